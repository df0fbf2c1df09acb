# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Wheels without what no program needs: their tests, and sources and headers for compilers.

Whole subpackages that QC3D does not import stay. Blender keeps the wheels of all extensions in one folder, so another
extension may get this copy of scipy, and must find it complete.
"""

from __future__ import annotations

import csv
import io
import re
import zipfile
from pathlib import Path, PurePosixPath

_FOR_COMPILERS = (".pyx", ".pxd", ".pyi", ".h")
_LICENCE_NAME = re.compile(r"(licen[cs]e|copying|notice)", re.IGNORECASE)


def slimmed(wheel: Path, folder: Path) -> Path:
    """A copy of the wheel in ``folder``, of the same name, without what nobody needs; its list of files agrees.

    Equal wheels make equal copies. License texts stay wherever they are.
    """
    path = folder / wheel.name
    with zipfile.ZipFile(wheel) as source, zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as copy:
        kept = [entry for entry in source.infolist() if not is_needless(entry.filename)]
        names = {entry.filename for entry in kept}
        for entry in kept:
            content = source.read(entry)
            if entry.filename.endswith(".dist-info/RECORD"):
                content = _record(content, names)
            written = zipfile.ZipInfo(entry.filename, (2026, 1, 1, 0, 0, 0))
            written.external_attr = entry.external_attr
            copy.writestr(written, content, zipfile.ZIP_DEFLATED, compresslevel=9)
    return path


def is_needless(name: str) -> bool:
    """Whether a file in a wheel is a test or for a compiler only.

    >>> [is_needless(name) for name in ("scipy/linalg/tests/test_blas.py", "scipy/linalg/cython_blas.pxd")]
    [True, True]
    >>> [is_needless(name) for name in ("scipy/linalg/blas.py", "scipy/linalg/tests/LICENSE", "a/tests.py")]
    [False, False, False]
    """
    path = PurePosixPath(name)
    if _LICENCE_NAME.match(path.name) or ".dist-info" in path.parts[0]:
        return False
    return "tests" in path.parts[:-1] or path.suffix in _FOR_COMPILERS


def _record(content: bytes, names: set[str]) -> bytes:
    """The wheel's list of files, with those that it still has."""
    rows = [row for row in csv.reader(io.StringIO(content.decode())) if row and row[0] in names]
    lines = io.StringIO()
    csv.writer(lines, lineterminator="\n").writerows(rows)
    return lines.getvalue().encode()
