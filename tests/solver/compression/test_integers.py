# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Integers as bytes: the range coder, the prediction, the rows."""

from __future__ import annotations

import zlib
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qc3d_addon.solver.compression.integers import inflated, inflated_at_most, packed, planes, unpacked
from qc3d_addon.solver.compression.prediction import Predictor
from qc3d_addon.solver.compression.range_coder import decoded
from qc3d_addon.solver.errors import InputError


class TestRangeCoder:
    """What version 1 wrote is read; test_files.py has a whole file."""

    @settings(deadline=None)
    @given(st.binary(max_size=200), st.integers(0, 300))
    def test_any_bytes_mean_numbers_or_an_error(self, data: bytes, count: int) -> None:
        with suppress(InputError):
            assert decoded(data, count).shape == (count,)

    def test_more_numbers_than_bytes_can_hold(self) -> None:
        with pytest.raises(InputError, match="3 bytes cannot hold 1000000000 numbers"):
            decoded(b"abc", 10**9)


class TestPrediction:
    @settings(max_examples=30, deadline=None)
    @given(st.integers(0, 60), st.integers(0, 2**32 - 1), st.booleans())
    def test_there_and_back(self, count: int, seed: int, regular: bool) -> None:
        random = np.random.default_rng(seed)
        points = random.integers(0, 3, size=(count, 3)) / 2.0 if regular else random.normal(size=(count, 3))
        numbers = random.integers(-(2**40), 2**40, size=(count, 2))
        predictor = Predictor(points)
        np.testing.assert_array_equal(predictor.numbers(predictor.differences(numbers)), numbers)
        np.testing.assert_array_equal(np.sort(predictor.order), np.arange(count))

    def test_what_is_smooth_leaves_little(self) -> None:
        points = np.random.default_rng(0).uniform(size=(3000, 3))
        numbers = np.round(1000.0 * np.sin(3.0 * points)).astype(np.int64)
        left = Predictor(points).differences(numbers)
        assert np.abs(left).mean() < 0.15 * np.abs(numbers).mean()

    def test_the_same_whatever_the_unit(self) -> None:
        points = np.random.default_rng(1).uniform(size=(200, 3))
        numbers = np.random.default_rng(2).integers(-50, 50, size=(200, 3))
        expected = Predictor(points).differences(numbers)
        for unit in (2.0**-40, 1024.0):
            np.testing.assert_array_equal(Predictor(points * unit).differences(numbers), expected)


class TestRows:
    @settings(deadline=None)
    @given(st.integers(1, 5), st.integers(0, 20), st.integers(0, 2**32 - 1))
    def test_there_and_back(self, count: int, points: int, seed: int) -> None:
        random = np.random.default_rng(seed)
        rows = random.integers(-(2**40), 2**40, size=(count, points, 3))
        np.testing.assert_array_equal(unpacked(packed(rows), rows.shape), rows)
        predictor = Predictor(random.normal(size=(points, 3)))
        np.testing.assert_array_equal(unpacked(packed(rows, predictor), rows.shape, predictor), rows)

    def test_what_goes_on_as_before_costs_little(self) -> None:
        steady = np.random.default_rng(0).integers(-500, 500, size=(1, 300, 3)) * np.arange(1, 9)[:, None, None]
        assert len(packed(steady)) < 1.35 * len(packed(steady[:1])) + 80

    @pytest.mark.parametrize("data", [b"", b"\x09", b"\xff123", b"\x00\x77"])
    def test_what_is_damaged(self, data: bytes) -> None:
        with pytest.raises(InputError, match="does not know"):
            unpacked(data, (1, 2, 3))


def test_small_numbers_take_one_byte_and_zeros_none() -> None:
    assert len(planes(np.array([1, -3, 100, -128]))) == 4
    assert planes(np.zeros(1000, dtype=np.int64)) == b""


class TestInflating:
    @given(st.binary(max_size=2000))
    def test_there_and_back(self, data: bytes) -> None:
        assert inflated(zlib.compress(data), len(data)) == data

    @pytest.mark.parametrize("size", [10, 1000, 2 * 10**7])
    def test_no_more_and_no_less_than_was_said(self, size: int) -> None:
        with pytest.raises(InputError, match="another length"):
            inflated(zlib.compress(bytes(10**7)), size)

    @pytest.mark.parametrize("data", [b"", b"abc"])
    def test_what_is_damaged(self, data: bytes) -> None:
        with pytest.raises(InputError):
            inflated(data, 1000)

    def test_at_most(self) -> None:
        data = zlib.compress(bytes(10**6))
        assert inflated_at_most(data, 10**6) == bytes(10**6)
        for damaged, most in ((data, 10**6 - 1), (data[:-1], 10**6), (b"abc", 10)):
            with pytest.raises(InputError, match="damaged"):
                inflated_at_most(damaged, most)
