# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Time the stages of one bake, in a process of its own, and print them as JSON.

    python -m benchmarks.stage_run CASE ENGINE IN-BETWEENS       the stages and the warm bake
    python -m benchmarks.stage_run CASE ENGINE IN-BETWEENS one   also one frame and its floor
    python -m benchmarks.stage_run CASE yardstick                fTetWild with its own defaults on the first shape
    python -m benchmarks.stage_run CASE METHOD IN-BETWEENS method    all in-betweens by a method of benchmarks.methods
"""

from __future__ import annotations

import importlib
import json
import os
import resource
import sys
import tempfile
import time as clock
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any
from unittest.mock import patch

import numpy as np

from . import stage_cases
from .catalogue import Floats, Ints

if TYPE_CHECKING:
    from scipy.sparse import csr_array
    from scipy.sparse.linalg import SuperLU

    from qc3d_addon.solver.fit.fitted_map import FittedMap
    from qc3d_addon.solver.settings import Engine

_REPEATS = 15


def main(arguments: list[str]) -> None:
    """Print one JSON object."""
    case, engine = arguments[:2]
    if engine == "yardstick":
        found = yardstick(case)
    elif arguments[3:] == ["method"]:
        found = by_method(case, engine, int(arguments[2]))
    else:
        found = stages(case, "tetwild" if engine == "tetwild" else "delaunay",
             int(arguments[2]), arguments[3:] == ["one"])
    usage = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
    found |= {"peak_mb": usage[0].ru_maxrss / 1024.0, "peak_child_mb": usage[1].ru_maxrss / 1024.0}
    found |= {"cpu": sum(part.ru_utime + part.ru_stime for part in usage)}
    json.dump(found, sys.stdout)


def stages(case: str, engine: Engine, count: int, one: bool) -> dict[str, Any]:
    """Seconds of each stage of a cold bake and of a warm one; if ``one``, also of a single frame and its floor."""
    started = clock.perf_counter()
    from qc3d_addon.solver.api import Fit
    from qc3d_addon.solver.fit.fit_pair import fit_pair
    from qc3d_addon.solver.frames.bake import evenly_spaced
    from qc3d_addon.solver.keys.keypair import KeyPair
    from qc3d_addon.solver.settings import FitOptions
    from qc3d_addon.solver.support.progress import finish

    imported = clock.perf_counter() - started
    faces, key0, key1 = stage_cases.load(case)
    options = FitOptions(engine=engine)
    started, used = clock.perf_counter(), clock.process_time()
    pair = KeyPair.checked(key0, key1, faces)
    fitted = finish(fit_pair(pair, options))
    bake = Fit(fitted).inbetweens(evenly_spaced(count))
    cold, used = clock.perf_counter() - started, clock.process_time() - used
    seconds: dict[str, float] = dict(bake.report.seconds)
    warm = _fastest(lambda: Fit(fitted).inbetweens(evenly_spaced(count)), 2)
    found = {
        "vertices": len(key0),
        "tetrahedra": len(fitted.mesh.tets),
        "folds": int(max(one.folds for one in bake.report.certificates)),
        "import": imported,
        "cold": cold,
        "cold_processor": used,
        "warm": warm,
        **{f"stage_{name}": value for name, value in seconds.items()},
        **(_one_frame(fitted) if one else {}),
        "count": count,
    }
    with suppress(ImportError):  # without Blender's module there is nothing to write to
        found |= {"stage_write": _written(faces, bake.frames)}
    return found


def _one_frame(fitted: FittedMap) -> dict[str, float]:
    """Seconds of one frame, of its back-substitutions, and of the same back-substitutions repeated on their own."""
    from qc3d_addon.solver.frames.natural import NaturalFrames
    from qc3d_addon.solver.maps import volume_system
    from qc3d_addon.solver.numerics.nested_dissection import factored
    from qc3d_addon.solver.surface import system

    watches: list[_Stopwatch] = []

    def watched(matrix: csr_array) -> _Stopwatch:
        watches.append(_Stopwatch(factored(matrix)))
        return watches[-1]

    with patch.object(volume_system, "factored", watched), patch.object(system, "factored", watched):
        maker = NaturalFrames(replace(fitted, path=None, volume=replace(fitted.volume)))  # nothing made yet
    middle = np.array([0.4])
    list(maker.frames(middle))  # what is made on first use
    runs = []
    for _ in range(_REPEATS):
        for watch in watches:
            watch.clear()
        started = clock.perf_counter()
        list(maker.frames(middle))
        runs.append((clock.perf_counter() - started, sum(watch.seconds for watch in watches)))
    one, within = min(runs)
    return {"one": one, "floor": within, "floor_alone": sum(_fastest(watch.again, _REPEATS) for watch in watches)}


class _Stopwatch:
    """Factors that measure the seconds of their back-substitutions."""

    def __init__(self, factors: SuperLU) -> None:
        self._factors = factors
        self.clear()

    def clear(self) -> None:
        self.seconds = 0.0
        self._loads: list[Floats] = []

    def solve(self, load: Floats) -> Floats:
        started = clock.perf_counter()
        solution: Floats = self._factors.solve(load)
        self.seconds += clock.perf_counter() - started
        self._loads.append(load)
        return solution

    def again(self) -> None:
        for load in self._loads:
            self._factors.solve(load)


def _written(faces: Ints, frames: Floats) -> float:
    """Seconds to put frames into a mesh as shape keys."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    mesh = bpy.data.meshes.new("Mesh")
    mesh.from_pydata(frames[0].tolist(), [], faces.tolist())
    obj = bpy.data.objects.new("Object", mesh)
    obj.shape_key_add(name="Basis")
    started = clock.perf_counter()
    for frame in frames[1:]:
        key = obj.shape_key_add(from_mix=False)
        key.points.foreach_set("co", frame.astype(np.float32).ravel())
    return clock.perf_counter() - started


def by_method(case: str, method: str, count: int) -> dict[str, Any]:
    """Processor seconds of one method for all in-betweens, from two arrays; None where its package is missing."""
    from .methods import Contest

    faces, key0, key1 = stage_cases.load(case)
    contest = Contest(faces, key0, key1, np.linspace(0.0, 1.0, count + 2), {})
    used = clock.process_time()
    try:
        contest.run(method)
    except ModuleNotFoundError:
        return {"processor": None}
    return {"processor": clock.process_time() - used}


def yardstick(case: str) -> dict[str, Any]:
    """Seconds of pytetwild.tetrahedralize with its own defaults."""
    from unittest.mock import MagicMock

    # The package imports pyvista for functions that are not used here.
    sys.modules.setdefault("pyvista", MagicMock())
    tetrahedralize = importlib.import_module("pytetwild").tetrahedralize

    faces, key0, _ = stage_cases.load(case)
    with tempfile.TemporaryDirectory(prefix="qc3d-") as folder:
        os.chdir(folder)  # fTetWild leaves a file in the working folder
        started = clock.perf_counter()
        _, tets = tetrahedralize(key0, faces.astype(np.int32))
        seconds = clock.perf_counter() - started
        os.chdir("/")
    return {"yardstick": seconds, "tetrahedra": len(tets)}


def _fastest(work: Callable[[], object], repeats: int) -> float:
    times = []
    for _ in range(repeats):
        started = clock.perf_counter()
        work()
        times.append(clock.perf_counter() - started)
    return min(times)


if __name__ == "__main__":
    main(sys.argv[1:])
