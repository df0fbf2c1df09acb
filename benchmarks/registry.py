# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which command makes which picture and table of the documentation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

IMAGES, SCIENCE, GUIDE = "docs/images", "docs/science", "docs/guide"
FIGURE = "qc3d_addon/demo/figure.blend"


@dataclass(frozen=True)
class Entry:
    """Something that is made again by a few commands.

    Parameters
    ----------
    name : str
    commands : tuple of tuple of str
        Run one after the other in the repository. ``{python}`` stands for the interpreter, ``{data}`` for the folder of
        the shapes, ``{work}`` for a folder of the entry's own, ``{package}`` for the extension's package for Linux.
    takes : str
        About how long, on a machine that does nothing else.
    pictures : dict
        Paths of pictures, each with the path in ``{work}`` that it is copied from; empty if a command writes it itself.
    tables : tuple of (str, str)
        Pages, with the writer that the lines around a table name.
    printed : tuple of str
        Pages that hold tables which the commands print; rows that are not on the page are told.
    needs : str
        ``shapes``: the folder ``QC3D_DATA``; ``window``: a Blender to chroot into, ``QC3D_BLENDER_ROOT``.
    """

    name: str
    commands: tuple[tuple[str, ...], ...]
    takes: Literal["seconds", "minutes", "an hour"]
    pictures: Mapping[str, str] = field(default_factory=dict)
    tables: tuple[tuple[str, str], ...] = ()
    printed: tuple[str, ...] = ()
    needs: Literal["", "shapes", "window"] = ""

    @property
    def files(self) -> tuple[str, ...]:
        """Everything in the documentation that it may change."""
        return (*self.pictures, *(page for page, _ in self.tables))


def _module(name: str, *options: str) -> tuple[str, ...]:
    return ("{python}", "-m", f"benchmarks.{name}", *options)


def _qc3d(*words: str) -> tuple[str, ...]:
    return ("{python}", "-m", "qc3d_addon", *words)


def _sheet(*words: str) -> tuple[str, ...]:
    return ("{python}", "tools/contact_sheet.py", *words)


def _written(page: str, writer: str, *options: str) -> tuple[tuple[str, str], ...]:
    return ((f"{SCIENCE}/{page}", " ".join((f"benchmarks/{writer}.py", *options))),)


_ARM = ("--object", "Arm", "--from", "Basis", "--to", "Bend")
_LID = ("--object", "Lid", "--from", "Basis", "--to", "Closed")
_FAMILIES = ("body", "head", "head_parts", "horse", "wolf", "fox", "bar")
_REPRODUCED = {"rebuilt": 4, "reproduced_arm": 7, "compression_cubes": 8, "compression_error": 10}

