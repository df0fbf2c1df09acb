# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw in-betweens side by side: the first key, the in-betweens, the second key, one row for each file.

A file is a baked .blend, with --object, --from and --to to say what to draw, or the FRAMES.npz of ``qc3d interpolate``.
All rows show the same two keys through the same camera. A name that ends in .gif makes a moving picture instead, with
the rows beside each other.

    python tools/contact_sheet.py "QC3D, linear=demo/limb.blend" --object Arm --from Basis --to "Bend 90" \\
        --straight --output sheet.png
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from qc3d_addon.solver.errors import InputError, QC3DError
from qc3d_addon.solver.files.atomic import replacing, require_writable
from qc3d_addon.solver.files.npz import open_archive, require_file
from qc3d_paper.drawing.shading import VIEWS, Floats, Ints
from qc3d_paper.drawing.sheets import Row, save_animation, save_sheet, straight_blend


def main(argv: list[str] | None = None) -> None:
    """Read the rows and write the picture; SystemExit with one sentence if that is impossible."""
    try:
        _draw(_arguments(argv))
    except QC3DError as error:
        raise SystemExit(f"contact_sheet: {error}") from error


def _arguments(argv: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("rows", nargs="+", metavar="[LABEL=]FILE", help="a baked .blend, or an .npz of frames")
    parser.add_argument("--object", help="in a .blend: the object")
    parser.add_argument("--from", dest="first", help="in a .blend: the first key")
    parser.add_argument("--via", action="append", default=[], help="in a .blend: a key between them; once for each")
    parser.add_argument("--to", dest="last", help="in a .blend: the last key")
    parser.add_argument("--scenery", metavar="NAME", help="in a .blend: a mesh to draw with it, where it stands")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="draw only every so many frames")
    parser.add_argument("--straight", action="store_true", help="add the straight blend of the keys as the first row")
    parser.add_argument("--view", choices=["auto", *VIEWS], default="auto")
    parser.add_argument("--up", choices=["y", "z"], default="z", help="the axis that points up (default: z)")
    parser.add_argument("--height", type=int, default=220, metavar="PIXELS", help="of one row (default: 220)")
    parser.add_argument("--output", type=Path, required=True, metavar="SHEET.png|.gif")
    return parser.parse_args(argv)


def _draw(arguments: argparse.Namespace) -> None:
    if arguments.output.suffix not in (".png", ".gif"):
        raise InputError(f"{arguments.output} is not a picture that can be drawn; give a name ending in .png or .gif.")
    require_writable(arguments.output, inputs=[_path(row) for row in arguments.rows])
    rows = [_read(row, arguments) for row in arguments.rows]
    rows = [row._replace(times=row.times[:: arguments.every], frames=row.frames[:: arguments.every]) for row in rows]
    if arguments.straight:
        rows.insert(0, straight_blend(rows[0]))
    if arguments.scenery is not None:
        scenery = _read_scenery(arguments.scenery)
        rows = [row.with_scenery(*scenery) for row in rows]
    if arguments.up == "y":
        rows = [row._replace(frames=row.frames[..., [0, 2, 1]] * (1.0, -1.0, 1.0)) for row in rows]
    if arguments.output.suffix == ".gif" and len({len(row.times) for row in rows}) > 1:
        raise InputError("The files have different numbers of frames; a moving picture needs equally many.")
    with replacing(arguments.output) as unfinished:
        save = save_animation if arguments.output.suffix == ".gif" else save_sheet
        save(rows, arguments.view, arguments.height, unfinished)


def _path(row: str) -> Path:
    return Path(row.rpartition("=")[2])


def _read(text: str, arguments: argparse.Namespace) -> Row:
    label, path = text.rpartition("=")[0], _path(text)
    if path.suffix == ".blend":
        if None in (arguments.object, arguments.first, arguments.last):
            raise InputError("A .blend needs --object, --from and --to.")
        through = (arguments.first, *arguments.via, arguments.last)
        return _read_blend(label or path.stem, path, arguments.object, through)
    with open_archive(path, "faces, times and frames are needed") as stored:
        faces, times, frames = stored.read(("faces", "times", "frames")).values()
    numbers = all(array.dtype.kind in "fiu" for array in (faces, times, frames))
    fits = faces.ndim == 2 and faces.shape[1:] == (3,) and frames.ndim == 3 and frames.shape[2:] == (3,)
    if not (numbers and fits and len(frames) and times.shape == (len(frames),)):
        raise InputError(f"The arrays in {path} are no frames; name what qc3d interpolate wrote.")
    return Row(label or path.stem, faces.astype(np.int64), times.astype(np.float64), frames.astype(np.float64))


def _read_blend(label: str, path: Path, name: str, through: tuple[str, ...]) -> Row:
    """The row of a chain in a .blend file: the user's own keys and the in-betweens baked between them."""
    import bpy

    from qc3d_addon.blender.keys.chain_shapes import step_shapes
    from qc3d_addon.blender.kinds import mesh_of
    from qc3d_addon.blender.store.mesh_data import triangles
    from qc3d_addon.blender.store.records import Record

    require_file(path)
    try:
        bpy.ops.wm.open_mainfile(filepath=str(path.resolve()), use_scripts=False)
    except RuntimeError as error:
        raise InputError(f"{path} cannot be opened; it must be a .blend file this Blender can read.") from error
    obj = bpy.data.objects.get(name)
    keys = getattr(obj and obj.data, "shape_keys", None)
    chains = [] if keys is None else Record.read(keys).chains
    chain = next((chain for chain in chains if chain.through == through), None)
    if obj is None or chain is None:
        raise InputError(f"{path} has no in-betweens of {' → '.join(through)} on an object {name!r}.")
    frames = step_shapes(obj, chain)
    return Row(label, triangles(mesh_of(obj)).astype(np.int64), np.array(chain.places), frames)


def _read_scenery(name: str) -> tuple[Floats, Ints]:
    """Vertices and triangles of a mesh in the .blend that was opened last, in world coordinates."""
    import bpy

    from qc3d_addon.blender.kinds import mesh_of
    from qc3d_addon.blender.store.mesh_data import triangles

    if name not in bpy.data.objects:
        raise InputError(f"There is no object {name!r}.")
    obj = bpy.data.objects[name]
    points = np.array([obj.matrix_world @ vertex.co for vertex in mesh_of(obj).vertices])
    return points, triangles(mesh_of(obj)).astype(np.int64)


if __name__ == "__main__":
    main()
