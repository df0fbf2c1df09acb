# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Figures 8 to 13 (section 6.2): maps compressed by their lowest modes, three figures for each two of them."""

from __future__ import annotations

from textwrap import fill
from typing import BinaryIO

import matplotlib
import numpy as np

from qc3d_addon.solver.arrays import Floats

from ..drawing.cubes import draw_cube, draw_open_cube
from .caption import Caption, table
from .experiment import FITTED_COUNTS, NUMBERS, Experiment, Way

matplotlib.use("Agg")
from matplotlib import pyplot
from matplotlib.axes import Axes

_SHOWN = 60  # modes of the representation in the pictures of the cube
_COUNTS = (1, 2, 4, 8, 16, 30, 60, 120, 240, 500, 1000, 2000)
_NARROW = 34  # characters of a line in a figure
_WINDOW = 15  # modes in the moving average of the spectra
_CHANNELS = ("xx", "xy", "xz", "yy", "yz", "zz")
_LINES: dict[Way, str] = {
    "coordinates": "k--o",
    "displacements": "C7--o",
    "put back": "C4--o",
    "published": "C1-o",
    "logarithm": "C0-o",
    "fitted": "C2-s",
}
_LABELS: dict[Way, str] = {
    "coordinates": "coordinates",
    "displacements": "displacements",
    "put back": "displacements, boundary put back",
    "published": "representation, published: P",
    "logarithm": "representation: log P",
    "fitted": "representation: nearest map (ours)",
}
_EQUAL = 6 * _SHOWN  # numbers at which ways are compared at equal storage
_FLAT = 1.5  # a mean square error that grows by less than half down to a tenth of the modes is called flat


