# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Cost of the fit as the number of tetrahedra grows: Newton steps, matrix products, seconds.

    python -m benchmarks.fit [--cases body:rest:t_pose ...]
"""

from __future__ import annotations

import argparse
import time as clock
from collections.abc import Callable
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.sparse.linalg import cg

from qc3d_addon.solver.fit import fold_free
from qc3d_addon.solver.fit.continuation import follow_path, path_to
from qc3d_addon.solver.fit.fold_free import FoldFreeFitter
from qc3d_addon.solver.keys.embedding import Embedding
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.meshing.delaunay import delaunay_mesh
from qc3d_addon.solver.meshing.poisson_disk import Resolution
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.support.progress import finish
from qc3d_addon.solver.surface.path import SurfacePath
from qc3d_addon.solver.tets.point_location import interpolation_matrix

from . import stage_cases
from .report import table

_SPACINGS = (0.03, 0.02, 0.014, 0.01, 0.007)  # the first three are those of the qualities


def main() -> None:
    """Print one row for each case and spacing."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", nargs="+", default=["body:rest:t_pose", "body:rest:arms_overhead"])
    rows = []
    for case in parser.parse_args().cases:
        faces, key0, key1 = stage_cases.load(case)
        embedding = Embedding.of(KeyPair.checked(key0, key1, faces))
        targets = path_to(SurfacePath(embedding), embedding.key1)
        for spacing in _SPACINGS:
            mesh = delaunay_mesh(embedding.key0, faces, Resolution(spacing, 0.25, 5.0 * spacing), FitOptions())
            landmarks = interpolation_matrix(mesh, embedding.key0)
            products: list[int] = []
            with patch.object(fold_free, "cg", _counting(cg, products)):
                started = clock.perf_counter()
                fitter = FoldFreeFitter(mesh, landmarks, embedding.weights)
                values = finish(follow_path(fitter, targets)).maps[-1]
                seconds = clock.perf_counter() - started
            missed = np.sqrt(embedding.weights @ ((landmarks @ values - embedding.key1) ** 2).sum(axis=1))
            cells = [case.replace(":", " "), f"{len(mesh.tets):,}", f"{seconds:.2f}", str(len(products))]
            rows.append([*cells, f"{np.mean(products):.0f}", str(max(products)), f"{missed:.1e}"])
    head = ["pair", "tetrahedra", "s", "Newton steps", "products a step", "at most", "residual"]
    print(table(head, rows))


def _counting(solve: Callable[..., Any], products: list[int]) -> Callable[..., Any]:
    """Wrap conjugate gradients so that they record their number of steps."""

    def counted(*arguments: Any, **options: Any) -> Any:  # noqa: ANN401
        steps: list[None] = []
        found = solve(*arguments, callback=lambda _: steps.append(None), **options)
        products.append(len(steps))
        return found

    return counted


if __name__ == "__main__":
    main()
