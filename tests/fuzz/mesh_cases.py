# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Absurd meshes with two or three keys, and what must hold for every bake."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, get_args

import numpy as np

from qc3d_addon.solver.collision.colliders import Collider
from qc3d_addon.solver.frames.bake import Bake
from qc3d_addon.solver.frames.task import Outcome, Task, carry_out
from qc3d_addon.solver.meshing.poisson_disk import RESOLUTIONS, Resolution
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.settings import Easing, FitOptions, FrameOptions, Mode, StretchLaw
from qc3d_addon.solver.support.progress import finish

from ..solver.meshes import box_surface, icosphere, twisted

Random = np.random.Generator
Array = np.ndarray[Any, Any]

NO_FACES = np.empty((0, 3), dtype=np.int64)
NO_EDGES = np.empty((0, 2), dtype=np.int64)


@dataclass
class Mesh:
    """Shapes (n, 3) of one mesh, its triangles and loose edges, and how it came about."""

    shapes: list[Any]
    faces: Any
    edges: Any
    story: list[str]


def make(random: Random) -> tuple[Mesh, FitOptions, FrameOptions, Any, Collider | None]:
    """One case: the mesh, the choices, the times of the frames and what they must not touch."""
    name, base = _pick(random, _BASES)
    points, faces = base(random)
    mesh = Mesh([points], faces, NO_EDGES, [name])
    for _ in range(1 + (random.random() < 0.15)):
        name, deform = _pick(random, _KEYS)
        mesh.story.append(f"to {name}")
        mesh.shapes.append(deform(mesh.shapes[-1], random) if len(points) else points.copy())
    for _ in range(random.choice(4, p=[0.4, 0.35, 0.15, 0.1])):
        name, spoil = _pick(random, _SPOILERS)
        mesh.story.append(name)
        spoil(mesh, random)
    if random.random() < 0.06:
        name, spoil = _pick(random, _LAST_SPOILERS)
        mesh.story.append(name)
        spoil(mesh, random)
    frame_options = FrameOptions(_one_of(random, get_args(Mode)), _one_of(random, get_args(Easing)))
    fit_options = FitOptions(
        stretch=_one_of(random, get_args(StretchLaw)),
        extra_turns=int(random.choice([0, 0, 0, 0, 1, -3, 100])),
        engine="tetwild" if random.random() < 0.05 else "delaunay",
        quality="normal",
        seed=int(random.integers(2**31)),
        mesh_time_limit=10.0,
    )
    times = _one_of(random, _TIMES)
    collider = None
    if random.random() < 0.1 and len(points):
        ball, ball_faces = icosphere(1, radius=10.0 ** random.uniform(-3, 1))
        collider = Collider.checked(np.stack([ball] * len(mesh.shapes)), ball_faces)
        mesh.story.append("a ball in the way")
    mesh.story.append(f"{fit_options} {frame_options} {times}")
    return mesh, fit_options, frame_options, np.array(times), collider


def run(
    mesh: Mesh, fit_options: FitOptions, frame_options: FrameOptions, times: Array, collider: Collider | None
) -> str:
    """Bake a case; what came of it in a word. Raises what the solver raises, and AssertionError of unsound results."""
    names = [f"key {number}" for number in range(len(mesh.shapes))]
    shapes = dict(zip(names, mesh.shapes, strict=True))
    task = Task.of_keys(shapes, mesh.faces, mesh.edges, names, fit_options, frame_options, times, collider)
    outcome = finish(carry_out(task))
    if outcome.bake is None:
        return "a map"
    _require_sound(outcome, task)
    return "frames"


def coarser() -> None:
    """Make quality ``normal`` ten times as fast."""
    RESOLUTIONS["normal"] = Resolution(spacing=0.07, slope=0.4, largest=0.2)


