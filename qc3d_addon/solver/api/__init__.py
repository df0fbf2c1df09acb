# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The public interface for scripts: arrays in, frames out. See docs/reference/python.md."""

from __future__ import annotations

from .. import steps
from ..collision.colliders import Collider
from ..combinations.combine import Combination
from ..combinations.verdicts import Verdict
from ..errors import InputError, QC3DError
from ..settings import FitOptions, FrameOptions
from .baking import bake, bake_keys, bake_together
from .combining import combine, judge_pairs
from .fits import Fit, fit, load_fit

__all__ = [
    "Collider",
    "Combination",
    "Fit",
    "FitOptions",
    "FrameOptions",
    "InputError",
    "QC3DError",
    "Verdict",
    "bake",
    "bake_keys",
    "bake_together",
    "combine",
    "fit",
    "judge_pairs",
    "load_fit",
    "steps",
]
