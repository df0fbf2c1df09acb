# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Live scrub with its button and the mouse on the slider: how often it draws, and that it survives undo."""

from __future__ import annotations

import time

import pytest

from .harness import PATIENCE, Window, redraws

BUTTON = "qc3d.live_scrub"
SLIDER = "Basis_to_Bend and twist"
OWN = ["Basis", "Bend 90", "Twist 120", "Bend and twist"]
MADE = [f"{SLIDER}_{25 * step}" for step in (1, 2, 3, 4)]
PREVIEW = "QC3D Preview"
VERTICES = 6890


@pytest.fixture
def baked(window: Window) -> Window:
    window.ask(
        """
def shown():
    mesh = arm().evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    values = np.empty(3 * len(mesh.vertices), dtype=np.float32)
    mesh.vertices.foreach_get('co', values)
    return values

def offset():
    '''How far the preview is from the straight blend of the baked keys.'''
    return float(abs(points('QC3D Preview') - points('Basis')).max()) if 'QC3D Preview' in names() else 0.0

bpy.context.preferences.inputs.use_mouse_continuous = False  # a mouse that is put somewhere by a program
arm().qc3d.quality = 'normal'
remember('Draft')
"""
    )
    window.ask("with inside('UI'): bpy.ops.qc3d.bake_inbetweens('EXEC_DEFAULT', True)")
    assert window.ask("names()") == OWN + MADE
    return window


def switch(window: Window) -> None:
    window.ask("with inside('UI'): bpy.ops.qc3d.live_scrub('EXEC_DEFAULT', True)")


def drag_slider(window: Window, right: int = 23) -> float:
    """Drag the slider with the mouse; where it is then."""
    x, y = window.find(f'["{SLIDER}"]')
    before = window.ask(f"arm()[{SLIDER!r}]")
    window.drag((x, y), (x + right, y))
    return window.wait(
        lambda: (place := window.ask(f"arm()[{SLIDER!r}]")) != before and place, "the slider has moved"
    )


def test_the_button_and_the_mouse_on_the_slider(baked: Window) -> None:
    active = baked.ask("arm().active_shape_key.name")
    baked.push(BUTTON)
    baked.wait_for(f"job() is None and names() == {[*OWN, *MADE, PREVIEW]}")
    assert baked.ask("arm().active_shape_key.name") == active
    for _ in range(2):
        drag_slider(baked)
        assert baked.ask("offset()") > 1e-3
    baked.push(BUTTON)
    baked.wait_for(f"names() == {OWN + MADE}")


def test_undo_takes_back_the_drag_and_leaves_the_preview(baked: Window) -> None:
    switch(baked)
    first = drag_slider(baked)
    second = drag_slider(baked)
    assert first != second
    offset = baked.ask("offset()")
    baked.press("ctrl+z")  # one step for each drag
    baked.wait_for(f"arm()[{SLIDER!r}] == {first!r}")
    assert baked.ask("names()") == [*OWN, *MADE, PREVIEW]
    baked.press("ctrl+shift+z")
    baked.wait_for(f"arm()[{SLIDER!r}] == {second!r}")
    baked.wait_for(f"abs(offset() - {offset}) < 1e-6")

    for _ in range(2):
        baked.press("ctrl+z")
    baked.press("ctrl+z")  # the bake
    baked.wait_for(f"names() == {OWN}")
    baked.press("ctrl+shift+z")
    baked.wait_for(f"names() == {OWN + MADE}")


def test_what_was_done_with_the_preview_on_is_undone_without_it(baked: Window) -> None:
    switch(baked)
    place = drag_slider(baked)
    drag_slider(baked)
    switch(baked)
    assert baked.ask("names()") == OWN + MADE
    baked.press("ctrl+z")
    baked.wait_for(f"arm()[{SLIDER!r}] == {place!r}")
    assert baked.ask("names()") == OWN + MADE


@pytest.mark.parametrize("save", [False, True], ids=["", "saved"])
def test_edit_mode_and_undo_in_it(baked: Window, save: bool) -> None:
    switch(baked)
    drag_slider(baked)
    baked.ask("with inside('WINDOW'): bpy.ops.object.mode_set('EXEC_DEFAULT', True, mode='EDIT')")
    baked.ask("with inside('WINDOW'): bpy.ops.mesh.select_all('EXEC_DEFAULT', True, action='SELECT')")
    baked.ask("with inside('WINDOW'): bpy.ops.transform.translate('EXEC_DEFAULT', True, value=(0, 0, 1))")
    if save:
        baked.ask(f"bpy.ops.wm.save_as_mainfile(filepath={str(baked.inside / 'saved.blend')!r}, copy=True)")
        baked.wait_for(f"names() == {OWN + MADE}")
    for keys in ("ctrl+z", "ctrl+z", "ctrl+shift+z", "ctrl+z"):
        steps = baked.ask("undone = []; bpy.app.handlers.undo_post.append(lambda *_: undone.append(1)); len(undone)")
        baked.press(keys)
        baked.wait_for(f"len(undone) > {steps} or {'shift' in keys}")
        time.sleep(0.3)
    baked.ask("with inside('WINDOW'): bpy.ops.object.mode_set('EXEC_DEFAULT', True, mode='OBJECT')")
    baked.ask("arm().update_tag()")
    baked.wait_for(f"names() == {OWN + MADE}")
    baked.press("ctrl+z")
    time.sleep(0.5)
    baked.ask("with inside('WINDOW'): bpy.ops.object.mode_set('EXEC_DEFAULT', True, mode='OBJECT')")
    baked.ask("arm().update_tag()")
    baked.wait_for(f"names() == {OWN + MADE}")


