# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Anderson acceleration of fixed-point iterations."""

from __future__ import annotations

import numpy as np

from .tetmesh import Floats

_SMALLEST_DIRECTION = 1e-10


class AndersonMixing:
    """The next point of a fixed-point iteration from the last few (Anderson 1965; for shapes Peng et al. 2018).

    Parameters
    ----------
    memory : int
        How many differences of earlier points are used.
    mixing : float
        How far to go along the step of the iteration itself; above 1 goes further than it asks for.
    """

    def __init__(self, memory: int, mixing: float) -> None:
        self._memory = memory
        self._mixing = mixing
        self._points: list[Floats] = []
        self._steps: list[Floats] = []
        self._last: tuple[Floats, Floats] | None = None

    def next(self, point: Floats, mapped: Floats) -> Floats:
        """The point after ``point``, which the iteration takes to ``mapped``; arrays of any one shape."""
        flat, step = point.ravel(), (mapped - point).ravel()
        if self._last is not None:
            self._points.append(flat - self._last[0])
            self._steps.append(step - self._last[1])
            del self._points[: -self._memory], self._steps[: -self._memory]
        self._last = flat, step
        moved = flat + self._mixing * step
        if self._steps:
            # Normal equations: a handful of unknowns, and only the direction matters.
            changes = np.stack(self._steps)
            products = np.einsum("ik,jk->ij", changes, changes)
            shares = np.linalg.lstsq(products, np.einsum("ik,k->i", changes, step), rcond=_SMALLEST_DIRECTION)[0]
            for share, before, change in zip(shares.tolist(), self._points, self._steps, strict=True):
                moved -= share * before
                moved -= (share * self._mixing) * change
        return moved.reshape(point.shape)
