# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Mode ``straight``: every vertex on the line between its keys, also where no map of a volume leads there."""

from __future__ import annotations

import time as clock
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Floats
from ..collision.self_crossings import CrossingLimit
from ..keys.keypair import KeyPair
from ..settings import Settings
from ..support.memory import peak_memory_mb
from .chain import Bake, Progress, Steps, checked_times, require_chain, split
from .easing import eased
from .measures import worst_stretch
from .report import crossing_notes


def straight_inbetweens(pairs: Sequence[KeyPair], times: ArrayLike, settings: Settings) -> Steps[Bake]:
    """Frames through two keys or more without any map; the keys themselves, bit for bit, where the time is theirs.

    Parameters
    ----------
    pairs : sequence of KeyPair
        Consecutive pairs of one mesh: the second key of each is the first of the next.
    times : (k,)
        0 is the first key of all, 1 the last.
    settings : Settings
        Only the easing matters.

    Returns
    -------
    Bake
        Without measures, which need a map; its report has None where it would speak of one.

    Raises
    ------
    InputError
        If a time is outside 0..1 or the pairs are not consecutive.
    """
    started = clock.perf_counter()
    wanted = checked_times(times)
    require_chain(pairs)
    segments, local = split(eased(wanted, settings.easing), len(pairs))
    limits = [_Crossings(pair) for pair in pairs]
    frames = np.empty((len(wanted), *pairs[0].key0.shape))
    crossings = []
    for index, (number, time) in enumerate(zip(segments.tolist(), local.tolist(), strict=True)):
        yield Progress("frames", index / len(wanted))
        pair = pairs[number]
        frames[index] = pair.key1 if time == 1.0 else pair.key0 + time * (pair.key1 - pair.key0)
        crossings.append(limits[number].excess(frames[index]))
    report = {
        "engine": "none",
        "mode": settings.mode,
        "stretch": settings.stretch,
        "easing": settings.easing,
        "quality": settings.quality,
        "vertices": len(pairs[0].key0),
        "tetrahedra": 0,
        "folds": {"map": None, "frames": None},
        "crossings": crossings,
        "certificates": [],
        "residual": None,
        "peak_memory_mb": peak_memory_mb(),
        "notes": crossing_notes(crossings, wanted),
        "worst_stretch": worst_stretch(pairs, segments, frames),
        "key_error": 0.0,
        "seconds": {"frames": clock.perf_counter() - started},
    }
    return Bake(wanted, frames, report)


class _Crossings:
    """Counts the crossings of frames of a pair beyond those of its keys, in units that suit them."""

    def __init__(self, pair: KeyPair) -> None:
        self._origin = pair.key0[0]
        self._scale = 1.0 / max(float(np.ptp(key, axis=0).max()) for key in (pair.key0, pair.key1))
        still = (pair.key0 == pair.key1).all(axis=1)
        self._limit = CrossingLimit(pair.faces, self._scaled(pair.key0), self._scaled(pair.key1), still)

    def excess(self, frame: Floats) -> int:
        """Crossing pairs of triangles of a frame (n, 3) beyond what the keys have."""
        return self._limit.excess(self._scaled(frame))

    def _scaled(self, positions: Floats) -> Floats:
        return np.asarray((positions - self._origin) * self._scale)
