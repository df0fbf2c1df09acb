# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The request for a bake, and its result."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from itertools import pairwise
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
        Frames that show the keys: the first and the last, or one for each key; None to leave what plays the in-betweens
        without keyframes. Frames of inner keys decide where these are on the control, unless the frame options do.
    tolerance
        If positive, the bake makes as few in-betweens as keep every vertex within this distance, in the object's own
        units, and ignores ``count``.
    colliders
        Name of a collection with objects that the in-betweens must not enter; empty for none.
    weights
        How in-betweens are blended: ``smooth``, or ``hats`` for straight lines from each to the next.
    play_on
        What plays them: ``key``, the value of the last key, which must be relative to the first; ``slider``, a new
        custom property; or ``auto``, the key if possible. A key with keyframes of its own plays no keys at frames of
        theirs.
    also_at
        Places of more in-betweens, each between 0 and 1 on the control.
    more
        Whether there may be more in-betweens than ``count`` between keys where volumes would otherwise not be kept.
    """

    keys: tuple[str, ...]
    count: int = 5
    fit_options: FitOptions = field(default_factory=FitOptions)
    frame_options: FrameOptions = field(default_factory=FrameOptions)
    keyframes: tuple[int, ...] | None = None
    tolerance: float = 0.0
    colliders: str = ""
    weights: WeightKind = "smooth"
    also_at: tuple[float, ...] = ()
    play_on: PlayOn = "auto"
    more: bool = False

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
        if self.keyframes is not None:
            _require_frames(self.keyframes, len(self.keys))
        if self.play_on not in get_args(PlayOn):
            raise InputError(f"Unknown control {self.play_on!r}; choose one of {', '.join(get_args(PlayOn))}.")
        _ = self.play_options  # refused here where it is not possible

    @property
    def play_options(self) -> PlayOptions:
        """How a control is to play the motion."""
        return PlayOptions(self.count, self.tolerance, self.weights, self.also_at, self.more)

    @property
    def timed(self) -> BakeRequest:
        """The same request, with the inner keys on the control where their frames are between the first and the last.

        Raises
        ------
        InputError
            If their times are too close.
        """
        if self.keyframes is None or len(self.keyframes) == 2 or self.frame_options.via_at:
            return self
        first, *inner, last = self.keyframes
        via_at = tuple((frame - first) / (last - first) for frame in inner)
        return replace(self, frame_options=replace(self.frame_options, via_at=via_at))

    def remembered(self) -> dict[str, Any]:
        """What a later bake of the same keys needs to know, as plain values."""
        settings = asdict(self.fit_options) | asdict(self.frame_options)
        return {
            "count": self.count,
            "more": self.more,
            "tolerance": self.tolerance,
            "via_at": list(settings.pop("via_at")),
            "settings": settings,
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
            via_at = tuple(stored.number(time) for time in stored.plain_list(remembered.get("via_at", [])))
            frame_options = FrameOptions(options.pop("mode"), options.pop("easing"), via_at)
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
                more=remembered.get("more", False),
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


def _require_frames(frames: tuple[int, ...], keys: int) -> None:
    """Raise InputError unless there are two frames or one for each key, in increasing order."""
    if len(frames) not in (2, keys):
        given = "1 frame is" if len(frames) == 1 else f"{len(frames)} frames are"
        raise InputError(f"{given} given for {keys} keys; give the first and the last, or one for each key.")
    for frame, following in pairwise(frames):
        if frame >= following:
            raise InputError(
                f"Keyframes from {frame} to {following} are not possible; the last must come after the first."
            )
