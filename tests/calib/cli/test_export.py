"""The command `export`: files for a gripper from a run, all or none, and never from numbers that must not be used."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from calib.checks import AMBER_ALLOWS
from calib.cli import app
from calib.files import write_text
from calib.sampling.posterior import Posterior
from calib.sampling.storage import save_posterior
from models.analytic import ClosedForm

FILES = ["README.md", "force_tables.csv", "force_tables.h", "force_tables.json", "force_tables.py", "taxels.json"]


def _run(*words: object) -> Result:
    return CliRunner().invoke(app, [str(w) for w in words])


def _said(result: Result) -> str:
    return " ".join((result.stdout + result.stderr).split())


@pytest.fixture(scope="module")
def runs(make_posterior: Callable[..., Posterior], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with runs: one that may be used, and one that has not converged."""
    folder = tmp_path_factory.mktemp("runs")
    for name, converged in (("good", True), ("red", False)):
        (folder / name).mkdir()
        save_posterior(make_posterior(converged), folder / name / "posterior.nc", ClosedForm())
    return folder


def test_export_writes_all_files_with_the_verdict_and_where_they_come_from(runs: Path, tmp_path: Path) -> None:
    result = _run("export", runs / "good", "--padding", "3 mm", "--draws", 100, "-o", tmp_path / "gripper")
    assert result.exit_code == 0, _said(result)
    assert sorted(path.name for path in tmp_path.glob("gripper/*")) == FILES
    plain = json.loads((tmp_path / "gripper" / "force_tables.json").read_text(encoding="utf-8"))
    assert [t["name"] for t in plain["tables"]] == ["sensor 1", "sensor 2", "next specimen", "next specimen on 3 mm of padding"]
    assert plain["verdict"]["colour"] == "amber"
    assert len(plain["posterior_sha256"]) == 64
    assert f"Amber: the tables {AMBER_ALLOWS}." in _said(result)
    assert "next specimen on 3 mm of padding" in _said(result)


def test_readings_of_the_tare_have_an_option_of_their_own_and_a_tare_is_a_capacitance(runs: Path, tmp_path: Path) -> None:
    result = _run("export", runs / "good", "--tare-readings", 16, "--draws", 100, "-o", tmp_path / "gripper")
    assert result.exit_code == 0, _said(result)
    assert "tare the mean of 16 readings" in (tmp_path / "gripper" / "README.md").read_text(encoding="utf-8")
    for word in ("16", "97.5 pF"):
        result = _run("export", runs / "good", "--tare", word, "-o", tmp_path / "other")
        assert result.exit_code == 2
        assert "Say --tare-readings 64" in _said(result)
    assert not (tmp_path / "other").exists()


def test_what_is_not_known_of_unloading_is_said_in_every_file(runs: Path, tmp_path: Path) -> None:
    assert _run("export", runs / "good", "--draws", 100, "-o", tmp_path / "gripper").exit_code == 0
    for name in FILES:
        text = (tmp_path / "gripper" / name).read_text(encoding="utf-8")
        assert "unloading is not covered, and by how much it is off is not known (sensor 1: " in text, name
    plain = json.loads((tmp_path / "gripper" / "force_tables.json").read_text(encoding="utf-8"))
    assert [table["unloading"] for table in plain["tables"]] == [None, None, None]


def test_strict_makes_amber_an_exit_code_of_3_with_all_files_written(runs: Path, tmp_path: Path) -> None:
    result = _run("export", runs / "good", "--padding", "3 mm", "--draws", 100, "--strict", "-o", tmp_path / "gripper")
    assert result.exit_code == 3
    assert sorted(path.name for path in tmp_path.glob("gripper/*")) == FILES


def test_a_red_run_is_not_exported(runs: Path, tmp_path: Path) -> None:
    result = _run("export", runs / "red", "-o", tmp_path / "gripper")
    assert result.exit_code == 3
    assert "is red: its numbers must not be used, and nothing is exported" in _said(result)
    assert "red, convergence" in _said(result)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--padding", "5.5"), "--padding"),
        (("--padding", "-1 mm"), "padding thickness must not be negative or infinite, got -1 mm"),
        (("--force", "0 N"), "force must be positive"),
        (("--parasitic", "2 pF"), 'Write "2 pF, 0.2 pF"'),
        (("--parasitic", "2 pF, 1 mm"), "--parasitic"),
        (("--noise", "10 nF"), "no reading of sensor 1 tells that it is pressed"),
    ],
)
def test_what_cannot_be_exported_is_refused_and_nothing_written(
    runs: Path, tmp_path: Path, words: tuple[str, ...], said: str
) -> None:
    result = _run("export", runs / "good", *words, "--draws", 100, "-o", tmp_path / "gripper")
    assert result.exit_code == 2, _said(result)
    assert said in _said(result)
    assert not list(tmp_path.iterdir())


