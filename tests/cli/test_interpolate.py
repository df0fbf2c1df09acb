# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``qc3d interpolate``: frames that meet their keys, and one sentence for unusable input."""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from qc3d_addon.cli import interpolate as command
from qc3d_addon.cli import main
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.frames.task import Task
from qc3d_addon.solver.keys.files import read_pairs
from qc3d_addon.solver.settings import FitOptions, FrameOptions

from ..command_lines import with_others
from ..solver.meshes import icosphere

QUICK = ["--quality", "normal", "--engine", "delaunay"]


def interpolate(pair: Path, output: Path, *more: str, first: str = "straight", second: str = "bent") -> int:
    command = ["interpolate", str(pair), "--from", first, "--to", second, "--frames", "1", "--output", str(output)]
    return main.main(with_others([*command, *QUICK], more))


def refusal(capsys: pytest.CaptureFixture[str]) -> str:
    """The one sentence on standard error."""
    output, text = capsys.readouterr()
    assert output == ""
    assert text.startswith("qc3d: ")
    assert text.endswith(".\n")
    assert text.count("\n") == 1
    return text


def test_frames_run_from_key_to_key(bar_file: Path, bar: dict[str, np.ndarray], tmp_path: Path) -> None:
    output, report = tmp_path / "frames.npz", tmp_path / "report.json"
    assert interpolate(bar_file, output, "--frames", "3", "--mode", "linear", "--report", str(report)) == 0

    with np.load(output, allow_pickle=False) as stored:
        frames, times = stored["frames"], stored["times"]
        np.testing.assert_array_equal(stored["faces"], bar["faces"])
        np.testing.assert_array_equal(stored["key0"], bar["V0"])
        np.testing.assert_array_equal(stored["key1"], bar["V1"])
    np.testing.assert_allclose(times, [0.0, 0.25, 0.5, 0.75, 1.0], atol=1e-15)
    diagonal = np.linalg.norm(np.ptp(bar["V0"], axis=0))
    assert frames.shape == (5, *bar["V0"].shape)
    assert np.abs(frames[0] - bar["V0"]).max() <= 1e-6 * diagonal
    assert np.abs(frames[-1] - bar["V1"]).max() <= 1e-6 * diagonal
    halfway = np.abs(frames[2] - 0.5 * (bar["V0"] + bar["V1"])).max()
    assert 0.0 < halfway < 0.1 * diagonal  # its own way between the keys, and near them

    found = json.loads(report.read_text())
    assert found["engine"] == "delaunay"
    assert found["mode"] == "linear"
    assert found["vertices"] == len(bar["V0"])
    assert found["tetrahedra"] > 100
    assert found["folds"]["map"] == 0
    assert len(found["folds"]["frames"]) == 5
    assert 0.0 <= found["residual"]["rms"] <= found["residual"]["max"] < 0.05
    assert 0.0 <= found["key_error"] <= 1e-6
    assert {"mesh", "locate", "fit", "frames"} <= set(found["seconds"])
    assert found["peak_memory_mb"] > 10


def test_a_chain_runs_through_every_key(bar: dict[str, np.ndarray], tmp_path: Path) -> None:
    lifted = bar["V1"] + np.maximum(bar["V0"][:, 2:] - 2.0, 0.0) ** 2 * [0.0, 0.1, 0.0]
    shapes = {"shape_names": np.array(["straight", "bent", "lifted"]), "V2": lifted}
    np.savez(tmp_path / "three.npz", **(bar | shapes))
    output, report = tmp_path / "frames.npz", tmp_path / "report.json"
    options = ["--via", "bent", "--via", "straight", "--frames", "1", "--mode", "linear", "--report", str(report)]
    assert interpolate(tmp_path / "three.npz", output, *options, second="lifted") == 0
    with np.load(output, allow_pickle=False) as stored:
        np.testing.assert_allclose(stored["times"], np.arange(7) / 6.0, atol=1e-15)
        for index, key in ((0, "V0"), (2, "V1"), (4, "V0")):
            np.testing.assert_array_equal(stored["frames"][index], bar[key])
        np.testing.assert_array_equal(stored["frames"][6], lifted)
        np.testing.assert_array_equal(stored["key0"], bar["V0"])
        np.testing.assert_array_equal(stored["key1"], lifted)
    assert len(json.loads(report.read_text())["folds"]["frames"]) == 7


