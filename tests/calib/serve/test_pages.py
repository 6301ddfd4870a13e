"""Every page of a folder is there, does what its command does, and keeps what it is told as files that the commands read."""

from __future__ import annotations

import io
import json
import re
import shutil
import sys
import time
import tomllib
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from letting_in import SCRIPT, Work, let_in
from PIL import Image
from small_lab import EXPERIMENT, write_lab, write_press
from small_run import QUICK, make_lab, quick
from starlette.testclient import TestClient

from calib.decision import Requirement, largest_force, recommend
from calib.experiment import read_experiment, read_specification, shipped
from calib.files import write_text
from calib.records import record_to_text
from calib.report import template_text
from calib.runs import load_run, run_state, verify
from calib.sampling.posterior import Posterior
from calib.serve import Workspace, jobs, open_workspace
from calib.serve.commands import reading_command
from calib.serve.forms import form_of_experiment
from calib.serve.looking import form_of, said_from

# What a report draws takes longest, and has tests of its own.
pytestmark = pytest.mark.usefixtures("all_undrawn")


def _in_one(page: str) -> str:
    """A page without the marks by which words of a command are kept whole."""
    return re.sub(r"</?span[^>]*>", "", page)


@pytest.fixture
def space(tmp_path: Path) -> Workspace:
    """A folder with a lab file and its experiment."""
    return open_workspace(write_lab(tmp_path / "work"))


@pytest.fixture
def page(space: Workspace) -> TestClient:
    """Its page."""
    return let_in(space)


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory, all_undrawn: None) -> Work:
    """The page of a folder with two runs that are finished, and one that was stopped."""
    lab = make_lab(tmp_path_factory.mktemp("runs"))
    quick(lab, "one", seed=1)
    quick(lab, "two", seed=2)
    shutil.copytree(lab / "one", lab / "stopped")
    (lab / "stopped" / "posterior.nc").unlink()
    return Work(let_in(space := open_workspace(lab)), space)


# --- files --------------------------------------------------------------------------------------------------------------


def test_a_dropped_file_is_kept_whole_and_listed(tmp_path: Path) -> None:
    space = open_workspace(tmp_path / "new")
    page = let_in(space)
    content = write_press(tmp_path / "press.csv").read_bytes()
    assert "no lab file" in page.get("/files").text
    answer = page.put("/files/upload?name=Set 1/press.csv", content=content)
    assert answer.json()["name"] == "lab/Set 1/press.csv"
    assert (space.folder / "lab" / "Set 1" / "press.csv").read_bytes() == content
    assert "lab/Set 1/press.csv" in page.get("/files").text
    assert page.put("/files/upload?name=Set 1/press.csv", content=content).status_code == 200  # the same once more
    other = page.put("/files/upload?name=Set 1/press.csv", content=b"other", headers=SCRIPT)
    assert other.status_code == 422
    assert "with other content" in other.json()["faults"][0]
    assert (space.folder / "lab" / "Set 1" / "press.csv").read_bytes() == content
    assert not list((space.folder / "lab").rglob(".*"))


def test_a_dropped_file_that_is_no_lab_file_is_named_with_what_it_is(tmp_path: Path) -> None:
    page = let_in(open_workspace(tmp_path / "new"))
    assert "Left out" not in page.get("/files").text
    for name in ("rig.jpg", "notes.md"):
        page.put(f"/files/upload?name={name}", content=b"x")
    assert "Left out: lab/notes.md (notes), lab/rig.jpg (a picture)." in page.get("/files").text


def test_a_file_that_is_refused_says_why_and_is_read_once_it_is_corrected(tmp_path: Path) -> None:
    space = open_workspace(tmp_path / "new")
    (space.folder / "lab").mkdir()
    write_press(space.folder / "lab" / "press.csv")
    page = let_in(space)
    assert "not understood" in page.get("/files/row?name=lab/press.csv").text
    # Settings and exports among lab files are none, and no fault.
    (space.folder / "lab" / "settings.json").write_text('{"kind": "force tables", "gain": 1}', encoding="utf-8")
    for where in ("/files/row", "/file"):
        said = page.get(f"{where}?name=lab/settings.json").text
        assert "no lab file" in said
        assert "not understood" not in said
        assert "level red" not in said
    assert "has no unit" in page.get("/file?name=lab/press.csv").text
    assert page.get("/file/picture.png?name=lab/press.csv").status_code == 422
    corrected = page.post(
        "/file/correct", data={"name": "lab/press.csv", "units_force": "N", "max_force": "4 N", "cycles": "1"}
    )
    assert "148 of 150 rows" in corrected.text or re.search(r"\d+ of 150 rows are used", corrected.text)
    assert 'value="4 N"' in corrected.text
    assert "calib read lab/press.csv --units force=N --cycles 1 --max-force &#34;4 N&#34;" in _in_one(corrected.text)
    assert page.get("/file/picture.png?name=lab/press.csv").content.startswith(b"\x89PNG")
    # What is advised of its quality ends with one full stop.
    assert "as prior of machine_compliance.</li>" in corrected.text
    assert not re.search(r"[^.]\.\.(?!\.)", re.sub("<[^>]+>", "", corrected.text))
    # Nothing of it is in the server's memory alone.
    assert 'value="4 N"' in let_in(open_workspace(space.folder)).get("/file?name=lab/press.csv").text


def test_what_is_said_of_a_file_goes_into_the_first_experiment_and_is_changed_there_from_then_on(tmp_path: Path) -> None:
    space = open_workspace(tmp_path / "new")
    (space.folder / "lab").mkdir()
    write_press(space.folder / "lab" / "press.csv")
    page = let_in(space)
    page.post("/file/correct", data={"name": "lab/press.csv", "units_force": "N", "max_force": "4 N"})
    assert "calib init lab --said readings.toml -o experiment.toml" in _in_one(page.get("/files").text)
    assert page.post("/files/draft", follow_redirects=False).headers["location"] == "/experiment"
    specimen = tomllib.loads(space.text)["specimens"][0]
    assert specimen["force"] == {"file": "lab/press.csv", "units": {"force": "N"}}
    assert specimen["use"] == {"max_force": "4 N"}
    before = space.text
    page.post("/file/correct", data={"name": "lab/press.csv", "units_force": "mN"})
    specimen = tomllib.loads(space.text)["specimens"][0]
    assert specimen["force"] == specimen["capacitance"] == {"file": "lab/press.csv", "units": {"force": "mN"}}
    assert "use" not in specimen
    assert [line for line in space.text.split("\n") if line.startswith("#")] == [
        line for line in before.split("\n") if line.startswith("#")
    ]
    assert page.post("/files/draft").status_code == 422  # it is not overwritten
    assert page.post("/file/remove", data={"name": "lab/press.csv"}).status_code == 422  # the experiment names it


