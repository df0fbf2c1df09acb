# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Options that several commands have."""

from __future__ import annotations

import argparse
from typing import get_args

from ..solver.settings import OF_THE_FIT, Easing, Engine, Mode, Quality, Settings, StretchLaw

_DEFAULTS = Settings()
_ALL = ("mode", "easing", *OF_THE_FIT)


def add_settings(command: argparse.ArgumentParser, frames: bool = True) -> None:
    """Add the solver's settings: all of them, or those of the fit alone."""
    for name, choices, text in (
        ("mode", get_args(Mode), "how in-betweens are made"),
        ("stretch", get_args(StretchLaw), "how mode natural interpolates stretches"),
        ("easing", get_args(Easing), "how far along the way the in-betweens are"),
        ("engine", get_args(Engine), "what fills the volume around the mesh"),
        ("quality", get_args(Quality), "how fine the volume is"),
    ):
        if not frames and name not in OF_THE_FIT:
            continue
        default = getattr(_DEFAULTS, name)
        command.add_argument(f"--{name}", choices=choices, default=default, help=f"{text} (default: {default})")
    command.add_argument(
        "--extra-turns",
        type=whole_number,
        default=_DEFAULTS.extra_turns,
        metavar="TURNS",
        help="full turns that two shapes cannot tell (default: 0)",
    )
    command.add_argument(
        "--seed",
        type=whole_number,
        default=_DEFAULTS.seed,
        metavar="S",
        help="of the delaunay engine's samples (default: 0)",
    )


def settings_of(arguments: argparse.Namespace) -> Settings:
    """The solver's settings that were chosen; the others stay at their defaults."""
    return Settings(**{name: getattr(arguments, name) for name in _ALL if hasattr(arguments, name)})


def whole_number(text: str) -> int:
    """A whole number; for argparse."""
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number") from None
