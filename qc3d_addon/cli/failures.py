# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that may end a command and is no bug, as a typed error with one sentence."""

from __future__ import annotations

from ..solver.errors import QC3DError, WorkerError, with_remedy

FAILURES = (QC3DError, MemoryError, OSError, RuntimeError)


def told(error: BaseException) -> QC3DError:
    """The error to tell the user, of one that is among ``FAILURES``; raises it again if it is a bug."""
    if isinstance(error, QC3DError):
        return error
    if isinstance(error, MemoryError):
        return WorkerError("There is not enough memory; use fewer frames, a lower quality or a smaller mesh.")
    if isinstance(error, OSError):
        where = f" ({error.filename})" if error.filename else ""
        return WorkerError(f"The system refuses to go on: {with_remedy(error)}{where}.")
    if "start new thread" not in str(error):
        raise error
    return WorkerError("The system allows no more threads; close some programs, or raise the limit (ulimit -u).")
