# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The smallest files: errors are kept, no simple way is smaller, odd meshes end in no traceback."""

from __future__ import annotations

import lzma

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.compression import graph_modes
from qc3d_addon.solver.compression.compact import from_bytes
from qc3d_addon.solver.compression.files import Source
from qc3d_addon.solver.compression.pack import (
    ChosenBoundary,
    Small,
    diagonal_of,
    errors_of,
    of_size,
    quantized_size,
    small_frames,
    small_maps,
    unpacked,
    without_folds,
)
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.maps.mapping import Mapping
from qc3d_addon.solver.support.progress import finish
from qc3d_addon.solver.tets.mesh import TetMesh

from ..meshes import bent, icosphere, jittered_grid, random_delaunay, sine_map

WAVES = np.array([[[1, 2, 1], [1, 1, 2], [2, 1, 1]], [[2, 0, 1], [1, 2, 0], [0, 1, 2]]])
AMPLITUDES = np.array([[0.06, -0.05, 0.05], [-0.03, 0.04, 0.03]])
MESH = jittered_grid(6, seed=0)
MAP = sine_map(MESH.points, AMPLITUDES, WAVES)
BALL, FACES = icosphere(2)
HEADER = 24  # bytes of header and checksum, and what lzma's smallest form has beyond the numbers


def morton_and_lzma(points: Floats, moved: Floats, error: float) -> int:
    """Bytes of displacements in steps along a curve that fills space; an independent few lines."""
    places = np.floor(1023.0 * (points - points.min(axis=0)) / np.ptp(points, axis=0).max()).astype(np.int64)
    keys = sum((places[:, axis] >> bit & 1) << (3 * bit + axis) for bit in range(10) for axis in range(3))
    low, high = 1e-9, 10.0
    for _ in range(50):
        step = np.sqrt(low * high)
        missed = errors_of(step * np.round(moved / step), moved, diagonal_of(points)).max()
        low, high = (step, high) if missed <= error else (low, step)
    numbers = np.round(moved / low).astype(np.int64)[:, np.argsort(keys, kind="stable")].transpose(0, 2, 1)
    symbols = ((numbers << 1) ^ (numbers >> 63)).astype("<u2")
    dtype = np.uint8 if symbols.max() < 256 else np.dtype("<u2")
    filters = [{"id": lzma.FILTER_LZMA1, "preset": 9 | lzma.PRESET_EXTREME, "lc": 0, "lp": 0, "pb": 0}]
    return len(lzma.compress(symbols.astype(dtype).tobytes(), lzma.FORMAT_RAW, filters=filters))


def maps(error: float, boundary: ChosenBoundary = "auto", mesh: TetMesh = MESH, targets: Floats = MAP[None]) -> Small:
    return finish(small_maps(mesh, targets, error, boundary))


def wavy(points: Floats, count: int = 5) -> Floats:
    """Frames of a surface that waves more and more."""
    x, y, z = points.T
    amounts = np.linspace(0, 0.2, count)
    return np.stack([points + s * np.column_stack([np.sin(4 * y), 0.5 * z**2, s * np.cos(3 * x)]) for s in amounts])


