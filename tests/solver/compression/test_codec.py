# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps compressed and decompressed: what is exact, and which errors are bounded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.compression import search as rate
from qc3d_addon.solver.compression.codec import Codec
from qc3d_addon.solver.compression.compressed import Compressed, Scheme
from qc3d_addon.solver.compression.files import Packer, Source
from qc3d_addon.solver.compression.search import Compressor
from qc3d_addon.solver.compression.transfer_loss import transferred
from qc3d_addon.solver.errors import InputError, ReconstructionError
from qc3d_addon.solver.maps.boundary_conditions import Conditions
from qc3d_addon.solver.maps.mapping import Mapping
from qc3d_addon.solver.tets.mesh import TetMesh

from ..meshes import jittered_grid, sine_map

SCHEMES: list[Scheme] = ["published", "logarithm", "fitted"]
MESH = jittered_grid(6, seed=0)
WAVES = np.array([[[1, 2, 1], [1, 1, 2], [2, 1, 1]], [[2, 0, 1], [1, 2, 0], [0, 1, 2]]])
MAP = sine_map(MESH.points, np.array([[0.06, -0.05, 0.05], [-0.03, 0.04, 0.03]]), WAVES)
TARGETS = MAP[None]
CODECS = {scheme: Codec(MESH, 60, scheme) for scheme in SCHEMES}
ON_FACES = MESH.on_cube_face


def rounded(scheme: Scheme, modes: int, step: float) -> tuple[Compressed, Floats]:
    codec = CODECS[scheme]
    return codec.rounded(TARGETS, codec.coefficients(TARGETS, modes), step)


def error_of(values: Floats) -> float:
    return float(np.sqrt(((values - TARGETS) ** 2).sum(axis=2).mean() / 3.0))


def compressor(scheme: Scheme, targets: Floats = TARGETS) -> Compressor:
    return Compressor(CODECS[scheme], targets, Packer(Source("maps", MESH.points, MESH.tets), 60))


class TestSchemes:
    @pytest.mark.parametrize("scheme", SCHEMES)
    def test_a_smooth_map_needs_few_modes(self, scheme: Scheme) -> None:
        errors = [error_of(rounded(scheme, modes, 1e-9)[1]) for modes in (1, 10, 60)]
        assert errors == sorted(errors, reverse=True)
        assert errors[-1] < 0.4 * errors[0]

    @pytest.mark.parametrize("scheme", SCHEMES)
    def test_the_faces_are_kept_exactly(self, scheme: Scheme) -> None:
        rebuilt = rounded(scheme, 5, 0.01)[1][0]
        np.testing.assert_array_equal(rebuilt[ON_FACES], MESH.points[ON_FACES])

    @pytest.mark.parametrize("scheme", SCHEMES)
    def test_the_identity_is_exact(self, scheme: Scheme) -> None:
        codec, targets = CODECS[scheme], MESH.points[None]
        rebuilt = codec.rounded(targets, codec.coefficients(targets, 1), 1e-9)[1][0]
        assert np.abs(rebuilt - MESH.points).max() < 1e-8

    def test_the_nearest_map_is_nearer_than_that_of_the_nearest_representation(self) -> None:
        codec = CODECS["fitted"]
        projected = codec.projected(Mapping(MESH, MAP), 20)[None]
        assert error_of(rounded("fitted", 20, 1e-9)[1]) < 0.8 * error_of(codec.rounded(TARGETS, projected, 1e-9)[1])

    def test_projection_finds_what_the_modes_hold(self) -> None:
        codec = CODECS["fitted"]
        numbers = np.random.default_rng(0).integers(-3, 4, size=(1, 20, 6))
        known = Mapping(MESH, MAP)
        # A representation of no map, in the place of a map's.
        known.__dict__["stretch"] = codec.stretch(
            Compressed("fitted", "sliding", 0.001, numbers, np.empty((1, 0, 3))), 0
        )
        found = codec.projected(known, 20) / (0.001 * codec.steps(20))[:, None]
        np.testing.assert_allclose(found, numbers[0], atol=1e-6)

    @settings(max_examples=20, deadline=None)
    @given(st.integers(1, 60), st.floats(1e-3, 0.3), st.integers(0, 2**32 - 1))
    def test_logarithms_are_positive_definite_whatever_the_numbers(self, modes: int, step: float, seed: int) -> None:
        numbers = np.random.default_rng(seed).integers(-3, 4, size=(1, modes, 6))
        compressed = Compressed("fitted", "sliding", step, numbers, np.empty((1, 0, 3)))
        assert np.linalg.eigvalsh(CODECS["fitted"].stretch(compressed, 0)).min() > 0.0

    def test_the_published_scheme_can_lose_the_map(self) -> None:
        compressed = Compressed("published", "sliding", 0.1, np.zeros((1, 1, 6), dtype=np.int64), np.empty((1, 0, 3)))
        with pytest.raises(ReconstructionError, match="not positive definite"):
            CODECS["published"].restore(compressed)

    def test_a_fixed_boundary_of_any_mesh(self) -> None:
        mesh = TetMesh(3.0 * MESH.points - 1.0, MESH.tets)
        targets = (mesh.points + 0.05 * np.sin(mesh.points[:, [1, 2, 0]]))[None]
        codec = Codec(mesh, 30, "fitted", "fixed")
        compressed, _ = codec.rounded(targets, codec.coefficients(targets, 30), 1e-6)
        restored = codec.restore(compressed)
        boundary = np.unique(mesh.boundary_faces)
        np.testing.assert_array_equal(restored[0, boundary], targets[0, boundary])
        assert np.sqrt(((restored - targets) ** 2).sum(axis=2).mean()) < 5e-3

    def test_maps_that_cannot_be_compressed(self) -> None:
        codec = CODECS["fitted"]
        with pytest.raises(InputError, match="folded tetrahedra"):
            codec.coefficients((MESH.points * [-1.0, 1.0, 1.0])[None], 5)
        with pytest.raises(InputError, match="moves the cube's faces"):
            codec.coefficients(1.1 * MESH.points[None], 5)
        with pytest.raises(InputError, match="too small"):
            codec.rounded(TARGETS, codec.projected(Mapping(MESH, MAP), 5)[None], 1e-300)

    def test_maps_that_another_machine_rebuilds_differently(self) -> None:
        compressed, _ = rounded("fitted", 5, 0.01)
        with pytest.raises(InputError, match="come out differently"):
            CODECS["fitted"].restore(replace(compressed, check=compressed.check + 1e-5))
        with pytest.raises(InputError, match="come out differently"):
            CODECS["fitted"].restore(replace(compressed, numbers=compressed.numbers + 1))


