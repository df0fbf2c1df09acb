# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""In-betweens in USD files: written into what Blender exports, read where Blender drops them.

They are attributes ``inbetweens:NAME`` with a weight, beside the offsets of their blend shape, and readers go straight
from one to the next (UsdSkel, *Inbetweens*).
"""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Callable, Iterator, Sequence
from importlib.machinery import PathFinder
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import bpy
import numpy as np
from numpy.typing import NDArray

from ...solver.errors import InputError, reason
from .in_betweens import InBetweens


class ReadShape(NamedTuple):
    """A blend shape of a file with its in-betweens.

    Parameters
    ----------
    name : str
    places : (p,)
        Weights of its in-betweens, between 0 and 1, increasing.
    offsets : (p + 1, n, 3)
        Of the in-betweens, and of the shape itself.
    """

    name: str
    places: NDArray[np.float64]
    offsets: NDArray[np.float64]


def add_in_betweens(path: Path, names: Sequence[str], vertices: int, found: Sequence[InBetweens]) -> None:
    """Write in-betweens into a file that Blender has exported.

    Parameters
    ----------
    path : Path
    names : sequence of str
        Of all shape keys of the exported mesh but the first, in their order.
    vertices : int
        Of the mesh.
    found : sequence of InBetweens

    Raises
    ------
    InputError
        If the file cannot be read or written, or has no mesh with these shapes.
    """
    usd, skel = _pxr("Usd"), _pxr("UsdSkel")
    stage = _opened(usd, path)
    made = frozenset().union(*(key.made for key in found))
    gone: set[str] = set()
    meshes = [mesh for mesh in _meshes(stage) if _has(skel, mesh, len(names), vertices)]
    if not meshes:
        raise InputError(f"{path.name} has no mesh with {len(names)} shapes of {vertices} vertices; export it again.")
    for mesh in meshes:
        tokens, shapes = _bound(skel, mesh)
        for key in found:
            _write_shape(skel.BlendShape(shapes[names.index(key.key)]), key)
        kept = [number for number, name in enumerate(names) if name not in made]
        gone |= {tokens[number] for number, name in enumerate(names) if name in made}
        for number in set(range(len(names))) - set(kept):
            stage.RemovePrim(shapes[number].GetPath())
        binding = skel.BindingAPI(mesh)
        binding.GetBlendShapesAttr().Set([tokens[number] for number in kept])
        binding.GetBlendShapeTargetsRel().SetTargets([shapes[number].GetPath() for number in kept])
    for prim in stage.Traverse():
        if prim.IsA(skel.Animation):
            _leave_out(skel.Animation(prim), gone)
    try:
        is_saved = stage.GetRootLayer().Save()
    except Exception as error:  # pxr's own kind
        raise InputError(f"{path.name} cannot be written: {reason(error)}; choose another place.") from error
    if not is_saved:
        raise InputError(f"{path.name} cannot be written; choose another place.")


def read_in_betweens(path: Path, vertices: int) -> list[ReadShape]:
    """Blend shapes that have in-betweens, of the meshes in a file that have so many vertices.

    Raises
    ------
    InputError
        If the file cannot be read, has no such mesh, or two, or what it holds makes no sense.
    """
    usd, skel = _pxr("Usd"), _pxr("UsdSkel")
    stage = _opened(usd, path)  # what is in it lives no longer than this
    meshes = [
        prim
        for prim in _meshes(stage)
        if len(_pxr("UsdGeom").Mesh(prim).GetPointsAttr().Get() or ()) == vertices and _bound(skel, prim)[1]
    ]
    if len(meshes) != 1:
        many = "no mesh" if not meshes else f"{len(meshes)} meshes"
        raise InputError(f"{path.name} has {many} of {vertices} vertices with blend shapes; choose the mesh it is of.")
    tokens, prims = _bound(skel, meshes[0])
    shapes = [_read_shape(skel.BlendShape(prim), name, vertices) for name, prim in zip(tokens, prims, strict=True)]
    return [shape for shape in shapes if len(shape.places)]


def _write_shape(shape: Any, key: InBetweens) -> None:  # noqa: ANN401 - of pxr, which has no types
    """Put in-betweens beside the offsets of a blend shape: for the same points, or for all where one is missing."""
    indices = np.array(shape.GetPointIndicesAttr().Get() or (), dtype=np.int64)
    if len(indices):
        moved = np.flatnonzero((key.offsets != 0.0).any(axis=(0, 2)))
        if len(np.setdiff1d(moved, indices)):
            offsets = np.zeros((key.offsets.shape[1], 3), dtype=np.float32)
            offsets[indices] = np.array(shape.GetOffsetsAttr().Get())
            shape.GetOffsetsAttr().Set(_vectors(offsets))
            indices = np.arange(key.offsets.shape[1])
            shape.GetPointIndicesAttr().Set(_pxr("Vt").IntArray.FromNumpy(indices.astype(np.int32)))
    for place, offsets in zip(key.places.tolist(), key.offsets, strict=True):
        between = shape.CreateInbetween(_token(key.key, place))
        between.SetWeight(place)
        between.SetOffsets(_vectors(offsets[indices] if len(indices) else offsets))


def safe_name(name: str) -> str:
    """A name as USD allows it, which is what Blender makes of names of shape keys."""
    safe = "".join(mark if mark.isascii() and mark.isalnum() else "_" for mark in name)
    return f"_{safe}" if safe[:1].isdigit() else safe


def _token(name: str, place: float) -> str:
    """A name for an in-between, with its place in it as riggers write it."""
    return f"{safe_name(name)}_{format(100.0 * place, '.4g').replace('.', '_')}"


def _leave_out(animation: Any, gone: set[str]) -> None:  # noqa: ANN401
    """Take blend shapes out of an animation, from all its moments."""
    names = list(animation.GetBlendShapesAttr().Get() or ())
    kept = [number for number, name in enumerate(names) if name not in gone]
    if len(kept) == len(names):
        return
    attribute = animation.GetBlendShapeWeightsAttr()
    for time in attribute.GetTimeSamples() or [None]:
        values = attribute.Get() if time is None else attribute.Get(time)
        if values is not None:
            chosen = [values[number] for number in kept]
            attribute.Set(chosen) if time is None else attribute.Set(chosen, time)
    animation.GetBlendShapesAttr().Set([names[number] for number in kept])


def _read_shape(shape: Any, name: str, vertices: int) -> ReadShape:  # noqa: ANN401
    indices = np.array(shape.GetPointIndicesAttr().Get() or range(vertices), dtype=np.int64)
    by_place: dict[float, NDArray[np.float64]] = {}
    for between in shape.GetInbetweens():
        place = between.GetWeight()
        if place is not None and 0.0 < place < 1.0:
            by_place[float(place)] = _dense(between.GetOffsets(), indices, vertices, name)
    places = sorted(by_place)
    whole = _dense(shape.GetOffsetsAttr().Get(), indices, vertices, name)
    return ReadShape(name, np.array(places), np.stack([by_place[place] for place in places] + [whole]))


def _dense(values: object, indices: NDArray[np.int64], vertices: int, name: str) -> NDArray[np.float64]:
    offsets = np.array([] if values is None else values, dtype=np.float64).reshape(-1, 3)
    in_range = not len(indices) or (indices.min() >= 0 and indices.max() < vertices)
    if len(offsets) != len(indices) or not in_range or not np.isfinite(offsets).all():
        raise InputError(f"The blend shape '{name}' does not belong to its mesh; export the file again.")
    dense = np.zeros((vertices, 3))
    dense[indices] = offsets
    return dense


def _meshes(stage: Any) -> Iterator[Any]:  # noqa: ANN401
    geometry = _pxr("UsdGeom")
    return (prim for prim in stage.Traverse() if prim.IsA(geometry.Mesh))


def _has(skel: ModuleType, mesh: Any, shapes: int, vertices: int) -> bool:  # noqa: ANN401
    points = _pxr("UsdGeom").Mesh(mesh).GetPointsAttr().Get() or ()
    return len(points) == vertices and len(_bound(skel, mesh)[1]) == shapes


def _bound(skel: ModuleType, mesh: Any) -> tuple[list[str], list[Any]]:  # noqa: ANN401
    """Names and prims of the blend shapes of a mesh."""
    binding = skel.BindingAPI(mesh)
    tokens = list(binding.GetBlendShapesAttr().Get() or ())
    targets = binding.GetBlendShapeTargetsRel().GetTargets()
    prims = [mesh.GetStage().GetPrimAtPath(target) for target in targets]
    return (tokens, prims) if len(tokens) == len(prims) else ([], [])


def _vectors(values: NDArray[np.float64] | NDArray[np.float32]) -> Any:  # noqa: ANN401
    return _pxr("Vt").Vec3fArray.FromNumpy(np.ascontiguousarray(values, dtype=np.float32))


def _opened(usd: ModuleType, path: Path) -> Any:  # noqa: ANN401
    try:
        return usd.Stage.Open(str(path), usd.Stage.LoadAll)
    except Exception as error:  # pxr's own kind, which every version calls another name
        raise InputError(f"{path} is no USD file that can be read: {reason(error)}; export it again.") from error


def _pxr(module: str) -> ModuleType:
    """A module of USD's own Python package, which comes with Blender."""
    try:
        return importlib.import_module(f"pxr.{module}")
    except ModuleNotFoundError:
        pass
    # Blender as a Python module has it in a folder of its own, which nothing is imported from.
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    # The stubs do not know this function of Blender's.
    of_blender: Callable[[str], str] = vars(bpy.utils)["system_resource"]
    folder = Path(of_blender('PYTHON'), "lib", version, "site-packages")
    spec = PathFinder.find_spec("pxr", [str(folder)])
    if spec is None or spec.loader is None:
        raise InputError("This Blender comes without USD's Python package; choose FBX, or another Blender.")
    package = importlib.util.module_from_spec(spec)
    sys.modules["pxr"] = package
    spec.loader.exec_module(package)
    return importlib.import_module(f"pxr.{module}")
