"""A certificate says what its run says, and no change of it, of its run or of its signature passes."""

from __future__ import annotations

import hashlib
import html
import json
import math
import os
import re
import shlex
import shutil
import stat
from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_run import BLOCK, KILLED, QUICK, at_operation, by_hand, in_a_process, in_small_steps, make_lab, quick
from typer.testing import CliRunner, Result

from calib.cli import app
from calib.cli.certificate import how_to_add
from calib.decision import Requirement
from calib.errors import InputError
from calib.experiment import Laboratory, read_experiment, shipped
from calib.lab import Sweep
from calib.problem import Problem
from calib.records import exact_record_from_text, record_to_text
from calib.report import CERTIFICATE_FORMAT, CERTIFICATE_KINDS, certificate_number, lines_to_add, missed_in
from calib.runs import certify_in, load_run, next_in, recommend_in, report_in, verify
from calib.runs.folder import Run
from calib.runs.listing import CERTIFICATES, CERTIFIED, SIGNATURE, Listing, read_listing, write_listing
from calib.runs.ownership import owned
from calib.runs.page import page_of
from calib.sampling import Departure, FirstEstimate, Gate, Posterior, sample
from calib.signature import SecretKey, new_key, public_key_text, secret_key_text, sign

pytestmark = pytest.mark.usefixtures("all_undrawn")

KEY = new_key()
WHO = """
[laboratory]
name = "Soft Sensors"
operator = "A. Person"
country = "NZ"
measured = ["2026-03-17", "2026-03-18"]
[[instruments]]
kind = "load cell"
serial = "12345"
calibrated = 2026-01-12
class = "0.5"
"""
#: A model that the data leave open, and one that they rule out.
OPEN = Departure("gent", "Gent, bonded base", -2.0, FirstEstimate(0.63e6, 0.02e6))
OUT = Departure("slippery", "slippery base", -20.0, FirstEstimate(1.2e6, 0.02e6))
#: What goes to a customer.
HANDED = ("certificate.html", "certificate.json", "certificate.xml", SIGNATURE)
#: Files whose every byte counts, and how many of each are changed, one after the other: 105 in all.
FILES = (*CERTIFICATES, "report.html", "posterior.nc")
N_CHANGE = 15


def _lab(folder: Path, more: str = WHO) -> Path:
    lab = make_lab(folder)
    with (lab / "experiment.toml").open("a") as file:
        file.write(more)
    return lab


def _calibrated(lab: Path, name: str, posterior: Posterior) -> Run:
    """A run folder of a posterior beside which the data leave one other model open, and rule out another."""
    return by_hand(lab, name, replace(posterior, diagnostics=replace(posterior.diagnostics, departures=(OPEN, OUT))))


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory, make_posterior: Callable[..., Posterior]) -> Path:
    """A lab folder with two finished runs that are certified, and one that is not usable."""
    lab = _lab(tmp_path_factory.mktemp("lab"))
    certify_in(_calibrated(lab, "run", make_posterior(n_specimen=1)), key=KEY)
    certify_in(_calibrated(lab, "other", replace(make_posterior(n_specimen=1), seed=8)), key=KEY)
    _calibrated(lab, "red", make_posterior(converged=False, n_specimen=1))
    return lab


@pytest.fixture
def run(made: Path, tmp_path: Path) -> Path:
    """The run in a fresh copy of that folder."""
    shutil.copytree(made, tmp_path / "lab")
    return tmp_path / "lab" / "run"


def _command(*words: object) -> Result:
    return CliRunner().invoke(app, [str(w) for w in words])


def _wrong(run: Path, key: SecretKey | None = None) -> dict[str, str]:
    found = verify(run, None if key is None else key.public)
    return {Path(f.name).name: f.state for f in found if f.state != "fine"}


def _rewritten(run: Path, change: dict[str, Any], **top: Any) -> None:
    """Change what a certificate says, checksum and all, as somebody would who knows how it is made."""
    path = run / "certificate.json"
    text = path.read_text(encoding="utf-8")
    kind = json.loads(text)["kind"]
    content = exact_record_from_text(kind, CERTIFICATE_FORMAT, text)
    content = {**content, "number": certificate_number({**content, **change}), **change}
    path.write_text(record_to_text(top.get("kind", kind), CERTIFICATE_FORMAT, content), encoding="utf-8")
    if (run / "run.json").is_file():
        _relist(run)


def _relist(run: Path) -> None:
    """Put the hashes of all files into run.json, as somebody would who knows how it is made."""
    listing = read_listing(run)
    assert listing is not None
    digests = {n: hashlib.sha256((run / n).read_bytes()).hexdigest() for n in listing.files if (run / n).is_file()}
    write_listing(run, replace(listing, files=digests))


def _flipped(content: bytes, place: int) -> bytes:
    return content[:place] + bytes([content[place] ^ 1]) + content[place + 1 :]


# --- what it says -------------------------------------------------------------------------------------------------------


def test_the_experiment_is_in_it_as_it_was_calibrated_though_its_file_was_edited(tmp_path: Path) -> None:
    file = make_lab(tmp_path) / "experiment.toml"
    calibrated = file.read_text(encoding="utf-8")
    run = quick(tmp_path).run
    file.write_text(calibrated + "# another idea\n", encoding="utf-8")
    certify_in(load_run(run.folder))
    said = json.loads((run.folder / "certificate.json").read_text(encoding="utf-8"))
    assert said["experiment"]["text"] == calibrated
    assert "inputs" in [reason["gate"] for reason in said["verdict"]["reasons"]]
    assert said["files"].keys() >= {"as_calibrated.toml", "posterior.nc"}


