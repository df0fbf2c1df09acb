# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The smallest of all ways to tell displacements with a given error, the simple ways of other programs among them."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arrays import Floats
from .entropy import approximate_size, encoded
from .fields import GROWTHS, ORDERS, Field, Part, Space, analyzed, combined, synthesized
from .graph_modes import MOST_MODES

_MARGIN = 0.98  # of the error is left to what rounding may add
_OF_FACTORS = 0.05  # of the error may come from rounded factors
_MOST_BITS = 24
# Smaller differences than this many steps are told as 0; which pays best depends on the field.
_THRESHOLDS = (0.6, 0.5, 0.66)
_COUNTS_OF_MODES = (30, 60, MOST_MODES)
_HOPE = 0.5  # of the error is the least that twice as many modes are expected to leave
_ROOMY = 0.9  # of the error is left by modes: where it is less, twice as many take more bytes than larger steps save
_TRIALS = 14
_NEAR = 0.995  # of the error is near enough
# Sizes are first found approximately; those that are as good as so many times the best are then found exactly.
_UNSURE = 1.15
_SMALLEST_STEP = 1e-12


class Rows(NamedTuple):
    """Rows (R, n, 3) that are told instead of displacements, and how these are made of them; see ``Field``."""

    rows: Floats
    factors: NDArray[np.int64] | None = None
    bits: int = 0

    def field(self, part: Part) -> Field:
        """The displacements whose rows are told by a part."""
        return Field(part, self.factors, self.bits)

    def displacements(self, rows: Floats) -> Floats:
        """(F, n, 3) the displacements with rows like these, (R, n, 3)."""
        return combined(rows, None if self.factors is None else np.ldexp(self.factors.astype(np.float64), -self.bits))


@dataclass(frozen=True, eq=False)
class Wanted:
    """Displacements, and how near is near enough.

    Parameters
    ----------
    space : Space
    displacements : (F, n, 3)
    unit : float
        What errors are relative to, such as the diagonal of the mesh's bounding box.
    error : float
        Largest root mean square error of each displacement, in that unit.
    """

    space: Space
    displacements: Floats
    unit: float
    error: float

    def excess(self, restored: Floats) -> float:
        """The largest error over that which is allowed."""
        squares = ((restored - self.displacements) ** 2).sum(axis=2).mean(axis=1)
        return float(np.sqrt(squares.max())) / (self.unit * self.error)


Candidate = tuple[int, Field]


def smallest(wanted: Wanted) -> Generator[float, None, Field]:
    """The smallest field that is near enough; yields the finished share of the work."""
    still = np.zeros((1, len(wanted.space.points), 3), dtype=np.int64)
    if wanted.excess(np.zeros_like(wanted.displacements)) <= 1.0:
        nothing = np.zeros((len(wanted.displacements), 1), dtype=np.int64)
        return Field(Part("plain", 0, 0.0, still), nothing if len(nothing) > 1 else None)
    candidates: list[Candidate] = []
    every = list(_principal(wanted))
    for number, rows in enumerate(every):
        for share, way in enumerate((_levels, _with_modes, _plain)):
            candidates += way(wanted, rows)
            yield (number + (share + 1) / 3) / (len(every) + 1)
    if len(wanted.displacements) > 1:
        candidates += _plain(wanted, Rows(wanted.displacements))
    limit = _UNSURE * min(size for size, _ in candidates)
    likely = [field for size, field in candidates if size <= limit]
    yield 1.0
    return min(likely, key=lambda field: exact_size(wanted.space, field))


def exact_size(space: Space, field: Field) -> int:
    """Bytes of all numbers of a field."""
    return len(encoded(field.part.stream(space))) + (0 if field.factors is None else len(encoded(field.factors)))


def _approximate(space: Space, field: Field) -> int:
    return approximate_size(field.part.stream(space)) + (0 if field.factors is None else field.factors.size)


def _principal(wanted: Wanted) -> Iterator[Rows]:
    """Rows that are fewer than the displacements: their principal components, as few as reach the error, and one more.

    Of one displacement, itself.
    """
    displacements, allowed = wanted.displacements, wanted.error * wanted.unit
    count, points = displacements.shape[:2]
    if count == 1:
        yield Rows(displacements)
        return
    flat = displacements.reshape(count, -1)
    values, vectors = np.linalg.eigh(flat @ flat.T)
    values, vectors = np.maximum(values[::-1], 0.0), vectors[:, ::-1]
    # What is left of each displacement, in squares, after 1, 2, ... components.
    left = np.maximum((flat**2).sum(axis=1)[:, None] - np.cumsum(vectors**2 * values, axis=1), 0.0)
    enough = np.flatnonzero(np.sqrt(left.max(axis=0) / max(points, 1)) <= _MARGIN * allowed)
    fewest = int(enough[0]) + 1 if enough.size else count
    for rank in dict.fromkeys((fewest, min(fewest + 1, count))):
        spread = np.sqrt(values[:rank].sum() / max(points, 1) / 12.0)
        bits = int(np.clip(np.ceil(np.log2(max(spread / (_OF_FACTORS * allowed), 2.0))), 1, _MOST_BITS))
        factors = np.round(np.ldexp(vectors[:, :rank], bits)).astype(np.int64)
        if not factors.any(axis=0).all():
            continue
        rows = np.linalg.lstsq(np.ldexp(factors.astype(np.float64), -bits), flat, rcond=None)[0]
        yield Rows(rows.reshape(rank, points, 3), factors, bits)


