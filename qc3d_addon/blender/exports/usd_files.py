# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""In-betweens in USD files, which Blender neither exports nor imports.

They are attributes ``inbetweens:NAME`` of a blend shape, each with a weight, and are interpolated linearly (UsdSkel,
*Inbetweens*).
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
        Name of the blend shape.
    places : (p,)
        Weights of its in-betweens, increasing, in (0, 1).
    offsets : (p + 1, n, 3)
        Offsets of the in-betweens and, last, of the shape itself.
    """

    name: str
    places: NDArray[np.float64]
    offsets: NDArray[np.float64]


def add_in_betweens(path: Path, names: Sequence[str], vertices: int, found: Sequence[InBetweens]) -> None:
    """Write in-betweens into a file that Blender has exported.

    Parameters
    ----------
    path : Path
        The file, which is replaced.
    names : sequence of str
        Names of all shape keys of the exported mesh except the first, in their order.
    vertices : int
        Number of vertices of the mesh.
    found : sequence of InBetweens
        The in-betweens of each key.

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
    except Exception as error:  # an exception type of pxr
        raise InputError(f"{path.name} cannot be written: {reason(error)}; choose another place.") from error
    if not is_saved:
        raise InputError(f"{path.name} cannot be written; choose another place.")


def read_in_betweens(path: Path, vertices: int) -> list[ReadShape]:
    """Blend shapes with in-betweens of the only mesh in a file that has this number of vertices.

    Raises
    ------
    InputError
        If the file cannot be read, has none or several such meshes, or has invalid data.
    """
    usd, skel = _pxr("Usd"), _pxr("UsdSkel")
    stage = _opened(usd, path)  # prims are valid only as long as this variable
    meshes = [
        prim
        for prim in _meshes(stage)
        if len(_pxr("UsdGeom").Mesh(prim).GetPointsAttr().Get() or ()) == vertices and _bound(skel, prim)[1]
    ]
    if len(meshes) != 1:
        many = "no mesh" if not meshes else f"{len(meshes)} meshes"
        raise InputError(
            f"{path.name} has {many} of {vertices} vertices with blend shapes; select the mesh that it was made for."
        )
    tokens, prims = _bound(skel, meshes[0])
    shapes = [_read_shape(skel.BlendShape(prim), name, vertices) for name, prim in zip(tokens, prims, strict=True)]
    return [shape for shape in shapes if len(shape.places)]


def _write_shape(shape: Any, key: InBetweens) -> None:  # noqa: ANN401 - of pxr, which has no types
    """Add in-betweens to a blend shape: for its points, or for all points if an in-between moves others too."""
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
    """The valid USD name that Blender gives to a shape key of this name."""
    safe = "".join(mark if mark.isascii() and mark.isalnum() else "_" for mark in name)
    return f"_{safe}" if safe[:1].isdigit() else safe


def _token(name: str, place: float) -> str:
    """The name of an in-between, with its place in percent, as riggers write it."""
    return f"{safe_name(name)}_{format(100.0 * place, '.4g').replace('.', '_')}"


def _leave_out(animation: Any, gone: set[str]) -> None:  # noqa: ANN401
    """Remove blend shapes from an animation, at all its time samples."""
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
        raise InputError(f"The blend shape '{name}' does not match its mesh; export the file again.")
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
    except Exception as error:  # an exception type of pxr, which has another name in every version
        raise InputError(f"{path} cannot be read as a USD file: {reason(error)}; export it again.") from error


def _pxr(module: str) -> ModuleType:
    """A module of USD's own Python package, which comes with Blender."""
    try:
        return importlib.import_module(f"pxr.{module}")
    except ModuleNotFoundError:
        pass
    # The bpy module has it in a folder that is not on Python's path.
    version = f"python{sys.version_info.major}.{sys.version_info.minor}"
    # The stubs do not know this function of Blender's.
    of_blender: Callable[[str], str] = vars(bpy.utils)["system_resource"]
    folder = Path(of_blender('PYTHON'), "lib", version, "site-packages")
    spec = PathFinder.find_spec("pxr", [str(folder)])
    if spec is None or spec.loader is None:
        raise InputError("This Blender has no Python package of USD; export FBX, or use another Blender.")
    package = importlib.util.module_from_spec(spec)
    sys.modules["pxr"] = package
    spec.loader.exec_module(package)
    return importlib.import_module(f"pxr.{module}")