def test_it_says_what_the_run_found_who_measured_and_how_it_was_made(run: Path) -> None:
    said = json.loads((run / "certificate.json").read_text(encoding="utf-8"))
    posterior = load_run(run).posterior
    modulus = said["results"][0]
    assert [value["name"] for value in said["results"]][-1] == "padding_thickness[sensor 1]"
    draws = posterior.to_dataframe()["young_modulus"].to_numpy()
    assert modulus["value"] == pytest.approx(np.mean(draws), rel=1e-3)  # those of the fixture are the truth
    assert modulus["standard_uncertainty"] == pytest.approx(np.std(draws), rel=0.1)
    assert modulus["interval_95"] == pytest.approx(np.quantile(draws, [0.025, 0.975]))
    assert modulus["unit"] == "Pa"
    assert said["laboratory"]["operator"] == "A. Person"
    assert said["instruments"] == [{"kind": "load cell", "serial": "12345", "calibrated": "2026-01-12", "class": "0.5"}]
    text = (run.parent / "experiment.toml").read_text(encoding="utf-8")
    assert said["experiment"]["text"] == text
    assert said["experiment"]["sha256"] == hashlib.sha256(text.encode()).hexdigest()
    lab_file = hashlib.sha256((run.parent / "force.csv").read_bytes()).hexdigest()
    assert {"what": "lab file", "file": "force.csv", "sha256": lab_file} in said["inputs"]
    assert [c["text"] for c in said["commands"]] == ["calib calibrate", "calib certificate"]
    assert said["calibrated_with"].keys() >= {"python", "numpy", "platform"}
    assert said["files"]["posterior.nc"] == load_run(run).posterior_sha256


def test_it_names_every_gate_with_its_light_those_of_the_report_first_of_all(run: Path) -> None:
    def told(folder: Path) -> tuple[dict[str, str], str, str]:
        said = json.loads((folder / "certificate.json").read_text(encoding="utf-8"))
        assert all(light["reason"] and bool(light["action"]) == (light["light"] != "green") for light in said["gates"])
        reasons = [(r["gate"], r["level"], r["finding"], r["action"]) for r in said["verdict"]["reasons"]]
        assert [tuple(light.values()) for light in said["gates"][: len(reasons)]] == reasons
        paths = [folder / f"certificate.{kind}" for kind in ("html", "xml")]
        page, xml = (html.unescape(path.read_text(encoding="utf-8")) if path.is_file() else "" for path in paths)
        return {light["gate"]: light["light"] for light in said["gates"]}, page, xml

    lights, page, xml = told(run)
    report_in(load_run(run))
    report = (run / "report.html").read_text(encoding="utf-8")
    assert list(lights) == re.findall(r"<span>✓ ([a-z ]+)</span>", report)
    assert len(lights) > 7
    assert set(lights.values()) == {"green"}
    for gate in lights:
        assert f"✓ {gate}: " in page
        assert f"green, {gate}<" in xml
    red = run.parent / "red"
    certify_in(load_run(red))
    lights, page, _ = told(red)
    assert lights["convergence"] == "red"
    assert lights["fit"] == "green"
    assert "✓ convergence" not in page


def test_what_is_added_later_comes_in_by_resuming_and_all_commands_are_told(tmp_path: Path) -> None:
    lab = _lab(tmp_path, "")
    certify_in(quick(lab, seed=4, command="calib calibrate experiment.toml -o run").run)
    with (lab / "experiment.toml").open("a") as file:
        file.write(WHO)
    assert _wrong(lab / "run") == {"experiment.toml": "changed"}
    quick(lab, resume=True, command="calib calibrate experiment.toml -o run --resume")
    assert _wrong(lab / "run") == {"certificate.json": "stale"}
    report_in(load_run(lab / "run"), command="calib report run")
    report_in(load_run(lab / "run"), command="calib report run")  # the same again is kept once
    made = certify_in(load_run(lab / "run"), command="calib certificate run")
    assert made.laboratory.operator == "A. Person"
    assert [c["text"] for c in made.origin.commands] == [
        "calib calibrate experiment.toml -o run",
        "calib calibrate experiment.toml -o run --resume",
        "calib report run",
        "calib certificate run",
    ]
    listing = read_listing(lab / "run")
    assert listing is not None
    assert [c.text for c in listing.commands][1:4:2] == ["calib certificate", "calib report run"]
    assert _wrong(lab / "run") == {}


def test_of_commands_that_wrote_what_is_hashed_the_last_of_each_is_told(run: Path) -> None:
    def recommended(command: str) -> None:
        recommend_in(load_run(run), Requirement(2.0, 0.5e-3, 3e-3, n_thickness=5, n_draw=50), seed=1, command=command)

    report_in(load_run(run), command="calib report run --pdf")  # whose summary is still there
    recommended("calib recommend run --force '1 N'")
    recommended("calib recommend run --force '2 N'")
    next_in(load_run(run), None, seed=1, command="calib next run --for modulus")
    made = certify_in(load_run(run), command="calib certificate run")
    assert [c["text"] for c in made.origin.commands] == [
        "calib calibrate",
        "calib report run --pdf",
        "calib recommend run --force '2 N'",
        "calib next run --for modulus",
        "calib certificate run",
    ]
    assert {"recommendation.json", "next.json"} <= json.loads((run / "certificate.json").read_text())["files"].keys()
    assert _wrong(run) == {}


def test_how_to_add_what_is_not_said_can_be_pasted_from_where_one_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a lab").mkdir()
    lab = _lab(tmp_path / "a lab", "")
    quick(lab, seed=4)
    monkeypatch.chdir(tmp_path)
    said = _command("certificate", "a lab/run").stdout
    (line,) = (line for line in said.splitlines() if ", then: " in line)
    asked, pasted = line.split(", then: ")
    with Path(shlex.split(asked)[-1]).open("a") as file:
        file.write(WHO)
    words = shlex.split(pasted)
    done = CliRunner().invoke(app, words[1:], obj=QUICK)
    assert (words[0], done.exit_code) == ("calib", 3), done.output  # so short a run is never converged
    assert ", then: " not in _command("certificate", "a lab/run").stdout
    said = json.loads((lab / "run" / "certificate.json").read_text(encoding="utf-8"))
    assert said["laboratory"]["operator"] == "A. Person"


