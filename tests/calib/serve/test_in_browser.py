"""A lab works on the page in Chromium, from a dropped file to a padding, by keyboard alone, and on a phone's screen."""

from __future__ import annotations

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
import zipfile
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from typing import Any

import pytest
from playwright.sync_api import Dialog, Locator, Page, Route, sync_playwright
from small_lab import EXPERIMENT, write_press

from calib.experiment import read_experiment
from calib.report import find_browser
from calib.runs import verify
from calib.signature import read_public_key

BROWSER = find_browser()
pytestmark = pytest.mark.skipif(BROWSER is None, reason="no Chromium on this machine: the page is not tried in a browser")

AXE = (Path(__file__).parent / "axe" / "axe.min.js").read_text(encoding="utf-8")
HANDED_ON = ("/certificate?name=run1", "/export?name=run1", "/next?name=run1&for=modulus")
#: What a slow machine may take for what takes seconds elsewhere [ms].
PATIENCE = 100_000


def _free_port() -> int:
    """A port that nobody has, away from those that other servers begin with."""
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


class Served:
    """A server in a process of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.port = folder, _free_port()
        self.process = self._begun()
        self.address = self._address()

    def _begun(self) -> subprocess.Popen[str]:
        words = [sys.executable, "-m", "calib", "serve", str(self.folder), "--no-browser", "--port", str(self.port)]
        return subprocess.Popen(words, stdout=subprocess.PIPE, text=True, cwd=self.folder.parent)

    def _address(self) -> str:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if found := re.search(r"http://\S+", line):
                return found[0]
        raise AssertionError("the server did not say where it is")

    def page(self, path: str) -> str:
        return self.address.split("/?")[0] + path

    def end(self, signum: signal.Signals) -> None:
        self.process.send_signal(signum)
        self.process.wait(30)
        assert self.process.stdout is not None
        self.process.stdout.close()

    def kill_and_begin_again(self) -> None:
        self.end(signal.SIGKILL)
        self.process = self._begun()
        assert self._address() == self.address


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """The page of a folder that is new."""
    made = Served(tmp_path_factory.mktemp("serve") / "work")
    yield made
    made.end(signal.SIGTERM)


@pytest.fixture(scope="module")
def page(served: Served) -> Iterator[Page]:
    """A browser that was let in."""
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"] if os.getuid() == 0 else [])
        made = browser.new_context(viewport={"width": 1280, "height": 900}).new_page()
        made.set_default_timeout(PATIENCE)
        made.on("filechooser", lambda _: None)  # from now on choosers open here and not on the screen
        made.on("pageerror", lambda error: pytest.fail(f"the script failed: {error}"))
        made.goto(served.address)
        made.wait_for_url("**/files")
        yield made
        browser.close()


def tab_to(page: Page, target: Locator) -> None:
    """Go to an element as somebody without a mouse does."""
    target.wait_for()
    for _ in range(120):
        if target.evaluate("element => element === document.activeElement"):
            return
        page.keyboard.press("Tab")
    raise AssertionError(f"the keyboard does not lead to {target}")


def serious(page: Page) -> list[str]:
    """What axe finds that keeps somebody from using the page."""
    page.evaluate(f"() => {{ {AXE} }}")
    found: dict[str, Any] = page.evaluate("() => axe.run(document, { resultTypes: ['violations'] })")
    return [f"{v['id']}: {v['nodes'][0]['html'][:160]}" for v in found["violations"] if v["impact"] in ("serious", "critical")]


def as_wide_as_the_screen(page: Page) -> bool:
    return bool(page.evaluate("() => document.documentElement.scrollWidth <= window.innerWidth"))


def first_paint(page: Page) -> float:
    """When something was seen [s]."""
    page.wait_for_function("() => performance.getEntriesByName('first-contentful-paint').length")
    return float(page.evaluate("() => performance.getEntriesByName('first-contentful-paint')[0].startTime")) / 1e3


def test_from_a_dropped_file_to_a_padding_by_keyboard_alone(page: Page, served: Served, tmp_path: Path) -> None:
    key = page.keyboard
    # A file whose force has no unit is dropped, refused with the reason, and corrected.
    tab_to(page, page.locator("#choose"))
    with page.expect_file_chooser() as chooser:
        key.press("Enter")
    chooser.value.set_files(write_press(tmp_path / "press.csv"))
    page.get_by_text("not understood").wait_for()
    assert serious(page) == []
    tab_to(page, page.get_by_role("link", name="lab/press.csv"))
    key.press("Enter")
    page.get_by_text('column "Force" has no unit').first.wait_for()
    tab_to(page, page.locator("#units_force"))
    key.type("N")
    key.press("Enter")
    page.get_by_role("heading", name="Quality").wait_for()
    assert serious(page) == []
    assert "--units force=N" in page.locator("#command").inner_text()

    # The experiment: a first one from the file, which is then put right in the form and in the text.
    page.goto(served.page("/files"))
    tab_to(page, page.get_by_role("button", name="Write a first experiment"))
    key.press("Enter")
    page.wait_for_url("**/experiment")
    assert serious(page) == []
    # Of a guess is said how it is known: it stands, and then it was measured.
    radius = page.locator("form[data-known]", has=page.locator("#f-indenter-radius"))
    marked = int(page.locator("#marked").inner_text())
    tab_to(page, radius.get_by_label("undecided"))
    key.press("ArrowDown")
    key.press("ArrowDown")
    tab_to(page, radius.get_by_role("button", name="The guess stands"))
    key.press("Enter")
    page.wait_for_function(
        "() => /radius = .5 mm. +# not measured: the guess stands/.test(document.querySelector('#text').value)"
    )
    assert radius.get_by_label("not measured").is_checked()
    assert page.locator("#marked").inner_text() == str(marked - 1)
    assert serious(page) == []
    key.press("ArrowUp")
    tab_to(page, radius.get_by_label("By what"))
    key.type("caliper")
    key.press("Enter")
    page.wait_for_function("() => /radius = .5 mm. +# measured: caliper/.test(document.querySelector('#text').value)")
    assert radius.get_by_label("measured by caliper").is_checked()
    tab_to(page, page.locator("#f-model"))
    key.press("c")
    key.press("Tab")
    page.wait_for_function("() => /^model = .closed form/m.test(document.querySelector('#text').value)")
    assert 'model = "closed form"' in (served.folder / "experiment.toml").read_text()
    tab_to(page, page.locator("#text"))
    key.press("Control+A")
    key.insert_text(EXPERIMENT.strip().replace('radius = "5 mm"', 'radius = "5 mn"'))
    page.locator(".field.wrong .check", has_text='unknown unit "mn"').wait_for()
    ball = page.get_by_label("Ball radius")
    ball.focus()
    key.press("Control+A")
    key.type("5 mm")
    key.press("Tab")
    page.locator(".check", has_text="10 mm in diameter").wait_for()
    assert (served.folder / "experiment.toml").read_text() == EXPERIMENT.strip()
    page.locator("#light .level").wait_for()

    # A calibration outlives its server, and is found again.
    page.goto(served.page("/calibrate"))
    assert serious(page) == []
    tab_to(page, page.get_by_role("button", name="Calibrate"))
    key.press("Enter")
    page.wait_for_url("**/run?name=run1")
    # What a running calibration offers to do is not what one is meant to do: no button of it is a primary one.
    cancel = page.get_by_role("button", name="Cancel")
    assert cancel.count() == 0 or cancel.get_attribute("class") == "quiet"
    served.kill_and_begin_again()
    page.reload()
    page.get_by_role("heading", name="What was found").wait_for()
    assert serious(page) == []
    assert (served.folder / "run1" / "report.html").is_file()

    # The padding: bands move while one moves, and the advice goes into the report.
    tab_to(page, page.get_by_role("link", name="Choose a padding"))
    key.press("Enter")
    page.locator("#charts:not([hidden])").wait_for()
    assert serious(page) == []
    tab_to(page, page.locator("#load"))
    lags = []
    for _ in range(7):
        page.evaluate("() => delete document.documentElement.dataset.lag")
        key.press("ArrowLeft")
        page.wait_for_function("() => document.documentElement.dataset.lag")
        time.sleep(0.3)
        lags.append(float(page.evaluate("() => document.documentElement.dataset.lag")))
    assert median(lags) < 200, f"most of seven moves were not drawn within a fifth of a second: {lags}"
    # A load beyond the slider is typed in: shown as extrapolated, by how much, and as fast.
    most = float(page.locator("#load").get_attribute("max") or "nan")
    tab_to(page, page.locator("#force"))
    page.wait_for_load_state("networkidle")  # what lies beyond is tabulated ahead
    page.evaluate("() => delete document.documentElement.dataset.lag")
    key.press("Control+A")
    key.type(f"{1.5 * most:g}")
    page.locator("#load-beyond .level.amber").wait_for()
    page.wait_for_function("most => Number(document.querySelector('#load').max) === 2 * most", arg=most)
    assert "times the largest measured force" in page.locator("#load-beyond").inner_text()
    assert float(page.evaluate("() => document.documentElement.dataset.lag")) < 200
    assert serious(page) == []
    key.press("Tab")
    assert page.locator("#force").input_value() == f"{1.5 * most:g} N"
    tab_to(page, page.locator("#force"))
    key.press("Control+A")
    key.type(f"{most / 2:g} N")
    page.wait_for_function("() => document.querySelector('#load-beyond').textContent === ''")
    # Enter in a field does what the button beside the load says, however often: the advice has a button of its own.
    for field in ("#force", "#limit-signal"):
        tab_to(page, page.locator(field))
        key.press("Enter")
        key.press("Enter")
    page.wait_for_load_state("networkidle")
    assert "made=yes" not in page.url
    assert not (served.folder / "run1" / "recommendation.json").exists()
    tab_to(page, page.get_by_role("button", name="Make the advice"))
    key.press("Enter")
    page.get_by_role("heading", name="Advice that is kept").wait_for()
    assert json.loads((served.folder / "run1" / "recommendation.json").read_text())
    gave = page.locator("#gave").inner_text()
    assert gave.startswith("calib recommend run1 --force")
    # What is asked for is there again when the page is loaded again, beside the command that gave the advice.
    tab_to(page, page.locator("#limit-signal"))
    key.type("11 %")
    page.wait_for_function("() => document.querySelector('#command').textContent.includes('--spec')")
    page.reload()
    page.locator("#charts:not([hidden])").wait_for()
    assert page.locator("#limit-signal").input_value() == "11 %"
    assert page.locator("#force").input_value() == f"{most / 2:g} N"
    assert page.locator("#command").inner_text() == "calib recommend run1 --spec run1-specification.toml"
    assert page.locator("#gave").inner_text() == gave
    assert serious(page) == []

    # It is taken along.
    page.goto(served.page("/run?name=run1"))
    with page.expect_download() as download:
        page.get_by_role("link", name="run1.zip").press("Enter")
    assert download.value.path().stat().st_size > 1e5

    # What is refused is said where the button is, and what was typed stays.
    page.goto(served.page("/calibrate"))
    page.get_by_label("Minutes at most").fill("1,5")
    page.get_by_label("Name").fill("run1")
    page.get_by_role("button", name="Calibrate").click()
    assert page.get_by_label("Minutes at most").evaluate("input => input.validity.patternMismatch")
    page.get_by_label("Minutes at most").fill("1.5")
    page.get_by_role("button", name="Calibrate").press("Enter")
    page.locator("form .said", has_text="run1").wait_for()
    assert page.get_by_label("Minutes at most").input_value() == "1.5"
    assert serious(page) == []


def _prior_is_typed_and_measured(tab: Page, file: Path) -> None:
    """A number of a prior is in the file once its field is left, and is what was measured; a refusal is seen where one is."""
    form = tab.locator("form[data-known]", has=tab.get_by_text("Sensor thickness")).first
    number, key = form.locator(".prior input").first, tab.keyboard
    number.focus()
    key.press("Control+A")
    key.type("0.75 mm")
    key.press("Tab")
    tab.wait_for_function("() => /sensor_thickness = .*.0\\.75 mm/.test(document.querySelector('#text').value)")
    number.fill("0.75x mm")
    number.press("Tab")
    form.locator(".check .bad").wait_for()  # it stays, in field and file, until it is right
    form.locator("input[name=known][value=measured]").check()
    form.get_by_label("By what").fill("the # of a microscope")
    form.get_by_role("button", name="It was measured").click()
    tab.locator("#said:not(:empty)").wait_for()
    assert tab.locator("#said").evaluate("said => said.getBoundingClientRect().bottom > 0")
    assert "measured: the" not in file.read_text()
    form.get_by_label("By what").fill("microscope")
    number.fill("0.76 mm")
    form.get_by_role("button", name="It was measured").click()
    tab.wait_for_function(
        "() => /sensor_thickness = .*.0\\.76 mm.*# measured: microscope/.test(document.querySelector('#text').value)"
    )


def test_the_shipped_example_is_begun_by_keyboard_alone_on_a_phone(page: Page, tmp_path: Path) -> None:
    other = Served(tmp_path / "new")
    tab = page.context.new_page()
    try:
        tab.set_viewport_size({"width": 390, "height": 844})
        tab.goto(other.address)
        tab.wait_for_url("**/files")
        assert serious(tab) == []
        assert as_wide_as_the_screen(tab)
        tab_to(tab, tab.get_by_role("button", name="Try it with the shipped example"))
        tab.keyboard.press("Enter")
        tab.wait_for_url("**/experiment")
        tab.locator("#light .level").wait_for()
        assert tab.locator("#marked").inner_text() == "0"
        assert serious(tab) == []
        assert as_wide_as_the_screen(tab)
        assert [s.name for s in read_experiment(other.folder / "experiment.toml").specimens] == ["sensor 1", "sensor 2"]
        _prior_is_typed_and_measured(tab, other.folder / "experiment.toml")
        # One that came along is offered, beside beginning anew.
        (other.folder / "experiment.toml").unlink()
        tab.goto(other.page("/files"))
        tab.get_by_role("heading", name="This folder holds an experiment").wait_for()
        assert tab.get_by_role("button", name="Start anew").count() == 1
        assert serious(tab) == []
        assert as_wide_as_the_screen(tab)
        tab_to(tab, tab.get_by_role("button", name="Use it"))
        tab.keyboard.press("Enter")
        tab.wait_for_url("**/experiment")
        assert read_experiment(other.folder / "experiment.toml").specimens[0].sweeps[0].force is not None
    finally:
        tab.close()
        other.end(signal.SIGTERM)


#: A drop as a browser makes it of a folder: entries of which each is a file, or is read in lots until nothing more comes.
DROPPED = """([folder, files]) => {
  const file = (name, text) => ({ isFile: true, name, file: done => done(new File([text], name)) });
  const inside = (name, entries) => ({ isFile: false, name, createReader: () => {
    const lots = [...entries.map(entry => [entry]), []];
    return { readEntries: done => done(lots.shift()) };
  } });
  const entries = Object.entries(files).map(([name, text]) => name.includes("/")
    ? inside(name.split("/")[0], [file(name.split("/")[1], text)]) : file(name, text));
  const drop = new Event("drop", { bubbles: true, cancelable: true });
  drop.dataTransfer = { items: [{ webkitGetAsEntry: () => inside(folder, entries) }], files: [] };
  document.querySelector("#drop").dispatchEvent(drop);
}"""
#: The same of files alone, with what the browser itself makes.
DROPPED_FILES = """files => {
  const dataTransfer = new DataTransfer();
  for (const [name, text] of Object.entries(files)) dataTransfer.items.add(new File([text], name));
  document.querySelector("#drop").dispatchEvent(new DragEvent("drop", { dataTransfer, bubbles: true, cancelable: true }));
}"""


def test_a_folder_of_raw_files_is_dropped_or_chosen_and_its_files_are_kept_as_they_were(page: Page, tmp_path: Path) -> None:
    text = write_press(tmp_path / "press.csv").read_text()
    raw = {"one.csv": text, "Set 2/two.csv": text + "\n", ".DS_Store": "no lab file"}
    chosen = tmp_path / "chosen"
    for name, content in raw.items():
        (chosen / name).parent.mkdir(parents=True, exist_ok=True)
        (chosen / name).write_text(content)
    other = Served(tmp_path / "new")
    tab = page.context.new_page()
    try:
        tab.set_viewport_size({"width": 390, "height": 844})
        tab.goto(other.address)
        tab.wait_for_url("**/files")
        with tab.expect_navigation():
            tab.evaluate(DROPPED, ["dropped", raw])
        with tab.expect_navigation():
            tab.evaluate(DROPPED_FILES, {"alone.csv": text})
        with tab.expect_navigation():
            tab.locator("#choose-folder").set_input_files(chosen)
        assert tab.locator(".files li").count() == 5
        assert as_wide_as_the_screen(tab)
        kept = {path.relative_to(other.folder / "lab").as_posix(): path.read_text() for path in other.folder.rglob("*.csv")}
        there = {name: content for name, content in raw.items() if not name.startswith(".")}
        folders = {f"{folder}/{name}": content for folder in ("dropped", "chosen") for name, content in there.items()}
        assert kept == folders | {"alone.csv": text}
        assert not list(other.folder.rglob(".DS_Store"))
    finally:
        tab.close()
        other.end(signal.SIGTERM)


def test_a_padding_is_looked_about_on_a_phone_by_keyboard_alone(page: Page, served: Served) -> None:
    key = page.keyboard
    page.set_viewport_size({"width": 390, "height": 844})
    page.goto(served.page("/padding?name=run1"))
    page.locator("#charts:not([hidden])").wait_for()
    tab_to(page, page.locator("#force"))
    key.press("Control+A")
    key.type("2")
    tab_to(page, page.locator("#limit-stroke"))
    assert page.locator("#force").input_value() == "2 N"
    key.type("1.9 mm")
    page.locator("#conforming:not([hidden])").wait_for()
    assert "at 2 N" in page.locator("#seen").inner_text()
    assert "Probability that it conforms" in page.locator("#seen").inner_text()
    assert as_wide_as_the_screen(page)
    assert serious(page) == []
    page.reload()
    page.locator("#conforming:not([hidden])").wait_for()
    assert (page.locator("#force").input_value(), page.locator("#limit-stroke").input_value()) == ("2 N", "1.9 mm")
    assert as_wide_as_the_screen(page)


def test_a_certificate_is_made_signed_and_checked_by_keyboard_alone(page: Page, served: Served) -> None:
    key = page.keyboard
    page.goto(served.page("/run?name=run1"))
    tab_to(page, page.get_by_role("link", name="Certificate"))
    key.press("Enter")
    tab_to(page, page.get_by_text("Make a key pair"))
    key.press("Enter")
    tab_to(page, page.get_by_role("button", name="Make it"))
    key.press("Enter")
    page.wait_for_function("() => document.querySelector('#key')?.options.length === 2")
    assert serious(page) == []
    tab_to(page, page.locator("#key"))
    key.press("l")
    page.wait_for_function("() => document.querySelector('#command').textContent.includes('--key lab1.key')")
    tab_to(page, page.get_by_role("button", name="Issue the certificate"))
    key.press("Enter")
    page.get_by_text("Checked with lab1.pub").wait_for()
    assert "calib verify run1 --public-key lab1.pub" in page.locator("#verify-command").inner_text()
    assert serious(page) == []
    run = served.folder / "run1"
    assert {f.state for f in verify(run, read_public_key(served.folder / "lab1.pub"))} == {"fine"}
    with page.expect_download() as download:
        page.get_by_role("link", name="certificate.json", exact=True).press("Enter")
    assert download.value.path().read_bytes() == (run / "certificate.json").read_bytes()
    assert served.folder.joinpath("lab1.key").read_text().split("\n")[1] not in page.content()


def test_tables_for_a_gripper_are_made_and_taken_along_by_keyboard_alone(page: Page, served: Served) -> None:
    key = page.keyboard
    page.goto(served.page("/export?name=run1"))
    tab_to(page, page.locator("#padding"))
    key.press("Control+A")
    key.type("2.5 mm")
    page.wait_for_function("() => document.querySelector('#command').textContent.includes('--padding \"2.5 mm\"')")
    tab_to(page, page.get_by_role("button", name="Make the tables"))
    key.press("Enter")
    page.get_by_role("heading", name="run1-gripper1").wait_for()
    assert page.get_by_role("cell", name="2.50 mm").count() == 1
    assert serious(page) == []
    with page.expect_download() as download:
        page.get_by_role("link", name="run1-gripper1.zip").press("Enter")
    with zipfile.ZipFile(download.value.path()) as archive:
        header = archive.read("run1-gripper1/force_tables.h")
    assert header == (served.folder / "run1-gripper1" / "force_tables.h").read_bytes()


def test_every_page_fits_a_phone_is_seen_at_once_and_can_be_used_by_everybody(page: Page, served: Served) -> None:
    page.set_viewport_size({"width": 390, "height": 844})
    for path in (
        "/files",
        "/experiment",
        "/check",
        "/calibrate",
        "/padding",
        "/runs",
        "/run?name=run1",
        "/report?name=run1",
        *HANDED_ON,
    ):
        paints = []
        for _ in range(3):
            page.goto(served.page(path))
            paints.append(first_paint(page))
            if paints[-1] < 1:
                break
        page.wait_for_load_state("networkidle")
        assert min(paints) < 1, path
        assert as_wide_as_the_screen(page), path
        assert serious(page) == [], path


@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.parametrize("name", ["report.html", "certificate.html"])
def test_what_is_handed_on_can_be_read_by_everybody(page: Page, served: Served, name: str, width: int) -> None:
    tab = page.context.new_page()
    tab.set_viewport_size({"width": width, "height": 844})
    tab.goto((served.folder / "run1" / name).as_uri())
    tab.evaluate("() => document.querySelectorAll('details').forEach(folded => { folded.open = true; })")
    assert serious(tab) == []
    assert as_wide_as_the_screen(tab)
    tab.close()


def test_a_page_that_is_open_sees_what_another_changes(page: Page, served: Served) -> None:
    page.set_viewport_size({"width": 1280, "height": 900})
    page.goto(served.page("/experiment"))
    other = page.context.new_page()
    other.goto(served.page("/experiment"))
    other.get_by_label("Disc radius").fill("9 mm")
    other.get_by_label("Disc radius").press("Tab")
    other.locator(".check", has_text="18 mm in diameter").wait_for()
    page.locator(".check", has_text="18 mm in diameter").wait_for()
    assert 'radius = "9 mm"' in page.locator("#text").input_value()
    # What somebody is typing meanwhile stays, and goes in when they leave the field.
    ball = page.get_by_label("Ball radius")
    ball.fill("")
    ball.press_sequentially("4 m")
    for radius in (8, 7):
        other.get_by_label("Disc radius").fill(f"{radius} mm")
        other.get_by_label("Disc radius").press("Tab")
        page.locator(".check", has_text=f"{2 * radius} mm in diameter").wait_for()
        page.wait_for_function(f"() => document.querySelector('#f-sensor-radius').value === '{radius} mm'")
        assert ball.input_value() == "4 m"
        assert 'radius = "4 m"' not in (served.folder / "experiment.toml").read_text()
    ball.press_sequentially("m")
    ball.press("Tab")
    page.locator(".check", has_text="8 mm in diameter").first.wait_for()
    page.wait_for_function("() => /^radius = .4 mm/m.test(document.querySelector('#text').value)")
    assert 'radius = "4 mm"' in (served.folder / "experiment.toml").read_text()
    other.close()


def test_what_is_typed_while_the_text_is_written_stays_and_goes_in(page: Page, served: Served) -> None:
    page.set_viewport_size({"width": 1280, "height": 900})
    page.goto(served.page("/experiment"))
    ball, text, held = page.get_by_label("Ball radius"), page.locator("#text"), list[Route]()
    was = ball.input_value()
    page.route("**/experiment/write", lambda route: held.append(route))
    text.fill(text.input_value().replace(f'radius = "{was}"', 'radius = "5 mn"', 1))
    while not held:
        page.wait_for_timeout(50)
    # The same as is still shown there, though by now the text says otherwise.
    ball.press("Control+A")
    ball.press_sequentially(was)
    held[0].continue_()
    page.unroute("**/experiment/write")
    page.locator(".field.wrong .check", has_text='unknown unit "mn"').wait_for()
    assert ball.input_value() == was
    page.keyboard.press("Tab")
    page.wait_for_function("was => document.querySelector('#text').value.includes(`radius = \"${was}\"`)", arg=was)
    assert page.locator(".field.wrong").count() == 0
    assert f'radius = "{was}"' in (served.folder / "experiment.toml").read_text()


def test_the_light_is_of_the_text_that_was_checked_and_of_no_other(page: Page, served: Served) -> None:
    page.set_viewport_size({"width": 1280, "height": 900})
    page.goto(served.page("/experiment"))
    light, ball = page.locator("#light"), page.get_by_label("Ball radius")
    light.locator(".level").wait_for()
    was, held = ball.input_value(), list[Route]()

    def hold(route: Route) -> None:
        held.append(route)

    page.route("**/check/light", hold)
    # As soon as something is typed, the verdict that stands there is gone; back as it was, it is asked for again.
    ball.press("End")
    ball.press("Backspace")
    assert light.inner_text() == "not checked yet what is typed is not in the file yet"
    ball.press_sequentially(was[-1])
    ball.press("Tab")
    assert light.locator(".level").count() == 0
    # While the new one is checked that is said, in no colour; a check that does not come leaves no verdict.
    page.wait_for_timeout(700)
    asked = len(held)
    ball.fill("10 mm")
    ball.press("Tab")
    assert light.inner_text().startswith("being checked")
    page.locator(".check", has_text="20 mm in diameter").first.wait_for()
    while len(held) == asked:
        page.wait_for_timeout(50)
    assert light.inner_text() == "being checked what the file now holds …"
    assert light.get_attribute("aria-live") == "polite"
    assert serious(page) == []
    held[-1].abort()
    light.get_by_text("The server does not answer").wait_for()
    assert light.locator(".level").count() == 0
    # A change that is refused leaves none, either; put right, it is checked.
    page.route("**/experiment/put", lambda route: route.abort())
    ball.fill("9 mm")
    ball.press("Tab")
    light.get_by_text("not checked what was changed is not in the file").wait_for()
    page.unroute("**/experiment/put")
    page.unroute("**/check/light", hold)
    ball.fill(was)
    ball.press("Tab")
    light.locator(".level").wait_for()
    # Another distribution has no numbers yet, so nothing of it is in the file, until they are there.
    modulus = page.locator("form.field[data-field*='young_modulus']").first
    modulus.locator("select[name=kind]").select_option("uniform")
    assert light.inner_text() == "not checked yet what is typed is not in the file yet"
    for number, value in enumerate(("0.2 MPa", "2 MPa")):
        assert light.locator(".level").count() == 0
        modulus.locator(f"[name=number{number}]").fill(value)
    page.keyboard.press("Tab")
    light.locator(".level").wait_for()
    assert 'uniform = ["0.2 MPa", "2 MPa"]' in page.locator("#text").input_value()
    # So with the text.
    page.locator("#text").press("End")
    page.locator("#text").press("Space")
    assert light.locator(".level").count() == 0
    light.locator(".level").wait_for()


def test_what_is_typed_and_not_in_the_file_is_asked_about_before_the_page_is_left(page: Page, served: Served) -> None:
    asked = list[str]()

    def stays(dialog: Dialog) -> None:
        asked.append(dialog.type)
        dialog.dismiss()

    tab = page.context.new_page()
    tab.goto(served.page("/experiment"))
    tab.locator("#light .level").wait_for()
    tab.on("dialog", stays)
    ball = tab.get_by_label("Ball radius")
    was = ball.input_value()
    for typed in (ball, tab.locator("#text")):
        tab.route("**/experiment/write", lambda route: None)
        typed.press("End")
        typed.press("Space")
        before = len(asked)
        tab.evaluate("() => { location.href = '/files'; }")
        while len(asked) == before:
            tab.wait_for_timeout(50)
        typed.press("Backspace")
        if typed is ball:
            assert ball.input_value() == was
            tab.evaluate("() => { location.hash = 'main'; }")
    assert asked == ["beforeunload"] * 2
    assert tab.url.split("#")[0].endswith("/experiment")
    tab.close()


@pytest.mark.parametrize("width", [390, 1280])
def test_a_file_more_is_dropped_corrected_and_added_by_keyboard_alone(
    page: Page, served: Served, tmp_path: Path, width: int
) -> None:
    key, name = page.keyboard, f"more{width}"
    page.set_viewport_size({"width": width, "height": 844})
    lines = write_press(tmp_path / "press.csv").read_text().split("\n")
    (tmp_path / f"{name}.csv").write_text("\n".join(lines[: -width // 390 - 1]) + "\n")
    page.goto(served.page("/files"))
    with page.expect_file_chooser() as chooser:
        page.locator("#choose").press("Enter")
    chooser.value.set_files(tmp_path / f"{name}.csv")
    row = page.locator("li", has_text=name)
    row.get_by_text("not understood").wait_for()
    tab_to(page, page.get_by_role("link", name=f"lab/{name}.csv"))
    key.press("Enter")
    tab_to(page, page.locator("#units_force"))
    key.type("N")
    key.press("Enter")
    tab_to(page, page.get_by_role("link", name="Add it to the experiment"))
    key.press("Enter")
    page.wait_for_url("**/files/add**")
    assert serious(page) == []
    tab_to(page, page.locator("#of"))
    key.press("a" if width == 390 else "End")  # another press of the specimen, or a new specimen
    assert page.locator("#sensor_thickness").is_visible() == (width == 1280)
    assert page.locator("#press").is_visible() == (width == 390)
    tab_to(page, page.locator("#ball"))
    key.press("End")
    tab_to(page, page.locator("#radius"))
    key.type("3 mm")
    assert serious(page) == []
    assert as_wide_as_the_screen(page)
    tab_to(page, page.get_by_role("button", name="Add it to the experiment"))
    key.press("Enter")
    page.wait_for_url("**/experiment")
    specimens = read_experiment(served.folder / "experiment.toml").specimens
    added = specimens[0].sweeps[1] if width == 390 else specimens[1].sweeps[0]
    assert (added.force, added.indenter_radius) == (served.folder / "lab" / f"{name}.csv", 3e-3)
    assert f"lab/{name}.csv" in page.locator("#text").input_value()
