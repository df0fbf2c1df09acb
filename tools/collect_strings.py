# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Collect the texts of the interface in Blender, and print those that a language lacks: python tools/collect_strings.py

A text is collected where Blender translates it: labels and descriptions of the registered classes and their
properties, and the constant texts that panels and menus draw. Sentences that are put together are not.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import bpy

BLENDER = Path(__file__).resolve().parents[1] / "qc3d_addon" / "blender"
NAMES = {"", "QC3D", "Delaunay", "FBX", "Tetwild", "USD", "glTF"}  # of what is not translated


def collect() -> list[str]:
    """The texts in English, sorted."""
    from qc3d_addon.blender.registration import CLASSES

    found = {text for cls in CLASSES for text in _of_class(cls)}
    for path in sorted(BLENDER.rglob("*.py")):
        found |= set(_drawn(path.read_text(encoding="utf-8")))
    return sorted(text for text in found - NAMES if any(letter.isalpha() for letter in text))


def missing(texts: list[str]) -> dict[str, list[str]]:
    """For each language, what it does not translate."""
    from qc3d_addon.blender.translations import LANGUAGES

    return {language: [text for text in texts if text not in known] for language, known in LANGUAGES.items()}


def unused(texts: list[str]) -> dict[str, list[str]]:
    """For each language, what it translates although nothing shows it."""
    from qc3d_addon.blender.translations import LANGUAGES

    return {language: sorted(set(known) - set(texts)) for language, known in LANGUAGES.items()}


def _of_class(cls: type) -> Iterator[str]:
    """Label and description of a class, and of its own properties."""
    if issubclass(cls, (bpy.types.Operator, bpy.types.Panel)):
        yield str(getattr(cls, "bl_label", ""))
    if issubclass(cls, bpy.types.Operator):
        yield str(getattr(cls, "bl_description", "") or cls.__doc__ or "").strip()
    for base in cls.__mro__:
        for deferred in vars(base).get("__annotations__", {}).values():
            options = getattr(deferred, "keywords", None)
            if not isinstance(options, dict) or 'HIDDEN' in options.get("options", ()):
                continue
            yield options.get("name", "")
            yield options.get("description", "")
            items = options.get("items")
            for item in items if isinstance(items, (list, tuple)) else ():
                yield from item[1:3]


def _drawn(source: str) -> Iterator[str]:
    """Constants given as ``text`` or ``title`` and the like when something is drawn."""
    for call in ast.walk(ast.parse(source)):
        for keyword in call.keywords if isinstance(call, ast.Call) else ():
            if keyword.arg in ("text", "title", "message", "confirm_text"):
                for node in ast.walk(keyword.value):
                    inside = isinstance(keyword.value, (ast.Constant, ast.IfExp))
                    if inside and isinstance(node, ast.Constant) and isinstance(node.value, str):
                        yield node.value


def main() -> None:
    """Print what is missing and what is not used."""
    texts = collect()
    print(f"{len(texts)} texts")
    for word, lists in (("missing", missing(texts)), ("unused", unused(texts))):
        for language, left in lists.items():
            for text in left:
                print(f"{language} {word}: {text!r}")


if __name__ == "__main__":
    main()