def test_the_models_that_the_data_leave_open_come_before_the_results(run: Path) -> None:
    model = "Gent, bonded base (odds 1 : 7.4), with a Young's modulus of 0.630 ± 0.020 instead of"
    said = json.loads((run / "certificate.json").read_text(encoding="utf-8"))
    (told,) = said["open_models"]
    assert told.startswith(model)
    assert said["statement"].endswith("the data do not rule out one other model: see below.")
    assert list(said).index("open_models") < list(said).index("results") < list(said).index("meant")
    for name, results in (("certificate.html", "<h2>Results</h2>"), ("certificate.xml", "Value: mean of the posterior.")):
        text = html.unescape((run / name).read_text(encoding="utf-8"))
        assert text.index(model) < text.index(results), name
    assert model in _command("certificate", run).stdout


def test_a_run_of_before_commands_were_kept_tells_the_one_that_began_it(run: Path) -> None:
    listing = read_listing(run)
    assert listing is not None
    write_listing(run, replace(listing, commands=(), attrs={"command": "calib calibrate"}))
    made = certify_in(load_run(run), command="calib certificate run")
    assert [c["text"] for c in made.origin.commands] == ["calib calibrate", "calib certificate run"]


def test_the_page_shows_numbers_rounded_and_stands_by_itself(run: Path) -> None:
    page = (run / "certificate.html").read_text(encoding="utf-8")
    said = json.loads((run / "certificate.json").read_text(encoding="utf-8"))
    assert "<h1>Certificate of calibration</h1>" in page
    assert said["number"] in page
    assert load_run(run).posterior_sha256 in page
    assert f"{said['results'][0]['value']}" not in page
    assert "no certificate of an accredited calibration" in page
    assert "src=" not in page
    assert "href=" not in page


def test_a_red_run_gets_a_statement_that_says_so_first_and_has_no_numbers(run: Path) -> None:
    red = run.parent / "red"
    done = _command("certificate", red)
    assert done.exit_code == 3, done.output
    assert done.stdout.startswith("NOT A CERTIFICATE: do not use the numbers of this calibration")
    text = (red / "certificate.json").read_text(encoding="utf-8")
    assert text.startswith('{\n "kind": "no certificate: do not use the numbers of this calibration"')
    said = json.loads(text)
    assert said["results"] is None
    assert said["taken_as_known"] == []
    assert said["open_models"] == []  # whose moduli are numbers, too
    page = (red / "certificate.html").read_text(encoding="utf-8")
    assert page.index("NOT A CERTIFICATE") < page.index("<body>")
    mean = load_run(red).posterior.diagnostics.parameters["young_modulus"].mean
    assert f"{mean / 1e6:.3f}" not in page
    assert not (red / "certificate.xml").exists()
    assert _wrong(red) == {}


def test_what_a_customer_looks_for_stands_at_its_head_with_the_lines_to_add(
    tmp_path: Path, make_posterior: Callable[..., Posterior]
) -> None:
    lab = _lab(tmp_path, "")
    _calibrated(lab, "run", make_posterior(n_specimen=1))
    done = _command("certificate", lab / "run")
    assert done.exit_code == 0, done.output  # the verdict is on the numbers, and stays as it is
    assert "Green: the numbers can be used." in done.stdout
    page = (lab / "run" / "certificate.html").read_text(encoding="utf-8")
    said = json.loads((lab / "run" / "certificate.json").read_text(encoding="utf-8"))
    assert said["verdict"]["colour"] == "green"
    assert said["statement"].endswith("who measured, where, when or with what is not said in full, see below.")
    missed = ("which laboratory", "where it is", "who measured", "when it was measured", "with which instruments, their serial")
    for what in missed:
        assert page.index("Verdict: green") < page.index(f"<li>{what}") < page.index("<h2>Results</h2>")
        assert f"  not said: {what}" in done.stdout
    lines = done.stdout.split("Lines to add, filled in:\n")[1].split("  Add it to")[0]
    # As they stand they are refused, one by one; filled in they are what was missed.
    with (lab / "experiment.toml").open("a") as file:
        file.write(lines)
    with pytest.raises(InputError) as refused:
        read_experiment(lab / "experiment.toml")
    assert len(refused.value.faults) == lines.count('"..."') + lines.count('".."') + lines.count("YYYY")
    text = (
        (lab / "experiment.toml")
        .read_text()
        .replace('"..."', '"x"')
        .replace('".."', '"NZ"')
        .replace("YYYY-MM-DD", "2026-03-17")
    )
    (lab / "experiment.toml").write_text(text)
    read = read_experiment(lab / "experiment.toml")
    assert missed_in(read.laboratory, read.instruments) == ()
    part = replace(read.instruments[0], serial="")
    assert missed_in(read.laboratory, (part,)) == ("the serial number of the load cell",)
    assert lines_to_add(read.laboratory, (part,), ())[-1] == 'serial = "..."'


def test_a_day_that_is_still_to_come_is_an_amber_reservation_with_both_days(
    tmp_path: Path, make_posterior: Callable[..., Posterior]
) -> None:
    lab = _lab(tmp_path, WHO.replace("2026-03-18", "2999-03-18").replace("2026-01-12", "2998-01-12"))
    _calibrated(lab, "run", make_posterior(n_specimen=1))
    done = _command("certificate", lab / "run")
    assert done.exit_code == 0, done.output
    assert _command("certificate", lab / "run", "--strict").exit_code == 3
    page, xml = ((lab / "run" / f"certificate.{kind}").read_text(encoding="utf-8") for kind in ("html", "xml"))
    content = json.loads((lab / "run" / "certificate.json").read_text(encoding="utf-8"))
    clock = content["issued"][:10]
    told = "2999-03-18 is stated as the day of measurement, and the clock of the computer that issued this stood at"
    for text in (done.stdout, page, xml):
        assert f"{told} {clock}" in text
        assert "Put right the one that is wrong, measured in [laboratory] or the clock, and issue it again" in text
    assert "with reservations" in content["title"]
    assert [r["gate"] for r in content["verdict"]["reasons"]] == ["day", "day"]
    assert load_run(lab / "run").verdict.colour == "green"
    assert _wrong(lab / "run") == {}
    # Without that reservation it is none that this program wrote, whoever puts checksums right.
    green = {"verdict": {"colour": "green", "reasons": []}, "title": "Certificate of calibration"}
    _rewritten(lab / "run", green, kind="certificate")
    assert "certificate.json" in _wrong(lab / "run")


