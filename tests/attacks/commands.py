# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""All commands that write files, with inputs in the working folder, and what the attacks check."""

from __future__ import annotations

from pathlib import Path

QUICK = ["--mode", "straight"]
KEYS = ["--from", "straight", "--to", "bent"]
SCENE_KEYS = ["--object", "Bar", "--from", "Basis", "--to", "Bent"]
_INTERPOLATE = ["interpolate", "bar.npz", *KEYS, "--frames", "0", *QUICK]
_COMBINE = ["combine", "bar.npz", "--rest", "straight", "--outer", "bent", "--inner", "leaned"]
_BAKE = ["bake", "bar.blend", *SCENE_KEYS, "--frames", "1", *QUICK]
_COMPRESS = ["compress", "map.npz", "--modes", "3", "--scheme", "published"]

# By name, with OUT for the output that is attacked and OTHER for one beside it, and the ending of OUT.
COMMANDS = {
    "interpolate": ([*_INTERPOLATE, "--output", "OUT"], ".npz"),
    "interpolate's report": ([*_INTERPOLATE, "--output", "OTHER", "--report", "OUT"], ".json"),
    "combine": ([*_COMBINE, "--output", "OUT"], ".npz"),
    "bake": ([*_BAKE, "--output", "OUT"], ".blend"),
    "bake's report": ([*_BAKE, "--output", "OTHER", "--report", "OUT"], ".json"),
    "export": (["export", "baked.blend", "--object", "Bar", "--output", "OUT"], ".usda"),
    "reconstruct": (["reconstruct", "map.npz", "--output", "OUT"], ".npz"),
    "compress": ([*_COMPRESS, "--output", "OUT"], ".qc3d"),
    "compress's report": ([*_COMPRESS, "--output", "OTHER", "--report", "OUT"], ".json"),
    "decompress": (["decompress", "map.qc3d", "map.npz", "--output", "OUT"], ".npz"),
    "decompress frames": (["decompress", "frames.qc3d", "frames.npz", "--output", "OUT"], ".npz"),
}
# Those that write several files of names of their own into a folder; one of the files is attacked.
FOLDER_COMMANDS = {
    "analyze": (["analyze", "map.npz", "--output", "FOLDER"], "summary.json"),
    "analyze shapes": (["analyze", "bar.npz", *KEYS, "--output", "FOLDER"], "surface.png"),
    "reproduce": (["reproduce", "--figure", "8", "--output", "FOLDER"], "figure8.png"),
}


def command(name: str, output: Path | str, other: Path | str = "other.out") -> list[str]:
    """The arguments of a command with the names of its outputs."""
    return [{"OUT": str(output), "OTHER": str(other)}.get(part, part) for part in COMMANDS[name][0]]


def folder_command(name: str, folder: Path | str) -> list[str]:
    """The arguments of a command with the name of its folder."""
    return [str(folder) if part == "FOLDER" else part for part in FOLDER_COMMANDS[name][0]]


def listing(folder: Path) -> dict[str, tuple[int, int, int, bytes]]:
    """What is in a folder: kind and mode, number, number of the device, and contents of everything."""
    found = {}
    for path in sorted(folder.rglob("*")):
        status = path.lstat()
        contents = path.read_bytes() if path.is_file() and not path.is_symlink() else b""
        found[str(path.relative_to(folder))] = (status.st_mode, status.st_ino, status.st_rdev, contents)
    return found


def is_sentence(text: str) -> bool:
    """Whether the command said one sentence and no more."""
    return text.startswith("qc3d: ") and text.endswith(".") and len(text.splitlines()) == 1


def is_alive(pid: int) -> bool:
    """Whether a process runs; not one that has ended and was not asked for."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False
