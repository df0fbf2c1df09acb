# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs fTetWild once. This is the only code that uses pytetwild.

It is a separate process because pytetwild holds the GIL while it works, cannot be canceled, removes the interrupt
handler, and may exit or crash from C++. It is started by :mod:`qc3d_addon.solver.meshing.tetwild`, which defines the
contents of the files::

    python -I tetwild_child.py WRAPPER NUMPY FOLDER SECONDS

WRAPPER is the file of pytetwild's compiled module, which is loaded without the package around it because that needs
pyvista. NUMPY is the folder that contains numpy. FOLDER contains the input as .npy files and receives ``output.npz``.
SECONDS is a time limit that holds even if no parent is left to enforce it. Without FOLDER and SECONDS, the program only
loads the module.
"""

from __future__ import annotations

import importlib.util
import math
import os
import signal
import sys
from io import BytesIO
from pathlib import Path
from types import ModuleType


def main(arguments: list[str]) -> None:
    wrapper, numpy_folder = Path(arguments[0]), arguments[1]
    sys.path.append(numpy_folder)
    if len(arguments) == 2:
        _load(wrapper)
        return
    folder, seconds = Path(arguments[2]), float(arguments[3])
    if hasattr(signal, "alarm"):
        signal.alarm(math.ceil(seconds) + 5)
    import numpy as np

    arrays = {file.stem: np.load(file, allow_pickle=False) for file in folder.glob("*.npy")}
    # The compiled function takes positional arguments only; the comments give pytetwild's names for them.
    points, tets = _load(wrapper).tetrahedralize_mesh(
        arrays["points"],
        arrays["faces"].astype(np.uint32),
        True,  # optimize
        True,  # skip_simplify: the surface is coarse already, and simplifying would drop the two vertices of the box
        0.05,  # edge_length_r: unused because edge_length_abs is given
        float(arrays["edge_length"]),  # edge_length_abs
        float(arrays["epsilon"]),
        10.0,  # stop_energy
        False,  # coarsen
        0,  # num_threads: all
        80,  # num_opt_iter
        6,  # loglevel
        True,  # quiet
        True,  # vtk_ordering: positive orientation
        True,  # disable_filtering: keep the whole box
        arrays["size_points"],
        arrays["size_tets"].astype(np.int32),
        arrays["size_values"],
    )
    # Via memory: if the disk is full, writing bytes raises a clear error, writing an archive does not.
    archive = BytesIO()
    np.savez(archive, points=points, tets=tets)
    # Renamed when complete, so that a crash while writing cannot look like a result.
    (folder / "unfinished.npz").write_bytes(archive.getvalue())
    os.replace(folder / "unfinished.npz", folder / "output.npz")


def _load(wrapper: Path) -> ModuleType:
    libraries = wrapper.parent.parent / "pytetwild.libs"
    if sys.platform == "win32" and libraries.is_dir():
        os.add_dll_directory(str(libraries))  # as the package's own __init__ does on Windows
    spec = importlib.util.spec_from_file_location("PyfTetWildWrapper", wrapper)
    if spec is None or spec.loader is None:
        raise ImportError(f"{wrapper} is not an extension module")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


if __name__ == "__main__":
    try:
        main(sys.argv[1:])
    except Exception as error:
        sys.exit(f"{type(error).__name__}: {error}".splitlines()[0])
