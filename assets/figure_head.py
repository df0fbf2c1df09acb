# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo figure's head, in meters, facing -y: shapes, colors, and how the keys move them."""

from __future__ import annotations

import numpy as np
from clay import Floats, Ints, ball, cut, joined, rod, surface
from motions import rise, turned

EYE, EYE_RADIUS = np.array([0.2, -0.3, 0.14]), 0.185  # the left one; the right one is its mirror image
MIRROR = np.array([-1.0, 1.0, 1.0])
SKIN, BLUSH, LIP, MOUTH = (0.80, 0.42, 0.26), (0.78, 0.20, 0.14), (0.56, 0.11, 0.10), (0.12, 0.01, 0.02)
_GAP, _THICKNESS = 0.005, 0.02  # between eyeball and lid, and of a lid
_UPPER, _LOWER = np.radians((58.0, 105.0)), np.radians((-44.0, -105.0))  # elevations of a lid's margin and crease
_SHUT = np.radians((-20.0, -25.0))  # of the two margins when the eye is closed
JAW = np.radians(25.0)  # how far it opens
_HINGE = (0.0, 0.02, -0.1)  # of the jaw
_CORNER = 0.15  # half the width of the mouth


def head() -> tuple[Floats, Ints]:
    """Vertices and quads, mirrored at x = 0."""
    return surface(_field, (-0.6575, -0.62, -0.75), (0.6575, 0.52, 0.66), 0.0263)


def colors(points: Floats) -> Floats:
    """(n, 3) red, green, blue of the skin, linear."""
    x, y, z = np.abs(points[:, 0]), points[:, 1], points[:, 2]
    paint = np.tile(SKIN, (len(points), 1))
    for strength, center, radius in ((0.7, (0.31, -0.34, -0.13), 0.17), (0.6, (0.0, -0.55, -0.055), 0.12),
                                     (0.5, (0.5, 0.0, -0.02), 0.13)):  # fmt: skip
        near = np.linalg.norm(np.stack([x, y, z], axis=1) - center, axis=1)
        paint += (strength * (1.0 - rise(near, 0.2 * radius, radius)))[:, None] * (np.array(BLUSH) - paint)
    lips = (1.0 - rise(_lips(points), -0.004, 0.014)) * (1.0 - rise(y, -0.4, -0.3))
    paint += lips[:, None] * (np.array(LIP) - paint)
    inside = (1.0 - rise(_mouth(points), 0.002, 0.012)) * rise(y - _front(points), 0.0, 0.03)
    return np.asarray(paint + inside[:, None] * (np.array(MOUTH) - paint))


def jaw(points: Floats) -> Floats:
    """The mouth opened: chin and lower lip turn about the jaw's hinge, the cheeks follow."""
    x, y, z = np.abs(points[:, 0]), points[:, 1], points[:, 2]
    band = 0.012 + 0.2 * rise(x, 0.08, 0.26)
    weight = rise((_smile(points) - z) / band, -0.5, 0.5) * rise(-y, -0.05, 0.2) * (1.0 - rise(x, 0.3, 0.48))
    return turned(points, _HINGE, (1.0, 0.0, 0.0), JAW * weight)


def forehead_up(points: Floats) -> Floats:
    """The forehead's skin, and what lies on it, pushed up along the skull."""
    weight = rise(-points[:, 1], 0.1, 0.4) * rise(points[:, 2], 0.3, 0.38)
    return turned(points, (0.0, 0.0, 0.06), (1.0, 0.0, 0.0), -np.radians(8.0) * weight)


def lids(closed_left: float, closed_right: float) -> tuple[Floats, Ints, Floats]:
    """The four lids, each a thin shell over its eyeball: vertices, quads, and which vertices belong to margins.

    A lid turns about the axis through the corners of the eye, which is parallel to x; its crease does not move.
    """
    points, faces, edges = [], [], []
    for side, closed in ((1.0, closed_left), (-1.0, closed_right)):
        for (margin, crease), shut in ((_UPPER, _SHUT[0]), (_LOWER, _SHUT[1])):
            shell, quads, edge = _shell(margin + closed * (shut - margin), crease)
            inwards = (side < 0.0) != (crease < 0.0)
            faces.append((quads[:, ::-1] if inwards else quads) + sum(map(len, points)))
            points.append((shell + EYE) * [side, 1.0, 1.0])
            edges.append(edge)
    return np.concatenate(points), np.concatenate(faces), np.concatenate(edges)


