# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps compressed and restored: what is exact, what is bounded, and what files may hold."""

from __future__ import annotations

import struct
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qc3d_addon.solver.compressed_files import (
    CompressedMaps,
    from_bytes,
    read_compressed,
    to_bytes,
    write_compressed,
)
from qc3d_addon.solver.compression import Codec, Scheme
from qc3d_addon.solver.errors import InputError, ReconstructionError
from qc3d_addon.solver.mapping import Mapping
from qc3d_addon.solver.rate import error_of, quantised_coordinates, with_error, with_modes, with_size
from qc3d_addon.solver.tetmesh import TetMesh
from qc3d_addon.solver.whole_numbers import deflated, inflated, packed, unpacked

from .meshes import jittered_grid, sine_map

SCHEMES: list[Scheme] = ["published", "logarithm", "fitted"]
MESH = jittered_grid(6, seed=0)
WAVES = np.array([[[1, 2, 1], [1, 1, 2], [2, 1, 1]], [[2, 0, 1], [1, 2, 0], [0, 1, 2]]])
MAP = Mapping(MESH, sine_map(MESH.points, np.array([[0.06, -0.05, 0.05], [-0.03, 0.04, 0.03]]), WAVES))
CODECS = {scheme: Codec(MESH, 60, scheme) for scheme in SCHEMES}


class TestWholeNumbers:
    @given(st.lists(st.integers(-(2**62), 2**62), max_size=30), st.binary(max_size=5))
    def test_there_and_back(self, numbers: list[int], behind: bytes) -> None:
        data = packed(np.array(numbers, dtype=np.int64))
        found, used = unpacked(data + behind, len(numbers))
        assert found.tolist() == numbers
        assert used == len(data)

    def test_small_numbers_take_one_byte_and_zeros_none(self) -> None:
        assert len(packed(np.array([1, -3, 100, -128]))) == 5
        assert packed(np.zeros(1000, dtype=np.int64)) == b"\0"

    @pytest.mark.parametrize("data", [b"", b"\x09", b"\x02abc"])
    def test_what_ends_too_early(self, data: bytes) -> None:
        with pytest.raises(InputError, match="end too early"):
            unpacked(data, 4)

    @given(st.binary(max_size=2000))
    def test_compressed_and_back(self, data: bytes) -> None:
        assert inflated(deflated(data), len(data)) == data

    def test_no_more_is_made_than_was_said(self) -> None:
        for bomb in (b"Z" + zlib.compress(bytes(10**7)), deflated(bytes(10**7))):
            with pytest.raises(InputError, match="longer than its header says"):
                inflated(bomb, 1000)

    @pytest.mark.parametrize("data", [b"", b"?abc", b"Zabc"])
    def test_what_is_damaged(self, data: bytes) -> None:
        with pytest.raises(InputError):
            inflated(data, 1000)


