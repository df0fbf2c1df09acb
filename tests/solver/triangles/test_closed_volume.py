# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes of closed components, their gradients, and the step that restores them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Floats, Ints
from qc3d_addon.solver.surface.volumes import MovingVolumes
from qc3d_addon.solver.triangles.closed_volume import ClosedComponents
from qc3d_addon.solver.triangles.topology import sides, vertex_components

from ..meshes import box_surface, enclosed_volume, icosphere

BOX, BOX_FACES = box_surface((2, 2, 3), (1.0, 2.0, 4.0))
BALL, BALL_FACES = icosphere(1)


def components_of(points: Floats, faces: Ints) -> ClosedComponents:
    return ClosedComponents(faces, vertex_components(sides(faces), len(points)))


def moving_in(components: ClosedComponents, moving: Ints) -> MovingVolumes:
    """All vertices are given, the moving ones first."""
    even = (components.faces, np.ones(len(components.faces)))
    return MovingVolumes(components, even, moving, order_of(len(components.labels), moving))


def order_of(count: int, moving: Ints) -> Ints:
    return np.concatenate([moving, np.setdiff1d(np.arange(count), moving)])


def joined(*parts: tuple[Floats, Ints]) -> tuple[Floats, Ints]:
    starts = np.cumsum([0, *(len(points) for points, _ in parts)])
    points = np.concatenate([points for points, _ in parts])
    return points, np.concatenate([faces + start for (_, faces), start in zip(parts, starts, strict=False)])


class TestVolumes:
    def test_a_box(self) -> None:
        assert components_of(BOX, BOX_FACES).volumes(BOX) == pytest.approx([8.0], rel=1e-14)

    def test_reversed_counts_negative(self) -> None:
        assert components_of(BOX, BOX_FACES[:, ::-1]).volumes(BOX) == pytest.approx([-8.0], rel=1e-14)

    @pytest.mark.parametrize("size", [1e-9, 1.0])
    @pytest.mark.parametrize("place", [0.0, 0.5, 1e4])
    def test_small_and_far(self, size: float, place: float) -> None:
        points = place + size * (BALL - BALL[0])
        exact = enclosed_volume(points - points[0], BALL_FACES)
        assert components_of(points, BALL_FACES).volumes(points) == pytest.approx([exact], rel=1e-12)

    def test_reversal_by_degrees(self) -> None:
        components = components_of(BOX, BOX_FACES)
        for scale, expected in ((1.0, 0.0), (0.0, 0.0), (-1.0, 1.0), (-0.5, 1.0)):
            assert components.reversal(BOX, BOX * [1.0, 1.0, scale]) == pytest.approx([expected])
        flat = [float(components.reversal(BOX, BOX * [1.0, 1.0, scale])[0]) for scale in np.linspace(0.0, -0.5, 2000)]
        assert np.all(np.diff(flat) >= 0.0)
        assert max(np.diff(flat)) < 0.05
        assert components.reversal(BOX, -3.0 * BOX) == pytest.approx([1.0])  # whatever the size

    def test_each_component_its_own(self) -> None:
        points, faces = joined((BOX, BOX_FACES), (0.1 * BOX + [0, 0, 1], BOX_FACES), (BALL + 7.0, BALL_FACES))
        found = components_of(points, faces).volumes(points)
        assert found == pytest.approx([8.0, 0.008, enclosed_volume(BALL, BALL_FACES)], rel=1e-12)

    def test_only_closed_components_have_one(self) -> None:
        points, faces = joined((BOX, BOX_FACES[1:]), (BALL, BALL_FACES))
        components = components_of(np.concatenate([points, [[9.0, 9.0, 9.0]]]), faces)
        assert len(components.faces) == len(BALL_FACES)
        found = components.volumes(np.concatenate([points, [[9.0, 9.0, 9.0]]]))
        assert found == pytest.approx([0.0, enclosed_volume(BALL, BALL_FACES), 0.0])

    @pytest.mark.parametrize("faces", [BOX_FACES[1:], BOX_FACES[:0], np.concatenate([BOX_FACES, BOX_FACES[:1]])])
    def test_none_closed(self, faces: Ints) -> None:
        components = components_of(BOX, faces)
        assert not len(components.faces)
        assert not components.volumes(BOX).any()
        assert moving_in(components, np.arange(len(BOX))).empty


