# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Render the README's pictures: the demo figure with its keys blended straight, and the same with QC3D.

    python assets/render_figure.py docs/images [--still]

writes first-sight.webp, which moves, and first-sight.png, the moment half-way, with Blender's Cycles on the processor.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np
from figure_rig import REACH
from PIL import Image, ImageDraw, ImageFont

REPOSITORY = Path(__file__).resolve().parents[1]
DEMO = REPOSITORY / "qc3d_addon" / "demo" / "figure.blend"
OFF_EYES = ("--colliders", "Eyes")
BAKES = (("Arm", "Bend", ()), ("Lids", "Blink.L", OFF_EYES), ("Lids", "Blink.R", OFF_EYES))
LABELS = ("Straight blend of shape keys", "QC3D")
_MOMENTS = 17  # pictures from the first key to the second
_FRAME, _PAUSE = 55, 700  # milliseconds
_LARGEST = 2_000_000  # bytes of the moving picture


def main() -> None:
    """Bake the demo file, render it both ways and save the pictures."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--still", action="store_true", help="only the still picture")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        open_baked(Path(folder))
        both(0.5, 60, 20, folder).save(arguments.folder / "first-sight.png", optimize=True)
        if not arguments.still:
            save_moving(arguments.folder / "first-sight.webp", folder)


def open_baked(folder: Path) -> None:
    """Bake the keys of ``BAKES`` in a copy of the demo file, and open it without its animation."""
    source = DEMO
    for number, (obj, key, options) in enumerate(BAKES):
        target = folder / f"{number}.blend"
        command = [sys.executable, "-m", "qc3d_addon", "bake", str(source), "--object", obj, "--on-key", key, *options]
        subprocess.run([*command, "--output", str(target)], check=True, cwd=REPOSITORY)
        source = target
    bpy.ops.wm.open_mainfile(filepath=str(source))
    rig = bpy.data.objects["Rig"]
    rig.animation_data_clear()
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.use_denoising = True
    scene.cycles.max_bounces = 2


def shot(value: float, straight: bool, percentage: int, samples: int, folder: str) -> np.ndarray:
    """(height, width, 3) uint8: the figure with the keys at one value."""
    rig = bpy.data.objects["Rig"]
    for _, key, _ in BAKES:
        rig.pose.bones[key].location[1] = REACH * value
    for obj, key, _ in BAKES:
        for block in bpy.data.objects[obj].data.shape_keys.key_blocks:
            if block.name.startswith(f"{key}_"):
                block.mute = straight
    scene = bpy.context.scene
    scene.render.resolution_percentage, scene.cycles.samples = percentage, samples
    scene.render.filepath = str(Path(folder, "shot.png"))
    bpy.ops.render.render(write_still=True)
    with Image.open(scene.render.filepath) as picture:
        return np.asarray(picture.convert("RGB"))


def both(value: float, percentage: int, samples: int, folder: str) -> Image.Image:
    """The straight blend beside QC3D, with labels."""
    shots = [shot(value, straight, percentage, samples, folder) for straight in (True, False)]
    halves = Image.fromarray(np.concatenate(shots, axis=1))
    width, height = halves.size
    top = height // 11
    picture = Image.new("RGB", (width, height + top), (244, 244, 242))
    picture.paste(halves, (0, top))
    font = ImageFont.load_default(size=top * 5 // 9)
    draw = ImageDraw.Draw(picture)
    for number, label in enumerate(LABELS):
        draw.text((width * (1 + 2 * number) // 4, top // 2), label, (30, 34, 38), font, anchor="mm")
    draw.line([(width // 2, 0), (width // 2, height + top)], (244, 244, 242), 3)
    return picture


def save_moving(path: Path, folder: str) -> None:
    """From the first key to the second and back, again and again."""
    values = 0.5 - 0.5 * np.cos(np.pi * np.linspace(0.0, 1.0, _MOMENTS))
    pictures = [both(value, 35, 10, folder) for value in values]
    order = [*range(_MOMENTS), *range(_MOMENTS - 2, 0, -1)]
    durations = [_PAUSE if index in (0, _MOMENTS - 1) else _FRAME for index in order]
    frames = [pictures[index] for index in order]
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=durations, loop=0, quality=82, method=6)
    if path.stat().st_size > _LARGEST:
        sys.exit(f"{path} has {path.stat().st_size} bytes, more than {_LARGEST}.")


if __name__ == "__main__":
    main()