class TestSchemes:
    @pytest.mark.parametrize("scheme", SCHEMES)
    def test_a_smooth_map_needs_few_modes(self, scheme: Scheme) -> None:
        codec = CODECS[scheme]
        errors = [error_of(codec.restore(codec.compress(MAP, modes, 1e-9)), MAP) for modes in (1, 10, 30, 60)]
        assert errors == sorted(errors, reverse=True)
        assert errors[-1] < 0.4 * errors[0]

    @pytest.mark.parametrize("scheme", SCHEMES)
    def test_the_faces_are_kept_exactly(self, scheme: Scheme) -> None:
        restored = CODECS[scheme].restore(CODECS[scheme].compress(MAP, 5, 0.01))
        np.testing.assert_array_equal(restored.values[MESH.on_cube_face], MESH.points[MESH.on_cube_face])

    def test_all_modes_of_constants_are_exact(self) -> None:
        identity = Mapping(MESH, MESH.points)
        for codec in CODECS.values():
            restored = codec.restore(codec.compress(identity, 1, 1e-11))
            assert np.abs(restored.values - MESH.points).max() < 1e-10

    def test_fitting_to_the_tetrahedra_is_nearer_than_averaging(self) -> None:
        def missed(scheme: Scheme) -> float:
            codec = CODECS[scheme]
            difference = codec.stretch(codec.compress(MAP, 60, 1e-9)) - MAP.stretch
            return float((MESH.volumes * (difference**2).sum(axis=(1, 2))).sum())

        assert missed("fitted") < missed("logarithm")

    @settings(max_examples=20)
    @given(st.integers(1, 60), st.floats(1e-3, 0.3), st.integers(0, 2**32 - 1))
    def test_logarithms_are_positive_definite_whatever_the_numbers(self, modes: int, step: float, seed: int) -> None:
        codec = CODECS["fitted"]
        numbers = np.random.default_rng(seed).integers(-3, 4, size=(modes, 6))
        compressed = replace(codec.compress(MAP, 1, 0.1), numbers=numbers, step=step)
        assert np.linalg.eigvalsh(codec.stretch(compressed)).min() > 0.0

    def test_the_published_scheme_can_lose_the_map(self) -> None:
        codec = CODECS["published"]
        numbers = np.zeros((1, 6), dtype=np.int64)
        with pytest.raises(ReconstructionError, match="not positive definite"):
            codec.restore(replace(codec.compress(MAP, 1, 0.1), numbers=numbers))

    def test_a_fixed_boundary_of_any_mesh(self) -> None:
        mesh = TetMesh(3.0 * MESH.points - 1.0, MESH.tets)
        values = mesh.points + 0.05 * np.sin(mesh.points[:, [1, 2, 0]])
        codec = Codec(mesh, 30, "fitted", "fixed")
        restored = codec.restore(codec.compress(Mapping(mesh, values), 30, 1e-6))
        boundary = np.unique(mesh.boundary_faces)
        np.testing.assert_array_equal(restored.values[boundary], values[boundary])
        assert error_of(restored, Mapping(mesh, values)) < 1e-3

    def test_maps_that_cannot_be_compressed(self) -> None:
        codec = CODECS["fitted"]
        with pytest.raises(InputError, match="folded tetrahedra"):
            codec.compress(Mapping(MESH, MESH.points * [-1.0, 1.0, 1.0]), 5, 0.1)
        with pytest.raises(InputError, match="moves the cube's faces"):
            codec.compress(Mapping(MESH, 1.1 * MESH.points), 5, 0.1)
        with pytest.raises(InputError, match="too small"):
            codec.compress(MAP, 5, 1e-300)


class TestRates:
    @pytest.mark.parametrize("error", [1e-2, 1e-3, 1e-5])
    def test_the_error_is_kept(self, error: float) -> None:
        choice = with_error(CODECS["fitted"], MAP, error)
        restored = CODECS["fitted"].restore(choice.compressed)
        np.testing.assert_array_equal(restored.values, choice.restored.values)
        assert error_of(restored, MAP) == choice.error <= error
        assert choice.restored.folds == 0
        assert choice.size == len(to_bytes(MESH, CompressedMaps(60, (choice.compressed,))))
        np.testing.assert_array_equal(restored.values[MESH.on_cube_face], MESH.points[MESH.on_cube_face])

    def test_the_size_is_kept(self) -> None:
        choices = [with_size(CODECS["fitted"], MAP, size) for size in (300, 600, 1200)]
        assert [choice.size <= size for choice, size in zip(choices, (300, 600, 1200), strict=True)] == [True] * 3
        assert choices[0].error > choices[1].error > choices[2].error

    def test_what_cannot_be_reached(self) -> None:
        with pytest.raises(InputError, match="the nearest is"):
            with_error(CODECS["logarithm"], MAP, 1e-9)
        with pytest.raises(InputError, match="10 bytes are too few for this map; the smallest file has"):
            with_size(CODECS["fitted"], MAP, 10)

    @pytest.mark.parametrize("scheme", SCHEMES)
    def test_rounding_adds_little_to_what_modes_leave(self, scheme: Scheme) -> None:
        codec = CODECS[scheme]
        choice = with_modes(codec, MAP, 20)
        exact = error_of(codec.restore(codec.compress(MAP, 20, 1e-9)), MAP)
        assert choice.error <= 1.01 * exact + 1e-12
        assert choice.size < len(to_bytes(MESH, CompressedMaps(60, (codec.compress(MAP, 20, 1e-9),))))

    def test_quantised_coordinates_cost_more_the_nearer_they_are(self) -> None:
        sizes = [quantised_coordinates(MAP, error) for error in (1e-2, 1e-3, 1e-4)]
        assert sizes == sorted(sizes)
        assert sizes[0] < sizes[2]