def test_it_is_tomorrow_already_in_the_east(tmp_path: Path, make_posterior: Callable[..., Posterior]) -> None:
    day = (datetime.now(UTC) + timedelta(hours=13)).date().isoformat()
    lab = _lab(tmp_path, f'[laboratory]\nmeasured = "{day}"\n')
    _calibrated(lab, "run", make_posterior(n_specimen=1))
    assert certify_in(load_run(lab / "run")).verdict.colour == "green"


def test_no_lines_to_add_are_announced_where_there_are_none(tmp_path: Path, make_posterior: Callable[..., Posterior]) -> None:
    lab = _lab(tmp_path, WHO.replace("2026-01-12", "2026-05-12"))  # after it measured: no line mends that
    _calibrated(lab, "run", make_posterior(n_specimen=1))
    said = _command("certificate", lab / "run").stdout
    assert "it was calibrated afterwards" in said
    assert "Lines to add" not in said


def test_without_a_laboratory_its_head_has_the_lines_to_add_and_the_shipped_example_is_copied_first(
    tmp_path: Path, make_posterior: Callable[..., Posterior], monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = _lab(tmp_path, "")
    run = _calibrated(lab, "run", make_posterior(n_specimen=1))
    said = _command("certificate", lab / "run").stdout
    lines = certify_in(run).to_add
    assert lines
    assert said.index("It names no laboratory.") < said.index(f"    {lines[0]}") < said.index("Green: the numbers can be used.")
    page = (lab / "run" / "certificate.html").read_text(encoding="utf-8")
    assert page.index("It names no laboratory and is not for a customer yet") < page.index("<h2>Results</h2>")
    assert "\n".join(lines) in html.unescape(page)
    assert "calib example" not in said
    example = shipped() / "experiment.toml"
    monkeypatch.chdir(tmp_path)
    advice = how_to_add(load_run(lab / "run"), (example, example), (None, None))
    assert "copy it first, by: calib example -o mine. Add it to mine/experiment.toml, then: calib calibrate mine/" in advice
    assert str(example.parent) not in advice


def test_only_instruments_that_measured_something_are_asked_for(make_posterior: Callable[..., Posterior]) -> None:
    both = make_posterior(n_specimen=1).sweeps[0]
    force, capacitance = (replace(both, channels={name: both.channels[name]}) for name in ("force", "capacitance"))

    def kinds(*sweeps: Sweep) -> list[str]:
        lines = lines_to_add(Laboratory(), (), sweeps)
        return [line.split('"')[1] for line in lines if line.startswith("kind")]

    assert kinds(both) == ["load cell", "LCR meter"]
    assert kinds(force) == ["load cell"]
    assert kinds(force, capacitance) == ["load cell", "LCR meter"]
    beside = replace(capacitance.channels["capacitance"], force=both.channels["force"].value)
    assert kinds(replace(capacitance, channels={"capacitance": beside})) == ["load cell", "LCR meter"]
    by_depth = replace(beside, force=None)
    assert kinds(replace(capacitance, channels={"capacitance": by_depth})) == ["LCR meter"]


def test_what_the_experiment_file_does_not_say_is_said_not_to_be_said(
    tmp_path: Path, make_posterior: Callable[..., Posterior]
) -> None:
    lab = _lab(tmp_path, "")
    _calibrated(lab, "run", make_posterior(n_specimen=1))
    (lab / "experiment.toml").unlink()
    done = _command("certificate", lab / "run")
    assert done.exit_code == 0, done.output
    for what in ("who measured", "with which instruments", "the text of the experiment file, which is not there any more"):
        assert f"not said: {what}" in done.stdout
    assert "no certificate.xml, which needs name in [laboratory], operator in [laboratory]" in done.stdout
    assert not (lab / "run" / "certificate.xml").exists()


def test_files_that_are_not_as_they_were_written_are_not_certified(run: Path) -> None:
    before = {p: p.read_bytes() for p in run.rglob("*") if p.is_file()}
    (run / "summary.csv").write_bytes(_flipped(before[run / "summary.csv"], 3))
    before[run / "summary.csv"] = (run / "summary.csv").read_bytes()
    with pytest.raises(InputError, match=r"summary\.csv: this file is not as it was written, and nothing is certified"):
        certify_in(load_run(run))
    assert {p: p.read_bytes() for p in run.rglob("*") if p.is_file()} == before
    (run / "summary.csv").unlink()
    with pytest.raises(InputError, match=r"summary\.csv: this file is not as it was written"):
        certify_in(load_run(run))
    (run / "run.json").unlink()
    with pytest.raises(InputError, match=r"run\.json is not there"):
        certify_in(load_run(run))


# --- what is changed is found -------------------------------------------------------------------------------------------


def test_every_single_byte_counts(run: Path) -> None:
    assert _wrong(run, KEY) == {}
    whole = {name: (run / name).read_bytes() for name in FILES}
    rng = np.random.default_rng(21)
    for _ in range(N_CHANGE):
        for name, content in whole.items():
            (run / name).write_bytes(_flipped(content, int(rng.integers(len(content)))))
        assert _wrong(run) == {**dict.fromkeys(FILES, "changed"), "forward model": "not checked"}  # told by the posterior alone
    for name, content in whole.items():
        (run / name).write_bytes(content)
    assert _wrong(run, KEY) == {}


@pytest.mark.parametrize("name", ["posterior.nc", "report.html", "summary.csv"])
def test_of_a_changed_file_nothing_else_is_accused_and_nothing_is_certified(run: Path, name: str) -> None:
    content = (run / name).read_bytes()
    (run / name).write_bytes(_flipped(content, len(content) // 2))
    told = {f.name: f for f in verify(run) if f.state != "fine" and f.name != SIGNATURE}
    assert {n for n, f in told.items() if f.wrong} == {name}
    assert (told["certificate.json"].state, told["certificate.json"].note) == (
        "not checked",
        f"it is of the {name} that the run wrote, which is not the one that is here: put that back",
    )
    assert ("forward model" in told) == (name == "posterior.nc")
    done = _command("verify", run)
    assert done.exit_code == 3, done.output
    assert f"{name} is not as written" in " ".join(done.stderr.split())
    assert "issue it again" not in done.output
    before = (run / "certificate.json").read_bytes()
    refused = _command("certificate", run)
    assert refused.exit_code == 2, refused.output
    assert name in " ".join(refused.stderr.split())
    assert (run / "certificate.json").read_bytes() == before


def test_an_advice_belongs_to_its_draws_whatever_the_experiment_says_since(tmp_path: Path) -> None:
    lab = _lab(tmp_path, "")
    given = "calib recommend run --force '2 N' --padding '0.5 mm:3 mm'"
    run = quick(lab, seed=4, command="calib calibrate experiment.toml -o run").run
    recommend_in(run, Requirement(2.0, 0.5e-3, 3e-3, n_thickness=5, n_draw=50), seed=1, command=given)
    with (lab / "experiment.toml").open("a") as file:
        file.write(WHO)
    quick(lab, resume=True, stages=replace(QUICK, sample=_no_step_more, page=page_of))
    again = load_run(lab / "run")
    assert again.posterior_sha256 != run.posterior_sha256
    assert again.posterior.draws_sha256 == run.posterior.draws_sha256
    assert "made from other draws" not in again.report.read_text(encoding="utf-8")
    assert given in [command["text"] for command in certify_in(again).origin.commands]
    assert _wrong(lab / "run") == {}
    # Of a run that was sampled further it is none any more.
    quick(lab, resume=True, stages=replace(QUICK, page=page_of))
    assert "made from other draws" in (lab / "run" / "report.html").read_text(encoding="utf-8")
    assert _wrong(lab / "run") == {"recommendation.json": "stale", "certificate.json": "stale"}
    done = _command("verify", lab / "run")
    assert f"run it again, `{given}`" in done.stdout
    assert "recommendation.json and certificate.json are of what the run was before" in " ".join(done.stderr.split())
    with pytest.raises(InputError, match=r"made from other draws .* nothing is certified\. Run it again, `calib recommend run"):
        certify_in(load_run(lab / "run"))


def _no_step_more(problem: Problem, *, checkpoint: Path, **options: Any) -> Posterior:
    """What is kept, as it is."""
    n_block = len(list(checkpoint.glob("ensemble-0-0*.npz")))
    limits = {"max_steps": BLOCK * n_block, "max_seconds": math.inf, "gate": Gate(ess=1e9)}
    with in_small_steps():
        return sample(problem, checkpoint=checkpoint, **{**options, **limits})


@pytest.mark.parametrize("name", [*FILES, "summary.json"])
def test_a_byte_counts_where_the_hash_in_run_json_was_changed_with_it(run: Path, name: str) -> None:
    content = (run / name).read_bytes()
    # The first line of a signature is a comment that nobody signs.
    first = content.index(b"\n") + 1 if name.endswith(".minisig") else 0
    place = int(np.random.default_rng(22).integers(first, len(content)))
    (run / name).write_bytes(_flipped(content, place))
    _relist(run)
    found = _wrong(run, KEY)
    assert found.get(name, found.get("certificate.json")) in ("changed", "stale"), place


def test_a_certificate_of_another_run_is_none_of_this_one(run: Path) -> None:
    for name in CERTIFICATES:
        shutil.copy(run.parent / "other" / name, run / name)
    assert _wrong(run, KEY) == dict.fromkeys(CERTIFICATES, "changed")
    _relist(run)
    (wrong,) = (f for f in verify(run, KEY.public) if f.state != "fine")
    assert (wrong.name, wrong.state, wrong.note) == ("certificate.json", "changed", "it is of another run")


def _results(**change: Any) -> Any:
    def changed(said: dict[str, Any]) -> dict[str, Any]:
        return {"results": [said["results"][0] | change, *said["results"][1:]]}

    return changed


@pytest.mark.parametrize(
    ("change", "note"),
    [
        (_results(value=7e5), "its young_modulus is not that of the posterior"),
        (_results(standard_uncertainty=1.0), "its young_modulus is not that of the posterior"),
        (_results(unit="MPa"), "its young_modulus is not that of the posterior"),
        (lambda _: {"results": []}, "it holds other results than the posterior"),
        (lambda s: {"laboratory": s["laboratory"] | {"operator": "C. Person"}}, "its laboratory is not that of the run"),
        (lambda _: {"instruments": []}, "its instruments is not that of the run"),
        (lambda _: {"open_models": []}, "its open models are not those of the run"),
        (lambda s: {"gates": s["gates"][1:]}, "its gates is not that of the run"),
        (lambda _: {"title": "Certificate of an accredited calibration"}, "its title is not that of the run"),
        (lambda _: {"statement": "All is well."}, "its statement is not that of the run"),
        (lambda _: {"meant": "Value: exact."}, "its meant is not that of the run"),
        (lambda _: {"accreditation": "ISO/IEC 17025"}, "its accreditation is not that of the run"),
        (lambda _: {"model": "Gent, with friction"}, "its model is not that of the run"),
        (lambda _: {"name": "Another experiment"}, "its name is not that of the run"),
        (lambda _: {"specimens": ["sensor 7"]}, "its specimens is not that of the run"),
        (lambda _: {"not_said": []}, "its not said is not that of the run"),
        (lambda _: {"ended": "2020-01-01T00:00:00+00:00"}, "its ended is not that of the run"),
        (lambda s: {"calibrated_with": s["calibrated_with"] | {"numpy": "1.0"}}, "its calibrated with is not that of the run"),
        (lambda s: {"experiment": s["experiment"] | {"file": "other.toml"}}, "its experiment is not that of the run"),
        (lambda s: {"commands": [s["commands"][0] | {"text": "calib calibrate x"}]}, "the run knows of no command"),
        (_results(learned="settled twice"), "what it says beside its results is not that of the run"),
        (_results(label="Hardness"), "what it says beside its results is not that of the run"),
        (lambda _: {"number": "0000-0000-0000-0000"}, "its number is not that of what it says"),
        (lambda s: {"experiment": s["experiment"] | {"text": "name = 'x'"}}, "the text of the experiment in it is another"),
        (lambda s: {"files": {n: d for n, d in s["files"].items() if n != "posterior.nc"}}, "it is of no posterior.nc"),
        (lambda s: {"files": s["files"] | {"../../secret": "0"}}, "it names ../../secret"),
        (lambda s: {"files": s["files"] | {"members/../../secret": "0"}}, "it names members/../../secret"),
        (lambda s: {"verdict": s["verdict"] | {"colour": "amber"}}, "it is a certificate with a verdict that is amber"),
        (lambda _: {"verdict": "green"}, "it is no certificate as it was written"),
        (lambda _: {"files": None}, "it is no certificate as it was written"),
    ],
)
def test_what_is_rewritten_with_all_its_hashes_does_not_pass(run: Path, change: Any, note: str) -> None:
    _rewritten(run, change(json.loads((run / "certificate.json").read_text(encoding="utf-8"))))
    wrong = {f.name: f for f in verify(run, KEY.public) if f.state != "fine"}
    assert {name: f.state for name, f in wrong.items()} == dict.fromkeys(("certificate.json", SIGNATURE), "changed")
    assert note in wrong["certificate.json"].note


def test_a_page_that_is_rewritten_with_all_its_hashes_does_not_pass(run: Path) -> None:
    certify_in(load_run(run))
    for name, of_it, another in (
        ("certificate.html", "<h1>Certificate of calibration", "<h1>Certificate of an accredited calibration"),
        ("certificate.xml", "Soft Sensors", "Hard Sensors"),
        ("ro-crate-metadata.json", "Soft Sensors", "Hard Sensors"),
    ):
        whole = {file: (run / file).read_bytes() for file in (name, "certificate.json", "run.json")}
        text = (run / name).read_text(encoding="utf-8")
        assert of_it in text
        (run / name).write_text(text.replace(of_it, another), encoding="utf-8")
        said = json.loads((run / "certificate.json").read_text(encoding="utf-8"))
        _rewritten(run, {"files": said["files"] | {name: hashlib.sha256((run / name).read_bytes()).hexdigest()}})
        (wrong,) = (f for f in verify(run) if f.state != "fine")
        assert (wrong.name, wrong.state, wrong.note) == (name, "changed", "it is not what comes of the certificate")
        for file, content in whole.items():
            (run / file).write_bytes(content)
    assert _wrong(run) == {}


def test_what_another_version_issued_is_held_by_its_hashes_and_that_is_said(run: Path) -> None:
    said = json.loads((run / "certificate.json").read_text(encoding="utf-8"))
    _rewritten(run, {"certified_with": said["certified_with"] | {"numpy": "1.0"}})
    listing = read_listing(run)
    assert listing is not None
    number = json.loads((run / "certificate.json").read_text(encoding="utf-8"))["number"]
    write_listing(run, replace(listing, attrs={**listing.attrs, CERTIFIED: number}))  # as that version would have
    found = {f.name: f for f in verify(run)}
    assert not any(f.wrong for f in found.values())
    assert "not made again here" in found["certificate.html"].note


@pytest.mark.parametrize(
    "change",
    [
        lambda said: {"issued": "2027-01-01T00:00:00+00:00"},
        lambda said: {"certified_with": said["certified_with"] | {"numpy": "1.0"}},
        lambda said: {"certified_with": {k: v for k, v in said["certified_with"].items() if k != "platform"}},
        lambda said: {"commands": [{**command, "at": "2020-01-01T00:00:00+00:00"} for command in said["commands"]]},
    ],
)
def test_hour_and_versions_are_those_of_the_certificate_that_the_run_knows_of(
    run: Path, change: Callable[[dict[str, Any]], dict[str, Any]]
) -> None:
    certify_in(load_run(run))
    assert any(f.note.startswith("not signed: when it was issued, and with which versions, is held by") for f in verify(run))
    said = json.loads((run / "certificate.json").read_text(encoding="utf-8"))
    _rewritten(run, change(said))
    (wrong,) = (f for f in verify(run) if f.name == "certificate.json")
    assert (wrong.state, f"No. {said['number']}: when it was issued" in wrong.note) == ("changed", True)


def test_a_red_run_cannot_be_made_to_look_usable(run: Path) -> None:
    red = run.parent / "red"
    certify_in(load_run(red))
    green = {"verdict": {"colour": "green", "reasons": []}, "converged": True, "results": []}
    _rewritten(red, green, kind=CERTIFICATE_KINDS["green"])
    (wrong,) = (f for f in verify(red) if f.state != "fine")
    assert (wrong.name, wrong.state) == ("certificate.json", "changed")
    assert "says green, and the verdict on this calibration is red" in wrong.note


def test_a_certificate_of_what_was_written_anew_since_is_stale(run: Path) -> None:
    recommend_in(load_run(run), Requirement(2.0, 0.5e-3, 3e-3, n_thickness=5, n_draw=50), seed=1)
    (run / "report.html").write_text("<p>another page of the same run</p>")
    _relist(run)
    done = _command("verify", run)
    assert done.exit_code == 3, done.output
    assert "stale         certificate.json (it is not of the report.html that is here: issue it again with" in done.stdout
    certify_in(load_run(run))
    assert _wrong(run) == {}


# --- who signed it ------------------------------------------------------------------------------------------------------


def test_the_key_tells_who_signed(run: Path, tmp_path: Path) -> None:
    made = _command("key", "new", "-o", tmp_path / "lab.key")
    assert made.exit_code == 0, made.output
    secret, public = tmp_path / "lab.key", tmp_path / "lab.pub"
    if os.name == "posix":
        assert stat.S_IMODE(secret.stat().st_mode) == 0o600
    assert _command("key", "new", "-o", secret).exit_code == 2
    signed = _command("certificate", run, "--key", secret)
    assert signed.exit_code == 0, signed.output
    checked = _command("verify", run, "--public-key", public)
    assert checked.exit_code == 0, checked.output
    assert "signed by A. Person, Soft Sensors with the key" in checked.stdout
    assert "verdict:green" in checked.stdout
    # Whoever has no key learns that there is a signature, and that it was not looked at.
    said = _command("verify", run)
    assert said.exit_code == 0
    (signature,) = [line for line in said.stdout.splitlines() if line.startswith("not checked ")]
    assert "certificate.json.minisig (said to be signed with the key " in signature
    assert "give the laboratory's own with --public-key" in signature
    assert "The signature was not checked" in said.stdout.splitlines()[-1]
    swapped = _command("verify", run, "--public-key", secret)
    assert swapped.exit_code == 2
    assert "this is a secret key" in " ".join(swapped.stderr.split())


def test_another_key_no_signature_and_no_certificate_do_not_pass_for_signed(run: Path) -> None:
    other = new_key()
    assert _wrong(run, other) == {"certificate.json.minisig": "changed"}
    certificate = (run / "certificate.json").read_bytes()
    forged = SecretKey(KEY.number, other.seed, other.public)
    for key, note in ((other, "signed with the key"), (forged, "the signature is not that of the key")):
        (run / "certificate.json.minisig").write_text(sign(certificate, key, "timestamp:1"))
        _relist(run)
        (wrong,) = (f for f in verify(run, KEY.public) if f.state != "fine")
        assert (wrong.name, wrong.state) == (SIGNATURE, "changed")
        assert note in wrong.note
    (run / "certificate.json.minisig").unlink()
    assert _wrong(run) == {"certificate.json.minisig": "missing"}
    _relist(run)
    assert _wrong(run) == {}
    assert _wrong(run, KEY) == {"certificate.json.minisig": "missing"}
    assert _wrong(run.parent / "red", KEY) == {"certificate.json.minisig": "missing"}


def test_issued_without_a_key_the_earlier_signature_goes(run: Path) -> None:
    certify_in(load_run(run))
    assert not (run / "certificate.json.minisig").exists()
    assert _wrong(run) == {}
    assert any(f.name == "certificate.json" and f.note.startswith("not signed: ") for f in verify(run))


def test_a_password_is_taken_from_the_environment_where_nobody_can_be_asked(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refused = _command("key", "new", "-o", tmp_path / "lab.key", "--password")
    assert refused.exit_code == 2
    assert not (tmp_path / "lab.key").exists()
    monkeypatch.setenv("CALIB_KEY_PASSWORD", "pässword")
    assert _command("key", "new", "-o", tmp_path / "lab.key", "--password").exit_code == 0
    assert _command("certificate", run, "--key", tmp_path / "lab.key").exit_code == 0
    monkeypatch.setenv("CALIB_KEY_PASSWORD", "another")
    refused = _command("certificate", run, "--key", tmp_path / "lab.key")
    assert refused.exit_code == 2
    assert "the password is another" in refused.stderr
    monkeypatch.delenv("CALIB_KEY_PASSWORD")
    refused = _command("certificate", run, "--key", tmp_path / "lab.key")
    assert refused.exit_code == 2
    assert "Set CALIB_KEY_PASSWORD" in " ".join(refused.stderr.split())


# --- without its run ----------------------------------------------------------------------------------------------------


@pytest.fixture
def handed(run: Path, tmp_path: Path) -> Path:
    """A folder with what goes to a customer, and beside it the laboratory's public key."""
    folder = tmp_path / "handed"
    folder.mkdir()
    for name in HANDED:
        shutil.copy(run / name, folder / name)
    (tmp_path / "lab.pub").write_text(public_key_text(KEY.public))
    return folder


def _checked(path: Path, *, key: bool = True) -> tuple[int, str]:
    given = ("--public-key", path.parents[path.is_file()] / "lab.pub") if key else ()
    done = _command("verify", path, *given)
    return done.exit_code, done.stdout + done.stderr


def test_a_customer_checks_a_certificate_without_its_run_and_is_told_what_that_leaves_open(handed: Path) -> None:
    for path in (handed, handed / "certificate.json"):
        code, said = _checked(path)
        assert (code, said.count("fine  ")) == (0, len(HANDED)), said
        assert "signed by A. Person, Soft Sensors with the key" in said
        assert "It says that it is: Certificate of calibration, No. " in said
        assert "Cannot be told here: whether posterior.nc, summary.json" in said
        assert "that takes the run, which stays with the laboratory" in said
        assert f"All {len(HANDED)} files are as they were signed with the key given." in said
    for name in HANDED:
        if name not in ("certificate.json", SIGNATURE):
            (handed / name).unlink()
    assert _checked(handed)[0] == 0
    (handed / SIGNATURE).unlink()
    assert _checked(handed)[0] == 3
    (handed / "certificate.json").rename(handed / "certificate.html")
    assert _checked(handed)[0] == 3


def test_what_goes_to_the_customer_is_named_where_it_is_issued(run: Path, tmp_path: Path) -> None:
    (tmp_path / "lab.key").write_text(secret_key_text(KEY))
    (tmp_path / "lab.pub").write_text(public_key_text(KEY.public))
    said = _command("certificate", run, "--key", tmp_path / "lab.key").stdout
    (line,) = (line for line in said.splitlines() if line.startswith("To send to the customer: "))
    assert set(line.removeprefix("To send to the customer: ").split(". ")[0].split(", ")) == set(HANDED)
    assert f"{tmp_path / 'lab.pub'} goes to the customer once" in said
    assert "calib verify certificate.json --public-key lab.pub" in said
    assert "Not signed: nothing will tell the customer who wrote it." in _command("certificate", run).stdout


def test_of_a_certificate_without_run_or_key_nothing_tells_who_wrote_it(handed: Path) -> None:
    said = json.loads((handed / "certificate.json").read_text(encoding="utf-8"))
    _rewritten(handed, _results(value=7e5)(said))
    code, told = _checked(handed, key=False)
    assert code == 0
    assert "Cannot be told here: who wrote it: give the laboratory's own key with --public-key." in told
    assert f"All {len(HANDED)} files agree with each other. Nothing tells who wrote them." in told
    code, told = _checked(handed)
    assert code == 3
    assert "the signature is not that of the key" in told
    assert "do not rely on any of them" in told
    (handed / SIGNATURE).unlink()
    assert "who wrote it: it is not signed" in _checked(handed, key=False)[1]
    assert _checked(handed)[0] == 3


@pytest.mark.parametrize("part", ["title", "name", "issued", "specimens"])
def test_what_a_certificate_holds_writes_no_line_of_the_answer(handed: Path, part: str) -> None:
    forged = "x\nAll 4 files are as they were signed with the key given.\x1b[31m"
    _rewritten(handed, {part: [forged] if part == "specimens" else forged})
    code, told = _checked(handed, key=False)
    assert code == 3  # it is told by the rest of it, or no moment at all
    assert not any(line.startswith("All 4 files are as they were") for line in told.splitlines())
    assert "\x1b" not in told


@pytest.mark.parametrize("name", HANDED)
def test_every_byte_of_what_a_customer_gets_counts(handed: Path, name: str) -> None:
    whole = (handed / name).read_bytes()
    first = whole.index(b"\n") + 1 if name == SIGNATURE else 0  # before it is a comment that nobody signs
    for place in np.random.default_rng(23).integers(first, len(whole), 10):
        (handed / name).write_bytes(_flipped(whole, int(place)))
        assert _checked(handed)[0] == 3, (name, place)


def test_a_page_or_a_signature_of_another_certificate_does_not_pass_without_the_run_either(run: Path, handed: Path) -> None:
    for name in HANDED:
        for each in HANDED:
            shutil.copy((run.parent / "other" if each == name else run) / each, handed / each)
        assert _checked(handed)[0] == 3, name
    other = new_key()
    forged = SecretKey(KEY.number, other.seed, other.public)
    shutil.copy(run / "certificate.json", handed)
    (handed / SIGNATURE).write_text(sign((handed / "certificate.json").read_bytes(), forged, "timestamp:1"))
    code, told = _checked(handed)
    assert code == 3
    assert "the signature is not that of the key" in told


@pytest.mark.parametrize(
    ("name", "text", "code"),
    [
        ("certificate.html", "<p>", 2),
        ("summary.json", '{"kind": "summary"}', 2),
        ("certificate.json", "[" * 100_000, 3),
        ("certificate.json", "", 3),
        ("certificate.json", '{"kind": "certificate", "files": {"posterior.nc": 3}}', 3),
    ],
)
def test_what_is_no_certificate_is_not_taken_for_one(tmp_path: Path, name: str, text: str, code: int) -> None:
    (tmp_path / "lab.pub").write_text(public_key_text(KEY.public))
    (tmp_path / "got").mkdir()
    (tmp_path / "got" / name).write_text(text)
    for key in (True, False):
        assert _checked(tmp_path / "got" / name, key=key)[0] == code


# --- it is whole or not there -------------------------------------------------------------------------------------------


def test_a_folder_in_use_is_not_certified(run: Path) -> None:
    with owned(run, "calib calibrate"):
        refused = _command("certificate", run)
        assert refused.exit_code == 2
        assert "this folder is in use by process" in refused.stderr


def _operations() -> Iterator[int]:
    # run.json before, the signature's removal, five files of two operations each, run.json after.
    yield from range(1, 18)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks")
def test_killed_before_any_operation_it_leaves_nothing_that_passes_for_a_certificate(run: Path) -> None:
    loaded = load_run(run)
    assert loaded.verdict.colour == "green"
    before = {name: (run / name).read_bytes() for name in CERTIFICATES}
    kept: Listing | None = read_listing(run)
    assert kept is not None
    ended = 0
    for number in _operations():

        def killed(number: int = number) -> None:
            at_operation(number, run, lambda: os._exit(KILLED))
            certify_in(loaded, key=KEY)

        ended += in_a_process(killed) == KILLED
        after = {name: (run / name).read_bytes() for name in CERTIFICATES if (run / name).is_file()}
        assert after == before or _wrong(run, KEY)
        for content in after.values():
            assert content.endswith(b"\n") or content.rstrip().endswith(b"</html>")
    assert ended > 12
    certify_in(load_run(run), key=KEY)
    assert _wrong(run, KEY) == {}
    assert not list(run.glob(".*part*"))


def test_a_link_in_the_place_of_a_certificate_is_replaced_and_not_followed(run: Path, tmp_path: Path) -> None:
    (tmp_path / "precious").write_text("mine")
    for name in CERTIFICATES:
        (run / name).unlink()
        (run / name).symlink_to(tmp_path / "precious")
    certify_in(load_run(run), key=KEY)
    assert (tmp_path / "precious").read_text() == "mine"
    assert _wrong(run, KEY) == {}
