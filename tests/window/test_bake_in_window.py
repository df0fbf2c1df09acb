# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A bake started from the panel's button: watched, canceled, finished, undone, redone and repeated."""

from __future__ import annotations

import time
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from .harness import Window, is_alive, paused, redraws

BAKE, CANCEL, REBAKE = "qc3d.bake_inbetweens", "qc3d.cancel", "qc3d.rebake"
OWN = ["Basis", "Bend 90", "Twist 120", "Bend and twist"]
MADE = [f"Basis_to_Bend and twist_{25 * step}" for step in (1, 2, 3, 4)]
BAR = np.array([71, 114, 179])  # the color of Blender's progress bars


def start(window: Window) -> int:
    """Press the button; the process that does the work."""
    window.push(BAKE)
    return window.wait_for("child()")


def bar_width(window: Window, path: Path) -> int:
    """How many pixels of the progress bar, which is just above the button Cancel, are filled."""
    _, y = window.find(CANCEL)
    window.shoot(path)
    rows = np.round(255 * matplotlib.image.imread(path)[y - 35 : y - 5, :, :3])
    return int((np.abs(rows - BAR).max(axis=2) < 4).sum(axis=1).max())


def test_the_bar_grows_and_the_window_is_drawn_all_the_while(window: Window, tmp_path: Path) -> None:
    with redraws(window) as idle:
        time.sleep(3.0)
    with redraws(window) as busy:
        child = start(window)
        began = window.ask("len(counter.times)")
        window.wait_for("job() is None")
        ended = window.ask("len(counter.times)")
    assert is_alive(child)  # it waits for the next bake
    rates = [len(gaps) / sum(gaps) for gaps in (idle, busy[began:ended])]
    print(f"redraws a second: {rates[0]:.0f} without a bake, {rates[1]:.0f} during one; longest {max(busy):.2f} s")
    # What a computer draws in a second is its own affair; drawing must not wait for the bake.
    assert rates[1] > 0.2 * rates[0]

    # So slow that the bar can be looked at twice.
    window.ask("arm().qc3d.quality, arm().qc3d.count = 'finest', 400")
    assert start(window) == child
    widths = []
    for fraction in (0.2, 0.6):
        window.wait_for(f"job().fraction > {fraction}")
        with paused(child):
            widths.append(bar_width(window, tmp_path / f"{fraction}.png"))
    assert 0 < widths[0] < widths[1]
    window.press("Escape")
    window.wait_for("job() is None")
    window.wait_gone(child)
    window.ask(f"arm().qc3d.quality, arm().qc3d.count = 'normal', {len(MADE)}")


def test_the_button_cannot_be_pressed_before_the_keys_are_chosen(window: Window) -> None:
    window.ask("arm().qc3d.to_key, arm().active_shape_key_index = '', 0; remember('No key')")
    window.push(BAKE)
    time.sleep(1.0)  # nothing is to happen, for which there is no sign
    assert window.ask("job()") is None
    assert "Choose the second key" not in window.ask("reports()")  # an error, where it could be pressed
    window.ask(f"arm().qc3d.to_key = {OWN[3]!r}")
    start(window)
    window.press("Escape")
    window.wait_for("job() is None")


@pytest.mark.parametrize("button", [False, True], ids=["Escape", "button"])
def test_a_cancelled_bake_changes_nothing(window: Window, button: bool) -> None:
    before = window.ask("state()")
    child = start(window)
    if button:
        with paused(child):
            window.move(*window.find(CANCEL))
    began = time.monotonic()
    if button:
        window.press_mouse()
    else:
        window.press("Escape")
    window.wait_gone(child)
    print(f"the child process was gone after {time.monotonic() - began:.2f} s")
    window.wait_for("'Bake In-Betweens was canceled; nothing was changed.' in reports()")
    assert window.ask("state()") == before
    assert window.ask("child()") is None
    assert list(window.folder.glob("qc3d-*")) == []


def test_a_bake_is_one_step_to_undo_and_can_be_made_again(window: Window) -> None:
    window.ask("arm().qc3d.quality = 'normal'; remember('Draft')")
    before = window.ask("state()")
    start(window)
    window.wait_for("job() is None")
    baked = window.ask("state()")
    assert baked[0] == OWN + MADE
    window.press("ctrl+z")
    window.wait_for(f"names() == {OWN}")
    assert window.ask("state()") == before
    window.press("ctrl+shift+z")
    window.wait_for(f"names() == {OWN + MADE}")
    assert window.ask("state()") == baked

    window.ask("sculpt('Bend and twist'); remember('Sculpted')")
    sculpted = window.ask("state()")
    window.push(REBAKE)
    window.wait_for("child()")
    window.wait_for("job() is None")
    again = window.ask("state()")
    assert again[:2] == sculpted[:2]
    assert again[3:] == sculpted[3:]
    assert again[2] != sculpted[2]
    assert window.ask("points('Bend and twist').tolist() == points('Basis_to_Bend and twist_100').tolist()")
    window.press("ctrl+z")
    window.wait_for(f"state() == {sculpted}")