def _shell(margin: float, crease: float) -> tuple[Floats, Ints, Floats]:
    """A lid of the left eye about the origin, as a closed surface: outside, round margin, inside."""
    rows, columns = 13, 21
    inner, middle = EYE_RADIUS + _GAP, EYE_RADIUS + _GAP + 0.5 * _THICKNESS
    fractions = np.linspace(1.0, 0.0, rows) ** 1.2  # from the crease to the margin, denser there
    round_ = np.linspace(0.5 * np.pi, -0.5 * np.pi, 9)[1:-1]
    radius = np.concatenate([np.full(rows, inner + _THICKNESS), middle + 0.5 * _THICKNESS * np.sin(round_),
                             np.full(rows, inner)])  # fmt: skip
    sideways = np.sign(crease) * 0.5 * _THICKNESS / middle * np.cos(round_)
    lid = margin + fractions * (crease - margin)
    elevation = np.concatenate([lid, margin - sideways, lid[::-1]])[:, None]
    across = np.radians(np.linspace(-83.0, 83.0, columns))[None]
    flat = radius[:, None] * np.cos(across)
    grid = np.stack([radius[:, None] * np.sin(across) + 0.0 * elevation, -flat * np.cos(elevation),
                     flat * np.sin(elevation)], axis=-1)  # fmt: skip
    ring, column = np.meshgrid(np.arange(len(radius)), np.arange(columns - 1), indexing="ij")
    after = (ring + 1) % len(radius)
    quads = np.stack([ring * columns + column, after * columns + column, after * columns + column + 1,
                      ring * columns + column + 1], axis=-1).reshape(-1, 4)  # fmt: skip
    edge = np.zeros((len(radius), columns))
    edge[rows - 1 : rows + 8] = 1.0
    return grid.reshape(-1, 3), quads, edge.ravel()


def brow() -> tuple[Floats, Ints]:
    """The left eyebrow."""
    bow = np.array([[0.085, -0.44, 0.385], [0.2, -0.435, 0.42], [0.315, -0.385, 0.385]])

    def field(points: Floats) -> Floats:
        inner = rod(points, bow[0], bow[1], 0.026, 0.032)
        return joined(inner, rod(points, bow[1], bow[2], 0.032, 0.02), 0.02)

    return surface(field, (0.02, -0.5, 0.33), (0.4, -0.3, 0.52), 0.016)


def hair() -> tuple[Floats, Ints]:
    """A cap of hair with a quiff."""

    def field(points: Floats) -> Floats:
        cap = ball(points, (0.0, 0.03, 0.07), (0.485, 0.465, 0.53))
        below = points[:, 2] - (0.5 - 0.8 * (points[:, 1] + 0.2))
        cap = -joined(-cap, 0.8 * below, 0.05)
        curl = ((-0.19, -0.01, 0.6), (-0.04, -0.17, 0.67), (0.12, -0.15, 0.75), (0.15, -0.02, 0.77))
        radii = (0.12, 0.115, 0.085, 0.04)
        for piece in range(3):
            cap = joined(cap, rod(points, *curl[piece : piece + 2], *radii[piece : piece + 2]), 0.06)
        return cap

    return surface(field, (-0.56, -0.5, -0.4), (0.56, 0.6, 0.94), 0.036)


def tongue() -> tuple[Floats, Ints]:
    """The tongue, which the jaw carries."""
    return surface(lambda points: ball(points, (0.0, -0.26, -0.315), (0.12, 0.16, 0.035)),
                   (-0.16, -0.46, -0.37), (0.16, -0.06, -0.26), 0.024)  # fmt: skip


def _field(points: Floats) -> Floats:
    mirrored = np.concatenate([np.abs(points[:, :1]), points[:, 1:]], axis=1)
    shape = ball(points, (0.0, 0.0, 0.06), (0.45, 0.44, 0.5))
    shape = joined(shape, ball(points, (0.0, -0.13, -0.3), (0.3, 0.28, 0.22)), 0.2)
    shape = joined(shape, ball(mirrored, (0.2, -0.2, -0.16), (0.22, 0.22, 0.2)), 0.12)
    shape = joined(shape, ball(mirrored, (0.27, -0.2, 0.14), (0.15, 0.17, 0.2)), 0.1)
    shape = joined(shape, ball(points, (0.0, -0.46, -0.06), (0.1, 0.11, 0.09)), 0.06)
    neck = rod(points, (0.0, 0.06, -0.3), (0.0, 0.08, -0.7), 0.19, 0.2)
    shape = joined(shape, np.maximum(neck, -0.66 - points[:, 2]), 0.08)
    ear = cut(ball(mirrored, (0.475, 0.03, -0.02), (0.08, 0.065, 0.125)),
              ball(mirrored, (0.54, -0.05, -0.02), (0.055, 0.06, 0.07)), 0.03)  # fmt: skip
    shape = joined(shape, ear, 0.04)
    shape = joined(shape, _lips(points), 0.045)
    return cut(shape, np.maximum(_mouth(points), points[:, 1] + 0.14), 0.015)


def _smile(points: Floats) -> Floats:
    """The height of the line between the lips."""
    return -0.265 + 1.2 * points[:, 0] ** 2


def _front(points: Floats) -> Floats:
    """The depth y of the line between the lips."""
    return -0.425 + 1.1 * points[:, 0] ** 2


def _mouth(points: Floats) -> Floats:
    """The distance to the opening of the mouth, seen from the front."""
    beside = np.maximum(np.abs(points[:, 0]) - _CORNER, 0.0)
    return np.hypot(beside, points[:, 2] - _smile(points)) - 0.024


def _lips(points: Floats) -> Floats:
    """The distance to a tube around the opening."""
    return np.hypot(_mouth(points) - 0.012, points[:, 1] - _front(points)) - 0.032
