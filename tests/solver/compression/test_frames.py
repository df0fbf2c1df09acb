# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames of a surface, compressed and decompressed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.compression import frames as frame_compression
from qc3d_addon.solver.compression.files import from_bytes
from qc3d_addon.solver.errors import InputError

from ..meshes import icosphere

POINTS, FACES = icosphere(3)
UNIT = 40.0  # frames in their own unit, away from the origin


def frames() -> Floats:
    """A ball that is bent more and more."""
    shapes = []
    for amount in np.linspace(0.0, 0.4, 4):
        x, y, z = (POINTS - 0.5).T
        shapes.append(np.column_stack([x, y + amount * x**2, z * (1.0 + 0.5 * amount * y)]))
    return UNIT * np.array(shapes) + 100.0


@pytest.mark.slow
@pytest.mark.parametrize("error", [3e-3, 1e-5])
def test_frames_come_back_within_the_error(error: float) -> None:
    wanted = frames()
    compressor = frame_compression.compressor(wanted, FACES, 8)
    choice = compressor.with_error(error)
    data = compressor.packer.bytes_of(choice.compressed)
    found = frame_compression.restored(wanted[0], from_bytes(data, frame_compression.source_of(wanted[0], FACES)))
    assert found.shape == wanted.shape
    np.testing.assert_array_equal(found[0], wanted[0])
    missed = np.sqrt(((found - wanted) ** 2).sum(axis=2).mean(axis=1)) / np.linalg.norm(np.ptp(wanted[0], axis=0))
    assert missed.max() <= error * (1.0 + 1e-9)
    assert missed.max() == pytest.approx(choice.error, rel=1e-6)
    if error == 1e-5:  # of few numbers, the header is a large part
        assert len(data) < len(compressor.quantized_coordinates(choice.error).data)


@pytest.mark.slow
def test_modes_alone_follow_the_frames() -> None:
    wanted = frames()
    compressor = frame_compression.compressor(wanted, FACES, 16)
    still = float(np.sqrt(((wanted[1:] - wanted[0]) ** 2).sum(axis=2).mean(axis=1)).max())
    choice = compressor.with_modes(16)
    assert choice.compressed.remainder is None
    assert choice.folds == (0, 0, 0)
    assert choice.error * np.linalg.norm(np.ptp(wanted[0], axis=0)) < 0.1 * still


def test_nothing_to_store() -> None:
    with pytest.raises(InputError, match="no frame after it"):
        frame_compression.compressor(frames()[:1], FACES, 4)
    with pytest.raises(InputError, match="in one place"):
        frame_compression.compressor(np.zeros((3, 5, 3)), FACES, 4)


def test_a_placement_of_something_else() -> None:
    wanted = frames()
    compressor = frame_compression.compressor(wanted, FACES, 0)
    choice = compressor.with_error(1e-2)
    data = compressor.packer.bytes_of(choice.compressed)
    content = from_bytes(data, frame_compression.source_of(wanted[0], FACES))
    with pytest.raises(InputError, match="not inside the cube"):
        frame_compression.restored(wanted[0], replace(content, placement=(0.0, 0.0, 0.0, 1.0)))
    with pytest.raises(InputError, match="another mesh"):
        from_bytes(data, frame_compression.source_of(wanted[1], FACES))
