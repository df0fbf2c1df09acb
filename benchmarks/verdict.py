# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Verdicts on the figures: limits that are kept or missed, and the comparison with the classical methods."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .catalogue import Pair

CLASSICAL = ("poisson", "arap")
RIVALRY = ("edge_excess_p99", "volume_dev")


@dataclass(frozen=True)
class Verdict:
    """One pair's results: ``figures[method]`` as they are stored."""

    pair: Pair
    figures: dict[str, dict[str, Any]]
    always: dict[str, float]

    def worst(self, method: str, measure: str) -> float | None:
        """The worst value of a measure over the inner frames; None if it was not measured or does not apply."""
        if method not in self.figures:
            return None
        value = self.figures[method]["worst"].get(measure)
        return None if value is None else float(value)

    @property
    def limits(self) -> dict[str, float]:
        """The limits of this pair."""
        return self.pair.limits(self.figures["straight"]["worst"]) if "straight" in self.figures else {}

    def misses(self, method: str = "natural") -> list[str]:
        """All limits that the method misses, each as a phrase with both figures."""
        result = self.figures[method]
        if "error" in result:
            return [f"failed: {result['error']}"]
        found = []
        limits = self.limits | self.always
        if self.pair.extra_turns:
            limits.pop("still_drift")  # vertices that return to their place after full turns are asked to turn
        for measure, limit in limits.items():
            value = always_measure(result, measure)
            if value is not None and not value <= limit:
                found.append(f"{measure} {value:.3g} > {limit:.3g}")
        return found

    def rivalry(self, measure: str, method: str = "natural") -> str:
        """``better`` than both classical methods, ``worse`` than one, or neither visible: ``below floor``; or ``-``."""
        rivals = [value for name in CLASSICAL if (value := self.worst(name, measure)) is not None]
        value = self.worst(method, measure)
        if value is None or not rivals:
            return "-"
        if value < min(rivals):
            return "better"
        return "below floor" if value <= self.pair.floors[measure] else "worse"


def always_measure(result: dict[str, Any], measure: str) -> float | None:
    """A measure of a stored result by its name in the list of limits.

    The error at the keys is that of the frames computed there, before QC3D replaces them by the keys themselves.
    """
    report = result["details"].get("report")
    if measure == "key_error":
        return max(float(result["key_error"]), 0.0 if report is None else float(report["key_error"]))
    if measure == "volume_folds":
        return None if report is None else float(report["folds"]["map"] + sum(report["folds"]["frames"]))
    value = result["worst"][measure]
    return None if value is None else float(value)
