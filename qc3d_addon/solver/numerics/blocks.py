# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Row by row work on long arrays, in blocks whose temporary arrays stay in the processor's cache.

Temporary arrays of a million triangles take hundreds of megabytes, and each goes through memory.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..arrays import Floats

_ROWS = 20_000


def in_blocks(work: Callable[[slice], tuple[Floats, ...]], count: int) -> tuple[Floats, ...]:
    """What ``work`` returns for all rows, computed a block at a time.

    Parameters
    ----------
    work : callable
        Returns arrays (k, ...), one row for each of the k rows of a slice. Their memory layout is kept.
    count : int
        Number of rows in all.

    Examples
    --------
    >>> float(in_blocks(lambda rows: (np.arange(100_000.0)[rows] ** 2,), 100_000)[0][-1])
    9999800001.0
    """
    if count <= _ROWS:
        return work(slice(0, count))
    results: tuple[Floats, ...] = ()
    for start in range(0, count, _ROWS):
        rows = slice(start, min(start + _ROWS, count))
        found = work(rows)
        results = results or tuple(_long(part, count) for part in found)
        for whole, part in zip(results, found, strict=True):
            whole[rows] = part
    return results


def _long(part: Floats, count: int) -> Floats:
    """An uninitialized array with ``count`` rows and the memory layout of ``part`` (k, ...)."""
    order = sorted(range(part.ndim), key=lambda axis: -part.strides[axis])
    shape = [count if axis == 0 else part.shape[axis] for axis in order]
    return np.empty(shape, part.dtype).transpose(np.argsort(order))
