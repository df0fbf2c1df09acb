# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Files with what a bug report needs: a .zip with a text, settings and, only where asked for, the shapes.

| entry | contents |
|---|---|
| report.md | the text, for people |
| settings.json | ``format`` 1, ``version`` of QC3D, ``keys``, and the options ``fit``, ``frame``, ``play`` |
| shapes.npz | if asked for: ``faces``, ``edges``, ``polygons``, ``shape_names``, ``V0``, ``V1``, …, and ``planes`` |

Keys are called by their numbers, 1, 2 and so on; no name of the user's is in the file.
"""

from __future__ import annotations

import io
import json
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files.npz import MOST_BYTES, Archive, require_file, unreadable, write_arrays
from ..keys.files import NEEDED, shapes_in
from ..keys.halves import MirrorPlane
from ..settings import FitOptions, FrameOptions, Mirror, PlayOptions
from .modes import needs_fits
from .task import Task

_FORMAT = 1
_MOST_TEXT, _MOST_KEYS = 2**20, 64
_MOST_PLANES = 6  # the whole has 2^6 times the vertices: two modifiers with all axes
_NUMBERS_OF_PLANE = 8  # normal, direction, offset and reach
_TEXT, _SETTINGS, _SHAPES = "report.md", "settings.json", "shapes.npz"


@dataclass(frozen=True, eq=False)
class BugReport:
    """A report as it was read.

    Parameters
    ----------
    text : str
        For people.
    version : str
        Of QC3D, where the report was written.
    task : Task, optional
        The bake, ready to be carried out; None if the report has no shapes.
    """

    text: str
    version: str
    task: Task | None


def write_bug_report(
    path: Path,
    text: str,
    version: str,
    through: Sequence[str],
    options: tuple[FitOptions, FrameOptions, PlayOptions],
    mesh: Mapping[str, NDArray[Any]] | None = None,
    shapes: Mapping[str, NDArray[Any]] | None = None,
    planes: Sequence[MirrorPlane] = (),
) -> None:
    """Write a report. Nothing of the mesh is checked: a report of what cannot be used must be possible too.

    Parameters
    ----------
    path : Path
    text : str
    version : str
        Of QC3D.
    through : sequence of str
        Names of the keys that the bake goes through; they are replaced by numbers.
    options : tuple
        How to fit, to make frames, and to play them.
    mesh : dict, optional
        ``faces`` (m, 3), ``edges`` (e, 2) of no face, and ``polygons`` (m,) of the faces.
    shapes : dict, optional
        Positions (n, 3) by the names of the keys; without both, no shapes are in the file.
    planes : sequence of MirrorPlane
        Planes across which the mesh is mirrored.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    number = {name: str(k + 1) for k, name in enumerate(dict.fromkeys(through))}
    fit, frame, play = (asdict(each) for each in options)
    keys = [number[name] for name in through]
    settings = {"format": _FORMAT, "version": version, "keys": keys, "fit": fit, "frame": frame, "play": play}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(_TEXT, text)
        archive.writestr(_SETTINGS, json.dumps(settings, indent=1))
        if mesh is not None and shapes is not None:
            arrays = {**mesh, "shape_names": np.array([number[name] for name in shapes])}
            arrays |= {f"V{k}": shape for k, shape in enumerate(shapes.values())}
            rows = [(*plane.normal, *plane.direction, plane.offset, plane.reach) for plane in planes]
            arrays["planes"] = np.array(rows, dtype=np.float64).reshape(-1, _NUMBERS_OF_PLANE)
            buffer = io.BytesIO()
            write_arrays(buffer, arrays)
            archive.writestr(_SHAPES, buffer.getvalue(), zipfile.ZIP_STORED)


