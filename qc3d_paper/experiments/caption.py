# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is written below a figure: what the paper claims, what was measured, and whether it holds."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Caption:
    """The text of one figure.

    Parameters
    ----------
    figures
        The paper's numbers of the figures, such as "3".
    title
        What is seen.
    claim
        What the paper claims.
    measured
        What was measured here.
    holds
        Whether the claim holds, in a sentence that begins with Yes, No or In part.
    """

    figures: str
    title: str
    claim: str
    measured: str
    holds: str

    def text(self, picture: Path) -> str:
        """The figure and its caption as Markdown."""
        return (
            f"## Figure {self.figures}: {self.title}\n\n![{self.title}]({picture.name})\n\n"
            f"**The paper claims:** {self.claim}\n\n**Measured:** {self.measured}\n\n**Holds?** {self.holds}\n"
        )
