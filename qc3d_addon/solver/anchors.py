# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Where vertices are drawn to when there is no volume yet: every component along the screw motion between its keys."""

from __future__ import annotations

import numpy as np

from .embedding import RigidMotion
from .tetmesh import Bools, Floats, Ints


class ScrewAnchors:
    """Each connected component moves along its own screw; what is left goes straight.

    A component with still vertices, or with fewer than three vertices, has no screw motion of its own.

    Parameters
    ----------
    key0, key1 : (n, 3)
    still : (n,) bool
    weights : (n,)
        Positive weights of the vertices in the fit of the screws.
    labels : (n,) int64
        Component of every vertex.
    """

    def __init__(self, key0: Floats, key1: Floats, still: Bools, weights: Floats, labels: Ints) -> None:
        self._key0 = key0
        self._parts: list[tuple[Ints, RigidMotion]] = []
        order = np.argsort(labels, kind="stable")
        starts = np.flatnonzero(np.diff(labels[order], prepend=-1))
        for members in np.split(order, starts[1:]):
            if len(members) >= 3 and not still[members].any():
                self._parts.append((members, RigidMotion.between(key0[members], key1[members], weights[members])))
        self._missing = key1 - self._moved(1.0)

    def _moved(self, time: float) -> Floats:
        moved = self._key0.copy()
        for members, motion in self._parts:
            moved[members] = motion.apply(self._key0[members], time)
        return moved

    def positions(self, time: float) -> Floats:
        """(n, 3) anchors at ``time``; the keys at 0 and 1."""
        return self._moved(time) + time * self._missing
