# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d reconstruct``: a map from its representation."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..solver.errors import InputError
from ..solver.files.atomic import require_writable
from ..solver.maps.boundary_conditions import Conditions
from ..solver.maps.files import EIGEN_FORM, STRETCH, TARGET, TetFile, read_tets, require_format, write_tets
from ..solver.maps.reconstruction import reconstruct
from ..solver.maps.representation import from_eigen_form, from_upper_triangle
from ..solver.numerics.rotations import determinants
from . import speech
from .landmarks import read_landmarks
from .options import print_notes

if TYPE_CHECKING:
    from ..solver.arrays import Floats
    from ..solver.tets.mesh import TetMesh

_FORMS = {"upper-triangle": (STRETCH, from_upper_triangle), "eigen": (EIGEN_FORM, from_eigen_form)}


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
        help="sliding: the unit cube's faces slide within themselves; fixed: the boundary is fixed at the array "
        "'target', or at its own place without one; free: only landmarks are fixed (default: sliding)",
    )
    command.add_argument(
        "--landmarks",
        type=Path,
        metavar="FILE.csv",
        help="columns vertex, x, y, z: targets of vertices; an empty cell leaves that coordinate free",
    )
    command.add_argument(
        "--output", type=Path, required=True, metavar="OUT", help="the mesh with the array 'target'; .mesh: moved"
    )
    command.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> None:
    require_writable(arguments.output, inputs=[arguments.mesh, arguments.landmarks])
    content = read_tets(arguments.mesh)
    require_format(arguments.output)
    print_notes(content.notes)
    mesh = content.mesh()
    conditions = _conditions(arguments, content, mesh)
    found = reconstruct(mesh, _stretch(arguments, content), conditions)
    write_tets(
        arguments.output,
        TetFile(mesh.points, mesh.tets, {**content.at_vertices, TARGET: found.values}, content.at_tets),
    )
    ratios = determinants(found.jacobians)
    moved = np.linalg.norm(found.values - mesh.points, axis=1).max()
    speech.say(
        f"{len(mesh.tets)} tetrahedra reconstructed, {found.folds} folds; volume ratio {ratios.min():.3g} to "
        f"{ratios.max():.3g}, vertices moved by up to {moved:.3g}; {arguments.output}"
    )
    if found.folds:
        speech.note(
            f"{found.folds} of {len(mesh.tets)} tetrahedra are folded: no map has this representation and meets "
            "these conditions; give fewer or other ones."
        )


def _stretch(arguments: argparse.Namespace, content: TetFile) -> Floats:
    name, matrices = _FORMS[arguments.form]
    numbers = content.of_tets(name)
    if numbers.ndim != 2 or numbers.shape[1] != 6 or numbers.dtype.kind not in "fiu":
        raise InputError(f"The array '{name}' has the shape {numbers.shape}; each tetrahedron needs six numbers.")
    return matrices(numbers.astype(np.float64))


def _conditions(arguments: argparse.Namespace, content: TetFile, mesh: TetMesh) -> Conditions:
    if arguments.boundary == "sliding":
        conditions = Conditions.sliding_cube(mesh)
    elif arguments.boundary == "fixed":
        has_target = TARGET in content.at_vertices or TARGET in content.misfits
        given = content.mapping().values if has_target else mesh.points
        conditions = Conditions.fixed_boundary(mesh, given)
    else:
        conditions = Conditions.none(mesh)
    if arguments.landmarks is None:
        return conditions
    return conditions.with_landmarks(*read_landmarks(arguments.landmarks))
