# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress bars: one for each stage on a terminal, none elsewhere."""

from __future__ import annotations

import io
import sys
from typing import NamedTuple

import pytest

from qc3d_addon.cli.progress_bars import StageBars


class Progress(NamedTuple):
    stage: str
    fraction: float


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


REPORTS = [Progress("mesh", 0.0), Progress("mesh", 0.5), Progress("fit", 0.25), Progress("fit", 0.75)]


def test_a_bar_for_each_stage_runs_to_its_end(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    with StageBars() as bars:
        for report in REPORTS:
            bars(report)
    lines = [line.split("\r")[-1] for line in terminal.getvalue().split("\n") if line]
    assert [line.split()[:2] for line in lines] == [["mesh", "100%"], ["fit", "100%"]]


def test_a_stage_that_failed_does_not_look_done(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    with pytest.raises(RuntimeError), StageBars() as bars:  # noqa: PT012
        bars(REPORTS[1])
        raise RuntimeError
    assert "100%" not in terminal.getvalue()


def test_nothing_is_drawn_without_a_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    with StageBars() as bars:
        for report in REPORTS:
            bars(report)
    assert capsys.readouterr() == ("", "")


def test_nothing_is_drawn_without_tqdm(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setitem(sys.modules, "tqdm", None)
    with StageBars() as bars:
        bars(REPORTS[0])
    assert terminal.getvalue() == ""