def read_bug_report(path: Path) -> BugReport:
    """Read a report, which may come from anyone.

    Raises
    ------
    InputError
        If it cannot be read, is no such report or is damaged, or has unusable shapes; or if there is too little memory.
    """
    require_file(path)
    try:
        with zipfile.ZipFile(path) as archive:
            text = _entry(archive, _TEXT, _MOST_TEXT).decode("utf-8")
            settings = json.loads(_entry(archive, _SETTINGS, _MOST_TEXT))
            has_shapes = _SHAPES in archive.namelist()
            if has_shapes and archive.getinfo(_SHAPES).compress_type != zipfile.ZIP_STORED:
                raise ValueError("its shapes are compressed twice")
            stored = _entry(archive, _SHAPES, MOST_BYTES) if has_shapes else b""
    except InputError:
        raise
    except KeyError as error:
        raise InputError(f"{path} is no report of QC3D: an entry is missing; write it again in Blender.") from error
    except (OSError, ValueError, EOFError, RuntimeError, NotImplementedError, RecursionError, MemoryError,
            zipfile.BadZipFile, zlib.error) as error:  # fmt: skip
        raise unreadable(path, error) from error
    try:
        if settings["format"] != _FORMAT:
            raise InputError(f"{path} was written by a later version of QC3D; install that version.")
        version, through = str(settings["version"]), tuple(map(str, settings["keys"]))
        frame, play = settings["frame"], settings["play"]
        fit_options = FitOptions(**settings["fit"])
        frame_options = FrameOptions(**{**frame, "via_at": tuple(frame["via_at"])})
        play_options = PlayOptions(**{**play, "also_at": tuple(play["also_at"])})
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise InputError(f"The settings in {path} make no sense; write the report again in Blender.") from error
    if not stored:
        return BugReport(text, version, None)
    if not 2 <= len(through) <= _MOST_KEYS:
        raise InputError(f"{path} goes through {len(through)} keys; 2 to {_MOST_KEYS} are possible.")
    archive_of_shapes = Archive(io.BytesIO(stored), path, NEEDED)
    names = tuple(dict.fromkeys(through))
    # Earlier reports have no planes: they are found as for other files of shapes.
    planes = _planes(archive_of_shapes, path) if "planes" in archive_of_shapes else None
    pairs_of_halves = (len(through) - 1) << len(planes or ())  # each plane doubles the vertices
    shapes, faces, polygons = shapes_in(
        archive_of_shapes, path, names, pairs=pairs_of_halves, quality=fit_options.quality,
        needs_fits=needs_fits(frame_options.mode),
    )  # fmt: skip
    edges = archive_of_shapes.read(["edges"])["edges"] if "edges" in archive_of_shapes else None
    mirror: Mirror | tuple[MirrorPlane, ...] = "auto" if planes is None else planes
    task = Task.of_keys(shapes, faces, edges, through, fit_options, frame_options, polygons=polygons, mirror=mirror)
    return BugReport(text, version, Task(task.pairs, through, fit_options, frame_options, play=play_options))


def _planes(archive: Archive, path: Path) -> tuple[MirrorPlane, ...]:
    """The mirror planes in a file of shapes; raises InputError if they are not what is written."""
    rows = archive.read(["planes"])["planes"]
    is_table = rows.dtype == np.float64 and rows.ndim == 2 and rows.shape[1] == _NUMBERS_OF_PLANE
    if not is_table or len(rows) > _MOST_PLANES or not np.isfinite(rows).all():
        raise InputError(f"The mirror planes in {path} make no sense; write the report again in Blender.")
    if not np.allclose((rows[:, 0:3] * rows[:, 3:6]).sum(axis=1), 1.0):
        raise InputError(f"A mirror plane in {path} mirrors nothing; write the report again in Blender.")
    return tuple(
        MirrorPlane((a, b, c), (x, y, z), offset, reach) for a, b, c, x, y, z, offset, reach in rows.tolist()
    )


def _entry(archive: zipfile.ZipFile, name: str, most: int) -> bytes:
    """An entry of at most so many bytes, whatever its header says."""
    with archive.open(name) as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise ValueError(f"{name} has more than {most} bytes")
    return data
