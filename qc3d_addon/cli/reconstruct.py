# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d reconstruct``: a map from its representation."""

from __future__ import annotations

import argparse
import csv
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..solver.errors import InputError
from ..solver.files.atomic import require_writable
from ..solver.files.npz import require_file, unreadable
from ..solver.maps.boundary_conditions import Conditions
from ..solver.maps.files import EIGEN_FORM, STRETCH, TARGET, TetFile, read_tets, write_tets
from ..solver.maps.reconstruction import reconstruct
from ..solver.maps.representation import from_eigen_form, from_upper_triangle
from . import speech

if TYPE_CHECKING:
    from ..solver.arrays import Floats
    from ..solver.tets.mesh import TetMesh

_FORMS = {"upper-triangle": (STRETCH, from_upper_triangle), "eigen": (EIGEN_FORM, from_eigen_form)}
_HEADER = ["vertex", "x", "y", "z"]


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the others."""
    command = commands.add_parser("reconstruct", help="a map of a tetrahedral mesh from its representation")
    command.add_argument(
        "mesh", type=Path, metavar="MESH", help="tetrahedra with the representation: .npz, .vtu, .vtk, .msh"
    )
    command.add_argument(
        "--form",
        choices=tuple(_FORMS),
        default="upper-triangle",
        help=f"which six numbers to read: the array '{STRETCH}' or '{EIGEN_FORM}' (default: upper-triangle)",
    )
    command.add_argument(
        "--boundary",
        choices=("sliding", "fixed", "free"),
        default="sliding",
        help="the unit cube's faces slide; or the boundary is held where the array 'target' has it, or where it is "
        "if there is none; or nothing but landmarks is held (default: sliding)",
    )
    command.add_argument(
        "--landmarks",
        type=Path,
        metavar="FILE.csv",
        help="columns vertex, x, y, z: where vertices go; an empty cell leaves that coordinate free",
    )
    command.add_argument(
        "--output", type=Path, required=True, metavar="OUT", help="the mesh with the array 'target'; .mesh: moved"
    )
    command.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> None:
    require_writable(arguments.output, inputs=[arguments.mesh, arguments.landmarks])
    content = read_tets(arguments.mesh)
    mesh = content.mesh()
    conditions = _conditions(arguments, content, mesh)
    found = reconstruct(mesh, _stretch(arguments, content), conditions)
    write_tets(
        arguments.output,
        TetFile(mesh.points, mesh.tets, {**content.at_vertices, TARGET: found.values}, content.at_tets),
    )
    if found.folds:
        speech.note(
            f"{found.folds} of {len(mesh.tets)} tetrahedra are folded: no map has this representation and meets "
            "these conditions; give fewer or other ones."
        )


def _stretch(arguments: argparse.Namespace, content: TetFile) -> Floats:
    name, matrices = _FORMS[arguments.form]
    if name not in content.at_tets:
        known = ", ".join(content.at_tets) or "none"
        raise InputError(f"{arguments.mesh} has no array '{name}' of the tetrahedra; it has {known}.")
    numbers = content.at_tets[name]
    if numbers.ndim != 2 or numbers.shape[1] != 6 or numbers.dtype.kind not in "fiu":
        raise InputError(f"The array '{name}' has the shape {numbers.shape}; each tetrahedron needs six numbers.")
    return matrices(numbers.astype(np.float64))


def _conditions(arguments: argparse.Namespace, content: TetFile, mesh: TetMesh) -> Conditions:
    if arguments.boundary == "sliding":
        conditions = Conditions.sliding_cube(mesh)
    elif arguments.boundary == "fixed":
        given = content.mapping().values if TARGET in content.at_vertices else mesh.points
        conditions = Conditions.fixed_boundary(mesh, given)
    else:
        conditions = Conditions.none(mesh)
    if arguments.landmarks is None:
        return conditions
    return conditions.with_landmarks(*read_landmarks(arguments.landmarks))


def read_landmarks(path: Path) -> tuple[list[int], list[list[float]]]:
    """Vertices and their places, NaN where a coordinate is free, of a table; raises InputError where it is none."""
    require_file(path)
    try:
        with path.open(newline="", encoding="utf-8") as file:
            rows = list(csv.reader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise unreadable(path, error) from error
    if not rows or [cell.strip() for cell in rows[0]] != _HEADER:
        raise InputError(f"{path} must begin with the row {','.join(_HEADER)}.")
    vertices, values = [], []
    for number, row in enumerate(rows[1:], start=2):
        if not row:
            continue
        try:
            vertex, *cells = row
            vertices.append(int(vertex))
            values.append([float(cell) if cell.strip() else np.nan for cell in cells])
            if len(cells) != 3:
                raise ValueError("four cells are needed")
        except ValueError as error:
            raise InputError(f"{path}, row {number}: {error}; correct the row.") from error
    if not vertices:
        raise InputError(f"{path} names no landmarks; give a row for each.")
    return vertices, values
