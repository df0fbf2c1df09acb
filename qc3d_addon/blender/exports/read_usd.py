# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the in-betweens of a USD file, which Blender's importer drops, as in-betweens of shape keys."""

from __future__ import annotations

from pathlib import Path

import bpy
import numpy as np

from ...solver.errors import InputError
from ...solver.files.npz import require_file
from ..bake import bookkeeping
from ..keys import chain_shapes, shape_keys
from ..kinds import keys_of, mesh_of
from ..store import checks
from ..store.chain import Chain
from ..store.mesh_data import key_coordinates
from ..store.names import chain_label
from ..store.records import Record
from . import usd_files


def read_in_betweens(obj: bpy.types.Object | None, path: Path) -> list[str]:
    """Give keys of an object the in-betweens of the blend shapes of the same names in a USD file.

    The keys themselves stay as they are. In-betweens are interpolated linearly, as in USD. Keys that already have
    in-betweens are skipped.

    Returns
    -------
    list of str
        Sentences for the user, the last of which says what was done.

    Raises
    ------
    InputError
        If the object or the file cannot be used, or nothing in the file belongs to a key; nothing is changed then.
    """
    obj = checks.require_object(obj)
    require_file(path)
    keys = keys_of(obj)
    found = usd_files.read_in_betweens(path, len(mesh_of(obj).vertices))
    by_token = {usd_files.safe_name(key.name): key for key in keys.key_blocks[1:]}
    record = Record.read(keys)
    notes, done = [], []
    for shape in found:
        key = by_token.get(usd_files.safe_name(shape.name))
        if key is None:
            notes.append(f"There is no shape key for '{shape.name}' of the file; import the file with Blender first.")
        elif record.chain_on_key(key.name) is not None:
            notes.append(f"'{key.name}' already has in-betweens; remove them to read those of the file.")
        else:
            _write(obj, record, key, shape)
            done.append(f"'{key.name}'")
    if not done:
        raise InputError(" ".join(notes) or f"{path.name} has no in-betweens for '{obj.name}'; choose another file.")
    return [*notes, f"{', '.join(done)}: in-betweens read from {path.name}."]


def _write(obj: bpy.types.Object, record: Record, key: bpy.types.ShapeKey, shape: usd_files.ReadShape) -> None:
    base = key.relative_key
    places = (0.0, *shape.places.tolist(), 1.0)
    first = key_coordinates(obj, base.name).astype(np.float64)
    # The last frame is the key of the object itself, not that of the file.
    frames = np.concatenate([first[None], first + shape.offsets[:-1], key_coordinates(obj, key.name)[None]])
    taken = {*obj.keys(), *(other.slider for other in record.chains)}
    chain = Chain((base.name, key.name), chain_label((key.name,), taken), on_key=key.name)
    steps = shape_keys.Steps(places, tuple(range(1, len(places) - 1)))
    shapes = chain_shapes.offsets_by_step(obj, places, frames)
    with shape_keys.chain_written(obj, chain, shapes, steps, None) as (undo, _):
        record.chains.append(chain)
        made = {steps.places[step]: np.asarray(shape) for step, shape in shapes.items()}
        bookkeeping.remember(obj, record, chain, None, made, undo)
