# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 8 to 13 (section 6.2): two maps compressed by their lowest modes, three figures for each."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import BinaryIO

import matplotlib
import numpy as np

from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.compression.codec import Codec, Scheme
from qc3d_addon.solver.compression.modes import Transfer
from qc3d_addon.solver.compression.transfer_loss import transferred
from qc3d_addon.solver.errors import ReconstructionError
from qc3d_addon.solver.maps.boundary_conditions import Conditions
from qc3d_addon.solver.maps.mapping import Mapping

from ..drawing.cubes import draw_cube
from . import shapes
from .caption import Caption
from .shapes import Pose

matplotlib.use("Agg")
from matplotlib import pyplot

_MODES = 400  # computing all modes of a mesh would take too long
_SHOWN = 60  # modes in the pictures of the cube
_COUNTS = (1, 2, 4, 8, 16, 30, 60, 120, 240, 400)
_FITTED_COUNTS = (4, 16, 60, 240)  # fewer, because each needs an optimization
_WINDOW = 15  # modes in the moving average of the spectra
_CHANNELS = ("xx", "xy", "xz", "yy", "yz", "zz")
_EXACTLY = 1e-9  # a quantization step so small that rounding does not matter
_LINES = {"coordinates": "k--o", "published": "C1-o", "logarithm": "C0-o", "fitted": "C2-s"}
_LABELS = {
    "coordinates": "coordinates",
    "published": "published: P",
    "logarithm": "logarithm: log P",
    "fitted": "fitted: nearest map, equal weights (ours)",
}
_SCHEMES: tuple[Scheme, ...] = ("published", "logarithm", "fitted")


class Experiment:
    """One map and everything that its three figures need, computed once.

    Parameters
    ----------
    pose : Pose
        The map carries the first shape of this pose onto the second.
    data : Path, optional
        Folder of the shapes, if they are not from a demo file.
    """

    def __init__(self, pose: Pose, data: Path | None) -> None:
        self.pose = pose
        fitted = shapes.fitted(shapes.read(pose, data))
        self.mapping = Mapping(fitted.mesh, fitted.mapped)
        self.modes = min(_MODES, len(fitted.mesh.points) - 2)
        moved = fitted.mapped - fitted.mesh.points
        self.reference = float((moved**2).sum(axis=1).mean())

    @cached_property
    def codecs(self) -> dict[Scheme, Codec]:
        """The codec of each scheme."""
        mesh = self.mapping.mesh
        first = Codec(mesh, self.modes, "published")
        return {
            "published": first,
            "logarithm": Codec(mesh, self.modes, "logarithm", known=first.spectrum),
            "fitted": Codec(mesh, self.modes, "fitted"),
        }

    def restored(self, scheme: Scheme, modes: int) -> Mapping | None:
        """The map restored from its first modes without quantization; None if the truncated form has no map."""
        codec = self.codecs[scheme]
        targets = self.mapping.values[None]
        try:
            _, rebuilt = codec.rounded(targets, codec.coefficients(targets, modes), _EXACTLY)
        except ReconstructionError:
            return None
        return Mapping(self.mapping.mesh, rebuilt[0])

    def transferred(self, scheme: Scheme) -> Mapping | None:
        """The map after the transfer from tetrahedra to vertices and back, with all modes kept."""
        return transferred(self.mapping, scheme, Conditions.sliding_cube(self.mapping.mesh))

    def coordinates(self, modes: int) -> Floats:
        """(N, 3) the map whose displacements are truncated to their first modes, for comparison."""
        mesh = self.mapping.mesh
        basis = self.codecs["published"].spectrum.modes[:, :modes]
        weighted = Transfer(mesh).vertex_volumes[:, None] * (self.mapping.values - mesh.points)
        return np.asarray(mesh.points + basis @ (basis.T @ weighted))

    def error(self, values: Floats) -> float:
        """Mean square distance of values (N, 3) from the map, squared cube units."""
        return float(((values - self.mapping.values) ** 2).sum(axis=1).mean())


def draw_cubes(number: str, experiment: Experiment, file: BinaryIO) -> Caption:
    """Draw the cube's faces after the map, and after truncation of its coordinates and of its representation."""
    mapping, modes = experiment.mapping, min(_SHOWN, experiment.modes)
    mesh = mapping.mesh
    coordinates = experiment.coordinates(modes)
    restored = experiment.restored("logarithm", modes)
    assert restored is not None
    figure, panels = pyplot.subplots(2, 3, figsize=(11, 7.4), layout="constrained")
    for column, values, title in (
        (panels[:, 0], mapping.values, "the map"),
        (panels[:, 1], coordinates, f"coordinates, {modes} modes"),
        (panels[:, 2], restored.values, f"representation (log P), {modes} modes"),
    ):
        draw_cube(column[0], mesh, values)
        draw_cube(column[1], mesh, values, behind=True)
        column[0].set_title(title)
    figure.savefig(file, dpi=100)
    pyplot.close(figure)
    held = mesh.on_cube_face
    moved, kept = (float(np.abs(values - mesh.points)[held].max()) for values in (coordinates, restored.values))
    folds = Mapping(mesh, coordinates).folds
    return Caption(
        number,
        f"{experiment.pose.label}: the cube after {modes} modes of coordinates and of the representation",
        "Compressed coordinates move the cube's boundary; the compressed representation keeps it.",
        f"coordinates leave the faces by up to {moved:.2g} and fold {folds} of {len(mesh.tets)} tetrahedra; "
        f"the representation leaves them by {kept:.2g} and folds {restored.folds}. Mean square error: coordinates "
        f"{experiment.error(coordinates):.2g}, representation {experiment.error(restored.values):.2g}.",
        "Yes." if kept == 0.0 < moved else "No.",
    )


