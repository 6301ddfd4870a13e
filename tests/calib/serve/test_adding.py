"""A file more is added to an experiment that is there as somebody would write it by hand, and what no file tells is asked."""

from __future__ import annotations

import html
import re
import shlex
import shutil
import tomllib
from pathlib import Path
from typing import Any

import pytest
from letting_in import SCRIPT, Work, let_in
from typer.testing import CliRunner

from calib.cli import app
from calib.experiment import read_experiment, read_sweeps
from calib.serve import open_workspace

DATASET = Path(__file__).parents[3] / "datasets" / "padded_sensor"
FILES = ("sensor1_instron.csv", "sensor1_lcr.csv", "sensor2_instron.csv", "sensor2_lcr.csv")


@pytest.fixture
def work(tmp_path: Path) -> Work:
    """The page of the shipped lab, whose experiment names the first of its two sensors."""
    folder = tmp_path / "lab"
    folder.mkdir()
    for name in FILES:
        shutil.copy(DATASET / name, folder)
    text = (DATASET / "experiment.toml").read_text(encoding="utf-8")
    before, _, rest = text.partition('[[specimens]]\nname = "sensor 2"')
    (folder / "experiment.toml").write_text(before + '[laboratory]\ncity = "Auckland"  # stays\n', encoding="utf-8")
    assert rest
    return Work(let_in(space := open_workspace(folder)), space)


SECOND = {"name": "sensor2_lcr.csv", "partner": "sensor2_instron.csv"}
NEW = {**SECOND, "of": "new", "specimen": "sensor 2", "ball": "same"}


def put(work: Work, **given: str) -> Any:
    return work.page.post("/files/add/put", data=given, follow_redirects=False)


def refused(work: Work, **given: str) -> str:
    before = work.space.text
    answer = put(work, **given)
    assert answer.status_code == 422, answer.headers
    assert work.space.text == before
    return str(answer.text)


def test_another_specimen_is_paired_tied_asked_for_and_added(work: Work) -> None:
    page, space = work
    assert "/files/add?name=sensor2_lcr.csv" in page.get("/files/row?name=sensor2_lcr.csv").text
    assert "/files/add" not in page.get("/files/row?name=sensor1_lcr.csv").text
    seen = page.get("/files/add?name=sensor2_lcr.csv").text
    assert "Paired by name" in seen
    assert '<option value="sensor2_instron.csv" selected>' in seen
    assert "clock of the tester minus clock of the meter" in seen
    assert 'value="sensor2"' in seen
    assert 'value="same"' in seen
    assert "selected>5 mm radius" not in seen  # the ball is asked, and not taken for granted
    everything = refused(work, **SECOND, sensor_thickness="0.7", of="new", specimen="")
    for said in ("Which ball pressed", "belong together", "What is the new specimen called"):
        assert said in everything
    assert "has no unit" in refused(work, **{**NEW, "ball": "another", "radius": "3"})
    assert "must be positive" in refused(work, **{**NEW, "ball": "another", "radius": "-3 mm"})
    assert "already" in refused(work, **{**NEW, "specimen": "sensor 1"})
    assert "bracket or a comma" in refused(work, **{**NEW, "specimen": "a[1], b"})
    thick = {"sensor_thickness": "0.74 mm", "sensor_thickness_sd": "0.02 mm"}
    clock = {"clock_offset": "-2 s", "clock_offset_sd": "1 s"}
    assert put(work, **NEW, **thick, **clock).headers["location"] == "/experiment"
    assert 'city = "Auckland"  # stays' in space.text
    assert "# own clock: the offset is inferred" in space.text
    added = tomllib.loads(space.text)["specimens"][1]
    assert added["force"] == "sensor2_instron.csv"
    assert added["priors"]["sensor_thickness"] == {"normal": ["0.74 mm", "0.02 mm"]}
    assert added["priors"]["clock_offset"] == {"normal": ["-2 s", "1 s"]}
    told = read_experiment(space.experiment)
    assert {u.what for u in told.unedited} == {"padding_thickness", "dielectric_thickness"}  # guesses, marked as such
    assert [len(s.channels) for s in read_sweeps(told)] == [2, 2]
    assert "in the experiment: sensor 2, capacitance" in page.get("/files/row?name=sensor2_lcr.csv").text


def test_the_commands_that_are_shown_draft_the_specimen_that_the_page_adds(work: Work, monkeypatch: pytest.MonkeyPatch) -> None:
    page, space = work
    shown = page.get("/files/add?name=sensor2_lcr.csv").text
    (block,) = re.findall(r'<code id="read-command">(.*?)</code>', shown, re.S)
    commands = html.unescape(re.sub(r"</?span[^>]*>", "", block)).split("\n")
    assert [command.split()[:2] for command in commands] == [["calib", word] for word in ("read", "init", "check")]
    assert put(work, **NEW).status_code == 303
    monkeypatch.chdir(space.folder)
    for command in commands:
        done = CliRunner().invoke(app, shlex.split(command)[1:])
        assert done.exit_code in (0, 3), (command, done.output)  # a check may be amber
    draft = tomllib.loads((space.folder / shlex.split(commands[1])[-1]).read_text(encoding="utf-8"))
    (drafted,), added = draft["specimens"], tomllib.loads(space.text)["specimens"][1]
    assert {**drafted, "name": "sensor 2"} == added


