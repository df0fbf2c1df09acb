# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Undo and redo of all operators, and undo during a bake: each is a single step, and nothing is half undone."""

from __future__ import annotations

from typing import Any

import pytest

from .harness import Window, paused
from .test_interruptions import CHANGED, start

SLIDER = "Basis_to_Lean"

# A ball that is symmetric, and everything in the file that an operator may change.
BALL = """
bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=6)
ball = bpy.context.active_object
ball.name = ball.data.name = 'Ball'
for name, lean in (('Basis', 0.0), ('Lean', 0.4), ('Tilt', -0.3)):
    key = ball.shape_key_add(name=name, from_mix=False)
    key.value = 0.0
    for point in key.points:
        point.co.x += lean * max(point.co.z, 0.0) ** 2
ball.qc3d.play_on = 'slider'
ball.qc3d.from_key, ball.qc3d.to_key, ball.qc3d.count = 'Basis', 'Lean', 2

def points_of(key):
    values = np.empty(3 * len(key.points), dtype=np.float32)
    key.points.foreach_get('co', values)
    return hashlib.sha256(values.tobytes()).hexdigest()

def everything():
    found = {'objects': [], 'keys': []}
    for obj in bpy.data.objects:
        action = obj.animation_data and obj.animation_data.action
        found['objects'].append([
            obj.name, [name for name in obj.keys() if name != 'qc3d'], [m.name for m in obj.modifiers],
            action and action.name, obj.active_shape_key_index, obj.mode,
        ])
    for keys in bpy.data.shape_keys:
        animation = keys.animation_data
        drivers = [[c.data_path, c.driver.expression] for c in animation.drivers] if animation else []
        stored = [[name, str(value)] for name, value in keys.items()]
        blocks = [[key.name, key.value, points_of(key)] for key in keys.key_blocks]
        found['keys'].append([blocks, drivers, stored, bool(animation and animation.action)])
    found['attributes'] = [a.name for a in bpy.data.objects['Ball'].data.attributes if 'QC3D' in a.name]
    found['nodes'] = len(bpy.data.node_groups)
    found['slider'] = bpy.data.objects['Ball'].get('Basis_to_Lean')
    return found

remember('Ball')
"""


@pytest.fixture
def ball(window: Window) -> Window:
    window.ask(BALL)
    run(window, "bake_inbetweens", use_keyframes=True)
    return window


def run(window: Window, name: str, **choices: object) -> None:
    """Call an operator as its button does, with a step to undo."""
    given = "".join(f", {key}={value!r}" for key, value in choices.items())
    window.ask(f"with inside('UI'): bpy.ops.qc3d.{name}('EXEC_DEFAULT', True{given})")


def names_and_values(everything: dict[str, Any]) -> list[Any]:
    return [[[name, value] for name, value, _ in keys[0]] for keys in everything["keys"]]