def _require_sound(outcome: Outcome, task: Task) -> None:
    bake, pairs = outcome.bake, list(task.pairs.values())
    assert isinstance(bake, Bake)
    assert bake.frames.shape == (len(task.times), *pairs[0].own.key0.shape), "frames of another shape"
    assert np.isfinite(bake.frames).all(), "positions that are not finite"
    along = [task.pairs[ends] for ends in pairwise(task.through)]
    for time, frame in zip(task.times, bake.frames, strict=True):
        if time == 0.0:
            assert np.array_equal(frame, along[0].own.key0), "the first key is missed"
        if time == 1.0:
            assert np.array_equal(frame, along[-1].own.key1), "the last key is missed"
    for values in bake.measures.values():
        assert np.isfinite(values).all(), "measures that are not finite"
    json.dumps(bake.report.as_json(), allow_nan=False)
    assert all(str(note).endswith(".") for note in bake.report.notes), "a note that is no sentence"
    assert bake.report.folds.map == (0 if task.needs_fits else None), "a fitted map with folds"
    if task.frame_options.mode == "natural":
        assert not any(bake.report.folds.frames), "frames with folds"


def _pick(random: Random, choices: dict[str, Any]) -> tuple[str, Any]:
    name = _one_of(random, list(choices))
    return name, choices[name]


def _one_of(random: Random, choices: Any) -> Any:  # noqa: ANN401 - an item of whatever it is
    return choices[int(random.integers(len(choices)))]


def _bar(random: Random) -> tuple[Array, Array]:
    cells = tuple(int(number) for number in random.integers(1, 4, 3))
    return box_surface((cells[0], cells[1], 2 * cells[2]), (1.0, 1.0, 4.0))


def _ball(random: Random) -> tuple[Array, Array]:
    return icosphere(int(random.integers(0, 3)), radius=1.0)


def _open(random: Random) -> tuple[Array, Array]:
    points, faces = _bar(random)
    return points, faces[random.random(len(faces)) < random.uniform(0.2, 1.0)]


def _sheet(random: Random) -> tuple[Array, Array]:
    points, faces = box_surface((4, 4, 1), (2.0, 2.0, 0.0))
    bump = random.choice([0.0, 1e-12, 1e-6, 1e-2, 1.0]) * random.normal(size=len(points))
    return points + bump[:, None] * [0.0, 0.0, 1.0], faces


def _parts(random: Random) -> tuple[Array, Array]:
    points, faces = icosphere(0, 0.3) if random.random() < 0.5 else (random.normal(size=(3, 3)), np.array([[0, 1, 2]]))
    count = int(random.choice([2, 5, 30, 150, 1500], p=[0.3, 0.3, 0.2, 0.18, 0.02]))
    places = random.uniform(-5.0, 5.0, size=(count, 1, 3))
    all_faces = faces + len(points) * np.arange(count)[:, None, None]
    return (points + places).reshape(-1, 3), all_faces.reshape(-1, 3)


def _soup(random: Random) -> tuple[Array, Array]:
    count = int(random.integers(4, 60))
    return random.normal(size=(count, 3)), random.integers(0, count, size=(int(random.integers(0, 80)), 3))


def _cloud(random: Random) -> tuple[Array, Array]:
    return random.normal(size=(int(random.integers(0, 40)), 3)), NO_FACES


def _line(random: Random) -> tuple[Array, Array]:
    count = int(random.integers(2, 20))
    return np.outer(np.arange(count), random.normal(size=3)), np.array([[0, 1, count - 1]])


def _few(random: Random) -> tuple[Array, Array]:
    count = int(random.integers(0, 6))
    return random.normal(size=(count, 3)), NO_FACES if count < 3 else np.array([[0, 1, 2]])


_BASES: dict[str, Callable[[Random], tuple[Array, Array]]] = {
    "a bar": _bar,
    "a ball": _ball,
    "a mesh with holes": _open,
    "a sheet": _sheet,
    "parts": _parts,
    "a soup": _soup,
    "a cloud": _cloud,
    "a line": _line,
    "few vertices": _few,
}


def _turned(points: Array, random: Random) -> Array:
    turn = rotation_matrices(random.normal(scale=2.0, size=(1, 3)))[0]
    return points @ turn.T + random.normal(size=3) * 10.0 ** random.uniform(-3, 5)


