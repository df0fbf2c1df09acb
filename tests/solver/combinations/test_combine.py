# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Two keys on at once: the true pose where it is known, and what both keys leave in place stays there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import qc3d_addon as qc3d
from qc3d_addon.solver.arrays import Floats
from qc3d_addon.solver.collision.crossings import CrossingSearch
from qc3d_addon.solver.combinations.base import KeysOnBase
from qc3d_addon.solver.combinations.composer import Composer
from qc3d_addon.solver.settings import Mirror
from qc3d_addon.solver.support.progress import Progress

from .arm import arm, posed

SIDE, ALONG = (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)
REST, FACES = arm()
DIAGONAL = float(np.linalg.norm(np.ptp(REST, axis=0)))


def off(shape: Floats, truth: Floats) -> float:
    return float(np.linalg.norm(shape - truth, axis=1).max()) / DIAGONAL


@pytest.mark.parametrize("axis", [(0.0, 0.0, 1.0), SIDE, ALONG], ids=["same axis", "other axis", "twist"])
@pytest.mark.parametrize("swapped", [False, True], ids=["named in order", "named the other way"])
def test_two_joints_are_those_of_the_posed_arm(axis: tuple[float, float, float], swapped: bool) -> None:
    raised, bent, truth = posed(REST, 80.0, 0.0), posed(REST, 0.0, 90.0, axis), posed(REST, 80.0, 90.0, axis)
    keys = [bent, raised] if swapped else [raised, bent]
    found = qc3d.combine(REST, keys, FACES)
    assert found.order == ((1, 0) if swapped else (0, 1))
    assert off(found.shape, truth) < 1e-6
    assert off(raised + bent - REST, truth) > 0.05
    assert found.crossings == 0


def test_the_order_can_be_turned() -> None:
    keys = [posed(REST, 80.0, 0.0), posed(REST, 0.0, 90.0, SIDE)]
    turned = qc3d.combine(REST, keys, FACES, order=(1, 0))
    assert turned.order == (1, 0)
    assert off(turned.shape, posed(REST, 80.0, 90.0, SIDE)) > 0.1


@pytest.mark.slow
def test_three_keys() -> None:
    wrist = REST.copy()
    beyond = np.maximum(REST[:, 0] - 3.3, 0.0)
    wrist[:, 1] += np.where(beyond > 0.0, 1.2 * beyond**2, 0.0)
    found = qc3d.combine(REST, [wrist, posed(REST, 80.0, 0.0), posed(REST, 0.0, 90.0, SIDE)], FACES)
    assert found.order == (1, 2, 0)
    # Skinning carries the wrist along exactly: it is beyond both joints.
    truth = posed(REST, 80.0, 90.0, SIDE)
    hand = REST[:, 0] > 3.0
    source, target = REST[hand], truth[hand]
    rotation = np.linalg.lstsq(source - source.mean(axis=0), target - target.mean(axis=0), rcond=None)[0].T
    truth = truth + (wrist - REST) @ rotation.T
    assert off(found.shape, truth) < 1e-3


@pytest.mark.slow
def test_partly_on_adds_nothing_to_what_each_key_shows() -> None:
    raised, bent = posed(REST, 60.0, 0.0), posed(REST, 0.0, 60.0, SIDE)
    halves = [posed(REST, 30.0, 0.0), posed(REST, 0.0, 30.0, SIDE)]
    composed = Composer(KeysOnBase(REST, [raised, bent], FACES)).composed(halves)
    assert off(composed, posed(REST, 30.0, 30.0, SIDE)) < 1e-5
    seen: list[float] = []

    def note(step: Progress) -> None:
        seen.append(step.overall)

    found = qc3d.combine(REST, [raised, bent], FACES, weights=(0.5, 0.5), between="natural", progress=note)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
    own = [qc3d.fit(REST, key, FACES).inbetweens([0.5]).frames[0] for key in (raised, bent)]
    missed = max(off(*pair) for pair in zip(own, halves, strict=True))
    assert off(found.shape, posed(REST, 30.0, 30.0, SIDE)) < 2.0 * missed


@pytest.mark.parametrize("weights", [(0.5, 0.5), (0.25, 1.0), (1.0, 0.6)])
def test_joints_that_are_partly_turned_are_those_of_the_posed_arm(weights: tuple[float, float]) -> None:
    keys = [posed(REST, 80.0, 0.0), posed(REST, 0.0, 90.0, SIDE)]
    found = qc3d.combine(REST, keys, FACES, weights=weights)
    assert off(found.shape, posed(REST, weights[0] * 80.0, weights[1] * 90.0, SIDE)) < 1e-6
    assert [note for note in found.notes if "pose of one joint" in note]
    assert found.crossings == 0


