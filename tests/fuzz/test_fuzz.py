# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A short fuzz run with different cases each time; ``python -m tests.fuzz`` runs thousands."""

from __future__ import annotations

import os
import sys

import pytest

from .runner import KINDS, MOST_SECONDS, run_cases

CASES = {"mesh": 40, "file": 200}
SEED = 20 if "CI" in os.environ else int.from_bytes(os.urandom(4), "big")


@pytest.mark.skipif(sys.platform == "win32", reason="limits time and memory as Linux and macOS do")
@pytest.mark.parametrize("kind", KINDS)
def test_every_case_ends_with_a_result_or_a_typed_error(kind: str) -> None:
    verdicts = list(run_cases(kind, SEED, range(CASES[kind])))
    assert [verdict.number for verdict in verdicts] == list(range(CASES[kind]))
    crashes = [verdict for verdict in verdicts if verdict.ending == "crash"]
    assert not crashes, f"seed {SEED}: {crashes}"
    assert max(verdict.seconds for verdict in verdicts) < MOST_SECONDS
    assert {verdict.ending for verdict in verdicts} == {"result", "error"}
