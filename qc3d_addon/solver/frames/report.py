# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a bake tells about itself, as plain values that can be written as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arrays import Floats
from ..fit.fitted_map import PreparedMap
from ..settings import Settings
from ..support.memory import peak_memory_mb
from .frame import Frame


def bake_report(
    prepared: Sequence[PreparedMap], settings: Settings, times: Floats, frames: Sequence[Frame], notes: Sequence[str]
) -> dict[str, Any]:
    """Engine, settings, sizes, folds, crossings and residuals of the frames at ``times`` (k,)."""
    crossings = [frame.crossings for frame in frames]
    sentences = [*notes, *crossing_notes(crossings, times)]
    residuals = [part.landmark_residual() for part in prepared]
    return {
        "engine": ", ".join(dict.fromkeys(part.engine for part in prepared)),
        "mode": settings.mode,
        "stretch": settings.stretch,
        "easing": settings.easing,
        "quality": prepared[0].quality,
        "vertices": len(prepared[0].pair.key0),
        "tetrahedra": sum(len(part.mesh.tets) for part in prepared),
        "folds": {
            "map": sum(part.folds(part.mapped) for part in prepared),
            "frames": [frame.folds for frame in frames],
        },
        "crossings": crossings,
        "certificates": [frame.certificate(time) for frame, time in zip(frames, times.tolist(), strict=True)],
        "residual": {name: max(residual[name] for residual in residuals) for name in ("rms", "max")},
        "peak_memory_mb": peak_memory_mb(),
        "notes": list(dict.fromkeys(sentences)),
    }


def crossing_notes(crossings: Sequence[int], times: Floats) -> list[str]:
    """A sentence about the frame at ``times`` (k,) that crosses itself most beyond its keys, if one does."""
    if not any(crossings):
        return []
    worst = int(np.argmax(crossings))
    return [f"The frame at {times[worst]:.3g} crosses itself in {crossings[worst]} pairs of triangles more than a key."]
