"""Make the pictures of README and gallery from a run of the shipped example: `python docs/make_pictures.py RUN`.

RUN is what README's first command leaves: calibrated, with a padding recommended for 10 N. A browser takes the pictures of
its page.
"""

from __future__ import annotations

import io
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

from calib import load_run
from calib.report import any_letters, find_browser, plots_of_report
from calib.runs import load_recommendation

PICTURES = Path(__file__).parent / "pictures"
#: Figures of the gallery: name on the page -> file.
GALLERY = {
    "padding": "padding",
    "beside": "beside",
    "change": "change",
    "force of sensor 1": "force",
    "capacitance of sensor 1": "capacitance",
    "priors of material and rig": "priors",
    "pairs": "pairs",
    "traces, 1": "traces",
}
#: Width of a screen and of a phone, and how much of the page is shown [px].
VIEWS = {"report": (1280, 1560), "report_phone": (390, 1640)}
#: Width of a picture, and its colours: these keep it small.
_WIDTH, _COLOURS = 760, 256


def main(folder: Path) -> None:
    """Make all pictures of a run."""
    PICTURES.mkdir(exist_ok=True)
    run = load_run(folder)
    plots = plots_of_report(run.posterior, run.predictions, load_recommendation(folder))
    for name, file in GALLERY.items():
        figure = plots[name].figure()
        buffer = io.BytesIO()
        with any_letters():
            figure.savefig(buffer, format="png", dpi=_WIDTH / figure.get_figwidth())
        _keep(Image.open(buffer), file)
    for file, (width, height) in VIEWS.items():
        _keep(_seen(run.report, width, height), file)


def _seen(page: Path, width: int, height: int) -> Image.Image:
    """What a browser shows of a page in a frame of this size."""
    browser = find_browser()
    if browser is None:
        sys.exit("no browser was found that takes pictures of pages")
    with tempfile.TemporaryDirectory() as scratch:
        frame = Path(scratch) / "frame.html"
        style = f"width: {width}px; height: {height}px; border: 0; overflow: hidden"
        frame.write_text(f'<body style="margin: 0"><iframe scrolling="no" style="{style}" src="{page.absolute().as_uri()}">')
        words = ["--headless", "--disable-gpu", "--no-sandbox", "--hide-scrollbars", f"--user-data-dir={scratch}/profile"]
        size = f"--window-size={max(width, 600)},{height}"
        words += [size, f"--screenshot={scratch}/page.png", frame.as_uri()]
        subprocess.run([browser, *words], check=True, timeout=120, capture_output=True)
        return Image.open(f"{scratch}/page.png").convert("RGB").crop((0, 0, width, height))


def _keep(picture: Image.Image, file: str) -> None:
    """Write a picture, small."""
    shown = picture.convert("RGB")
    if shown.width > _WIDTH:
        shown = shown.resize((_WIDTH, round(shown.height * _WIDTH / shown.width)), Image.Resampling.LANCZOS)
    shown.quantize(_COLOURS, kmeans=3).save(PICTURES / f"{file}.png", optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
