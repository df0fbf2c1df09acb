# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Chains beside an animator's own frames: keys at every third or sixth frame of a clip, and the frames between them.

    python -m benchmarks.clips

The environment variable QC3D_DATA says where the clips are.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from typing import Literal

import numpy as np
from scipy.interpolate import CubicSpline, interp1d

import qc3d_addon as qc3d

from .catalogue import DATA, Floats, Ints
from .measures import count_crossings, diagonal, edge_lengths, edge_uses
from .report import table

CLIPS, STEPS = ("wolf_gallop", "fox_walk"), (3, 6)
_NEAR = 1e-3  # of the time between two keys: how near to a key velocities are measured

# From the keys (k, n, 3) and triangles to frames (t, n, 3) at times in 0..1.
Method = Callable[[Floats, Ints, Floats], Floats]


def straight(keys: Floats, faces: Ints, times: Floats) -> Floats:
    """Straight lines from key to key."""
    return np.asarray(interp1d(np.linspace(0.0, 1.0, len(keys)), keys, axis=0)(times))


def spline(end: Literal["natural", "not-a-knot"], keys: Floats, faces: Ints, times: Floats) -> Floats:
    """A cubic spline for every vertex."""
    return np.asarray(CubicSpline(np.linspace(0.0, 1.0, len(keys)), keys, bc_type=end)(times))


def alone(keys: Floats, faces: Ints, times: Floats) -> Floats:
    """The in-betweens of each two keys, as if there were no others."""
    along = times * (len(keys) - 1)
    number = np.minimum(along.astype(np.int64), len(keys) - 2)
    frames = np.empty((len(times), *keys.shape[1:]))
    for pair in range(len(keys) - 1):
        fit = qc3d.fit(keys[pair], keys[pair + 1], faces)
        members = np.flatnonzero(number == pair)
        frames[members] = fit.inbetweens(along[members] - pair).frames
    return frames


def chain(keys: Floats, faces: Ints, times: Floats) -> Floats:
    """A chain through all keys."""
    return np.asarray(qc3d.bake(list(keys), faces, times).frames)


METHODS: dict[str, Method] = {
    "straight": straight,
    "cubic spline, not-a-knot": partial(spline, "not-a-knot"),
    "cubic spline, natural": partial(spline, "natural"),
    "pairs alone": alone,
    "chain": chain,
}


def clip(name: str) -> tuple[Ints, Floats]:
    """Triangles (m, 3) and all frames (t, n, 3)."""
    with np.load(DATA / f"clip_{name}.npz", allow_pickle=False) as stored:
        frames = [stored[f"V{number}"] for number in range(len(stored["shape_names"]))]
        return stored["faces"].astype(np.int64), np.stack(frames).astype(np.float64)


def rows_of(name: str, step: int) -> list[list[str]]:
    """The rows of the table."""
    faces, truth = clip(name)
    truth = truth[: (len(truth) - 1) // step * step + 1]
    count, keys = len(truth), truth[::step]
    inner = np.arange(count) % step != 0
    # Beside the frames: just before and after all inner keys, for the velocities there.
    knots = np.linspace(0.0, 1.0, len(keys))[1:-1]
    near = _NEAR / (len(keys) - 1)
    times = np.concatenate([np.linspace(0.0, 1.0, count), knots - near, knots + near])
    edges = edge_uses(faces)[0]
    true_lengths = np.stack([edge_lengths(shape, edges) for shape in truth])
    crossings = [count_crossings(shape, faces) or 0 for shape in truth]
    rows, unit = [], 0.0
    for title, method in METHODS.items():
        found = method(keys, faces, times)
        frames, before, after = found[:count], found[count : count + len(knots)], found[count + len(knots) :]
        off = float(np.sqrt(((frames - truth)[inner] ** 2).sum(axis=2).mean())) / diagonal(truth[0])
        unit = unit or off
        lengths = np.stack([edge_lengths(shape, edges) for shape in frames])
        wrong = np.abs(lengths / true_lengths - 1.0)[inner]
        jump = np.linalg.norm(after - 2.0 * keys[1:-1] + before, axis=2) / near
        speed = np.linalg.norm(after - before, axis=2) / (2.0 * near)
        more = max(max(0, (count_crossings(frames[k], faces) or 0) - crossings[k]) for k in np.flatnonzero(inner))
        rows.append([
            f"{name.replace('_', ' ')}, every {'third' if step == 3 else 'sixth'}", title, f"{off:.4f}",
            f"{off / unit:.2f}", f"{np.sqrt((wrong**2).mean()):.3f}", f"{np.percentile(wrong, 99):.3f}", str(more),
            f"{np.sqrt((jump**2).mean() / (speed**2).mean()):.3f}",
        ])  # fmt: skip
    return rows


def main() -> None:
    """Measure and print."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    rows = [row for step in STEPS for name in CLIPS for row in rows_of(name, step)]
    header = ["clip, keys", "method", "off", "of straight", "lengths, rms", "lengths, p99", "new crossings", "jump"]
    print(table(header, rows))


if __name__ == "__main__":
    main()
