"""What the system cannot do, in every command: exit code 2 and a sentence with the file's name, never a traceback."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import textwrap
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from calib.cli import app
from calib.cli.common import refusing_bad_input, telling
from models.surrogate.store import StoreError

ROOT = Path(__file__).parents[3]
LAB = ROOT / "datasets" / "padded_sensor" / "sensor1_instron.csv"
DESIGN = """
[indenter]
radius = "5 mm"
[sensor]
thickness = "0.74 mm"
radius = "10 mm"
young_modulus = "0.69 MPa"
relative_permittivity = 2.8
[padding]
thickness = "1.10 mm"
"""

# Commands that write a file: their words, and the ending of what they write.
WRITING: dict[str, tuple[tuple[object, ...], str]] = {
    "init": (("init", LAB, "-o"), ".toml"),
    "read": (("read", LAB, "-o"), ".csv"),
    "read, picture": (("read", LAB, "--picture"), ".png"),
    "simulate": (("simulate", "DESIGN", "--displacement", "0.2 mm", "--model", "closed-form", "-o"), ".csv"),
    "train": (("surrogate", "train", "--processes", "1", "--store", "STORE", "-o"), ".npz"),
    "train, store": (("surrogate", "train", "--processes", "1", "-o", "NEW", "--store"), ".sqlite"),
}


def refused(error: BaseException, capsys: pytest.CaptureFixture[str]) -> str:
    """What is said on stderr where a command meets an error."""
    with pytest.raises(typer.Exit) as caught, refusing_bad_input():
        raise error
    assert caught.value.exit_code == 2
    return " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize("number", sorted({*errno.errorcode} - {errno.EPIPE, errno.ESHUTDOWN}))
def test_whatever_the_system_says_is_a_sentence_with_the_file(number: int, capsys: pytest.CaptureFixture[str]) -> None:
    said = refused(OSError(number, os.strerror(number), "run/posterior.nc"), capsys)
    assert said.startswith("Error: run/posterior.nc: ")
    assert ". " in said  # what is wrong, and what to do


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (OSError(errno.ENOSPC, "No space left on device", b"run/x.nc"), "there is no room left on the disk. Make room"),
        (OSError("HDF5 says so"), "HDF5 says so"),
        (OSError(), "the system refuses it"),
        (OSError(errno.EBADF, "Bad file descriptor", 7), "Bad file descriptor"),
        (
            MemoryError("Unable to allocate 8 GiB"),
            "not enough memory (Unable to allocate 8 GiB). Close other programs",
        ),
        (MemoryError(), "there is not enough memory"),
        (BrokenProcessPool(), "a worker process was ended from outside"),
    ],
)
def test_what_names_no_file_is_a_sentence_too(error: BaseException, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert words in refused(error, capsys)


@pytest.mark.parametrize("command", WRITING)
@pytest.mark.parametrize("place", ["no/such/folder/f", "a folder", "a file/f", "n" * 250, "/proc/f"])
def test_an_output_that_cannot_be_written_is_refused_first(command: str, place: str, tmp_path: Path) -> None:
    words, ending = WRITING[command]
    output = tmp_path / f"{place}{ending}"
    (tmp_path / f"a folder{ending}").mkdir()
    (tmp_path / "a file").touch()
    (tmp_path / "design.toml").write_text(DESIGN, encoding="utf-8")
    before = sorted(tmp_path.iterdir())
    own = {"DESIGN": tmp_path / "design.toml", "STORE": tmp_path / "runs.sqlite", "NEW": tmp_path / "new.npz"}
    result = CliRunner().invoke(app, [str(own.get(str(word), word)) for word in (*words, output)])
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit)
    assert result.stderr.startswith(f"Error: {output}: ")
    assert ". " in result.stderr
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    "content", [b"", b"time,force\n", b"SQLite format 3\x00", b"PK\x03\x04", b"\x89HDF\r\n\x1a\n" + bytes(999)]
)
@pytest.mark.parametrize(
    "words",
    [
        ("surrogate", "info", "--surrogate", "BAD"),
        ("surrogate", "validate", "--surrogate", "BAD"),
        ("surrogate", "train", "-o", "NEW", "--improve", "BAD"),
        ("simulate", "DESIGN", "--force", "1 N", "--surrogate", "BAD"),
        ("report", "RUN"),
        ("recommend", "RUN", "--force", "1 N"),
        ("compare", "RUN", "RUN"),
        ("surrogate", "refine", "RUN"),
    ],
)
def test_a_file_that_is_none_is_named_and_refused(words: tuple[str, ...], content: bytes, tmp_path: Path) -> None:
    (tmp_path / "design.toml").write_text(DESIGN, encoding="utf-8")
    (tmp_path / "run").mkdir()
    bad = tmp_path / ("run/posterior.nc" if "RUN" in words else "bad.npz")
    bad.write_bytes(content)
    own = {"DESIGN": tmp_path / "design.toml", "NEW": tmp_path / "new.npz", "RUN": tmp_path / "run", "BAD": bad}
    result = CliRunner().invoke(app, [str(own.get(word, word)) for word in words])
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit)
    assert result.stderr.startswith(f"Error: {bad}: ")
    assert not (tmp_path / "new.npz").exists()


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EPIPE, errno.EBADF])
def test_what_cannot_be_told_of_a_whole_run_says_where_it_is(number: int, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(typer.Exit) as caught, telling(Path("my run")):
        raise OSError(number, os.strerror(number))
    assert caught.value.exit_code == 1
    said = " ".join(capsys.readouterr().err.split())
    assert said.startswith("Error: standard output: ")
    assert said.endswith('All results are written: calib report "my run"')


def test_what_a_store_of_curves_holds_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*_: object, **__: object) -> None:
        raise StoreError("is full")

    monkeypatch.setattr("models.surrogate.training.run_training", stopped)
    store = tmp_path / "runs.sqlite"
    store.touch()
    words = ("surrogate", "train", "--processes", "1", "--points", "80", "-o", str(tmp_path / "new.npz"), "--store", str(store))
    assert f"{store}: 0 loading curves of 80 are there" in CliRunner().invoke(app, list(words)).stderr


def test_a_reader_that_ends_early_leaves_a_sentence() -> None:
    code = """
        import typer
        from calib.cli.common import refusing_bad_input, say
        def talk() -> None:
            with refusing_bad_input():
                for _ in range(9999):  # more than a pipe holds
                    say("x" * 99)
        typer.run(talk)
    """
    words = [sys.executable, "-c", textwrap.dedent(code)]
    process = subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stderr is not None
    process.stdout.readline()
    process.stdout.close()
    said = process.stderr.read()
    process.stderr.close()
    assert process.wait() == 2
    assert " ".join(said.split()).startswith("Error: standard output: its reader ended before all was said.")
    assert "Traceback" not in said
    assert "Exception" not in said


@pytest.mark.parametrize("word", ["stdout", "stderr"])
def test_a_refusal_beside_a_stream_that_takes_nothing_keeps_its_exit_code(word: str) -> None:
    code = f"""
        import sys, typer
        from calib.cli.common import refusing_bad_input
        from calib.errors import Fault, InputError
        def talk() -> None:
            with refusing_bad_input():
                sys.{word}.reconfigure(line_buffering=False, write_through=False)
                sys.{word}.write("pending")
                raise InputError(Fault("no"))
        typer.run(talk)
    """
    buffered = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    words = [sys.executable, "-c", textwrap.dedent(code)]
    with open("/dev/full", "wb") as full:
        assert subprocess.run(words, cwd=ROOT, env=buffered, stdout=full, stderr=full, check=False).returncode == 2
