# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The interface in other languages: what Blender shows in English, and its translation.

Sentences that are put together from parts, such as errors and results, stay English.
"""

from __future__ import annotations

import bpy

from . import chinese, french, german, japanese, spanish

LANGUAGES = {
    "de_DE": german.TEXTS,
    "es": spanish.TEXTS,
    "fr_FR": french.TEXTS,
    "ja_JP": japanese.TEXTS,
    "zh_HANS": chinese.TEXTS,
}
_CONTEXTS = ("*", "Operator")  # labels of operators are looked up apart from other texts
_DOMAIN = __package__ or ""


def register() -> None:
    """Give Blender the translations."""
    tables = {
        language: {(context, text): translation for text, translation in texts.items() for context in _CONTEXTS}
        for language, texts in LANGUAGES.items()
    }
    bpy.app.translations.register(_DOMAIN, tables)  # type: ignore[arg-type,unused-ignore]  # 4.5's stubs: other keys


def unregister() -> None:
    """Take them back."""
    bpy.app.translations.unregister(_DOMAIN)
