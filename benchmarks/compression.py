# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Compression of maps: bytes, folds and errors of the schemes and of quantized coordinates, as Markdown tables.

    python -m benchmarks.compression --data FOLDER

FOLDER contains head.npz and body.npz. The frames of a chain are read from a FRAMES.npz of ``qc3d interpolate``, if
given.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from qc3d_addon.solver.compression import frames as frame_compression
from qc3d_addon.solver.compression.codec import Codec, Scheme
from qc3d_addon.solver.compression.files import Packer, Source
from qc3d_addon.solver.compression.search import Choice, Compressor
from qc3d_addon.solver.errors import InputError, ReconstructionError
from qc3d_paper.experiments import shapes

ERRORS = (1e-2, 3e-3, 1e-3, 1e-4)
MODES = 300
PLAIN: tuple[Scheme, ...] = ("published", "logarithm", "fitted")
COUNTS = (16, 60)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, metavar="FOLDER")
    parser.add_argument("--frames", type=Path, metavar="FRAMES.npz")
    arguments = parser.parse_args()
    print("| what | error | modes | remainder | bytes | of raw | quantised + deflate | ratio | folds | theirs |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for pose in (shapes.DATA_FACES[1], shapes.DATA_BODIES[2]):
        fitted = shapes.fitted(shapes.read(pose, arguments.data))
        mesh, targets = fitted.mesh, fitted.mapped[None]
        packer = Packer(Source("maps", mesh.points, mesh.tets), MODES)
        compressor = Compressor(Codec(mesh, MODES), targets, packer)
        _print_errors(pose.label, compressor)
        for scheme in PLAIN:
            searched = Compressor(Codec(mesh, MODES, scheme), targets, packer)
            for modes in COUNTS:
                try:
                    _print_row(f"{pose.label}, {scheme}, modes alone", searched, searched.with_modes(modes))
                except ReconstructionError:
                    print(f"| {pose.label}, {scheme}, {modes} modes alone | no map |", flush=True)
    if arguments.frames is not None:
        with np.load(arguments.frames, allow_pickle=False) as archive:
            frames, faces = archive["frames"], archive["faces"].astype(np.int64)
        searched = frame_compression.compressor(frames, faces, MODES)
        _print_errors("frames", searched)
        for modes in COUNTS:
            _print_row("frames, fitted, modes alone", searched, searched.with_modes(modes))


def _print_errors(label: str, compressor: Compressor) -> None:
    identity = compressor.with_modes(0).error
    for error in ERRORS:
        if error >= identity:
            continue  # nothing need be stored
        try:
            _print_row(label, compressor, compressor.with_error(error))
        except InputError as reason:
            print(f"| {label} | {error:.0e} | {reason} |", flush=True)


def _print_row(label: str, compressor: Compressor, choice: Choice) -> None:
    raw = 4 * compressor.targets.size
    quantised = compressor.quantised_coordinates(choice.error)
    cells = (
        label,
        f"{choice.error:.1e}",
        choice.compressed.numbers.shape[1],
        "no" if choice.compressed.remainder is None else "yes",
        choice.size,
        f"1 : {raw / choice.size:.0f}",
        len(quantised.data),
        f"{len(quantised.data) / choice.size:.2f}",
        sum(choice.folds),
        sum(quantised.folds) if quantised.folds else "–",
    )
    print("| " + " | ".join(map(str, cells)) + " |", flush=True)


if __name__ == "__main__":
    main()
