# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Frames as keys and settings, baked again by the reader."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.collision.colliders import Collider
from qc3d_addon.solver.compression.compact import from_bytes, to_bytes
from qc3d_addon.solver.compression.files import Source
from qc3d_addon.solver.compression.pack import small_frames, unpacked
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.frames.bake_settings import Settings
from qc3d_addon.solver.frames.remade import Inputs, remade, restored, small_bake
from qc3d_addon.solver.frames.task import Task, carry_out
from qc3d_addon.solver.settings import FitOptions, FrameOptions
from qc3d_addon.solver.support.progress import finish

from ..meshes import bent, box_surface, icosphere

POINTS, FACES = box_surface((4, 4, 12), (0.2, 0.2, 0.6))
SHAPES = {"straight": POINTS, "bent": bent(POINTS, 1.2), "back": bent(POINTS, -0.6)}
POLYGONS = np.arange(len(FACES)) // 2


def baked(through: tuple[str, ...], times: Floats, **options: str) -> tuple[Task, Floats]:
    task = Task.of_keys(
        SHAPES, FACES, None, through, FitOptions(), FrameOptions(**options), times, polygons=POLYGONS, mirror="none"
    )
    bake = finish(carry_out(task)).bake
    assert bake is not None
    return task, bake.frames


class TestSettings:
    @pytest.mark.parametrize(
        "settings",
        [
            Settings((0, 3)),
            Settings((0, 2), (0.0, 0.1, 1.0), FitOptions(seed=3), FrameOptions("linear", "ease-in")),
            Settings((0, 2, 5), frame_options=FrameOptions(via_at=(0.3,))),
            Settings((0, 2), mirror="xz"),
        ],
    )
    def test_there_and_back(self, settings: Settings) -> None:
        assert Settings.of_text(settings.text) == settings

    @pytest.mark.parametrize(
        "text",
        [
            "",
            "[]",
            "[" * 5000,
            '{"at":[0]}',
            '{"at":[1,3]}',
            '{"at":[0,3,2]}',
            '{"at":[0,true]}',
            '{"at":[0,1],"more":1}',
            '{"at":[0,1],"times":["x"]}',
            '{"at":[0,1],"fit":{"unknown":1}}',
            '{"at":[0,1],"fit":{"quality":"best"}}',
            '{"at":[0,1],"frame":[]}',
            '{"at":[0,1],"mirror":"auto"}',
            '{"at":[0,1],"mirror":"w"}',
            '{"at":[0,1],"mirror":[]}',
        ],
    )
    def test_what_makes_no_sense(self, text: str) -> None:
        with pytest.raises(InputError):
            Settings.of_text(text)

    def test_of_a_task(self) -> None:
        times = np.array([0.0, 0.2, 0.5, 1.0])
        task, frames = baked(("straight", "bent", "back"), times, mode="straight")
        assert Settings.of_task(task, frames) == Settings(
            (0, 2, 3), tuple(times), FitOptions(), FrameOptions(mode="straight")
        )
        assert Settings.of_task(replace(task, times=times[[0, 1, 3]]), frames[[0, 1, 3]]) is None
        assert Settings.of_task(task, frames + 1.0) is None


@pytest.fixture(scope="module")
def bake() -> tuple[Task, Floats]:
    return baked(("straight", "bent", "back"), np.linspace(0.0, 1.0, 9))


