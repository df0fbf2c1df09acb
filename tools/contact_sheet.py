# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw in-betweens side by side: first key, in-betweens, second key, one row for each file.

A file is a baked .blend (then --object, --from and --to say what to draw) or the FRAMES.npz of ``qc3d interpolate``.
All rows show the same two keys, through the same camera.

    python tools/contact_sheet.py "QC3D, linear=demo/limb.blend" --object Arm --from Basis --to "Bend 90" \\
        --straight --output sheet.png
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from qc3d_paper.drawing.shading import VIEWS, Floats, Ints
from qc3d_paper.drawing.sheets import Row, save_sheet, straight_blend


def main(argv: list[str] | None = None) -> None:
    """Read the rows and write the picture."""
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
    parser.add_argument("--output", type=Path, required=True, metavar="SHEET.png")
    arguments = parser.parse_args(argv)

    rows = [_read(row, arguments) for row in arguments.rows]
    rows = [row._replace(times=row.times[:: arguments.every], frames=row.frames[:: arguments.every]) for row in rows]
    if arguments.straight:
        rows.insert(0, straight_blend(rows[0]))
    if arguments.scenery is not None:
        scenery = _read_scenery(arguments.scenery)
        rows = [row.with_scenery(*scenery) for row in rows]
    if arguments.up == "y":
        rows = [row._replace(frames=row.frames[..., [0, 2, 1]] * (1.0, -1.0, 1.0)) for row in rows]
    save_sheet(rows, arguments.view, arguments.height, arguments.output)


def _read(text: str, arguments: argparse.Namespace) -> Row:
    label, _, name = text.rpartition("=")
    path = Path(name)
    if path.suffix == ".blend":
        if None in (arguments.object, arguments.first, arguments.last):
            raise SystemExit("A .blend needs --object, --from and --to.")
        through = (arguments.first, *arguments.via, arguments.last)
        return _read_blend(label or path.stem, path, arguments.object, through)
    with np.load(path, allow_pickle=False) as stored:
        return Row(label or path.stem, stored["faces"].astype(np.int64), stored["times"], stored["frames"])


def _read_blend(label: str, path: Path, name: str, through: tuple[str, ...]) -> Row:
    """The user's own keys and the in-betweens that were baked between them."""
    import bpy

    from qc3d_addon.blender.store.mesh_data import key_coordinates, triangles
    from qc3d_addon.blender.store.records import Record

    bpy.ops.wm.open_mainfile(filepath=str(path))
    obj = bpy.data.objects[name]
    chain = Record.read(obj.data.shape_keys).chain(through)
    if chain is None:
        raise SystemExit(f"{path} has no in-betweens of {' → '.join(through)}.")
    stride = chain.intervals // (len(through) - 1)
    keys = chain.keys | {number * stride: key for number, key in enumerate(through)}
    steps = sorted(keys)
    frames = np.stack([key_coordinates(obj, keys[step]) for step in steps]).astype(np.float64)
    return Row(label, triangles(obj.data).astype(np.int64), np.array(steps) / chain.intervals, frames)


def _read_scenery(name: str) -> tuple[Floats, Ints]:
    """Positions and triangles of a mesh in the file that was read last, in the scene's coordinates."""
    import bpy

    from qc3d_addon.blender.store.mesh_data import triangles

    if name not in bpy.data.objects:
        raise SystemExit(f"There is no object {name!r}.")
    obj = bpy.data.objects[name]
    points = np.array([obj.matrix_world @ vertex.co for vertex in obj.data.vertices])
    return points, triangles(obj.data).astype(np.int64)


if __name__ == "__main__":
    main()
