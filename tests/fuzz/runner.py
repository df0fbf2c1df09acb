# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs cases in a child process with limits; after a crash, goes on with the next case."""

from __future__ import annotations

import json
import os
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time as clock
import traceback
import warnings
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from qc3d_addon.solver.errors import QC3DError

from . import file_cases, mesh_cases

KINDS = ("mesh", "file")
MOST_SECONDS = 120  # on a busy machine; most take less than one
MOST_MEGABYTES = 1500
REPOSITORY = Path(__file__).resolve().parents[2]
_SENTENCE = re.compile(r"[^\x00-\x1f\x7f-\x9f]{20,1500}\.")


@dataclass(frozen=True)
class Verdict:
    """What came of a case.

    Parameters
    ----------
    kind
        "mesh" or "file".
    number
        The case's number; with the seed of the run it makes the case again.
    story
        How the case came about.
    ending
        "result", "error" where a typed error said why not, or "crash" for anything else.
    text
        The result in a word, the error's sentence, or what is known of the crash.
    seconds
        How long it took.
    """

    kind: str
    number: int
    story: str
    ending: str
    text: str
    seconds: float


def run_cases(kind: str, seed: int, numbers: range) -> Iterator[Verdict]:
    """Run cases of one kind one after the other."""
    waiting = list(numbers)
    while waiting:
        arguments = [sys.executable, "-m", f"{__package__}.runner", kind, str(seed), *map(str, waiting)]
        with (
            tempfile.TemporaryFile("w+") as errors,
            subprocess.Popen(arguments, cwd=REPOSITORY, stdout=subprocess.PIPE, stderr=errors, text=True) as child,
        ):
            assert child.stdout is not None
            story = ""
            for line in child.stdout:
                message = json.loads(line)
                if "ending" not in message:
                    story = message["story"]
                    continue
                waiting.remove(message["number"])
                yield Verdict(**message)
            child.wait()
            errors.seek(0)
            words = errors.read()[-2000:]
        if child.returncode != 0:
            if child.returncode == -signal.SIGALRM:
                words = f"stopped after {MOST_SECONDS} s"
            if not waiting:
                raise RuntimeError(f"the child ended with {child.returncode} after its last case: {words}")
            yield Verdict(kind, waiting.pop(0), story, "crash", f"exit status {child.returncode}: {words}", 0.0)


def run_case(kind: str, seed: int, number: int) -> Verdict:
    """Run one case in this process."""
    started = clock.monotonic()
    random = np.random.default_rng([seed, KINDS.index(kind), number])
    story = ""
    try:
        with warnings.catch_warnings(), np.errstate(all="raise", under="ignore"):
            warnings.simplefilter("error")
            if kind == "mesh":
                mesh, *choices = mesh_cases.make(random)
                story = ", ".join(mesh.story)
                _announce(story)
                ending, text = "result", mesh_cases.run(mesh, *choices)
            else:
                with tempfile.TemporaryDirectory() as folder:
                    case = file_cases.make(random, Path(folder))
                    story = case.story
                    _announce(story)
                    ending, text = "result", case.read()
    except QC3DError as error:
        ending, text = "error", str(error)
        if not _SENTENCE.fullmatch(text):
            ending, text = "crash", f"not a sentence: {text!r}"
    except Exception:
        ending, text = "crash", traceback.format_exc()
    return Verdict(kind, number, story, ending, text, clock.monotonic() - started)


def _announce(story: str) -> None:
    if __name__ == "__main__":
        print(json.dumps({"story": story}), flush=True)


def _main(arguments: list[str]) -> None:
    kind, seed = arguments[0], int(arguments[1])
    mesh_cases.coarser()
    file_cases.warm_up()
    resource.setrlimit(resource.RLIMIT_DATA, (MOST_MEGABYTES * 2**20,) * 2)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for number in map(int, arguments[2:]):
        signal.alarm(MOST_SECONDS)  # without a handler: it ends the process, also where Python does not come to it
        print(json.dumps(asdict(run_case(kind, seed, number))), flush=True)
    signal.alarm(0)
    os._exit(0)


if __name__ == "__main__":
    _main(sys.argv[1:])
