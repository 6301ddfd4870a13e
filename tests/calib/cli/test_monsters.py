"""Monstrous input: no file, however large, deep or strange, is waited for; each is refused at once with its name and advice."""

from __future__ import annotations

import os
import random
import signal
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from types import FrameType

import pytest
from typer.testing import CliRunner, Result

from calib.cli import app

#: Seconds of computation that a refusal may take, and characters that it may have.
LONGEST, MOST = 2.0, 2500

EXPERIMENT = """name = "x"
model = "closed form"
[indenter]
radius = RADIUS
[sensor]
radius = "10 mm"
EXTRA
[[specimens]]
name = "s"
force = FORCE
[specimens.priors]
sensor_thickness = { normal = ["0.74 mm", "0.02 mm"] }
padding_thickness = { normal = ["1.10 mm", "0.03 mm"] }
"""

HEADER = "Displacement (mm),Force (N)\n"
PRESS = HEADER + "".join(f"{0.004 * i:.5f},{0.02 * i**1.5:.6f}\n" for i in range(80))


@pytest.fixture(autouse=True)
def not_for_ever() -> Iterator[None]:
    """End a test that waits for what never comes, such as the writer of a pipe."""
    if not hasattr(signal, "setitimer"):
        yield
        return

    def ended(signum: int, frame: FrameType | None) -> None:
        raise TimeoutError("waited for 60 s")

    before = signal.signal(signal.SIGALRM, ended)
    signal.setitimer(signal.ITIMER_REAL, 60.0)
    yield
    signal.setitimer(signal.ITIMER_REAL, 0.0)
    signal.signal(signal.SIGALRM, before)


