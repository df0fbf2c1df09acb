# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``blender --command qc3d …``: the command ``qc3d`` inside Blender's own Python."""

from __future__ import annotations

from .compat import interruptible


def run_command(arguments: list[str]) -> int:
    """Run one command line; the exit status."""
    # Imported when the command runs: Blender registers it each time it starts.
    from ..cli import speech

    speech.open_streams()
    with interruptible():
        try:
            from ..cli.main import main

            return main(arguments)
        except KeyboardInterrupt:  # while the libraries were loaded
            speech.note("Interrupted; nothing was written.")
            return 130
        except SystemExit as ended:  # --help and --version end this way, which Blender would report as an error
            return int(ended.code or 0)