class TestTransfer:
    @pytest.mark.parametrize("scheme", SCHEMES)
    def test_a_linear_map_survives(self, scheme: Scheme) -> None:
        values = MESH.points + 0.0
        found = transferred(Mapping(MESH, values), scheme, Conditions.sliding_cube(MESH))
        assert found is not None
        assert np.abs(found.values - values).max() < 1e-9

    def test_the_nearest_vertex_values_lose_less_than_means(self) -> None:
        lost = {}
        for scheme in SCHEMES:
            found = transferred(Mapping(MESH, MAP), scheme, Conditions.sliding_cube(MESH))
            assert found is not None
            lost[scheme] = error_of(found.values[None])
        assert 0.0 < lost["fitted"] < 0.5 * min(lost["published"], lost["logarithm"])


@pytest.mark.slow
class TestRates:
    @pytest.fixture(autouse=True)
    def _few_modes(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Searches among few modes are quick."""
        monkeypatch.setattr(rate, "_MODES", {"fitted": (0, 16), "published": (4, 16, 60)})

    @pytest.mark.parametrize("error", [1e-2, 1e-3, 1e-5])
    def test_the_error_is_kept(self, error: float) -> None:
        search = compressor("fitted")
        choice = search.with_error(error)
        restored = CODECS["fitted"].restore(choice.compressed)
        np.testing.assert_array_equal(restored, choice.restored)
        assert error_of(restored) == pytest.approx(choice.error, rel=1e-9)
        assert choice.error <= error
        assert Mapping(MESH, restored[0]).folds == 0
        assert choice.size == len(search.packer.bytes_of(choice.compressed))
        np.testing.assert_array_equal(restored[0][ON_FACES], MESH.points[ON_FACES])

    def test_the_size_is_kept(self) -> None:
        sizes = (300, 700)
        choices = [compressor("fitted").with_size(size) for size in sizes]
        assert all(choice.size <= size for choice, size in zip(choices, sizes, strict=True))
        assert choices[0].error > 2.0 * choices[1].error

    def test_what_cannot_be_reached(self) -> None:
        with pytest.raises(InputError, match="the nearest is"):
            compressor("logarithm").with_error(1e-9)
        with pytest.raises(InputError, match="10 bytes are too few; the smallest file has"):
            compressor("fitted").with_size(10)

    @pytest.mark.parametrize("scheme", SCHEMES)
    def test_rounding_adds_little_to_what_modes_leave(self, scheme: Scheme) -> None:
        search = compressor(scheme)
        choice = search.with_modes(20)
        exact = rounded(scheme, 20, 1e-9)
        assert choice.error <= 1.011 * error_of(exact[1]) + 1e-12
        assert choice.size < 0.7 * search.packer.size(exact[0])

    def test_maps_that_go_on_steadily_cost_little_more_than_one(self) -> None:
        moved = MAP - MESH.points
        row = MESH.points + np.linspace(0.2, 1.0, 5)[:, None, None] * moved
        one = compressor("fitted").with_error(1e-4)
        many = compressor("fitted", row).with_error(1e-4)
        assert many.errors.shape == (5,)
        assert many.error <= 1e-4
        assert many.size < 3.0 * one.size

    def test_less_than_quantized_coordinates(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(rate, "_MODES", {"fitted": (60,)})
        for error in (1e-4, 1e-5):
            search = compressor("fitted")
            choice = search.with_error(error)
            assert choice.size < len(search.quantized_coordinates(choice.error).data)

    def test_quantized_coordinates_cost_more_the_nearer_they_are(self) -> None:
        sizes = [len(compressor("fitted").quantized_coordinates(error).data) for error in (1e-2, 1e-3, 1e-4)]
        assert sizes == sorted(sizes)
        assert sizes[0] < sizes[2]
