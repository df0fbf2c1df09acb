# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of sliders and keys: readable, unique, and never longer than Blender keeps."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from qc3d_addon.blender.store.names import LIMIT, chain_label, key_name

# What Blender can hold as a key's name: up to 63 bytes.
key_names = st.text(st.characters(exclude_categories=("Cs", "Cc")), min_size=1, max_size=63).filter(
    lambda name: len(name.encode()) <= LIMIT
)


def test_short_names_are_kept_whole() -> None:
    assert chain_label(["Basis", "Smile"], set()) == "Basis_to_Smile"
    places = (0.0, 0.05, 0.25, 1 / 3, 1.0)
    assert [key_name("Smile", step, places) for step in range(5)] == [
        "Smile_00",
        "Smile_05",
        "Smile_25",
        "Smile_33",
        "Smile_100",
    ]
    assert [key_name("Smile", step, (0.331, 0.334)) for step in range(2)] == ["Smile_33_1", "Smile_33_4"]


def test_a_long_name_keeps_both_ends_and_uses_the_room_of_a_short_one() -> None:
    label = chain_label(["Basis", "CC_Base_Body_Mouth_Corner_Upper_Lip_Raiser_Left"], set())
    first, second = label.split("_to_")
    assert first == "Basis"
    assert second.startswith("CC_Base_Body_Mouth_C")
    assert second.endswith("pper_Lip_Raiser_Left")


def test_a_label_that_is_taken_gets_a_number() -> None:
    taken = {"A_to_B"}
    assert chain_label(["A", "B"], taken) == "A_to_B_v2"
    assert chain_label(["A", "B"], taken | {"A_to_B_v2"}) == "A_to_B_v3"


@given(key_names, key_names)
def test_names_fit_with_the_suffix_that_blender_may_add(first: str, second: str) -> None:
    label = chain_label([first, second], set())
    longest = key_name(label, 0, (0.999, 0.9995))
    assert len((longest + ".001").encode()) <= LIMIT
    assert "_to_" in label


@pytest.mark.parametrize("letter", ["a", "é", "表", "🙂"])
def test_names_are_cut_between_characters(letter: str) -> None:
    name = (letter * 63).encode()[:63].decode(errors="ignore")
    label = chain_label([name, name], set())
    assert set(label) == {letter, *"_to"}
    other = chain_label([name, name], {label})
    assert other != label
    assert len(other.encode()) <= len(key_name("x" * 53, 0, (0.25, 1.0)).encode())


def test_a_chain_shares_its_room_between_its_keys() -> None:
    assert chain_label(["Rest", "Mid", "End"], set()) == "Rest_to_Mid_to_End"
    long = "CC_Base_Body_Mouth_Corner_Raiser"
    label = chain_label([long + "_1", "Rest", long + "_2"], set())
    first, middle, last = label.split("_to_")
    assert (middle, first[-2:], last[-2:]) == ("Rest", "_1", "_2")
    assert abs(len(first) - len(last)) <= 1


def test_a_long_chain_names_its_ends() -> None:
    assert chain_label([f"Pose {number:03}" for number in range(12)], set()) == "Pose 000_to____to_Pose 011"


@given(st.lists(key_names, min_size=2, max_size=12))
def test_names_of_chains_fit(names: list[str]) -> None:
    longest = key_name(chain_label(names, set()), 0, (0.999, 0.9995))
    assert len((longest + ".001").encode()) <= LIMIT
