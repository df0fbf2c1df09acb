# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The methods that are compared."""

from __future__ import annotations

import time as clock
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from qc3d_addon.solver.api import Fit
from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.settings import FitOptions, Mode
from qc3d_addon.solver.support.progress import finish

from .classical import arap, arap_surface, corrective_smooth, poisson, rotational

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

OURS: tuple[Mode, ...] = ("linear", "natural")
MODULES = {
    "rotational": rotational,
    "smooth": corrective_smooth,
    "surface": arap_surface,
    "poisson": poisson,
    "arap": arap,
}
METHODS = ("straight", *MODULES, *OURS)


class Outcome(NamedTuple):
    """In-betweens (k, n, 3), the seconds they took, and the method's own report."""

    frames: Floats
    seconds: float
    details: dict[str, Any]


class Contest:
    """Runs methods on one pair of shapes; both modes of QC3D share one fit.

    ``choices`` are options of QC3D, such as the engine and the quality.
    """

    def __init__(self, faces: Ints, key0: Floats, key1: Floats, times: Floats, choices: dict[str, Any]) -> None:
        self.faces, self.key0, self.key1, self.times = faces, key0, key1, times
        self._choices = choices
        self._fitted: Fit | None = None

    def run(self, method: str) -> Outcome:
        """The in-betweens of one method."""
        started = clock.perf_counter()
        for mode in OURS:
            if method == mode:
                return self._ours(mode)
        details: dict[str, Any] = {}
        if method == "straight":
            weight = self.times[:, None, None]
            frames = (1.0 - weight) * self.key0 + weight * self.key1
        elif method == "rotational":
            frames = rotational.frames(self.key0, self.key1, self.times)
        elif method == "smooth":
            frames = corrective_smooth.frames(self.key0, self.key1, self.faces, self.times)
        elif method == "surface":
            frames = arap_surface.frames(self.key0, self.key1, self.faces, self.times)
        elif method == "poisson":
            frames = poisson.frames(self.key0, self.key1, self.faces, self.times)
        elif method == "arap":
            frames, counts = arap.frames(self.key0, self.key1, self.faces, self.times)
            details.update(counts)
        else:
            raise ValueError(f"Unknown method {method!r}; there are {', '.join(METHODS)}.")
        return Outcome(frames, clock.perf_counter() - started, details)

    def _ours(self, mode: Mode) -> Outcome:
        if self._fitted is None:
            pair = KeyPair.checked(self.key0, self.key1, self.faces)
            self._fitted = Fit(finish(fit_pair(pair, FitOptions(**self._choices))))
        bake = self._fitted.inbetweens(self.times, mode=mode)
        return Outcome(bake.frames, sum(bake.report.seconds.values()), {"report": bake.report.as_json()})