class TestFiles:
    @pytest.fixture
    def content(self) -> CompressedMaps:
        fitted = with_size(CODECS["fitted"], MAP, 900).compressed
        return CompressedMaps(60, (fitted, CODECS["fitted"].compress(MAP, 7, 0.01)))

    def test_there_and_back(self, content: CompressedMaps, tmp_path: Path) -> None:
        size = write_compressed(tmp_path / "map.qc3d", MESH, content)
        assert (tmp_path / "map.qc3d").stat().st_size == size
        found = read_compressed(tmp_path / "map.qc3d", MESH)
        assert (found.modes, found.scheme, found.boundary, len(found.maps)) == (60, "fitted", "sliding", 2)
        for one, other in zip(found.maps, content.maps, strict=True):
            assert (one.step, one.remainder_step) == (other.step, other.remainder_step)
            for name in ("numbers", "held", "remainder"):
                np.testing.assert_array_equal(getattr(one, name), getattr(other, name))
            restored = CODECS["fitted"].restore(one)
            np.testing.assert_array_equal(restored.values, CODECS["fitted"].restore(other).values)

    def test_every_truncation_is_refused(self, content: CompressedMaps) -> None:
        data = to_bytes(MESH, content)
        for length in range(0, len(data), 7):
            with pytest.raises(InputError):
                from_bytes(data[:length], MESH)

    @settings(max_examples=300)
    @given(st.integers(0, 10**6), st.integers(1, 255))
    def test_every_changed_byte_is_refused(self, place: int, change: int) -> None:
        data = bytearray(to_bytes(MESH, CompressedMaps(60, (CODECS["fitted"].compress(MAP, 7, 0.01),))))
        data[place % len(data)] ^= change
        with pytest.raises(InputError):
            from_bytes(bytes(data), MESH)

    @settings(max_examples=300, deadline=None)
    @given(st.data())
    def test_nothing_but_a_typed_error_comes_of_any_header(self, data: st.DataObject) -> None:
        """The checksum made right again, as somebody who wants to do harm would."""
        changed = bytearray(to_bytes(MESH, CompressedMaps(60, (CODECS["fitted"].compress(MAP, 7, 0.01),))))
        for _ in range(data.draw(st.integers(1, 4))):
            changed[data.draw(st.integers(8, len(changed) - 5))] = data.draw(st.integers(0, 255))
        changed[-4:] = struct.pack("<I", zlib.crc32(bytes(changed[:-4])))
        try:
            found = from_bytes(bytes(changed), MESH)
        except InputError:
            return
        assert all(len(each.numbers) <= found.modes for each in found.maps)

    def test_another_mesh(self, content: CompressedMaps) -> None:
        other = TetMesh(MESH.points * (1.0 + 1e-12), MESH.tets)
        with pytest.raises(InputError, match="another mesh"):
            from_bytes(to_bytes(MESH, content), other)

    def test_files_that_are_none(self, tmp_path: Path) -> None:
        with pytest.raises(InputError, match="cannot be read"):
            read_compressed(tmp_path / "none.qc3d", MESH)
        (tmp_path / "other.qc3d").write_bytes(b"PK" + bytes(500))
        with pytest.raises(InputError, match="not a file of compressed maps"):
            read_compressed(tmp_path / "other.qc3d", MESH)