class TestMaps:
    @pytest.mark.slow
    @settings(max_examples=15, deadline=None)
    @given(
        st.integers(5, 150),
        st.integers(0, 10**6),
        st.floats(-5.0, -1.0),
        st.sampled_from(["auto", "fixed", "exact"]),
        st.floats(0.3, 300.0),
    )
    def test_the_error_is_kept_on_any_mesh(
        self, count: int, seed: int, exponent: float, boundary: ChosenBoundary, unit: float
    ) -> None:
        cube = random_delaunay(count, seed)
        mesh = TetMesh(unit * cube.points, cube.tets)
        moved = np.random.default_rng(seed).normal(scale=0.02 * unit, size=(2, *mesh.points.shape))
        targets, error = mesh.points + moved, 10.0**exponent
        small = maps(error, boundary, mesh, targets)
        back = unpacked(small.data, Source("maps", mesh.points, mesh.tets))
        np.testing.assert_array_equal(back, small.restored)
        np.testing.assert_allclose(small.errors, errors_of(back, targets, diagonal_of(mesh.points)))
        assert small.error <= error * (1.0 + 1e-9)
        assert small.folds == tuple(Mapping(mesh, values).folds for values in back)
        if boundary == "exact":
            rows = np.unique(mesh.boundary_faces)
            np.testing.assert_array_equal(back[:, rows], targets[:, rows])

    @pytest.mark.parametrize("error", [0.1, 1e-2, 3e-3, 1e-3, 1e-4, 1e-6])
    def test_no_simple_way_is_smaller(self, error: float) -> None:
        small = maps(error)
        assert len(small.data) <= morton_and_lzma(MESH.points, MAP[None] - MESH.points, error) + HEADER
        assert len(small.data) <= quantized_size(MAP[None] - MESH.points, np.sqrt(3.0), error) + HEADER
        moved = small.restored[0] - MESH.points
        assert not moved[MESH.on_cube_face].any()

    @pytest.mark.slow
    @settings(max_examples=8, deadline=None)
    @given(st.integers(5, 80), st.integers(0, 10**6), st.floats(-5.0, -1.0), st.floats(0.0, 1.0))
    def test_no_simple_way_is_smaller_on_any_mesh(self, count: int, seed: int, exponent: float, noise: float) -> None:
        mesh, error = random_delaunay(count, seed), 10.0**exponent
        random = np.random.default_rng(seed)
        moved = 0.05 * noise * random.normal(size=(1, *mesh.points.shape))
        moved += 0.2 * np.sin(3.0 * mesh.points @ random.normal(size=(3, 3)))
        small = maps(error, "fixed", mesh, mesh.points + moved)
        assert small.error <= error * (1.0 + 1e-9)
        assert len(small.data) <= morton_and_lzma(mesh.points, moved, error) + HEADER
        assert len(small.data) <= quantized_size(moved, diagonal_of(mesh.points), error) + HEADER

    def test_far_from_the_origin(self) -> None:
        mesh = TetMesh(MESH.points + 1e6, MESH.tets)
        small = maps(1e-4, "auto", mesh, MAP[None] + 1e6)
        assert small.error <= 1e-4
        assert len(small.data) < 1.05 * len(maps(1e-4, "fixed").data)

    def test_points_of_no_tetrahedron_and_several_parts(self) -> None:
        count = len(MESH.points)
        points = np.concatenate([MESH.points, MESH.points + 3.0, [[9.0, 9.0, 9.0]]])
        mesh = TetMesh(points, np.concatenate([MESH.tets, MESH.tets + count]))
        targets = np.concatenate([MAP, 1.1 * MESH.points + 3.0, [[9.0, 8.0, 9.0]]])[None]
        for boundary in ("auto", "fixed", "exact"):
            for error in (1e-2, 1e-4):
                assert maps(error, boundary, mesh, targets).error <= error

    @pytest.mark.slow
    def test_modes_alone_are_smallest_for_what_is_smooth(self) -> None:
        mesh = jittered_grid(10, seed=1)
        small = maps(3e-3, "auto", mesh, sine_map(mesh.points, AMPLITUDES, WAVES)[None])
        assert small.way == "modes"
        assert len(small.data) < 0.6 * morton_and_lzma(
            mesh.points, sine_map(mesh.points, AMPLITUDES, WAVES)[None] - mesh.points, 3e-3
        )

    @pytest.mark.parametrize("factored", [10**6, 0])
    def test_modes_come_back_however_they_are_found(self, monkeypatch: pytest.MonkeyPatch, factored: int) -> None:
        monkeypatch.setattr(graph_modes, "FACTORED_IN_VOLUME", factored)
        mesh = jittered_grid(11, seed=1)
        small = maps(1e-2, "auto", mesh, sine_map(mesh.points, AMPLITUDES, WAVES)[None])
        assert small.way == "modes"
        assert small.error <= 1e-2
        np.testing.assert_array_equal(unpacked(small.data, Source("maps", mesh.points, mesh.tets)), small.restored)

    def test_nothing_to_tell(self) -> None:
        small = maps(1e-3, "auto", MESH, MESH.points[None])
        assert len(small.data) < HEADER
        np.testing.assert_array_equal(small.restored[0], MESH.points)

    @pytest.mark.slow
    def test_without_folds(self) -> None:
        mesh = jittered_grid(8, seed=0)
        targets = sine_map(mesh.points, 1.6 * AMPLITUDES, WAVES)[None]
        small = maps(0.02, "auto", mesh, targets)
        source = Source("maps", mesh.points, mesh.tets)
        packed, space = from_bytes(small.data, source)
        assert small.is_unfolded
        assert packed.is_unfolded
        assert small.folds == (0,)
        assert small.error <= 0.02
        # What the reader does not unfold comes back with folds.
        assert Mapping(mesh, mesh.points + packed.field.displacements(space)[0]).folds > 0
        assert finish(without_folds(lambda error: small_maps(mesh, targets, error), 0.02)).data == small.data
        mirrored = MESH.points * [-1.0, 1.0, 1.0]
        with pytest.raises(InputError, match=r"fold \d+ tetrahedra even with"):
            finish(without_folds(lambda error: small_maps(MESH, mirrored[None], error, "fixed"), 0.1))

    @pytest.mark.slow
    def test_the_size_is_kept(self) -> None:
        smalls = [finish(of_size(lambda error: small_maps(MESH, MAP[None], error), size)) for size in (150, 500)]
        assert len(smalls[0].data) <= 150
        assert 400 < len(smalls[1].data) <= 500
        assert smalls[1].error < 0.5 * smalls[0].error
        with pytest.raises(InputError, match="5 bytes are too few; the smallest file has"):
            finish(of_size(lambda error: small_maps(MESH, MAP[None], error), 5))

    def test_what_cannot_be(self) -> None:
        with pytest.raises(InputError, match="out of themselves"):
            maps(1e-3, "sliding", MESH, 1.1 * MESH.points[None])
        flat = TetMesh(np.zeros((4, 3)), np.array([[0, 1, 2, 3]]))
        with pytest.raises(InputError, match="in one place"):
            maps(1e-3, "fixed", flat, np.zeros((1, 4, 3)))

    def test_progress_goes_from_0_to_1(self) -> None:
        shares: list[float] = []
        finish(small_maps(MESH, MAP[None], 1e-3), shares.append)
        assert shares == sorted(shares)
        assert 0.0 < shares[0] < shares[-1] == 1.0


