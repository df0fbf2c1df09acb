# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The sweep of private folders removes what killed processes left, and nothing else that looks like it."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from qc3d_addon.solver.files.atomic import replacing
from qc3d_addon.solver.files.private_folders import PREFIX, PrivateFolder, remove_abandoned

from .commands import listing

ANOTHER = 54321  # a user
MARK = "in_use"


def make_old(path: Path) -> None:
    os.utime(path, (time.time() - 1e6,) * 2, follow_symlinks=False)


def abandoned(parent: Path, lines: str = "") -> Path:
    """A folder of a process that was killed."""
    program = (
        "import os, signal, sys\nfrom pathlib import Path\n"
        "from qc3d_addon.solver.files.private_folders import PrivateFolder\n"
        "folder = PrivateFolder(Path(sys.argv[1]))\n(folder.path / 'data').write_text('large')\n"
        f"{lines}\nprint(folder.path, flush=True)\nos.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run([sys.executable, "-c", program, str(parent)], capture_output=True, text=True, timeout=60)
    assert done.returncode == -signal.SIGKILL, done
    return Path(done.stdout.strip())


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="kills a process as Linux and macOS do")
class TestWhatAKilledProcessLeft:
    def test_goes_at_once(self, tmp_path: Path) -> None:
        left = abandoned(tmp_path, "(folder.path / 'deep' / 'er').mkdir(parents=True)")
        assert (left / "data").exists()
        with PrivateFolder(tmp_path) as folder:
            assert list(tmp_path.iterdir()) == [folder]

    def test_beside_an_output_goes_with_the_next_output_there(self, tmp_path: Path) -> None:
        lines = "name = folder.beside('.blend')\nname.write_text('half')\nPath(f'{name}@').write_text('more')"
        abandoned(tmp_path, lines)
        assert len(list(tmp_path.iterdir())) == 3
        with replacing(tmp_path / "new.json") as new:
            new.write_text("{}")
        assert [path.name for path in tmp_path.iterdir()] == ["new.json"]

    def test_a_copy_of_it_stays(self, tmp_path: Path) -> None:
        """As in a backup, or where somebody works on with what was rescued."""
        (tmp_path / "backup").mkdir()
        left = abandoned(tmp_path)
        for copy in (tmp_path / "backup" / left.name, tmp_path / f"{PREFIX}mine"):
            shutil.copytree(left, copy)
        (tmp_path / "backup" / left.name / "work.blend").write_text("hours")
        remove_abandoned(tmp_path)
        remove_abandoned(tmp_path / "backup")
        assert not left.exists()
        assert (tmp_path / "backup" / left.name / "work.blend").exists()
        assert (tmp_path / f"{PREFIX}mine" / "data").exists()

    def test_renamed_it_stays(self, tmp_path: Path) -> None:
        left = abandoned(tmp_path).rename(tmp_path / f"{PREFIX}mine")
        remove_abandoned(tmp_path)
        assert (left / "data").exists()

    def test_of_another_user_stays(self, tmp_path: Path) -> None:
        left = abandoned(tmp_path)
        try:
            os.chown(left, ANOTHER, -1)
        except PermissionError:
            pytest.skip("only root may give files away")
        remove_abandoned(tmp_path)
        assert (left / "data").exists()

    def test_with_a_mark_of_another_user_stays(self, tmp_path: Path) -> None:
        left = abandoned(tmp_path)
        try:
            os.chown(left / MARK, ANOTHER, -1)
        except PermissionError:
            pytest.skip("only root may give files away")
        remove_abandoned(tmp_path)
        assert (left / "data").exists()

    def test_what_it_leads_to_stays(self, tmp_path: Path) -> None:
        (tmp_path / "mine").mkdir()
        (tmp_path / "mine" / "work.blend").write_text("hours")
        abandoned(tmp_path, f"(folder.path / 'link').symlink_to({str(tmp_path / 'mine')!r})")
        remove_abandoned(tmp_path)
        assert [path.name for path in tmp_path.iterdir()] == ["mine"]
        assert (tmp_path / "mine" / "work.blend").exists()

    @pytest.mark.parametrize("name", ["work.blend", "../work.blend", ".qc3d-work", f"{PREFIX}{'0' * 32}/../work.blend"])
    def test_only_names_of_its_own_are_removed_beside_it(self, tmp_path: Path, name: str) -> None:
        inside = tmp_path / "inside"
        inside.mkdir()
        for path in (tmp_path / "work.blend", inside / "work.blend", inside / ".qc3d-work"):
            path.write_text("hours")
        left = abandoned(inside)
        with (left / MARK).open("a") as mark:
            mark.write(f"{name}\n")
        remove_abandoned(inside)
        assert sorted(path.name for path in inside.iterdir()) == [".qc3d-work", "work.blend"]
        assert (tmp_path / "work.blend").exists()


def test_a_folder_in_use_stays_however_old(tmp_path: Path) -> None:
    with PrivateFolder(tmp_path) as folder:
        (folder / "data").write_text("large")
        for path in (folder, folder / MARK):
            make_old(path)
        with PrivateFolder(tmp_path):
            assert (folder / "data").exists()


