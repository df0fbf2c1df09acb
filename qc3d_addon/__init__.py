# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""QC3D fills in the frames between two shape keys with fold-free volumetric maps.

Blender's way in is ``register``; scripts find the public functions here, see docs/reference/python.md. They are loaded
when they are first asked for, so that Blender, which imports this at its start, does not wait for scipy.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .solver.api import (
        Collider,
        Combination,
        Fit,
        FitOptions,
        FrameOptions,
        InputError,
        QC3DError,
        Verdict,
        bake,
        bake_keys,
        bake_together,
        combine,
        fit,
        judge_pairs,
        load_fit,
        steps,
    )

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
    "register",
    "steps",
    "unregister",
]


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from .solver import api

    return getattr(api, name)


def __dir__() -> list[str]:
    return sorted(__all__)


def register() -> None:
    """Make the operators, properties, panel and command known to Blender."""
    from .blender import registration

    registration.register()


def unregister() -> None:
    """Take back everything that ``register`` made known."""
    from .blender import registration

    registration.unregister()
