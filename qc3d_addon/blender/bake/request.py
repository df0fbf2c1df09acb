# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The request for a bake, and its result."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, fields
from typing import Any, Literal, get_args

from ...solver.errors import InputError
from ...solver.settings import DENSE_STEPS, FitOptions, FrameOptions, PlayOptions, WeightKind
from ..store import names
from ..store import stored_values as stored

# Frames between every two keys that a preview interpolates with a spline. benchmarks/scrub.py measured an error of at
# most 6.5e-6 of the size between them.
PREVIEW_STEPS = 24

PlayOn = Literal["auto", "key", "slider"]


@dataclass(frozen=True)
class BakeRequest:
    """What to bake between shape keys of an object.

    Parameters
    ----------
    keys
        Names of two keys or more, from the first to the last; a name may be repeated, but not twice in a row.
    count
        Number of in-betweens between every two keys that follow each other, evenly spaced.
    fit_options, frame_options
        The solver's options.
    keyframes
        First and last frame between which the slider goes from 0 to 1, or None to leave it without keyframes.
    tolerance
        If positive, the bake makes as few in-betweens as keep every vertex within this distance, in the object's own
        units, and ignores ``count``.
    colliders
        Name of a collection with objects that the in-betweens must not enter; empty for none.
    weights
        How in-betweens are blended: ``smooth``, or ``hats`` for straight lines from each to the next.
    play_on
        What plays them: ``key``, the value of the last key, which must be relative to the first; ``slider``, a new
        custom property; or ``auto``, the key if possible.
    also_at
        Places of more in-betweens, each between 0 and 1 on the control.
    """

    keys: tuple[str, ...]
    count: int = 5
    fit_options: FitOptions = field(default_factory=FitOptions)
    frame_options: FrameOptions = field(default_factory=FrameOptions)
    keyframes: tuple[int, int] | None = None
    tolerance: float = 0.0
    colliders: str = ""
    weights: WeightKind = "smooth"
    also_at: tuple[float, ...] = ()
    play_on: PlayOn = "auto"

    def __post_init__(self) -> None:
        if len(self.keys) < 2:
            raise InputError("In-betweens need two keys or more.")
        most = names.MAX_STEPS // (len(self.keys) - 1) - 1
        if most < 1 or (self.tolerance > 0.0 and most + 1 < DENSE_STEPS):
            raise InputError(f"{len(self.keys)} keys in a row are too many for one slider; bake them in parts.")
        if not 1 <= self.count <= most:
            raise InputError(f"{self.count} in-betweens are not possible; 1 to {most} are.")
        if not 0.0 <= self.tolerance < float("inf"):
            raise InputError(f"The tolerance is {self.tolerance}; it must be a distance, or 0 for a fixed number.")
        if self.keyframes is not None and self.keyframes[0] >= self.keyframes[1]:
            first, last = self.keyframes
            raise InputError(f"Keyframes from {first} to {last} are not possible; the last must come after the first.")
        if self.play_on not in get_args(PlayOn):
            raise InputError(f"Unknown control {self.play_on!r}; choose one of {', '.join(get_args(PlayOn))}.")
        _ = self.play_options  # refused here where it is not possible

    @property
    def play_options(self) -> PlayOptions:
        """How a control is to play the motion."""
        return PlayOptions(self.count, self.tolerance, self.weights, self.also_at)

    def remembered(self) -> dict[str, Any]:
        """What a later bake of the same keys needs to know, as plain values."""
        return {
            "count": self.count,
            "tolerance": self.tolerance,
            "settings": asdict(self.fit_options) | asdict(self.frame_options),
            "colliders": self.colliders,
            "weights": self.weights,
            "also_at": list(self.also_at),
            "play_on": self.play_on,
        }

    @property
    def base(self) -> str:
        """Name of the key that the playing key is relative to; empty if a slider plays the in-betweens."""
        return self.keys[0] if self.play_on == "key" else ""

    @classmethod
    def again(cls, keys: tuple[str, ...], remembered: dict[str, Any]) -> BakeRequest:
        """The request that ``remembered`` came from, without keyframes, so that those of the file stay.

        Raises
        ------
        InputError
            If the values are not what this version writes.
        """
        try:
            options = dict(stored.plain_dict(remembered["settings"]))
            frame_options = FrameOptions(**{field.name: options.pop(field.name) for field in fields(FrameOptions)})
            return cls(
                keys,
                stored.whole(remembered["count"], 1, names.MAX_STEPS),
                FitOptions(**options),
                frame_options,
                tolerance=stored.number(remembered["tolerance"], 0.0),
                colliders=stored.text(remembered.get("colliders", "")),
                weights=remembered.get("weights", "hats"),  # all that earlier versions knew
                also_at=tuple(stored.number(place) for place in stored.plain_list(remembered.get("also_at", []))),
                play_on=remembered.get("play_on", "slider"),
            )
        except (KeyError, TypeError, ValueError, InputError) as error:
            raise InputError("The options of the earlier bake are unknown; bake anew.") from error


@dataclass(frozen=True)
class BakeResult:
    """The result of a bake.

    Parameters
    ----------
    slider
        Name of the custom property that plays the chain, or of the key.
    slider_object
        Name of the object.
    keys
        Names of the generated shape keys, from the first key to the last.
    notes
        Sentences for the user.
    report
        The solver's report with the names above, as plain values that can be written as JSON.
    """

    slider: str
    slider_object: str
    keys: tuple[str, ...]
    notes: tuple[str, ...]
    report: dict[str, Any]

    def summary(self) -> str:
        """One sentence: what was made and where the slider is."""
        seconds = sum(self.report["seconds"].values())
        plays = f"'{self.slider}'" if self.report["on_key"] else f"the slider '{self.slider}'"
        return (
            f"{self.report['count']} in-betweens in {seconds:.1f} s (engine {self.report['engine']}); "
            f"{plays} on '{self.slider_object}' plays them."
        )