@pytest.mark.slow
def test_a_sculpted_key_beside_a_joint_shows_its_in_between() -> None:
    swollen = REST + np.exp(-((REST[:, :1] - 2.0) ** 2) / 0.1) * REST * [0.0, 0.5, 0.5]
    found = qc3d.combine(REST, [posed(REST, 80.0, 0.0), swollen], FACES, weights=(0.0, 0.5))
    natural = qc3d.fit(REST, swollen, FACES).inbetweens([0.5]).frames[0]
    np.testing.assert_array_equal(found.shape, natural)
    assert not [note for note in found.notes if "pose of one joint" in note]


def test_one_that_is_off_changes_nothing() -> None:
    raised, bent = posed(REST, 80.0, 0.0), posed(REST, 0.0, 90.0, SIDE)
    np.testing.assert_array_equal(qc3d.combine(REST, [raised, bent], FACES, weights=(1.0, 0.0)).shape, raised)
    np.testing.assert_array_equal(qc3d.combine(REST, [raised, bent], FACES, weights=(0.0, 0.0)).shape, REST)


def test_keys_of_separate_places_are_added() -> None:
    left, right = REST.copy(), REST.copy()
    left[REST[:, 0] < 1.0, 1] *= 1.5
    right[REST[:, 0] > 3.0, 1] *= 0.7
    found = qc3d.combine(REST, [left, right], FACES).shape
    assert off(found, left + right - REST) < 1e-9
    still = (left == REST).all(axis=1) & (right == REST).all(axis=1)
    np.testing.assert_array_equal(found[still], REST[still])


def test_both_squash_and_nothing_turns_inside_out() -> None:
    flat = REST * [1.0, 0.55, 1.0]
    found = qc3d.combine(REST, [flat, flat * [1.0, 1.0, 0.9]], FACES)
    assert off(found.shape, REST * [1.0, 0.15, 0.9]) < 0.01
    assert found.crossings == 0


def test_seams_stay_shut() -> None:
    """The same arm with every triangle for itself."""
    loose = np.arange(3 * len(FACES)).reshape(-1, 3)
    keys = [posed(REST, 80.0, 0.0)[FACES.ravel()], posed(REST, 0.0, 90.0, SIDE)[FACES.ravel()]]
    found = qc3d.combine(REST[FACES.ravel()], keys, loose).shape
    assert off(found, posed(REST, 80.0, 90.0, SIDE)[FACES.ravel()]) < 1e-6


def test_loose_edges_and_vertices_go_along() -> None:
    """A hair of two edges on the hand, and a vertex that hangs together with nothing."""
    def with_hair(shape: Floats, turn: Floats) -> Floats:
        root = shape[-1]
        return np.concatenate([shape, [root + turn @ [0.2, 0.0, 0.0], root + turn @ [0.4, 0.0, 0.0], [9.0, 9.0, 9.0]]])

    turns = {}
    for name, angles in {"rest": (0.0, 0.0), "raised": (80.0, 0.0), "bent": (0.0, 90.0), "both": (80.0, 90.0)}.items():
        shape = posed(REST, *angles, SIDE)
        hand = REST[:, 0] > 3.0
        rotation = np.linalg.lstsq(REST[hand] - REST[-1], shape[hand] - shape[-1], rcond=None)[0].T
        turns[name] = with_hair(shape, rotation)
    root = len(REST) - 1
    edges = [[root, root + 1], [root + 1, root + 2]]
    found = qc3d.combine(turns["rest"], [turns["raised"], turns["bent"]], FACES, edges).shape
    assert off(found, turns["both"]) < 1e-3


@pytest.mark.parametrize(
    ("choices", "said"),
    [
        ({"weights": (0.5,)}, "1 weights"),
        ({"weights": (0.5, 1.5)}, "1.5"),
        ({"weights": (0.5, float("nan"))}, "nan"),
        ({"order": (0, 0)}, "order"),
        ({"quality": "coarse"}, "quality"),
        ({"between": "posed"}, "posed"),
    ],
)
def test_what_cannot_be_is_refused(choices: dict[str, object], said: str) -> None:
    with pytest.raises(qc3d.InputError, match=said):
        qc3d.combine(REST, [posed(REST, 80.0, 0.0), posed(REST, 0.0, 90.0)], FACES, **choices)


def test_one_key_is_no_combination() -> None:
    with pytest.raises(qc3d.InputError, match="two keys"):
        qc3d.combine(REST, [posed(REST, 80.0, 0.0)], FACES)


