# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The last fitted maps are remembered as they were stored, and not too many of them."""

from __future__ import annotations

import numpy as np
import pytest

from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.fit import recent
from qc3d_addon.solver.fit.fit_pair import fit_pair
from qc3d_addon.solver.fit.fitted_map import FittedMap
from qc3d_addon.solver.fit.recent import RecentFits
from qc3d_addon.solver.fit.storage import to_bytes
from qc3d_addon.solver.keys.keypair import KeyPair
from qc3d_addon.solver.settings import FitOptions
from qc3d_addon.solver.support.progress import finish

from ..meshes import box_surface, twisted


def fitted_by(angle: float) -> FittedMap:
    points, faces = box_surface((1, 1, 3), (1.0, 1.0, 3.0))
    return finish(fit_pair(KeyPair.checked(points, twisted(points, angle), faces), FitOptions()))


@pytest.fixture(scope="module")
def fits() -> list[FittedMap]:
    return [fitted_by(angle) for angle in (0.2, 0.4, 0.6)]


def again(pair: KeyPair) -> KeyPair:
    return KeyPair.checked(pair.key0, pair.key1, pair.faces, pair.edges, pair.polygons)


def test_what_was_fitted_is_found_by_its_stored_form(fits: list[FittedMap]) -> None:
    fitted, data = fits[0], to_bytes(fits[0])
    known = RecentFits()
    known.keep(data, fitted)
    found = known.restored(data, again(fitted.pair))
    assert found.volume is fitted.volume
    assert found.surface_path is fitted.surface_path
    assert fitted.seconds
    assert found.seconds == {}


def test_what_was_not_is_restored_once(fits: list[FittedMap]) -> None:
    fitted, data = fits[0], to_bytes(fits[0])
    known = RecentFits()
    found = known.restored(data, again(fitted.pair))
    assert found.volume is not fitted.volume
    np.testing.assert_array_equal(found.maps, fitted.maps)
    assert known.restored(data, again(fitted.pair)).volume is found.volume


def test_other_keys_have_no_part_in_it(fits: list[FittedMap]) -> None:
    data = to_bytes(fits[0])
    known = RecentFits()
    known.keep(data, fits[0])
    with pytest.raises(InputError, match="belongs to other keys"):
        known.restored(data, fits[1].pair)
    with pytest.raises(InputError, match="is damaged"):
        known.restored(data[:-1], fits[0].pair)


def test_the_one_that_was_not_used_for_longest_is_forgotten(
    fits: list[FittedMap], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recent, "_MOST_MAPS", 2)
    stored = [to_bytes(fitted) for fitted in fits]
    known = RecentFits()
    known.keep(stored[0], fits[0])
    known.keep(stored[1], fits[1])
    known.restored(stored[0], fits[0].pair)
    known.keep(stored[2], fits[2])
    assert known.restored(stored[0], fits[0].pair).volume is fits[0].volume
    assert known.restored(stored[2], fits[2].pair).volume is fits[2].volume
    assert known.restored(stored[1], fits[1].pair).volume is not fits[1].volume


def test_meshes_may_not_be_too_large_together(fits: list[FittedMap], monkeypatch: pytest.MonkeyPatch) -> None:
    size = len(fits[0].pair.key0)
    stored = [to_bytes(fitted) for fitted in fits]
    monkeypatch.setattr(recent, "_MOST_VERTICES", 2 * size - 1)
    known = RecentFits()
    known.keep(stored[0], fits[0])
    known.keep(stored[1], fits[1])
    assert known.restored(stored[1], fits[1].pair).volume is fits[1].volume
    assert known.restored(stored[0], fits[0].pair).volume is not fits[0].volume
    monkeypatch.setattr(recent, "_MOST_VERTICES", size - 1)
    known = RecentFits()
    known.keep(stored[0], fits[0])
    assert known.restored(stored[0], fits[0].pair).volume is not fits[0].volume
