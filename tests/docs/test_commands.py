# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Commands that the documentation names exist, and their options too."""

from __future__ import annotations

import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [*sorted(ROOT.glob("docs/**/*.md")), *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md"))]
# Commands in lines of code, and between backquotes, which may be broken into lines.
FENCED = re.compile(r"^```\w*\n(.*?)^```", re.DOTALL | re.MULTILINE)
INDENTED = re.compile(r"^    (\S.*)$", re.MULTILINE)
INLINE = re.compile(r"`([^`]+)`")
OPTION = re.compile(r"(?<![\w-])--[a-z][\w-]*")
# Of other programs: their own options.
OTHERS = {"--background", "--python", "--command", "--online-mode", "--python-exit-code", "--factory-startup"}


def commands() -> list[tuple[str, str]]:
    """The page and the words of every command of this project that a page shows."""
    found = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        fenced = [line for block in FENCED.findall(text) for line in block.replace("\\\n", " ").splitlines()]
        rest = FENCED.sub("", text)
        shown = [*fenced, *INDENTED.findall(rest), *(" ".join(code.split()) for code in INLINE.findall(rest))]
        for line in shown:
            words = line.split("  #")[0].strip()
            if re.match(r"(?:\w+=\S+ )*(?:qc3d|blender --command qc3d|make|python(?:3\S*)?) ", words + " "):
                found.append((page.relative_to(ROOT).as_posix(), words))
    return sorted(set(found))


@cache
def help_of(*command: str) -> str:
    made = subprocess.run([sys.executable, *command, "--help"], cwd=ROOT, capture_output=True, text=True, check=True)
    return made.stdout


def _program(words: str) -> tuple[str, ...] | None:
    """What is run to be told of the options, such as ("-m", "benchmarks.clips"); None for other programs."""
    if match := re.match(r"(?:blender --command )?qc3d(?: (\w+))?", words):
        return ("-m", "qc3d_addon", *filter(None, [match[1]]))
    if match := re.search(
        r"python\S* (?:-m ((?:benchmarks|tests|qc3d_addon)[\w.]*)|((?:tools|assets)/\S+\.py))", words
    ):
        return ("-m", match[1]) if match[1] else (match[2],)
    return None


@pytest.mark.slow
@pytest.mark.parametrize("program", sorted({p for _, words in commands() if (p := _program(words))}), ids=" ".join)
def test_options_exist(program: tuple[str, ...]) -> None:
    options = {
        (page, option)
        for page, words in commands()
        if _program(words) == program
        for option in OPTION.findall(words)
        if option not in OTHERS
    }
    if not options:
        assert _exists(program), program
        return
    known = set(OPTION.findall(help_of(*program)))
    assert [pair for pair in sorted(options) if pair[1] not in known] == []


def test_targets_of_make_exist() -> None:
    known = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE))
    named = {
        word
        for _, words in commands()
        if (found := re.match(r"(?:\w+=\S+ )*make ([\w-]+)", words))
        for word in found.groups()
    }
    assert named - known == set()
    assert len(named) > 4


def _exists(program: tuple[str, ...]) -> bool:
    if program[0] != "-m":
        return (ROOT / program[0]).is_file()
    path = ROOT / program[1].replace(".", "/")
    if len(program) == 3:
        return (ROOT / f"{path}").is_dir() and program[2] in help_of("-m", program[1])
    return path.with_suffix(".py").is_file() or (path / "__main__.py").is_file()
