"""Make every picture of README and docs anew from the program as it is: `python docs/make_pictures.py`.

A lab works on the page in Chromium with the files of the shipped example, from dropping them to what to measure next; of the
run that comes of it are the pictures of the report and of the gallery. The rest are those that commands draw. It takes a few
minutes and the extras `serve`, `sign` and `test`; look at each picture before it is kept.
"""

from __future__ import annotations

import io
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import matplotlib
from PIL import Image
from playwright.sync_api import Page, sync_playwright

from calib import load_run
from calib.report import any_letters, find_browser, plots_of_report
from calib.runs import load_recommendation

DOCS = Path(__file__).parent
PICTURES = DOCS / "pictures"
EXAMPLE = DOCS.parent / "datasets" / "padded_sensor"
#: Figures of gallery and tutorial: name on the page -> file.
GALLERY = {
    "padding": "padding",
    "beside": "beside",
    "change": "change",
    "force of sensor 1": "force",
    "capacitance of sensor 1": "capacitance",
    "force of sensor 2": "force2",
    "capacitance of sensor 2": "capacitance2",
    "priors of material and rig": "priors",
    "priors of sensor 1": "priors1",
    "priors of sensor 2": "priors2",
    "pairs": "pairs",
    "traces, 1": "traces",
    "traces, 2": "traces2",
}
#: Width of a screen and of a phone [px], and what stands behind the name of a picture of each.
WIDTHS = {1280: "", 390: "_390"}
#: Who measured with what, for the certificate; nobody in particular.
LABORATORY = """
[laboratory]
name = "Soft Sensors"
operator = "A. Person"
country = "NZ"
measured = "2026-03-17"

[[instruments]]
kind = "load cell"
serial = "12345"
calibrated = "2026-01-12"

[[instruments]]
kind = "LCR meter"
serial = "67890"
calibrated = "2026-02-02"
"""
#: The sensor of the paper, as the text on finite elements shows it deformed.
PAPER = """
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
# The page names the folder that it works in: that of a lab, not the temporary one of these pictures.
_AT_HOME = (
    """addEventListener("DOMContentLoaded", () => { document.querySelector(".folder").textContent = "~/measurements"; });"""
)
# Width of a figure [px], colours of a picture: these keep it small. What anything on the page may take [ms].
_WIDTH, _COLOURS, _PATIENCE = 760, 256, 600_000
# White below an element at whose end a picture ends [px].
_BELOW = 10


def main() -> None:
    """Make all pictures."""
    PICTURES.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "measurements"
        of_commands(Path(scratch))
        with served(folder) as address, sync_playwright() as playwright:
            words = ["--no-sandbox"] if os.name == "posix" and os.getuid() == 0 else []
            browser = playwright.chromium.launch(executable_path=find_browser(), args=words)
            page = browser.new_context(viewport={"width": 1280, "height": 900}).new_page()
            page.set_default_timeout(_PATIENCE)
            page.add_init_script(_AT_HOME)
            page.goto(address)
            page.wait_for_url("**/files")
            of_page(page, address.split("/?")[0], folder)
            report = browser.new_context().new_page()
            for name, width, height in (("report", 1280, 1560), ("report_phone", 390, 1640)):
                report.set_viewport_size({"width": width, "height": height})
                report.goto((folder / "run1" / "report.html").as_uri())
                keep(Image.open(io.BytesIO(report.screenshot())), name, _WIDTH)
            browser.close()
        of_gallery(folder / "run1")


def of_page(page: Page, site: str, folder: Path) -> None:
    """Work on the page as a lab does, and keep what is seen.

    Parameters
    ----------
    page : of a browser that was let in.
    site : address of the server.
    folder : that is served.
    """
    page.locator("input[type=file]").first.set_input_files([*sorted(EXAMPLE.glob("sensor*.csv")), EXAMPLE / "truth.json"])
    page.locator("li", has_text="truth.json").get_by_text("no lab file").wait_for()
    seen(page, "files", 620, 780)
    page.get_by_role("button", name="Write a first experiment").click()
    page.wait_for_url("**/experiment")
    page.locator("#light .level").wait_for()
    seen(page, "experiment", 860)

    text = re.sub(r'"(sensor\d_\w+\.csv)"', r'"lab/\1"', (EXAMPLE / "experiment.toml").read_text(encoding="utf-8"))
    (folder / "experiment.toml").write_text(text + LABORATORY, encoding="utf-8")
    page.goto(f"{site}/calibrate")
    page.set_viewport_size({"width": 390, "height": 780})
    page.get_by_role("button", name="Calibrate", exact=True).click()
    page.locator("dt", has_text="Effective draws").first.wait_for()
    keep(Image.open(io.BytesIO(page.screenshot())), "serve_run_390")
    page.get_by_role("heading", name="What was found").wait_for()
    calib(folder, "recommend", "run1", "--force", "10 N", "--padding", "0 mm:9 mm")

    page.goto(f"{site}/padding?name=run1")
    page.locator("#charts:not([hidden])").wait_for()
    page.locator("#force").fill("15 N")
    page.locator("#load-beyond .level.amber").wait_for()
    page.locator("#at").fill("5.5")
    seen(page, "padding", "#charts figure", "#charts figure")

    calib(folder, "key", "new", "-o", "lab.key")
    page.goto(f"{site}/certificate?name=run1")
    page.locator("#key").select_option("lab.key")
    page.get_by_role("button", name="Issue the certificate").click()
    page.get_by_text("Checked with lab.pub").wait_for()
    seen(page, "certificate", 1000, 960)

    page.goto(f"{site}/export?name=run1")
    page.locator("#padding").fill("5.5 mm")
    page.get_by_role("button", name="Make the tables").click()
    page.get_by_role("heading", name="run1-gripper1").wait_for()
    seen(page, "export", 1000, 1200)

    page.goto(f"{site}/next?name=run1&for=modulus")
    page.get_by_role("button", name="Ask").click()
    page.get_by_role("table").wait_for()
    seen(page, "next", 1000)

    for kind in ("instron", "lcr"):  # a third specimen: of other bytes than the second
        lines = (EXAMPLE / f"sensor2_{kind}.csv").read_text(encoding="utf-8").splitlines(keepends=True)
        (folder / "lab" / f"sensor3_{kind}.csv").write_text("".join(lines[:-5]), encoding="utf-8")
    page.goto(f"{site}/files/add?name=lab%2Fsensor3_lcr.csv")
    page.locator("#of").select_option(index=page.locator("#of option").count() - 1)
    seen(page, "add", 1340, 1200)


def of_commands(scratch: Path) -> None:
    """Keep what commands and studies draw.

    Parameters
    ----------
    scratch : folder to write into.
    """
    calib(scratch, "read", str(EXAMPLE / "sensor1_instron.csv"), "--picture", "read.png")
    shutil.copy(scratch / "read.png", DOCS / "tutorial_read.png")
    (scratch / "design.toml").write_text(PAPER, encoding="utf-8")
    words = ("--displacement", "0.7 mm", "--model", "fem", "--picture", "deformed.png", "-o", "curve.csv")
    calib(scratch, "simulate", "design.toml", *words)
    shutil.copy(scratch / "deformed.png", DOCS / "deformed.png")
    draw = str(DOCS.parent / "benchmarks" / "surrogate_range.py")
    subprocess.run([sys.executable, draw, str(DOCS / "surrogate_range.png")], check=True)
    notebook = json.loads((DOCS.parent / "notebooks" / "padding_optimum.ipynb").read_text(encoding="utf-8"))
    names: dict[str, object] = {}
    matplotlib.use("Agg")
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), names)
    drawn = names["figure"]
    assert isinstance(drawn, matplotlib.figure.Figure)
    drawn.savefig(DOCS / "padding_optimum.png", dpi=100)


def of_gallery(folder: Path) -> None:
    """Keep the figures of a report.

    Parameters
    ----------
    folder : of a run with a recommendation.
    """
    run = load_run(folder)
    plots = plots_of_report(run.posterior, run.predictions, load_recommendation(folder))
    for name, file in GALLERY.items():
        figure = plots[name].figure()
        buffer = io.BytesIO()
        with any_letters():
            figure.savefig(buffer, format="png", dpi=_WIDTH / figure.get_figwidth())
        keep(Image.open(buffer), file, _WIDTH)


@contextmanager
def served(folder: Path) -> Iterator[str]:
    """The address of the page of a folder, while it is served."""
    words = [sys.executable, "-m", "calib", "serve", str(folder), "--no-browser"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            yield next(found[0] for line in process.stdout if (found := re.search(r"http://\S+", line)))
        finally:
            process.terminate()


def calib(folder: Path, *words: str) -> None:
    """Give a command in a folder."""
    subprocess.run([sys.executable, "-m", "calib", *words], cwd=folder, check=True, stdout=subprocess.DEVNULL)


def seen(page: Page, name: str, tall: int | str, tall_on_phone: int | str = 0) -> None:
    """Keep the head of a page on a screen, and on a phone if that is asked for: so many pixels, or to the end of an element."""
    for (width, behind), end in zip(WIDTHS.items(), (tall, tall_on_phone), strict=True):
        if end:
            page.set_viewport_size({"width": width, "height": end if isinstance(end, int) else 900})
            page.wait_for_load_state("networkidle")
            if isinstance(end, str):
                bottom = page.locator(end).first.evaluate("element => element.getBoundingClientRect().bottom + window.scrollY")
                page.set_viewport_size({"width": width, "height": int(bottom) + _BELOW})
            page.evaluate("() => { window.scrollTo(0, 0); document.activeElement.blur(); }")
            keep(Image.open(io.BytesIO(page.screenshot())), f"serve_{name}{behind}")
    page.set_viewport_size({"width": 1280, "height": 900})


def keep(picture: Image.Image, file: str, width: int = 0) -> None:
    """Write a picture, small: not wider than `width` [px], if that is given, and of few colours."""
    shown = picture.convert("RGB")
    if 0 < width < shown.width:
        shown = shown.resize((width, round(shown.height * width / shown.width)), Image.Resampling.LANCZOS)
    shown.quantize(_COLOURS, kmeans=3).save(PICTURES / f"{file}.png", optimize=True)


if __name__ == "__main__":
    main()
