# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The in-betweens of a key for other programs: shapes at values of the key."""

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
        Names of the keys that play its in-betweens in Blender; in other programs the shapes below replace them.
    places : (p,)
        Values of the key, increasing, in (0, 1).
    offsets : (p, n, 3)
        Offsets of the vertices from the key's base at these values, in the object's own units.
    """

    key: str
    made: frozenset[str]
    places: NDArray[np.float64]
    offsets: NDArray[np.float64]
