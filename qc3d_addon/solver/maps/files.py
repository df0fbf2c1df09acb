# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Tetrahedral meshes with values on them, read without trusting them and written whole or not at all.

Files of the ending .npz hold the arrays ``points`` (N, 3) and ``tets`` (M, 4), and any others: of N rows for the
vertices, of M rows for the tetrahedra. All other endings (.vtu, .vtk, .msh, .mesh, ...) go through meshio.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files.atomic import replacing
from ..files.npz import open_archive, read_array, require_file, write_arrays
from ..tets.mesh import TetMesh
from .mapping import Mapping, checked_mesh

Arrays = dict[str, NDArray[Any]]

# Names of the arrays that the commands write and read.
TARGET = "target"  # images of the vertices
STRETCH = "stretch"  # representation, first form
EIGEN_FORM = "eigen_form"  # representation, second form
# Gmsh's own numbering of a model's parts, which is of no use without the model.
_TAGS = "gmsh:"
# Formats of meshio that hold nothing but the mesh itself.
_BARE = {".mesh", ".meshb", ".stl", ".off", ".obj"}


@dataclass(frozen=True, eq=False)
class TetFile:
    """What a file of tetrahedra holds.

    Parameters
    ----------
    points : (N, 3)
    tets : (M, 4)
    at_vertices : dict
        Arrays of N rows by name.
    at_tets : dict
        Arrays of M rows by name.
    """

    points: NDArray[Any]
    tets: NDArray[Any]
    at_vertices: Arrays = field(default_factory=dict)
    at_tets: Arrays = field(default_factory=dict)

    def mesh(self) -> TetMesh:
        """The mesh by itself; raises InputError where it is none."""
        return checked_mesh(self.points, self.tets)

    def mapping(self, target: TetFile | None = None) -> Mapping:
        """The map onto the vertices of another file, or onto the array ``target`` of this one.

        Raises
        ------
        InputError
            If there is no such array, or the other file has other tetrahedra.
        """
        if target is None:
            if TARGET not in self.at_vertices:
                raise InputError(f"The mesh has no array '{TARGET}' (N, 3) of its vertices' images; name another file.")
            return Mapping.checked(self.points, self.tets, self.at_vertices[TARGET])
        if not np.array_equal(self.tets, target.tets):
            raise InputError("The two files have different tetrahedra; a map needs the same ones in the same order.")
        return Mapping.checked(self.points, self.tets, target.points)


def read_tets(path: Path) -> TetFile:
    """Read a tetrahedral mesh and the values on it.

    Raises
    ------
    InputError
        If the file cannot be read, or holds no tetrahedra.
    """
    if path.suffix.lower() == ".npz":
        with open_archive(path, "points and tets are needed") as archive:
            arrays: Arrays = {name: read_array(archive, name, path) for name in archive.files}
        for name in ("points", "tets"):
            if name not in arrays:
                raise InputError(f"{path} has no array {name}; it has {', '.join(arrays) or 'none'}.")
        points, tets = arrays.pop("points"), arrays.pop("tets")
        rows = {name: len(values) if values.ndim else -1 for name, values in arrays.items()}
        at_vertices = {name: values for name, values in arrays.items() if rows[name] == len(points)}
        # Where there are as many vertices as tetrahedra, an array may be either.
        at_tets = {name: values for name, values in arrays.items() if rows[name] == len(tets)}
        return TetFile(points, tets, at_vertices, at_tets)
    require_file(path)
    with _meshio_errors(path, "read"):
        found = _meshio().read(path, _format(path))
    blocks = [number for number, block in enumerate(found.cells) if block.type == "tetra"]
    if not blocks:
        raise InputError(f"{path} holds no tetrahedra; it has {', '.join(b.type for b in found.cells) or 'no cells'}.")
    tets = np.concatenate([found.cells[number].data for number in blocks])
    at_tets = {
        name: np.concatenate([_unpadded(values[number]) for number in blocks])
        for name, values in found.cell_data.items()
        if not name.startswith(_TAGS)
    }
    at_vertices = {name: values for name, values in found.point_data.items() if not name.startswith(_TAGS)}
    return TetFile(found.points, tets, at_vertices, at_tets)


def write_tets(path: Path, content: TetFile) -> None:
    """Write a mesh with its values, whole or not at all; the format follows the ending.

    Formats without values, such as .mesh, get the mesh with its vertices at their images.

    Raises
    ------
    InputError
        If the file cannot be written, or the ending is unknown.
    """
    with replacing(path) as unfinished:
        put_tets(unfinished, content, path)


def put_tets(new: Path, content: TetFile, path: Path) -> None:
    """As ``write_tets``, straight into the file ``new``, which errors call ``path``.

    Raises
    ------
    InputError
        If the ending is unknown, or the format has no room for such values.
    OSError
        If the file cannot be written.
    """
    if path.suffix.lower() == ".npz":
        mesh = {"points": content.points, "tets": content.tets}
        write_arrays(new, {**mesh, **content.at_vertices, **content.at_tets})
        return
    meshio = _meshio()
    if path.suffix.lower() in _BARE:
        found = meshio.Mesh(content.at_vertices.get(TARGET, content.points), [("tetra", content.tets)])
    else:
        pad = _padded if _format(path) == "gmsh" else np.asarray
        at_tets = {name: [pad(values)] for name, values in content.at_tets.items()}
        found = meshio.Mesh(content.points, [("tetra", content.tets)], content.at_vertices, at_tets)
    with _meshio_errors(path, "written"):
        found.write(new, _format(path))


def _format(path: Path) -> str | None:
    """Two programs use the ending .msh, and meshio would take it for the other one's."""
    return "gmsh" if path.suffix.lower() == ".msh" else None


def _padded(values: NDArray[Any]) -> NDArray[Any]:
    """Gmsh has room for 1, 3 or 9 numbers in a place: six get three zeros behind them."""
    return np.pad(values, ((0, 0), (0, 3))) if values.ndim == 2 and values.shape[1] == 6 else values


def _unpadded(values: NDArray[Any]) -> NDArray[Any]:
    is_padded = values.ndim == 2 and values.shape[1] == 9 and not values[:, 6:].any()
    return values[:, :6] if is_padded else values


def _meshio() -> Any:  # noqa: ANN401 - a module
    try:
        import meshio
    except ImportError as error:
        raise InputError(
            "Files other than .npz are read and written by meshio, which is not installed; pip install 'qc3d[meshes]'."
        ) from error
    return meshio


@contextmanager
def _meshio_errors(path: Path, done: str) -> Iterator[None]:
    """One sentence for whatever a damaged file makes meshio do, which may be any error, or to leave the program."""
    said = StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said):
            yield
    except (Exception, SystemExit) as error:
        if isinstance(error, OSError) and done == "written":
            raise
        reason = " ".join(str(error).split()) if not isinstance(error, SystemExit) else "not a format meshio knows"
        remedy = "export it again, or name another file" if done == "read" else "choose another format or place"
        reason = reason.rstrip(".") or type(error).__name__
        raise InputError(f"{path} cannot be {done}: {reason}; {remedy}.") from error
