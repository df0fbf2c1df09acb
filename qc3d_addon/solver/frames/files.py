# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames written to .npz files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..arrays import Floats
from ..keys.keypair import KeyPair


def write_frames(path: Path, pairs: Sequence[KeyPair], times: Floats, frames: Floats) -> None:
    """Write frames (k, n, 3) at ``times`` (k,) with the faces, the first and the last key of the pairs, compressed.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    with path.open("wb") as file:
        np.savez_compressed(
            file, faces=pairs[0].faces, frames=frames, times=times, key0=pairs[0].key0, key1=pairs[-1].key1
        )
