# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of tetrahedral meshes with data on them.

An .npz file contains the arrays ``points`` (N, 3) and ``tets`` (M, 4), and any others: arrays with N rows belong to the
vertices, arrays with M rows to the tetrahedra. Other formats (.vtu, .vtk, .msh, .mesh, ...) are read and written by
meshio. Files are not trusted when they are read, and written completely or not at all.
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

from ..errors import InputError, with_remedy
from ..files.atomic import replacing
from ..files.npz import open_archive, require_file, write_arrays
from ..files.private_folders import PrivateFolder
from ..support.memory import require_memory_for_tets
from ..tets.mesh import TetMesh
from .mapping import Mapping, checked_mesh

Arrays = dict[str, NDArray[Any]]

# Names of the arrays that the commands write and read.
TARGET = "target"  # images of the vertices
STRETCH = "stretch"  # representation, first form
EIGEN_FORM = "eigen_form"  # representation, second form
# Prefix of Gmsh's tags for the entities of a model, which have no meaning without the model.
_TAGS = "gmsh:"
# Formats of meshio that cannot store data on the mesh.
_BARE = {".mesh", ".meshb"}
_OTHERS = "choose .npz, .vtu, .vtk, .msh or .mesh"
# Cells without a volume, by the beginning of meshio's names; files often have them for the boundary.
_FLAT_CELLS = ("vertex", "line", "triangle", "quad", "polygon", "VTK_LAGRANGE_CURVE")