def test_a_wrong_correction_is_refused_with_every_fault_and_what_was_typed_stays(page: TestClient, space: Workspace) -> None:
    before = space.text
    units = {"units_force": "x" * 5000, "units_time": "h:min:s"}
    data = {"name": "lab/press.csv", **units, "cycles": "two", "max_force": "5", "specimen": "0", "where_value": "1"}
    answer = page.post("/file/correct", data=data)
    assert answer.status_code == 422
    for said in ("unit of the force", "cycles must be", "max_force", "specimen must be a whole number", "belong together"):
        assert said in answer.text
    assert "unit of the time" not in answer.text
    assert 'value="two"' in answer.text
    assert space.text == before


def test_a_file_that_is_put_out_of_the_way_is_kept(tmp_path: Path) -> None:
    space = open_workspace(tmp_path / "new")
    (space.folder / "lab").mkdir()
    content = write_press(space.folder / "lab" / "press.csv").read_bytes()
    page = let_in(space)
    page.post("/file/correct", data={"name": "lab/press.csv", "units_force": "N"})
    page.post("/file/remove", data={"name": "lab/press.csv"})
    assert space.lab_files() == []
    assert space.said() == {}
    assert [path.read_bytes() for path in (space.folder / ".removed").glob("*/press.csv")] == [content]


def test_what_a_form_says_of_a_file_comes_back_from_it() -> None:
    form = {
        "units_force": "kN",
        "columns_time": "T",
        "specimen": "2",
        "where_column": "Frequency (Hz)",
        "where_value": "1000",
        "sign_force": "compression negative",
        "sheet": "Test 1",
        "scale": "micro",
        "decimal": ",",
        "max_force": "5 N",
        "max_depth": "0.8 mm",
        "branch": "unloading",
        "cycles": "2, 3",
    }
    said = said_from(form)
    assert {key: value for key, value in form_of(said).items() if value} == form
    assert reading_command("a b.csv", said) == (
        'calib read "a b.csv" --units force=kN --columns time=T --specimen 2 --where "Frequency (Hz)=1000" '
        '--sign "force=compression negative" --sheet "Test 1" --scale micro --decimal , --branch unloading --cycles 2,3 '
        '--max-force "5 N" --max-depth "0.8 mm"'
    )


# --- experiment ---------------------------------------------------------------------------------------------------------


def put(page: TestClient, at: list[str | int], **given: str) -> dict[str, object]:
    answer = page.post("/experiment/put", data={"at": json.dumps(at), **given}, headers=SCRIPT)
    found: dict[str, object] = {"status": answer.status_code, **answer.json()}
    return found


def test_form_and_text_are_the_same_file(page: TestClient, space: Workspace) -> None:
    put(page, ["indenter", "radius"], value="4 mm")
    put(page, ["priors", "young_modulus"], kind="normal", number0="0.6 MPa", number1="0.1 MPa")
    put(page, ["specimens", 0, "priors", "dielectric_thickness"], kind="normal", number0="0.16 mm", number1="0.01 mm")
    tables = tomllib.loads(space.text)
    assert tables["indenter"]["radius"] == "4 mm"
    assert tables["priors"]["young_modulus"] == {"normal": ["0.6 MPa", "0.1 MPa"]}
    assert tables["specimens"][0]["priors"]["dielectric_thickness"] == {"normal": ["0.16 mm", "0.01 mm"]}
    shown = page.get("/experiment").text
    assert 'value="4 mm"' in shown
    assert "8 mm in diameter" in shown
    changed = space.text.replace('"4 mm"', '"3 mm"')
    page.post("/experiment/write", data={"text": changed, "seen": _seen(page)}, headers=SCRIPT)
    assert "6 mm in diameter" in page.get("/experiment/state", headers=SCRIPT).json()["drawn"]
    put(page, ["indenter", "friction_coefficient"], value="stick")
    assert tomllib.loads(space.text)["indenter"]["friction_coefficient"] == "stick"
    put(page, ["indenter", "friction_coefficient"], value="")
    assert "friction_coefficient" not in space.text


def _seen(page: TestClient) -> str:
    return str(page.get("/experiment/state").json()["seen"])


def test_what_is_wrong_is_said_beside_its_field(page: TestClient, space: Workspace) -> None:
    put(page, ["indenter", "radius"], value="5")
    form = form_of_experiment(space)
    wrong = {field.at: field.wrong for field in form.fields if field.wrong}
    assert list(wrong) == [("indenter", "radius")]
    assert "has no unit" in wrong["indenter", "radius"]
    assert "has no unit" in page.get("/experiment").text
    put(page, ["indenter", "radius"], value="")
    wrong = {field.at: field.wrong for field in form_of_experiment(space).fields if field.wrong}
    assert list(wrong) == [("indenter", "radius")]
    assert "is missing" in wrong["indenter", "radius"]


def test_a_text_that_is_no_toml_is_kept_and_said_with_its_line(page: TestClient, space: Workspace) -> None:
    broken = EXPERIMENT + "radius = \n"
    answer = page.post("/experiment/write", data={"text": broken, "seen": _seen(page)}, headers=SCRIPT).json()
    assert "is not valid TOML" in answer["faults"][0]
    assert space.text == broken
    assert "is not valid TOML" in page.get("/experiment").text
    assert put(page, ["indenter", "radius"], value="4 mm")["status"] == 422