@pytest.fixture(scope="module", autouse=True)
def loaded(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Load what the commands load when they first run, which is no part of the time that is measured."""
    _calibrate(tmp_path_factory.mktemp("first"), _experiment())


def _experiment(radius: str = '"5 mm"', extra: str = "", force: str = '"missing.csv"') -> str:
    return EXPERIMENT.replace("RADIUS", radius).replace("EXTRA", extra).replace("FORCE", force)


def _run(*words: object) -> Result:
    return CliRunner().invoke(app, [str(word) for word in words])


def _calibrate(folder: Path, content: str | bytes) -> Result:
    path = folder / "experiment.toml"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return _run("calibrate", path, "-o", folder / "run", "--budget", 0)


def _refused(act: Callable[[], Result], *words: str) -> None:
    """Show that a command is refused at once, in a sentence that holds some words."""
    begin = time.process_time()
    result = act()
    assert time.process_time() - begin < LONGEST
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit)
    assert len(result.stderr) < MOST
    assert all(word in result.stderr for word in words), result.stderr


SPECIMEN = '[[specimens]]\nname = "s"\nforce = "missing.csv"\n'

#: What is in an experiment file, and what is said of it.
EXPERIMENTS: dict[str, tuple[str | bytes, str]] = {
    "5,000 digits": (_experiment("1" * 5000), "experiment.toml:4: a number of thousands of digits"),
    "hexadecimal digits": (_experiment("0x" + "f" * 50_000), "experiment.toml:4:1: a whole number of more than 64 bits"),
    "an exponent": (_experiment("1e400"), "experiment.toml:4:1: indenter_radius must be finite"),
    "an exponent of a quantity": (_experiment('"1e999999999999 mm"'), 'experiment.toml:4:1: indenter_radius: "1e99'),
    "a unit of 100,000 factors": (_experiment('"5 ' + "m*" * 100_000 + 'm"'), "(200003 characters)"),
    "a unit in brackets": (_experiment('"5 ' + "(" * 50_000 + 'm"'), "experiment.toml:4:1: indenter_radius"),
    "a power of a unit": (_experiment('"5 mm**9**9**9"'), 'experiment.toml:4:1: indenter_radius: unknown unit "mm**9**9**9"'),
    "a quantity of 1 MB": (_experiment('"' + "1" * 1_000_000 + ' mm"'), "experiment.toml: has more than 1 MB"),
    "50,000 keys": (_experiment(extra="\n".join(f"k{i} = 1" for i in range(50_000))), ":7:1: 50000 unknown keys in [sensor]"),
    "50,000 specimens": ("[[specimens]]\n" * 50_000, "experiment.toml: has more than 10000 tables"),
    "3,000 specimens": (_experiment() + SPECIMEN * 3000, "3001 times [[specimens]], more than 2000"),
    "deep arrays": (_experiment(extra="x = " + "[" * 100_000 + "]" * 100_000), "experiment.toml: is nested too deeply. Look"),
    "deep tables": (_experiment(extra="x = " + "{a=" * 50_000 + "1" + "}" * 50_000), "experiment.toml: is nested too deeply"),
    "deep keys": (_experiment(extra=".".join(["a"] * 100_000) + " = 1"), "experiment.toml: is nested too deeply"),
    "an array of 100,000": (_experiment(extra="x = [" + "1," * 100_000 + "]"), 'experiment.toml:7:1: unknown key "x"'),
    "a prior of 50,000": (
        _experiment(extra="[priors]\nyoung_modulus = { normal = [" + '"1 MPa",' * 50_000 + "] }"),
        "experiment.toml:8:1: young_modulus: normal takes [mean, sd], got 50000 values",
    ),
    "a name of 900,000": (_experiment().replace('"x"', '"' + "x" * 900_000 + '"'), "experiment.toml:1:1: name"),
    "a file's name of 100,000": (_experiment(force='"' + "x" * 100_000 + '"'), "experiment.toml:10:1: force file not found"),
    "a file's name with zero": (
        _experiment(force='"a\\u0000b"'),
        'experiment.toml:10:1: force is not the name of a file, got "a\\x00b"',
    ),
    "20,000 columns": (
        _experiment(force='{ file = "press.csv", where = {' + ",".join(f"k{i}=1" for i in range(20_000)) + "} }"),
        "experiment.toml:10:31: where names 20000 columns",
    ),
    "50,000 cycles": (_experiment(force='"press.csv"\nuse = { cycles = [' + "1," * 50_000 + "] }"), "cycles names one twice"),
    "an escape sequence": (_experiment(extra='law = "\\u001b[31mred"'), 'got "\\x1b[31mred"'),
    "binary": (random.Random(1).randbytes(100_000), "experiment.toml:1:"),
    "zeros": (b"\0" * 1000, "experiment.toml: is not UTF-8 text, found a byte of zero"),
    "UTF-16": (_experiment().encode("utf-16"), "experiment.toml:1:1: is not UTF-8 text"),
}


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_monstrous_experiments_are_refused_at_once(tmp_path: Path, name: str) -> None:
    content, said = EXPERIMENTS[name]
    (tmp_path / "press.csv").write_text(PRESS)
    _refused(lambda: _calibrate(tmp_path, content), "experiment.toml", said)
    assert not (tmp_path / "run").exists()


#: What is in a lab file, and what is said of it.
LAB_FILES: dict[str, tuple[str | bytes, str]] = {
    "zeros": (HEADER + "".join(f"{0.004 * i:.5f},0.0\n" for i in range(500)), "force reads 0 N in every row that is used"),
    "a constant": (
        HEADER + "".join(f"{0.004 * i:.5f},1.5\n" for i in range(500)),
        "force reads 1.5 N in every row that is used",
    ),
    "infinities": (HEADER + "".join(f"{0.004 * i:.5f},{'nan' if i % 2 else 'inf'}\n" for i in range(100)), "over-range inf"),
    "beyond all numbers": (HEADER + "".join(f"{0.004 * i:.5f},{i}e308\n" for i in range(100)), "only 0 usable rows of force"),
    "5,000 digits": (HEADER + "".join(f"{'1' * 5000},{i}\n" for i in range(300)), "press.csv"),
    "a line of 1 MB": ("1" * 1_000_000 + "\n" + PRESS, "press.csv:1: a line of 1000000 characters"),
    "100,000 columns": (",".join(f"c{i} (N)" for i in range(100_000)) + "\n", "press.csv:1: a line of more than 20000"),
    "line ends": ("\n" * 1_000_000, "press.csv: the file is empty"),
    "brackets": (PRESS.replace("Force (N)", "Force " + "(" * 9000 + "N" + ")" * 9000), "press.csv"),
    "spaces": ((" " * 19_000 + "1\n") * 100, "press.csv"),
    "commas": (("1," * 9000 + "\n") * 100, "press.csv:1: no header row"),
    "deep JSON": ('{"a": ' + "[" * 100_000 + "]" * 100_000 + "}", "press.csv: lists stand in each other by the hundred"),
    "binary": (random.Random(1).randbytes(1_000_000), "press.csv: the file is not text"),
    "nothing": ("", "press.csv: the file is empty"),
}


@pytest.mark.parametrize("name", LAB_FILES)
def test_monstrous_lab_files_are_refused_at_once(tmp_path: Path, name: str) -> None:
    content, said = LAB_FILES[name]
    (tmp_path / "press.csv").write_bytes(content.encode() if isinstance(content, str) else content)
    _refused(lambda: _calibrate(tmp_path, _experiment(force='"press.csv"')), said)
    assert not (tmp_path / "run").exists()


def test_a_lab_file_of_gigabytes_is_not_read(tmp_path: Path) -> None:
    with (tmp_path / "press.csv").open("wb") as file:
        file.write(PRESS.encode())
        file.truncate(3_000_000_000)  # holes, which take no room
    _refused(lambda: _calibrate(tmp_path, _experiment(force='"press.csv"')), "press.csv: has 3.0 GB, too many")


@pytest.mark.skipif(os.name == "nt", reason="pipes and devices as POSIX has them")
@pytest.mark.parametrize("what", ["pipe", "device", "folder"])
def test_what_is_no_file_is_not_waited_for(tmp_path: Path, what: str) -> None:
    path = {"pipe": tmp_path / "pipe", "device": Path("/dev/zero"), "folder": tmp_path / "folder"}[what]
    if what == "pipe":
        os.mkfifo(path)
    elif what == "folder":
        path.mkdir()
    (tmp_path / "design.toml").write_text(
        'indenter.radius="5 mm"\nsensor.thickness="0.74 mm"\nsensor.radius="10 mm"\nsensor.young_modulus="0.69 MPa"\n'
        'sensor.relative_permittivity=2.8\npadding.thickness="1.1 mm"\n'
    )
    name = str(path)
    commands: list[tuple[object, ...]] = [
        ("calibrate", path, "-o", tmp_path / "run"),
        ("read", path),
        ("init", path, "-o", tmp_path / "new.toml"),
        ("simulate", path, "--force", "5 N"),
        ("simulate", tmp_path / "design.toml", "--force", "5 N", "--surrogate", path),
        ("surrogate", "info", "--surrogate", path),
        ("report", path),
        ("verify", path),
    ]
    for words in commands:
        _refused(partial(_run, *words), name)
    _refused(lambda: _calibrate(tmp_path, _experiment(force=f'"{name}"')), "experiment.toml:10:1", name)


@pytest.mark.parametrize(
    "force", ["1e400 N", "inf N", "nan N", "5 N**999999999", "5 " + "N*" * 5000 + "N", "5 9**9**9**9 N", "1" * 5000 + " N"]
)
def test_monstrous_quantities_of_options_are_refused_at_once(tmp_path: Path, force: str) -> None:
    _refused(lambda: _run("simulate", tmp_path / "design.toml", "--force", force), "--force")


@pytest.mark.parametrize(
    "words",
    [
        ("\x1b[31mcommand",),
        ("--\x1b[31moption",),
        ("calibrate", "--\x1b[31moption"),
        ("calibrate", "e.toml", "-o", "run", "\x1b]0;more\x07"),
        ("calibrate", "e.toml", "-o", "run", "--budget", "\x1b[31m"),
        ("simulate", "e.toml", "--model", "\x1b[31m\u202e"),
        ("surrogate", "\x1b[31mcommand"),
        ("surrogate", "info", "--family", "\x1b[31m"),
        ("report", "\x1b[31mrun"),
        ("read", "a\x1b[31m.csv"),
    ],
)
def test_escape_sequences_of_the_command_line_are_written_out(words: tuple[str, ...]) -> None:
    result = _run(*words)
    assert result.exit_code == 2
    assert "\\x1b" in result.stderr or "should be a valid number" in result.stderr
    assert not set(result.stdout + result.stderr) & set("\x1b\x07\u202e")