class TestFrames:
    @pytest.mark.slow
    @settings(max_examples=10, deadline=None)
    @given(st.integers(2, 6), st.floats(-6.0, -1.0), st.integers(0, 10**6))
    def test_the_error_is_kept(self, count: int, exponent: float, seed: int) -> None:
        random = np.random.default_rng(seed)
        frames = wavy(BALL, count) + random.normal(scale=0.002, size=(count, *BALL.shape))
        small = finish(small_frames(frames, FACES, 10.0**exponent))
        back = unpacked(small.data, Source("frames", frames[0], FACES))
        np.testing.assert_array_equal(back, small.restored)
        assert errors_of(back, frames[1:], diagonal_of(frames[0])).max() <= 10.0**exponent * (1.0 + 1e-9)

    @pytest.mark.parametrize("error", [1e-2, 1e-3, 1e-4, 1e-6])
    def test_no_simple_way_is_smaller(self, error: float) -> None:
        frames = wavy(BALL, 9)
        small = finish(small_frames(frames, FACES, error))
        moved = frames[1:] - frames[0]
        assert len(small.data) <= morton_and_lzma(frames[0], moved, error) + HEADER
        assert len(small.data) <= quantized_size(moved, diagonal_of(frames[0]), error) + HEADER

    def test_what_moves_on_in_one_way_costs_little_more_than_one_frame(self) -> None:
        moved = bent(BALL - 0.5, 1.0) + 0.5 - BALL
        sizes = [
            len(finish(small_frames(BALL + np.linspace(0, 1, count)[:, None, None] * moved, FACES, 1e-4)).data)
            for count in (2, 30)
        ]
        assert sizes[1] < 1.25 * sizes[0] + 40

    def test_a_mesh_without_faces_and_one_of_few_points(self) -> None:
        for points in (BALL[:1].repeat(2, axis=0) + [[0, 0, 0], [0, 1, 0]], BALL[:5]):
            frames = np.stack([points, points + 0.1, points + 0.3])
            small = finish(small_frames(frames, np.empty((0, 3), dtype=np.int64), 1e-3))
            assert small.error <= 1e-3

    def test_nothing_to_store(self) -> None:
        with pytest.raises(InputError, match="no frame after it"):
            finish(small_frames(BALL[None], FACES, 1e-3))


def test_another_mesh_or_kind() -> None:
    small = maps(1e-2)
    for source, message in (
        (Source("maps", MESH.points * (1.0 + 1e-12), MESH.tets), "another mesh"),
        (Source("maps", MESH.points, MESH.tets[::-1]), "another mesh"),
        (Source("frames", MESH.points, MESH.tets), "holds maps"),
    ):
        with pytest.raises(InputError, match=message):
            unpacked(small.data, source)
