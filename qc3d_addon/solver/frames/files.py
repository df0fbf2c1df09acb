# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames written to .npz files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..arrays import Floats
from ..files.npz import write_arrays
from ..keys.keypair import KeyPair


def write_frames(path: Path, pairs: Sequence[KeyPair], times: Floats, frames: Floats) -> None:
    """Write frames (k, n, 3) at ``times`` (k,) with the faces, the first and the last key of the pairs, compressed.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    ends = {"key0": pairs[0].key0, "key1": pairs[-1].key1}
    write_arrays(path, {"faces": pairs[0].faces, "frames": frames, "times": times, **ends})
