# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What a user may choose, checked once: how a pair of keys is fitted, and how frames are made from the fit."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from numbers import Integral, Real
from typing import Any, Literal, TypedDict, get_args

from .errors import InputError

Mode = Literal["natural", "linear", "straight"]
Easing = Literal["linear", "ease-in", "ease-out", "ease-in-out"]
Engine = Literal["auto", "tetwild", "delaunay"]
Sampling = Literal["graded", "published"]
Quality = Literal["normal", "fine", "finest", "exact"]
StretchLaw = Literal["linear", "logarithmic"]
Mirror = Literal["auto", "none", "x", "y", "z", "xy", "xz", "yz", "xyz"]
WeightKind = Literal["smooth", "hats"]
Between = Literal["auto", "natural"]

# Frames between every two keys that a tolerance chooses from.
DENSE_STEPS = 48

_MOST_TURNS = 100
# Of the motion from one key to the next: in-betweens of shorter ones would be too close to tell apart.
_LEAST_DURATION = 0.001


@dataclass(frozen=True)
class FitOptions:
    """Options of the fit between two keys; a fit with other options has to be computed again.

    Parameters
    ----------
    engine
        Method that fills the cube with tetrahedra: ``delaunay``, ``tetwild``, or ``auto`` (tetwild if it works).
    quality
        Resolution of the tetrahedra: ``normal``, ``fine``, ``finest``, or ``exact``. With ``exact`` they are as fine as
        the surface, the map meets both keys, and the engine is always ``delaunay``.
    seed
        Seed of the random samples of the ``delaunay`` engine, 0 or more.
    stretch
        How mode ``natural`` interpolates stretches: ``linear`` or ``logarithmic``.
    extra_turns
        Full turns, in [-100, 100], that two shapes cannot determine: mode ``natural`` adds them to parts that can turn
        freely, each about its own axis. If still vertices hold a part, a value other than 0 also frees those of them
        that return to their place after full turns.
    sampling
        Samples of the ``delaunay`` engine: ``graded``, or ``published``, those of Chen & Lui (section 6.1): a uniform
        Poisson disk, of which samples are discarded at random.
    threshold
        Of the published sampling: within this many radii of the surface, fewer samples are kept the nearer they are.
    sparsity
        Of the published sampling: samples at a distance d beyond that are kept with the probability exp(-sparsity d),
        d in sides of the cube.
    mesh_time_limit
        Seconds after which a tetwild run is stopped.

    Raises
    ------
    InputError
        If a value is of the wrong type or out of its range.

    Examples
    --------
    >>> FitOptions(quality="fine").quality
    'fine'
    """

    engine: Engine = "delaunay"
    quality: Quality = "normal"
    seed: int = 0
    stretch: StretchLaw = "linear"
    extra_turns: int = 0
    sampling: Sampling = "graded"
    threshold: float = 1.0
    sparsity: float = 12.0
    mesh_time_limit: float = 120.0

    def __post_init__(self) -> None:
        _require_choices(self, {"engine": Engine, "quality": Quality, "stretch": StretchLaw, "sampling": Sampling})
        _require_whole(self.seed, "seed")
        _require_whole(self.extra_turns, "number of extra turns")
        if not -_MOST_TURNS <= self.extra_turns <= _MOST_TURNS:
            raise InputError(
                f"{self.extra_turns} extra turns are asked for; choose a number from -{_MOST_TURNS} to {_MOST_TURNS}."
            )
        if self.seed < 0:
            raise InputError(f"The seed is {self.seed}; it must be 0 or more.")
        for value, name, most in ((self.threshold, "threshold", 10.0), (self.sparsity, "sparsity", 100.0)):
            if not isinstance(value, Real) or isinstance(value, bool) or not 0.0 <= value <= most:
                raise InputError(f"The {name} of the sampling is {value!r}; it must be a number from 0 to {most:g}.")
        if self.quality == "exact" and self.engine == "tetwild":
            raise InputError("The quality exact fills the volume by the engine delaunay; choose that, or auto.")
        if self.sampling == "published" and (self.engine != "delaunay" or self.quality == "exact"):
            raise InputError(
                "The published sampling belongs to the engine delaunay and a quality other than exact; choose those."
            )
        limit = self.mesh_time_limit
        if not isinstance(limit, Real) or isinstance(limit, bool) or not limit > 0.0:
            raise InputError(f"The time limit of meshing is {limit!r}; it must be a positive number of seconds.")

    @property
    def identity(self) -> str:
        """The options as one string; fits with the same string are interchangeable."""
        text = f"{self.engine} {self.quality} {self.seed} {self.stretch} {self.extra_turns}"
        return text if self.sampling == "graded" else f"{text} published {self.threshold} {self.sparsity}"


