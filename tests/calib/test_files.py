"""Files that are there whole or not at all."""

from __future__ import annotations

import hashlib
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from calib.errors import InputError
from calib.files import open_up, real_path, remove_leftovers, sha256_of, whole_file, write_text


def test_a_file_is_there_when_all_went_well(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    with whole_file(path) as whole:
        assert whole.parent == tmp_path
        assert whole.suffix == ".csv"
        whole.write_text("1\n")
        assert not path.exists()
    assert [p.name for p in tmp_path.iterdir()] == ["a.csv"]
    assert path.read_text() == "1\n"


def test_a_write_that_fails_leaves_what_was_there_and_nothing_beside_it(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("before\n")

    def write_half() -> None:
        with whole_file(path) as whole:
            whole.write_text("half of")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_half()
    assert [p.name for p in tmp_path.iterdir()] == ["a.csv"]
    assert path.read_text() == "before\n"


def test_what_cannot_take_its_name_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "a.csv").mkdir()
    with pytest.raises(OSError, match="directory"):
        write_text(tmp_path / "a.csv", "1\n")
    assert [p.name for p in tmp_path.iterdir()] == ["a.csv"]


def test_content_is_on_the_disk_before_the_file_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done: list[str] = []
    fsync, replace = os.fsync, os.replace

    def synced(descriptor: int) -> None:
        done.append("folder" if stat.S_ISDIR(os.fstat(descriptor).st_mode) else f"file of {os.fstat(descriptor).st_size}")
        fsync(descriptor)

    def named(source: Path, target: Path) -> None:
        done.append("named")
        replace(source, target)

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(os, "replace", named)
    write_text(tmp_path / "a.txt", "seven\n")
    assert done == ["file of 6", "named", "folder"]


def test_a_killed_write_leaves_a_leftover_that_can_be_told_and_removed(tmp_path: Path) -> None:
    code = (
        "import os, signal, sys; from pathlib import Path; from calib.files import whole_file\n"
        "with whole_file(Path(sys.argv[1])) as whole:\n"
        "    whole.write_text('half'); os.kill(os.getpid(), signal.SIGKILL)"
    )
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path / "block.npz")], cwd=Path(__file__).parents[2], check=False)
    assert done.returncode != 0
    (tmp_path / "other.npz").write_bytes(b"kept")
    assert not (tmp_path / "block.npz").exists()
    assert len(list(tmp_path.iterdir())) == 2
    remove_leftovers(tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["other.npz"]


def test_permissions_are_those_that_other_new_files_have(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        (tmp_path / "plain").write_text("")
        write_text(tmp_path / "whole", "")
        (tmp_path / "folder").mkdir(0o700)
        open_up(tmp_path / "folder", 0o777)
    finally:
        os.umask(before)
    assert (tmp_path / "whole").stat().st_mode == (tmp_path / "plain").stat().st_mode
    assert stat.S_IMODE((tmp_path / "folder").stat().st_mode) == 0o750


def test_a_missing_folder_is_refused_with_advice(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"does not exist\. Create it, or choose another -o"):
        write_text(tmp_path / "no" / "a.txt", "")


def test_text_is_utf_8_with_line_feeds_and_has_a_hash(tmp_path: Path) -> None:
    write_text(tmp_path / "a.txt", "µm\n")
    assert (tmp_path / "a.txt").read_bytes() == b"\xc2\xb5m\n"
    assert sha256_of(tmp_path / "a.txt") == hashlib.sha256(b"\xc2\xb5m\n").hexdigest()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes here")
def test_a_pipe_has_no_hash_and_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(OSError, match="no regular file"):
        sha256_of(tmp_path / "pipe.csv")


def test_a_link_that_leads_round_in_a_circle_is_a_path_like_any_other(tmp_path: Path) -> None:
    (tmp_path / "round.csv").symlink_to("round.csv")
    assert real_path(tmp_path / "round.csv").name == "round.csv"
    (tmp_path / "there.csv").symlink_to(tmp_path / "one.csv")
    assert real_path(tmp_path / "there.csv") == real_path(tmp_path / "one.csv")
