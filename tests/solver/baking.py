# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Helpers for tests that bake: engines that work here, and frames of stored fits."""

from __future__ import annotations

from collections.abc import Sequence

from numpy.typing import ArrayLike

from qc3d_addon.solver.collision.colliders import Collider
from qc3d_addon.solver.fit.fitted_map import FittedMap
from qc3d_addon.solver.frames.bake import Bake, checked_times
from qc3d_addon.solver.frames.chain import chain_frames
from qc3d_addon.solver.frames.following import Following
from qc3d_addon.solver.meshing.tetwild_loading import unavailable_reason
from qc3d_addon.solver.settings import Easing, FrameOptions, Mode
from qc3d_addon.solver.support.progress import Progress, finish


def engine_available(name: str) -> bool:
    """Whether the engine can run here; cheap, loads nothing compiled."""
    return name in ("auto", "delaunay") or unavailable_reason() is None


def frames_of(
    fits: FittedMap | Sequence[FittedMap],
    times: ArrayLike,
    mode: Mode = "natural",
    easing: Easing = "linear",
    collider: Collider | None = None,
    seen: list[Progress] | None = None,
) -> Bake:
    """The frames of one fit, or of a chain of them, at ``times``."""
    chain = [fits] if isinstance(fits, FittedMap) else list(fits)
    options = FrameOptions(mode, easing)
    posed = None
    if collider is not None:
        posed = finish(Following(collider, checked_times(times), chain[0].options, options).posed())
    pairs = [fitted.pair for fitted in chain]
    steps = chain_frames(pairs, [] if mode == "straight" else chain, times, options, posed)
    return finish(steps, None if seen is None else seen.append)