def draw_cubes(number: str, experiments: list[Experiment], file: BinaryIO) -> Caption:
    """Draw boundary and inside of the cube after the maps and after their truncations, at equal storage."""
    figure, panels = pyplot.subplots(
        2 * len(experiments), 4, figsize=(15, 7.2 * len(experiments)), layout="constrained", squeeze=False
    )
    rows: list[list[str]] = []
    kept_everywhere, wins = True, []
    for row, experiment in enumerate(experiments):
        few = min(_SHOWN, experiment.modes // 2)
        published = experiment.restored("published", few)
        way: Way = "logarithm" if published is None else "published"
        shown = {
            "the map": experiment.mapping.values,
            f"coordinates\n{2 * few} modes, {6 * few} numbers": _restored(experiment, "coordinates", 2 * few),
            f"displacements\n{2 * few} modes, {6 * few} numbers": _restored(experiment, "displacements", 2 * few),
            f"{'log P' if published is None else 'P'}\n{few} modes, {6 * few} numbers": _restored(experiment, way, few),
        }
        for column, (title, values) in enumerate(shown.items()):
            draw_cube(panels[2 * row, column], experiment.mesh, values)
            draw_open_cube(panels[2 * row + 1, column], experiment.mesh, values)
            panels[2 * row, column].set_title(title)
        panels[2 * row, 0].set_ylabel(f"{_narrow(experiment.title)}\nboundary")
        panels[2 * row + 1, 0].set_ylabel("inside: the planes z = ¼, ½, ¾")
        measured: list[tuple[Way, int]] = [
            ("coordinates", few),
            ("displacements", few),
            ("coordinates", 2 * few),
            ("displacements", 2 * few),
            ("put back", 2 * few),
            (way, few),
        ]
        found = [_restored(experiment, name, count) for name, count in measured]
        for (name, count), values in zip(measured, found, strict=True):
            cells = [experiment.title, _LABELS[name], str(count), str(NUMBERS[name] * count)]
            rows.append(cells + _errors(experiment, values))
        coordinates, _, put_back, representation = found[2:]
        kept_everywhere &= _leaving(experiment, representation) == 0.0 < _leaving(experiment, coordinates)
        inside = ~experiment.on_boundary
        wins.append(
            f"{experiment.title}: representation {experiment.error(representation, inside):.2g}, coordinates "
            f"{experiment.error(coordinates, inside):.2g}, displacements with the boundary put back "
            f"{experiment.error(put_back, inside):.2g}"
        )
    figure.savefig(file, dpi=80)
    pyplot.close(figure)
    return Caption(
        number,
        "; ".join(experiment.title for experiment in experiments)
        + ": boundary and inside after truncation, at equal storage",
        "Compressed coordinates move the boundary of the cube; the compressed representation keeps it.",
        "Mean square errors in squared sides of the cube, and how far the faces are left."
        + table(["map", "what", "modes", "numbers", "boundary", "inside", "faces left by", "folds"], rows),
        f"{'Yes' if kept_everywhere else 'No'}, for the boundary. The inside, at equal storage: {'; '.join(wins)}.",
    )


def _restored(experiment: Experiment, way: Way, modes: int) -> Floats:
    values = experiment.restored(way, modes)
    assert values is not None  # only P itself, cut off, may be no representation
    return values


def _errors(experiment: Experiment, values: Floats) -> list[str]:
    """Cells of a table: errors at the boundary and inside, how far the faces are left, and folds."""
    errors = [experiment.error(values, at) for at in (experiment.on_boundary, ~experiment.on_boundary)]
    return [*(f"{number:.2g}" for number in (*errors, _leaving(experiment, values))), str(experiment.folds(values))]


def _leaving(experiment: Experiment, values: Floats) -> float:
    """How far a map moves the cube's faces out of their planes at most."""
    return float(np.abs(values - experiment.mesh.points)[experiment.mesh.on_cube_face].max())


def draw_spectrum(number: str, experiments: list[Experiment], file: BinaryIO) -> Caption:
    """Draw the size of the coefficients of the six channels against the mode, all modes."""
    figure, panels = pyplot.subplots(
        len(experiments), 6, figsize=(17, 3.3 * len(experiments)), sharey="row", layout="constrained", squeeze=False
    )
    window, shares = np.ones(_WINDOW), []
    for row, experiment in enumerate(experiments):
        sizes = np.abs(experiment.channels)
        for axes, name, channel in zip(panels[row], _CHANNELS, sizes.T, strict=True):
            modes = np.arange(1, len(channel) + 1)
            axes.semilogy(modes, np.maximum(channel, 1e-12), ".", markersize=2, color="0.65")
            inner = channel[1:]  # the constant mode, which holds the identity, is a point of its own
            mean = np.sqrt(np.convolve(inner**2, window, "same") / np.convolve(np.ones_like(inner), window, "same"))
            axes.semilogy(modes[1:], np.maximum(mean, 1e-12), color="C0", linewidth=1.2)
            axes.set_title(name)
            axes.set_xlabel("mode")
        panels[row, 0].set_ylim(max(sizes[1:].max() * 1e-4, 1e-12), sizes.max() * 2.0)
        panels[row, 0].set_ylabel(f"{_narrow(experiment.title)}\nsize of the coefficient")
        weights = np.where([name[0] == name[1] for name in _CHANNELS], 1.0, 2.0)
        energy = (sizes[1:] ** 2) @ weights
        tenth = max(1, len(energy) // 10)
        shares.append(float(energy[:tenth].sum() / energy.sum()))
    figure.savefig(file, dpi=90)
    pyplot.close(figure)
    measured = "; ".join(
        f"{experiment.title}, {experiment.modes} modes: {share:.0%}"
        for experiment, share in zip(experiments, shares, strict=True)
    )
    verdicts = "; ".join(
        f"{experiment.title}: {'yes' if share > 0.8 else 'in part' if share > 0.3 else 'no'}"
        for experiment, share in zip(experiments, shares, strict=True)
    )
    return Caption(
        number,
        "spectra of the six channels of P, all modes",
        "The spectra are concentrated at low frequencies.",
        f"Share that the lowest tenth of the modes has of the energy of all, without the constant mode: {measured}. "
        "xy, xz and yz are drawn as they are; since each stands twice in P, their squares count twice in the energy, "
        f"which is as if they were multiplied by √2. Blue: root mean square of {_WINDOW} modes.",
        f"{_overall([share > 0.8 for share in shares])}. {verdicts}.",
    )


def draw_errors(number: str, experiments: list[Experiment], file: BinaryIO) -> Caption:
    """Draw the mean square error against the number of modes and against how many numbers are stored."""
    figure, panels = pyplot.subplots(
        len(experiments), 2, figsize=(13, 4.6 * len(experiments)), sharey="row", layout="constrained", squeeze=False
    )
    rows: list[list[str]] = []
    verdicts, flat = [], []
    for row, experiment in enumerate(experiments):
        every = [*(count for count in _COUNTS if count < experiment.modes), experiment.modes]
        counts: dict[Way, list[int]] = dict.fromkeys(_LABELS, every)
        counts["fitted"] = [count for count in FITTED_COUNTS if count <= experiment.modes]
        reached = {way: _parts(experiment, way, found) for way, found in counts.items()}
        transfer = experiment.transfer_part("published")
        for axes, numbers, label in ((panels[row, 0], False, "modes"), (panels[row, 1], True, "numbers stored")):
            _draw_lines(axes, counts, reached, numbers)
            axes.axhline(1.0, color="0.4", linewidth=1.0, label="source to target")
            axes.axhline(transfer, color="C1", linestyle=":", label="published, transfer alone")
            axes.set_xlabel(label)
            axes.set_title(f"{_narrow(experiment.title)}\nby {label}", fontsize=10)
        panels[row, 0].set_ylabel("mean square error, of that from source to target")
        panels[row, 0].set_ylim(1e-5, None)
        panels[row, 1].legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
        for way, found in reached.items():
            at = [_at(counts[way], found, count) for count in (_SHOWN // 2, _SHOWN, _EQUAL // NUMBERS[way])]
            whole = found[-1] if counts[way][-1] == experiment.modes else np.nan
            parts = [f"{part:.2%}" if np.isfinite(part) else "–" for part in (whole, *at)]
            rows.append([experiment.title, _LABELS[way], *parts])
        rows.append([experiment.title, "published, transfer alone", f"{transfer:.2%}", "–", "–", "–"])
        tenth = _at(every, reached["published"], experiment.modes // 10)
        growth = tenth / reached["published"][-1]
        flat.append(bool(growth < _FLAT))
        verdicts.append(f"{experiment.title}: from all modes to a tenth the error grows {growth:.2g} times")
    figure.savefig(file, dpi=90)
    pyplot.close(figure)
    return Caption(
        number,
        "error by the number of modes, and by how many numbers are stored",
        "The error stays about the same until few modes are left.",
        "What is left of the mean square error between source and target."
        + table(["map", "what", "all modes", f"{_SHOWN // 2}", f"{_SHOWN}", f"{_EQUAL} numbers"], rows),
        f"{_overall(flat)}. {'; '.join(verdicts)}.",
    )


def _parts(experiment: Experiment, way: Way, counts: list[int]) -> list[float]:
    """Mean square errors over that between source and target, NaN where a truncation has no map."""
    restored = (experiment.restored(way, count) for count in counts)
    return [np.nan if found is None else experiment.error(found) / experiment.reference for found in restored]


def _draw_lines(axes: Axes, counts: dict[Way, list[int]], reached: dict[Way, list[float]], is_storage: bool) -> None:
    for way, parts in reached.items():
        places = np.array(counts[way]) * (NUMBERS[way] if is_storage else 1)
        axes.loglog(places, np.maximum(parts, 1e-30), _LINES[way], markersize=3.5, label=_LABELS[way])


def _at(counts: list[int], parts: list[float], count: int) -> float:
    """The value at a number of modes, between those that were computed by a power law."""
    return float(np.exp(np.interp(np.log(max(count, 1)), np.log(counts), np.log(np.maximum(parts, 1e-300)))))


def _narrow(title: str) -> str:
    return fill(title, _NARROW)


def _overall(holds: list[bool]) -> str:
    return "Yes" if all(holds) else "In part" if any(holds) else "No"
