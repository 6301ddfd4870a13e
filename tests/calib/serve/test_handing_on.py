"""Certificate, tables for a gripper and what to measure next come from the page as from the commands, and no secret does."""

from __future__ import annotations

import base64
import io
import json
import re
import shutil
import stat
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from letting_in import SCRIPT, Work, let_in
from markupsafe import escape
from small_run import by_hand, make_lab

from calib.decision import Gripper
from calib.digits import range_text
from calib.report import gripper_files
from calib.runs import export_in, load_run, next_for, verify
from calib.runs.listing import read_listing
from calib.sampling.posterior import Posterior
from calib.serve import Keys, open_workspace
from calib.signature import new_key, read_public_key, read_secret_key, secret_key_text

pytestmark = pytest.mark.usefixtures("all_undrawn")

WHO = """
[laboratory]
name = "Soft <b>Sensors</b>"
operator = "A. Person"
country = "NZ"
measured = 2026-03-17
[[instruments]]
kind = "load cell"
serial = "12345"
calibrated = 2026-01-12
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory, make_posterior: Callable[..., Posterior], all_undrawn: None) -> Path:
    """A folder with a run that may be used and one that may not."""
    lab = make_lab(tmp_path_factory.mktemp("handing"))
    with (lab / "experiment.toml").open("a") as file:
        file.write(WHO)
    by_hand(lab, "run", make_posterior(n_specimen=1))
    by_hand(lab, "red", replace(make_posterior(converged=False, n_specimen=1), seed=8))
    return lab


@pytest.fixture
def work(made: Path, tmp_path: Path) -> Work:
    """The page of a fresh copy of it."""
    shutil.copytree(made, tmp_path / "lab")
    return Work(let_in(space := open_workspace(tmp_path / "lab")), space)


def ok(answer: Any) -> str:
    assert answer.status_code == 200, answer.text
    return re.sub(r'<span class="word">([^<]*)</span>', r"\1", answer.text)  # words of a command are kept whole


def faults(answer: Any, status: int = 422) -> str:
    assert answer.status_code == status, answer.text
    return " ".join(answer.json()["faults"])


# --- certificate --------------------------------------------------------------------------------------------------------


def test_a_certificate_is_issued_signed_and_checked_as_on_the_command_line(work: Work) -> None:
    page, space = work
    run = space.folder / "run"
    seen = ok(page.get("/certificate/look?name=run"))
    for said in ("A. Person", "Soft &lt;b&gt;Sensors", "12345", "2026-01-12", "none: not signed", "calib certificate run"):
        assert said in seen
    ok(page.post("/certificate/key", data={"name": "run", "key_name": "lab"}))
    assert stat.S_IMODE((space.folder / "lab.key").stat().st_mode) & 0o077 == 0
    asked = {"name": "run", "key": "lab.key"}
    command = page.get("/certificate/command", params=asked).json()["command"]
    assert command == "calib certificate run --key lab.key"
    ok(page.post("/certificate/issue", data=asked))
    listing = read_listing(run)
    assert listing is not None
    assert listing.commands[-1].text == command
    found = {f.name: f for f in verify(run, read_public_key(space.folder / "lab.pub"))}
    assert {f.state for f in found.values()} == {"fine"}
    assert "signed by A. Person" in found["certificate.json.minisig"].note
    number = json.loads((run / "certificate.json").read_text())["number"]
    seen = ok(page.get("/certificate/look?name=run"))
    assert number in seen
    assert "calib verify run --public-key lab.pub" in seen
    checked = ok(page.get("/run/verified?name=run&key=lab.pub"))
    assert "signed by A. Person" in checked
    assert "Checked with lab.pub" in checked
    assert "said to be signed" in ok(page.get("/run/verified?name=run"))
    for file in ("html", "json", "xml", "json.minisig"):
        assert page.get(f"/run/file?name=run&file=certificate.{file}").content == (run / f"certificate.{file}").read_bytes()
    assert page.get("/run/file?name=run&file=ro-crate-metadata.json").status_code == 200
    sheet = page.get("/certificate/page?name=run")
    assert sheet.content == (run / "certificate.html").read_bytes()
    assert "sandbox" in sheet.headers["content-security-policy"]
    content = bytearray((run / "certificate.xml").read_bytes())
    content[len(content) // 2] ^= 1
    (run / "certificate.xml").write_bytes(content)
    assert "certificate.xml" in ok(page.get("/run/verified?name=run&key=lab.pub"))
    assert 'class="level red"' in ok(page.get("/run/verified?name=run&key=lab.pub"))


def test_a_certificate_says_that_the_experiment_has_changed_since_the_page_was_drawn(work: Work) -> None:
    page, space = work
    before = ok(page.get("/certificate/look?name=run"))
    with space.experiment.open("a", encoding="utf-8") as file:
        file.write("\n# another idea\n")
    seen = ok(page.get("/certificate/look?name=run"))
    assert ("has changed since" in before, "has changed since" in seen) == (False, True)
    ok(page.post("/certificate/issue", data={"name": "run", "key": ""}))
    verdict = json.loads((space.folder / "run" / "certificate.json").read_text())["verdict"]
    assert verdict["colour"] != "green"
    assert "inputs" in [reason["gate"] for reason in verdict["reasons"]]
    assert 'class="level amber"' in ok(page.get("/runs"))  # and so says the list


def test_a_red_run_gets_a_statement_without_results(work: Work) -> None:
    seen = ok(work.page.get("/certificate/look?name=red"))
    assert "holds no results" in seen
    assert "Issue the statement, without results" in seen
    ok(work.page.post("/certificate/issue", data={"name": "red", "key": ""}))
    content = json.loads((work.space.folder / "red" / "certificate.json").read_text())
    assert content["kind"].startswith("no certificate")
    assert content["results"] is None
    assert not (work.space.folder / "red" / "certificate.xml").exists()
    seen = ok(work.page.get("/certificate/look?name=red"))
    assert "NOT A CERTIFICATE" in seen
    assert "0.62" not in seen + ok(work.page.get("/certificate/page?name=red"))


def test_a_red_run_shows_no_number_that_one_might_take_for_a_result(work: Work) -> None:
    fine, seen = (ok(work.page.get(f"/run/found?name={name}")) for name in ("run", "red"))
    struck = re.sub(r"<s>.*?</s>", "", seen)
    assert "What was found" in fine
    assert "<s>" not in fine
    assert "no result" in struck
    assert "What was found" not in struck
    for number in re.findall(r"[\d.]+ ± [\d.]+", fine):
        assert number in seen
        assert number not in struck
    look = ok(work.page.get("/padding/look?name=red"))
    assert "No padding is chosen by a run that must not be used" in look
    assert 'type="range"' not in look
    beside = ok(work.page.get("/runs/difference?first=run&second=red"))
    assert "<s>" in beside


def test_no_secret_reaches_the_browser(work: Work) -> None:
    page, space = work
    ok(page.post("/certificate/key", data={"name": "run", "key_name": "lab"}))
    ok(page.post("/certificate/issue", data={"name": "run", "key": "lab.key"}))
    key = read_secret_key(space.folder / "lab.key", lambda: "")
    # Under another name, and as an editor may have saved it.
    (space.folder / "force_table.csv").write_bytes(b"\xef\xbb\xbf" + (space.folder / "lab.key").read_bytes())
    (space.folder / "sub").mkdir()
    (space.folder / "sub" / "link.csv").symlink_to(space.folder / "lab.key")
    lines = (space.folder / "lab.key").read_text().split("\n")
    secret = [lines[1], lines[1][:40], lines[1][-60:], key.seed.hex(), base64.b64encode(key.seed).decode()[:40]]
    told = ""
    for path in (
        "/files",
        "/runs",
        "/run?name=run",
        "/run/found?name=run",
        "/certificate?name=run",
        "/certificate/look?name=run",
    ):
        told += ok(page.get(path))
    for name in ("lab.key", "lab.pub", "force_table.csv", "sub/link.csv"):
        for path in ("/files/row", "/file", "/file/picture.png", "/files/add"):
            answer = page.get(path, params={"name": name}, headers={"Accept": "application/json"})
            assert "no lab file" in faults(answer), name
            told += answer.text
        answer = page.get("/run/file", params={"name": "run", "file": f"../{name}"}, headers={"Accept": "application/json"})
        told += faults(answer)
    told += page.get("/run/bundle.zip?name=run").text
    assert not [part for part in secret if part in told]
    content = (space.folder / "lab.key").read_bytes()
    assert "is a key" in faults(page.put("/files/upload?name=lab.key", content=content, headers=SCRIPT))
    assert not list((space.folder / "lab").rglob("*lab.key*"))
    for file in (space.folder / ".serve").rglob("*"):
        assert not file.is_file() or lines[1].encode() not in file.read_bytes()
    assert all(part not in (space.folder / "run" / "run.json").read_text() for part in secret)


def test_a_password_is_never_typed_into_a_page(work: Work, monkeypatch: pytest.MonkeyPatch) -> None:
    page, space = work
    key = new_key()
    (space.folder / "locked.key").write_text(secret_key_text(key, "pässword"))
    seen = ok(page.get("/certificate/look?name=run"))
    assert "locked.key has a password" in seen
    assert "calib serve --key locked.key" in seen
    answer = page.post("/certificate/issue", data={"name": "run", "key": "locked.key"}, headers=SCRIPT)
    assert "has a password" in faults(answer)
    assert not (space.folder / "run" / "certificate.json").exists()
    # Begun with it, the page has it; so it has where its password stands in the environment.
    given = Keys(space, {space.folder / "locked.key": key})
    ok(let_in(space, given).post("/certificate/issue", data={"name": "run", "key": "locked.key"}))
    assert {f.state for f in verify(space.folder / "run", key.public)} == {"fine"}
    monkeypatch.setenv("CALIB_KEY_PASSWORD", "pässword")
    answer = page.post("/certificate/issue", data={"name": "run", "key": "locked.key"})
    assert "pässword" not in ok(answer)


def test_a_key_is_one_of_the_list_wherever_it_lies(work: Work, tmp_path: Path) -> None:
    page, space = work
    key = new_key()
    outside = tmp_path / "keys" / "lab.key"
    outside.parent.mkdir()
    outside.write_text(secret_key_text(key))
    (space.folder / "link.key").symlink_to(outside)
    for name in (str(outside), "../keys/lab.key", "link.key", "run/../lab.key", "/etc/passwd", "experiment.toml", "\x00"):
        answer = page.post("/certificate/issue", data={"name": "run", "key": name}, headers=SCRIPT)
        assert "The page has no key" in faults(answer), name
    begun = let_in(space, Keys(space, {outside: key}))
    assert str(outside) in ok(begun.get("/certificate/look?name=run"))
    ok(begun.post("/certificate/issue", data={"name": "run", "key": str(outside)}))
    assert {f.state for f in verify(space.folder / "run", key.public)} == {"fine"}
    for name in ("../lab", "a/b", "", ".x"):
        assert page.post("/certificate/key", data={"name": "run", "key_name": name}).status_code == 422, name
    (space.folder / "mine.pub").write_text("mine")
    answer = page.post("/certificate/key", data={"name": "run", "key_name": "mine"}, headers=SCRIPT)
    assert "already" in faults(answer)
    assert (space.folder / "mine.pub").read_text() == "mine"
    assert not (space.folder / "mine.key").exists()


def test_who_measured_is_filled_in_as_a_form_and_taken_over_by_the_run(work: Work) -> None:
    page, space = work

    def put(at: list[str | int], value: str) -> None:
        answer = page.post("/experiment/put", data={"at": json.dumps(at), "value": value}, headers=SCRIPT)
        assert not answer.json()["faults"], answer.json()

    assert "says something else" not in ok(page.get("/certificate/look?name=run"))
    assert 'value="2026-03-17"' in ok(page.get("/experiment"))  # a day, as TOML has days
    put(["laboratory", "measured"], "2026-03-17 to 2026-03-18")
    put(["laboratory", "city"], "Auckland")
    ok(page.post("/experiment/instrument", data={"kind": "LCR meter"}))
    put(["instruments", 1, "serial"], '"9"</script>')
    put(["instruments", 1, "calibrated"], "2026-02-02")
    assert 'measured = ["2026-03-17", "2026-03-18"]' in space.text
    assert 'kind = "LCR meter"' in space.text
    seen = ok(page.get("/experiment"))
    assert 'value="2026-03-17 to 2026-03-18"' in seen
    assert "</script>&" not in seen
    seen = ok(page.get("/certificate/look?name=run"))
    assert "says something else" in seen
    assert "calib calibrate experiment.toml -o run --resume" in seen
    wrong = page.post("/experiment/put", data={"at": '["laboratory", "country"]', "value": "New Zealand"}, headers=SCRIPT)
    shown = json.dumps(wrong.json()["fields"])
    assert "two letters that ISO 3166-1 has" in shown
    assert "(New Zealand)" in shown
    assert page.post("/experiment/instrument", data={"kind": " "}).status_code == 422


# --- export -------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def exported(made: Path, tmp_path_factory: pytest.TempPathFactory) -> Work:
    """The page of a copy of the folder with tables that were made on it."""
    folder = tmp_path_factory.mktemp("export") / "lab"
    shutil.copytree(made, folder)
    work = Work(let_in(space := open_workspace(folder)), space)
    data = {"name": "run", "output": "gripper", "padding": "2.5 mm", "leads": "2 pF", "leads_sd": "0.2 pF", "noise": "8 fF"}
    ok(work.page.post("/export/make", data=data))
    return work


def test_tables_are_those_of_the_command_and_are_taken_along(exported: Work) -> None:
    page, space = exported
    folder = space.folder / "gripper"
    gripper = Gripper(padding=2.5e-3, parasitic=(2e-12, 0.2e-12), noise=8e-15)
    expected = export_in(load_run(space.folder / "run"), gripper, space.folder / "again")
    assert {path.name: path.read_text() for path in folder.iterdir()} == gripper_files(expected)
    shutil.rmtree(space.folder / "again")
    asked = {"name": "run", "output": "gripper", "padding": "2.5 mm", "leads": "2 pF", "leads_sd": "0.2 pF", "noise": "8 fF"}
    command = page.get("/export/command", params={**asked, "tare": "16"}).json()["command"]
    assert (
        command == 'calib export run --padding "2.5 mm" --noise "8 fF" --parasitic "2 pF, 0.2 pF" --tare-readings 16 -o gripper'
    )
    seen = ok(page.get("/export/look?name=run"))
    for table in expected.tables:
        assert f"{table.touch * 1e6:.0f} to {table.ratio[-1] * 1e6:.0f} ppm" in seen
        touch = float(np.interp(table.touch, table.ratio, table.force))
        assert f"{range_text(touch, table.largest)} N" in seen
    for file in gripper_files(expected):
        assert page.get(f"/export/file?name=gripper&file={file}").content == (folder / file).read_bytes()
    with zipfile.ZipFile(io.BytesIO(page.get("/export/bundle.zip?name=gripper").content)) as archive:
        assert {Path(name).name for name in archive.namelist()} == set(gripper_files(expected))
    assert not [name for name in space.lab_files() if "gripper" in name]  # tables are no lab files
    assert "gripper" not in ok(page.get("/export/look?name=red")).replace("on a gripper", "")


def test_tables_that_are_wrong_or_not_to_be_are_refused(exported: Work) -> None:
    page, space = exported
    before = sorted(path.name for path in space.folder.iterdir())

    def refused(**given: str) -> str:
        return faults(page.post("/export/make", data={"name": "run", "output": "new", **given}, headers=SCRIPT))

    assert "is red" in refused(name="red")
    assert "already" in refused(output="gripper")
    assert "cannot be a name" in refused(output="../out")
    said = refused(padding="5.5", noise="x", tare="0", leads="1 mm")
    assert all(word in said for word in ("padding", "noise", "tare", "leads"))
    assert "Give both" in refused(leads="2 pF")
    assert "must not be negative" in refused(padding="-1 mm")
    refused(padding="1e9 mm")
    assert page.get("/export/file?name=gripper&file=../experiment.toml").status_code == 422
    assert page.get("/export/file?name=run&file=README.md").status_code == 422
    assert "Nothing is exported" in ok(page.get("/export/look?name=red"))
    assert sorted(path.name for path in space.folder.iterdir()) == before


def test_tables_that_were_changed_are_told(exported: Work) -> None:
    page, space = exported
    path = space.folder / "gripper" / "force_tables.json"
    text = path.read_text()
    path.write_text(text.replace('"level": 0.9', '"level": 0.5'))
    seen = ok(page.get("/export/look?name=run"))
    path.write_text(text)
    assert "Do not use these tables" in seen


# --- next ---------------------------------------------------------------------------------------------------------------


def test_what_to_measure_next_is_asked_kept_and_drafted(work: Work) -> None:
    page, space = work
    asked = {"name": "run", "for": "modulus", "force": ""}
    assert ok(page.get("/next?name=run"))
    answer = page.post("/next/ask", data=asked, follow_redirects=False)
    assert answer.headers["location"] == "/next?name=run&for=modulus"
    expected = next_for(load_run(space.folder / "run"), None, seed=1)
    kept = json.loads((space.folder / "run" / "next.json").read_text())
    assert kept["ranked"][0]["what"] == expected.ranked[0].what
    listing = read_listing(space.folder / "run")
    assert listing is not None
    assert listing.commands[-1].text == "calib next run"
    seen = ok(page.get("/next/found", params=asked))
    places = [seen.index(f">{escape(one.what)}</th>") for one in expected.ranked]
    assert places == sorted(places)
    for number in ("1", "2"):
        drafted = ok(page.post("/next/draft", data={**asked, "number": number}))
        assert f"--draft next{number}.toml --number {number}" in drafted
        assert (space.folder / f"next{number}.toml").read_text() == expected.draft(int(number), space.folder)
    assert page.post("/next/draft", data={**asked, "number": "99"}).status_code == 422
    assert page.post("/next/ask", data={**asked, "for": "padding"}).status_code == 422
    assert page.post("/next/ask", data={**asked, "for": "luck"}).status_code == 422
    assert page.get("/next/command", params={"name": "run", "for": "padding", "force": "3 N"}).json()["command"] == (
        'calib next run --for padding --force "3 N"'
    )


def test_a_run_that_is_gone_or_moved_meanwhile_is_told(work: Work) -> None:
    page, space = work
    ok(page.get("/certificate/look?name=run"))
    (space.folder / "run" / "posterior.nc").unlink()
    for path in ("/certificate/look", "/export/look", "/next/found", "/run/found"):
        answer = page.get(path, params={"name": "run", "for": "modulus"}, headers={"Accept": "application/json"})
        assert answer.status_code in (409, 422), path
    assert page.post("/certificate/issue", data={"name": "run", "key": ""}).status_code in (409, 422)
    shutil.rmtree(space.folder / "run")
    for path in ("/certificate", "/certificate/look", "/export/look", "/next/found", "/run"):
        assert page.get(path, params={"name": "run", "for": "modulus"}).status_code == 422, path
