# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""As small as an error allows, or as near as a size allows."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..arrays import Floats
from ..errors import InputError, ReconstructionError
from ..maps.mapping import Mapping
from .codec import Codec
from .compressed import Compressed
from .files import Packer, plain_bytes

# Modes and steps that searches choose from.
_MODES = {"fitted": (0, 16, 48, 120, 300), "published": (4, 8, 16, 32, 64, 128, 300)}
_STEPS = (8e-3, 2e-3, 5e-4)
_HALVINGS, _HALVINGS_OF_SIZE = 12, 8
# When so many numbers of modes after each other have not helped, more do not either.
_IN_VAIN = 2
_FEW = 1e-3  # of the tetrahedra
# Rounding may add so much to the error that the modes leave.
_ROUNDING = 0.01
_SMALLEST_STEP = 1e-9


@dataclass(frozen=True, eq=False)
class Choice:
    """Compressed maps with what they cost.

    Parameters
    ----------
    compressed : Compressed
    rebuilt : (F, N, 3)
        The maps that the modes give.
    restored : (F, n, 3)
        What comes back: with the remainder.
    errors : (F,)
        Root mean square distance of what comes back, over the diagonal of the source's bounding box.
    size : int
        Bytes of the file.
    folds : (F,)
        Folded tetrahedra of the maps that come back; of the rebuilt ones where those are not what is compressed.
    tets : int
        Of so many.
    """

    compressed: Compressed
    rebuilt: Floats
    restored: Floats
    errors: Floats
    size: int
    folds: tuple[int, ...]
    tets: int

    @property
    def error(self) -> float:
        """The largest of the errors."""
        return float(self.errors.max())

    @property
    def folding(self) -> int:
        """0 without folds, 1 where fewer than one tetrahedron in a thousand is folded, 2 where there are more."""
        return 0 if not any(self.folds) else 1 if max(self.folds) < _FEW * self.tets else 2


class Quantized(NamedTuple):
    """Coordinates without modes: their bytes, and, of maps, how many tetrahedra they fold."""

    data: bytes
    folds: tuple[int, ...]