def test_the_notes_are_those_of_the_report(
    bar_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A turn asked for that no part can take is said in the report, and to the user."""
    report = tmp_path / "report.json"
    options = ["--extra-turns", "1", "--report", str(report)]
    assert interpolate(bar_file, tmp_path / "frames.npz", *options) == 0
    notes = json.loads(report.read_text())["notes"]
    assert notes
    assert capsys.readouterr().err == "".join(f"qc3d: {note}\n" for note in notes)


def test_a_mirrored_key_is_refused_and_blends_straight(
    bar: dict[str, np.ndarray], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mirrored = bar["V0"] * [-1.0, 1.0, 1.0] + [0.5, 0.0, 0.0]
    np.savez(tmp_path / "mirrored.npz", **(bar | {"V1": mirrored}))
    assert interpolate(tmp_path / "mirrored.npz", tmp_path / "frames.npz") == 2
    assert "mirrored or turned inside out" in refusal(capsys)
    assert not (tmp_path / "frames.npz").exists()
    report = tmp_path / "report.json"
    options = ["--mode", "straight", "--report", str(report)]
    assert interpolate(tmp_path / "mirrored.npz", tmp_path / "frames.npz", *options) == 0
    with np.load(tmp_path / "frames.npz") as stored:
        halfway = bar["V0"] + 0.5 * (mirrored - bar["V0"])
        np.testing.assert_allclose(stored["frames"], [bar["V0"], halfway, mirrored], rtol=0.0, atol=1e-15)
    assert json.loads(report.read_text())["engine"] == "none"


def test_every_setting_reaches_the_solver(bar_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Reached(Exception):
        pass

    def carry_out(task: Task) -> None:
        assert task.fit_options == FitOptions(stretch="logarithmic", extra_turns=-2, quality="fine", seed=5)
        assert task.frame_options == FrameOptions("linear", "ease-in")
        raise Reached

    monkeypatch.setattr(command, "carry_out", carry_out)
    options = ["--mode", "linear", "--stretch", "logarithmic", "--easing", "ease-in", "--extra-turns", "-2"]
    options += ["--quality", "fine", "--engine", "delaunay"]
    with pytest.raises(Reached):
        interpolate(bar_file, tmp_path / "frames.npz", *options, "--seed", "5")


def test_the_quality_exact_meets_the_second_key(bar_file: Path, tmp_path: Path) -> None:
    told = tmp_path / "report.json"
    assert interpolate(bar_file, tmp_path / "frames.npz", "--quality", "exact", "--report", str(told)) == 0
    report = json.loads(told.read_text())
    assert report["quality"] == "exact"
    assert report["residual"]["max"] <= 1e-4
    assert report["folds"] == {"map": 0, "frames": [0, 0, 0]}


def test_the_same_seed_gives_the_same_frames(bar_file: Path, tmp_path: Path) -> None:
    outputs = [tmp_path / "one.npz", tmp_path / "two.npz"]
    for output in outputs:
        assert interpolate(bar_file, output, "--seed", "7", "--mode", "linear") == 0
    one, two = (np.load(output)["frames"] for output in outputs)
    np.testing.assert_array_equal(one, two)


def test_real_keys(data_folder: Path, tmp_path: Path) -> None:
    output, report = tmp_path / "frames.npz", tmp_path / "report.json"
    command = ["interpolate", str(data_folder / "fox.npz"), "--from", "bind", "--to", "Walk_0.25", "--frames", "1"]
    assert main.main([*command, *QUICK, "--output", str(output), "--report", str(report)]) == 0
    assert json.loads(report.read_text())["folds"]["map"] == 0


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--from", "sideways"], "no shape 'sideways'; it has 'straight', 'bent'"),
        (["--to", "straight"], "two different keys"),
        (["--via", "sideways"], "no shape 'sideways'; it has 'straight', 'bent'"),
        (["--via", "bent"], "'bent' comes twice in a row"),
        (["--frames", "-1"], "-1 in-betweens are not possible"),
        (["--frames", "1000000000"], "1000000000 in-betweens are not possible"),
        (["--frames", "several"], "'several' is not a whole number"),
        (["--mode", "magic"], "'magic'"),
        (["--engine", "steam"], "'steam'"),
        (["--quality", "best"], "'best'"),
        (["--stretch", "rubber"], "'rubber'"),
        (["--extra-turns", "1000"], "1000 extra turns are asked for"),
        (["--extra-turns", "half"], "'half' is not a whole number"),
        (["--seed", "-3"], "The seed is -3"),
        (["--speed", "9"], "--speed"),
        (["--output", "missing/frames.npz"], "frames.npz cannot be written: No such file or directory"),
        (["--output", "bar.npz/frames.npz"], "frames.npz cannot be written: Not a directory"),
        (["--output", "."], "is a folder"),
        (["--output", "bar.npz"], "named twice"),
        (["--report", "frames.npz"], "named twice"),
        (["--report", "missing/report.json"], "report.json cannot be written"),
    ],
)
def test_unusable_options(
    options: list[str],
    said: str,
    bar_file: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(bar_file.parent)
    before = bar_file.read_bytes()
    assert interpolate(Path(bar_file.name), Path("frames.npz"), *options) == 2
    assert said in refusal(capsys)
    assert os.listdir() == ["bar.npz"]
    assert bar_file.read_bytes() == before


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"faces": None}, "has no array faces"),
        ({"shape_names": None}, "has no array shape_names"),
        ({"V1": None}, "has no array V1"),
        ({"shape_names": np.array([1, 2])}, "must be a list of texts"),
        ({"shape_names": np.array(["straight", "bent"], dtype=object)}, "shape_names"),
        ({"V1": np.zeros((3, 3))}, "vertices; both must be shapes of the same mesh"),
        ({"V1": np.array([["a", "b", "c"]])}, "coordinates must be numbers"),
        ({"V1": np.zeros((0, 3), dtype=complex)}, "coordinates must be numbers"),
        ({"faces": np.array([[0, 1, 999999]])}, "refers to a vertex outside"),
        ({"faces": np.array([[0.5, 1.0, 2.0]])}, "must be integers"),
    ],
)
def test_unusable_arrays(
    changes: dict[str, np.ndarray | None],
    said: str,
    bar: dict[str, np.ndarray],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / "changed.npz"
    np.savez(path, allow_pickle=True, **{name: array for name, array in (bar | changes).items() if array is not None})
    assert interpolate(path, tmp_path / "frames.npz") == 2
    assert said in refusal(capsys)


def test_a_key_that_is_not_finite(
    bar: dict[str, np.ndarray], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = bar["V1"].copy()
    broken[5, 1] = np.nan
    np.savez(tmp_path / "nan.npz", **(bar | {"V1": broken}))
    assert interpolate(tmp_path / "nan.npz", tmp_path / "frames.npz") == 2
    assert "Vertex 5 of the second key" in refusal(capsys)


@pytest.mark.parametrize("kind", ["missing", "folder", "text", "pickle", "single array", "truncated", "corrupt"])
def test_files_that_are_no_pair(kind: str, bar_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "odd.npz"
    whole = bar_file.read_bytes()
    if kind == "folder":
        path.mkdir()
    elif kind == "text":
        path.write_text("straight, bent\n")
    elif kind == "pickle":
        path.write_bytes(pickle.dumps({"faces": [0, 1, 2]}))
    elif kind == "single array":
        with path.open("wb") as file:
            np.save(file, np.zeros((4, 3)))
    elif kind == "truncated":
        path.write_bytes(whole[: len(whole) // 2])
    elif kind == "corrupt":
        path.write_bytes(whole.replace(b"NUMPY", b"NUMPI"))
    assert interpolate(path, tmp_path / "frames.npz") == 2
    assert "odd.npz" in refusal(capsys)
    assert not (tmp_path / "frames.npz").exists()


def test_the_program_itself(bar_file: Path, tmp_path: Path) -> None:
    """As a program: its exit status, nothing but the sentence on standard error, and no bars without a terminal."""
    program = [sys.executable, "-m", "qc3d_addon"]
    command = ["interpolate", str(bar_file), "--from", "straight", "--to", "bent", "--frames", "0", *QUICK]
    good = subprocess.run(
        [*program, *command, "--output", str(tmp_path / "frames.npz")], capture_output=True, text=True, timeout=120
    )
    assert (good.returncode, good.stdout, good.stderr) == (0, "", "")
    bad = subprocess.run([*program, *command, "--output", str(tmp_path)], capture_output=True, text=True, timeout=120)
    assert bad.returncode == 2
    assert bad.stderr == f"qc3d: {tmp_path} is a folder; give the name of a file.\n"


def test_version(capsys: pytest.CaptureFixture[str], repository: Path) -> None:
    with pytest.raises(SystemExit) as ended:
        main.main(["--version"])
    assert ended.value.code == 0
    version = capsys.readouterr().out.removeprefix("qc3d ").strip()
    assert f'version = "{version}"' in (repository / "blender_manifest.toml").read_text()


class TestPolygonsAndHalves:
    def test_polygons_in_the_file(self, bar: dict[str, np.ndarray], tmp_path: Path) -> None:
        half = len(bar["faces"]) // 2
        labels = np.tile(np.arange(half), 2)
        order = np.argsort(labels, kind="stable")
        loops = np.concatenate([bar["faces"][:half], bar["faces"][half:, 2:]], axis=1)
        path = tmp_path / "quads.npz"
        np.savez(path, **bar | {"faces": bar["faces"][order], "polygons": labels[order]})
        labelled = read_pairs(path, ("straight", "bent"))["straight", "bent"]
        filled = np.pad(loops, ((0, 0), (0, 2)), constant_values=-1)
        np.savez(path, **bar | {"faces": bar["faces"][order], "polygons": filled})
        listed = read_pairs(path, ("straight", "bent"))["straight", "bent"]
        assert len(np.unique(labelled.polygons)) == half
        assert np.array_equal(labelled.polygons, listed.polygons)

    @pytest.mark.parametrize(
        "polygons", [np.zeros(3, dtype=int), np.zeros((5, 4), dtype=int), np.array("x"), np.ones(4)]
    )
    def test_polygons_that_are_none(self, bar: dict[str, np.ndarray], tmp_path: Path, polygons: np.ndarray) -> None:
        path = tmp_path / "spoiled.npz"
        np.savez(path, **bar, polygons=polygons)
        with pytest.raises(InputError, match="polygons"):
            read_pairs(path, ("straight", "bent"))

    def test_a_half(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        corners = np.array([[x, y, z] for x in (0.0, 1.0) for y in (-1, 1) for z in (-1, 1)])
        quads = np.array([[4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
        faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
        moved = corners * [1.0, 1.0, 1.5] + [0.0, 0.5, 0.0]
        np.savez(tmp_path / "half.npz", faces=faces, shape_names=np.array(["a", "b"]), V0=corners, V1=moved)
        ends = ["--from", "a", "--to", "b", "--frames", "1", "--output", str(tmp_path / "out.npz")]
        assert main.main(["interpolate", str(tmp_path / "half.npz"), *ends]) == 0
        assert "mirror image across a plane; 4 vertices" in capsys.readouterr().err
        with np.load(tmp_path / "out.npz") as out:
            assert out["frames"].shape == (3, 8, 3)
            assert np.array_equal(out["faces"], faces)
            assert not out["frames"][:, :4, 0].any()
        assert main.main(["interpolate", str(tmp_path / "half.npz"), *ends, "--mirror", "none"]) == 0
        assert "mirror image" not in capsys.readouterr().err


@pytest.mark.slow
def test_a_collider_in_the_file(bar_file: Path, bar: dict[str, np.ndarray], tmp_path: Path) -> None:
    free, output = tmp_path / "free.npz", tmp_path / "frames.npz"
    assert interpolate(bar_file, free, "--frames", "3") == 0
    tip = np.load(free)["frames"][2][np.argmax(bar["V0"] @ [1.0, 1.0, 1.0])]
    ball, faces = icosphere(1)
    ball = tip + 0.3 * (ball - ball.mean(axis=0)) / np.ptp(ball, axis=0).max()
    np.savez(tmp_path / "pair.npz", **bar, collider=ball[None], collider_faces=faces)
    assert interpolate(tmp_path / "pair.npz", output, "--frames", "3") == 0
    with np.load(output) as made:
        assert made["collider"].shape == (2, *ball.shape)
        assert np.abs(made["frames"] - np.load(free)["frames"]).max() > 1e-3
        frames = made["frames"]
    small, back = str(tmp_path / "small.qc3d"), tmp_path / "back.npz"
    assert main.main(["compress", str(output), "--error", "1e-4", "--output", small]) == 0
    assert main.main(["decompress", small, str(output), "--output", str(back)]) == 0
    missed = np.load(back)["frames"] - frames
    unit = np.linalg.norm(np.ptp(frames[0], axis=0))
    assert np.sqrt((missed**2).sum(axis=2).mean(axis=1)).max() <= 1.001e-4 * unit
    np.savez(tmp_path / "bad.npz", **bar, collider=ball, collider_faces=faces)
    assert interpolate(tmp_path / "bad.npz", output, "--frames", "3") == 2
