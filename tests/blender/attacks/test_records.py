# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Hostile records in a .blend file: refused in one sentence without any change, or harmless."""

from __future__ import annotations

import json
import random
import re
from collections.abc import Callable, Iterator
from typing import Any

import bpy
import pytest

from qc3d_addon.blender.operators.forget_record import QC3D_OT_forget_record
from qc3d_addon.blender.store import names, records
from qc3d_addon.blender.store.records import PROPERTY, VERSION, Record
from qc3d_addon.blender.ui.panel_results import QC3D_PT_results
from qc3d_addon.solver.errors import InputError

from ..test_panel_results import Context, drawn

pytestmark = pytest.mark.usefixtures("quick_map")

State = Callable[[], dict[str, Any]]
SLIDER = "Basis_to_Lean"
OPERATORS = (
    "rebake",
    "live_scrub",
    "select_worst",
    "heat_map",
    "mirror",
    "to_keyframes",
    "absolute_keys",
    "export_alembic",
    "save_map",
    "remove",
)
# In place of each value of a record; as texts, since JSON can say what Python's own values cannot.
VALUES = [
    "null",
    "true",
    "-1",
    "0",
    "1",
    "2.5",
    "1000000000",
    "1" + "0" * 400,
    "1" + "0" * 5000,
    "1e308",
    "1e999",
    "NaN",
    "-Infinity",
    '""',
    '"1"',
    '"' + "x" * 300 + '"',
    '"' + "x" * 100_000 + '"',
    '"a\\u0000b"',
    '"\\ud800"',
    "[]",
    "{}",
    "[[1]]",
    '{"a": 1}',
    "[" * 400 + "]" * 400,
    "[" * 100_000 + "]" * 100_000,
]


@pytest.fixture
def baked(figure: bpy.types.Object) -> bpy.types.Object:
    choices = {"mode": "linear", "use_keyframes": True, "count": 2}
    assert bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean", **choices) == {"FINISHED"}
    return figure


def stored(obj: bpy.types.Object) -> dict[str, Any]:
    return json.loads(obj.data.shape_keys[PROPERTY])


