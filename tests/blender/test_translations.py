# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Every text of the interface is translated into every language, and nothing else is."""

from __future__ import annotations

import importlib
import re
from types import SimpleNamespace
from typing import Any

import pytest

import collect_strings
from qc3d_addon.blender import translations
from qc3d_addon.blender.translations import LANGUAGES

# Names, keys and numbers that every language must keep.
KEPT = re.compile(r"QC3D|USD|FBX|Alembic|Smile_\d+|\[\{.*?\}, \.\.\.\]|Maya|Unity|Unreal|VRM|\.blend\b|\d+")


@pytest.fixture(scope="module")
def texts() -> list[str]:
    found = collect_strings.collect()
    assert {"Bake In-Betweens", "Advanced", "Limbs turn; lengths and volumes are kept", "Discard and Open",
            "Copy QC3D Report for a Bug", "Time Limit"} <= set(found)  # fmt: skip
    return found


@pytest.mark.parametrize("language", LANGUAGES)
def test_nothing_is_missing_or_left_over(language: str, texts: list[str]) -> None:
    assert collect_strings.missing(texts)[language] == []
    assert collect_strings.unused(texts)[language] == []


@pytest.mark.parametrize("language", LANGUAGES)
def test_translations_keep_names_and_the_form_of_labels(language: str) -> None:
    for text, translation in LANGUAGES[language].items():
        assert translation.strip()
        assert not translation.endswith(".") or text.endswith(".") or ". " in translation, text
        for name in KEPT.findall(text):
            assert name in translation, text
        assert text.startswith("  ") == translation.startswith("  ")


@pytest.mark.parametrize("language", LANGUAGES)
def test_what_fits_on_a_button_in_english_fits_on_it(language: str) -> None:
    # Pixels of Blender's own font at its usual size; the sidebar is 240 wide or wider, without the margins of a panel.
    blf: Any = importlib.import_module("blf")  # Blender's own: it is there once bpy is
    blf.size(0, 11)
    for text, translation in LANGUAGES[language].items():
        if blf.dimensions(0, text)[0] <= 130:
            assert blf.dimensions(0, translation)[0] <= 205, (text, translation)


def test_blender_gets_them_as_labels_of_operators_too(monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, dict[str, dict[tuple[str, str], str]]] = {}
    blender = SimpleNamespace(register=given.__setitem__, unregister=given.__delitem__)
    monkeypatch.setattr(translations, "bpy", SimpleNamespace(app=SimpleNamespace(translations=blender)))
    translations.register()
    (tables,) = given.values()
    assert tables["de_DE"]["Operator", "Bake In-Betweens"] == "Zwischenformen backen"
    assert tables["ja_JP"]["*", "Quality"] == "品質"
    translations.unregister()
    assert given == {}
