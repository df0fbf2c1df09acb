# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the pictures and tables of the documentation again, and says which of them changed.

    python -m benchmarks.regenerate --list
    python -m benchmarks.regenerate --only packages --only arm
    python -m benchmarks.regenerate      # everything that can be made here; hours

What needs real shapes (QC3D_DATA) or a window (QC3D_BLENDER_ROOT) is left out where these are missing, with the reason.
Benchmarks that are resumed keep their results in build/benchmarks. Exit status 1 if a command failed.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

from .catalogue import DATA, ROOT
from .registry import ENTRIES, Entry

WORK = ROOT / "build" / "regenerate"


def reason_to_leave_out(entry: Entry) -> str | None:
    """What is missing here for an entry, as a sentence; None if nothing is."""
    if entry.needs == "shapes" and not DATA.is_dir():
        return f"There are no shapes in {DATA}; name their folder with QC3D_DATA."
    if entry.needs == "window":
        if not os.environ.get("QC3D_BLENDER_ROOT"):
            return "Name a folder to chroot into with QC3D_BLENDER_ROOT; see tests/window/harness.py."
        if _package() is None:
            return "There is no package in dist/; make one with: make extension PLATFORM=linux-x64."
    return None


def make(entry: Entry) -> list[str]:
    """Run the commands of an entry, and say in a line for each picture and table what became of it.

    Raises
    ------
    subprocess.CalledProcessError
        If a command fails.
    """
    work = WORK / entry.name.replace(" ", "_")
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    before = {name: _content(ROOT / name) for name in entry.files}
    known = {
        "python": sys.executable,
        "data": str(DATA),
        "work": str(work),
        "package": str(_package()),
    }
    printed = ""
    for words in entry.commands:
        command = [word.format(**known) for word in words]
        made = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True, env=_environment())
        printed += made.stdout
    (work / "printed.txt").write_text(printed, encoding="utf-8")
    for name, source in entry.pictures.items():
        if source:
            shutil.copyfile(work / source, ROOT / name)
    said = [f"{'changed' if _content(ROOT / name) != before[name] else 'as it was'}: {name}" for name in entry.files]
    for page in entry.printed:
        missing = rows_not_on(printed, (ROOT / page).read_text(encoding="utf-8"))
        said.append(f"{f'{missing} printed rows are not' if missing else 'all printed rows are'} on {page}")
    return said


def rows_not_on(printed: str, page: str) -> int:
    """How many rows of tables in a text a page does not have."""
    have = {_cells(line) for line in page.splitlines()}
    rows = {_cells(line) for line in printed.splitlines() if line.startswith("|")}
    return len(rows - have)


def _cells(line: str) -> tuple[str, ...]:
    return tuple(cell.strip(" -") for cell in line.split("|"))


def _content(path: Path) -> bytes:
    return path.read_bytes() if path.exists() else b""


def _package() -> Path | None:
    found = sorted((ROOT / "dist").glob("qc3d-*linux-x64.zip"), key=lambda path: path.stat().st_mtime)
    return found[-1] if found else None


def _environment() -> dict[str, str]:
    """The packages of this checkout first, and one thread for numpy, as the benchmarks want it."""
    paths = [str(ROOT), os.environ.get("PYTHONPATH", "")]
    threads = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    return {**threads, **os.environ, "PYTHONPATH": os.pathsep.join(path for path in paths if path)}


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = [entry.name for entry in ENTRIES]
    parser.add_argument("--only", action="append", choices=names, metavar="NAME", help="only this; repeatable")
    parser.add_argument("--list", action="store_true", help="say what there is, and make nothing")
    chosen = parser.parse_args()
    failed = False
    for entry in ENTRIES:
        if chosen.only and entry.name not in chosen.only:
            continue
        missing = reason_to_leave_out(entry)
        if chosen.list:
            print(f"{entry.name} ({entry.takes}): {', '.join((*entry.files, *entry.printed))}")
            continue
        if missing is not None:
            print(f"{entry.name}: left out. {missing}")
            continue
        started = time.monotonic()
        try:
            said = make(entry)
        except (subprocess.CalledProcessError, OSError) as error:
            said, failed = [f"failed: {error}"], True
        print(f"{entry.name}, {time.monotonic() - started:.0f} s", *said, sep="\n  ", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
