# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether the surface crosses itself at any moment that Blender plays, between the baked positions too.

    python -m benchmarks.continuous [--pairs body:rest:t_pose ...] [--parts 8]
    python -m benchmarks.continuous --methods     # the frames of all methods that benchmarks.inbetweens has stored

Each pair, the listed ones by default, is baked with the default settings and five in-betweens, in single precision as
Blender stores them. Between the in-betweens Blender plays straight lines (weights *hats*) or a cubic (weights
*smooth*), which is divided into straight parts here. Along each part, ``ipctk`` finds every vertex that meets a
triangle and every edge that meets another: with *hats* without gaps in time, since its continuous test misses nothing
(Wang et al. 2021, *A Large-scale Benchmark and an Inclusion-based Algorithm for Continuous Collision Detection*). What
is nearer than its tolerance may count too. Pairs where a key already crosses itself, or beside that, are counted apart.

``--methods`` looks at the frames of ``benchmarks.inbetweens`` instead, of each method, and at straight lines between
them, as hats would play them.
"""

from __future__ import annotations

import argparse
import time as clock
from dataclasses import replace
from itertools import pairwise

import numpy as np

from qc3d_addon.solver.arrays import Bools
from qc3d_addon.solver.fit.own_crossings import crossing_vertices
from qc3d_addon.solver.frames.task import Task, carry_out
from qc3d_addon.solver.frames.weights import Weights
from qc3d_addon.solver.keys.embedding import Embedding
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.settings import FitOptions, PlayOptions
from qc3d_addon.solver.support.progress import finish
from qc3d_addon.solver.triangles.topology import sides, unique_edges

from .catalogue import Catalogue, Floats, Ints, Pair
from .methods import METHODS
from .report import NAMES, table
from .results import RESULTS, Results

_PARTS = 8  # straight parts between two neighboring in-betweens
_HEAD = ["pair", "hats", "smooth", "hats, at the keys' own", "smooth, at the keys' own", "CPU s"]


def main() -> None:
    """Print the table, row by row."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", nargs="+")
    parser.add_argument("--parts", type=int, default=_PARTS, help="straight parts between two in-betweens")
    parser.add_argument("--methods", action="store_true", help="the stored frames of all methods")
    chosen = parser.parse_args()
    catalogue = Catalogue()
    pairs = [catalogue.find(text) for text in chosen.pairs or ()] or [pair for pair in catalogue.pairs if pair.listed]
    print(table(["pair", *(NAMES[method] for method in METHODS)] if chosen.methods else _HEAD, []), flush=True)
    results = Results(RESULTS, 3, "delaunay", "normal")
    for pair in pairs:
        cells = row_of_methods(pair, results) if chosen.methods else row(pair, chosen.parts)
        print(table(cells, []).splitlines()[0], flush=True)


def row_of_methods(pair: Pair, results: Results) -> list[str]:
    """The cells of one pair: for each method, how often its stored frames meet away from the keys' own crossings."""
    faces, first, second = pair.load()
    checked = KeyPair.checked(first, second, faces)
    vertices, group = checked.welding
    own, cells = _own_crossings(checked), []
    for method in METHODS:
        stored = results.load_frames(pair, method)
        if stored is None:
            cells.append("-")
            continue
        # The same lines in parts: boxes around short ways have little in common.
        short = Weights.hats(stored[1]).played(stored[2][:, vertices], _divided(stored[1], _PARTS))
        meeting = meetings(short, group[checked.faces])
        cells.append(str(np.count_nonzero(~own[meeting].any(axis=1))))
    return [str(pair).replace(":", " "), *cells]


def _own_crossings(checked: KeyPair) -> Bools:
    """(v,) which of the welded vertices are where a key crosses itself."""
    vertices, group = checked.welding
    own = np.zeros(len(vertices), dtype=bool)
    own[group[crossing_vertices(Embedding.of(checked))]] = True
    return own


def row(pair: Pair, parts: int) -> list[str]:
    """The cells of one pair."""
    faces, first, second = pair.load()
    checked = KeyPair.checked(first, second, faces)
    vertices, group = checked.welding
    own = _own_crossings(checked)
    knots, shapes = baked(pair, faces, first, second)
    started = clock.process_time()
    counts = []
    for weights in (Weights.hats(knots), Weights.smooth(knots)):
        meeting = meetings(weights.played(shapes, _divided(knots, parts))[:, vertices], group[checked.faces])
        counts.append(own[meeting].any(axis=1))
    seconds = clock.process_time() - started
    elsewhere, at_own = ([str(np.count_nonzero(there == where)) for there in counts] for where in (False, True))
    return [str(pair).replace(":", " "), *elsewhere, *at_own, f"{seconds:.1f}"]


def _divided(knots: Floats, parts: int) -> Floats:
    """Positions (k,) with so many parts between every two of these (q,)."""
    return np.asarray(np.unique(np.concatenate([*np.linspace(knots[:-1], knots[1:], parts + 1), knots])))


def baked(pair: Pair, faces: Ints, first: Floats, second: Floats) -> tuple[Floats, Floats]:
    """Positions (k,) and shapes (k, n, 3) of the keys and in-betweens, rounded as Blender stores them."""
    task = Task.of_keys({"a": first, "b": second}, faces, None, ("a", "b"), FitOptions(extra_turns=pair.extra_turns))
    bake = finish(carry_out(replace(task, play=PlayOptions()))).bake
    assert bake is not None
    return bake.times, bake.frames.astype(np.float32).astype(np.float64)


def meetings(shapes: Floats, faces: Ints) -> Ints:
    """(c, 4) vertices of the pairs that meet while a surface moves along straight lines from shape to shape.

    Parameters
    ----------
    shapes : (k, n, 3)
    faces : (m, 3)

    Returns
    -------
    (c, 4) int64
        A vertex and the three of a triangle, or the two ends of both edges; each pair once, however often it meets.
    """
    import ipctk  # of the extra benchmark; the options are explained without it

    corners, edges = np.asarray(faces, dtype=np.int32), unique_edges(sides(faces)).astype(np.int32)
    mesh = ipctk.CollisionMesh(np.asfortranarray(shapes[0]), np.asfortranarray(edges), np.asfortranarray(corners))
    found: set[tuple[int, ...]] = set()
    for before, after in pairwise(shapes):
        start, end = np.asfortranarray(before), np.asfortranarray(after)
        candidates = ipctk.Candidates()
        candidates.build(mesh, start, end)
        if candidates.is_step_collision_free(mesh, start, end):
            continue
        for one in [*candidates.fv_candidates, *candidates.ee_candidates]:
            ids = tuple(one.vertex_ids(mesh.edges, mesh.faces))
            if ids not in found and one.ccd(before[list(ids)].ravel(), after[list(ids)].ravel())[0]:
                found.add(ids)
    return np.array(sorted(found), dtype=np.int64).reshape(-1, 4)


if __name__ == "__main__":
    main()