def test_a_folder_that_exists_or_has_no_place_is_refused(runs: Path, tmp_path: Path) -> None:
    (tmp_path / "taken").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    for name, said in (("taken", "exists and is not overwritten"), ("link", "exists"), ("no/where", "does not exist")):
        result = _run("export", runs / "good", "-o", tmp_path / name)
        assert result.exit_code == 2
        assert said in _said(result)
    assert not list((tmp_path / "taken").iterdir())


@pytest.mark.parametrize("files", [0, 5])
def test_a_full_disk_leaves_nothing_behind(runs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, files: int) -> None:
    written: list[Path] = []

    def full(path: Path, text: str) -> None:
        if len(written) == files:
            raise OSError(28, "No space left on device", str(path))
        written.append(path)
        write_text(path, text)

    monkeypatch.setattr("calib.runs.export.write_text", full)
    result = _run("export", runs / "good", "--draws", 100, "-o", tmp_path / "gripper")
    assert result.exit_code == 2
    assert "gripper: " in _said(result)
    assert not list(tmp_path.iterdir())


def test_a_damaged_run_is_refused(runs: Path, tmp_path: Path) -> None:
    content = bytearray((runs / "good" / "posterior.nc").read_bytes())
    content[len(content) // 2] ^= 1
    (tmp_path / "posterior.nc").write_bytes(content)
    result = _run("export", tmp_path, "-o", tmp_path / "gripper")
    assert result.exit_code == 2
    assert "posterior.nc" in _said(result)
    assert not (tmp_path / "gripper").exists()


@pytest.fixture(scope="module")
def advised(
    runs: Path, tmp_path_factory: pytest.TempPathFactory, undrawing: Callable[[], AbstractContextManager[None]]
) -> Path:
    """A run with a recommendation for a larger force than was measured."""
    run = tmp_path_factory.mktemp("advised") / "run"
    shutil.copytree(runs / "good", run)
    with undrawing():
        result = _run("recommend", run, "--force", "9 N", "--padding", "2 mm:4 mm", "--steps", 3, "--draws", 50)
    assert result.exit_code == 0, _said(result)
    return run


def test_a_table_that_ends_before_the_force_of_the_recommendation_says_so_everywhere(advised: Path, tmp_path: Path) -> None:
    result = _run("export", advised, "--padding", "3 mm", "--draws", 100, "-o", tmp_path / "gripper")
    assert result.exit_code == 0, _said(result)
    measured = json.loads((tmp_path / "gripper" / "force_tables.json").read_text(encoding="utf-8"))["tables"]
    told = (
        f"the recommendation in this run is for 9 N, and this table is for {measured[-1]['rated_N']:.3g} N, "
        'the largest force that was measured. Make it for 9 N (--force "9 N")'
    )
    assert told in _said(result)
    assert told in " ".join((tmp_path / "gripper" / "README.md").read_text(encoding="utf-8").split())
    assert [table["verdict"]["colour"] for table in measured[:2]] == ["green", "green"]
    result = _run("export", advised, "--padding", "3 mm", "--force", "9 N", "--draws", 100, "-o", tmp_path / "more")
    assert result.exit_code == 0, _said(result)
    assert "the recommendation in this run" not in _said(result)
    # Without a design there is nothing that the recommendation is of.
    result = _run("export", advised, "--draws", 100, "-o", tmp_path / "measured")
    assert "the recommendation in this run" not in _said(result)


# --- one reading --------------------------------------------------------------------------------------------------------


def _force(run: Path, *words: object) -> tuple[int, str]:
    result = _run("force", run, *words, "--draws", 100)
    return result.exit_code, _said(result)


def test_one_reading_means_the_force_that_the_exported_table_says(runs: Path, tmp_path: Path) -> None:
    exported = _run("export", runs / "good", "--padding", "3 mm", "--draws", 100, "-o", tmp_path / "gripper")
    assert exported.exit_code == 0, _said(exported)
    table = json.loads((tmp_path / "gripper" / "force_tables.json").read_text(encoding="utf-8"))["tables"][-1]
    tare = 1e12 * table["tare_F"][1]
    reading = tare * (1 + 0.5 * table["ratio"][-1])
    force, lower, upper = (
        np.interp(0.5 * table["ratio"][-1], table["ratio"], table[n]) for n in ("force_N", "lower_N", "upper_N")
    )
    code, said = _force(runs / "good", f"{reading:.9f} pF", "--tare", f"{tare:.9f} pF", "--padding", "3 mm")
    assert code == 0, said
    found = re.search(r"pF: ([0-9.]+) N \(90 %: ([0-9.]+) to ([0-9.]+) N\)\.", said)
    assert found is not None, said
    assert [float(x) for x in found.groups()] == pytest.approx([force, lower, upper], abs=0.02 * (upper - lower))
    assert "Amber: the force" in said  # 3 mm were not measured
    assert "sensor 1, " not in said
    assert f"{table['force_N'][-1]:.4g} N; tare to be expected: " in said


@pytest.mark.parametrize("asked", [("--padding", "3 mm"), ("--noise", "2 fF", "--force", "1.5 N")])
def test_the_command_in_the_readme_reads_the_table_that_the_readme_shows(
    asked: tuple[str, ...], runs: Path, tmp_path: Path
) -> None:
    exported = _run("export", runs / "good", *asked, "--draws", 100, "-o", tmp_path / "gripper")
    assert exported.exit_code == 0, _said(exported)
    readme = (tmp_path / "gripper" / "README.md").read_text(encoding="utf-8")
    (shown,) = set(re.findall(r"TABLES\['(.*?)'\]", readme))
    (command,) = re.findall(r"^calib (force RUN .*)$", readme, re.MULTILINE)
    table = next(
        t
        for t in json.loads((tmp_path / "gripper" / "force_tables.json").read_text(encoding="utf-8"))["tables"]
        if t["name"] == shown
    )
    tare = 1e12 * table["tare_F"][1]
    reading = tare * (1 + 0.5 * table["ratio"][-1])
    words = shlex.split(command.replace("100 pF", f"{reading:.9f} pF").replace("97.5 pF", f"{tare:.9f} pF"))
    code, said = _force(runs / "good", *words[2:])
    assert code == 0, said
    (force,) = re.findall(r"pF: ([0-9.]+) N \(90 %", said)
    assert float(force) == pytest.approx(np.interp(0.5 * table["ratio"][-1], table["ratio"], table["force_N"]), rel=0.05)


def test_a_reading_without_a_tare_means_nothing_and_what_tare_to_expect_is_said(runs: Path) -> None:
    code, said = _force(runs / "good", "100 pF")
    assert code == 2
    assert "100 pF alone means nothing: a sensor is read against its own tare" in said
    assert "sensor 1, " in said
    assert 'Read it without contact, and give it: --tare "97.5 pF"' in said


def test_readings_of_which_no_force_is_known_say_so(runs: Path) -> None:
    (expected,) = re.findall(r"sensor 1, (?:about )?([0-9.]+)", _force(runs / "good", "100 pF", "--sensor", "sensor 1")[1])
    tare = float(expected)
    readings = [f"{share * tare:.6f} pF" for share in (1.0, 1.5, 0.9)]
    code, said = _force(runs / "good", *readings, "--tare", f"{tare} pF", "--sensor", "sensor 1")
    assert code == 0, said
    assert "no contact that noise would not explain as well; at most" in said
    assert "and how much more is not known: the table ends at" in said
    assert "nothing, as it is farther below rest than noise explains" in said
    assert "Amber: the forces" in said
    assert said.count("amber, reading: Sensor 1: ") == 2
    code, said = _force(runs / "good", readings[0], "--tare", f"{tare} pF", "--sensor", "sensor 1")
    assert "amber, reading" not in said  # no contact is an answer


def test_a_recommendation_that_is_not_as_it_was_written_tells_no_force_to_export_for(advised: Path, tmp_path: Path) -> None:
    run = tmp_path / "damaged"
    shutil.copytree(advised, run)
    path = run / "recommendation.json"
    path.write_text(path.read_text(encoding="utf-8")[:-300], encoding="utf-8")
    for words in (("export", run, "-o", tmp_path / "gripper"), ("force", run, "98 pF", "--tare", "97 pF")):
        result = _run(*words, "--padding", "3 mm", "--draws", 100)
        assert (result.exit_code, "recommendation.json" in _said(result)) == (2, True), _said(result)
        assert "run `calib recommend` again" in _said(result)
    assert not (tmp_path / "gripper").exists()


def test_a_tare_that_cannot_be_of_a_sensor_is_amber_or_leaves_it_out(runs: Path) -> None:
    code, said = _force(runs / "good", "130 pF", "--tare", "120 pF", "--sensor", "sensor 1", "--strict")
    assert code == 3
    assert "amber, tare: Sensor 1: a tare of 120 pF is not what is to be expected of it" in said
    code, said = _force(runs / "good", "98.5 nF", "--tare", "97.5 nF", "--sensor", "sensor 1")
    assert (code, "Check its unit, and that of the readings" in said, "would make of it" in said) == (0, True, False), said
    low, high = (float(x) for x in re.findall(r"sensor [12], (?:about )?([0-9.]+)", _force(runs / "good", "100 pF")[1]))
    assert abs(high / low - 1) > 0.02
    code, said = _force(runs / "good", f"{1.001 * low} pF", "--tare", f"{low} pF")
    assert code == 0, said
    assert f"sensor 2: left out, a tare of {low:.6g} pF is not what is to be expected of it" in said
    assert "Green: the forces can be used." in said


def test_a_tare_too_low_is_amber_with_what_it_makes_of_the_sensor_at_rest(runs: Path) -> None:
    tare = float(re.findall(r"sensor 1, (?:about )?([0-9.]+)", _force(runs / "good", "100 pF")[1])[0])
    words = ("--sensor", "sensor 1", "--strict")
    code, said = _force(runs / "good", f"{tare} pF", "--tare", f"{0.999 * tare} pF", *words)
    assert code == 3, said
    (load,) = re.findall(r"what is expected at rest reads as (?:more than )?([0-9.]+) N with it", said)
    # What was read is at rest, and a force is said of it, all of which the tare makes.
    assert float(load) == pytest.approx(float(re.findall(r"pF: ([0-9.]+) N", said)[0]), abs=0.06)


def test_a_padding_beside_a_sensor_that_does_not_lie_on_it_is_refused(runs: Path) -> None:
    words = ("100 pF", "--tare", "97 pF", "--padding", "3 mm", "--sensor")
    for name in ("sensor 1", "next specimen"):
        code, said = _force(runs / "good", *words, name)
        assert code == 2
        assert f'--padding "3 mm" beside --sensor "{name}", which lies on' in said
        assert 'on --padding lies "next specimen on 3 mm of padding"' in said
    code, said = _force(runs / "good", *words, "next specimen on 3 mm of padding")
    assert code == 0, said


def test_a_tare_that_was_taken_under_a_load_is_told_from_one_at_rest_and_by_which_load(runs: Path, tmp_path: Path) -> None:
    exported = _run("export", runs / "good", "-o", tmp_path / "gripper", "--padding", "3 mm", "--draws", 400)
    assert exported.exit_code == 0, _said(exported)
    tables = json.loads((tmp_path / "gripper" / "force_tables.json").read_text(encoding="utf-8"))["tables"]
    table = next(t for t in tables if t["name"] == "sensor 1")
    rest = 1e12 * table["tare_F"][2]
    for share in (0.4, 0.7, 0.95):
        force = share * table["force_N"][-1]
        tare = rest * (1 + float(np.interp(force, table["force_N"], table["ratio"])))
        code, said = _force(
            runs / "good", f"{1.0005 * tare} pF", "--tare", f"{tare:.6f} pF", "--sensor", "sensor 1", "--strict"
        )
        assert code == 3, said
        (load,) = re.findall(r"it is what ([0-9.]+) N would make of it", said)
        assert float(load) == pytest.approx(force, rel=0.05)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("100", "--tare", "97 pF"), "has no unit"),
        (("100 N", "--tare", "97 pF"), "CAPACITANCE"),
        (("0 pF", "--tare", "97 pF"), 'a capacitance is positive, got "0 pF"'),
        (("100 pF", "--tare", "nan pF"), "--tare"),
        (("100 pF", "--tare", "97 pF", "--sensor", "sensor 9"), 'Choose one of "sensor 1", "sensor 2", "next specimen"'),
    ],
)
def test_what_is_no_reading_is_refused(runs: Path, words: tuple[str, ...], told: str) -> None:
    code, said = _force(runs / "good", *words)
    assert (code, told in said) == (2, True), said


def test_no_force_is_read_from_a_red_run(runs: Path) -> None:
    code, said = _force(runs / "red", "100 pF", "--tare", "97 pF")
    assert code == 3
    assert "is red: its numbers must not be used, and nothing is read from it" in said