@dataclass(frozen=True, eq=False)
class TetFile:
    """The contents of a file with a tetrahedral mesh.

    Parameters
    ----------
    points : (N, 3)
    tets : (M, 4)
    at_vertices : dict
        Arrays with N rows, by name.
    at_tets : dict
        Arrays with M rows, by name.
    misfits : dict
        Shapes of arrays with another number of rows, by name.
    notes : tuple of str
        Sentences for the user about what of the file was left out.
    """

    points: NDArray[Any]
    tets: NDArray[Any]
    at_vertices: Arrays = field(default_factory=dict)
    at_tets: Arrays = field(default_factory=dict)
    misfits: dict[str, tuple[int, ...]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def of_vertices(self, name: str) -> NDArray[Any]:
        """The array with N rows of this name; raises InputError, saying what there is, where there is none."""
        return self._of(name, self.at_vertices, self.at_tets, f"its {len(self.points)} vertices")

    def of_tets(self, name: str) -> NDArray[Any]:
        """The array with M rows of this name; raises InputError, saying what there is, where there is none."""
        return self._of(name, self.at_tets, self.at_vertices, f"its {len(self.tets)} tetrahedra")

    def _of(self, name: str, known: Arrays, others: Arrays, owners: str) -> NDArray[Any]:
        if name in known:
            return known[name]
        if name in others or name in self.misfits:
            shape = others[name].shape if name in others else self.misfits[name]
            raise InputError(f"The array '{name}' has the shape {shape}; the mesh needs a row for each of {owners}.")
        raise InputError(f"The mesh has no array '{name}' of {owners}; it has {', '.join(known) or 'none'}.")

    def mesh(self) -> TetMesh:
        """The mesh, validated; raises InputError if the arrays are not a valid mesh."""
        return checked_mesh(self.points, self.tets)

    def mapping(self, target: TetFile | None = None) -> Mapping:
        """The map to the vertices of another file, or to the array ``target`` of this file.

        Raises
        ------
        InputError
            If there is no such array, or if the other file has different tetrahedra.
        """
        if target is None:
            return Mapping.checked(self.points, self.tets, self.of_vertices(TARGET))
        if not np.array_equal(self.tets, target.tets):
            raise InputError("The two files have different tetrahedra; a map needs the same ones in the same order.")
        return Mapping.checked(self.points, self.tets, target.points)


def read_tets(path: Path) -> TetFile:
    """Read a tetrahedral mesh and the data on it.

    Raises
    ------
    InputError
        If the file cannot be read, contains no tetrahedra, or contains other cells that have a volume.
    """
    if path.suffix.lower() == ".npz":
        with open_archive(path, "points and tets are needed") as archive:
            headers = archive.headers(["points", "tets", *archive.names])
            held = sum(header.held for header in headers.values())
            require_memory_for_tets(headers["points"].rows, headers["tets"].rows, held)
            arrays: Arrays = archive.read(headers)
        points, tets = arrays.pop("points"), arrays.pop("tets")
        rows = {name: len(values) if values.ndim else -1 for name, values in arrays.items()}
        at_vertices = {name: values for name, values in arrays.items() if rows[name] == len(points)}
        # With as many vertices as tetrahedra, an array may belong to either, and is listed for both.
        at_tets = {name: values for name, values in arrays.items() if rows[name] == len(tets)}
        misfits = {n: values.shape for n, values in arrays.items() if n not in at_vertices and n not in at_tets}
        return TetFile(points, tets, at_vertices, at_tets, misfits, _misfits_note(misfits))
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
    return TetFile(found.points, tets, at_vertices, at_tets, notes=_cells_note(path, found.cells))


def _misfits_note(misfits: dict[str, tuple[int, ...]]) -> tuple[str, ...]:
    if not misfits:
        return ()
    shapes = ", ".join(f"{name} {shape}" for name, shape in misfits.items())
    return (f"Left out, since they have neither a row for each vertex nor one for each tetrahedron: {shapes}.",)


def _cells_note(path: Path, cells: list[Any]) -> tuple[str, ...]:
    """What is left out beside the tetrahedra; raises InputError where it is a part of the volume."""
    counts: dict[str, int] = {}
    for block in cells:
        if block.type != "tetra":
            counts[block.type] = counts.get(block.type, 0) + len(block.data)
    solid = ", ".join(f"{count} {name}" for name, count in counts.items() if not name.startswith(_FLAT_CELLS))
    if solid:
        raise InputError(
            f"{path} has cells beside its tetrahedra ({solid}), without which there would be holes; split them into "
            "linear tetrahedra first."
        )
    left = ", ".join(f"{count} {name}" for name, count in counts.items())
    return (f"Left out, since they have no volume: cells of the types {left}.",) if left else ()


def write_tets(path: Path, content: TetFile) -> None:
    """Write a mesh with its data, completely or not at all; the suffix decides the format.

    Formats that cannot store data, such as .mesh, get the mesh with its vertices at their images.

    Raises
    ------
    InputError
        If the file cannot be written, the suffix is unknown, or the format cannot store tetrahedra.
    """
    require_format(path)
    with replacing(path) as unfinished:
        put_tets(unfinished, content, path)


def require_format(path: Path) -> None:
    """Check, before any work, that the format of an ending holds tetrahedra and their values.

    Raises
    ------
    InputError
        If it does not, or no such format is known.
    """
    if path.suffix.lower() == ".npz" or path.suffix.lower() in _BARE:
        return
    corners = np.concatenate([np.zeros((1, 3)), np.eye(3)])
    one = TetFile(corners, np.array([[0, 1, 2, 3]]), {TARGET: 2.0 * corners}, {STRETCH: np.ones((1, 6))})
    with PrivateFolder(path.parent) as folder:  # beside the output, where it must be possible to write anyway
        trial = folder / f"trial{path.suffix}"
        try:
            put_tets(trial, one, path)
        except OSError as error:
            raise InputError(f"{path} cannot be written: {with_remedy(error)}.") from error
        try:
            back = read_tets(trial)
            is_held = np.array_equal(back.at_vertices[TARGET], one.at_vertices[TARGET])
            is_held = is_held and back.tets.shape == one.tets.shape and back.at_tets[STRETCH].shape == (1, 6)
        except (InputError, KeyError):
            is_held = False
    if not is_held:
        raise InputError(
            f"{path} cannot be written: the format {path.suffix} has no room for tetrahedra and the values on them; "
            f"{_OTHERS}."
        )


def put_tets(new: Path, content: TetFile, path: Path) -> None:
    """As ``write_tets``, but directly to the file ``new``; ``path`` is its name in error messages.

    Raises
    ------
    InputError
        If the suffix is unknown, or if the format cannot store such data.
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
    """The format to request from meshio, or None: two programs use .msh, and meshio would assume the other one."""
    return "gmsh" if path.suffix.lower() == ".msh" else None


def _padded(values: NDArray[Any]) -> NDArray[Any]:
    """Gmsh stores 1, 3 or 9 numbers for each element, so six are padded with three zeros."""
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
    """Turn whatever meshio does with a bad file, any exception or even SystemExit, into a one-sentence InputError."""
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
