# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which of the frames that were computed become shape keys."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..store.records import Chain
from .request import BakeRequest

if TYPE_CHECKING:
    from ...solver.frames.bake import Bake


def chosen_steps(bake: Bake, request: BakeRequest, chain: Chain) -> tuple[NDArray[np.int64], list[str]]:
    """Which frames become shape keys, all or as few as the tolerance allows, and sentences for the user.

    Baked again with the same tolerance a chain does not lose steps, so that its keys can stay.
    """
    if not request.tolerance > 0.0:
        return np.arange(len(bake.times)), []
    from ...solver.frames.thinning import fewest_steps, missed_between

    pairs = len(request.keys) - 1
    earlier = chain.intervals // pairs if chain.request.get("tolerance") == request.tolerance else 0
    steps = fewest_steps(bake.frames, request.tolerance, pairs, max(earlier, 1))
    chosen = np.arange(0, len(bake.times), (len(bake.times) - 1) // (steps * pairs))
    sentences = []
    if 0 < earlier < steps:
        sentences.append(
            f"The tolerance needs {steps - 1} in-betweens between every two keys now, before it were {earlier - 1}: "
            "their shape keys were replaced."
        )
    missed = missed_between(bake.frames) if len(chosen) == len(bake.times) else 0.0
    if missed > request.tolerance:
        sentences.append(
            f"The most in-betweens that a tolerance makes, {steps - 1} between every two keys, miss it: vertices are "
            f"up to about {missed:.2g} off. Choose more by their number, or a larger tolerance."
        )
    return chosen, sentences
