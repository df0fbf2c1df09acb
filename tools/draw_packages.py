# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draw the packages by floor, with an arrow wherever one imports another::

    python tools/draw_packages.py [docs/develop/packages.png]

The floors come from tests/test_layering.py, the arrows from the code.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

import matplotlib

matplotlib.use("agg")
from matplotlib import pyplot
from matplotlib.patches import Rectangle

REPOSITORY = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(REPOSITORY))
from tests.test_layering import SOLVER_FLOORS, imports_of, modules  # noqa: E402

# Packages above the solver, each on a floor of its own.
ABOVE = ("worker", "blender", "cli")
# A palette safe for color-blind readers (Okabe & Ito 2008), one color for each floor in turn.
_COLORS = ("#56B4E9", "#E69F00", "#009E73", "#F0E442", "#CC79A7", "#D55E00", "#0072B2")
_DARK = {"#0072B2", "#D55E00", "#009E73"}
_WIDTH, _HEIGHT = 1.6, 0.62
# Imported from everywhere: arrows to these would hide all others.
_COMMON = {"arrays", "errors", "settings"}


def imports(repository: Path) -> tuple[Counter[str], Counter[tuple[str, str]]]:
    """Number of modules in each package, and of imports from one package to another."""
    sizes: Counter[str] = Counter()
    arrows: Counter[tuple[str, str]] = Counter()
    for name, is_package, source in modules(repository):
        own = _room(name)
        if own is None:
            continue
        sizes[own] += not is_package
        for target in set(imports_of(source, name, is_package)):
            other = _room(target)
            if other is not None and other != own and other not in _COMMON:
                arrows[own, other] += 1
    return sizes, arrows


def _room(name: str) -> str | None:
    parts = name.split(".")
    if len(parts) < 2 or parts[0] != "qc3d_addon":
        return None
    if parts[1] == "solver":
        return parts[2] if len(parts) > 2 and any(parts[2] in floor for floor in SOLVER_FLOORS) else None
    return parts[1] if parts[1] in ABOVE else None


def draw(path: Path) -> None:
    """Write the picture to ``path``."""
    sizes, arrows = imports(REPOSITORY)
    floors = [*SOLVER_FLOORS, *((room,) for room in ABOVE)]
    places = {}
    for level, rooms in enumerate(floors):
        for number, room in enumerate(rooms):
            places[room] = (2.6 * (number - 0.5 * (len(rooms) - 1)), 1.15 * level)
    figure, axes = pyplot.subplots(figsize=(9, 1.1 * len(floors)))
    heights = {room: level for level, rooms in enumerate(floors) for room in rooms}
    for (own, other), count in arrows.items():
        (x0, y0), (x1, y1) = places[own], places[other]
        bend = 0.12 * (heights[own] - heights[other] - 1) * (1 if x0 >= x1 else -1)
        axes.annotate(
            "",
            (x1, y1 + 0.5 * _HEIGHT),
            (x0, y0 - 0.5 * _HEIGHT),
            arrowprops={
                "arrowstyle": "-|>",
                "color": "0.45",
                "linewidth": min(0.4 + 0.06 * count, 2.0),
                "alpha": 0.55,
                "connectionstyle": f"arc3,rad={min(max(bend, -0.45), 0.45)}",
            },
        )
    for level, rooms in enumerate(floors):
        for room in rooms:
            x, y = places[room]
            color = _COLORS[level % len(_COLORS)]
            box = Rectangle(
                (x - 0.5 * _WIDTH, y - 0.5 * _HEIGHT), _WIDTH, _HEIGHT, facecolor=color, edgecolor="black", zorder=3
            )
            axes.add_patch(box)
            count = sizes[room]
            text = room if count == 1 else f"{room}\n{count} modules"
            ink = "white" if color in _DARK else "black"
            axes.text(x, y, text, ha="center", va="center", fontsize=10.5, zorder=4, color=ink)
    axes.axhline(1.15 * (len(SOLVER_FLOORS) - 0.5), color="black", linewidth=1.0, linestyle=":")
    note = "solver/: numpy and scipy only.\nArrays, errors and settings\nare imported from everywhere."
    axes.text(-4.4, 1.15 * (len(SOLVER_FLOORS) - 0.5) - 0.12, note, va="top", fontsize=10)
    axes.set_xlim(-4.5, 4.5)
    axes.set_ylim(-0.6, 1.15 * len(floors) - 0.4)
    axes.axis("off")
    figure.savefig(path, dpi=110, bbox_inches="tight")
    pyplot.close(figure)


if __name__ == "__main__":
    draw(Path(sys.argv[1]) if len(sys.argv) > 1 else REPOSITORY / "docs" / "develop" / "packages.png")
