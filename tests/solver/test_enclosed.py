# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Volumes of closed components, their derivative, and the step that restores them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from qc3d_addon.solver.enclosed import ClosedComponents
from qc3d_addon.solver.tetmesh import Floats, Ints
from qc3d_addon.solver.topology import sides, vertex_components

from .meshes import box_surface, enclosed_volume, icosphere

BOX, BOX_FACES = box_surface((2, 2, 3), (1.0, 2.0, 4.0))
BALL, BALL_FACES = icosphere(1)


def components_of(points: Floats, faces: Ints) -> ClosedComponents:
    return ClosedComponents(faces, vertex_components(sides(faces), len(points)))


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

    def test_each_component_its_own(self) -> None:
        points, faces = joined((BOX, BOX_FACES), (0.1 * BOX + [0, 0, 1], BOX_FACES), (BALL + 7.0, BALL_FACES))
        found = components_of(points, faces).volumes(points)
        assert found == pytest.approx([8.0, 0.008, enclosed_volume(BALL, BALL_FACES)], rel=1e-12)

    def test_only_closed_components_have_one(self) -> None:
        points, faces = joined((BOX, BOX_FACES[1:]), (BALL, BALL_FACES))
        components = components_of(np.concatenate([points, [[9.0, 9.0, 9.0]]]), faces)
        assert not components.empty
        found = components.volumes(np.concatenate([points, [[9.0, 9.0, 9.0]]]))
        assert found == pytest.approx([0.0, enclosed_volume(BALL, BALL_FACES), 0.0])

    @pytest.mark.parametrize("faces", [BOX_FACES[1:], BOX_FACES[:0], np.concatenate([BOX_FACES, BOX_FACES[:1]])])
    def test_none_closed(self, faces: Ints) -> None:
        components = components_of(BOX, faces)
        assert components.empty
        assert not components.volumes(BOX).any()
        assert not components.volume_gradient(BOX).any()


class TestGradient:
    @given(st.integers(0, 2**32 - 1))
    def test_derivative_of_the_volumes(self, seed: int) -> None:
        random = np.random.default_rng(seed)
        points, faces = joined((BOX, BOX_FACES), (BALL, BALL_FACES))
        points = points + 0.1 * random.normal(size=points.shape)
        direction = random.normal(size=points.shape)
        direction[len(BOX) :] = 0.0
        components = components_of(points, faces)
        step = 1e-4
        ahead, behind = (components.volumes(points + sign * step * direction) for sign in (1.0, -1.0))
        slope = (components.volume_gradient(points) * direction).sum()
        # The volume is cubic: what central differences miss is the third derivative.
        np.testing.assert_allclose((ahead - behind) / (2.0 * step), [slope, 0.0], rtol=0.0, atol=1e-6)

    def test_moving_everything_changes_nothing(self) -> None:
        np.testing.assert_allclose(components_of(BOX, BOX_FACES).volume_gradient(BOX).sum(axis=0), 0.0, atol=1e-15)


class TestStep:
    def test_gains_what_is_missing_in_each_component(self) -> None:
        points, faces = joined((BOX, BOX_FACES), (BALL, BALL_FACES))
        components = components_of(points, faces)
        missing = np.array([0.3, -0.001])
        wanted = components.volumes(points) + missing
        for _ in range(5):
            slope = components.volume_gradient(points)
            points = components.stepped(points, slope, slope, wanted - components.volumes(points))
        np.testing.assert_allclose(components.volumes(points), wanted, rtol=1e-13)

    def test_what_cannot_move_stays(self) -> None:
        points, faces = joined((BOX, BOX_FACES), (BALL, BALL_FACES))
        components = components_of(points, faces)
        slope = components.volume_gradient(points)
        direction = slope.copy()
        direction[: len(BOX)] = 0.0
        moved = components.stepped(points, direction, slope, np.array([1.0, 0.01]))
        np.testing.assert_array_equal(moved[: len(BOX)], points[: len(BOX)])
        assert np.abs(moved - points).max() > 1e-3

    def test_a_component_squeezed_into_a_point_stays_finite(self) -> None:
        points = np.full_like(BOX, 0.3)
        components = components_of(points, BOX_FACES)
        slope = components.volume_gradient(points)
        np.testing.assert_array_equal(components.stepped(points, slope, slope, np.array([0.1])), points)
