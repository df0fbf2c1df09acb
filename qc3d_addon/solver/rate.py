# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""As small as an error allows, or as near as a size allows."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from .compressed_files import sizes
from .compression import Codec, Compressed
from .errors import InputError, ReconstructionError
from .mapping import Mapping
from .tetmesh import Floats
from .whole_numbers import deflated, packed

# Modes and steps that searches choose from.
_MODES = (0, 16, 48, 120, 300)
_STEPS = (4e-3, 1e-3, 2.5e-4)
_HALVINGS = 16
# Rounding may add so much to the error that the modes leave.
_ROUNDING = 0.01
_SMALLEST_STEP = 1e-9


@dataclass(frozen=True, eq=False)
class Choice:
    """A compressed map with what it costs.

    Parameters
    ----------
    compressed : Compressed
    restored : Mapping
    error : float
        Root mean square distance of the restored vertices, over the bounding box's diagonal.
    size : int
        Bytes of the file.
    """

    compressed: Compressed
    restored: Mapping
    error: float
    size: int


def error_of(restored: Mapping, mapping: Mapping) -> float:
    """Root mean square distance between two maps' vertices, over the diagonal of the source's bounding box."""
    squares = ((restored.values - mapping.values) ** 2).sum(axis=1)
    return float(np.sqrt(squares.mean()) / np.linalg.norm(np.ptp(mapping.mesh.points, axis=0)))


def with_modes(codec: Codec, mapping: Mapping, modes: int) -> Choice:
    """The first modes and nothing else, with the largest step whose rounding adds about a hundredth to the error.

    Raises
    ------
    ReconstructionError
        If the truncated representation is not positive definite, which happens with the scheme ``published``.
    """
    exact = _choice(codec, mapping, codec.compress(mapping, modes, _SMALLEST_STEP))
    allowed = exact.error * (1.0 + _ROUNDING) + 1e-12
    best, low, high = exact, np.log(_SMALLEST_STEP), np.log(0.1)
    for _ in range(10):
        step = float(np.exp(0.5 * (low + high)))
        try:
            tried = _choice(codec, mapping, codec.compress(mapping, modes, step))
        except ReconstructionError:
            high = np.log(step)
            continue
        if tried.error <= allowed:
            best, low = tried, np.log(step)
        else:
            high = np.log(step)
    return best


def with_error(codec: Codec, mapping: Mapping, error: float) -> Choice:
    """The smallest choice whose error is at most ``error``, without folds where there is one.

    Raises
    ------
    InputError
        If the scheme does not come as near with the modes that there are, naming what it reaches.
    """
    found = [
        choice
        for base in _bases(codec, mapping)
        for choice in _with_remainders(codec, mapping, base, lambda choice: choice.error <= error)
    ]
    fitting = [choice for choice in found if choice.error <= error]
    if not fitting:
        nearest = min((choice.error for choice in found), default=float("inf"))
        raise InputError(f"The error {error:.2g} is not reached; the nearest is {nearest:.2g}; allow that.")
    return _without_folds(sorted(fitting, key=lambda choice: choice.size))


def with_size(codec: Codec, mapping: Mapping, size: int) -> Choice:
    """The nearest choice of at most ``size`` bytes, without folds where there is one.

    Raises
    ------
    InputError
        If nothing is as small, naming what is.
    """
    found = [
        choice
        for base in _bases(codec, mapping)
        for choice in _with_remainders(codec, mapping, base, lambda choice: choice.size > size)
    ]
    fitting = [choice for choice in found if choice.size <= size]
    if not fitting:
        smallest = min((choice.size for choice in found), default=0)
        raise InputError(f"{size} bytes are too few for this map; the smallest file has {smallest}.")
    return _without_folds(sorted(fitting, key=lambda choice: choice.error))


def quantised_coordinates(mapping: Mapping, error: float) -> int:
    """Bytes of the displacements themselves, rounded so that their error is ``error``, and deflated: what to beat."""
    moved = mapping.values - mapping.mesh.points
    diagonal = float(np.linalg.norm(np.ptp(mapping.mesh.points, axis=0)))

    def rounded(step: float) -> tuple[Floats, float]:
        numbers = np.round(moved / step)
        missed = float(np.sqrt(((numbers * step - moved) ** 2).sum(axis=1).mean()) / diagonal)
        return numbers, missed

    low, high = np.log(error * diagonal * 1e-3), np.log(error * diagonal * 1e3)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if rounded(float(np.exp(middle)))[1] <= error else (low, middle)
    return len(deflated(packed(rounded(float(np.exp(low)))[0].T.astype(np.int64))))


def _without_folds(choices: list[Choice]) -> Choice:
    """The first choice whose restored map has no folds; the first of all where every one has some."""
    return next((choice for choice in choices if choice.restored.folds == 0), choices[0])


def _bases(codec: Codec, mapping: Mapping) -> Iterator[Choice]:
    """Choices of modes alone: few and many, coarse and fine."""
    most = codec.spectrum.modes.shape[1]
    for modes in sorted({min(modes, most) for modes in _MODES}):
        for step in _STEPS if modes else _STEPS[:1]:
            try:
                yield _choice(codec, mapping, codec.compress(mapping, modes, step))
            except ReconstructionError:
                continue  # truncated by the scheme ``published`` so that no map has it


def _with_remainders(
    codec: Codec, mapping: Mapping, base: Choice, is_fine: Callable[[Choice], bool]
) -> Iterator[Choice]:
    """The base, and, where the scheme has one, with the remainders on either side of where ``is_fine`` turns."""
    yield base
    if codec.scheme != "fitted" or base.error == 0.0:
        return
    diagonal = float(np.linalg.norm(np.ptp(mapping.mesh.points, axis=0)))
    low, high = np.log(diagonal * 1e-9), np.log(diagonal * base.error * 20.0)
    for _ in range(_HALVINGS):
        step = float(np.exp(0.5 * (low + high)))
        compressed = codec.with_remainder(base.compressed, base.restored, mapping, step)
        values = codec.finished(compressed, base.restored)
        choice = Choice(compressed, values, error_of(values, mapping), _size(codec, compressed))
        yield choice
        if is_fine(choice):
            low = np.log(step)
        else:
            high = np.log(step)


def _choice(codec: Codec, mapping: Mapping, compressed: Compressed) -> Choice:
    restored = codec.restore(compressed)
    return Choice(compressed, restored, error_of(restored, mapping), _size(codec, compressed))


def _size(codec: Codec, compressed: Compressed) -> int:
    return sizes(codec.mesh, [compressed], codec.spectrum.modes.shape[1])