@pytest.mark.parametrize("second", ["elbow90", "elbow90side", "twist90"])
def test_the_arm_of_the_cases(second: str, data_folder: Path) -> None:
    path = data_folder.parent / "cases" / "combination_arm.npz"
    if not path.is_file():
        pytest.skip(f"{path} does not exist")
    with np.load(path, allow_pickle=False) as stored:
        shapes = {name: stored[f"V{number}"] for number, name in enumerate(stored["shape_names"].tolist())}
        faces = stored["faces"]
    found = qc3d.combine(shapes["rest"], [shapes["raise80"], shapes[second]], faces)
    diagonal = np.linalg.norm(np.ptp(shapes["rest"], axis=0))
    assert np.linalg.norm(found.shape - shapes[f"raise80+{second}"], axis=1).max() < 1e-9 * diagonal
    assert found.crossings == 0
    if second == "elbow90side":
        half = qc3d.combine(shapes["rest"], [shapes["raise80"], shapes[second]], faces, weights=(0.5, 0.5)).shape
        truth = shapes["half raise80+half elbow90side"]
        assert np.linalg.norm(half - truth, axis=1).max() < 1e-9 * diagonal


@pytest.mark.slow
def test_a_mouth_opens_smiling_without_new_crossings(data_folder: Path) -> None:
    with np.load(data_folder / "head.npz", allow_pickle=False) as stored:
        names = stored["shape_names"].tolist()
        rest, jaw, smile = (stored[f"V{names.index(name)}"].astype(float) for name in ("neutral", "jawOpen", "smile"))
        faces = stored["faces"].astype(np.int64)
    composed = Composer(KeysOnBase(rest, [jaw, smile], faces)).composed([jaw, smile])
    found = qc3d.combine(rest, [smile, jaw], faces)
    assert found.order == (1, 0)
    assert found.crossings == 0
    search = CrossingSearch(faces, [rest, jaw])
    known = {tuple(pair) for shape in (rest, jaw, smile) for pair in search.pairs(shape).tolist()}
    assert len({tuple(pair) for pair in search.pairs(composed).tolist()} - known) > 100  # what had to be undone
    assert not {tuple(pair) for pair in search.pairs(found.shape).tolist()} - known


def test_width_and_height_of_a_box_multiply() -> None:
    corners = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    both = corners * [2.0, 1.0, 1.5]
    found = qc3d.combine(corners, [corners * [2.0, 1.0, 1.0], corners * [1.0, 1.0, 1.5]], faces)
    assert abs(found.shape - both).max() < 1e-9
    [verdict] = qc3d.judge_pairs(corners, [corners * [2.0, 1.0, 1.0], corners * [1.0, 1.0, 1.5]], faces)
    assert verdict.adding_is_right


@pytest.mark.parametrize("mirror", ["auto", "z"])
def test_a_half_is_combined_as_the_mirrored_whole(mirror: Mirror) -> None:
    upper = (REST[FACES][:, :, 2] > -1e-9).all(axis=1)
    used, faces = np.unique(FACES[upper], return_inverse=True)
    raised = posed(REST, 60.0, 0.0)
    swell = REST + np.exp(-((REST[:, :1] - 1.1) ** 2) / 0.1) * REST * [0.0, 0.8, 0.8]
    whole = qc3d.combine(REST, [raised, swell], FACES).shape
    half = [shape[used] for shape in (REST, raised, swell)]
    found = qc3d.combine(half[0], half[1:], faces.reshape(-1, 3), mirror=mirror).shape
    alone = qc3d.combine(half[0], half[1:], faces.reshape(-1, 3), mirror="none").shape
    seam = np.abs(half[0][:, 2]) < 1e-9
    assert seam.sum() > 20
    assert np.abs(found[seam, 2]).max() < 1e-12 < np.abs(alone[seam, 2]).max()
    # The other half of the arm is triangulated another way than the image of this one.
    assert off(found, whole[used]) < 0.1 * off(raised[used] + swell[used] - half[0], whole[used])


def test_an_unknown_mirror() -> None:
    with pytest.raises(qc3d.InputError, match="Unknown mirror 'w'"):
        qc3d.combine(REST, [posed(REST, 60.0, 0.0), REST], FACES, mirror="w")  # type: ignore[arg-type]


def test_a_limb_that_reaches_across_its_open_end_is_no_half() -> None:
    faces = FACES[(REST[FACES][:, :, 0] > 1e-9).any(axis=1)]
    raised, bent, truth = posed(REST, 100.0, 0.0), posed(REST, 0.0, 90.0, (0.0, 0.0, 1.0)), posed(REST, 100.0, 90.0)
    assert min(raised[:, 0].min(), bent[:, 0].min()) > -1e-9
    assert truth[:, 0].min() < -0.1
    found = qc3d.combine(REST, [raised, bent], faces)
    assert off(found.shape, truth) < 1e-6
    assert found.crossings == 0
    assert any("was not taken as one half" in note for note in found.notes)