def _twisted(points: Array, random: Random) -> Array:
    if np.ptp(points[:, 2]) == 0.0:
        return points.copy()
    return twisted(points, float(random.uniform(-7.0, 7.0)))


def _half_moved(points: Array, random: Random) -> Array:
    chosen = points[:, 2:] > np.median(points[:, 2])
    return np.where(chosen, points + random.normal(scale=0.5, size=3), points)


def _half_collapsed(points: Array, random: Random) -> Array:
    return np.where(points[:, 2:] > np.median(points[:, 2]), points.mean(axis=0), points)


def _stretched(points: Array, random: Random) -> Array:
    return points * 10.0 ** random.uniform(-3, 3, size=3)


_KEYS: dict[str, Callable[[Array, Random], Array]] = {
    "the same": lambda points, random: points.copy(),
    "turned and moved": _turned,
    "twisted": _twisted,
    "a half moved": _half_moved,
    "shaken": lambda points, random: points + random.normal(scale=10.0 ** random.uniform(-8, 0), size=points.shape),
    "stretched": _stretched,
    "other units": lambda points, random: points * 10.0 ** random.uniform(-14, 14),
    "mirrored": lambda points, random: points * [-1.0, 1.0, 1.0] + random.normal(size=3),
    "inside out": lambda points, random: -points * 10.0 ** random.uniform(-2, 2),
    "a point": lambda points, random: np.repeat(points[:1], len(points), axis=0),
    "nearly a point": lambda points, random: points[0] + 10.0 ** random.uniform(-18, -2) * (points - points[0]),
    "a line": lambda points, random: points * [1.0, 0.0, 0.0],
    "a plane": lambda points, random: points * [1.0, 0.0, 1.0],
    "nearly a plane": lambda points, random: points * [1.0, 10.0 ** random.uniform(-12, -1), 1.0],
    "a half collapsed": _half_collapsed,
    "shuffled": lambda points, random: random.permutation(points),
    "anything": lambda points, random: random.normal(size=points.shape),
}


def _scaled(mesh: Mesh, random: Random) -> None:
    factor = 10.0 ** _one_of(random, [-300, -160, -76, -75, -74, -38, -30, -6, 6, 30, 38, 74, 75, 76, 160, 300])
    with np.errstate(all="ignore"):
        mesh.shapes = [shape * factor for shape in mesh.shapes]


def _not_finite(mesh: Mesh, random: Random) -> None:
    shape = mesh.shapes[int(random.integers(len(mesh.shapes)))]
    if shape.size:
        places = random.integers(shape.size, size=int(random.choice([1, 1, 5, shape.size])))
        shape.reshape(-1)[places] = _one_of(random, [np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324])


