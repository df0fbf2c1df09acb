# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The fold-free fit against SLIM, with the same tetrahedra, landmarks and path: python -m benchmarks.slim [PAIR ...]

SLIM (Rabinovich et al. 2017, "Scalable locally injective mappings") runs as shipped with libigl, with the symmetric
Dirichlet energy. Its landmarks must be vertices, so it gets vertex targets that fit our landmarks by least squares. It
follows the same path to the second key, and at each step iterates until its residual is no larger than ours or its
energy stalls. Times are CPU seconds of this process in one thread, without those of the path itself.
"""

from __future__ import annotations

import sys
import time as clock

import igl
import numpy as np
from scipy.sparse import csc_array, diags_array
from scipy.sparse.linalg import splu

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.fit.continuation import follow_path, path_to
from qc3d_addon.solver.fit.fold_free import FoldFreeFitter
from qc3d_addon.solver.keys.embedding import Embedding
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.meshing.cube import fill_cube
from qc3d_addon.solver.numerics.assembly import StiffnessPattern, stiffness_elements
from qc3d_addon.solver.numerics.rotations import determinants
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.support.progress import finish
from qc3d_addon.solver.surface.path import SurfacePath
from qc3d_addon.solver.tets.point_location import interpolation_matrix

from .report import table
from .stage_cases import load

PAIRS = ("body:rest:arm_raise30", "body:rest:t_pose", "body:rest:arms_overhead", "horse:bind:Gallop_0")
_SOFTNESS = 1e5
_SMOOTHING = 1e-6
_MOST_ITERATIONS = 60
_CLOSE_ENOUGH = 1.05
_ON_THE_WAY = 5e-3  # cube units
_STALLED = 0.999


class Problem:
    """One pair: its tetrahedra, landmarks and path."""

    def __init__(self, case: str) -> None:
        faces, key0, key1 = load(case)
        self.embedding = Embedding.of(KeyPair.checked(key0, key1, faces))
        self.mesh = fill_cube(self.embedding.key0, faces, FitOptions(quality="finest")).mesh
        self.landmarks = interpolation_matrix(self.mesh, self.embedding.key0)
        self.targets = path_to(SurfacePath(self.embedding), self.embedding.key1)

    def missed(self, values: Floats, target: Floats) -> float:
        """Residual: root mean square distance of the landmarks from their targets, in cube units."""
        squares = ((self.landmarks @ values - target) ** 2).sum(axis=1)
        return float(np.sqrt(self.embedding.weights @ squares))

    def folds(self, values: Floats) -> int:
        """Number of inverted tetrahedra."""
        return int((determinants(self.mesh.jacobians(values)) <= 0.0).sum())

    def fitted(self) -> Floats:
        """Our fit to the last target along the path, as in a bake."""
        fitter = FoldFreeFitter(self.mesh, self.landmarks, self.embedding.weights)
        return np.asarray(finish(follow_path(fitter, self.targets)).maps[-1])

    def fitted_by_slim(self, goal: float) -> tuple[Floats, int]:
        """SLIM's map along the same path, and its number of iterations; it ends when its residual reaches ``goal``."""
        mesh, weights = self.mesh, self.embedding.weights
        laplacian = StiffnessPattern(mesh.tets, len(mesh.points)).assemble(
            stiffness_elements(mesh.volumes, mesh.gradients)
        )
        normal = self.landmarks.T @ diags_array(weights) @ self.landmarks
        factors = splu(csc_array(normal + _SMOOTHING * laplacian))
        near = np.asarray(normal.diagonal() > 0.0)
        constrained = np.flatnonzero(near | mesh.on_cube_face.any(axis=1))
        values, iterations = mesh.points, 0
        for target in self.targets:
            loads = self.landmarks.T @ (weights[:, None] * target) + _SMOOTHING * (laplacian @ values)
            wanted = np.where(near[:, None], factors.solve(loads), mesh.points)[constrained]
            data = igl.slim_precompute(
                np.asfortranarray(mesh.points),
                np.asfortranarray(mesh.tets.astype(np.int32)),
                np.asfortranarray(values),
                igl.MappingEnergyType.SYMMETRIC_DIRICHLET,
                constrained.astype(np.int32),
                np.asfortranarray(wanted),
                _SOFTNESS,
            )
            before, enough = np.inf, _CLOSE_ENOUGH * goal if target is self.targets[-1] else _ON_THE_WAY
            for _ in range(_MOST_ITERATIONS):
                values = np.asarray(igl.slim_solve(data, 1))
                iterations += 1
                now = self.missed(values, target)
                if now <= enough or now > _STALLED * before:
                    break
                before = now
        return values, iterations


def main(cases: list[str]) -> None:
    """Print the table."""
    rows = []
    for case in cases or PAIRS:
        problem = Problem(case)
        started = clock.process_time()
        fitted = problem.fitted()
        ours = clock.process_time() - started
        key1 = problem.targets[-1]
        goal = problem.missed(fitted, key1)
        started = clock.process_time()
        other, iterations = problem.fitted_by_slim(goal)
        slim = clock.process_time() - started
        cells = [case.replace(":", " "), str(len(problem.mesh.tets)), f"{ours:.2f}", f"{goal:.1e}"]
        cells += [str(problem.folds(fitted)), f"{slim:.2f}", str(iterations), f"{problem.missed(other, key1):.1e}"]
        rows.append([*cells, str(problem.folds(other)), f"{slim / ours:.1f}"])
    head = ["pair", "tetrahedra", "ours, CPU s", "residual", "folds", "SLIM, CPU s", "iterations", "residual", "folds"]
    print(table([*head, "ratio"], rows))


if __name__ == "__main__":
    main(sys.argv[1:])
