# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The engine ``tetwild``: fTetWild (Hu et al. 2020, *Fast tetrahedral meshing in the wild*) in a child process."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from ..arrays import Floats, Ints
from ..errors import MeshingError, with_remedy
from ..files.private_folders import PrivateFolder, temporary_place
from ..numerics.grouped_sums import means_by_label
from ..support.guarded_program import Ending, Guardian
from ..tets.mesh import TetMesh
from .poisson_disk import RESOLUTIONS, Resolution, sample_cube, sample_surface
from .slivers import triangulate
from .tetwild_loading import load_command, unavailable_reason

MARGIN = 0.14  # the surface keeps this far from the cube's faces; also the longest edge that fTetWild aims at

_EDGE_FACTOR = 1.6  # fTetWild's ideal edges per distance between Poisson-disk samples, for equally fine meshes


def tetwild_mesh(points: Floats, faces: Ints, resolution: Resolution, seed: int, time_limit: float) -> TetMesh:
    """Fill the cube. Not deterministic: fTetWild makes a different mesh at every call.

    Parameters
    ----------
    points : (n, 3) float64
        Vertices inside [0.14, 0.86]³.
    faces : (m, 3) int64
        Triangles in any state.
    resolution : Resolution
        Target distances between vertices.
    seed : int
        Seed of the samples that carry the size field.
    time_limit : float
        Seconds after which the child process is killed.

    Raises
    ------
    MeshingError
        If fTetWild is unavailable, has no usable triangle, fails, crashes or exceeds the time limit.
    """
    vertices, triangles = cluster(points, faces, 0.75 * resolution.spacing)
    if not len(triangles):
        raise MeshingError("The meshing engine tetwild needs triangles, and the mesh has none that it could use.")
    rng = np.random.default_rng(seed)
    coarse = RESOLUTIONS["normal"]
    surface = sample_surface(points, faces, coarse.spacing, rng)
    samples = sample_cube(surface, coarse.around(surface), rng)
    background = TetMesh(samples, triangulate(samples))
    # fTetWild fills the bounding box of its vertices, grown by the edge length on every side. Two extra vertices that
    # no triangle uses make this box exactly the unit cube.
    inner = np.array([[MARGIN] * 3, [1.0 - MARGIN] * 3])
    diagonal = float(np.linalg.norm(inner[1] - inner[0]))
    arrays = {
        "points": np.concatenate([vertices, inner]),
        "faces": triangles,
        "edge_length": np.array(MARGIN),
        "epsilon": np.array(0.7 * resolution.spacing / diagonal),
        "size_points": samples,
        "size_tets": background.tets[background.volumes > 1e-10],  # interpolation in flat ones would fail
        "size_values": _EDGE_FACTOR * resolution.around(surface)(samples),
    }
    positions, tets = run_child(arrays, time_limit)
    for exact in (0.0, 1.0):
        positions[np.abs(positions - exact) < 1e-9] = exact
    # The two extra vertices come back without tetrahedra, and would make every linear system on the mesh singular.
    used, corners = np.unique(tets, return_inverse=True)
    return TetMesh(positions[used], corners.reshape(-1, 4).astype(np.int64))


def cluster(points: Floats, faces: Ints, cell: float) -> tuple[Floats, Ints]:
    """Coarsen a triangle mesh by vertex clustering: all vertices in a cell of a regular grid become one.

    The running time of fTetWild depends on the surface it is given, and the volume is coarser than the surface anyway.

    Parameters
    ----------
    points : (n, 3) float64
        Vertices.
    faces : (m, 3) int64
        Triangles.
    cell : float
        Edge length of the grid's cells, in the units of the points.

    Returns
    -------
    vertices : (k, 3) float64
        Mean of the vertices of each cell that is in use.
    triangles : (l, 3) int64
        Distinct triangles with three distinct corners; collapsed ones are dropped.
    """
    used, corners = np.unique(faces, return_inverse=True)
    _, cell_of = np.unique(np.floor(points[used] / cell).astype(np.int64), axis=0, return_inverse=True)
    cell_of = cell_of.reshape(-1)
    means = means_by_label(cell_of, points[used])
    merged = np.sort(cell_of[corners.reshape(-1, 3)], axis=1)
    merged = merged[(merged[:, 0] != merged[:, 1]) & (merged[:, 1] != merged[:, 2])]
    kept, triangles = np.unique(np.unique(merged, axis=0), return_inverse=True)
    return means[kept], triangles.reshape(-1, 3)


def run_child(arrays: dict[str, Floats | Ints], time_limit: float) -> tuple[Floats, Ints]:
    """Run the child process on ``arrays``; return vertices (N, 3) and tetrahedra (M, 4).

    Raises
    ------
    MeshingError
        If fTetWild is unavailable, or if the child fails in any way.
    """
    reason = unavailable_reason()
    if reason is not None:
        raise MeshingError(f"The meshing engine tetwild cannot run here: {reason}.")
    try:
        with PrivateFolder() as folder, Guardian(folder) as guardian:
            for key, array in arrays.items():
                np.save(folder / f"{key}.npy", array, allow_pickle=False)
            ending = guardian.run([*load_command(), str(folder), str(time_limit)], time_limit)
            _require_success(ending, folder / "output.npz", time_limit)
            with np.load(folder / "output.npz", allow_pickle=False) as archive:
                return archive["points"].astype(np.float64), archive["tets"].astype(np.int64)
    except (ValueError, KeyError, zipfile.BadZipFile) as error:
        raise MeshingError(f"The result of the meshing engine tetwild cannot be read: {error}") from error
    except OSError as error:
        raise MeshingError(
            f"The meshing engine tetwild cannot work with temporary files in {temporary_place()}: "
            f"{with_remedy(error)}."
        ) from error


def _require_success(ending: Ending, output: Path, time_limit: float) -> None:
    if ending.status is None:
        raise MeshingError(
            f"The meshing engine tetwild was stopped after its time limit of {time_limit:g} s; "
            "raise the limit, or choose a lower quality or the engine delaunay."
        )
    if ending.status != 0 or not output.exists():
        how = f" with an error: {ending.words}." if ending.words else f" without a mesh (exit status {ending.status})."
        raise MeshingError(f"The meshing engine tetwild ended{how}")