def lean_ball(window: Window, segments: int, rings: int, count: int) -> None:
    """A ball that leans, baked with so many in-betweens, and what moves its slider and notes what is drawn."""
    window.ask(
        f"""
bpy.ops.mesh.primitive_uv_sphere_add(segments={segments}, ring_count={rings})
ball = bpy.context.active_object
assert len(ball.data.vertices) == {segments * (rings - 1) + 2}
ball.shape_key_add(name='Basis')
lean = ball.shape_key_add(name='Lean', from_mix=False)
lean.value = 0.0
rest = np.empty(3 * len(lean.points), dtype=np.float32)
lean.points.foreach_get('co', rest)
rest = rest.reshape(-1, 3)
lean.points.foreach_set('co', (rest + np.maximum(rest[:, 2:], 0) ** 2 * np.float32([0.8, 0.1, -0.1])).ravel())
arm().hide_set(True)
view()[1].spaces.active.shading.type = 'SOLID'
with inside('WINDOW'):
    bpy.ops.qc3d.bake_inbetweens(play_on='slider', from_key='Basis', to_key='Lean', count={count})

class Drag:
    '''Moves the slider a little between redraws, and notes where it is and what is shown at each.'''
    def __init__(self):
        self.moves, self.seen = 0, []
        self.draw = bpy.types.SpaceView3D.draw_handler_add(self.note, (), 'WINDOW', 'POST_PIXEL')
        bpy.app.timers.register(self.move)
    def move(self):
        if self.draw is None:
            return None
        self.moves += 1
        ball['Basis_to_Lean'] = self.moves % 100 / 100
        ball.update_tag()
        return 0.001
    def note(self):
        mesh = ball.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        self.seen.append((ball['Basis_to_Lean'], mesh.vertices[self.watched].co.x))
    def stop(self):
        bpy.types.SpaceView3D.draw_handler_remove(self.draw, 'WINDOW')
        self.draw = None
        return self.seen

Drag.watched = int(np.argmax(rest[:, 2] - abs(rest[:, 1]) + 0.5 * rest[:, 0]))
"""
    )


def test_every_redraw_shows_where_the_slider_is(window: Window) -> None:
    lean_ball(window, 84, 83, 3)
    rates: dict[bool, list[float]] = {False: [], True: []}
    for is_on in (False, True, False, True):
        window.ask("drag = Drag()")
        with redraws(window) as gaps:
            time.sleep(3.0)
        seen = window.ask("drag.stop()")
        rates[is_on].append(len(gaps) / sum(gaps))
        window.ask("with inside('WINDOW'): bpy.ops.qc3d.live_scrub()")
    without, with_it = (", ".join(f"{rate:.0f}" for rate in rates[is_on]) for is_on in (False, True))
    print(f"{VERTICES} vertices, slider moving, redraws a second: {without} without the preview, {with_it} with it")

    window.ask(
        """
with inside('WINDOW'):
    bpy.ops.qc3d.bake_inbetweens(play_on='slider', from_key='Basis', to_key='Lean', count=99)
keys = ball.data.shape_keys.key_blocks
"""
    )
    dense = window.ask("[0.0] + [keys[f'Basis_to_Lean_{step:02}'].points[Drag.watched].co.x for step in range(1, 100)]")
    dense[0] = window.ask("keys['Basis'].points[Drag.watched].co.x")
    assert len(seen) > 3
    for place, shown in seen:
        assert abs(shown - dense[round(100 * place)]) < 1e-4


def test_a_hundred_thousand_vertices_are_evaluated_often_enough(window: Window) -> None:
    lean_ball(window, 317, 317, 1)
    timed = """
def step(number):
    ball['Basis_to_Lean'] = number % 40 / 40
    ball.update_tag()
    bpy.context.view_layer.update()
    mesh = ball.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    mesh.corner_normals[0].vector.copy()
    return mesh.vertices[Drag.watched].co.x

def timed(steps):
    import time
    before = time.perf_counter(), time.process_time()
    places = [step(number) for number in range(steps)]
    return (time.perf_counter() - before[0]) / steps, (time.process_time() - before[1]) / steps, len(set(places))
"""
    window.ask(timed)
    found: dict[bool, tuple[float, float, int]] = {}
    for is_on in (False, True):
        window.ask("step(0)")
        found[is_on] = window.ask("timed(40)")
        window.ask("drag = Drag()")
        with redraws(window) as gaps:
            time.sleep(3.0)
        assert len(window.ask("drag.stop()")) > 0
        clock, processor, places = found[is_on]
        print(
            f"100174 vertices, {'with' if is_on else 'without'} the preview: {1e3 * clock:.0f} ms a step on the clock, "
            f"{1e3 * processor:.0f} ms of the processors; {len(gaps) / sum(gaps):.1f} redraws a second"
        )
        assert places > 35
        window.ask("with inside('WINDOW'): bpy.ops.qc3d.live_scrub()", 10.0 * PATIENCE)
