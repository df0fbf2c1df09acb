# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d reproduce``: the paper's experiments, drawn, measured, and compared with its claims."""

from __future__ import annotations

import argparse
from functools import cache
from importlib.util import find_spec
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from ..solver.errors import InputError
from ..solver.files.atomic import making_folder, replacing_all, require_writable_in
from ..solver.maps.mapping import Mapping
from . import speech

if TYPE_CHECKING:
    from qc3d_paper.experiments.caption import Caption
    from qc3d_paper.experiments.experiment import Experiment

    from ..solver.tets.mesh import TetMesh

NUMBERS = tuple(range(3, 14))
_TEXT = "figures.md"


def add_to(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command to the others."""
    command = commands.add_parser("reproduce", help="the experiments of the paper on which the method is based")
    command.add_argument(
        "--figure", type=int, choices=NUMBERS, action="append", metavar="N", help="3 to 13; repeatable (default: all)"
    )
    command.add_argument(
        "--data", type=Path, metavar="FOLDER", help="real shapes: head.npz and body.npz in place of the demo files"
    )
    command.add_argument("--output", type=Path, required=True, metavar="FOLDER", help="made if it does not exist")
    command.set_defaults(run=_run)


def _run(arguments: argparse.Namespace) -> None:
    if find_spec("matplotlib") is None:
        raise InputError("The figures need matplotlib, which is not installed; pip install 'qc3d[demo]'.")
    pictures = {number: arguments.output / f"figure{number}.png" for number in sorted(set(arguments.figure or NUMBERS))}
    require_writable_in(arguments.output, [*(path.name for path in pictures.values()), _TEXT])
    text = "# The paper's figures, made again\n"
    for number, path in pictures.items():
        drawn = BytesIO()
        caption = _draw(number, arguments.data, drawn)
        text += f"\n{caption.text(path)}"
        # Each figure comes with its caption; a folder that is made stays only with something in it.
        with making_folder(arguments.output), replacing_all(path, arguments.output / _TEXT) as (picture, captions):
            picture.write_bytes(drawn.getvalue())
            captions.write_text(text, encoding="utf-8")
        speech.say(f"Figure {number}: {caption.holds}")


def _draw(number: int, data: Path | None, file: BinaryIO) -> Caption:
    from qc3d_paper.experiments import bijections, sequences, shapes, spectra

    if number <= 5:
        return bijections.draw(str(number), *_bijection(str(number), data), file)
    if number <= 7:
        known = {6: (shapes.FACES, shapes.DATA_FACES), 7: (shapes.BODIES, shapes.DATA_BODIES)}
        return sequences.draw(str(number), known[number][data is not None], data, file)
    which, kind = divmod(number - 8, 3)
    draw = (spectra.draw_cubes, spectra.draw_spectrum, spectra.draw_errors)[kind]
    return draw(str(number), _experiments(which, data), file)


def _bijection(number: str, data: Path | None) -> tuple[str, Mapping]:
    """Title of a figure, and the map that it reconstructs: from a formula, or fitted to real shapes."""
    from qc3d_paper.experiments import bijections, shapes

    if data is None:
        title, formula = bijections.BIJECTIONS[number]
        return bijections.without_folds(_cube(), title, formula)
    pose = (shapes.DATA_FACES[1], shapes.DATA_BODIES[0], shapes.DATA_BODIES[2])[int(number) - 3]
    fitted = shapes.fitted(shapes.read(pose, data))
    return f"the map of {pose.label}", Mapping(fitted.mesh, fitted.mapped)


@cache
def _cube() -> TetMesh:
    from qc3d_paper.experiments import shapes

    return shapes.cube()


@cache
def _experiments(which: int, data: Path | None) -> list[Experiment]:
    """A smooth bijection, as the paper's maps are, and a fitted map: first mild ones, a face, then extreme, a body."""
    from qc3d_paper.experiments import bijections, shapes
    from qc3d_paper.experiments.experiment import Experiment

    mild, extreme = (shapes.FACES, shapes.BODIES) if data is None else (shapes.DATA_FACES, shapes.DATA_BODIES)
    pose, formula = ((mild[1], "5"), (extreme[2], "4"))[which]
    return [Experiment.smooth(*bijections.BIJECTIONS[formula]), Experiment.fitted(pose, data)]
