# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Captions: what the paper claims, what was measured, and whether the claim holds."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


def table(head: list[str], rows: list[list[str]]) -> str:
    """A Markdown table, with what comes before and after it kept apart."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n\n" + "\n".join(f"| {' | '.join(cells)} |" for cells in lines) + "\n\n"


@dataclass(frozen=True)
class Caption:
    """The caption of one figure.

    Parameters
    ----------
    figures : str
        Number of the figure in the paper, such as "3".
    title : str
        What the figure shows.
    claim : str
        What the paper claims.
    measured : str
        What was measured here.
    holds : str
        Whether the claim holds: a sentence that begins with Yes, No or In part.
    """

    figures: str
    title: str
    claim: str
    measured: str
    holds: str

    def text(self, picture: Path) -> str:
        """Markdown of the figure, whose picture is in the same folder, and its caption."""
        return (
            f"## Figure {self.figures}: {self.title}\n\n![{self.title}]({picture.name})\n\n"
            f"**The paper claims:** {self.claim}\n\n**Measured:** {self.measured.rstrip()}\n\n**Holds?** {self.holds}\n"
        )
