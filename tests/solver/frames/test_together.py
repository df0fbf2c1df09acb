# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Several meshes in one map: what coincides stays together, and each mesh meets its own keys."""

from __future__ import annotations

import numpy as np
import pytest

import qc3d_addon as qc3d
from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.frames.task import Task, carry_out
from qc3d_addon.solver.frames.together import PlacedMesh, Together
from qc3d_addon.solver.keys.halves import MirrorPlane
from qc3d_addon.solver.keys.keypair import consecutive_pairs
from qc3d_addon.solver.numerics.rotations import rotation_matrices
from qc3d_addon.solver.settings import FrameOptions
from qc3d_addon.solver.support.progress import finish

from ..meshes import arced, box_surface

pytestmark = pytest.mark.usefixtures("coarse_volume")

BODY, FACES = box_surface((2, 2, 8), (1.0, 1.0, 5.0))
ENDS = ("rest", "bent")


def sleeve() -> tuple[Floats, Ints, Ints]:
    """A band around the body's upper half, of the body's own vertices; which these are."""
    chosen = FACES[(BODY[FACES][:, :, 2] > 3.0).all(axis=1) & (BODY[FACES][:, :, 2] < 4.9).any(axis=1)]
    used, corners = np.unique(chosen, return_inverse=True)
    return BODY[used], corners.reshape(-1, 3), used


def test_what_coincides_stays_together() -> None:
    points, faces, used = sleeve()
    body, band = qc3d.bake_together([([BODY, arced(BODY, 1.2)], FACES), ([points, arced(points, 1.2)], faces)], 3)
    assert np.array_equal(band.frames, body.frames[:, used])
    apart = qc3d.bake([points, arced(points, 1.2)], faces, 3)
    assert np.abs(apart.frames[2] - body.frames[2][used]).max() > 1e-4
    for bake, key in ((body, BODY), (band, points)):
        assert np.array_equal(bake.frames[0], key)
        assert np.array_equal(bake.frames[-1], arced(key, 1.2))
        assert bake.report.vertices == len(key)
        assert bake.report.worst_stretch.vertex < len(key)
        assert all(values.shape == (5, len(key)) for values in bake.measures.values())
    still = (arced(BODY, 1.2) == BODY).all(axis=1)
    assert np.array_equal(body.frames[:, still], np.broadcast_to(BODY[still], (5, still.sum(), 3)))


def test_meshes_in_places_of_their_own() -> None:
    """Objects that are moved, turned, stretched and mirrored: seams between them stay shut where they are shown."""
    points, faces, used = sleeve()
    bent = arced(BODY, 1.2)
    matrix = np.eye(4)
    matrix[:3, :3] = rotation_matrices(np.array([[0.4, -0.2, 0.9]]))[0] * [0.5, -2.0, 1.5]
    matrix[:3, 3] = 3.0, -1.0, 2.0
    back = np.linalg.inv(matrix[:3, :3]).T
    seen = [((shape - matrix[:3, 3]) @ back).astype(np.float32) for shape in (points, bent[used])]
    meshes = [
        PlacedMesh(consecutive_pairs(dict(zip(ENDS, (BODY, bent), strict=True)), FACES, None, ENDS), np.eye(4)),
        PlacedMesh(consecutive_pairs(dict(zip(ENDS, seen, strict=True)), faces[:, ::-1], None, ENDS), matrix),
    ]
    together = Together(meshes)
    assert len(together.pairs[ENDS].welding[0]) == len(BODY)
    outcome = finish(carry_out(Task(together.pairs, ENDS, times=np.linspace(0.0, 1.0, 4))))
    assert outcome.bake is not None
    body, band = together.apart(outcome.bake, FrameOptions(), ENDS)
    assert np.array_equal(band.frames[0], seen[0])
    assert np.array_equal(band.frames[-1], seen[1])
    shown = [meshes[1].shared(frame) for frame in band.frames]
    assert max(np.abs(a - b[used]).max() for a, b in zip(shown, body.frames, strict=True)) < 1e-5


def test_a_half_beside_a_whole() -> None:
    half = FACES[(BODY[FACES][:, :, 0] > -1e-9).all(axis=1)]
    used, corners = np.unique(half, return_inverse=True)
    keys = dict(zip(ENDS, (BODY[used], BODY[used] * [1.2, 1.0, 0.9]), strict=True))
    pairs = consecutive_pairs(keys, corners.reshape(-1, 3), None, ENDS, None, [MirrorPlane.across(0, 1e-6)])
    other = consecutive_pairs(dict(zip(ENDS, (BODY + 3.0, BODY + 4.0), strict=True)), FACES, None, ENDS)
    together = Together([PlacedMesh(pairs, np.eye(4)), PlacedMesh(other, np.eye(4))])
    outcome = finish(carry_out(Task(together.pairs, ENDS, times=np.array([0.0, 0.4, 1.0]))))
    assert outcome.bake is not None
    bakes = together.apart(outcome.bake, FrameOptions(), ENDS)
    assert [bake.frames.shape[1] for bake in bakes] == [len(used), len(BODY)]
    assert not bakes[0].frames[:, BODY[used][:, 0] == 0.0, 0].any()


def test_refused() -> None:
    pairs = consecutive_pairs(dict(zip(ENDS, (BODY, 2.0 * BODY), strict=True)), FACES, None, ENDS)
    with pytest.raises(InputError, match="no meshes"):
        Together([])
    with pytest.raises(InputError, match="different names"):
        Together([PlacedMesh(pairs, np.eye(4)), PlacedMesh({("a", "b"): pairs[ENDS]}, np.eye(4))])
    with pytest.raises(InputError, match="has the scale 0 along an axis"):
        Together([PlacedMesh(pairs, np.diag([1.0, 0.0, 1.0, 1.0]))])
    with pytest.raises(InputError, match="all need the same two or more"):
        qc3d.bake_together([([BODY], FACES)])
    with pytest.raises(InputError, match="2, 3 keys"):
        qc3d.bake_together([([BODY, BODY], FACES), ([BODY, BODY, BODY], FACES)])
