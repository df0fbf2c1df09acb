# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What other programs are told of a key's in-betweens: shapes at values of the key."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class InBetweens(NamedTuple):
    """The in-betweens of one key.

    Parameters
    ----------
    key : str
        Name of the key.
    made : frozenset of str
        Names of the keys that play its in-betweens in Blender; elsewhere the shapes below take their place.
    places : (p,)
        Values of the key, between 0 and 1, increasing.
    offsets : (p, n, 3)
        What the key shows there, from what it is relative to, in the object's own units.
    """

    key: str
    made: frozenset[str]
    places: NDArray[np.float64]
    offsets: NDArray[np.float64]