def test_two_tabs_lose_nothing(page: TestClient, space: Workspace) -> None:
    seen, text = _seen(page), space.text
    assert put(page, ["indenter", "radius"], value="4 mm", was='"5 mm"')["status"] == 200
    late = put(page, ["indenter", "radius"], value="6 mm", was='"5 mm"')
    assert (late["status"], tomllib.loads(space.text)["indenter"]["radius"]) == (409, "4 mm")
    assert "changed elsewhere" in str(late["refused"])
    assert put(page, ["sensor", "radius"], value="9 mm", was='"10 mm"')["status"] == 200  # another field goes in
    answer = page.post("/experiment/write", data={"text": text, "seen": seen}, headers=SCRIPT)
    assert answer.status_code == 409
    assert tomllib.loads(space.text)["indenter"]["radius"] == "4 mm"
    assert page.post("/experiment/write", data={"text": " ", "seen": _seen(page)}, headers=SCRIPT).status_code == 422


def test_marks_go_as_values_are_said_or_meant(tmp_path: Path) -> None:
    space = open_workspace(tmp_path / "new")
    (space.folder / "lab").mkdir()
    write_press(space.folder / "lab" / "press.csv")
    page = let_in(space)
    page.post("/file/correct", data={"name": "lab/press.csv", "units_force": "N"})
    page.post("/files/draft")
    before = form_of_experiment(space)
    assert len(before.marked) == len(read_experiment(space.experiment).unedited) > 8
    put(page, ["sensor", "radius"], value="9 mm")
    ball = next(field for field in form_of_experiment(space).fields if field.at == ("indenter", "radius"))
    assert ball.task == "radius of the ball, half its diameter"
    decide(page, ["indenter", "radius"], known="measured", value="5 mm", by="caliper")
    electrode = next(field for field in form_of_experiment(space).fields if field.at == ("sensor", "electrode_radius"))
    decide(page, list(electrode.at), known="stands")
    left = read_experiment(space.experiment)
    assert len(left.unedited) == len(before.marked) - 3
    assert (left.indenter_radius, left.sensor_radius) == (5e-3, 9e-3)
    put(page, ["priors", "load_zero_drift"], example="yes")  # there is no such unknown
    put(page, ["specimens", 0, "priors", "load_zero"], example="yes")
    added = next(field for field in form_of_experiment(space).fields if field.at[-1] == "load_zero")
    assert "example" in added.task


def decide(page: TestClient, at: list[str | int], status: int = 200, **said: str) -> str:
    """Say how a quantity is known, as the script does; what the page answers."""
    answer = page.post("/experiment/decide", data={"at": json.dumps(at), **said}, headers=SCRIPT)
    assert answer.status_code == status, answer.text
    return str(answer.text)


def test_what_is_said_of_how_a_quantity_is_known_is_what_one_writes_by_hand(tmp_path: Path) -> None:
    space = open_workspace(tmp_path / "new")
    (space.folder / "lab").mkdir()
    write_press(space.folder / "lab" / "press.csv")
    page = let_in(space)
    page.post("/file/correct", data={"name": "lab/press.csv", "units_force": "N"})
    page.post("/files/draft")
    draft = space.text
    thickness: list[str | int] = ["specimens", 0, "priors", "sensor_thickness"]
    modulus: list[str | int] = ["priors", "young_modulus"]

    def line(name: str) -> str:
        return next(line for line in space.text.split("\n") if line.startswith(f"{name} ="))

    def known(*at: str | int) -> tuple[str, str]:
        field = next(field for field in form_of_experiment(space).fields if field.at == at)
        return field.known, field.by

    assert known(*thickness) == ("undecided", "")
    # Measured: value, uncertainty, with what; the uncertainty in the unit of the value.
    decide(page, thickness, known="measured", mean="0.74 mm", sd="0.02", by="microscope, 5 places")
    assert line("sensor_thickness") == (
        'sensor_thickness = { normal = ["0.74 mm", "0.02 mm"] }   # measured: microscope, 5 places'
    )
    assert known(*thickness) == ("measured", "microscope, 5 places")
    # Not measured: the guess stands, as it is or wider, and the data may tell better.
    decide(page, thickness, known="stands", wider="2")
    assert line("sensor_thickness").endswith('["0.74 mm", "0.04 mm"] }   # not measured: the guess, 2 times as wide')
    assert known(*thickness) == ("stands", "")
    decide(page, modulus, known="stands")
    assert line("young_modulus").endswith("   # not measured: the guess stands")
    # Undecided again: the very line of the draft.
    for at in (thickness, modulus):
        decide(page, at, known="undecided")
        assert known(*at) == ("undecided", "")
    assert tomllib.loads(space.text) == tomllib.loads(draft)
    assert line("sensor_thickness") == next(one for one in draft.split("\n") if one.startswith("sensor_thickness ="))
    # What has no prior is taken as exact: nobody is told that a guess of it is as good as a measurement.
    before = len(read_experiment(space.experiment).unedited)
    decide(page, ["indenter", "radius"], known="stands")
    told = read_experiment(space.experiment).unedited
    assert len(told) == before
    assert [(u.what, u.stands) for u in told if u.stands] == [("indenter radius", True)]
    assert form_of_experiment(space).marked == tuple(u for u in told if not u.stands)
    # A value of one's own is no guess any more.
    put(page, ["indenter", "radius"], value="4 mm")
    assert line("radius") == 'radius = "4 mm"'
    # What makes no sense is refused with the reason, and changes nothing.
    kept = space.text
    refused: list[tuple[list[str | int], dict[str, str], str]] = [
        (thickness, {"known": "measured", "mean": "0.74 mm"}, "how sure it is"),
        (thickness, {"known": "measured", "sd": "0.02 mm"}, "the value is missing"),
        (thickness, {"known": "measured", "mean": "1 mm", "sd": "1 mm", "by": "x # EDIT: y"}, "without #"),
        (thickness, {"known": "measured", "mean": "1 mm", "sd": "1 mm", "by": "x\ny = 1"}, "with what it was measured"),
        (thickness, {"known": "measured", "mean": "1e999", "sd": "1"}, "is no number"),
        (thickness, {"known": "stands", "wider": "0"}, "is not how much wider"),
        (thickness, {"known": "perhaps"}, "nothing says how it is known"),
        (["model"], {"known": "stands"}, "there is nothing to decide"),
        (["sensor", "electrode_radius"], {"known": "measured"}, "nothing says what was measured"),
    ]
    for at, said, why in refused:
        assert why in decide(page, at, 422, **said).lower()
    assert decide(page, thickness, 409, known="stands", was="3")
    assert space.text == kept
    page.post("/experiment/put", data={"at": json.dumps(thickness), "kind": "fixed", "number0": "1 mm"}, headers=SCRIPT)
    assert "A prior that is fixed is not made wider here" in decide(page, thickness, 422, known="stands", wider="2")


