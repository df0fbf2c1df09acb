# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stored results, so that a benchmark can be resumed: a JSON of figures and an .npz of frames per pair and method."""

from __future__ import annotations

import hashlib
import importlib
import json
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

from . import classical
from .catalogue import ROOT, Floats, Ints, Pair
from .methods import METHODS, MODULES, OURS

RESULTS = ROOT / "build/benchmarks"


def revision() -> str:
    """The commit that is measured, with a plus sign if the working tree differs from it."""
    head = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, capture_output=True, text=True)
    if head.returncode != 0:
        return "unknown"
    changed = subprocess.run(["git", "status", "--porcelain", "qc3d_addon"], cwd=ROOT, capture_output=True, text=True)
    return head.stdout.strip() + ("+" if changed.stdout else "")


def content(pair: Pair) -> str:
    """Hash of the triangles and both shapes."""
    digest = hashlib.sha256()
    for array in pair.load():
        digest.update(array.tobytes())
    return digest.hexdigest()[:16]


def fingerprint(method: str) -> str:
    """Hash of the sources that a result of the method depends on."""
    digest = hashlib.sha256()
    for source in [*_sources(method), ROOT / "benchmarks/measures.py"]:
        digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


def _sources(method: str) -> list[Path]:
    """The solver, or the module of a classical method and those of the same folder that it imports."""
    if method in OURS:
        return sorted((ROOT / "qc3d_addon/solver").rglob("*.py"))
    found, waiting = set[Path](), [MODULES[method]] if method in MODULES else []
    while waiting:
        module = Path(str(waiting.pop().__file__))
        if module not in found:
            found.add(module)
            names = re.findall(r"^from \.(\w*) import (\w+)", module.read_text(encoding="utf-8"), re.MULTILINE)
            waiting += [importlib.import_module(f"{classical.__name__}.{one or other}") for one, other in names]
    return sorted(found)


class Results:
    """The folder of results for one choice of in-betweens, engine and quality.

    Sources are hashed once, here: a result belongs to the sources that this process has loaded, even if they are edited
    while it runs.
    """

    def __init__(self, folder: Path, inner_frames: int, engine: str, quality: str) -> None:
        self.folder = folder
        self.inner_frames, self.engine, self.quality = inner_frames, engine, quality
        self._revision = revision()
        self._fingerprints = {method: fingerprint(method) for method in METHODS}

    def _path(self, pair: Pair, method: str, suffix: str) -> Path:
        parts = [str(pair).replace(":", "-"), method, str(self.inner_frames)]
        parts += (self.engine, self.quality) if method in OURS else ()
        return self.folder / ("_".join(parts) + suffix)

    def load(self, pair: Pair, method: str, *, current: bool = True) -> dict[str, Any] | None:
        """The stored figures; None if there are none or, with ``current``, if sources or shapes were others."""
        path = self._path(pair, method, ".json")
        if not path.is_file():
            return None
        result: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        is_current = result["fingerprint"] == self._fingerprints[method] and result.get("content") == content(pair)
        return result if is_current or not current else None

    def store(self, pair: Pair, method: str, result: dict[str, Any]) -> None:
        """Store figures together with the hash of the sources."""
        self.folder.mkdir(parents=True, exist_ok=True)
        stamped = {"revision": self._revision, "fingerprint": self._fingerprints[method], "content": content(pair)}
        stamped |= result
        self._path(pair, method, ".json").write_text(json.dumps(stamped, indent=1), encoding="utf-8")

    def store_frames(self, pair: Pair, method: str, faces: Ints, times: Floats, frames: Floats) -> None:
        """Store frames for pictures, in single precision."""
        self.folder.mkdir(parents=True, exist_ok=True)
        path = self._path(pair, method, ".npz")
        np.savez_compressed(path, faces=faces, times=times, frames=frames.astype(np.float32))

    def load_frames(self, pair: Pair, method: str) -> tuple[Ints, Floats, Floats] | None:
        """Stored triangles, times and frames; None if there are none."""
        path = self._path(pair, method, ".npz")
        if not path.is_file():
            return None
        with np.load(path, allow_pickle=False) as stored:
            return stored["faces"].astype(np.int64), stored["times"], stored["frames"].astype(np.float64)
