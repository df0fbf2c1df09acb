# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The collider at the times of the frames: fixed, or following its own shapes from key to key."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from ..arrays import Floats
from ..collision.colliders import Collider, PosedCollider
from ..errors import InputError, QC3DError
from ..fit.fit_pair import fit_pair
from ..keys.keypair import Ends, KeyPair, consecutive_pairs
from ..settings import FitOptions, FrameOptions
from ..support.progress import Steps, finish, numbered
from .chain import chain_frames
from .key_times import KeyTimes
from .modes import needs_fits


class Following:
    """A collider interpolated from key to key, by natural in-betweens, or along straight lines in mode ``straight``.

    Parameters
    ----------
    collider : Collider
    times : (k,)
        Times of the frames, 0..1.
    fit_options : FitOptions
        Fit options of the mesh; its extra turns do not apply to the collider.
    frame_options : FrameOptions
        Frame options of the mesh.

    Attributes
    ----------
    fits : int
        Number of fits that are needed.
    notes : list of str
        Sentences for the user; complete once the collider is posed.
    """

    def __init__(
        self, collider: Collider, times: Floats, fit_options: FitOptions, frame_options: FrameOptions
    ) -> None:
        self._collider, self._times = collider, times
        self._fit_options = replace(fit_options, extra_turns=0)
        self._frame_options = replace(frame_options, mode="natural")
        self._through = _names(collider.shapes)
        self.notes: list[str] = []
        self._pairs: dict[Ends, KeyPair] = {}
        if collider.moves and needs_fits(frame_options.mode):
            try:
                self._pairs = consecutive_pairs(
                    dict(zip(self._through, collider.shapes, strict=True)), collider.faces, None, self._through
                )
            except InputError as error:
                self._go_straight(error)

    @property
    def fits(self) -> int:
        return len(self._pairs)

    def posed(self) -> Steps[PosedCollider]:
        """The collider at all times."""
        if self._pairs:
            try:
                return PosedCollider(self._collider, (yield from self._natural()))
            except QC3DError as error:
                self._go_straight(error)
        return PosedCollider(self._collider, self._straight())

    def _natural(self) -> Steps[Floats]:
        fitted = {}
        for number, (ends, pair) in enumerate(self._pairs.items()):
            fitted[ends] = yield from numbered(fit_pair(pair, self._fit_options), number, len(self._pairs))
        along = list(pairwise(self._through))
        # The collider's frames take little time compared with the mesh's, so their progress is not reported.
        pairs, fits = [self._pairs[ends] for ends in along], [fitted[ends] for ends in along]
        return finish(chain_frames(pairs, fits, self._times, self._frame_options)).frames

    def _straight(self) -> Floats:
        shapes = self._collider.shapes
        if not self._collider.moves:
            return np.broadcast_to(shapes[0], (len(self._times), *shapes[0].shape))
        number, local = KeyTimes.of(self._frame_options, len(shapes) - 1).split(self._times)
        time = local[:, None, None]
        return np.asarray((1.0 - time) * shapes[number] + time * shapes[number + 1])

    def _go_straight(self, error: QC3DError) -> None:
        self._pairs = {}
        self.notes = [f"The colliders move along straight lines between the keys. {error}"]


def _names(shapes: Floats) -> tuple[str, ...]:
    """A name for each of the collider's shapes (k, c, 3); equal shapes share a name, but never two in a row."""
    names: list[str] = []
    for number, shape in enumerate(shapes):
        same = (names[other] for other in range(number - 1) if np.array_equal(shapes[other], shape))
        earlier = next(same, None)
        names.append(str(number) if earlier is None or earlier == names[-1] else earlier)
    return tuple(names)