def test_a_number_without_end_is_said_beside_its_field_and_breaks_no_page(page: TestClient, space: Workspace) -> None:
    answer = page.post("/experiment/put", data={"at": '["priors", "young_modulus"]', "kind": "fixed", "number0": "1e999"})
    assert answer.status_code == 200
    space.write_experiment(space.text.replace('"5 mm"', "inf").replace('"10 mm"', "nan"))
    assert page.get("/experiment").status_code == 200
    state = page.get("/experiment/state", headers=SCRIPT)
    assert state.status_code == 200
    assert "inf" in state.json()["fields"]['["indenter", "radius"]']["wrong"]


def test_no_field_leads_out_of_the_experiment(page: TestClient, space: Workspace) -> None:
    before = space.text
    for at in ([], ["specimens", 5, "priors", "load_zero"], ["__class__"], [True], [0], ["priors", "nothing"], {"a": 1}, "x"):
        answer = page.post("/experiment/put", data={"at": json.dumps(at), "value": "1", "kind": "fixed"}, headers=SCRIPT)
        assert answer.status_code == 422, at
    assert page.post("/experiment/put", data={"at": "[["}, headers=SCRIPT).status_code == 422
    assert space.text == before


# --- check and calibrate ------------------------------------------------------------------------------------------------


def test_the_check_says_what_the_command_says(page: TestClient, space: Workspace) -> None:
    assert "calib check experiment.toml" in _in_one(page.get("/check").text)
    found = page.get("/check/found", headers={"X-Part": "1"})
    assert "What the data will tell" in found.text
    assert re.search(r"A calibration will take about [^.<]* on this machine if nothing else runs on it\.", found.text)
    assert 'class="level' in page.get("/check/light").text
    put(page, ["indenter", "radius"], value="5")
    refused = page.get("/check/light", headers={"X-Part": "1"})
    assert refused.status_code == 422
    assert "has no unit" in refused.text


def test_a_calibration_is_the_command_that_is_shown_and_outlives_the_page(page: TestClient, space: Workspace) -> None:
    # With these unknown, too, sampling goes on for longer than a slow page takes to cancel it.
    known = "discrepancy|force_noise|capacitance_noise|parasitic_capacitance|machine_compliance"
    space.write_experiment(re.sub(rf"^({known}) = .*\n", "", space.text, flags=re.MULTILINE))
    asked = {"name": "run1", "budget": "3", "seed": "7"}
    jobs._CHILDREN.clear()  # of other tests in this process
    command = page.get("/calibrate/command", params=asked).json()["command"]
    assert command == "calib calibrate experiment.toml -o run1 --budget 3 --seed 7"
    assert page.post("/calibrate/begin", data=asked, follow_redirects=False).headers["location"] == "/run?name=run1"
    assert page.post("/calibrate/begin", data=asked).status_code == 422  # it goes on already
    later = let_in(open_workspace(space.folder))  # another server, which knows nothing but the folder
    begun = dict(jobs._CHILDREN)
    jobs._CHILDREN.clear()
    if sys.platform != "win32":
        job = jobs.job_of(space, "run1")
        assert job is not None
        assert job.alive
        assert job.command == command
    assert "run1" in later.get("/runs").text
    under_way = later.get("/run?name=run1").text
    assert '<button type="submit" class="quiet">Cancel</button>' in under_way
    assert "It is being made by:" in under_way
    assert "Ctrl+C in the terminal of a calibration cancels it" in under_way
    assert f'<code id="again-command">{command} --resume</code>' in _in_one(under_way)
    until(lambda: run_state(space.folder / "run1").last is not None)
    state = run_state(space.folder / "run1")
    assert state.condition == "running"
    assert later.get("/run/progress?name=run1").headers["x-alive"] == "yes"
    later.post("/calibrate/cancel", data={"name": "run1"})
    until(lambda: later.get("/run/progress?name=run1").headers["x-alive"] == "no")
    assert run_state(space.folder / "run1").condition == "stopped"
    assert "Stopped" in later.get("/run/progress?name=run1").text
    stopped = later.get("/run?name=run1").text
    assert "Resume" in stopped
    assert "Ctrl+C" not in stopped
    assert later.post("/calibrate/cancel", data={"name": "run1"}).status_code == 422
    assert [child.wait() for child in begun.values()] == [143]


@pytest.mark.skipif(sys.platform == "win32", reason="there the lock of a run alone tells whether it goes on")
@pytest.mark.parametrize(
    ("begun", "said"), [("2000-01-01 00:00:00", "All is written"), ("2100-01-01 00:00:00", "Reading and checking")]
)
def test_what_is_done_at_the_end_of_a_run_is_no_reading_as_at_its_beginning(finished: Work, begun: str, said: str) -> None:
    import fcntl

    job = finished.space.page_folder / "jobs" / "one"
    job.mkdir(parents=True)
    try:
        words = ["calib", "calibrate", "experiment.toml", "-o", "one"]
        write_text(job / "job.json", record_to_text("job", 1, {"words": words, "pid": 1, "begun": begun}))
        with (job / "lock").open("wb") as lock:  # held by a command as long as it goes on
            fcntl.flock(lock, fcntl.LOCK_EX)
            answer = finished.page.get("/run/progress?name=one")
    finally:
        shutil.rmtree(job)
    assert answer.headers["x-alive"] == "yes"
    assert re.findall(r"<strong>(All is written|Reading and checking)", answer.text) == [said]


