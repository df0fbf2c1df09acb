# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How near the maps of each quality come to the second key, in what time, and how small their determinants get.

    python -m benchmarks.meeting [--cases body:rest:t_pose ...] [--qualities normal exact ...]

Without cases: every pair of the catalogue. *Beyond*: vertices that are missed by more than 1e-4 of the diagonal; of
these *crossing* are where a key crosses itself.
"""

from __future__ import annotations

import argparse
import time as clock
from typing import get_args

import numpy as np

from qc3d_addon.solver.errors import QC3DError
from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.fit.meeting import MET
from qc3d_addon.solver.fit.own_crossings import crossing_vertices
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.numerics.rotations import determinants
from qc3d_addon.solver.settings import FitOptions, Quality
from qc3d_addon.solver.support.progress import finish

from .catalogue import Catalogue, Pair
from .report import table

_HEAD = ["pair", "quality", "tetrahedra", "CPU s", "rms", "largest", "beyond", "crossing", "folds", "least determinant"]


def main() -> None:
    """Print the table, row by row."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", nargs="+")
    parser.add_argument("--qualities", nargs="+", choices=get_args(Quality), default=get_args(Quality))
    chosen = parser.parse_args()
    catalogue = Catalogue()
    pairs = [catalogue.find(case) for case in chosen.cases] if chosen.cases else catalogue.pairs
    head, line = table(_HEAD, []).splitlines()
    print(f"{head}\n{line}", flush=True)
    for pair in pairs:
        for quality in chosen.qualities:
            print(table(row(pair, quality), []).splitlines()[0], flush=True)


def row(pair: Pair, quality: Quality) -> list[str]:
    """The cells of one pair with one quality."""
    faces, first, second = pair.load()
    options = FitOptions(quality=quality, extra_turns=pair.extra_turns)
    started = clock.process_time()
    try:
        fitted = finish(fit_pair(KeyPair.checked(first, second, faces), options))
    except QC3DError as error:
        return [str(pair), quality, str(error), *["-"] * (len(_HEAD) - 3)]
    seconds = clock.process_time() - started
    missed, residual = fitted.missed(), fitted.landmark_residual()
    beyond = missed > MET
    crossing = np.count_nonzero(beyond & crossing_vertices(fitted.embedding))
    least = determinants(fitted.mesh.jacobians(fitted.mapped)).min()
    folds = sum(fitted.folds(values) for values in fitted.maps)
    return [
        str(pair).replace(":", " "),
        quality,
        f"{len(fitted.mesh.tets):,}",
        f"{seconds:.1f}",
        f"{residual.rms:.1e}",
        f"{residual.max:.1e}",
        f"{np.count_nonzero(beyond)} ({beyond.mean():.2%})",
        str(crossing),
        str(folds),
        f"{least:.1e}",
    ]


if __name__ == "__main__":
    main()
