# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 8 to 13: two maps compressed by their lowest modes, each in three figures."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

import matplotlib
import numpy as np

from ..figures.cubes import draw_cube
from ..solver.compression import Codec, Scheme
from ..solver.errors import ReconstructionError
from ..solver.mapping import Mapping
from ..solver.spectral import Transfer
from ..solver.tetmesh import Floats
from . import shapes
from .caption import Caption
from .shapes import Pose

matplotlib.use("Agg")
from matplotlib import pyplot

_MODES = 400
_SHOWN = 60  # modes in the pictures of the cube
_COUNTS = (1, 2, 4, 8, 16, 30, 60, 120, 240, 400)
_CHANNELS = ("xx", "xy", "xz", "yy", "yz", "zz")
_EXACTLY = 1e-12  # a step so small that nothing is rounded
_SCHEMES: tuple[Scheme, ...] = ("published", "logarithm", "fitted")


class Experiment:
    """One map, and what its figures need, computed once.

    Parameters
    ----------
    pose : Pose
        The shapes that the map carries onto each other.
    data : Path, optional
        The folder of the shapes, where they are no demo file.
    """

    def __init__(self, pose: Pose, data: Path | None) -> None:
        self.pose = pose
        prepared = shapes.fitted(shapes.read(pose, data))
        self.mapping = Mapping(prepared.mesh, prepared.mapped)
        self.modes = min(_MODES, len(prepared.mesh.points) - 2)
        moved = prepared.mapped - prepared.mesh.points
        self.reference = float((moved**2).sum(axis=1).mean())

    @cached_property
    def codecs(self) -> dict[Scheme, Codec]:
        """A codec for each scheme; all have the same modes."""
        first = Codec(self.mapping.mesh, self.modes, "published")
        return {scheme: first.with_scheme(scheme) for scheme in _SCHEMES}

    def restored(self, scheme: Scheme, modes: int) -> Mapping | None:
        """The map from its first modes, nothing rounded; None where the truncated representation has no map."""
        codec = self.codecs[scheme]
        try:
            return codec.restore(codec.compress(self.mapping, modes, _EXACTLY))
        except ReconstructionError:
            return None

    def coordinates(self, modes: int) -> Floats:
        """(N, 3) the map's displacements from their first modes: what the representation is compared with."""
        mesh = self.mapping.mesh
        basis = self.codecs["published"].spectrum.modes[:, :modes]
        weighted = Transfer(mesh).vertex_volumes[:, None] * (self.mapping.values - mesh.points)
        return np.asarray(mesh.points + basis @ (basis.T @ weighted))

    def error(self, values: Floats) -> float:
        """Mean square distance from the map."""
        return float(((values - self.mapping.values) ** 2).sum(axis=1).mean())


def draw_cubes(number: str, experiment: Experiment, path: Path) -> Caption:
    """The cube's faces after the map, and after its coordinates and its representation were cut off."""
    mapping, modes = experiment.mapping, min(_SHOWN, experiment.modes)
    mesh = mapping.mesh
    coordinates = experiment.coordinates(modes)
    restored = experiment.restored("logarithm", modes)
    assert restored is not None
    figure, panels = pyplot.subplots(1, 3, figsize=(13, 4.8), layout="constrained")
    for axes, values, title in (
        (panels[0], mapping.values, "the map"),
        (panels[1], coordinates, f"coordinates, {modes} modes"),
        (panels[2], restored.values, f"representation, {modes} modes"),
    ):
        draw_cube(axes, mesh, values)
        axes.set_title(title)
    figure.savefig(path, dpi=100)
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


def draw_spectrum(number: str, experiment: Experiment, path: Path) -> Caption:
    """Size of the six channels' coefficients, by mode."""
    coefficients = np.abs(experiment.codecs["published"].coefficients(experiment.mapping, experiment.modes))
    figure, axes = pyplot.subplots(figsize=(9, 4.5), layout="constrained")
    for name, channel in zip(_CHANNELS, coefficients.T, strict=True):
        axes.semilogy(np.arange(1, len(channel) + 1), np.maximum(channel, 1e-12), linewidth=0.7, label=name)
    axes.set_xlabel("mode")
    axes.set_ylabel("size of the coefficient")
    axes.legend(ncols=6)
    figure.savefig(path, dpi=100)
    pyplot.close(figure)
    # Without the constant mode, which holds the identity.
    energy = (coefficients[1:] ** 2).sum(axis=1)
    tenth = max(1, len(energy) // 10)
    share = float(energy[:tenth].sum() / energy.sum())
    mesh, transfer = experiment.mapping.mesh, Transfer(experiment.mapping.mesh)
    stretch = experiment.mapping.stretch - np.eye(3)
    at_vertices = transfer.to_vertices @ stretch.reshape(-1, 9)
    caught = (coefficients**2).sum() - 3.0 * mesh.volumes.sum()
    every = float((transfer.vertex_volumes[:, None] * at_vertices**2).sum())
    return Caption(
        number,
        f"{experiment.pose.label}: spectra of the six channels",
        "The spectra are concentrated at low frequencies.",
        f"of the energy in {experiment.modes} modes, the constant one left out, the lowest tenth has {share:.0%}; all "
        f"of them have about {min(max(caught / every, 0.0), 1.0):.0%} of what the vertices have of P − I.",
        "Yes."
        if share > 0.8
        else "In part: low modes are larger, but much is spread over the others."
        if share > 0.3
        else "No.",
    )


def draw_errors(number: str, experiment: Experiment, path: Path) -> Caption:
    """Mean square error by the number of modes, with that between source and target for comparison."""
    counts = [count for count in _COUNTS if count <= experiment.modes]
    figure, axes = pyplot.subplots(figsize=(9, 4.8), layout="constrained")
    reached: dict[str, list[float]] = {"coordinates": [experiment.error(experiment.coordinates(k)) for k in counts]}
    lost = 0
    for scheme in _SCHEMES:
        restored = [experiment.restored(scheme, count) for count in counts]
        lost += sum(found is None for found in restored)
        reached[scheme] = [np.nan if found is None else experiment.error(found.values) for found in restored]
    for label, errors in reached.items():
        axes.loglog(counts, errors, "--o" if label == "coordinates" else "-o", markersize=4, label=label)
    axes.axhline(experiment.reference, color="0.4", linewidth=1.0, label="source to target")
    axes.set_xlabel("modes")
    axes.set_ylabel("mean square error, cube units")
    axes.legend()
    figure.savefig(path, dpi=100)
    pyplot.close(figure)
    parts = {label: errors[-1] / experiment.reference for label, errors in reached.items()}
    flat = reached["published"][counts.index(60)] / reached["published"][-1] if 60 in counts else np.inf
    told = ", ".join(f"{label} {part:.1%}" for label, part in parts.items())
    without = f"; {lost} truncations had no map" if lost else ""
    return Caption(
        number,
        f"{experiment.pose.label}: error by the number of modes",
        "The error is flat until few modes are left.",
        f"of the error between source and target, {counts[-1]} modes leave: {told}{without}. From {counts[-1]} to 60 "
        f"modes the published scheme's error grows by a factor of {flat:.2g}.",
        "Yes." if flat < 1.5 else "In part: it grows slowly." if flat < 4.0 else "No: it grows all the way.",
    )
