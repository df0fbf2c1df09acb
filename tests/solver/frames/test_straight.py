# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Mode ``straight``: straight lines between the keys, without a map."""

from __future__ import annotations

import json

import numpy as np
import pytest

from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.frames import task as tasks
from qc3d_addon.solver.frames.bake import Bake
from qc3d_addon.solver.frames.task import Task, carry_out
from qc3d_addon.solver.settings import FrameOptions
from qc3d_addon.solver.support.progress import finish

from ..meshes import box_surface, twisted

BAR, FACES = box_surface((1, 1, 3), (1.0, 1.0, 3.0))
SHAPES = {"a": BAR, "b": twisted(BAR, 1.0), "c": BAR * [-1.0, 1.0, 1.0]}
NO_EDGES = np.empty((0, 2), dtype=np.int64)


def straight(through: tuple[str, ...], times: list[float], **choices: str) -> Bake:
    options = FrameOptions("straight", **choices)  # type: ignore[arg-type]
    task = Task.of_keys(SHAPES, FACES, NO_EDGES, through, frame_options=options, times=times)
    assert task.new_fits == 0
    outcome = finish(carry_out(task))
    assert outcome.fits == {}
    assert outcome.bake is not None
    return outcome.bake


def test_frames_are_on_the_lines() -> None:
    bake = straight(("a", "c"), [0.0, 0.25, 1.0])
    np.testing.assert_allclose(bake.frames, [BAR, BAR + 0.25 * (SHAPES["c"] - BAR), SHAPES["c"]], rtol=0.0, atol=1e-15)
    np.testing.assert_array_equal(bake.frames[[0, 2]], [BAR, SHAPES["c"]])
    assert json.loads(json.dumps(bake.report.as_json(), allow_nan=False))["residual"] is None
    assert bake.report.worst_stretch.excess == pytest.approx(0.5)  # edges across are half as long


def test_a_chain_with_easing_meets_every_key() -> None:
    bake = straight(("a", "b", "c"), [0.0, 0.5, 0.75, 1.0], easing="ease-in")
    along = 2.0 * 0.75**2 - 1.0
    expected = SHAPES["b"] + along * (SHAPES["c"] - SHAPES["b"])
    np.testing.assert_allclose(bake.frames[[0, 3]], [BAR, SHAPES["c"]], atol=0.0)
    np.testing.assert_allclose(bake.frames[2], expected, atol=1e-15)


@pytest.mark.parametrize(
    "keys",
    [
        (BAR[:1], BAR[1:2]),
        (BAR[:1], BAR[:1]),
        (BAR[:3], BAR[1:4]),
        (BAR * [1, 0, 1], BAR * [1, 1, 0]),
        (np.zeros_like(BAR), BAR),
        (BAR, np.ones_like(BAR)),
        (np.zeros_like(BAR), np.ones_like(BAR)),
        (1e300 * BAR, -1e300 * BAR),
        (1e-300 * BAR, 1e300 * BAR),
        (1e300 * BAR, 1e-310 * BAR),
        (1e-310 * BAR, -1e-310 * BAR),
    ],
    ids=lambda keys: f"{keys[0].shape[0]} vertices, {np.ptp(keys[0]):.0e} to {np.ptp(keys[1]):.0e}",
)
def test_nothing_that_is_finite_is_refused(keys: tuple[np.ndarray, np.ndarray]) -> None:
    faces = FACES if len(keys[0]) == len(BAR) else NO_EDGES.reshape(0, 3)
    task = Task.of_keys(
        dict(zip("ab", keys, strict=True)), faces, NO_EDGES, ("a", "b"), frame_options=FrameOptions("straight"),
        times=[0.0, 0.25, 1.0],
    )
    with np.errstate(all="raise", under="ignore"):
        bake = finish(carry_out(task)).bake
    assert bake is not None
    expected = [keys[0], 0.75 * keys[0] + 0.25 * keys[1], keys[1]]
    np.testing.assert_allclose(bake.frames, expected, rtol=1e-12, atol=1e-14 * np.abs(keys).max())
    json.dumps(bake.report.as_json(), allow_nan=False)


@pytest.mark.parametrize("scale", [1e-74, 1e-30, 1e30, 1e74])
def test_keys_of_any_size(scale: float) -> None:
    shapes = {name: scale * shape for name, shape in SHAPES.items()}
    task = Task.of_keys(shapes, FACES, NO_EDGES, ("a", "b"), frame_options=FrameOptions("straight"), times=[0.5])
    with np.errstate(all="raise", under="ignore"):
        bake = finish(carry_out(task)).bake
    assert bake is not None
    assert bake.report.crossings == straight(("a", "b"), [0.5]).report.crossings


def test_no_map_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tasks, "fit_pair", None)
    straight(("a", "b"), [0.5])


@pytest.mark.parametrize("mode", ["straight", "natural", "linear"])
@pytest.mark.parametrize("time", [1.5, float("nan")])
def test_times_that_are_none_are_refused_before_any_work(mode: str, time: float) -> None:
    options = FrameOptions(mode)  # type: ignore[arg-type]
    steps = carry_out(Task.of_keys(SHAPES, FACES, NO_EDGES, ("a", "b"), frame_options=options, times=[time]))
    with pytest.raises(InputError, match="from 0"):
        next(steps)
