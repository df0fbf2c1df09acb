# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark's report: limits, comparison with classical methods, stored results, tables."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks import report, runner
from benchmarks import results as results_module
from benchmarks.catalogue import DATA, PAIRS, Catalogue, Pair
from benchmarks.methods import METHODS, Contest
from benchmarks.results import Results
from benchmarks.verdict import Verdict

FLOORS = {"edge_excess_p99": 0.0025, "volume_dev": 0.001}
ALWAYS = {"key_error": 1e-6, "still_drift": 1e-6, "volume_folds": 0, "intersections": 0}
LISTED = Pair("body", "rest", "t_pose", {"edge_excess_p99": 40.0, "volume_dev": 20.0}, FLOORS)


def figures(edge: float, volume: float | None, folds: int = 0, **more: float) -> dict[str, Any]:
    worst = {"edge_excess_p99": edge, "volume_dev": volume, "still_drift": 0.0, "intersections": 0}
    made = {"folds": {"map": folds, "frames": [0, 0]}, "tetrahedra": 7, "key_error": 0.0, "residual": {"max": 0.0}}
    return {
        "worst": worst | more, "key_error": 0.0, "jerk": 0.1, "seconds": 1.0, "revision": "abc",
        "details": {"report": made},
    }  # fmt: skip


def verdict(natural: dict[str, Any], pair: Pair = LISTED) -> Verdict:
    rivals = {"straight": figures(0.2, 0.1), "poisson": figures(0.004, 0.003), "arap": figures(0.006, 0.002)}
    return Verdict(pair, rivals | {"natural": natural}, ALWAYS)


def test_limits_are_a_share_of_the_straight_blend_but_not_below_the_floor() -> None:
    assert verdict(figures(0.0, 0.0)).limits == pytest.approx({"edge_excess_p99": 0.005, "volume_dev": 0.005})
    mild = Verdict(LISTED, {"straight": figures(0.01, 0.001)}, ALWAYS)
    assert mild.limits == FLOORS


def test_every_missed_limit_is_named() -> None:
    assert verdict(figures(0.005, 0.005)).misses() == []
    missed = verdict(figures(0.02, 0.02, folds=3, intersections=2, still_drift=1e-3)).misses()
    assert sorted(miss.split()[0] for miss in missed) == [
        "edge_excess_p99", "intersections", "still_drift", "volume_dev", "volume_folds",
    ]  # fmt: skip
    assert verdict({"error": "natural: no", "worst": {}, "details": {}}).misses() == ["failed: natural: no"]


def test_the_error_at_the_keys_is_the_one_before_they_are_put_in() -> None:
    result = figures(0.0, 0.0)
    result["details"]["report"]["key_error"] = 1e-3
    assert verdict(result).misses() == ["key_error 0.001 > 1e-06"]


def test_what_is_asked_to_turn_may_leave_its_place() -> None:
    drifting = {"straight": figures(1.0, 1.0), "natural": figures(0.0, 0.0, still_drift=0.3)}
    assert Verdict(Pair("bar", "straight", "twist450"), drifting, ALWAYS).misses() == []
    assert len(Verdict(Pair("bar", "straight", "twist270"), drifting, ALWAYS).misses()) == 1


def test_not_a_number_misses_a_limit() -> None:
    assert len(verdict(figures(float("nan"), 0.0)).misses()) == 1


@pytest.mark.parametrize(
    ("edge", "expected"), [(0.0039, "better"), (0.0041, "worse"), (0.004, "worse"), (0.001, "better")]
)
def test_rivalry_asks_for_better_than_both(edge: float, expected: str) -> None:
    assert verdict(figures(edge, 0.0)).rivalry("edge_excess_p99") == expected


def test_rivalry_below_the_floor_and_without_volume() -> None:
    close = Verdict(LISTED, {"poisson": figures(0.001, None), "natural": figures(0.002, None)}, ALWAYS)
    assert close.rivalry("edge_excess_p99") == "below floor"
    assert close.rivalry("volume_dev") == "-"