class FitChoices(TypedDict, total=False):
    """The options of a fit as keyword arguments."""

    engine: Engine
    quality: Quality
    seed: int
    stretch: StretchLaw
    extra_turns: int
    sampling: Sampling
    threshold: float
    sparsity: float
    mesh_time_limit: float


@dataclass(frozen=True)
class FrameOptions:
    """Options of frames; different frames of the same fit may use different ones.

    Parameters
    ----------
    mode
        ``natural`` keeps rotations, lengths and volumes, ``linear`` is the paper's scheme (Chen & Lui, section 6.1),
        ``straight`` moves every vertex along a straight line and needs no fit.
    easing
        How the speed of the motion changes: ``linear``, ``ease-in``, ``ease-out`` or ``ease-in-out``.
    via_at
        Times of the keys between the first and the last, increasing, between 0 and 1; empty if every pair of keys takes
        the same time before the easing.

    Raises
    ------
    InputError
        If a value is of the wrong type or out of its range.

    Examples
    --------
    >>> FrameOptions(easing="ease-in")
    FrameOptions(mode='natural', easing='ease-in', via_at=())
    """

    mode: Mode = "natural"
    easing: Easing = "linear"
    via_at: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        _require_choices(self, {"mode": Mode, "easing": Easing})
        for time in self.via_at:
            if not isinstance(time, Real) or isinstance(time, bool) or not 0.0 < time < 1.0:
                raise InputError(f"The time of a key is {time!r}; it must be a number between 0 and 1.")
        for time, following in pairwise((0.0, *self.via_at, 1.0)):
            if following - time < _LEAST_DURATION:
                raise InputError(
                    f"Keys at {time:g} and {following:g} are too close or in the wrong order; each must come at least "
                    f"{_LEAST_DURATION:g} after the one before."
                )


@dataclass(frozen=True)
class PlayOptions:
    """How a control plays a motion through a few of its shapes.

    Parameters
    ----------
    count : int
        Number of in-betweens between every two keys, evenly spaced in the control's position.
    more : bool
        Whether there may be more, up to 2 ``count`` + 1, between keys where volumes would otherwise be off by 0.1 % or
        more beyond the motion itself.
    tolerance : float
        If positive, as few in-betweens as play every moment within this distance, in the keys' unit, placed where they
        help most; ``count`` is then ignored.
    weights : WeightKind
        ``smooth``: a smooth path through the shapes; ``hats``: straight blends between neighbors.
    also_at : tuple of float
        Positions of additional in-betweens, between 0 and 1.

    Raises
    ------
    InputError
        If a value is of the wrong type or out of its range.
    """

    count: int = 5
    tolerance: float = 0.0
    weights: WeightKind = "smooth"
    also_at: tuple[float, ...] = ()
    more: bool = False

    def __post_init__(self) -> None:
        _require_choices(self, {"weights": WeightKind})
        if not isinstance(self.more, bool):
            raise InputError(f"The option more is {self.more!r}; it must be True or False.")
        if not isinstance(self.count, Integral) or isinstance(self.count, bool) or self.count < 0:
            raise InputError(f"The number of in-betweens is {self.count!r}; it must be a whole number from 0.")
        numbers = [(self.tolerance, "tolerance"), *((place, "place of an in-between") for place in self.also_at)]
        for value, what in numbers:
            if not isinstance(value, Real) or isinstance(value, bool) or not 0.0 <= value < float("inf"):
                raise InputError(f"The {what} is {value!r}; it must be a number from 0.")
        if not all(0.0 < place < 1.0 for place in self.also_at):
            raise InputError("The place of an in-between must be between 0 and 1.")


def _require_choices(options: object, kinds: dict[str, Any]) -> None:
    for name, kind in kinds.items():
        value, choices = getattr(options, name), get_args(kind)
        if not isinstance(value, str) or value not in choices:
            raise InputError(f"Unknown {name} {value!r}; choose one of {', '.join(choices)}.")


def _require_whole(value: object, name: str) -> None:
    if not isinstance(value, Integral) or isinstance(value, bool):
        raise InputError(f"The {name} is {value!r}; it must be a whole number.")