def places(values: object, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The path of every value inside of JSON values, the outermost first."""
    yield path
    if isinstance(values, (dict, list)):
        for key, value in values.items() if isinstance(values, dict) else enumerate(values):
            yield from places(value, (*path, key))


def replaced(values: Any, path: tuple[Any, ...], text: str) -> str:  # noqa: ANN401 - whatever JSON holds
    """The values as JSON, with another text where the path leads."""
    mark = "@@ here @@"
    if not path:
        return text
    copy = json.loads(json.dumps(values))
    inner = copy
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = mark
    return json.dumps(copy).replace(json.dumps(mark), text)


def expect_sound(record: Record) -> None:
    """Whatever was read has the types and ranges that everything else counts on."""
    assert len({chain.slider for chain in record.chains}) == len(record.chains)
    for chain in record.chains:
        assert 1 <= chain.intervals <= names.MAX_STEPS
        assert all(type(step) is int and 0 <= step <= chain.intervals for step in chain.keys)
        for name in (chain.slider, *chain.keys.values(), *chain.through):
            assert 1 <= len(name.encode()) <= 2 * names.LIMIT
            assert "\0" not in name
        if chain.keyframes is not None:
            assert list(chain.keyframes) == sorted(set(chain.keyframes))
        if chain.result is not None:
            assert chain.result.seconds < float("inf")
            assert chain.result.worst is None or 0.0 <= chain.result.worst.at <= 1.0


def try_everything(obj: bpy.types.Object, state: State, folder: str) -> dict[str, str]:
    """What the panel and every operator make of a record: done, or one sentence with nothing changed."""
    said = {}
    path = f"{folder}/before.blend"
    bpy.ops.wm.save_as_mainfile(filepath=path)
    for name in OPERATORS:
        obj = bpy.data.objects["Figure"]
        assert QC3D_PT_results.poll(Context(obj))
        drawn(obj)
        choices = {"export_alembic": {"filepath": f"{folder}/a.abc"}, "save_map": {"filepath": f"{folder}/a.qc3dmap"}}
        before, problem = state(), ""
        try:
            assert getattr(bpy.ops.qc3d, name)(**choices.get(name, {})) == {"FINISHED"}
        except RuntimeError as error:
            problem = str(error).strip()
        assert "\n" not in problem, (name, problem)
        assert not problem or state() == before, name
        said[name] = problem
        bpy.ops.wm.open_mainfile(filepath=path)
    return said


def test_every_value_of_a_record(baked: bpy.types.Object) -> None:
    keys, whole = baked.data.shape_keys, stored(baked)
    counts = {"refused": 0, "read": 0}
    for path in places(whole):
        for text in VALUES:
            keys[PROPERTY] = replaced(whole, path, text)
            found = records.state(keys)
            if found.problem is None:
                record = Record.read(keys)
                expect_sound(record)
                assert found.chains == len(record.chains)
                counts["read"] += 1
            else:
                assert found.problem.startswith("The record of earlier bakes on 'Key' "), (path, text[:50])
                with pytest.raises(InputError, match=re.escape(found.problem)):
                    Record.read(keys)
                counts["refused"] += 1
    assert counts["refused"] > 900, counts
    # What a later bake may not know (its request) and what no bake can tell (a name, a count) is read.
    assert 50 < counts["read"] < 500, counts


def test_values_that_are_missing_too_many_or_of_other_types(baked: bpy.types.Object) -> None:
    keys, whole = baked.data.shape_keys, stored(baked)
    chain = whole["chains"][0]
    spoiled: list[object] = [7, 2.5, b"{}", b"\xff", ["{", "}"], [1, 2], {"chains": []}, True, "", "null", "{", "\0"]
    for name in ("through", "slider", "places", "corners", "keys"):
        spoiled.append({**whole, "chains": [{other: value for other, value in chain.items() if other != name}]})
    spoiled += [
        {name: value for name, value in whole.items() if name != "maps"},
        {**whole, "chains": [chain, chain]},
        {**whole, "chains": [chain, {**chain, "through": ["Lean", "Basis"]}]},
        {**whole, "chains": [{**chain, "through": ["Basis"]}]},
        {**whole, "chains": [{**chain, "through": ["Basis", "Basis"]}]},
        {**whole, "chains": [{**chain, "keys": {"1": "Lean", "2": "Lean"}}]},
        {**whole, "chains": [{**chain, "keys": {"4": "Lean"}}]},
        {**whole, "chains": [{**chain, "keys": {"01": "Lean"}}]},
        {**whole, "chains": [{**chain, "keys": {"١": "Lean"}}]},
        {**whole, "chains": [{**chain, "keyframes": [5, 5]}]},
        {**whole, "chains": [{**chain, "keyframes": [1, 2, 3]}]},
        {**whole, "chains": [{**chain, "something": 1}]},
        {**whole, "chains": [{**chain, "intervals": 10**9}]},
        {**whole, "chains": [{**chain, "corners": [2, 1]}]},
        {**whole, "maps": [{"from_key": "Basis"}]},
        {**whole, "maps": [{**whole["maps"][0], "something": "1"}]},
        {**whole, "version": -1},
        {**whole, "version": "1"},
    ]
    for value in spoiled:
        keys.pop(PROPERTY)
        keys[PROPERTY] = json.dumps(value) if isinstance(value, dict) and "maps" in str(value) else value
        with pytest.raises(InputError, match="The record of earlier bakes on 'Key' is damaged; press Forget"):
            Record.read(keys)
        assert records.state(keys).is_damaged


def test_a_text_that_was_cut_or_changed(baked: bpy.types.Object) -> None:
    keys, whole = baked.data.shape_keys, baked.data.shape_keys[PROPERTY]
    draw = random.Random(12)
    refused = 0
    for number in range(600):
        place = draw.randrange(len(whole))
        text = whole[:place] if number % 2 else whole[:place] + chr(draw.randrange(1, 0x300)) + whole[place + 1 :]
        keys[PROPERTY] = text
        try:
            expect_sound(Record.read(keys))
        except InputError:
            refused += 1
    assert refused > 400


def spoil(record: dict[str, Any], path: tuple[Any, ...], value: object) -> str:
    return replaced(record, ("chains", 0, *path), json.dumps(value))


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("places",), [0.0, 1.0, 0.5]),
        (("places",), [0.0, 0.5]),
        (("corners",), [10**9]),
        (("on_key",), "Stretch"),
        (("keys",), {str(step): f"Made {step}" for step in range(10**4)}),
        (("keyframes",), [10**9, 10**12]),
        (("result", "worst", "at"), 1e300),
        (("result", "notes"), [["deep"]]),
        (("result", "seconds"), "long"),
        (("request",), {"count": [[[[1]]]]}),
        (("slider",), ""),
        (("slider",), "x" * 64),
    ],
)
def test_no_operator_touches_what_is_refused(
    baked: bpy.types.Object, state: State, tmp_path: Any, path: tuple[Any, ...], value: object  # noqa: ANN401
) -> None:
    baked.data.shape_keys[PROPERTY] = spoil(stored(baked), path, value)
    said = try_everything(baked, state, str(tmp_path))
    for sentence in said.values():
        assert "The record of earlier bakes on 'Key' is damaged; press Forget Damaged Record" in sentence
    assert "The record of earlier bakes on 'Key' is damaged" in drawn(bpy.data.objects["Figure"]).texts[0]


@pytest.mark.parametrize(
    ("path", "value", "failing"),
    [
        # More steps than there are keys, other keys, none at all.
        (
            ("places",),
            [step / 999 for step in range(1000)],
            {"absolute_keys": "", "heat_map": "not measured", "mirror": "no mirror image"},
        ),
        (("on_key",), "Lean", {"remove": "", "rebake": ""}),
        (("digests",), ["", "x"], {"remove": "", "rebake": ""}),
        (("keys",), {}, {"absolute_keys": "", "rebake": ""}),
        (("keys",), {"0": "Basis", "1": "Stretch", "2": "None"}, {"absolute_keys": "were deleted", "rebake": ""}),
        (("slider",), "Something else", {"to_keyframes": "was deleted", "remove": "", "rebake": ""}),
        (("through",), ["Stretch", "Lean"], {"rebake": "", "save_map": "no longer matches the keys"}),
        (("through",), ["None", "Lean"], {"rebake": "", "remove": ""}),
        (("request",), {}, {"rebake": "are unknown", "live_scrub": "are unknown", "remove": ""}),
        (("request", "count"), 10**9, {"rebake": "are unknown"}),
        (("request", "count"), 10**400, {"rebake": "are unknown"}),
        (("request", "count"), 1.5, {"rebake": "are unknown"}),
        (("request", "tolerance"), "0.1", {"rebake": "are unknown"}),
        (("request", "colliders"), 7, {"rebake": "are unknown"}),
        (("request", "settings"), 7, {"rebake": "are unknown"}),
        (("request", "settings", "mode"), "later", {"rebake": "are unknown"}),
        (("request", "settings", "extra_turns"), 1.5, {"rebake": "are unknown"}),
        (("request", "settings", "seed"), "2", {"rebake": "are unknown"}),
        (("request", "settings", "seed"), True, {"rebake": "are unknown"}),
        (("result",), None, {"select_worst": "were not measured", "rebake": "", "heat_map": ""}),
        (("result", "worst", "vertex"), 10**9, {"select_worst": "were not measured", "heat_map": ""}),
        (("mirror_of",), "None", {"mirror": "is itself the mirror image of 'None'", "rebake": ""}),
    ],
)
def test_what_is_read_is_harmless(
    baked: bpy.types.Object,
    state: State,
    tmp_path: Any,  # noqa: ANN401
    path: tuple[Any, ...],
    value: object,
    failing: dict[str, str],
) -> None:
    baked.data.shape_keys[PROPERTY] = spoil(stored(baked), path, value)
    said = try_everything(baked, state, str(tmp_path))
    for name, sentence in failing.items():
        assert sentence in said[name] if sentence else said[name] == "", (name, said[name])


class TestVersions:
    def test_what_is_written_has_one(self, baked: bpy.types.Object) -> None:
        assert stored(baked)["version"] == VERSION

    def test_a_record_without_one_is_that_of_an_earlier_version(self, baked: bpy.types.Object, state: State) -> None:
        keys, whole = baked.data.shape_keys, stored(baked)
        del whole["version"]
        keys[PROPERTY] = json.dumps(whole)
        assert len(Record.read(keys).chains) == 1
        # Such as the first version wrote.
        first = {name: whole["chains"][0][name] for name in ("through", "slider", "keys", "keyframes")}
        first["intervals"] = 3
        keys[PROPERTY] = json.dumps({"chains": [{**first, "request": {}, "result": {}}], "maps": whole["maps"]})
        (chain,) = Record.read(keys).chains
        assert (chain.result, chain.request, chain.mirror_of) == (None, {}, "")
        assert (chain.places, chain.corners) == ((0.0, 1 / 3, 2 / 3, 1.0), (1, 2))  # hats
        with pytest.raises(RuntimeError, match="are unknown; bake anew"):
            bpy.ops.qc3d.rebake()
        assert drawn(baked).texts[0] == f'["{SLIDER}"]'
        assert bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean", count=2) == {"FINISHED"}
        assert stored(baked)["version"] == VERSION

    def test_a_later_one_is_left_alone(self, baked: bpy.types.Object, state: State, tmp_path: Any) -> None:  # noqa: ANN401
        keys = baked.data.shape_keys
        keys[PROPERTY] = json.dumps({**stored(baked), "version": VERSION + 1, "chains": {"another": "form"}})
        before = state()
        for sentence in try_everything(baked, state, str(tmp_path)).values():
            assert "was written by a later version of QC3D; install that version" in sentence
        for operator in (bpy.ops.qc3d.bake_inbetweens, bpy.ops.qc3d.prepare):
            with pytest.raises(RuntimeError, match="was written by a later version of QC3D; install that version"):
                operator(from_key="Basis", to_key="Stretch")
        with pytest.raises(RuntimeError, match="is not damaged"):
            bpy.ops.qc3d.forget_record()
        layout = drawn(bpy.data.objects["Figure"])
        assert "was written by a later version of QC3D" in layout.texts[0]
        assert layout.buttons == []
        assert state() == before


class TestForgetting:
    def test_it_keeps_keys_and_sliders(self, baked: bpy.types.Object, state: State) -> None:
        keys = baked.data.shape_keys
        assert bpy.ops.qc3d.heat_map() == {"FINISHED"}
        before = state()
        keys[PROPERTY] = 7
        layout = drawn(baked)
        assert "is damaged; press Forget Damaged Record" in layout.texts[0]
        assert [name for name, _ in layout.buttons] == ["forget_record"]
        assert QC3D_OT_forget_record.bl_label == "Forget Damaged Record"
        assert bpy.ops.qc3d.forget_record() == {"FINISHED"}
        after = state()
        for part in ("blocks", "drivers"):
            assert after["keys"]["Key"][part] == before["keys"]["Key"][part]
        assert SLIDER in baked
        assert list(keys.keys()) == []
        assert not baked.modifiers
        assert not QC3D_PT_results.poll(Context(baked))
        assert bpy.ops.qc3d.bake_inbetweens(play_on="slider", from_key="Basis", to_key="Lean", count=2) == {"FINISHED"}
        assert f"{SLIDER}_v2" in baked

    def test_a_sound_record_cannot_be_forgotten(self, baked: bpy.types.Object, state: State) -> None:
        before = state()
        with pytest.raises(RuntimeError, match="is not damaged"):
            bpy.ops.qc3d.forget_record()
        assert state() == before
