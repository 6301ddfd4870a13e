"""`calib read` and `calib init` on what labs have: folders, several specimens, wrong units, cycles."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner, Result

from calib.cli import app
from calib.errors import InputError
from calib.experiment.experiment_file import read_experiment
from calib.experiment.record import experiment_from_json, experiment_to_json
from calib.experiment.sweeps import read_sweeps
from calib.lab.pressing import make_sweep
from calib.lab.use import Use


def _run(*words: object) -> Result:
    return CliRunner().invoke(app, [str(w) for w in words])


def _line(text: str) -> str:
    return " ".join(text.split())


def _press(start: float, scale: float = 1.0, cycles: int = 1) -> str:
    """Rows time, displacement in mm, force in N of presses to 0.6 mm and back, from `start` s on."""
    x = np.concatenate([np.concatenate([np.linspace(-0.1, 0.6, 60), np.linspace(0.6, -0.1, 60)[1:]]) for _ in range(cycles)])
    force = scale * np.maximum(x, 0) ** 1.5 * 8 + 0.003 * np.sin(37.0 * np.arange(x.size))
    return "".join(f"{start + 0.1 * i:.2f},{d:.5f},{f:.4f}\n" for i, (d, f) in enumerate(zip(x, force, strict=True)))


def _log(n: int = 120) -> str:
    x = np.concatenate([np.linspace(-0.1, 0.6, n // 2), np.linspace(0.6, -0.1, n - n // 2)])
    c = 97.3 + 3 * np.maximum(x, 0) ** 2 + 0.004 * np.sin(23.0 * np.arange(n))
    return "".join(f"{0.1 * i:.2f},{v:.4f},0.0012\n" for i, v in enumerate(c))


TESTER = "Time (s),Extension (mm),Load (N)\n"
LCR = "Time (s),Cp (pF),D\n"


def test_read_tells_noise_resolution_cycles_and_quality_and_draws(tmp_path: Path) -> None:
    (tmp_path / "press.csv").write_text(TESTER + _press(0.0, cycles=3))
    result = _run("read", tmp_path / "press.csv", "--cycles", 2, "--picture", tmp_path / "p.png", "-o", tmp_path / "o.csv")
    assert result.exit_code == 0, result.output
    said = _line(result.stdout)
    for words in ("delimiter comma", "decimal point", "3 cycles, cycle 2 is used", "noise", "0.0001", "hysteresis"):
        assert words in said
    assert (tmp_path / "p.png").read_bytes()[:4] == b"\x89PNG"
    table = pd.read_csv(tmp_path / "o.csv")
    assert set(table["cycle"][table["used"]]) == {2}
    assert _run("read", tmp_path / "press.csv", "--cycles", 4).exit_code == 2


def test_names_with_square_brackets_are_shown_whole(tmp_path: Path) -> None:
    (tmp_path / "press.csv").write_text("Time [s],Weg [mm],Kraft [in N]\n" + _press(0.0))
    result = _run("read", tmp_path / "press.csv")
    assert result.exit_code == 0, result.output
    in_table = [line for line in result.stdout.splitlines() if line.startswith("│")]
    for name in ("Time [s]", "Weg [mm]", "Kraft [in N]"):
        assert any(name in line for line in in_table), result.stdout


def test_what_the_user_says_of_units_and_columns_replaces_what_the_file_says(tmp_path: Path) -> None:
    (tmp_path / "press.csv").write_text("Time (s),Extension (mm),Load 1,Load 2 (N)\n0,0.1,0.001,5\n1,0.2,0.002,6\n")
    refused = _run("read", tmp_path / "press.csv")
    assert refused.exit_code == 2
    result = _run("read", tmp_path / "press.csv", "--columns", "force=Load 1", "--units", "force=kN", "-o", tmp_path / "o.csv")
    assert result.exit_code == 0, result.output
    assert "read as kN" in result.stdout
    np.testing.assert_allclose(pd.read_csv(tmp_path / "o.csv")["force_N"], [1.0, 2.0], rtol=1e-15)
    by_number = _run("read", tmp_path / "press.csv", "--columns", "force=4", "-o", tmp_path / "o.csv")
    assert by_number.exit_code == 0, by_number.output
    np.testing.assert_allclose(pd.read_csv(tmp_path / "o.csv")["force_N"], [5.0, 6.0])


def test_what_is_advised_of_a_capacitance_that_may_be_in_series_can_be_pasted(tmp_path: Path) -> None:
    rows = "".join(f"{0.1 * k:.1f},{52.3 + 0.02 * k:.4f},0.35\n" for k in range(40))
    (tmp_path / "lcr.csv").write_text("t (s),C (pF),D\n" + rows)
    refused = _run("read", tmp_path / "lcr.csv")
    assert '--columns "capacitance_series=C (pF)" for Cs' in _line(refused.stderr)
    result = _run("read", tmp_path / "lcr.csv", "--columns", "capacitance_series=C (pF)", "-o", tmp_path / "o.csv")
    assert result.exit_code == 0, result.output
    np.testing.assert_allclose(pd.read_csv(tmp_path / "o.csv")["capacitance_F"][0], 52.3e-12 / (1 + 0.35**2), rtol=1e-6)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--units", "force"], "not of the form quantity=value"),
        (["--units", "weight=kN"], "The quantities are time"),
        (["--units", "force=tons"], "one of N, mN"),
        (["--units", "capacitance=pF"], "there is no capacitance column"),
        (["--columns", "force=Weight"], 'no column "Weight"'),
        (["--specimen", "2"], "there is no specimen 2"),
        (["--picture", "p.jpeg"], "a picture ends in"),
    ],
)
def test_wrong_options_of_read_say_what_is_wrong_and_write_nothing(tmp_path: Path, words: list[str], message: str) -> None:
    (tmp_path / "press.csv").write_text(TESTER + _press(0.0))
    result = _run("read", tmp_path / "press.csv", *words, "-o", tmp_path / "o.csv")
    assert result.exit_code == 2, result.output
    assert message in _line(result.stderr)
    assert not (tmp_path / "o.csv").exists()


def test_a_folder_becomes_an_experiment_with_what_was_left_out(tmp_path: Path) -> None:
    folder = tmp_path / "measured"
    (folder / "lcr").mkdir(parents=True)
    (folder / "A1_instron.csv").write_text(TESTER + _press(0.0))
    (folder / "lcr" / "A1_hioki.txt").write_text(LCR + _log())
    (folder / "thicknesses.csv").write_text("specimen,thickness\nA1,0.74\n")
    (folder / "both.csv").write_text(TESTER + _press(0.0) + "\n" + TESTER + _press(0.0, scale=2.0))
    result = _run("init", folder, "-o", tmp_path / "experiment.toml")
    assert result.exit_code == 0, result.output
    assert "paired by name" in result.stdout
    assert "left out" in result.stdout
    text = (tmp_path / "experiment.toml").read_text()
    assert "thicknesses.csv" in text
    plan = read_experiment(tmp_path / "experiment.toml")
    assert [s.name for s in plan.specimens] == ["A1", "both 1", "both 2"]
    first, second = (plan.specimens[k].sweeps[0] for k in (1, 2))
    assert (first.force_reading.specimen, second.force_reading.specimen) == (1, 2)
    both = [make_sweep("s", "", 5e-3, f.force, None, force_reading=f.force_reading) for f in (first, second)]
    ones, twos = (sweep.channels["force"].value for sweep in both)
    assert np.max(twos) == pytest.approx(2 * np.max(ones), rel=0.02)


def test_files_whose_names_say_nothing_are_paired_by_the_time_at_which_they_began(tmp_path: Path) -> None:
    for k, hour in ((1, 10), (2, 11)):
        date = f"Start,2024-05-02 {hour}:00:0{k}\n"
        (tmp_path / f"Specimen_RawData_{k}.csv").write_text(date + TESTER + _press(0.0))
        (tmp_path / f"{'xy'[2 - k]}.csv").write_text(date + LCR + _log())
    result = _run("init", tmp_path, "-o", tmp_path / "experiment.toml")
    assert result.exit_code == 0, result.output
    plan = read_experiment(tmp_path / "experiment.toml")
    files = [s.sweeps[0] for s in plan.specimens]
    paired = {f.force.name: f.capacitance.name for f in files if f.force is not None and f.capacitance is not None}
    assert paired == {"Specimen_RawData_1.csv": "y.csv", "Specimen_RawData_2.csv": "x.csv"}
    assert "paired by time: the records began 0 s apart" in (tmp_path / "experiment.toml").read_text()


def test_raw_data_of_bluehill_are_called_by_their_sample(tmp_path: Path) -> None:
    for sample in ("S7", "S8"):
        (tmp_path / f"{sample}.is_ccyclic_RawData").mkdir()
        (tmp_path / f"{sample}.is_ccyclic_RawData" / "Specimen_RawData_1.csv").write_text(TESTER + _press(0.0))
        (tmp_path / f"{sample}_1_hioki.csv").write_text(LCR + _log())
    result = _run("init", tmp_path, "-o", tmp_path / "experiment.toml")
    assert result.exit_code == 0, result.output
    plan = read_experiment(tmp_path / "experiment.toml")
    pairs = {s.name: s.sweeps[0].capacitance.name for s in plan.specimens if s.sweeps[0].capacitance and s.sweeps[0].force}
    assert pairs == {"S7_1": "S7_1_hioki.csv", "S8_1": "S8_1_hioki.csv"}


def test_names_that_agree_with_times_that_do_not_are_to_be_checked(tmp_path: Path) -> None:
    (tmp_path / "A_instron.csv").write_text("Start,2024-05-02 10:00:00\n" + TESTER + _press(0.0))
    (tmp_path / "A_lcr.csv").write_text("Start,2024-05-03 10:00:00\n" + LCR + _log())
    result = _run("init", tmp_path, "-o", tmp_path / "experiment.toml")
    assert "but the records began 24.0 h apart: check" in result.stdout


def test_init_lists_every_file_and_says_what_is_open_and_what_to_do_next(tmp_path: Path) -> None:
    lab = tmp_path / "lab"
    (lab / "old").mkdir(parents=True)
    (lab / "s1_press.csv").write_text(TESTER + _press(0.0))
    (lab / "old" / "s1_cap.csv").write_text(LCR + _log())
    twice = "".join(f"{line},{line.split(',')[2]}9\n" for line in _press(0.0).splitlines())
    (lab / "s2_press.csv").write_text("Time (s),Extension (mm),Load (N),Load (N)\n" + twice)
    (lab / ".hidden").write_text("x")
    (lab / "photo.png").write_bytes(b"\x89PNG")
    result = _run("init", lab, "-o", lab / "experiment.toml")
    assert result.exit_code == 0, result.output
    said = [" ".join(line.split()) for line in result.stdout.splitlines()]
    for line in (
        ".hidden left out: a hidden file",
        "photo.png left out: a picture",
        "s1_press.csv table with a header",
        "old/s1_cap.csv LCR log",
        'open: column "Load (N)" appears twice (columns 3 and 4)',
        "s1: force s1_press.csv, capacitance old/s1_cap.csv (paired by name)",
        "s2: force s2_press.csv",
    ):
        assert line in said, result.stdout
    left = read_experiment(lab / "experiment.toml").unedited
    assert f"with {len(left)} lines marked EDIT" in result.stdout
    again = _run("init", lab, "-o", tmp_path / "experiment.toml")
    assert "not looked at, as calib wrote it: experiment.toml" in again.stdout


def test_what_init_offers_for_a_choice_can_be_read(tmp_path: Path) -> None:
    twice = "".join(f"{line},{line.split(',')[2]}9\n" for line in _press(0.0).splitlines())
    (tmp_path / "a.csv").write_text("Time (s),Extension (mm),Load (N),Load (N)\n" + twice)
    assert _run("init", tmp_path / "a.csv", "-o", tmp_path / "e.toml").exit_code == 0
    text = (tmp_path / "e.toml").read_text()
    (marked,) = (line for line in text.splitlines() if "EDIT: choose" in line)
    offered = [line[4:] for line in text.splitlines() if line.startswith('#   force = { file = "a.csv"')]
    assert len(offered) == 2
    for line in offered:
        (tmp_path / "chosen.toml").write_text(text.replace(marked, line))
        chosen = read_experiment(tmp_path / "chosen.toml")
        (sweep,) = read_sweeps(chosen)
        assert "force" in sweep.channels
        assert "force" not in [u.what for u in chosen.unedited]


def test_a_file_that_was_named_and_is_not_understood_stops_init(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(TESTER + _press(0.0))
    (tmp_path / "b.txt").write_text("dear diary\n")
    result = _run("init", tmp_path / "a.csv", tmp_path / "b.txt", "-o", tmp_path / "e.toml")
    assert result.exit_code == 2
    assert "b.txt" in _line(result.stderr)
    assert not (tmp_path / "e.toml").exists()


def test_a_folder_without_lab_files_is_refused(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    assert "there is no file in this folder" in _line(_run("init", tmp_path / "empty", "-o", tmp_path / "e.toml").stderr)
    (tmp_path / "empty" / "notes.txt").write_text("dear diary\n")
    result = _run("init", tmp_path / "empty", "-o", tmp_path / "e.toml")
    assert result.exit_code == 2
    assert "no table is found" in _line(result.stderr)
    assert not (tmp_path / "e.toml").exists()


HEAD = """
[indenter]
radius = "5 mm"
[sensor]
radius = "10 mm"
[[specimens]]
name = "s"
force = {force}
[specimens.priors]
sensor_thickness = {{ normal = ["0.74 mm", "0.02 mm"] }}
padding_thickness = {{ normal = ["1.10 mm", "0.03 mm"] }}
"""


def test_an_experiment_says_how_a_file_is_to_be_read(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("Time (s),Extension (mm),Load 1\n" + _press(0.0, cycles=2))
    force = '{ file = "a.csv", units = { force = "mN" }, columns = { force = 3 } }\nuse = { cycles = [2] }'
    (tmp_path / "e.toml").write_text(HEAD.format(force=force))
    files = read_experiment(tmp_path / "e.toml").specimens[0].sweeps[0]
    plan = read_experiment(tmp_path / "e.toml")
    assert experiment_from_json(experiment_to_json(plan)) == plan
    assert dict(files.force_reading.units) == {"force": "mN"}
    assert dict(files.force_reading.columns) == {"force": "3"}
    assert files.use == Use(cycles=(2,))
    sweep = make_sweep("s", "", 5e-3, files.force, None, force_reading=files.force_reading, use=files.use)
    assert "force" in sweep.channels
    assert np.max(sweep.channels["force"].value) == pytest.approx(8e-3 * 0.6**1.5, rel=0.1)
    assert any("cycle 2 is used" in note for note in sweep.notes)


@pytest.mark.parametrize(
    ("force", "message"),
    [
        ('{ units = { force = "kN" } }', "force names no file"),
        ('{ file = "a.csv", unit = { force = "kN" } }', "unit"),
        ('{ file = "a.csv", units = { weight = "kN" } }', "weight"),
        ('{ file = "a.csv", specimen = 0 }', "specimen must be a whole number from 1, got 0"),
        ('{ file = "b.csv" }', "file not found"),
    ],
)
def test_faults_in_how_a_file_is_to_be_read_are_told_with_their_line(tmp_path: Path, force: str, message: str) -> None:
    (tmp_path / "a.csv").write_text(TESTER + _press(0.0))
    (tmp_path / "e.toml").write_text(HEAD.format(force=force))
    with pytest.raises(InputError, match=message) as caught:
        read_experiment(tmp_path / "e.toml")
    assert caught.value.faults[0].line == 8


# ------------------------------------------------------------------------------------------------ what is said to `calib read`


def test_read_takes_what_is_said_of_a_file_and_of_the_part_that_is_used(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text(TESTER + _press(0.0, cycles=3))
    said = ["--sign", "compression negative", "--max-force", "0.5 N", "--max-depth", "0.3 mm", "--cycles", "2,3"]
    result = _run("read", tmp_path / "p.csv", *said, "-o", tmp_path / "o.csv")
    assert result.exit_code == 0
    text = _line(result.output)
    for words in ("as stated; the record shows the opposite", "counted from contact at", "cycles 2 and 3 are used", "beyond"):
        assert words in text
    back = _run("read", tmp_path / "p.csv", "--sign", "force=compression positive", "--branch", "unloading", "--decimal", ".")
    assert back.exit_code == 0
    assert "unloading of cycle 1 is used" in _line(back.output)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (
            ("--where", "1000"),
            '--where "1000" is not of the form column=value. Write for example --where "Frequency (Hz)=1000"',
        ),
        (("--where", "a=1", "--where", "a=2"), '--where is given twice for "a"'),
        (("--sign", "negative"), '--sign "negative" is not understood. Write --sign "compression positive" or'),
        (("--sign", "load=compression negative"), '--sign "load=compression negative" is not understood'),
        (("--sign", "compression negative", "--sign", "force=compression positive"), "--sign is given twice for force"),
        (("--scale", "nano"), '--scale "nano" is not understood. Write --scale "micro"'),
        (("--decimal", ";"), '--decimal ";" is not understood'),
        (("--max-force", "5"), '--max-force: max_force: "5" has no unit'),
        (("--max-depth", "0 mm"), 'max_depth must be positive, got "0 mm". Write --max-depth "0.8 mm"'),
        (("--branch", "down"), 'branch must be "loading" or "unloading", got "down". Write --branch loading'),
        (("--max-force", ""), '--max-force: max_force: "" is not a number with a unit. Write --max-force "5 N"'),
        (("--max-depth", ""), '--max-depth: max_depth: "" is not a number with a unit'),
        (("--branch", ""), 'branch must be "loading" or "unloading", got ""'),
        (("--cycles", ""), 'cycles must be a list of whole numbers from 1, got ""'),
        (("--cycles", "2,x"), 'cycles must be a list of whole numbers from 1, got "2,x". Write --cycles 2,3'),
    ],
)
def test_what_cannot_be_said_to_read_is_refused_with_an_example(tmp_path: Path, words: tuple[str, ...], message: str) -> None:
    (tmp_path / "p.csv").write_text(TESTER + _press(0.0))
    result = _run("read", tmp_path / "p.csv", *words)
    assert result.exit_code == 2
    assert message in _line(result.output)


def test_the_help_of_read_names_every_option(tmp_path: Path) -> None:
    text = _run("read", "--help").output
    for option in ("where", "sheet", "sign", "scale", "decimal", "max-force", "max-depth", "branch", "cycles"):
        assert f"--{option}" in text


def test_a_doubtful_sign_is_refused_by_read_and_its_advice_works(tmp_path: Path) -> None:
    rows = "".join(f"{i * 0.1:.1f},{-0.8 + i * 0.004:.4f},{4 - i * 0.02:.3f}\n" for i in range(200))
    (tmp_path / "p.csv").write_text("Time (s),Extension (mm),Load (N)\n" + rows)
    refused = _run("read", tmp_path / "p.csv")
    assert refused.exit_code == 2
    assert "cannot be told which way compression is in force" in _line(refused.output)
    for option, branch in (("force=compression positive", ("--branch", "unloading")), ("force=compression negative", ())):
        assert f'--sign "{option}"' in _line(refused.output)
        assert " ".join(branch) in _line(refused.output)
        assert _run("read", tmp_path / "p.csv", "--sign", option, *branch).exit_code == 0


def test_what_is_not_read_of_a_file_is_named_in_read_and_in_the_notes_of_a_sweep(tmp_path: Path) -> None:
    rows = "".join(f"{line},23.5,{k}\n" for k, line in enumerate(_press(0.0).splitlines()))
    (tmp_path / "a.csv").write_text("Made by hand\nTime (s),Extension (mm),Load (N),T (°C),Remark\n" + rows, encoding="utf-8")
    said = _run("read", tmp_path / "a.csv")
    assert said.exit_code == 0, said.output
    named = [line for line in said.stdout.splitlines() if line.startswith("not read: ")]
    assert any('column 4 "T (°C)"' in line for line in named)
    assert any('column 5 "Remark"' in line for line in named)
    assert any("line 1" in line and "Made by hand" in line for line in named)
    notes = " ".join(make_sweep("s", "", 5e-3, tmp_path / "a.csv", None).notes)
    assert 'column 4 "T (°C)"' in notes
    assert "Made by hand" not in notes


_TESTER = "Time (s),Extension (mm),Load (N)"


@pytest.mark.parametrize(
    ("header", "row", "message", "options"),
    [
        (_TESTER, "{t:.1f},{back:.3f},{unload:.4f}", "unloading", "--branch unloading"),
        (_TESTER, ",{x:.3f},{f:.4f}", "60 x empty cell: time", "--columns time=none"),
        ("Time (s),Cp (pF),Status", "{t:.1f},{c:.4f},5", "60 x LCR status 5", "--columns status=none"),
        (_TESTER, "{t:.1f},0.3,{f:.4f}", '"Extension (mm)" stands still', ""),
        (_TESTER, "{t:.1f},{x:.3f},", 'column "Load (N)" is empty', ""),
        ("Time (s),Cp (pF)", "{t:.1f},9.9E37", "60 x over-range 9.9E37", ""),
    ],
)
def test_a_file_without_a_row_that_can_be_used_is_refused_with_what_to_do(
    tmp_path: Path, header: str, row: str, message: str, options: str
) -> None:
    depth = [0.01 * i for i in range(60)]
    load = [6.0 * x**1.7 + 0.2 for x in depth]
    both = zip(depth, load, depth[::-1], load[::-1], strict=True)
    rows = [row.format(t=10 * x, x=x, f=f, c=97 + f, back=b, unload=u) for x, f, b, u in both]
    file, written = tmp_path / "a.csv", tmp_path / "rows.csv"
    file.write_text("\n".join([header, *rows]) + "\n")
    refused = _run("read", file, "-o", written)
    assert refused.exit_code == 2
    assert not written.exists()
    assert "none of the 60 row(s) can be used" in _line(refused.output)
    assert message in _line(refused.output)
    assert options in _line(refused.output)
    if options:
        assert _run("read", file, "-o", written, *options.split()).exit_code == 0
        assert written.exists()
