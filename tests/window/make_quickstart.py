# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Follow the page *The first bake* in a real Blender, and take its pictures, and those of two other pages.

    QC3D_BLENDER_ROOT=... python -m tests.window.make_quickstart dist/qc3d-VERSION-linux-x64.zip docs/images
    QC3D_BLENDER_ROOT=... python -m tests.window.make_quickstart docs/images   # only how to install, without a package

The places that are clicked in the preferences are those of Blender 5.2 on a screen of 1280 x 800. If its Python is not
3.11 or 3.13, make the package with ``EXTRA_PYTHON``.
"""

from __future__ import annotations

import os
import shutil
import sys
import time
from pathlib import Path

from PIL import Image

from .harness import Window, missing

SCREEN = (1280, 800)
HOME = "home/animator"
KEY = "Bend"
VIEW_AND_STATUS = (0, 0, 1056, 800)
SETTLE = 1.0  # seconds in which Blender draws what a click changed


def main(package: Path, pictures: Path) -> None:
    """Take the pictures of the package in use."""
    root = os.environ.get("QC3D_BLENDER_ROOT")
    reason = missing(root)
    if reason is not None:
        sys.exit(reason)
    home = Path(root or "") / HOME
    home.mkdir(parents=True)
    try:
        shutil.copy(package, home)
        with Window(Path(root or ""), SCREEN, package=False, home=f"/{HOME}") as window:
            window.press("Escape")
            install(window, pictures, package.name)
            open_demo(window)
            half_way(window, pictures / "before.png")
            window.open_sidebar()
            choose(window, pictures)
            bake(window, pictures)
            play(window, pictures)
            half_way(window, pictures / "after.png")
            beside(pictures)
            heat_map(window, pictures)
    finally:
        shutil.rmtree(home)


def click(window: Window, x: int, y: int) -> None:
    window.click(x, y)
    time.sleep(SETTLE)


def where_to_install(pictures: Path) -> None:
    """Only the picture of the preferences, which needs no package."""
    root = os.environ.get("QC3D_BLENDER_ROOT")
    reason = missing(root)
    if reason is not None:
        sys.exit(reason)
    with Window(Path(root or ""), SCREEN, package=False) as window:
        window.press("Escape")
        open_menu(window, pictures)


def open_menu(window: Window, pictures: Path) -> None:
    """Get Extensions, and the menu with Install from Disk."""
    window.ask("bpy.ops.screen.userpref_show('INVOKE_DEFAULT')")
    window.place_window("Preferences", 200, 60, 900, 640)
    click(window, 257, 255)
    click(window, 1081, 78)
    for height in (194, 200):  # the entry lights up when the mouse moves over it, not when it appears there
        window.move(973, height)
        time.sleep(SETTLE)
    window.shoot(pictures / "quickstart-install.png", (200, 60, 900, 240))


def install(window: Window, pictures: Path, package: str) -> None:
    """Get Extensions, Install from Disk; the file is chosen without Blender's dialog, which opens somewhere."""
    open_menu(window, pictures)
    window.press("Escape")
    where = f"filepath='/{HOME}/{package}', repo='user_default', enable_on_install=True"
    window.ask(f"bpy.ops.extensions.package_install_files({where})")
    window.wait_for("'bl_ext.user_default.qc3d' in bpy.context.preferences.addons")
    time.sleep(SETTLE)
    other = "bpy.context.window_manager.windows[-1]"
    window.ask(f"with bpy.context.temp_override(window={other}): bpy.ops.wm.window_close()")
    window.wait_for("len(bpy.context.window_manager.windows) == 1")
    time.sleep(SETTLE)


def open_demo(window: Window) -> None:
    """Step 1: the sidebar, and the demo, whose arm is selected."""
    window.open_sidebar()
    window.push("qc3d.open_demo")
    window.wait_for("bpy.context.active_object.data.shape_keys is not None")
    window.open_sidebar()  # the file brings its own layout
    time.sleep(SETTLE)


def choose(window: Window, pictures: Path) -> None:
    """Step 1: the keys to start from and to end with."""
    for setting, name in (("qc3d.first", "Basis"), ("qc3d.last", KEY)):
        entry = window.ask(f"bpy.context.active_object.data.shape_keys.key_blocks.find({name!r})")
        x, y = window.find(setting)
        click(window, x, y)
        window.move(x, y + 33 + 20 * entry)
        time.sleep(SETTLE)
        window.shoot(pictures / "quickstart-keys.png", (640, 80, 620, 340))
        click(window, x, y + 33 + 20 * entry)
        window.wait_for(f"bpy.context.active_object.{setting} == {name!r}")


def bake(window: Window, pictures: Path) -> None:
    """Step 2: the button."""
    window.push("qc3d.bake_inbetweens")
    window.move(300, 500)
    window.ask("import sys; jobs = sys.modules['bl_ext.user_default.qc3d.blender.bake.jobs']")
    window.wait_for("jobs.current().fraction > 0.5")
    window.shoot(pictures / "quickstart-bake.png", VIEW_AND_STATUS)
    window.wait_for("jobs.current() is None")
    window.wait_for(f"'{KEY}_50' in bpy.context.active_object.data.shape_keys.key_blocks")
    time.sleep(SETTLE)


def play(window: Window, pictures: Path) -> None:
    """Step 3: the space bar over the 3D view."""
    window.press("space")
    window.wait_for("bpy.context.scene.frame_current >= 39")
    window.press("space")
    window.wait_for("not bpy.context.window_manager.windows[0].screen.is_animation_playing")
    window.ask("bpy.context.scene.frame_set(39)")  # half-way, however fast this machine draws
    time.sleep(SETTLE)
    window.shoot(pictures / "quickstart-play.png", VIEW_AND_STATUS)


def half_way(window: Window, path: Path) -> None:
    """The figure while the bone Bend is half-way up, without the sidebar over it."""
    window.ask("view()[1].spaces.active.show_region_ui = False")
    window.ask("bpy.context.scene.frame_set(38)")
    time.sleep(SETTLE)
    window.shoot(path, (250, 140, 560, 480))


def beside(pictures: Path) -> None:
    """Before and after the bake in one picture."""
    halves = [Image.open(pictures / f"{name}.png").convert("RGB") for name in ("before", "after")]
    width, height = halves[0].size
    both = Image.new("RGB", (2 * width + 4, height), (255, 255, 255))
    for number, half in enumerate(halves):
        both.paste(half, (number * (width + 4), 0))
        (pictures / f"{('before', 'after')[number]}.png").unlink()
    both.save(pictures / "on_the_key.png", optimize=True)


def heat_map(window: Window, pictures: Path) -> None:
    """The heat map of the bake, with its legend."""
    window.open_sidebar()
    window.push("qc3d.heat_map")
    window.move(300, 650)
    window.wait_for("jobs.current() is None and len(bpy.context.active_object.data.color_attributes) > 0")
    time.sleep(SETTLE)
    window.shoot(pictures / "heat_map.png", VIEW_AND_STATUS)


if __name__ == "__main__":
    given = [Path(word) for word in sys.argv[1:]]
    main(*given) if len(given) == 2 else where_to_install(*given)