def draw_spectrum(number: str, experiment: Experiment, file: BinaryIO) -> Caption:
    """Draw the magnitude of the six channels' coefficients by mode."""
    codec, mesh = experiment.codecs["published"], experiment.mapping.mesh
    coefficients = np.abs(codec.projected(experiment.mapping, experiment.modes))
    figure, panels = pyplot.subplots(2, 3, figsize=(11, 5.4), sharex=True, sharey=True, layout="constrained")
    window = np.ones(_WINDOW)
    for axes, name, channel in zip(panels.ravel(), _CHANNELS, coefficients.T, strict=True):
        modes = np.arange(1, len(channel) + 1)
        axes.semilogy(modes, np.maximum(channel, 1e-12), ".", markersize=2.5, color="0.6")
        inner = channel[1:]  # the constant mode, which contains the identity, is not averaged with the others
        mean = np.sqrt(np.convolve(inner**2, window, "same") / np.convolve(np.ones_like(inner), window, "same"))
        axes.semilogy(modes[1:], np.maximum(mean, 1e-12), color="C0", linewidth=1.5)
        axes.set_title(name, fontsize=10)
        axes.set_ylim(max(coefficients[1:].max() * 1e-4, 1e-12), max(coefficients.max() * 2.0, 1e-11))
    figure.supxlabel("mode")
    figure.supylabel(f"size of the coefficient; blue: root mean square of {_WINDOW}")
    figure.savefig(file, dpi=100)
    pyplot.close(figure)
    # Without the constant mode, which contains the identity.
    energy = (coefficients[1:] ** 2).sum(axis=1)
    tenth = max(1, len(energy) // 10)
    share = float(energy[:tenth].sum() / energy.sum())
    transfer = Transfer(mesh)
    at_vertices = transfer.to_vertices @ (experiment.mapping.stretch - np.eye(3)).reshape(-1, 9)
    every = float((transfer.vertex_volumes[:, None] * at_vertices**2).sum())
    identity = codec.projected(Mapping(mesh, mesh.points), experiment.modes)
    caught = float(((codec.projected(experiment.mapping, experiment.modes) - identity) ** 2).sum()) / every
    return Caption(
        number,
        f"{experiment.pose.label}: spectra of the six channels",
        "The spectra are concentrated at low frequencies.",
        f"of the energy in {experiment.modes} modes, the constant one left out, the lowest tenth has {share:.0%}; all "
        f"of them have {caught:.0%} of what the vertices have of P − I.",
        "Yes."
        if share > 0.8
        else "In part: low modes are larger, but much is spread over the others."
        if share > 0.3
        else "No.",
    )


def draw_errors(number: str, experiment: Experiment, file: BinaryIO) -> Caption:
    """Draw the mean square error by the number of modes, and that between source and target for comparison."""
    every = [count for count in _COUNTS if count <= experiment.modes]
    counts: dict[str, list[int]] = {"coordinates": every, "published": every, "logarithm": every}
    counts["fitted"] = [count for count in _FITTED_COUNTS if count <= experiment.modes]
    reached = {"coordinates": [experiment.error(experiment.coordinates(count)) for count in every]}
    transfers, lost = [], 0
    for scheme in _SCHEMES:
        restored = [experiment.restored(scheme, count) for count in counts[scheme]]
        lost += sum(found is None for found in restored)
        reached[scheme] = [np.nan if found is None else experiment.error(found.values) for found in restored]
        transfers.append(_part_of(experiment, experiment.transferred(scheme)))
    figure, axes = pyplot.subplots(figsize=(9, 4.8), layout="constrained")
    for label, errors in reached.items():
        axes.loglog(counts[label], errors, _LINES[label], markersize=4, label=_LABELS[label])
    axes.axhline(experiment.reference, color="0.4", linewidth=1.0, label="source to target")
    axes.axhline(transfers[0] * experiment.reference, color="C1", linestyle=":", label="published, transfer alone")
    axes.set_xlabel("modes")
    axes.set_ylabel("mean square error, cube units")
    axes.legend(fontsize=9)
    figure.savefig(file, dpi=100)
    pyplot.close(figure)
    told = ", ".join(
        f"{label} {reached[label][-1] / experiment.reference:.2%} with {counts[label][-1]} modes" for label in reached
    )
    few = max(count for count in every if count <= max(every[-1] // 4, 1))
    growth = reached["published"][every.index(few)] / reached["published"][-1]
    without = f"; {lost} truncations had no map" if lost else ""
    return Caption(
        number,
        f"{experiment.pose.label}: error by the number of modes",
        "The error is flat until few modes are left.",
        f"of the mean square error between source and target there is left: {told}{without}. The transfer between "
        f"tetrahedra and vertices alone, all modes kept, leaves {transfers[0]:.2%} (published), {transfers[1]:.2%} "
        f"(logarithm), {transfers[2]:.2%} (fitted: nearest vertex values). From {every[-1]} to {few} modes the "
        f"published scheme's error grows by a factor of {growth:.2g}.",
        "Yes." if growth < 1.1 else "In part: it grows slowly." if growth < 2.0 else "No: it grows all the way.",
    )


def _part_of(experiment: Experiment, restored: Mapping | None) -> float:
    """Mean square error relative to that between source and target; NaN without a map."""
    return np.nan if restored is None else experiment.error(restored.values) / experiment.reference