def test_shortfalls_name_every_pair_and_reason() -> None:
    bad = figures(0.5, 0.5)
    assert len(runner.shortfalls([verdict(bad)])) == 4  # two limits, two rivals
    assert runner.shortfalls([verdict(figures(0.001, 0.001))]) == []
    assert runner.shortfalls([Verdict(LISTED, {"straight": bad}, ALWAYS)]) == [f"{LISTED}: natural was not measured"]


def test_document_names_the_misses_and_counts() -> None:
    text = report.document([verdict(figures(0.02, 0.0, intersections=2))])
    assert "edge_excess_p99 0.02 > 0.005; intersections 2 > 0" in text
    assert "keeps every limit on 0 of 1 pairs" in text
    assert "| body rest → t_pose | 0.200 |" in text


def test_tables_are_written_between_the_markers(tmp_path: Path) -> None:
    path = tmp_path / "page.md"
    path.write_text(f"before\n{report.BEGIN}\nold\n{report.END}\nafter\n", encoding="utf-8")
    report.write_between_markers(path, "new")
    text = path.read_text(encoding="utf-8")
    assert "old" not in text
    assert text.index("before") < text.index("new") < text.index("after")
    path.write_text("no markers", encoding="utf-8")
    with pytest.raises(SystemExit, match="no lines"):
        report.write_between_markers(path, "new")


def test_results_of_other_sources_are_not_reused(tmp_path: Path) -> None:
    results = Results(tmp_path, 3, "delaunay", "normal")
    assert results.load(LISTED, "natural") is None
    results.store(LISTED, "natural", {"worst": {}})
    found = results.load(LISTED, "natural")
    assert found is not None
    assert found["worst"] == {}
    assert Results(tmp_path, 3, "delaunay", "fine").load(LISTED, "natural") is None
    for path in tmp_path.glob("*.json"):
        path.write_text(json.dumps(found | {"fingerprint": "other"}), encoding="utf-8")
    assert results.load(LISTED, "natural") is None
    assert results.load(LISTED, "natural", current=False) is not None


def test_results_depend_on_the_modules_of_their_method(monkeypatch: pytest.MonkeyPatch) -> None:
    own = {method: [path.stem for path in results_module._sources(method)] for method in METHODS}
    assert own["arap"] == ["arap", "gradients", "interior"]
    assert own["straight"] == []
    assert {"natural", "course"} <= set(own["natural"])
    before = {method: results_module.fingerprint(method) for method in METHODS}
    monkeypatch.setitem(results_module.MODULES, "poisson", results_module.MODULES["smooth"])
    changed = [method for method in METHODS if results_module.fingerprint(method) != before[method]]
    assert changed == ["poisson"]


def test_every_method_runs_on_a_small_pair(bar: dict[str, np.ndarray]) -> None:
    times = np.array([0.0, 0.5, 1.0])
    contest = Contest(bar["faces"], bar["V0"], bar["V1"], times, {"engine": "delaunay", "quality": "normal"})
    for method in ("straight", "poisson", "arap", "natural"):
        outcome = contest.run(method)
        assert outcome.frames.shape == (3, *bar["V0"].shape)
        assert np.allclose(outcome.frames[0], bar["V0"], atol=1e-9)
        assert np.allclose(outcome.frames[-1], bar["V1"], atol=1e-9)


def test_the_catalogue_holds_the_listed_pairs_and_every_shape() -> None:
    if not PAIRS.is_file() or not DATA.is_dir():
        pytest.skip(f"needs the list {PAIRS} (QC3D_PAIRS) and the shapes in {DATA} (QC3D_DATA)")
    catalogue = Catalogue()
    assert len(set(catalogue.pairs)) == len(catalogue.pairs)
    assert catalogue.pairs[0].listed
    assert Pair("body", "arm_raise30", "t_pose") in catalogue.pairs
    assert catalogue.find("body:rest:sit").listed
    with pytest.raises(SystemExit, match="no pair"):
        catalogue.find("body:rest:nowhere")
