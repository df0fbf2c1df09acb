# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Output files are put in place completely or not at all; several of them all or none."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.files import replacement
from qc3d_addon.solver.files.atomic import making_folder, replacing, replacing_all, require_room, require_writable


def contents(folder: Path) -> dict[str, str]:
    return {path.name: path.read_text() for path in folder.iterdir()}


def test_what_was_there_stays_when_the_work_fails(tmp_path: Path) -> None:
    path = tmp_path / "frames.npz"
    path.write_text("earlier")
    with pytest.raises(RuntimeError), replacing(path) as new:  # noqa: PT012
        new.write_text("half")
        raise RuntimeError
    assert contents(tmp_path) == {"frames.npz": "earlier"}


@pytest.mark.parametrize("beside", [False, True])
def test_the_new_file_takes_the_place_of_the_old_one(tmp_path: Path, beside: bool) -> None:
    path = tmp_path / "frames.npz"
    path.write_text("earlier")
    with replacing_all(path, beside=beside) as (new,):
        assert new.is_absolute()
        assert new.suffix == path.suffix
        assert (new.parent == tmp_path) == beside
        assert not new.exists()
        new.write_text("whole")
        assert path.read_text() == "earlier"
    assert contents(tmp_path) == {"frames.npz": "whole"}


def test_nothing_is_left_of_a_file_beside_its_place_when_the_work_fails(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError), replacing_all(tmp_path / "baked.blend", beside=True) as (new,):  # noqa: PT012
        new.write_text("half")
        raise RuntimeError
    assert contents(tmp_path) == {}


class TestSeveralFiles:
    @pytest.fixture
    def paths(self, tmp_path: Path) -> list[Path]:
        paths = [tmp_path / name for name in ("one.txt", "two.txt", "three.txt")]
        paths[0].write_text("earlier one")
        paths[2].write_text("earlier three")
        return paths

    def test_all_take_their_places(self, paths: list[Path], tmp_path: Path) -> None:
        with replacing_all(*paths) as new:
            for path in new:
                path.write_text("new")
        assert contents(tmp_path) == {"one.txt": "new", "two.txt": "new", "three.txt": "new"}

    @pytest.mark.parametrize("failing", [0, 1, 2])
    @pytest.mark.parametrize("error", [OSError(5, "Input/output error"), KeyboardInterrupt()])
    @pytest.mark.parametrize("is_done", [False, True])
    def test_or_none_does(
        self,
        paths: list[Path],
        tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch,
        failing: int,
        error: BaseException,
        is_done: bool,
    ) -> None:
        """The error comes before or right after the file is put in its place."""
        before, replace = contents(tmp_path), Path.replace

        def sometimes(self: Path, target: Path) -> Path:
            fails = self.name.startswith("new") and target.name == paths[failing].name
            if fails and not is_done:
                raise error
            replace(self, target)
            if fails:
                raise error
            return target

        expected = InputError if isinstance(error, OSError) else KeyboardInterrupt
        monkeypatch.setattr(Path, "replace", sometimes)
        with pytest.raises(expected), replacing_all(*paths) as new:  # noqa: PT012
            for path in new:
                path.write_text("new")
        assert contents(tmp_path) == before

    def test_where_there_are_no_links_files_are_copied(
        self, paths: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        def no_links(*_: object) -> None:
            raise OSError(1, "Operation not permitted")

        monkeypatch.setattr(os, "link", no_links)
        self.test_or_none_does(paths, tmp_path, monkeypatch, 2, KeyboardInterrupt(), True)

    def test_one_that_was_not_written_is_missed(self, paths: list[Path], tmp_path: Path) -> None:
        before = contents(tmp_path)
        with pytest.raises(InputError, match="txt was not written"), replacing_all(*paths) as new:  # noqa: PT012
            for path in new[:2]:
                path.write_text("new")
        assert contents(tmp_path) == before

    def test_another_program_that_holds_the_folder_is_not_waited_for_without_end(
        self, paths: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        fcntl = pytest.importorskip("fcntl")
        monkeypatch.setattr(replacement, "_LONGEST_WAIT", 0.1)
        folder = os.open(tmp_path, os.O_RDONLY)
        try:
            fcntl.flock(folder, fcntl.LOCK_EX)
            self.test_all_take_their_places(paths, tmp_path)
        finally:
            os.close(folder)


class TestFolders:
    def test_what_is_made_goes_where_the_work_fails(self, tmp_path: Path) -> None:
        with pytest.raises(RuntimeError), making_folder(tmp_path / "one" / "two"):  # noqa: PT012
            assert (tmp_path / "one" / "two").is_dir()
            raise RuntimeError
        assert not list(tmp_path.iterdir())

    def test_what_others_put_there_stays(self, tmp_path: Path) -> None:
        with pytest.raises(RuntimeError), making_folder(tmp_path / "one" / "two"):  # noqa: PT012
            (tmp_path / "one" / "theirs").write_text("theirs")
            raise RuntimeError
        assert [path.name for path in (tmp_path / "one").iterdir()] == ["theirs"]

    def test_a_file_in_its_place(self, tmp_path: Path) -> None:
        (tmp_path / "file").write_text("mine")
        with pytest.raises(InputError, match="file cannot be made a folder: File exists"), making_folder(
            tmp_path / "file"
        ):
            pass


@pytest.mark.parametrize("call", [require_writable, lambda path: require_room(path, 3_000_000)])
def test_looking_leaves_nothing(call: Callable[[Path], None], tmp_path: Path) -> None:
    (tmp_path / "frames.npz").write_text("earlier")
    call(tmp_path / "frames.npz")
    call(tmp_path / "new.npz")
    assert contents(tmp_path) == {"frames.npz": "earlier"}
