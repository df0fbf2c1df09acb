# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress on a terminal: one bar for each stage of a bake."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from typing import TYPE_CHECKING, NoReturn

if TYPE_CHECKING:
    from types import TracebackType

    from tqdm import tqdm

    from ..solver.support.progress import Done, Progress

_FORMAT = "{desc:8}{percentage:4.0f}% |{bar:40}| {elapsed}"


class StageBars:
    """Draws the progress that it is called with; silent unless standard error is a terminal.

    Also silent inside Blender, whose own Python comes without tqdm.
    """

    def __init__(self) -> None:
        self._bar: tqdm[NoReturn] | None = None
        self._visible = sys.stderr is not None and sys.stderr.isatty() and find_spec("tqdm") is not None

    def __call__(self, progress: Progress) -> None:
        self._show(progress.stage, progress.fraction)

    def of_keys(self, progress: Done) -> None:
        """Draw the progress of a run of many keys: one bar for all."""
        self._show("keys", progress.overall)

    def _show(self, stage: str, fraction: float) -> None:
        if not self._visible:
            return
        if self._bar is None or self._bar.desc != stage:
            self._finish_stage()
            self._bar = _new_bar(stage)
        self._bar.update(max(0.0, fraction - self._bar.n))

    def __enter__(self) -> StageBars:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self._finish_stage()
        elif self._bar is not None:
            self._bar.close()

    def _finish_stage(self) -> None:
        """Complete the bar: a stage is finished when another one starts, whatever fraction it reported last."""
        if self._bar is not None:
            self._bar.update(1.0 - self._bar.n)
            self._bar.close()
            self._bar = None


def _new_bar(stage: str) -> tqdm[NoReturn]:
    from tqdm import tqdm

    bar: tqdm[NoReturn] = tqdm(total=1.0, bar_format=_FORMAT, file=sys.stderr)
    bar.desc = stage  # set_description would add a colon, which the alignment does not expect
    bar.refresh()
    return bar