@pytest.mark.slow
class TestBakes:
    @pytest.mark.parametrize("error", [1e-4, 1e-5])
    def test_smaller_than_without_baking_and_within_the_error(self, bake: tuple[Task, Floats], error: float) -> None:
        task, frames = bake
        settings = Settings.of_task(task, frames)
        assert settings is not None
        small = finish(small_bake(frames, FACES, error, settings, POLYGONS))
        assert small.way.startswith("remade")
        assert len(small.data) < len(finish(small_frames(frames, FACES, error)).data)
        source = Source("frames", frames[0], FACES)
        back = finish(restored(small.data, Inputs(source, POLYGONS)))
        np.testing.assert_allclose(back, small.restored, atol=1e-9)
        unit = np.linalg.norm(np.ptp(frames[0], axis=0))
        assert np.sqrt(((back - frames[1:]) ** 2).sum(axis=2).mean(axis=1)).max() <= error * unit * (1.0 + 1e-6)
        with pytest.raises(InputError, match="have to be made again"):
            unpacked(small.data, source)
        with pytest.raises(InputError, match="with the mesh's polygons"):
            finish(restored(small.data, Inputs(source)))

    def test_a_machine_that_bakes_other_frames(self, bake: tuple[Task, Floats]) -> None:
        task, frames = bake
        settings, source = Settings.of_task(task, frames), Source("frames", frames[0], FACES)
        assert settings is not None
        small = finish(small_bake(frames, FACES, 1e-4, settings, POLYGONS))
        packed, space = from_bytes(small.data, source)
        assert packed.remaking is not None
        other = replace(packed, remaking=replace(packed.remaking, check=packed.remaking.check + 1e-3))
        with pytest.raises(InputError, match="come out differently"):
            finish(restored(to_bytes(source, space, other), Inputs(source, POLYGONS)))

    @pytest.mark.parametrize(
        "settings",
        [
            Settings((0, 20_000)),
            Settings(tuple(range(100))),
            Settings((0, 8), fit_options=FitOptions(mesh_time_limit=1e9)),
            Settings((0, 7)),
            Settings((0, 8), (0.0, 1.0)),
        ],
    )
    def test_files_that_would_take_hours_or_do_not_fit(self, bake: tuple[Task, Floats], settings: Settings) -> None:
        with pytest.raises(InputError):
            finish(remade(Inputs.of(bake[1][0], FACES), bake[1][-1:], settings, max(settings.at[-1], 8)))

    def test_keys_that_nothing_can_be_made_of_are_stored(self, bake: tuple[Task, Floats]) -> None:
        _, frames = bake
        small = finish(small_bake(frames, FACES, 1e-3, Settings((0, 3)), POLYGONS))
        assert small.way in ("levels", "modes", "plain")


def _is_small(task: Task, frames: Floats, error: float) -> None:
    """The file of a bake is made again, smaller than the stored frames, and comes back within the error."""
    pair, settings = task.pairs[task.through[:2]].own, Settings.of_task(task, frames)
    assert settings is not None
    inputs = Inputs.of(frames[0], pair.faces, pair.polygons, task.collider)
    small = finish(small_bake(frames, pair.faces, error, settings, pair.polygons, task.collider))
    assert small.way.startswith("remade")
    assert len(small.data) < len(finish(small_frames(frames, pair.faces, error)).data)
    back = finish(restored(small.data, inputs))
    unit = np.linalg.norm(np.ptp(frames[0], axis=0))
    assert np.sqrt(((back - frames[1:]) ** 2).sum(axis=2).mean(axis=1)).max() <= error * unit * (1.0 + 1e-6)
    if task.collider is not None:
        with pytest.raises(InputError, match="made with a collider"):
            finish(restored(small.data, Inputs(inputs.source, inputs.polygons)))


@pytest.mark.slow
def test_half_of_a_mesh() -> None:
    points, faces = box_surface((4, 4, 12), (0.2, 0.2, 0.6))
    points[:, 0] -= points[:, 0].min()
    half = faces[~(points[faces][:, :, 0] == 0.0).all(axis=1)]
    shapes = {"straight": points, "bent": bent(points[:, [1, 0, 2]], 1.0)[:, [1, 0, 2]]}
    times = np.linspace(0.0, 1.0, 9)
    task = Task.of_keys(shapes, half, None, ("straight", "bent"), FitOptions(), FrameOptions(), times)
    assert task.pairs["straight", "bent"].planes
    bake = finish(carry_out(task)).bake
    assert bake is not None
    assert Settings.of_task(task, bake.frames) == Settings((0, 8), mirror="x")
    _is_small(task, bake.frames, 1e-4)


@pytest.mark.slow
def test_what_does_not_enter_a_collider(bake: tuple[Task, Floats]) -> None:
    _, free = bake
    tip = free[2][np.argmax(POINTS[:, 2])]
    ball, ball_faces = icosphere(2)
    ball = tip + 0.05 * (ball - ball.mean(axis=0)) / np.ptp(ball, axis=0).max()
    collider = Collider.checked(ball[None], ball_faces).at_keys(3)
    through, times = ("straight", "bent", "back"), np.linspace(0.0, 1.0, 9)
    task = Task.of_keys(SHAPES, FACES, None, through, times=times, collider=collider, polygons=POLYGONS, mirror="none")
    made = finish(carry_out(task)).bake
    assert made is not None
    assert np.abs(made.frames - free).max() > 1e-3
    _is_small(task, made.frames, 1e-4)
