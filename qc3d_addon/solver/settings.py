# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user may choose, checked once."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral, Real
from typing import Literal, get_args

from .easing import Easing
from .errors import InputError
from .stretch import StretchLaw

Mode = Literal["natural", "linear", "straight"]
Engine = Literal["auto", "tetwild", "delaunay"]
Quality = Literal["normal", "fine", "finest"]


# What a prepared map depends on; the other choices are about frames.
OF_THE_FIT = ("stretch", "extra_turns", "engine", "quality", "seed")


@dataclass(frozen=True)
class Settings:
    """The choices of one bake.

    Parameters
    ----------
    mode
        How in-betweens are made: ``natural`` keeps rotations, lengths and volumes, ``linear`` is the paper's scheme,
        ``straight`` moves every vertex along a straight line, without a map.
    stretch
        How ``natural`` interpolates stretches: ``linear`` or ``logarithmic``.
    easing
        How far along the way the in-betweens are: ``linear``, ``ease-in``, ``ease-out`` or ``ease-in-out``.
    extra_turns
        Full turns, -100..100, that two shapes cannot tell: mode ``natural`` adds them to parts that turn freely, each
        about its own axis. In parts that are held, any number but 0 lets what is back in its place after whole turns
        turn with the rest.
    engine
        What fills the cube: ``delaunay``, ``tetwild``, or ``auto`` (tetwild where it can run).
    quality
        How fine the volume is: ``normal``, ``fine`` or ``finest``.
    seed
        Seed of the random samples of the ``delaunay`` engine.
    mesh_time_limit
        Seconds after which a tetwild run is stopped.
    """

    mode: Mode = "natural"
    stretch: StretchLaw = "linear"
    easing: Easing = "linear"
    extra_turns: int = 0
    engine: Engine = "delaunay"
    quality: Quality = "normal"
    seed: int = 0
    mesh_time_limit: float = 120.0

    def __post_init__(self) -> None:
        kinds = {"mode": Mode, "stretch": StretchLaw, "easing": Easing, "engine": Engine, "quality": Quality}
        for name, kind in kinds.items():
            value, choices = getattr(self, name), get_args(kind)
            if value not in choices:
                raise InputError(f"Unknown {name} {value!r}; choose one of {', '.join(choices)}.")
        for name, what in (("extra_turns", "number of extra turns"), ("seed", "seed")):
            value = getattr(self, name)
            if not isinstance(value, Integral) or isinstance(value, bool):
                raise InputError(f"The {what} is {value!r}; it must be a whole number.")
            object.__setattr__(self, name, int(value))  # of numpy's, which JSON does not know
        limit = self.mesh_time_limit
        if not isinstance(limit, Real) or isinstance(limit, bool):
            raise InputError(f"The time limit of meshing is {limit!r}; it must be a number of seconds.")
        if not -100 <= self.extra_turns <= 100:
            raise InputError(f"{self.extra_turns} extra turns are asked for; choose a number from -100 to 100.")
        if self.seed < 0:
            raise InputError(f"The seed is {self.seed}; it must be 0 or more.")
        if not self.mesh_time_limit > 0.0:
            raise InputError(f"The time limit of meshing is {self.mesh_time_limit} s; it must be positive.")

    @property
    def preparation(self) -> str:
        """The choices that a prepared map depends on; a map prepared with others must be made anew."""
        return f"{self.engine} {self.quality} {self.seed} {self.stretch} {self.extra_turns}"
