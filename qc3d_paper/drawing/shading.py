# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shaded pictures of triangle meshes: an orthographic camera and a depth buffer in numpy; needs no window."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Directions toward the camera by name; z is up and objects face -y, as in Blender.
VIEWS = {"front": (0.0, -1.0, 0.0), "side": (1.0, 0.0, 0.0), "three-quarter": (0.6, -0.75, 0.3)}

# Lights: direction (right, up, toward the camera) and strength. The key light comes from the upper left, the fill light
# from the right.
_LIGHTS = (((-0.5, 0.65, 0.6), 0.75), ((0.8, 0.1, 0.5), 0.22))
_AMBIENT = 0.2
_MOST_PIXELS = 100_000  # around triangles that are drawn at once
_BAND = 32  # rows of the picture that are drawn at once


@dataclass(frozen=True)
class Camera:
    """An orthographic camera that shows the same part of space in every picture.

    Parameters
    ----------
    axes : (3, 3)
        Unit vectors in rows: right, up, and toward the camera.
    low, high : (2,)
        Opposite corners of the visible rectangle, along right and up.
    """

    axes: Floats
    low: Floats
    high: Floats

    @classmethod
    def around(cls, shapes: Floats, view: str, margin: float = 0.04) -> Camera:
        """A camera in the view named, one of ``VIEWS``, that shows all shapes (k, n, 3)."""
        axes = _axes(np.array(VIEWS[view]))
        flat = shapes.reshape(-1, 3) @ axes[:2].T
        low, high = flat.min(axis=0), flat.max(axis=0)
        border = margin * np.max(high - low)
        return cls(axes, low - border, high + border)


def upright(points: Floats, up: str) -> Floats:
    """Points (..., 3) turned so that the axis ``up`` of x, y and z points along z, as pictures have it."""
    if up == "y":
        return np.asarray(points[..., [0, 2, 1]] * np.array([1.0, -1.0, 1.0]))
    return np.asarray(points[..., [1, 2, 0]]) if up == "x" else points


def best_view(key0: Floats, key1: Floats) -> str:
    """Name of the view in which the motion from one key to the other, both (n, 3), is largest."""
    motion = key1 - key0
    return max(VIEWS, key=lambda view: float(np.linalg.norm(motion @ _axes(np.array(VIEWS[view]))[:2].T)))


def draw(
    points: Floats,
    faces: Ints,
    camera: Camera,
    height: int,
    color: tuple[float, float, float] | Floats,
    background: tuple[float, float, float],
    samples: int = 3,
) -> Floats:
    """Draw one shape.

    Parameters
    ----------
    points : (n, 3)
        Vertex positions.
    faces : (m, 3) int64
        Triangles; their back sides are drawn darker.
    camera : Camera
    height : int
        Height of the picture in pixels; its width follows from the camera.
    color : (3,) or (m, 3)
        Red, green, blue in 0..1, for the shape or for each triangle.
    background : (3,)
        Red, green, blue in 0..1.
    samples : int
        Each pixel is the mean of ``samples`` x ``samples`` points.

    Returns
    -------
    (height, width, 3)
        The picture, with colors in 0..1, top row first.
    """
    fine = height * samples
    scale = fine / (camera.high[1] - camera.low[1])
    width = int(np.ceil(scale * (camera.high[0] - camera.low[0]) / samples)) * samples
    seen = points @ camera.axes.T
    spots = (seen[:, :2] - camera.low) * scale
    normals = _vertex_normals(points, faces) @ camera.axes.T

    paint = np.broadcast_to(np.array(color), (len(faces), 3))
    bands = []
    for low in range(0, height, _BAND):
        high = min(low + _BAND, height)
        # Only what may reach into the band; the rest of the triangles costs nothing there.
        inside = (spots[faces, 1].max(axis=1) >= low * samples) & (spots[faces, 1].min(axis=1) <= high * samples)
        nearest = _nearest(
            spots - [0.0, low * samples], seen[:, 2], faces[inside], (high - low) * samples, width
        )
        band = _shaded(nearest, faces[inside], normals, paint[inside], background)
        bands.append(band.reshape(high - low, samples, width // samples, samples, 3).mean(axis=(1, 3)))
    return np.asarray(np.concatenate(bands)[::-1])


def _shaded(
    nearest: _Nearest, faces: Ints, normals: Floats, paint: Floats, background: tuple[float, float, float]
) -> Floats:
    """(pixels, 3) the light that comes from what is nearest."""
    drawn = nearest.triangle >= 0
    triangle, weights = nearest.triangle[drawn], nearest.weights[drawn]
    normal = np.einsum("pk,pka->pa", weights, normals[faces[triangle]])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    front = normal[:, 2] >= 0.0
    light = _brightness(np.where(front[:, None], normal, -normal)) * np.where(front, 1.0, 0.6)
    picture = np.tile(background, (len(drawn), 1))
    picture[drawn] = np.clip(light[:, None] * paint[triangle], 0.0, 1.0)
    return picture


def _axes(towards: Floats) -> Floats:
    towards = towards / np.linalg.norm(towards)
    right = np.cross((0.0, 0.0, 1.0), towards)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(towards, right), towards])


