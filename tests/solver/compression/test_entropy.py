# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole numbers by the coders of the standard library."""

from __future__ import annotations

import tracemalloc
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qc3d_addon.solver.compression.entropy import LARGEST, approximate_size, decoded, encoded
from qc3d_addon.solver.errors import InputError


@settings(deadline=None)
@given(st.lists(st.integers(1 - LARGEST, LARGEST - 1) | st.integers(-3, 3), max_size=60))
def test_there_and_back(numbers: list[int]) -> None:
    assert decoded(encoded(np.array(numbers, dtype=np.int64)), len(numbers)).tolist() == numbers


@pytest.mark.parametrize("scale", [0.1, 0.5, 3.0, 40.0, 1e5])
def test_few_more_bits_than_chance_needs(scale: float) -> None:
    numbers = np.round(np.random.default_rng(0).laplace(scale=scale, size=6000)).astype(np.int64)
    _, counts = np.unique(numbers, return_counts=True)
    entropy = -(counts / 6000 * np.log2(counts / 6000)).sum()
    needed = 6000 / 8 * (entropy if scale < 10.0 else np.log2(2.0 * np.e * scale))
    assert len(encoded(numbers)) < 1.06 * needed + 30


def test_zeros_cost_nearly_nothing() -> None:
    assert len(encoded(np.zeros(1_000_000, dtype=np.int64))) < 250
    assert not decoded(encoded(np.zeros(1_000_000, dtype=np.int64)), 1_000_000).any()


def test_the_approximate_size_is_near() -> None:
    for scale in (0.2, 2.0, 200.0):
        numbers = np.round(np.random.default_rng(1).laplace(scale=scale, size=5000)).astype(np.int64)
        assert 0.95 < approximate_size(numbers) / len(encoded(numbers)) < 1.25


def test_a_number_that_is_too_large() -> None:
    with pytest.raises(InputError, match="allow a larger error"):
        encoded(np.array([0, LARGEST]))


@pytest.mark.parametrize("scale", [0.05, 1.0, 500.0])
def test_many_more_than_there_are(scale: float) -> None:
    data = encoded(np.round(np.random.default_rng(0).laplace(scale=scale, size=1000)).astype(np.int64))
    with pytest.raises(InputError):
        decoded(data, 10**6)


@settings(max_examples=400, deadline=None)
@given(st.integers(0, 40) | st.integers(128, 168), st.binary(max_size=200), st.integers(0, 300))
def test_any_bytes_mean_numbers_or_an_error(coder: int, data: bytes, count: int) -> None:
    with suppress(InputError):
        assert decoded(bytes([coder]) + data, count).shape == (count,)


def test_no_more_is_made_than_was_asked_for() -> None:
    for numbers in (np.zeros(10**6, dtype=np.int64), np.tile(np.arange(100), 10**4)):
        data = encoded(numbers)
        tracemalloc.start()
        with suppress(InputError):
            decoded(data, 10)
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert most < 3_000_000