def _doubled(mesh: Mesh, random: Random) -> None:
    count = len(mesh.shapes[0])
    chosen = random.integers(0, max(count, 1), size=count // 2)
    mesh.shapes = [np.concatenate([shape, shape[chosen]]) for shape in mesh.shapes]
    faces = mesh.faces.copy()
    swap = random.random(faces.shape) < 0.3
    renamed = np.arange(count)
    renamed[chosen] = count + np.arange(len(chosen))
    mesh.faces = np.where(swap & (faces >= 0) & (faces < count), renamed[np.clip(faces, 0, max(count - 1, 0))], faces)


def _reversed_faces(mesh: Mesh, random: Random) -> None:
    mesh.faces = np.where(random.random((len(mesh.faces), 1)) < 0.5, mesh.faces[:, ::-1], mesh.faces)


def _repeated_faces(mesh: Mesh, random: Random) -> None:
    mesh.faces = np.concatenate([mesh.faces, mesh.faces[random.random(len(mesh.faces)) < 0.5]])


def _flat_faces(mesh: Mesh, random: Random) -> None:
    faces = mesh.faces.copy()
    chosen = random.random(len(faces)) < 0.3
    faces[chosen, 1] = faces[chosen, 0]
    mesh.faces = faces


def _fins(mesh: Mesh, random: Random) -> None:
    count = len(mesh.shapes[0])
    if count and len(mesh.faces):
        tips = random.normal(size=(3, 3))
        mesh.shapes = [np.concatenate([shape, shape[:1] + tips]) for shape in mesh.shapes]
        fins = np.column_stack([mesh.faces[random.integers(len(mesh.faces), size=3), :2], count + np.arange(3)])
        mesh.faces = np.concatenate([mesh.faces, fins])


def _wires(mesh: Mesh, random: Random) -> None:
    count = len(mesh.shapes[0])
    mesh.edges = random.integers(0, max(count, 1), size=(int(random.integers(1, 20)), 2))


def _loose(mesh: Mesh, random: Random) -> None:
    extra = random.normal(size=(int(random.integers(1, 20)), 3)) * 10.0 ** random.uniform(-2, 3)
    mesh.shapes = [np.concatenate([shape, extra]) for shape in mesh.shapes]


def _wrong_corners(mesh: Mesh, random: Random) -> None:
    if mesh.faces.size:
        mesh.faces = mesh.faces.astype(np.int64)
        mesh.faces.reshape(-1)[int(random.integers(mesh.faces.size))] = _one_of(random, [-1, 10**6, 2**40, -(2**62)])


def _other_kinds(mesh: Mesh, random: Random) -> None:
    kinds = ["f4", "f2", "i4", "u1", "c16", "O", "U8", "?", ">f8", "M8[s]"]
    with np.errstate(all="ignore"):
        if random.random() < 0.5:
            number = int(random.integers(len(mesh.shapes)))
            mesh.shapes[number] = _as_kind(mesh.shapes[number], _one_of(random, kinds))
        else:
            mesh.faces = _as_kind(mesh.faces, _one_of(random, [*kinds, "u8", "i1"]))


def _as_kind(values: Array, kind: str) -> Any:  # noqa: ANN401 - an array of whatever kind
    if kind.startswith("M"):
        return np.zeros(values.shape, dtype=kind)
    return values.real.astype(np.int64).astype(kind) if kind in "i1 u1 i4 u8 ?" else values.astype(kind)


def _other_shapes(mesh: Mesh, random: Random) -> None:
    number = int(random.integers(len(mesh.shapes)))
    shape = mesh.shapes[number]
    odd = [shape[:-1], shape[:, :2], shape.reshape(-1), shape[None], shape.tolist(), None, [], [[1, 2, 3], [1]], 7]
    mesh.shapes[number] = _one_of(random, odd)


def _other_face_shapes(mesh: Mesh, random: Random) -> None:
    faces = mesh.faces
    mesh.faces = _one_of(
        random, [faces[:, :2], faces.reshape(-1), faces[None], faces.tolist(), [], None, [[0, 1, 2], [1]], "faces"]
    )


_SPOILERS: dict[str, Callable[[Mesh, Random], None]] = {
    "scaled": _scaled,
    "numbers that are none": _not_finite,
    "doubled vertices": _doubled,
    "reversed faces": _reversed_faces,
    "repeated faces": _repeated_faces,
    "flat faces": _flat_faces,
    "fins": _fins,
    "wires": _wires,
    "loose vertices": _loose,
    "corners that are none": _wrong_corners,
}
# After which the arrays may be no arrays any more.
_LAST_SPOILERS: dict[str, Callable[[Mesh, Random], None]] = {
    "arrays of other kinds": _other_kinds,
    "arrays of other shapes": _other_shapes,
    "faces of other shapes": _other_face_shapes,
}
_TIMES: list[list[Any]] = [
    [0.0, 0.5, 1.0],
    [0.0, 0.4],
    [1.0, 0.9, 0.0],
    [0.0, 0.5, 1.0],
    [0.0, 0.5, 1.0],
    [0.0, 0.25, 0.5, 0.75, 1.0],
    [0.5],
    [1.0, 0.3, 0.3, 0.0],
    [],
    [1e-300, 1.0 - 1e-16],
    [-0.1, 0.5],
    [float("nan")],
    [0.5, 2.0],
]