def _plain(wanted: Wanted, rows: Rows) -> Iterator[Candidate]:
    """Rounded, in two orders, and as differences from row to row."""
    space = wanted.space
    for threshold in _THRESHOLDS[:2]:

        def part(step: float, option: int = 0, threshold: float = threshold) -> Part:
            return Part("plain", option, step, _rounded(rows.rows / step, threshold) * space.free)

        step = _largest_step(wanted, rows, lambda step: part(step).field(space))
        differences = min(ORDERS, len(rows.rows)) if rows.factors is None else 1
        if step is None:
            continue
        for option in range(2 * differences):
            field = rows.field(part(step, option))
            yield _approximate(space, field), field


def _levels(wanted: Wanted, rows: Rows) -> Iterator[Candidate]:
    """By levels: the growth of steps that is best, then the threshold that is."""
    space, hierarchy = wanted.space, wanted.space.hierarchy
    guess = 0.0
    sizes = dict.fromkeys(range(len(GROWTHS)), np.inf)
    trials = [(growth, _THRESHOLDS[0]) for growth in sizes]
    while trials:
        growth, threshold = trials.pop(0)

        def part(step: float, growth: int = growth, threshold: float = threshold) -> Part:
            numbers = hierarchy.numbers(rows.rows, step, GROWTHS[growth], space.free, threshold)
            return Part("levels", growth, step, numbers)

        step = _largest_step(wanted, rows, lambda step: part(step).field(space), guess)
        if step is not None:
            guess, field = step, rows.field(part(step))
            size = _approximate(space, field)
            sizes[growth] = min(size, sizes[growth])
            yield size, field
        if not trials and threshold == _THRESHOLDS[0]:
            best = min(sizes, key=lambda growth: sizes[growth])
            trials = [(best, threshold) for threshold in _THRESHOLDS[1:]]


def _with_modes(wanted: Wanted, rows: Rows) -> Iterator[Candidate]:
    """The mesh's own modes, as few as come near enough, or twice as many; no more than are worth their time."""
    space, is_enough = wanted.space, False
    counts = list(dict.fromkeys(min(count, space.most_modes) for count in _COUNTS_OF_MODES))
    for number, count in enumerate(counts, start=1):
        coefficients = analyzed(space, rows.rows, count)
        excess = wanted.excess(rows.displacements(synthesized(space, coefficients)))
        if not count or excess * _HOPE ** (len(counts) - number) >= _MARGIN:
            return
        if excess >= _MARGIN:
            continue  # there is hope
        for threshold in _THRESHOLDS:

            def part(step: float, coefficients: Floats = coefficients, threshold: float = threshold) -> Part:
                return Part("modes", 0, step, _rounded(coefficients / step, threshold))

            step = _largest_step(wanted, rows, lambda step: part(step).field(space))
            if step is not None:
                field = rows.field(part(step))
                yield _approximate(space, field), field
        if excess < _ROOMY or is_enough:
            return
        is_enough = True


def plain_size(wanted: Wanted) -> int:
    """About the bytes of the displacements by the simple ways alone."""
    return min((size for size, _ in _plain(wanted, Rows(wanted.displacements))), default=0)


def largest_step(wanted: Wanted) -> float | None:
    """The largest step to which the displacements can be rounded, and nothing else; None where none is known."""
    rows = Rows(wanted.displacements)
    return _largest_step(wanted, rows, lambda step: step * np.round(rows.rows / step))


def _rounded(numbers: Floats, threshold: float) -> NDArray[np.int64]:
    """Whole numbers near these; those that are smaller than the threshold become 0."""
    return np.asarray(np.sign(numbers) * np.floor(np.abs(numbers) + (1.0 - threshold)), dtype=np.int64)


def _largest_step(wanted: Wanted, rows: Rows, field: Callable[[float], Floats], guess: float = 0.0) -> float | None:
    """The largest step, in single precision, whose field (R, n, 3) is near enough; None where none is.

    The error grows about as the step does, so that a few trials come near.
    """
    allowed = wanted.error * wanted.unit
    step = guess or 2.0 * allowed
    best, low, high = None, 0.0, np.inf
    for _ in range(_TRIALS):
        step = float(np.float32(step))
        if not step > _SMALLEST_STEP * allowed:
            return best
        excess = wanted.excess(rows.displacements(field(step)))
        if excess <= 1.0:
            best, low = step, step
            if excess >= _NEAR or high / low < 1.003:
                break
        else:
            high = step
        proposed = step * float(np.clip(0.998 / max(excess, 1e-9), 1.0 / 30.0, 30.0))
        inside = low < proposed < high
        step = proposed if inside else float(np.sqrt(low * high)) if low and high < np.inf else proposed
    return best