def until(holds: Callable[[], bool], seconds: float = 120.0) -> None:
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "it did not come about"
        time.sleep(0.1)


def test_a_calibration_that_is_refused_says_so_and_may_be_begun_again(page: TestClient, space: Workspace) -> None:
    put(page, ["indenter", "radius"], value="5")
    page.post("/calibrate/begin", data={"name": "run1"})
    until(lambda: page.get("/run/progress?name=run1").headers["x-alive"] == "no")
    said = page.get("/run/progress?name=run1").text
    assert "refused" in said
    assert "has no unit" in said
    assert page.get("/calibrate").text.count('value="run1"') == 1


@pytest.mark.parametrize(
    "data",
    [
        {"name": "../out"},
        {"name": "lab"},
        {"name": ""},
        {"name": "a/b"},
        {"name": "x", "budget": "nan"},
        {"name": "x", "seed": "1.5"},
    ],
)
def test_a_calibration_with_a_wrong_name_or_number_is_refused(page: TestClient, space: Workspace, data: dict[str, str]) -> None:
    assert page.post("/calibrate/begin", data=data).status_code == 422
    assert not jobs.jobs(space)


# --- runs ---------------------------------------------------------------------------------------------------------------


def test_runs_are_listed_with_their_state_and_verdict(finished: Work) -> None:
    listed = finished.page.get("/runs").text
    assert re.search(r'name=one">one</a></th><td><span class="level (red|amber|green)">', listed)
    assert re.search(r'name=stopped">stopped</a></th><td>stopped', listed)


def test_a_run_shows_what_was_found_and_its_files_are_taken_along(finished: Work) -> None:
    assert "young_modulus" in finished.page.get("/run/found?name=one").text
    folder = finished.space.folder / "one"
    assert finished.page.get("/run/file?name=one&file=posterior.nc").content == (folder / "posterior.nc").read_bytes()
    with zipfile.ZipFile(io.BytesIO(finished.page.get("/run/bundle.zip?name=one").content)) as archive:
        names = set(archive.namelist())
        assert archive.read("one/summary.json") == (folder / "summary.json").read_bytes()
    assert {"one/posterior.nc", "one/run.json", "one/report.html"} <= names
    assert not any("checkpoint" in name for name in names)
    assert not list((finished.space.page_folder / "downloads").glob("*"))
    assert "as they were" in finished.page.get("/run/verified?name=one").text
    assert {f.state for f in verify(folder)} == {"fine"}


def test_a_certificate_is_taken_along_once_there_is_one(built: Work) -> None:
    assert built.page.get("/run/file?name=run&file=certificate.json").status_code == 422
    (built.space.folder / "run" / "certificate.json").write_text("{}")
    assert "the certificate, for programs" in built.page.get("/run?name=run").text
    assert built.page.get("/run/file?name=run&file=certificate.json").content == b"{}"
    (built.space.folder / "run" / "certificate.json").unlink()


def test_a_report_may_run_nothing(finished: Work) -> None:
    assert "sandbox" in finished.page.get("/report?name=one").text
    answer = finished.page.get("/report/page?name=one")
    assert "sandbox" in answer.headers["content-security-policy"]
    assert "script-src" not in answer.headers["content-security-policy"]
    assert finished.page.get("/report?name=stopped").status_code in (200, 422)


def test_two_runs_stand_side_by_side(finished: Work) -> None:
    shown = finished.page.get("/runs/difference?first=one&second=two").text
    assert "calib diff one two" in _in_one(shown)
    # Two tables of the same numbers say which statistic they show.
    assert "Medians ± one standard deviation" in shown
    assert '<th scope="col">one, median</th>' in shown
    assert "means ± one standard deviation" in finished.page.get("/run/found?name=one").text
    assert "young_modulus" in shown
    assert finished.page.get("/runs/curves.png?first=one&second=two").content.startswith(b"\x89PNG")


def test_what_is_marked_among_the_runs_stands_in_the_commands_that_compare_and_average_them(finished: Work) -> None:
    shown = _in_one(finished.page.get("/runs").text)
    first, second = re.findall(r'<option value="([^"]+)" selected>', shown)
    assert f'<code id="compare">calib diff {first} {second}</code>' in shown
    assert '<code id="averaged">calib average RUN RUN2 -o average</code>' in shown
    asked = finished.page.get("/runs/difference/command?first=two&second=one").json()
    assert asked == {"command": "calib diff two one"}
    asked = finished.page.get("/runs/average/command?run=one&run=two&name=both").json()
    assert asked == {"command": "calib average one two -o both"}


def test_an_average_wants_two_runs_and_a_name(finished: Work) -> None:
    assert finished.page.post("/runs/average", data={"run": "one", "name": "both"}).status_code == 422
    assert finished.page.post("/runs/average", data={"run": ["one", "../x"], "name": "both"}).status_code == 422
    assert finished.page.post("/runs/average", data={"run": ["one", "two"], "name": "one"}).status_code == 422