def undo(window: Window, expected: dict[str, Any]) -> None:
    window.move(window.size[0] // 3, window.size[1] // 2)
    window.press("ctrl+z")
    window.wait(lambda: window.ask("everything()") == expected, "what was before")


def redo(window: Window, expected: dict[str, Any]) -> None:
    window.press("ctrl+shift+z")
    window.wait(lambda: window.ask("everything()") == expected, "what was after")


@pytest.mark.parametrize(
    ("name", "choices"),
    [
        ("rebake", {}),
        ("bake_inbetweens", {"count": 5}),
        ("bake_inbetweens", {"to_key": "Tilt", "from_key": "Basis", "use_keyframes": True}),
        ("prepare", {"to_key": "Tilt", "from_key": "Basis"}),
        ("mirror", {}),
        ("absolute_keys", {}),
        ("to_keyframes", {"frame_start": 1, "frame_end": 5}),
        ("heat_map", {"measure": "volume"}),
        ("select_worst", {}),
        ("remove", {}),
    ],
    ids=lambda value: value if isinstance(value, str) else "-".join(map(str, value.values())),
)
def test_an_operator_is_one_step(ball: Window, name: str, choices: dict[str, object]) -> None:
    if name == "rebake":
        sculpt = "bpy.data.objects['Ball'].data.shape_keys.key_blocks['Lean'].points[0].co.x += 0.5"
        ball.ask(f"{sculpt}\nremember('Sculpted')")
    before = ball.ask("everything()")
    run(ball, name, **choices)
    after = ball.ask("everything()")
    assert after != before
    undo(ball, before)
    redo(ball, after)
    undo(ball, before)
    # It works as it did the first time.
    run(ball, name, **choices)
    again = ball.ask("everything()")
    assert names_and_values(again) == names_and_values(after)
    assert again["objects"] == after["objects"]


def test_a_record_that_was_forgotten_comes_back(ball: Window) -> None:
    ball.ask("bpy.data.objects['Ball'].data.shape_keys['qc3d'] = 7; remember('Damaged')")
    before = ball.ask("everything()")
    run(ball, "forget_record")
    after = ball.ask("everything()")
    assert after["keys"][-1][2] == []
    undo(ball, before)
    redo(ball, after)


def test_several_steps_back_and_forth(ball: Window) -> None:
    states = [ball.ask("everything()")]
    for name in ("heat_map", "mirror", "absolute_keys", "select_worst", "remove"):
        run(ball, name, slider=SLIDER)
        states.append(ball.ask("everything()"))
    for state in reversed(states[:-1]):
        undo(ball, state)
    for state in states[1:]:
        redo(ball, state)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        # What is undone was there when the bake was begun.
        ("sculpt('Bend and twist')", CHANGED),
        ("arm().data.shape_keys.key_blocks['Bend and twist'].name = 'Up'; arm().qc3d.to_key = 'Up'", CHANGED),
        (
            "arm().shape_key_add(name='New', from_mix=False).points[0].co.x += 1.0; arm().qc3d.to_key = 'New'",
            "There is no shape key 'New'",
        ),
        (
            "arm().data = arm().data.copy(); arm().data.shape_keys.key_blocks['Bend and twist'].points[3].co.x += 1.0",
            CHANGED,
        ),
    ],
    ids=["sculpted", "renamed", "added", "made its own"],
)
def test_what_the_bake_was_begun_with_is_undone(window: Window, change: str, sentence: str) -> None:
    before = window.ask("state()")
    window.ask(f"{change}\nremember('Changed')")
    with paused(start(window)):
        window.move(window.size[0] // 3, window.size[1] // 2)
        window.press("ctrl+z")
        window.wait(lambda: window.ask("state()") == before, "the undo")
    window.wait_for("job() is None")
    window.wait_for(f"{sentence!r} in reports()")
    assert window.ask("state()") == before


def test_the_object_is_undone(window: Window) -> None:
    """Its copy was made, and is baked; then its making is undone."""
    window.ask(
        "copy = arm().copy(); copy.data = arm().data.copy(); copy.name = 'Copy'\n"
        "bpy.context.scene.collection.objects.link(copy); bpy.context.view_layer.objects.active = copy\n"
        "copy.qc3d.quality = 'normal'; remember('Copied')"
    )
    window.push("qc3d.bake_inbetweens")
    with paused(window.wait_for("child()")):
        window.move(window.size[0] // 3, window.size[1] // 2)
        window.press("ctrl+z")
        window.wait_for("'Copy' not in bpy.data.objects")
    window.wait_for("job() is None")
    window.wait_for("\"'Copy' was deleted meanwhile; nothing was written.\" in reports()")


def test_an_earlier_bake_is_undone_while_the_next_one_works(window: Window) -> None:
    """The next one does not need it: it writes all of its own, into what is there then."""
    before = window.ask("names()")
    window.ask("with inside('UI'): bpy.ops.qc3d.bake_inbetweens('EXEC_DEFAULT', True)")
    window.ask("arm().qc3d.to_key = 'Bend 90'; remember('Chosen')")
    with paused(start(window)):
        window.move(window.size[0] // 3, window.size[1] // 2)
        window.press("ctrl+z", "ctrl+z")
        window.wait_for(f"names() == {before}")
    window.wait_for("job() is None")
    made = [f"Basis_to_Bend 90_{25 * step}" for step in (1, 2, 3, 4)]
    window.wait_for(f"names() == {before + made}")
    chains = "json.loads(arm().data.shape_keys['qc3d'])['chains']"
    assert window.ask(f"import json\n[chain['slider'] for chain in {chains}]") == ["Basis_to_Bend 90"]
    window.press("ctrl+z")
    window.wait_for(f"names() == {before}")


def test_undo_brings_back_another_number_of_steps_under_live_scrub(ball: Window) -> None:
    """The preview adds what the steps that are there then lack."""
    ball.ask(
        """
def shown():
    ball = bpy.data.objects['Ball']
    mesh = ball.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    values = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get('co', values)
    return values
"""
    )
    ball.ask(f"bpy.data.objects['Ball'].animation_data_clear(); bpy.data.objects['Ball'][{SLIDER!r}] = 0.3")
    ball.ask("bpy.data.objects['Ball'].update_tag(); remember('Moved')")
    steps = ball.ask("len(bpy.data.objects['Ball'].data.shape_keys.key_blocks)")
    run(ball, "bake_inbetweens", count=6)
    run(ball, "live_scrub")
    ball.ask("there = shown()")
    ball.move(ball.size[0] // 3, ball.size[1] // 2)
    ball.press("ctrl+z")
    ball.wait_for(f"len(bpy.data.objects['Ball'].data.shape_keys.key_blocks) == {steps + 1}")
    ball.wait_for("float(abs(shown() - there).max()) < 1e-3")
