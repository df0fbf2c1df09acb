# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of bug reports: baked again by one command, without names, and refused in one sentence if damaged."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from qc3d_addon.cli import main
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.frames.bug_reports import read_bug_report, write_bug_report
from qc3d_addon.solver.keys.halves import MirrorPlane
from qc3d_addon.solver.settings import FitOptions, FrameOptions, PlayOptions

OPTIONS = (FitOptions(seed=3), FrameOptions(mode="straight"), PlayOptions(count=2))


@pytest.fixture
def report(bar: dict[str, np.ndarray], tmp_path: Path) -> Path:
    path = tmp_path / "report.zip"
    mesh = {"faces": bar["faces"], "edges": np.empty((0, 2), dtype=np.int32)}
    shapes = {"Secret": bar["V0"].astype(np.float32), "Other": bar["V1"].astype(np.float32)}
    write_bug_report(path, "A text.\n", "9.8.7", ("Secret", "Other", "Secret"), OPTIONS, mesh, shapes)
    return path


def changed(path: Path, change: Callable[[dict[str, bytes]], None]) -> Path:
    """The file with other entries."""
    with zipfile.ZipFile(path) as archive:
        entries = {name: archive.read(name) for name in archive.namelist()}
    change(entries)
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in entries.items():
            archive.writestr(name, data)
    return path


def with_settings(**values: object) -> Callable[[dict[str, bytes]], None]:
    def change(entries: dict[str, bytes]) -> None:
        entries["settings.json"] = json.dumps(json.loads(entries["settings.json"]) | values).encode()

    return change


def test_everything_comes_back(report: Path, bar: dict[str, np.ndarray]) -> None:
    found = read_bug_report(report)
    assert (found.text, found.version) == ("A text.\n", "9.8.7")
    assert found.task is not None
    assert found.task.through == ("1", "2", "1")
    assert (found.task.fit_options, found.task.frame_options, found.task.play) == OPTIONS
    np.testing.assert_array_equal(found.task.pairs["1", "2"].key0, bar["V0"].astype(np.float32))


def test_no_name_is_in_the_file(report: Path) -> None:
    with zipfile.ZipFile(report) as archive:
        for name in archive.namelist():
            data = archive.read(name)
            for secret in ("Secret", "Other"):
                assert secret.encode() not in data
                assert secret.encode("utf-32-le") not in data


def test_the_command_bakes_it_again(
    report: Path, bar: dict[str, np.ndarray], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frames, numbers = tmp_path / "frames.npz", tmp_path / "numbers.json"
    assert main.main(["replay", str(report), "--output", str(frames), "--report", str(numbers)]) == 0
    said = capsys.readouterr().out
    assert said.startswith("A text.\n")
    assert "7 shapes in" in said
    with np.load(frames, allow_pickle=False) as stored:
        np.testing.assert_array_equal(stored["key1"], bar["V0"].astype(np.float32))
        assert stored["frames"].shape == (7, *bar["V0"].shape)
    assert json.loads(numbers.read_text(encoding="utf-8"))["mode"] == "straight"


def test_without_shapes_there_is_nothing_to_bake(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "report.zip"
    write_bug_report(path, "A text.\n", "1.0.0", ("a", "b"), OPTIONS)
    assert read_bug_report(path).task is None
    assert main.main(["replay", str(path)]) == 2
    said = capsys.readouterr()
    assert said.out == "A text.\n"
    assert "ask for a report with shapes" in said.err


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda entries: entries.pop("settings.json"), "an entry is missing"),
        (lambda entries: entries.update({"settings.json": b"{"}), "cannot be read"),
        (lambda entries: entries.update({"settings.json": b"[]"}), "make no sense"),
        (lambda entries: entries.update({"report.md": b"\xff"}), "cannot be read"),
        (lambda entries: entries.update({"report.md": b" " * (2**20 + 1)}), "more than"),
        (lambda entries: entries.update({"shapes.npz": b"nothing"}), "is not an .npz file"),
        (with_settings(format=2), "later version"),
        (with_settings(fit={"quality": "best"}), "Unknown quality"),
        (with_settings(fit={"more": 1}), "make no sense"),
        (with_settings(keys=["1"]), "goes through 1 keys"),
        (with_settings(keys=["1", "5"]), "no shape '5'"),
    ],
)
def test_damaged_files_are_refused(report: Path, change: Callable[[dict[str, bytes]], None], sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        read_bug_report(changed(report, change))


def test_mirror_planes_come_back(bar: dict[str, np.ndarray], tmp_path: Path) -> None:
    """What a Mirror modifier completes is completed again, across the same plane and not one that is guessed."""
    path = tmp_path / "report.zip"
    mesh = {"faces": bar["faces"], "edges": np.empty((0, 2), dtype=np.int32)}
    shapes = {"a": bar["V0"], "b": bar["V1"]}
    plane = MirrorPlane((0.0, 0.6, 0.8), (0.0, 0.6, 0.8), 0.25, 1e-3)
    write_bug_report(path, "", "1.0.0", ("a", "b"), OPTIONS, mesh, shapes, [plane])
    task = read_bug_report(path).task
    assert task is not None
    pair = task.pairs["1", "2"]
    assert pair.planes == (plane,)
    assert len(pair.key0) == 2 * len(bar["V0"])
    write_bug_report(path, "", "1.0.0", ("a", "b"), OPTIONS, mesh, shapes)
    without = read_bug_report(path).task
    assert without is not None
    assert not without.pairs["1", "2"].planes


@pytest.mark.parametrize(
    ("rows", "sentence"),
    [
        (np.zeros((1, 7)), "make no sense"),
        (np.zeros((7, 8)), "make no sense"),
        (np.full((1, 8), np.nan), "make no sense"),
        (np.zeros((1, 8)), "mirrors nothing"),
    ],
)
def test_planes_that_mirror_nothing_are_refused(report: Path, rows: np.ndarray, sentence: str) -> None:
    def change(entries: dict[str, bytes]) -> None:
        with np.load(io.BytesIO(entries["shapes.npz"])) as stored:
            arrays = {**stored, "planes": rows}
        buffer = io.BytesIO()
        np.savez(buffer, **arrays)
        entries["shapes.npz"] = buffer.getvalue()

    with pytest.raises(InputError, match=sentence):
        read_bug_report(changed(report, change))


def test_every_truncation_is_refused_or_read(report: Path) -> None:
    data = report.read_bytes()
    for end in range(0, len(data), 997):
        report.write_bytes(data[:end])
        with pytest.raises(InputError):
            read_bug_report(report)