class TestGradient:
    @given(st.integers(0, 2**32 - 1))
    def test_derivative_of_the_volumes(self, seed: int) -> None:
        random = np.random.default_rng(seed)
        points, faces = joined((BOX, BOX_FACES), (BALL, BALL_FACES))
        points = points + 0.1 * random.normal(size=points.shape)
        moving = random.permutation(len(BOX))[: random.integers(1, len(BOX) + 1)]
        direction = np.zeros_like(points)
        direction[moving] = random.normal(size=(len(moving), 3))
        components = components_of(points, faces)
        step = 1e-4
        ahead, behind = (components.volumes(points + sign * step * direction) for sign in (1.0, -1.0))
        volumes = moving_in(components, moving)
        _, slope = volumes.with_slope(points[order_of(len(points), moving)].T)
        # The volume is cubic: what central differences miss is the third derivative.
        found = volumes.changes(slope, direction[moving].T)
        np.testing.assert_allclose((ahead - behind) / (2.0 * step), [found[0], 0.0], rtol=0.0, atol=1e-6)

    @given(st.integers(0, 2**32 - 1))
    def test_what_moves_and_what_rests_enclose_the_volumes_together(self, seed: int) -> None:
        random = np.random.default_rng(seed)
        points, faces = joined((BOX, BOX_FACES), (BALL + 3.0, BALL_FACES))
        moving = random.permutation(len(points))[: random.integers(1, len(points) + 1)]
        before = points + 0.1 * random.normal(size=points.shape)
        after = before.copy()
        after[moving] += 0.1 * random.normal(size=(len(moving), 3))
        components = components_of(points, faces)
        volumes = moving_in(components, moving)
        found = volumes.with_slope(after[order_of(len(after), moving)].T)[0] + volumes.resting(after)
        touched = np.isin(faces, moving).any(axis=1)
        seen = np.unique(components.labels[faces[touched, 0]])
        np.testing.assert_allclose(found[seen], components.volumes(after)[seen], rtol=1e-11, atol=1e-12)

    def test_moving_everything_changes_nothing(self) -> None:
        volumes = moving_in(components_of(BOX, BOX_FACES), np.arange(len(BOX)))
        np.testing.assert_allclose(volumes.with_slope(BOX.T)[1].sum(axis=1), 0.0, atol=1e-15)


class TestStep:
    def test_gains_what_is_missing_in_each_component(self) -> None:
        points, faces = joined((BOX, BOX_FACES), (BALL, BALL_FACES))
        volumes = moving_in(components_of(points, faces), np.arange(len(points)))
        shape = points.T.copy()
        wanted = volumes.with_slope(shape)[0] + np.array([0.3, -0.001])
        for _ in range(5):
            enclosed, slope = volumes.with_slope(shape)
            shape = volumes.stepped(shape, slope, slope, wanted - enclosed)
        np.testing.assert_allclose(volumes.with_slope(shape)[0], wanted, rtol=1e-13)

    def test_what_cannot_move_stays(self) -> None:
        points, faces = joined((BOX, BOX_FACES), (BALL, BALL_FACES))
        volumes = moving_in(components_of(points, faces), np.arange(len(points)))
        _, slope = volumes.with_slope(points.T)
        direction = slope.copy()
        direction[:, : len(BOX)] = 0.0
        moved = volumes.stepped(points.T, direction, slope, np.array([1.0, 0.01])).T
        np.testing.assert_array_equal(moved[: len(BOX)], points[: len(BOX)])
        assert np.abs(moved - points).max() > 1e-3

    def test_a_component_squeezed_into_a_point_stays_finite(self) -> None:
        points = np.full_like(BOX, 0.3)
        volumes = moving_in(components_of(points, BOX_FACES), np.arange(len(BOX)))
        _, slope = volumes.with_slope(points.T)
        np.testing.assert_array_equal(volumes.stepped(points.T, slope, slope, np.array([0.1])), points.T)