class Compressor:
    """Searches for one row of maps.

    Parameters
    ----------
    codec : Codec
    targets : (F, n, 3)
        What is to be compressed.
    packer : Packer
        Makes the file.
    progress : callable, optional
        Called with the finished share of the work from time to time.
    """

    def __init__(
        self, codec: Codec, targets: Floats, packer: Packer, progress: Callable[[float], object] | None = None
    ) -> None:
        self.codec, self.targets, self.packer = codec, targets, packer
        self.progress = progress or (lambda share: None)

    def with_modes(self, modes: int) -> Choice:
        """The first modes and nothing else, with the largest step whose rounding adds about a hundredth to the error.

        Raises
        ------
        InputError
            If a map is folded or moves a sliding boundary out of its faces.
        ReconstructionError
            If a truncated representation is not positive definite, which happens with the scheme ``published``.
        """
        coefficients = self.codec.coefficients(self.targets, modes)
        best = self._base(coefficients, _SMALLEST_STEP)
        allowed = best.error * (1.0 + _ROUNDING) + 1e-12
        low, high = np.log(_SMALLEST_STEP), np.log(0.1)
        for halving in range(_HALVINGS):
            self.progress(halving / _HALVINGS)
            step = float(np.exp(0.5 * (low + high)))
            try:
                tried = self._base(coefficients, step)
            except ReconstructionError:
                high = np.log(step)
                continue
            if tried.error <= allowed:
                best, low = tried, np.log(step)
            else:
                high = np.log(step)
        return best

    def with_error(self, error: float) -> Choice:
        """The smallest choice whose every error is at most ``error``, of those with the fewest folds.

        Raises
        ------
        InputError
            If the scheme does not come as near with the modes that there are, naming what it reaches; and as
            ``with_modes``.
        """
        best: Choice | None = None
        nearest, in_vain = np.inf, 0
        for bases in self._bases():
            found = [base if base.error <= error else self._near_enough(base, error) for base in bases]
            nearest = min([nearest, *(base.error for base in bases)])
            candidates = [choice for choice in found if choice is not None]
            if best is not None:
                candidates.insert(0, best)
            before, best = best, min(candidates, key=_by_size, default=None)
            in_vain = in_vain + 1 if best is before else 0
            if best is not None and in_vain == _IN_VAIN and not best.folding:
                break
        if best is None:
            raise InputError(f"The error {error:.2g} is not reached; the nearest is {nearest:.2g}; allow that.")
        return best

    def with_size(self, size: int) -> Choice:
        """The nearest choice of at most ``size`` bytes, of those with the fewest folds.

        Raises
        ------
        InputError
            If nothing is as small, naming what is; and as ``with_modes``.
        """
        best: Choice | None = None
        smallest, in_vain = np.inf, 0
        for bases in self._bases():
            smallest = min([smallest, *(base.size for base in bases)])
            candidates = [] if best is None else [best]
            for base in bases:
                if base.size <= size:
                    candidates += [base, *self._nearest(base, size)]
            before, best = best, min(candidates, key=_by_error, default=None)
            in_vain = in_vain + 1 if best is before else 0
            if in_vain == _IN_VAIN and (best is None or not best.folding):
                break
        if best is None:
            raise InputError(f"{size} bytes are too few; the smallest file has {smallest:.0f}.")
        return best

    def quantized_coordinates(self, error: float) -> Quantized:
        """The displacements themselves, rounded so that their error is ``error``, and deflated: what to beat."""
        moved = self.targets - self.codec.points
        step = _largest_step(
            lambda step: float(self._errors(np.round(moved / step) * step - moved).max()) <= error,
            error * self.codec.diagonal,
        )
        numbers = np.round(moved / step).astype(np.int64)
        folds = (
            tuple(Mapping(self.codec.mesh, values).folds for values in self.codec.points + step * numbers)
            if self.codec.observes_map
            else ()
        )
        return Quantized(plain_bytes(numbers), folds)

    def _bases(self) -> Iterator[list[Choice]]:
        """Choices of modes alone: few and many, each coarse and fine."""
        known = _MODES["fitted" if self.codec.scheme == "fitted" else "published"]
        counts = sorted({min(modes, self.codec.modes) for modes in known})
        for number, modes in enumerate(counts):
            self.progress(number / len(counts))
            coefficients = self.codec.coefficients(self.targets, modes)
            found = []
            for step in _STEPS if modes else _STEPS[:1]:
                try:
                    found.append(self._base(coefficients, step))
                except ReconstructionError:
                    continue  # truncated by the scheme ``published`` so that no map has it
            if found:
                yield found

    def _base(self, coefficients: Floats, step: float) -> Choice:
        compressed, rebuilt = self.codec.rounded(self.targets, coefficients, step)
        return self._choice(compressed, rebuilt)

    def _choice(self, compressed: Compressed, rebuilt: Floats) -> Choice:
        restored = self.codec.finished(compressed, rebuilt)
        maps = restored if self.codec.observes_map else rebuilt
        folds = tuple(Mapping(self.codec.mesh, values).folds for values in maps)
        size, errors = self.packer.size(compressed), self._errors(restored - self.targets)
        return Choice(compressed, rebuilt, restored, errors, size, folds, len(self.codec.mesh.tets))

    def _near_enough(self, base: Choice, error: float) -> Choice | None:
        """The base with the coarsest remainder that brings it near enough; None where the scheme has no remainder."""
        if self.codec.scheme != "fitted":
            return None
        missed = self.targets - self.codec.observe(base.rebuilt)

        def is_near(step: float) -> bool:
            compressed = self.codec.with_remainder(base.compressed, missed, step)
            return float(self._errors(self.codec.finished(compressed, base.rebuilt) - self.targets).max()) <= error

        step = _largest_step(is_near, error * self.codec.diagonal)
        return self._choice(self.codec.with_remainder(base.compressed, missed, step), base.rebuilt)

    def _nearest(self, base: Choice, size: int) -> Iterator[Choice]:
        """The base with remainders that fit into ``size`` bytes, the finest last."""
        if self.codec.scheme != "fitted" or base.error == 0.0:
            return
        missed = self.targets - self.codec.observe(base.rebuilt)
        low, high = np.log(self.codec.diagonal * base.error * 1e-5), np.log(self.codec.diagonal * base.error * 20.0)
        for _ in range(_HALVINGS_OF_SIZE):
            step = float(np.exp(0.5 * (low + high)))
            choice = self._choice(self.codec.with_remainder(base.compressed, missed, step), base.rebuilt)
            if choice.size <= size:
                yield choice
                high = np.log(step)
            else:
                low = np.log(step)

    def _errors(self, missed: Floats) -> Floats:
        return np.asarray(np.sqrt((missed**2).sum(axis=2).mean(axis=1)) / self.codec.diagonal)


def _largest_step(is_fine: Callable[[float], bool], around: float) -> float:
    """The largest step that is fine, to about a percent, between a thousandth and a thousand times ``around``."""
    low, high = np.log(around * 1e-3), np.log(around * 1e3)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if is_fine(float(np.exp(middle))) else (low, middle)
    return float(np.exp(low))


def _by_size(choice: Choice) -> tuple[int, int]:
    """What comes back with the fewest folds first, then what is smallest."""
    return choice.folding, choice.size


def _by_error(choice: Choice) -> tuple[int, float]:
    """What comes back with the fewest folds first, then what is nearest."""
    return choice.folding, choice.error
