# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""How far the volumes of a mesh's closed components are from those interpolated between the keys of a pair."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats
from ..keys.keypair import KeyPair
from ..triangles.closed_volume import ClosedComponents
from ..triangles.topology import sides, unique_edges, vertex_components

_LEAST_VOLUME = 1e-6  # of the largest volume; a relative deviation of smaller ones means little


class ComponentVolumes:
    """The volumes of the closed components of a pair's mesh, linearly interpolated between the keys.

    Parameters
    ----------
    pair : KeyPair
    """

    def __init__(self, pair: KeyPair) -> None:
        self._vertices, group = pair.welding
        faces = group[pair.faces]
        self._closed = ClosedComponents(faces, vertex_components(unique_edges(sides(faces)), len(self._vertices)))
        self._keys = [self._closed.volumes(key[self._vertices]) for key in (pair.key0, pair.key1)]
        first = np.abs(self._keys[0])
        self._known = first > _LEAST_VOLUME * max(float(first.max(initial=0.0)), 1e-300)

    def deviations(self, shapes: Floats, times: Floats) -> list[float]:
        """For each shape (p, n, 3) at a time (p,), 0..1, the largest relative deviation; none where nothing is closed.

        A component whose interpolated volume is nearly 0 does not count.
        """
        first, second = self._keys
        found = []
        for shape, time in zip(shapes, times, strict=True):
            wanted = (1.0 - time) * first + time * second
            usable = self._known & (np.abs(wanted) > _LEAST_VOLUME * np.abs(first))
            deviation = np.abs(self._closed.volumes(shape[self._vertices]) - wanted)[usable] / np.abs(wanted[usable])
            found += [float(deviation.max())] if usable.any() else []
        return found
