# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Elimination orders for a surface's matrix: python -m benchmarks.factorizations [VERTICES ...]

Prints, for each order, the seconds to find it, to factor, and to solve for three right-hand sides, and the number of
entries of L.
"""

from __future__ import annotations

import sys
import time as clock
from collections.abc import Callable
from typing import Literal

import numpy as np
from scipy.sparse import csc_array, csr_array, eye_array
from scipy.sparse.csgraph import reverse_cuthill_mckee
from scipy.sparse.linalg import splu

from qc3d_addon.solver.numerics.assembly import StiffnessPattern, stiffness_elements
from qc3d_addon.solver.numerics.nested_dissection import elimination_order
from qc3d_addon.solver.triangles.geometry import hat_gradients, tangent_bases

from .catalogue import Floats, Ints
from .report import table
from .stage_cases import limb

SIZES = (20_000, 70_000, 150_000)
_ANCHORS = 1e-6


def cuthill_mckee(points: Floats, matrix: csr_array) -> Ints:
    """The reverse Cuthill-McKee order, for a small bandwidth."""
    return np.asarray(reverse_cuthill_mckee(matrix, symmetric_mode=True), dtype=np.int64)


# For each name: how the order is found, and which ordering SuperLU then applies.
Spec = Literal["NATURAL", "MMD_AT_PLUS_A", "COLAMD"]
ORDERS: tuple[tuple[str, Callable[[Floats, csr_array], Ints] | None, Spec], ...] = (
    ("nested dissection", elimination_order, "NATURAL"),
    ("MMD_AT_PLUS_A", None, "MMD_AT_PLUS_A"),
    ("COLAMD", None, "COLAMD"),
    ("reverse Cuthill-McKee", cuthill_mckee, "NATURAL"),
)


def main(arguments: list[str]) -> None:
    """Print the table."""
    rows = []
    for size in [int(argument) for argument in arguments] or SIZES:
        points, matrix = surface_matrix(size)
        for name, find, spec in ORDERS:
            started = clock.perf_counter()
            order = None if find is None else find(points, matrix)
            found = clock.perf_counter()
            ordered = csc_array(matrix if order is None else matrix[order][:, order])
            factors = splu(ordered, permc_spec=spec, diag_pivot_thresh=0.0, options={"SymmetricMode": True})
            factored = clock.perf_counter()
            factors.solve(np.ones((size, 3), order="F"))
            solved = clock.perf_counter()
            cells = [f"{found - started:.2f}" if order is not None else "", f"{factored - found:.2f}"]
            rows.append([f"{size:,}", name, *cells, f"{1e3 * (solved - factored):.0f}", f"{factors.L.nnz / 1e6:.1f}"])
    print(table(["vertices", "order", "order, s", "factors, s", "solve, ms", "million entries"], rows))


def surface_matrix(size: int) -> tuple[Floats, csr_array]:
    """Points of a sphere and the stiffness matrix of its surface, weakly anchored."""
    faces, sphere, _ = limb(size)
    return sphere, stiffness(sphere, faces)


def stiffness(points: Floats, faces: Ints) -> csr_array:
    """The positive definite matrix of a surface."""
    gradients = hat_gradients(points, faces, tangent_bases(points, faces))
    elements = stiffness_elements(np.ones(len(faces)), gradients)
    matrix = StiffnessPattern(faces, len(points)).assemble(elements)
    return csr_array(matrix + _ANCHORS * float(matrix.diagonal().mean()) * eye_array(len(points)))


if __name__ == "__main__":
    main(sys.argv[1:])
