# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Narrows values of general Blender types to the type that they have where QC3D reads them."""

from __future__ import annotations

from typing import TypeVar

import bpy

from ..solver.errors import InputError, QC3DError

T = TypeVar("T")


def present(value: T | None) -> T:
    """``value`` itself, which is never None where QC3D reads it; raises QC3DError if it is."""
    if value is None:
        raise QC3DError("Blender has nothing where something must be; please report this.")
    return value


def expect(kind: type[T], value: object) -> T:
    """``value`` itself, which is always of type ``kind`` where QC3D reads it.

    Raises
    ------
    QC3DError
        If it is of another type, or None.
    """
    if not isinstance(value, kind):
        raise QC3DError(f"Blender gave {type(value).__name__} in place of {kind.__name__}; please report this.")
    return value


def mesh_of(obj: bpy.types.Object) -> bpy.types.Mesh:
    """The mesh of an object; raises InputError if the object is not a mesh."""
    if not isinstance(obj.data, bpy.types.Mesh):
        raise InputError(f"'{obj.name}' is not a mesh; select a mesh with shape keys.")
    return obj.data


def shape_keys_of(obj: bpy.types.Object) -> bpy.types.Key | None:
    """The shape keys of an object's mesh, or None; raises InputError if the object is not a mesh."""
    return mesh_of(obj).shape_keys


def keys_of(obj: bpy.types.Object) -> bpy.types.Key:
    """The shape keys of an object's mesh; raises InputError if it has none."""
    keys = shape_keys_of(obj)
    if keys is None:
        raise InputError(f"'{obj.name}' has no shape keys; add two to go between.")
    return keys