def _empty(folder: Path) -> None:
    folder.mkdir()


def _with_empty_mark(folder: Path) -> None:
    folder.mkdir()
    (folder / MARK).touch()


def _with_mark(folder: Path) -> None:
    folder.mkdir()
    (folder / MARK).write_text("This folder is in use by the team; do not delete.\n")


def _with_half_a_mark(folder: Path) -> None:
    with PrivateFolder(folder.parent) as made:
        text = (made / MARK).read_text()
    folder.mkdir()
    (folder / MARK).write_text(text[:20])


def _with_mark_of_another(folder: Path) -> None:
    with PrivateFolder(folder.parent) as made:
        text = (made / MARK).read_text()
    folder.mkdir()
    (folder / MARK).write_text(text)


def _with_mark_that_is_a_folder(folder: Path) -> None:
    (folder / MARK).mkdir(parents=True)


def _with_mark_that_is_a_pipe(folder: Path) -> None:
    folder.mkdir()
    os.mkfifo(folder / MARK)


def _with_mark_that_is_a_link(folder: Path) -> None:
    _with_mark(folder)
    (folder / MARK).rename(folder / "elsewhere")
    (folder / MARK).symlink_to("elsewhere")


def _link(folder: Path) -> None:
    _with_mark(folder.with_name("elsewhere"))
    folder.symlink_to("elsewhere")


def _file(folder: Path) -> None:
    folder.write_text("mine")


def _unreadable(folder: Path) -> None:
    _with_mark(folder)
    folder.chmod(0)


LOOKALIKES = [
    _empty,
    _with_empty_mark,
    _with_mark,
    _with_half_a_mark,
    _with_mark_of_another,
    _with_mark_that_is_a_folder,
    _with_mark_that_is_a_pipe,
    _with_mark_that_is_a_link,
    _link,
    _file,
    _unreadable,
]


@pytest.mark.parametrize("make", LOOKALIKES)
@pytest.mark.parametrize("name", ["qc3d-output", f"{PREFIX}output", f"{PREFIX}abcd1234"])
def test_what_only_looks_like_one_of_ours_stays(make: Callable[[Path], None], name: str, tmp_path: Path) -> None:
    if os.name == "nt" and make in (_with_mark_that_is_a_pipe, _with_mark_that_is_a_link, _link):
        pytest.skip("makes pipes and links as Linux and macOS do")
    folder = tmp_path / name
    make(folder)
    if folder.is_dir() and not folder.is_symlink() and make is not _empty and make is not _unreadable:
        (folder / "work.blend").write_text("hours")
    make_old(folder)
    before = listing(tmp_path)
    with PrivateFolder(tmp_path):
        pass
    assert listing(tmp_path) == before
    if make is _unreadable:
        folder.chmod(0o700)


@pytest.mark.parametrize("seed", range(40))
def test_random_folders_stay(seed: int, tmp_path: Path) -> None:
    """Names, marks and contents put together at random, from pieces of real ones."""
    choose = random.Random(seed)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    with PrivateFolder(tmp_path) as one, PrivateFolder(tmp_path) as two, PrivateFolder(elsewhere) as other:
        sentence = (one / MARK).read_text()
        starts, ends = [(one.name[:22], two.name[22:]), (other.name[:22], one.name[22:])], [other.name, one.name[:-1]]
    names = ["".join(pair) for pair in starts] + ends + [f"{one.name}0", one.name.upper(), f"{PREFIX}{'0' * 32}"]
    for name in choose.sample(names, 4):
        folder = tmp_path / name
        folder.mkdir()
        mark = folder / choose.choice([MARK, "mark", f"{MARK}.txt"])
        mark.write_bytes(choose.choice([sentence.encode(), b"", sentence[:9].encode(), choose.randbytes(99)]))
        if choose.random() < 0.5:
            (folder / "work.blend").write_text("hours")
        make_old(folder)
    before = listing(tmp_path)
    remove_abandoned(tmp_path)
    assert listing(tmp_path) == before


@pytest.mark.parametrize("half", ["", "in_use", "in_use with a part of its sentence"])
@pytest.mark.parametrize("what", [None, "work.blend"])
def test_of_a_folder_that_was_never_finished(half: str, what: str | None, tmp_path: Path) -> None:
    """A process may be killed as it makes one: that goes when it is old, if nothing else is in it."""
    with PrivateFolder(tmp_path) as folder:
        sentence = (folder / MARK).read_text()
    folder.mkdir()
    if half:
        (folder / MARK).write_text(sentence[:20] if half != MARK else "")
    if what:
        (folder / what).write_text("hours")
    remove_abandoned(tmp_path)
    assert folder.exists()  # it may still be in the making
    make_old(folder)
    remove_abandoned(tmp_path)
    assert folder.exists() == (what is not None)


@pytest.mark.parametrize("mode", [0o300, 0o100])
def test_a_folder_for_temporary_files_that_may_not_be_listed(unprivileged: Path, mode: int) -> None:
    unprivileged.chmod(mode)
    if mode & 0o200:
        PrivateFolder(unprivileged).close()
    else:
        with pytest.raises(PermissionError):
            PrivateFolder(unprivileged)
