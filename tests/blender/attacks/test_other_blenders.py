# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Baked files of Blender 4.5 and 5.2, each opened in both: everything plays and can be edited.

``make_baked_files.py`` made them.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import pytest

from qc3d_addon.blender import compat, live_scrub
from qc3d_addon.blender.heat_map import heat_map
from qc3d_addon.blender.keys import chain_keys, chain_shapes
from qc3d_addon.blender.store import kept_measures
from qc3d_addon.blender.store.chain import Chain
from qc3d_addon.blender.store.records import Record
from qc3d_addon.solver.settings import FitOptions

from ..test_panel_results import drawn

Shown = Callable[..., np.ndarray]
ReadShapes = Callable[[bpy.types.Object], dict[str, np.ndarray]]
FILES = sorted(Path(__file__).with_name("files").glob("*.blend"))
# What plays them in files of this version, and in those from before weights were smooth.
CONTROLS = ("Basis_to_Lean.L", "Lean.L_to_Basis_to_Long", "Basis_to_Lean.R", "Long")
EARLIER = ("Basis→Lean.L", "Lean.L→Basis→Long", "Basis→Lean.R")


@pytest.fixture(params=FILES, ids=[path.stem for path in FILES])
def baked(request: pytest.FixtureRequest, quick_map: list[FitOptions]) -> bpy.types.Object:
    assert bpy.ops.wm.open_mainfile(filepath=str(request.param)) == {'FINISHED'}
    obj = bpy.data.objects["Figure"]
    bpy.context.view_layer.objects.active = obj
    return obj


def test_there_is_a_file_of_each() -> None:
    assert [path.stem for path in FILES] == ["baked_4.5", "baked_5.2", "earlier_4.5", "earlier_5.2"]


def sliders(obj: bpy.types.Object) -> tuple[str, ...]:
    """The names of what plays the in-betweens of an object."""
    return EARLIER if EARLIER[0] in obj else CONTROLS


def expected(obj: bpy.types.Object, chain: Chain, place: float) -> np.ndarray:
    """What the weights of a chain show of its steps."""
    return chain.weights.played(chain_shapes.step_shapes(obj, chain), [place])[0]


def test_it_plays(baked: bpy.types.Object, shapes: ReadShapes, shown: Shown) -> None:
    assert all(curve.driver.is_valid for curve in baked.data.shape_keys.animation_data.drivers)
    baked.animation_data_clear()  # the slider is set by hand below
    names = sliders(baked)
    start = 0.5  # where the second one shows the Basis
    baked[names[1]] = start
    for chain in Record.read(baked.data.shape_keys).chains:
        control = chain_keys.control_of(baked, chain)
        for place in (0.0, 0.3, 0.5, 1.0):
            assert control.put(place) is None
            np.testing.assert_allclose(shown(baked), expected(baked, chain, place), atol=1e-5)
        control.put(start if chain.slider == names[1] else 0.0)
    copy = bpy.data.objects["Figure absolute"]
    np.testing.assert_allclose(shown(baked, **{names[0]: 0.6}), shown(copy), atol=1e-4)


def test_its_keyframes_play(baked: bpy.types.Object) -> None:
    for frame, place in ((1, 0.0), (13, 0.5), (25, 1.0)):
        bpy.context.scene.frame_set(frame)
        assert baked[sliders(baked)[0]] == pytest.approx(place, abs=1e-6)
    assert compat.find_fcurve(baked, f'["{sliders(baked)[0]}"]') is not None


def test_its_record_its_measures_and_its_heat_map_are_there(baked: bpy.types.Object) -> None:
    record = Record.read(baked.data.shape_keys)
    names = sliders(baked)
    assert tuple(chain.slider for chain in record.chains) == names
    assert all(chain.result is not None for chain in record.chains)
    assert all(chain.keys for chain in record.chains)
    for slider in names:
        assert kept_measures.read(baked.data.shape_keys, slider, len(baked.data.vertices)) is not None
    state = heat_map.shown(baked)
    assert state is not None
    assert (state.slider, state.measure) == (names[0], "stretch")
    panel = drawn(baked)
    assert panel.lists
    assert any("in-betweens" in text for text in panel.texts)  # the details of the chosen one
    assert not [text for text in drawn(baked).texts if "stopped" in text or "deleted" in text]


def test_baked_again_everything_stays_and_no_map_is_made(
    baked: bpy.types.Object, shapes: ReadShapes, quick_map: list[FitOptions]
) -> None:
    before = shapes(baked)
    for slider in sliders(baked)[:2]:
        assert bpy.ops.qc3d.rebake(slider=slider) == {"FINISHED"}
    if sliders(baked) == CONTROLS:
        assert quick_map == []  # where the format of stored maps is another one, make the files again
    after = shapes(baked)
    assert list(after) == list(before)
    for name, shape in after.items():
        np.testing.assert_allclose(shape, before[name], atol=1e-5)


def test_everything_can_be_done_with_it(baked: bpy.types.Object, tmp_path: Path) -> None:
    choices: dict[str, dict[str, Any]] = {
        "export_alembic": {"filepath": str(tmp_path / "a.abc"), "frames": 2},
        "save_map": {"filepath": str(tmp_path / "a.qc3dmap")},
        "to_keyframes": {"frame_start": 1, "frame_end": 5},
        "heat_map": {"measure": "volume"},
    }
    names = sliders(baked)
    assert bpy.ops.qc3d.rebake(slider=names[0]) == {"FINISHED"}  # its map may be of another version
    operators = ("mirror", "heat_map", "select_worst", "absolute_keys", "export_alembic", "save_map", "live_scrub")
    for name in operators:
        operator = getattr(bpy.ops.qc3d, name)
        assert operator(slider=names[0], **choices.get(name, {})) == {"FINISHED"}, name
    live_scrub.end()
    assert bpy.ops.qc3d.load_map(filepath=str(tmp_path / "a.qc3dmap")) == {"FINISHED"}
    assert bpy.ops.qc3d.to_keyframes(slider=names[2], **choices["to_keyframes"]) == {"FINISHED"}
    assert bpy.ops.qc3d.heat_map(show="off") == {"FINISHED"}
    for copy in [obj for obj in bpy.data.objects if obj != baked]:
        bpy.data.objects.remove(copy)  # its driver reads a slider
    for slider in (*names[:2], *names[3:]):
        assert bpy.ops.qc3d.remove(slider=slider) == {"FINISHED"}
    assert [name for name in baked.keys() if name in names] == []  # noqa: SIM118 - not a dictionary
    assert list(baked.data.shape_keys.keys()) == []
    left = baked.data.shape_keys.key_blocks.keys()
    assert left[:3] == ["Basis", "Lean.L", "Long"]
    assert len(left) == 7
    assert all(name.startswith(names[2]) for name in left[3:])


def test_saved_again_it_is_whole(baked: bpy.types.Object, tmp_path: Path) -> None:
    """As when a file goes back and forth between two versions of Blender."""
    keys = baked.data.shape_keys
    record = Record.read(keys)
    stored = {name: bytes(value) for name, value in keys.items() if isinstance(value, bytes)}
    assert len(stored) == (6 if sliders(baked) == EARLIER else 11)  # three maps; of each chain measures, and shapes now
    path = str(tmp_path / "again.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    bpy.ops.wm.open_mainfile(filepath=path)
    keys = bpy.data.objects["Figure"].data.shape_keys
    assert Record.read(keys) == record
    assert {name: bytes(value) for name, value in keys.items() if isinstance(value, bytes)} == stored