ENTRIES = (
    Entry("packages", (("{python}", "tools/draw_packages.py"),), "seconds", {"docs/develop/packages.png": ""}),
    Entry(
        "arm",
        (
            _qc3d("bake", FIGURE, *_ARM, "--frames", "5", "--mode", "linear", "--output", "{work}/linear.blend"),
            _qc3d("bake", FIGURE, *_ARM, "--frames", "5", "--output", "{work}/natural.blend"),
            _sheet(
                "mode linear={work}/linear.blend", "mode natural={work}/natural.blend", "--straight", *_ARM,
                "--view", "front", "--output", "{work}/arm.png",
            ),
        ),
        "seconds",
        {f"{IMAGES}/arm.png": "arm.png"},
    ),
    Entry(
        "lid",
        (
            _qc3d("bake", "assets/lid.blend", *_LID, "--frames", "24", "--output", "{work}/free.blend"),
            _qc3d(
                "bake", "assets/lid.blend", *_LID, "--frames", "24", "--colliders", "Eyeball",
                "--output", "{work}/lid.blend",
            ),
            _sheet(
                "without colliders={work}/free.blend", "with colliders={work}/lid.blend", "--straight", *_LID,
                "--scenery", "Eyeball", "--every", "5", "--output", "{work}/lid.png",
            ),
        ),
        "seconds",
        {f"{IMAGES}/lid.png": "lid.png"},
    ),
    Entry("lid table", (_module("lid"),), "seconds", printed=(f"{GUIDE}/colliders.md",)),
    Entry(
        "first sight",
        (("{python}", "assets/render_figure.py", IMAGES),),
        "minutes",
        {f"{IMAGES}/first-sight.webp": "", f"{IMAGES}/first-sight.png": ""},
    ),
    Entry(
        "window",
        (("{python}", "-m", "tests.window.make_quickstart", "{package}", IMAGES),),
        "minutes",
        {
            f"{IMAGES}/{name}.png": ""
            for name in (
                "quickstart-install", "quickstart-keys", "quickstart-bake", "quickstart-play", "on_the_key", "heat_map",
            )
        },
        needs="window",
    ),
    Entry(
        "paper",
        (_qc3d("reproduce", *(f"--figure={number}" for number in _REPRODUCED.values()), "--output", "{work}"),),
        "minutes",
        {f"{IMAGES}/{name}.png": f"figure{number}.png" for name, number in _REPRODUCED.items()},
    ),
    Entry(
        "analyze",
        (_qc3d("analyze", "{data}/body.npz", "--from", "rest", "--to", "t_pose", "--output", "{work}"),),
        "seconds",
        {f"{IMAGES}/analyze_body.png": "surface.png"},
        needs="shapes",
    ),
    Entry(
        "kinds",
        (_module("kinds"),),
        "minutes",
        {f"{IMAGES}/kinds_{name}.png": "" for name in ("page", "bird", "stones")},
    ),
    Entry(
        "inbetweens",
        (_module("inbetweens", "--listed", "--write"),),
        "an hour",
        {f"{IMAGES}/inbetweens_{family}.png": "" for family in _FAMILIES},
        _written("inbetweens.md", "inbetweens"),
        needs="shapes",
    ),
    Entry("clips", (_module("clips"),), "minutes", printed=(f"{SCIENCE}/inbetweens.md",), needs="shapes"),
    Entry(
        "chain picture",
        (_module("chain_picture", f"{IMAGES}/chain.png"),),
        "seconds",
        {f"{IMAGES}/chain.png": ""},
        needs="shapes",
    ),
    Entry("played", (_module("played"),), "minutes", printed=(f"{SCIENCE}/inbetweens.md",), needs="shapes"),
    Entry(
        "continuous",
        (_module("continuous"), _module("continuous", "--methods")),
        "minutes",
        printed=(f"{SCIENCE}/inbetweens.md",),
        needs="shapes",
    ),
    Entry("stages", (_module("stages", "--write"),), "minutes", tables=_written("speed.md", "stages"), needs="shapes"),
    Entry(
        "growth",
        (_module("stages", "--growth", "--frames", "4", "--write"),),
        "minutes",
        tables=_written("speed.md", "stages", "--growth"),
    ),
    Entry(
        "small",
        (_module("stages", "--small", "--frames", "4", "--write"),),
        "minutes",
        tables=_written("speed.md", "stages", "--small"),
    ),
    Entry(
        "methods",
        (_module("stages", "--methods", "--frames", "3", "--write"),),
        "minutes",
        tables=_written("speed.md", "stages", "--methods"),
        needs="shapes",
    ),
    Entry("keys", (_module("keys", "--write"),), "minutes", tables=_written("speed.md", "keys"), needs="shapes"),
    Entry("clicks", (_module("clicks", "--write"),), "minutes", tables=_written("speed.md", "clicks")),
    Entry("fit", (_module("fit"),), "minutes", printed=(f"{SCIENCE}/speed.md",), needs="shapes"),
    Entry("slim", (_module("slim"),), "an hour", printed=(f"{SCIENCE}/speed.md",), needs="shapes"),
    Entry("factorizations", (_module("factorizations"),), "minutes", printed=(f"{SCIENCE}/speed.md",), needs="shapes"),
    Entry("meeting", (_module("meeting"),), "minutes", printed=(f"{SCIENCE}/method.md",), needs="shapes"),
    Entry("heat maps", (_module("heat_maps"),), "minutes", printed=(f"{SCIENCE}/method.md",), needs="shapes"),
    Entry("scrub", (_module("scrub"),), "minutes", printed=(f"{GUIDE}/panel.md",), needs="shapes"),
    Entry("large", (_module("large"),), "an hour", printed=(f"{GUIDE}/limits.md",)),
    Entry(
        "compression",
        (_module("compression", "--data", "{data}", "--write"),),
        "minutes",
        tables=(("docs/reference/compression.md", "benchmarks/compression.py"),),
        needs="shapes",
    ),
)  # fmt: skip
