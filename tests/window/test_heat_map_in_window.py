# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The heat map in a window: its button, legend and menu, undo, and the restored view."""

from __future__ import annotations

import time
from pathlib import Path

import matplotlib.image
import numpy as np

from .harness import Window

BUTTON = "qc3d.heat_map"
SHADING = "[view()[1].spaces.active.shading.type, view()[1].spaces.active.shading.color_type]"
SHOWN = "sys.modules[ADDON + '.blender.heat_map.heat_map'].shown(arm())"
FIRST, LAST = (33, 79, 166), (179, 26, 41)  # colors of the ends of the scale of stretch and volume


def colors(window: Window, path: Path) -> set[tuple[int, ...]]:
    """The colors in the lower left corner of the 3D view, as the screen shows them."""
    left, bottom = window.ask("r = region('WINDOW'); [r.x, r.y]")
    window.shoot(path, (left, window.size[1] - bottom - 120, 300, 120))
    pixels = np.round(255 * matplotlib.image.imread(path)[:, :, :3]).astype(int)
    return {tuple(pixel) for pixel in pixels.reshape(-1, 3).tolist()}


def has_legend(window: Window, path: Path) -> bool:
    """Whether the colors of both ends of the scale are there, nearly: the bar runs from one to the other."""
    drawn = np.array(sorted(colors(window, path)))
    return all((np.abs(drawn - end).max(axis=1) <= 10).any() for end in (FIRST, LAST))


def test_the_button_the_menu_and_undo(window: Window, tmp_path: Path) -> None:
    window.ask(
        """
arm().qc3d.quality = 'normal'
view()[1].spaces.active.overlay.show_overlays = True
view()[1].spaces.active.shading.color_type = 'OBJECT'
remember('Draft')
with inside('UI'):
    bpy.ops.qc3d.bake_inbetweens('EXEC_DEFAULT', True)
"""
    )
    before = window.ask(SHADING)
    assert before == ["WIREFRAME", "OBJECT"]
    assert not has_legend(window, tmp_path / "before.png")
    window.push(BUTTON)
    window.wait_for(f"{SHOWN} is not None")
    assert window.ask(SHADING) == ["SOLID", "VERTEX"]
    assert window.ask("arm().data.color_attributes.active_color_name") == "QC3D Heat Map"
    window.wait(lambda: has_legend(window, tmp_path / "shown.png"), "a legend")

    window.click(*window.find(".measure"))
    time.sleep(0.5)
    window.press("v")  # of Volume
    window.wait_for(f"{SHOWN}.measure == 'volume'")
    window.move(window.size[0] // 3, window.size[1] // 2)
    window.press("ctrl+z")  # one step
    window.wait_for(f"{SHOWN} is not None and {SHOWN}.measure == 'stretch' and arm().qc3d.measure == 'stretch'")

    window.push(BUTTON)
    window.wait_for(f"{SHOWN} is None")
    assert window.ask(SHADING) == before
    window.wait(lambda: not has_legend(window, tmp_path / "hidden.png"), "no legend")
    assert window.ask("[name for name in arm().data.attributes.keys() if 'QC3D' in name]") == []
    window.press("ctrl+z")
    window.wait_for(f"{SHOWN} is not None")
    window.press("ctrl+z")
    window.wait_for(f"{SHOWN} is None")
    assert window.ask("len(names())") == 8
