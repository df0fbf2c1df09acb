# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The same mesh, keys, settings and kept map give bit-identical frames in any process."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from qc3d_addon.solver.fit.storage import from_bytes
from qc3d_addon.solver.frames.bake import Bake, evenly_spaced
from qc3d_addon.solver.frames.task import Outcome, Task, carry_out
from qc3d_addon.solver.meshing.cube import fill_cube
from qc3d_addon.solver.settings import Engine, FitOptions, FrameOptions, Mode
from qc3d_addon.solver.support.progress import finish
from qc3d_addon.worker import client

from ..fuzz.mesh_cases import coarser
from ..solver.baking import engine_available
from ..solver.meshes import arced, box_surface, icosphere

KEYS = ("Basis", "Bent")


def task_with(
    engine: Engine, mode: Mode = "natural", seed: int = 3, kept: dict[tuple[str, str], bytes] | None = None
) -> Task:
    points, faces = box_surface((2, 2, 8), (1.0, 1.0, 5.0))
    options = FitOptions(engine=engine, seed=seed), FrameOptions(mode)
    shapes = {"Basis": points, "Bent": arced(points, 0.9)}
    return replace(Task.of_keys(shapes, faces, None, KEYS, *options, evenly_spaced(2)), kept=kept or {})


def frames_of(outcome: Outcome) -> bytes:
    assert isinstance(outcome.bake, Bake)
    measures = sorted(outcome.bake.measures.items())
    return outcome.bake.frames.tobytes() + b"".join(values.tobytes() for _, values in measures)


def digest_of_a_bake(engine: Engine, mode: Mode) -> str:
    coarser()
    return hashlib.sha256(frames_of(finish(carry_out(task_with(engine, mode))))).hexdigest()


@pytest.mark.parametrize("mode", ["natural", "linear", "straight"])
def test_other_processes_with_other_hashes_give_the_same(mode: Mode, repository: Path) -> None:
    program = f"from tests.worker.test_determinism import digest_of_a_bake as d; print(d('delaunay', {mode!r}))"
    found = set()
    for hashes in ("0", "1", "2"):
        environment = {**os.environ, "PYTHONHASHSEED": hashes}
        done = subprocess.run(
            [sys.executable, "-c", program], cwd=repository, env=environment, capture_output=True, text=True, check=True
        )
        found.add(done.stdout.strip())
    assert len(found) == 1


def test_another_seed_gives_another_mesh_and_other_frames() -> None:
    one, other = (finish(carry_out(task_with("delaunay", seed=seed))) for seed in (3, 4))
    assert frames_of(one) != frames_of(other)


def test_the_seeded_mesh_is_the_same_bit_for_bit() -> None:
    meshes = [fill_cube(*icosphere(2), FitOptions(seed=5)).mesh for _ in range(2)]
    np.testing.assert_array_equal(meshes[0].points, meshes[1].points)
    np.testing.assert_array_equal(meshes[0].tets, meshes[1].tets)


@pytest.mark.parametrize("engine", ["delaunay", "tetwild"])
def test_a_kept_map_gives_the_same_frames_again(engine: Engine) -> None:
    """fTetWild makes another mesh at every call; the one that is kept with the bake is used again."""
    if not engine_available(engine):
        pytest.skip(f"the engine {engine} cannot run here")
    first = client.run(task_with(engine))
    again = task_with(engine, kept=first.fits)
    assert again.new_fits == 0
    outcomes = [first, client.run(again), finish(carry_out(again))]
    assert len({frames_of(outcome) for outcome in outcomes}) == 1
    assert all(outcome.fits == first.fits for outcome in outcomes)


def test_a_kept_map_serves_another_number_of_frames() -> None:
    first = client.run(task_with("delaunay"))
    denser = replace(task_with("delaunay", kept=first.fits), times=evenly_spaced(5))
    found = finish(carry_out(denser)).bake
    assert found is not None
    assert first.bake is not None
    # To rounding: frames are solved a few together.
    np.testing.assert_allclose(found.frames[::2], first.bake.frames, rtol=0.0, atol=1e-12)
    mesh = from_bytes(first.fits[KEYS], denser.pairs[KEYS]).mesh
    assert len(mesh.tets) > 100
