# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How near the heat maps of each quality are to those of the map that meets both keys.

    python -m benchmarks.heat_maps [--pairs wolf:bind:Gallop_0 ...]

For volume and dilatation at the second key: the mean over all vertices of the difference of logarithms from quality
``exact``, and the 50th and 99th percentile of the measure itself.
"""

from __future__ import annotations

import argparse
from typing import get_args

import numpy as np

from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.frames.measures import VertexMeasures
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.settings import FitOptions, Quality
from qc3d_addon.solver.support.progress import finish

from .catalogue import Catalogue, Floats, Pair
from .report import table

_PAIRS = ("bar:straight:twist180", "wolf:bind:Gallop_0")
_MEASURES = ("volume", "dilatation")
_HEAD = ["pair", "quality", *(f"{name}: {what}" for name in _MEASURES for what in ("mean difference", "50 %", "99 %"))]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", nargs="+", default=_PAIRS)
    catalogue = Catalogue()
    rows = [line for pair in parser.parse_args().pairs for line in rows_of(catalogue.find(pair))]
    print(table(_HEAD, rows))


def rows_of(pair: Pair) -> list[list[str]]:
    """The cells of one pair, a row for each quality."""
    found: dict[Quality, dict[str, Floats]] = {}
    faces, first, second = pair.load()
    keys = KeyPair.checked(first, second, faces)
    for quality in get_args(Quality):
        fitted = finish(fit_pair(keys, FitOptions(quality=quality, extra_turns=pair.extra_turns)))
        found[quality] = VertexMeasures([fitted]).of(0, second, fitted.mapped)
    rows = []
    for quality, measures in found.items():
        cells = [str(pair).replace(":", " "), quality]
        for name in _MEASURES:
            values = measures[name]
            cells.append(f"{np.abs(np.log(values / found['exact'][name])).mean():.3f}")
            cells += [f"{np.percentile(values, share):.2f}" for share in (50, 99)]
        rows.append(cells)
    return rows


if __name__ == "__main__":
    main()
