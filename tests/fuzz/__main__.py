# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m tests.fuzz --cases 2000 --seed 1``: half of the cases are meshes, half files; prints crashes."""

from __future__ import annotations

import argparse
import re
import sys
from collections import Counter

from .runner import KINDS, Verdict, run_cases

_NUMBERS = re.compile(r"[-+]?\d[\d.e+-]*|'[^']*'|/\S+|nan|inf")


def main() -> int:
    """Run the cases; 1 where one of them crashed."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--cases", type=int, default=2000, metavar="N", help="how many (default: 2000)")
    parser.add_argument("--seed", type=int, default=1, metavar="S", help="another seed, other cases (default: 1)")
    parser.add_argument("--only", choices=KINDS, help="cases of this kind only")
    parser.add_argument("--first", type=int, default=0, metavar="K", help="number of the first case (default: 0)")
    arguments = parser.parse_args()
    kinds = (arguments.only,) if arguments.only else KINDS
    endings: Counter[tuple[str, str]] = Counter()
    sentences: Counter[str] = Counter()
    slowest = Verdict("", 0, "", "", "", 0.0)
    for place, kind in enumerate(kinds):
        count = (arguments.cases + place) // len(kinds)
        for verdict in run_cases(kind, arguments.seed, range(arguments.first, arguments.first + count)):
            endings[kind, verdict.ending] += 1
            slowest = max(slowest, verdict, key=lambda case: case.seconds)
            if verdict.ending == "error":
                sentences[_NUMBERS.sub("…", verdict.text)] += 1
            if verdict.ending == "crash":
                print(f"CRASH {kind} {verdict.number} ({verdict.story}):\n{verdict.text}\n", flush=True)
    for sentence, times in sentences.most_common():
        print(f"{times:5} {sentence}")
    for (kind, ending), times in sorted(endings.items()):
        print(f"{kind}: {times} {ending}")
    print(f"slowest: {slowest.kind} {slowest.number}, {slowest.seconds:.1f} s ({slowest.story})")
    return 1 if any(ending == "crash" for _, ending in endings) else 0


if __name__ == "__main__":
    sys.exit(main())