def _vertex_normals(points: Floats, faces: Ints) -> Floats:
    """(n, 3) area-weighted vertex normals, not normalized."""
    corners = points[faces]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.stack(
        [np.bincount(faces.ravel(), weights=np.repeat(area[:, axis], 3), minlength=len(points)) for axis in range(3)],
        axis=1,
    )


class _Nearest(NamedTuple):
    """Of each pixel the triangle in front, -1 for none, and the weights of its corners."""

    triangle: Ints
    weights: Floats


def _nearest(spots: Floats, depths: Floats, faces: Ints, height: int, width: int) -> _Nearest:
    """What is seen in each pixel, row by row: of a few triangles at a time, so that memory does not grow with them."""
    found = _Nearest(np.full(height * width, -1, dtype=np.int64), np.zeros((height * width, 3)))
    front = np.full(height * width, -np.inf)
    spans = np.ptp(spots[faces], axis=1) + 1.0
    share = np.cumsum(spans.prod(axis=1)) // _MOST_PIXELS
    for first, last in pairwise([0, *(np.flatnonzero(np.diff(share)) + 1), len(faces)]):
        triangle, rows, columns, weights = _covered(spots, faces[first:last], height, width)
        triangle += first
        depth = np.einsum("pk,pk->p", weights, depths[faces[triangle]])
        pixel = rows * width + columns
        # The last write to a pixel stays, so the nearest goes last.
        order = np.argsort(depth, kind="stable")
        order = order[depth[order] >= front[pixel[order]]]
        front[pixel[order]], found.triangle[pixel[order]] = depth[order], triangle[order]
        found.weights[pixel[order]] = weights[order]
    return found


def _covered(spots: Floats, faces: Ints, height: int, width: int) -> tuple[Ints, Ints, Ints, Floats]:
    """For each pixel center covered by a triangle: the triangle, row, column, and barycentric weights (p, 3)."""
    corners = spots[faces]
    most = np.array([width, height]) - 1
    low = np.clip(np.ceil(corners.min(axis=1) - 0.5), 0, most).astype(np.int64)
    high = np.clip(np.floor(corners.max(axis=1) - 0.5), -1, most).astype(np.int64)
    size = np.maximum(high - low + 1, 0)
    count = size.prod(axis=1)
    triangle = np.repeat(np.arange(len(faces)), count)
    within = np.arange(len(triangle)) - np.repeat(np.cumsum(count) - count, count)
    columns = low[triangle, 0] + within % np.maximum(size[triangle, 0], 1)
    rows = low[triangle, 1] + within // np.maximum(size[triangle, 0], 1)

    first, second, third = (corners[triangle, corner] for corner in range(3))
    center = np.stack([columns, rows], axis=1) + 0.5
    double_area = _cross(second - first, third - first)
    flat = double_area == 0.0
    inverse = 1.0 / np.where(flat, 1.0, double_area)
    opposite = (
        _cross(third - second, center - second),
        _cross(first - third, center - third),
        _cross(second - first, center - first),
    )
    weights = np.stack(opposite, axis=1) * inverse[:, None]
    inside = (weights >= 0.0).all(axis=1) & ~flat
    return triangle[inside], rows[inside], columns[inside], weights[inside]


def _cross(first: Floats, second: Floats) -> Floats:
    return np.asarray(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])


def _brightness(normals: Floats) -> Floats:
    """(p,) brightness: diffuse light from both lights, ambient light, and slight darkening toward the outline."""
    light = np.full(len(normals), _AMBIENT)
    for direction, strength in _LIGHTS:
        unit = np.array(direction) / np.linalg.norm(direction)
        light += strength * np.maximum(normals @ unit, 0.0)
    return np.asarray(light * (0.8 + 0.2 * normals[:, 2]))