def test_another_press_with_another_ball_stands_beside_the_first(work: Work) -> None:
    given = {**SECOND, "of": "=sensor 1", "ball": "another", "radius": "3 mm"}
    assert "would be called" in refused(work, **given, press="a", first="a")
    assert "What is this press called" in refused(work, **given, press="")
    assert put(work, **given, press="ball 3 mm", first="ball 5 mm").status_code == 303
    text = work.space.text
    own = tomllib.loads(text)["specimens"]
    assert len(own) == 1
    assert {"force", "capacitance"}.isdisjoint(own[0])
    assert [sweep["name"] for sweep in own[0]["sweeps"]] == ["ball 5 mm", "ball 3 mm"]
    assert 'capacitance = "sensor1_lcr.csv"       # own clock: the offset is inferred' in text
    sweeps = read_experiment(work.space.experiment).specimens[0].sweeps
    assert [sweep.indenter_radius for sweep in sweeps] == [5e-3, 3e-3]
    clock = {"clock_offset": "-2 s", "clock_offset_sd": "1 s"}
    text = work.space.text
    work.space.write_experiment(
        text.replace("[specimens.priors]", '[specimens.priors]\nclock_offset = { normal = ["0 s", "9 s"] }')
    )
    again = {"name": "again.csv", "partner": "", "of": "=sensor 1", "press": "x", "ball": "same"}
    shutil.copy(work.space.folder / "sensor2_instron.csv", work.space.folder / "again.csv")
    assert "for all of its presses" in refused(work, **again, **clock)
    work.space.write_experiment(text)
    # A third one, of a file with something said of it, which goes along.
    lines = (DATASET / "sensor1_instron.csv").read_text(encoding="utf-8").split("\n")
    (work.space.folder / "third.csv").write_text("\n".join(lines[:-2]) + "\n", encoding="utf-8")
    work.page.post("/file/correct", data={"name": "third.csv", "max_force": "3 N", "units_force": "N"})
    third = {"name": "third.csv", "partner": "", "of": "=sensor 1", "ball": "same"}
    assert "is given twice" in refused(work, **third, press="ball 3 mm")
    assert put(work, **third, press="again").status_code == 303
    added = tomllib.loads(work.space.text)["specimens"][0]["sweeps"][2]
    assert added == {
        "name": "again",
        "force": {"file": "third.csv", "units": {"force": "N"}},
        "use": {"max_force": "3 N"},
    }


def test_what_would_count_data_twice_or_cannot_be_tied_is_refused(work: Work) -> None:
    page, folder = work.page, work.space.folder
    shutil.copy(folder / "sensor1_instron.csv", folder / "copy.csv")
    copy = {"name": "copy.csv", "partner": "", "of": "=sensor 1", "press": "two", "ball": "same"}
    assert "same bytes as sensor1_instron.csv" in refused(work, **copy)
    assert "in the experiment already" in page.get("/files/add?name=sensor1_lcr.csv").text
    assert put(work, **{**NEW, "name": "sensor1_lcr.csv"}).status_code == 422
    alone = page.get("/files/add?name=sensor2_lcr.csv&partner=").text
    assert "It needs a force file of the same press" in alone
    assert "a force file of the same press" in refused(work, **{**NEW, "partner": ""})
    for partner in ("sensor1_instron.csv", "../x.csv", "nothing.csv"):
        assert page.get("/files/add", params={"name": "sensor2_lcr.csv", "partner": partner}).status_code == 422, partner
        assert put(work, **{**NEW, "partner": partner}).status_code == 422
    assert put(work, **{**NEW, "of": "=nobody"}).status_code == 422
    assert put(work, **NEW).status_code == 303
    assert put(work, **NEW).status_code == 422  # another tab that was open


def test_an_experiment_that_is_written_in_another_way_is_not_touched(work: Work) -> None:
    space = work.space
    specimens = '[{ name = "a", force = "sensor1_instron.csv", priors = { sensor_thickness = { fixed = "1 mm" } } }]'
    text = f'specimens = {specimens}\n[indenter]\nradius = "5 mm"\n[sensor]\nradius = "10 mm"\n'
    space.write_experiment(text)
    assert "Add it in the text" in refused(work, **NEW)
    space.write_experiment("indenter = [")
    answer = work.page.get("/files/add?name=sensor2_lcr.csv", headers=SCRIPT)
    assert "cannot be read as it is" in answer.json()["faults"][0]
    space.experiment.unlink()
    answer = work.page.get("/files/add?name=sensor2_lcr.csv", headers=SCRIPT)
    assert "no experiment yet" in answer.json()["faults"][0]