def test_a_stopped_run_is_gone_on_with_by_the_command_that_resumes(finished: Work, monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[list[str]] = []
    monkeypatch.setattr("calib.serve.jobs.start", lambda space, name, words: begun.append(list(words)))
    finished.page.post("/calibrate/resume", data={"name": "stopped", "budget": "5"})
    assert begun == [["calibrate", "experiment.toml", "-o", "stopped", "--budget", "5", "--resume"]]
    assert "calib calibrate experiment.toml -o stopped --budget 10 --resume</code>" in _in_one(
        finished.page.get("/run?name=stopped").text
    )
    asked = finished.page.get("/calibrate/resumed?name=stopped&budget=5").json()
    assert asked == {"command": "calib calibrate experiment.toml -o stopped --budget 5 --resume"}
    assert finished.page.post("/calibrate/resume", data={"name": "nothing"}).status_code == 422


def test_a_run_of_another_experiment_file_is_gone_on_with_by_that_file(
    finished: Work, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    shutil.copytree(finished.space.folder, tmp_path / "copy", ignore=shutil.ignore_patterns("two", ".serve"))
    space = open_workspace(tmp_path / "copy")
    (space.folder / "first").mkdir()
    for path in [*space.folder.glob("*.toml"), *space.folder.glob("*.csv"), space.folder / "one"]:
        path.rename(space.folder / "first" / path.name)
    shutil.copy(space.folder / "first" / "experiment.toml", space.experiment)
    begun: list[list[str]] = []
    monkeypatch.setattr("calib.serve.jobs.start", lambda space, name, words: begun.append(list(words)))
    let_in(space).post("/calibrate/resume", data={"name": "first/one"})
    assert begun == [["calibrate", "first/experiment.toml", "-o", "first/one", "--resume"]]


def test_going_on_that_was_refused_says_so_beside_the_run_that_stayed_as_it_is(finished: Work, tmp_path: Path) -> None:
    shutil.copytree(finished.space.folder, tmp_path / "copy", ignore=shutil.ignore_patterns("two", ".serve"))
    space = open_workspace(tmp_path / "copy")
    page = let_in(space)
    before = (space.folder / "one" / "run.json").read_bytes()
    space.experiment.write_text(space.experiment.read_text().replace('"5 mm"', '"6 mm"'))
    page.post("/calibrate/resume", data={"name": "one"})
    for _ in range(1200):
        shown = page.get("/run?name=one").text
        if "Cancel" not in shown:
            break
        time.sleep(0.1)
    assert "it was refused, and the run stayed as it is" in shown
    assert "the run in this folder is another" in shown
    assert "It was made by:" in shown
    assert (space.folder / "one" / "run.json").read_bytes() == before


def test_a_calibration_that_is_gone_on_with_shows_the_command_that_goes_on(
    finished: Work, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ("calib", "calibrate", "experiment.toml", "-o", "stopped", "--budget", "5", "--resume")
    going = jobs.Job("stopped", words, 1, "now", "", alive=True)
    monkeypatch.setattr("calib.serve.jobs.job_of", lambda space, name: going)
    shown = _in_one(finished.page.get("/run?name=stopped").text)
    assert "It is being made by:" in shown
    assert "calib calibrate experiment.toml -o stopped --budget 5 --resume" in shown
    assert "--resume --resume" not in shown


def test_an_average_that_goes_on_says_how_it_is_cancelled_and_begun_again(
    finished: Work, monkeypatch: pytest.MonkeyPatch
) -> None:
    going = jobs.Job("stopped", ("calib", "average", "one", "two", "-o", "stopped"), 1, "now", "", alive=True)
    monkeypatch.setattr("calib.serve.jobs.job_of", lambda space, name: going)
    shown = _in_one(finished.page.get("/run?name=stopped").text)
    assert "Ctrl+C in its terminal cancels it" in shown
    assert '<code id="again-command">calib average one two -o stopped</code>' in shown


@pytest.mark.parametrize(("code", "told"), [(143, "before anything was begun"), (2, "It was refused, and nothing was sampled")])
def test_a_calibration_that_ended_before_it_sampled_says_why(
    finished: Work, monkeypatch: pytest.MonkeyPatch, code: int, told: str
) -> None:
    ended = jobs.Job("early", ("calib", "calibrate", "experiment.toml", "-o", "early"), 1, "now", "", alive=False, code=code)
    monkeypatch.setattr("calib.serve.jobs.job_of", lambda space, name: ended)
    begun = finished.space.page_folder / "jobs" / "early"
    begun.mkdir(parents=True)
    try:
        assert told in finished.page.get("/run/progress?name=early").text
    finally:
        begun.rmdir()


def test_the_folder_of_a_run_opens_the_page_with_that_run(finished: Work) -> None:
    space = open_workspace(finished.space.folder / "one")
    assert space.folder == finished.space.folder
    answer = let_in(space).get("/", follow_redirects=False)
    assert answer.headers["location"] == "/run?name=one"
    assert finished.page.get("/", follow_redirects=False).headers["location"] == "/files"


# --- padding ------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory, make_posterior: Callable[..., Posterior]) -> Work:
    """The page of a folder with a run that measured capacitance."""
    lab = make_lab(tmp_path_factory.mktemp("padding"))
    quick(lab, stages=replace(QUICK, sample=lambda *_, **__: make_posterior()))
    return Work(let_in(space := open_workspace(lab)), space)


def test_bands_move_with_load_and_limits(built: Work) -> None:
    assert 'type="range"' in built.page.get("/padding/look?name=run").text
    assert "/padding/look?name=run" in built.page.get("/padding").text
    low, high = (built.page.get(f"/padding/view?name=run&force={force} N").json() for force in (1, 4))
    assert len(low["thickness"]) == len(low["signal"][2]) == 73
    middle = [(a, b) for a, b in zip(low["signal"][2], high["signal"][2], strict=True) if a is not None and b is not None]
    assert middle
    assert all(a < b for a, b in middle)
    assert len(high["reason"]) == len(high["light"]) == 181  # one for every place of the slider
    limited = built.page.get(
        "/padding/view", params={"name": "run", "force": "4 N", "stroke": "0.5 mm", "tolerance": "0.1 mm"}
    ).json()
    assert limited["limits"] == ["stroke at most 0.5 mm"]
    assert max(p for p in limited["conforming"] if p is not None) <= 1
    assert limited["command"] == "calib recommend run --spec run-specification.toml"
    assert low["command"] == 'calib recommend run --force "1 N" --padding "0 mm:9 mm"'


def test_a_load_beyond_the_slider_is_shown_as_extrapolated_by_how_much(built: Work) -> None:
    look = built.page.get("/padding/look?name=run").text
    (found,) = re.findall(r'id="load" min="[^"]+" max="([^"]+)"', look)
    most = float(found)
    run = load_run(built.space.folder / "run")
    measured = largest_force(run.posterior)
    own = [reason.finding[1:] for reason in run.verdict.reasons]  # what speaks against the calibration is said first
    within = built.page.get(f"/padding/view?name=run&force={measured} N").json()
    assert (within["most"], within["beyond"]) == (most, "")
    far = built.page.get(f"/padding/view?name=run&force={3 * most} N").json()
    assert far["most"] == 4 * most
    assert far["force"] == pytest.approx(3 * most)
    assert f"{3 * most / measured:.1f} times the largest measured force" in far["beyond"]
    assert "green" not in far["colour"]
    # On thick padding less was measured, so that a load there is farther beyond it.
    assert all(any(told in reason for told in (far["beyond"], "on padding as thick", *own)) for reason in far["reason"])
    assert f'--force "{3 * most:.6g} N"' in far["command"]
    # The same numbers as from the slider's own table, where both have them.
    near, same = (built.page.get(f"/padding/view?name=run&force={force} N").json() for force in (most, most * 1.0001))
    assert same["most"] == 2 * most
    assert same["spans"]
    there = dict(zip(same["thickness"], same["signal"][2], strict=True))
    both = [
        (low, there[h], high)
        for h, low, high in zip(near["thickness"], near["signal"][0], near["signal"][4], strict=True)
        if low is not None and there.get(h) is not None
    ]
    assert len(both) > 20
    assert all(low < a < high for low, a, high in both)
    # What lies too far is refused with how far that is, and what to do.
    answer = built.page.get("/padding/view?name=run&force=1e9 N", headers=SCRIPT)
    assert answer.status_code == 422
    assert "times what was measured" in answer.json()["faults"][0]
    assert "press a sensor that far" in answer.json()["faults"][0]


@pytest.mark.parametrize("name", ["serve_padding.png", "serve_padding_390.png"])
def test_the_pictures_of_the_padding_page_end_below_a_chart(name: str) -> None:
    docs = Path(__file__).parents[3] / "docs" / "pictures"
    below = np.asarray(Image.open(docs / name).convert("L"))[-8:]
    assert np.all(below > 250)


def test_page_and_report_say_alike_which_paddings_carry_a_load(built: Work) -> None:
    run = load_run(built.space.folder / "run")
    most = json.loads(built.page.get("/padding/view?name=run&force=1 N").text)["most"]
    partly = 0
    for force in (most, 2 * most, 2.9 * most):
        seen = built.page.get(f"/padding/view?name=run&force={force} N").json()
        own = [h for h, covered in zip(seen["thickness"], seen["covered"], strict=True) if covered]
        advice = recommend(run.posterior, run.forward, Requirement(force, 0.0, 9e-3, n_thickness=181, n_draw=300), seed=1)
        told = advice.thickness[advice.covered] * 1e3
        assert [own[0], own[-1]] == pytest.approx([told[0], told[-1]], abs=1.01 * seen["step"])
        partly += not np.all(advice.covered)
    assert partly


@pytest.mark.parametrize("asked", ["force=5", "force=1e9 N", "signal=-3 %", "stroke=x", "tolerance=-1 mm"])
def test_a_view_that_makes_no_sense_is_refused(built: Work, asked: str) -> None:
    answer = built.page.get(f"/padding/view?name=run&{asked}", headers={"Accept": "application/json"})
    assert answer.status_code == 422
    assert answer.json()["faults"]


def test_the_advice_is_kept_with_the_run_as_the_command_keeps_it(built: Work) -> None:
    space = built.space
    built.page.post("/padding/advise", data={"name": "run", "force": "3 N"})
    assert json.loads((space.folder / "run" / "recommendation.json").read_text())
    assert "Advice that is kept with run" in built.page.get("/padding/look?name=run").text
    built.page.post("/padding/advise", data={"name": "run", "force": "3 N", "stroke": "0.5 mm", "tolerance": "0.05 mm"})
    wanted = read_specification(space.folder / "run-specification.toml", 100)
    assert [limit.in_words for limit in wanted.limits] == ["stroke at most 0.5 mm"]
    assert (space.folder / "run" / "specification.csv").is_file()
    assert built.page.post("/padding/advise", data={"name": "run"}).status_code == 422
    # Nothing is advised for a load that the page refuses to show.
    before = (space.folder / "run" / "recommendation.json").read_bytes()
    refused = built.page.post("/padding/advise", data={"name": "run", "force": "0.001 N"})
    assert (refused.status_code, "The load must lie between" in refused.text) == (422, True)
    assert (space.folder / "run" / "recommendation.json").read_bytes() == before


def _value(page: str, field: str) -> str:
    (found,) = re.findall(rf'<input id="{field}"[^>]* value="([^"]*)"', page)
    return str(found)


def test_load_and_limits_stay_over_a_reload_and_the_advice(built: Work) -> None:
    asked = {"name": "run", "force": "2 N", "signal": "11 %", "stroke": "0.9 mm", "tolerance": "0.05 mm"}
    fields = {"force": "force", **{f"limit-{key}": key for key in ("signal", "stroke")}, "tolerance": "tolerance"}
    by_spec = "calib recommend run --spec run-specification.toml"
    # They stand in the address, also in that to which the advice leads.
    answer = built.page.post("/padding/advise", data={**asked, "height": ""}, follow_redirects=False)
    assert answer.status_code == 303, answer.text
    led = answer.headers["location"]
    assert built.page.get("/padding", params=asked).text.count("signal=11%20%25") == 1
    (part,) = re.findall(r'data-load="([^"]+)"', built.page.get(led).text)
    look = built.page.get(part.replace("&amp;", "&")).text
    assert {field: _value(look, field) for field in fields} == {field: asked[key] for field, key in fields.items()}
    assert f'<code id="command">{by_spec}</code>' in _in_one(look)
    # Without an address they are those of the advice that is kept, with the command that gave it.
    look = built.page.get("/padding/look?name=run").text
    assert {field: _value(look, field) for field in fields} == {field: asked[key] for field, key in fields.items()}
    assert f'<code id="command">{by_spec}</code>' in _in_one(look)
    assert f'<code id="gave">{by_spec}</code>' in _in_one(look)
    # What is asked for anew leaves the command of the advice as it is; what is no quantity stays as it was typed.
    look = built.page.get("/padding/look?name=run&force=3 N").text
    assert (_value(look, "force"), _value(look, "limit-signal")) == ("3 N", "")
    assert '<code id="command">calib recommend run --force &#34;3 N&#34; --padding &#34;0 mm:9 mm&#34;</code>' in _in_one(look)
    assert f'<code id="gave">{by_spec}</code>' in _in_one(look)
    assert _value(built.page.get("/padding/look?name=run&force=3 NN").text, "force") == "3 NN"
    built.page.post("/padding/advise", data={"name": "run", "force": "3 N"})
    look = built.page.get("/padding/look?name=run").text
    assert (_value(look, "force"), _value(look, "limit-signal")) == ("3 N", "")
    assert '<code id="gave">calib recommend run --force &#34;3 N&#34;' in _in_one(look)


def test_wide_tables_of_the_page_move_in_their_boxes_as_those_of_the_report(page: TestClient) -> None:
    assert template_text("scroll.css") in page.get("/static/serve.css").text


def test_a_page_without_runs_says_what_to_do_first(page: TestClient) -> None:
    for path in ("/padding", "/runs", "/calibrate"):
        assert page.get(path).status_code == 200
    assert "Calibrate first" in page.get("/padding").text


def test_what_is_damaged_is_told_and_not_served_as_if_it_were_not(built: Work, tmp_path: Path) -> None:
    space = open_workspace(tmp_path / "copy")
    shutil.copytree(built.space.folder / "run", space.folder / "run")
    page = let_in(space)
    content = bytearray((space.folder / "run" / "posterior.nc").read_bytes())
    content[len(content) // 2] ^= 1
    (space.folder / "run" / "posterior.nc").write_bytes(content)
    assert page.get("/run/found?name=run", headers={"X-Part": "1"}).status_code == 422
    write_text(space.experiment, "\x00")
    assert page.get("/experiment").status_code == 200
    space.experiment.write_bytes(b"\xff\xfe")
    assert page.get("/experiment").status_code == 422


# --- beginning ----------------------------------------------------------------------------------------------------------


def test_the_shipped_example_is_a_first_step_that_can_be_calibrated(tmp_path: Path) -> None:
    space = open_workspace(tmp_path / "new")
    page = let_in(space)
    assert "Try it with the shipped example" in page.get("/files").text
    assert page.post("/files/example", headers=SCRIPT).status_code == 200
    experiment = read_experiment(space.experiment)
    assert [specimen.name for specimen in experiment.specimens] == ["sensor 1", "sensor 2"]
    assert {path.name for path in (space.folder / "lab" / "example").iterdir()} >= {"sensor1_lcr.csv", "specification.toml"}
    assert space.lab_files() == [f"lab/example/sensor{k}_{of}.csv" for k in (1, 2) for of in ("instron", "lcr")]
    # What comes of it is what the command makes.
    there = read_experiment(shipped() / "experiment.toml")
    assert replace(experiment, path=None, specimens=(), sha256="") == replace(there, path=None, specimens=(), sha256="")
    seen = page.get("/files").text
    assert "Try it" not in seen
    assert "Use it" not in seen
    assert page.post("/files/example", headers=SCRIPT).status_code == 422  # nothing is overwritten


def test_an_experiment_in_a_dropped_folder_is_offered_and_used_where_its_files_lie(tmp_path: Path) -> None:
    space = open_workspace(tmp_path / "new")
    page = let_in(space)
    sweeps = '[[specimens.sweeps]]\nname = "a"\nforce = "more/press.csv"\n'
    text = EXPERIMENT.replace('"lab/press.csv"', '"./press.csv"')
    more = '[[specimens]]\nname = "b"\n[specimens.priors]\nsensor_thickness = { fixed = "0.74 mm" }\n'
    more += f'padding_thickness = {{ fixed = "1.10 mm" }}\n{sweeps}'
    content = write_press(tmp_path / "press.csv").read_bytes()
    for name, data in (("Mon 1/press.csv", content), ("Mon 1/more/press.csv", content), ("Mon 1/old.toml", b"a = 1")):
        assert page.put(f"/files/upload?name={name}", content=data).status_code == 200
    assert "holds an experiment" not in page.get("/files").text
    page.put("/files/upload?name=Mon 1/experiment.toml", content=(text + more).replace("\n", "\r\n").encode("utf-8-sig"))
    seen = page.get("/files").text
    assert "This folder holds an experiment" in seen
    assert "lab/Mon 1/experiment.toml" in seen
    assert "Start anew" in seen
    assert page.post("/files/use", data={"name": "lab/Mon 1/old.toml"}, headers=SCRIPT).status_code == 422
    assert page.post("/files/use", data={"name": "../new/lab/Mon 1/experiment.toml"}, headers=SCRIPT).status_code == 422
    assert not space.experiment.exists()
    assert page.post("/files/use", data={"name": "lab/Mon 1/experiment.toml"}).status_code == 200
    tables = tomllib.loads(space.text)
    assert tables["specimens"][0]["force"] == {"file": "lab/Mon 1/press.csv", "units": {"force": "N"}}
    assert tables["specimens"][1]["sweeps"][0]["force"] == "lab/Mon 1/more/press.csv"
    assert tables["indenter"] == tomllib.loads(text)["indenter"]
    assert [one.force.name for s in read_experiment(space.experiment).specimens for one in s.sweeps if one.force] == [
        "press.csv"
    ] * 2
    assert "holds an experiment" not in page.get("/files").text
    assert page.post("/files/use", data={"name": "lab/Mon 1/experiment.toml"}, headers=SCRIPT).status_code == 422


@pytest.mark.parametrize("named", ["/etc/hostname", "../../../secret.csv", "C:\\secret.csv", "\\\\host\\share\\x.csv"])
def test_an_experiment_that_names_files_elsewhere_is_not_used(tmp_path: Path, named: str) -> None:
    space = open_workspace(tmp_path / "new")
    page = let_in(space)
    text = EXPERIMENT.replace('"lab/press.csv"', json.dumps(named))
    page.put("/files/upload?name=Mon/experiment.toml", content=text.encode())
    answer = page.post("/files/use", data={"name": "lab/Mon/experiment.toml"}, headers=SCRIPT)
    assert answer.status_code == 422
    assert "lies outside of what was dropped" in answer.json()["faults"][0]
    assert not space.experiment.exists()
