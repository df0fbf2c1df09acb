# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Options are validated when they are made: types as well as ranges."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.settings import FitOptions, FrameOptions


def test_defaults() -> None:
    assert FitOptions() == FitOptions("delaunay", "normal", 0, "linear", 0)
    assert FrameOptions() == FrameOptions("natural", "linear")


@pytest.mark.parametrize(
    ("choice", "sentence"),
    [
        ({"engine": "tetgen"}, "Unknown engine 'tetgen'; choose one of auto, tetwild, delaunay."),
        ({"engine": None}, "Unknown engine None; choose one of"),
        ({"engine": ["auto"]}, "Unknown engine ['auto']; choose one of"),
        ({"quality": "best"}, "Unknown quality 'best'; choose one of normal, fine, finest"),
        ({"stretch": 1}, "Unknown stretch 1; choose one of linear, logarithmic."),
        ({"mesh_time_limit": 0.0}, "The time limit of meshing is 0.0; it must be a positive number of seconds."),
        ({"mesh_time_limit": float("nan")}, "The time limit of meshing is nan;"),
        ({"mesh_time_limit": "60"}, "The time limit of meshing is '60';"),
        ({"mesh_time_limit": True}, "The time limit of meshing is True;"),
        ({"seed": -1}, "The seed is -1; it must be 0 or more."),
        ({"seed": 1.0}, "The seed is 1.0; it must be a whole number."),
        ({"seed": None}, "The seed is None; it must be a whole number."),
        ({"extra_turns": 1.5}, "The number of extra turns is 1.5; it must be a whole number."),
        ({"extra_turns": "2"}, "The number of extra turns is '2'; it must be a whole number."),
        ({"extra_turns": True}, "The number of extra turns is True; it must be a whole number."),
        ({"extra_turns": 101}, "101 extra turns are asked for; choose a number from -100 to 100."),
    ],
)
def test_options_of_a_fit_are_refused_with_a_sentence(choice: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=re.escape(sentence)):
        FitOptions(**choice)


@pytest.mark.parametrize(
    ("choice", "sentence"),
    [
        ({"mode": "cubic"}, "Unknown mode 'cubic'; choose one of natural, linear, straight."),
        ({"mode": 0}, "Unknown mode 0; choose one of"),
        ({"easing": "bounce"}, "Unknown easing 'bounce'; choose one of"),
    ],
)
def test_options_of_frames_are_refused_with_a_sentence(choice: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError, match=re.escape(sentence)):
        FrameOptions(**choice)


def test_whole_numbers_of_numpy_are_whole_numbers() -> None:
    assert FitOptions(extra_turns=np.int64(2), seed=np.int32(3)).extra_turns == 2
