# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What other ways need for displacements with the same root mean square error: a few lines of numpy, and libraries.

None of these sizes has a header, a checksum or the number that a step stands for.
"""

from __future__ import annotations

import bz2
import importlib
import io
import lzma
import zlib
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
# Makes bytes of displacements and says what comes back of them, for a number that is larger the coarser it is.
Coder = Callable[[float], tuple[int, Array]]

# Steps and bounds are looked for between these multiples of the error, to better than a hundredth.
_FINEST, _COARSEST, _HALVINGS = 0.05, 200.0, 11


class Rivals:
    """Other ways to tell displacements.

    Parameters
    ----------
    points : (n, 3)
        Where they belong.
    displacements : (F, n, 3)
    unit : float
        What errors are relative to.
    """

    def __init__(self, points: Array, displacements: Array, unit: float) -> None:
        self._moved, self._unit = displacements, unit
        places = np.floor(2**20 * 0.999 * (points - points.min(axis=0)) / np.ptp(points, axis=0).max()).astype(np.int64)
        along = sum((places[:, axis] >> bit & 1) << (3 * bit + axis) for bit in range(20) for axis in range(3))
        self._orders = (np.arange(len(points)), np.argsort(along, kind="stable"))

    def sizes(self, error: float) -> dict[str, int | None]:
        """Bytes by the name of the way; None where its library is not installed."""
        numbers = np.round(self._moved / self._largest(self._rounded, error)).astype(np.int64)
        ordered = [numbers[:, order] for order in self._orders]
        found: dict[str, int | None] = {
            "deflate, file order": len(zlib.compress(_bytes(ordered[0]), 9)),
            "Morton order + lzma": _lzma(_bytes(ordered[1])),
        }
        if len(numbers) > 1:
            changes = [np.diff(rows, n=times, axis=0, prepend=np.zeros((times, *rows.shape[1:]), dtype=np.int64))
                       for rows in ordered for times in (0, 1, 2)]  # fmt: skip
            found["time differences + lzma or bz2"] = min(_best(_bytes(rows)) for rows in changes)
            found["PCA + Morton order + lzma"] = self._pca(error)
        found["pcodec"] = _with("pcodec", lambda module: min(_pcodec(module, rows) for rows in ordered))
        found["meshoptimizer"] = _with("meshoptimizer", lambda module: min(_meshopt(module, rows) for rows in ordered))
        for name, label in (("SZ3", "SZ3"), ("Zfp", "zfp")):
            found[label] = _with("hdf5plugin", partial(self._by_filter, name, error))
        found["Draco"] = _with("DracoPy", lambda module: self._draco(module, error))
        return found

    def _error(self, restored: Array) -> float:
        squares = ((restored - self._moved) ** 2).sum(axis=2).mean(axis=1)
        return float(np.sqrt(squares.max()) / self._unit)

    def _rounded(self, step: float) -> tuple[int, Array]:
        return 0, step * np.round(self._moved / step)

    def _reached(self, coder: Coder, error: float) -> int:
        """The bytes of the coarsest code that is near enough; 0 where none is."""
        low, high, size = _FINEST * error * self._unit, _COARSEST * error * self._unit, 0
        for _ in range(_HALVINGS):
            middle = float(np.sqrt(low * high))
            made, restored = coder(middle)
            if self._error(restored) <= error:
                low, size = middle, made
            else:
                high = middle
        return size

    def _pca(self, error: float) -> int:
        """Principal components along time, as few as are smallest, rounded, and factors in single precision."""
        flat = self._moved.reshape(len(self._moved), -1)
        vectors = np.linalg.eigh(flat @ flat.T)[1][:, ::-1]
        sizes: list[int] = []
        for rank in range(1, len(flat) + 1):
            basis = vectors[:, :rank]
            rows = (basis.T @ flat).reshape(rank, *self._moved.shape[1:])
            if self._error(np.tensordot(basis, rows, axes=1)) > 0.99 * error:
                continue

            def coder(step: float, rows: Array = rows, basis: Array = basis) -> tuple[int, Array]:
                return 1, np.tensordot(basis, step * np.round(rows / step), axes=1)

            step = self._largest(coder, error)
            size = _lzma(_bytes(np.round(rows / step).astype(np.int64)[:, self._orders[1]])) + 4 * len(flat) * rank
            if sizes and size > min(sizes):
                break
            sizes.append(size)
        return min(sizes)

    def _largest(self, coder: Coder, error: float) -> float:
        """The coarsest step that is near enough."""
        low, high = _FINEST * error * self._unit, _COARSEST * error * self._unit
        for _ in range(_HALVINGS):
            middle = float(np.sqrt(low * high))
            near = self._error(coder(middle)[1]) <= error
            low, high = (middle, high) if near else (low, middle)
        return low

    def _by_filter(self, name: str, error: float, module: Any) -> int:  # noqa: ANN401 - a library
        return self._reached(partial(self._filtered, name, module), error)

    def _filtered(self, name: str, module: Any, bound: float) -> tuple[int, Array]:  # noqa: ANN401 - a library
        """By a filter of HDF5, in the better order."""
        h5py = importlib.import_module("h5py")
        choice: Any = module.SZ3(absolute=bound) if name == "SZ3" else module.Zfp(accuracy=bound)
        best: tuple[int, Array] | None = None
        for order in self._orders:
            rows = np.ascontiguousarray(self._moved[:, order])
            # The components first: neighbors in the array are then neighbors on the mesh.
            data, memory = np.ascontiguousarray(rows.transpose(0, 2, 1)), io.BytesIO()
            with h5py.File(memory, "w") as file:
                file.create_dataset("x", data=data, chunks=data.shape, **choice)
            with h5py.File(memory, "r") as file:  # what was written is read from the cache until then
                restored, size = np.asarray(file["x"][()]), int(file["x"].id.get_storage_size())
            back = np.empty_like(rows)
            back[:, order] = restored.transpose(0, 2, 1)
            if best is None or size < best[0]:
                best = size, back
        assert best is not None
        return best

    def _draco(self, module: Any, error: float) -> int:  # noqa: ANN401 - a library
        """Each displacement as a cloud of points, in the fewest bits that are near enough."""
        # Steps of more than eight times the error are never near enough.
        size = float(np.ptp(self._moved, axis=1).max())
        for bits in range(max(1, int(np.log2(size / (8.0 * error * self._unit)))), 28):
            data = [module.encode(rows.astype(np.float32), None, bits, 10, preserve_order=True) for rows in self._moved]
            restored = np.stack([np.asarray(module.decode(each).points, dtype=np.float64) for each in data])
            if self._error(restored) <= error:
                return sum(map(len, data))
        raise ValueError("Draco does not come as near")


def _bytes(numbers: Array) -> bytes:
    """Numbers (F, n, 3) as the lowest bytes of all, then the next, by component."""
    flat = numbers.transpose(0, 2, 1).ravel()
    table = ((flat << 1) ^ (flat >> 63)).astype("<u8").view(np.uint8).reshape(-1, 8)
    used = int(np.flatnonzero(table.any(axis=0)).max(initial=0)) + 1
    return np.ascontiguousarray(table[:, :used].T).tobytes()


def _lzma(data: bytes) -> int:
    sizes = []
    for bits in (0, 3):
        preset = 9 | lzma.PRESET_EXTREME
        filters = [{"id": lzma.FILTER_LZMA1, "preset": preset, "lc": bits, "lp": 0, "pb": 0}]
        sizes.append(len(lzma.compress(data, lzma.FORMAT_RAW, filters=filters)))
    return min(sizes)


def _best(data: bytes) -> int:
    return min(_lzma(data), len(bz2.compress(data)))


def _pcodec(module: Any, numbers: Array) -> int:  # noqa: ANN401 - a library
    standalone = importlib.import_module("pcodec.standalone")
    flat = np.ascontiguousarray(numbers.transpose(0, 2, 1).ravel().astype(np.int32))
    return len(standalone.simple_compress(flat, module.ChunkConfig(compression_level=12)))


def _meshopt(module: Any, numbers: Array) -> int:  # noqa: ANN401 - a library
    """Vertices of four 16-bit numbers, and the result by lzma, as its documentation advises."""
    size = 0
    for rows in numbers:
        vertices = np.zeros((len(rows), 4), dtype=np.int16)
        vertices[:, :3] = rows
        data = bytes(module.encode_vertex_buffer(vertices, len(vertices), 8))
        size += min(len(data), _lzma(data))
    return size


def _with(name: str, size: Callable[[Any], int]) -> int | None:
    try:
        module = importlib.import_module(name)
    except ImportError:
        return None
    return size(module)
