# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark of the stages: its shapes, and one small measurement from end to end."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import stages
from benchmarks.methods import METHODS
from benchmarks.stage_cases import SMALL, limb, load
from qc3d_addon.solver.triangles.closed_volume import ClosedComponents


def test_the_limb_is_closed_and_faces_outwards_in_both_shapes() -> None:
    faces, sphere, bent = limb(500)
    components = ClosedComponents(faces, np.zeros(len(sphere), dtype=np.int64))
    assert len(faces) == 2 * 500 - 4
    volumes = [components.volumes(shape)[0] for shape in (sphere, bent)]
    assert 0.9 * 4.0 / 3.0 * np.pi < volumes[0] < 4.0 / 3.0 * np.pi
    # Drawn out to three times the length, 0.8 of the width, and bent about its middle, which keeps the volume.
    assert 0.97 * 3.0 * 0.8**2 < volumes[1] / volumes[0] < 1.03 * 3.0 * 0.8**2


def test_every_stage_is_timed() -> None:
    found = stages.run("limb:300", "delaunay", 2, "one")
    for stage in ("mesh", "locate", "path", "fit", "factor", "frames", "measure"):
        assert found[f"stage_{stage}"] > 0.0
    assert found["cold"] >= sum(found[f"stage_{stage}"] for stage in ("mesh", "fit", "frames"))
    assert 0.0 < found["floor"] < found["one"]
    assert 0.0 < found["floor_alone"] < found["one"]
    assert found["folds"] == 0
    assert found["peak_mb"] > 10.0


def test_other_methods_are_timed_beside_ours() -> None:
    lines = stages.by_method(["limb:100"], 1).splitlines()
    assert [len(line.split("|")) for line in lines] == [len(METHODS) + 3] * 3
    cells = dict(zip(METHODS, lines[2].split("|")[2:-1], strict=True))
    assert float(cells["natural"]) > 0.0
    seconds, _, ratio = cells["poisson"].rstrip(") ").partition("(")
    assert float(ratio) == pytest.approx(float(seconds) / float(cells["natural"]), abs=0.05)


@pytest.mark.parametrize("case", SMALL)
def test_small_shapes_have_as_many_vertices_as_they_say(case: str) -> None:
    faces, first, second = load(case)
    assert len(first) == len(second) == int(case.split(":")[1])
    assert sorted(set(faces.ravel().tolist())) == list(range(len(first)))
