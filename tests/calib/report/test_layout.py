"""The page on a phone, on a screen and on paper: nothing is wider than it, nothing too small, no colour without its sign."""

from __future__ import annotations

import base64
import io
import re
import subprocess
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from html.parser import HTMLParser
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import StepPatch
from matplotlib.text import Text
from PIL import Image
from sheets import filled

from calib.catalogue import QUANTITIES
from calib.checks import Reason, verdict_of
from calib.checks.predictive import predict
from calib.decision import NextInShort, Requirement, ShortMeasurement, recommend, recommend_for
from calib.digits import interval_text
from calib.experiment import Instrument, Limit, Specification
from calib.lab.quality.grade import Grade
from calib.report import (
    Origin,
    certificate_page,
    certify,
    corner_figure,
    find_browser,
    plots_of_report,
    print_page,
    prior_figure,
    report_page,
    template_text,
)
from calib.report.figures.padding import beside_figure
from calib.report.pictures import Plot
from calib.sampling.posterior import Posterior
from models.analytic import ClosedForm

# Of a phone 390 pixels wide the page leaves so many between its margins, and no letter may be lower than these.
PHONE, LETTERS = 390 - 2 * 16, 9.0
VOID = ("meta", "img", "br")

MakePosterior = Callable[..., Posterior]


class Rule(NamedTuple):
    """One rule of the style sheet: the medium it is for, what it is of, and what it says."""

    medium: str
    selector: str
    says: Mapping[str, str]


def rules(css: str) -> Iterator[Rule]:
    for medium, inner, selector, body in re.findall(
        r"@media ([^{]*)\{((?:[^{}]*\{(?:[^{}]|\{[^{}]*\})*\})*)\s*\}|([^{}@]+)\{([^{}]*)\}", css
    ):
        if medium:
            yield from (rule._replace(medium=medium.strip()) for rule in rules(inner))
        else:
            said = (part.split(":", 1) for part in body.split(";") if ":" in part)
            yield Rule("", selector.strip(), {name.strip(): value.strip() for name, value in said})


CSS = "".join(template_text(name) for name in ("scroll.css", "page.css"))
OF_ELEMENTS = re.sub(r"/\*.*?\*/|^ *@page.*?$", "", CSS, flags=re.S | re.M)
RULES = tuple(rules(OF_ELEMENTS))


class Tree(HTMLParser):
    """The elements of a page, each with those that it stands in, as "tag.class"."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.found: list[tuple[str, dict[str, str], tuple[str, ...]]] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        said = {name: value or "" for name, value in attrs}
        self.found.append((tag, said, tuple(self.open)))
        if tag not in VOID:
            self.open.append(".".join([tag, *said.get("class", "").split()]))

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop().split(".")[0] == tag


@pytest.fixture(scope="module")
def drawn() -> dict[str, Figure]:
    return {}


@pytest.fixture(scope="module")
def page(make_posterior: MakePosterior, drawn: dict[str, Figure]) -> str:
    """A page with all that a page may have, its figures drawn but not encoded."""

    def kept(plot: Plot) -> str:
        drawn[str(len(drawn))] = plot.figure()
        return f"data:image/png,{len(drawn) - 1}"

    posterior = make_posterior(n_specimen=1)
    first, *others = posterior.sweeps
    grades = (
        Grade("load zero", "warning", -6.1, "N", "it is -6.1 N", "Balance it.", "force", "a.csv"),
        Grade("hysteresis", "good", 0.04, "1", "gives back 96 %", "", "force", "a.csv"),
    )
    posterior = replace(posterior, sweeps=(replace(first, grades=grades), *others))
    limits = (Limit("signal", "at_least", 0.05), Limit("stroke", "at_most", 1e-3))
    spec = Specification(limits, (8.0,), upper=4e-3, steps=3, n_draw=50, electrode_radii=(8e-3, 9e-3), modulus_spread=0.1)
    advice = recommend_for(posterior, ClosedForm(), spec, seed=1)
    predictions = predict(posterior, ClosedForm(), np.random.default_rng(1), n_draw=20)
    drawings = {name: partial(kept, plot) for name, plot in plots_of_report(posterior, predictions, advice).items()}
    return report_page(posterior, predictions, advice, posterior_sha256="ab" * 32, drawings=drawings)


@pytest.fixture(scope="module")
def page_with_next_steps(make_posterior: MakePosterior) -> str:
    """A page of two specimens, with what to measure next, and pictures of the size that they have."""
    posterior = make_posterior()
    return _sheets_page(posterior, (), replace_advice=True)


def _sheets_page(
    posterior: Posterior, reasons: Sequence[Reason], *, replace_advice: bool = False, as_large: bool = False
) -> str:
    """A page whose pictures are blank, with an advice beyond the data and the reasons that are given.

    Pictures are of one size, or each as large as it is.
    """
    limits = (Limit("signal", "at_least", 0.05),)
    spec = Specification(limits, (8.0,), upper=4e-3, steps=3, n_draw=50, modulus_spread=0.1)
    wanted = Requirement(8.0, 0.0, 4e-3, n_thickness=13, n_draw=50)
    advice = recommend_for(posterior, ClosedForm(), spec if replace_advice else wanted, seed=1, verdict=verdict_of(reasons))
    predictions = predict(posterior, ClosedForm(), np.random.default_rng(1), n_draw=20)
    blank = "data:image/svg+xml,%3Csvg xmlns='http://www.w3.org/2000/svg' width='460' height='430'%3E%3C/svg%3E"
    plots = plots_of_report(posterior, predictions, advice)
    drawings = {name: partial(_blank, plot) if as_large else lambda: blank for name, plot in plots.items()}
    some = (ShortMeasurement("press it once more", "modulus ±1 % instead of ±2 %", 0.28, 1.1, 15.0),)
    return report_page(
        posterior,
        predictions,
        advice,
        verdict=verdict_of(reasons),
        posterior_sha256="ab" * 32,
        drawings=drawings,
        next_steps=NextInShort("modulus", "Young's modulus", "It is known to 2 %.", some),
    )


def _blank(plot: Plot) -> str:
    """A picture with nothing on it, as large as that of a plot."""
    width, height = (round(96 * inches) for inches in plot.figure().get_size_inches())
    buffer = io.BytesIO()
    Image.new("L", (width, height), 255).save(buffer, format="png")
    return f"data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode()}"


def test_the_style_sheet_is_understood_here() -> None:
    assert {rule.medium for rule in RULES} == {"", "screen and (max-width: 700px)", "print"}
    assert len(RULES) == OF_ELEMENTS.count("{") - OF_ELEMENTS.count("@media") > 100


def test_every_table_moves_in_a_box_of_its_own(page: str) -> None:
    tables = [inside for tag, _, inside in Tree(page).found if tag == "table"]
    assert len(tables) >= 5
    assert all("div.scroll" in inside for inside in tables)
    assert next(rule.says["overflow-x"] for rule in RULES if rule.selector == ".scroll") == "auto"


def test_rows_that_are_stacked_on_a_phone_say_what_their_cells_are(page_with_next_steps: str) -> None:
    rows = re.findall(r"<tr[ >].*?</tr>", page_with_next_steps, re.S)
    stacked = [row for row in rows if "data-label" in row]
    tables = re.findall(r'<table class="stacked.*?</table>', page_with_next_steps, re.S)
    assert len(tables) >= 8
    assert sum(len(re.findall("<tr><td", table)) for table in tables) == len(stacked)
    for row in stacked:
        _, *others = re.findall(r"<td[^>]*>", row)
        assert all('data-label="' in cell and 'data-label=""' not in cell for cell in others), row


@pytest.mark.parametrize("name", ["grid-template-columns", "width", "min-width"])
def test_nothing_asks_for_more_room_than_a_phone_has(name: str) -> None:
    on_phone = [rule for rule in RULES if rule.medium != "print" and name in rule.says]
    assert on_phone
    for rule in on_phone:
        value = re.sub(r"min\(\d+px, 100%\)", "", rule.says[name])
        sizes = [float(n) for n in re.findall(r"([\d.]+)px", value)] + [15 * float(n) for n in re.findall(r"([\d.]+)em", value)]
        assert sum(sizes) <= PHONE, rule
        # What is as wide as its longest words leaves the rest no room.
        assert "max-content" not in value, rule
        assert "min-content" not in value, rule


def test_long_words_break(page: str) -> None:
    breaking = {rule.selector: rule.says["overflow-wrap"] for rule in RULES if "overflow-wrap" in rule.says}
    assert breaking["code, .hash"] == breaking["dd"] == "anywhere"
    assert breaking["body"] == "break-word"
    assert '<meta name="viewport" content="width=device-width, initial-scale=1">' in page


def test_letters_of_the_page_are_not_too_small() -> None:
    sizes = {rule.selector: rule.says["font-size"] for rule in RULES if "font-size" in rule.says}
    pixels = {selector: float(size[:-2]) * (1.0 if size.endswith("px") else 96 / 72) for selector, size in sizes.items()}
    assert min(pixels.values()) >= LETTERS, pixels


def test_letters_in_figures_can_be_read_on_a_phone(page: str, drawn: dict[str, Figure]) -> None:
    images = [(said, inside) for tag, said, inside in Tree(page).found if tag == "img"]
    assert len(images) == len(drawn) == 12
    for said, inside in images:
        figure = drawn[said["src"].split(",")[1]]
        least = re.search(r"--least: (\d+)px", said.get("style", ""))
        assert (least is None) or "div.scroll.wide" in inside
        shown = float(least[1]) if least else PHONE
        scale = shown / (96.0 * figure.get_figwidth())
        small = min((t for t in figure.findobj(Text) if t.get_visible()), key=lambda t: t.get_fontsize())
        assert float(small.get_fontsize()) * 96 / 72 * scale >= LETTERS, (said["data-name"], small)


def test_statistics_are_folded_at_the_end_and_open_on_paper(page: str) -> None:
    found = Tree(page).found
    places = {said["id"]: inside for _, said, inside in found if "id" in said}
    assert [name for name, inside in places.items() if "details" in inside] == ["convergence", "ridges", "data", "run"]
    assert list(places)[-5:] == ["appendix", "convergence", "ridges", "data", "run"]
    opened = next(rule for rule in RULES if rule.selector == "details::details-content")
    assert (opened.medium, opened.says["content-visibility"]) == ("print", "visible")


def test_after_the_first_sheet_come_lab_data_fit_and_decision(page: str) -> None:
    names = [said["id"] for tag, said, _ in Tree(page).found if tag == "section"]
    assert names == ["verdict", "quality", "sweeps", "parameters", "specification", "padding", "limits", "appendix"]


def test_the_first_sheet_has_verdict_numbers_signal_and_conditions(page: str) -> None:
    sheet = page.partition('<section id="verdict">')[2].partition("<nav>")[0]
    places = [sheet.index(word) for word in ('class="verdict', 'class="cards"', "<img ", "padding thickness", "Holds only for")]
    assert places == sorted(places)
    assert re.findall('data-name="([^"]*)"', sheet) == ["conformity"]
    assert page.count('data-name="conformity"') == 1


def test_of_a_specification_only_what_conforms_is_called_recommended(page: str) -> None:
    section = page.partition('<section id="padding">')[2].partition("</section>")[0]
    assert "What padding gives the largest signal" in section
    assert "at the thickness of the largest signal, " in section
    assert "recommended thickness" not in section
    assert "at the recommended" not in section


def tick_labels(axis: Axis) -> list[Text]:
    """The labels of an axis that are drawn, level."""
    low, high = sorted(axis.get_view_interval())
    within = [tick.label1 for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high]
    return [t for t in within if t.get_visible() and t.get_text() and t.get_rotation() == 0]


def test_labels_of_ticks_do_not_touch(page: str, drawn: dict[str, Figure]) -> None:
    assert page
    for figure in drawn.values():
        FigureCanvasAgg(figure).draw()
        labels = [t for ax in figure.axes if ax.get_visible() for axis in (ax.xaxis, ax.yaxis) for t in tick_labels(axis)]
        boxes = [(t.get_text(), t.get_window_extent()) for t in labels]
        touching = [(one, other) for (one, a), (other, b) in combinations(boxes, 2) if a.overlaps(b)]
        assert not touching, touching


def test_labels_of_neighbouring_panels_keep_apart_wherever_their_ticks_lie(make_posterior: MakePosterior) -> None:
    posterior = make_posterior()
    for share in np.linspace(0.9, 1.1, 12):
        figure = prior_figure(replace(posterior, draws=posterior.draws * share))
        FigureCanvasAgg(figure).draw()
        rows = [[t.get_window_extent() for t in tick_labels(ax.xaxis)] for ax in figure.axes if ax.axison]
        for left, right in zip(rows[::2], rows[1::2], strict=False):
            assert right[0].x0 - left[-1].x1 > 1.2 * left[-1].height


def test_letters_of_figures_can_be_read_on_paper(page: str, drawn: dict[str, Figure]) -> None:
    said = {rule.selector: rule.says["max-width"] for rule in RULES if rule.medium == "print" and "max-width" in rule.says}
    for about, inside in [(about, inside) for tag, about, inside in Tree(page).found if tag == "img"]:
        figure = drawn[about["src"].split(",")[1]]
        millimetres = float(said[".wide img" if "div.scroll.wide" in inside else ".pair img"].removesuffix("mm"))
        small = min((t for t in figure.findobj(Text) if t.get_visible() and t.get_text()), key=lambda t: t.get_fontsize())
        assert float(small.get_fontsize()) * millimetres / (25.4 * figure.get_figwidth()) >= 5.0, (about["data-name"], small)


@pytest.mark.parametrize("share", [0.93, 1.0, 1.07])
def test_labels_of_pairs_keep_apart_from_those_of_the_next_panel_and_from_its_name(
    make_posterior: MakePosterior, share: float
) -> None:
    posterior = make_posterior()
    figure = corner_figure(replace(posterior, draws=posterior.draws * share))
    FigureCanvasAgg(figure).draw()
    shown = [ax for ax in figure.axes if ax.get_visible() and ax.get_frame_on()]
    assert len(shown) > 6
    for axes in ([ax.xaxis for ax in shown], [ax.yaxis for ax in shown]):
        names = [axis.label.get_window_extent() for axis in axes if axis.label.get_text()]
        rows = [[t.label1.get_window_extent() for t in axis.get_major_ticks() if t.label1.get_text()] for axis in axes]
        assert sum(map(bool, rows)) >= 3
        for one, other in combinations(rows, 2):
            assert not any(a.overlaps(b) for a in one for b in other)
        assert not any(name.overlaps(box) for name in names for row in rows for box in row)


def test_panels_are_zoomed_to_the_posterior_and_state_the_prior(make_posterior: MakePosterior) -> None:
    posterior = make_posterior(n_specimen=1)
    figure = prior_figure(posterior)
    for ax, info in zip(figure.axes, posterior.parameters, strict=False):
        draws = posterior.draws[:, :, posterior.parameters.index(info)] * QUANTITIES[info.parameter].display_scale
        low, high = ax.get_xlim()
        inside = (np.quantile(draws, 0.999) - np.quantile(draws, 0.001)) / (high - low)
        assert 0.75 < inside < 1, info.name
        believed = np.asarray(info.prior.ppf_normal(np.array([-1.96, 1.96]))) * QUANTITIES[info.parameter].display_scale
        assert [t.get_text() for t in ax.texts] == [f"prior, 95 %: {interval_text(*believed)}"]


def test_optima_that_lie_close_together_are_more_than_one_bar(make_posterior: MakePosterior) -> None:
    r = recommend(make_posterior(n_specimen=1), ClosedForm(), Requirement(8.0, 0.0, 4e-3, n_draw=50), seed=1)
    close = replace(r, optimum=np.random.default_rng(1).normal(2e-3, 1e-5, 400))
    bars = beside_figure(close).axes[-1].patches[0]
    assert isinstance(bars, StepPatch)
    assert np.count_nonzero(bars.get_data()[0]) > 15
    beside_figure(replace(r, optimum=np.full(400, 2e-3)))


def test_every_sheet_has_its_number_and_the_hash_of_the_run(make_posterior: MakePosterior, page: str, undrawn: None) -> None:
    assert 'content: "page " counter(page) " of " counter(pages)' in CSS
    assert '@page { @bottom-left { content: "run abababababababab";' in page
    posterior = make_posterior(n_specimen=1)
    predictions = predict(posterior, ClosedForm(), np.random.default_rng(1), n_draw=20)
    own = replace(posterior, attrs={**posterior.attrs, "fingerprint": "0123456789abcdef" * 4})
    assert 'content: "run 0123456789abcdef";' in report_page(own, predictions, posterior_sha256="ab" * 32)
    assert "@bottom-left" not in report_page(posterior, predictions)
    odd = replace(posterior, attrs={**posterior.attrs, "fingerprint": '"} </style>'})
    assert "@bottom-left" not in report_page(odd, predictions)


@pytest.mark.parametrize(("colour", "sign"), [("green", "✓"), ("amber", "!"), ("red", "✗")])
def test_no_light_is_a_colour_alone(colour: str, sign: str) -> None:
    said = {rule.selector: rule.says for rule in RULES if not rule.medium}
    assert said[f"ul.lights li.{colour}::before"]["content"] == f'"{sign} {colour}"'
    status = next(says for selector, says in said.items() if f".verdict.{colour} strong.status::before" in selector)
    assert status["content"] == f'"{sign} "'


def test_no_word_of_the_page_is_judged_by_a_colour_alone(page: str) -> None:
    words = re.findall(r'class="(yes|no|warns)">([^<]*)', page)
    assert {kind for kind, _ in words} >= {"yes", "warns"}
    assert not [(kind, word) for kind, word in words if word[:1] not in {"yes": "✓", "no": "!✗", "warns": "!"}[kind]]
    assert next(rule.says["content"] for rule in RULES if rule.selector == "td.no::after") == '" ✗"'


@pytest.mark.parametrize(("one", "other"), [("good", "bad"), ("good", "amber"), ("amber", "bad")])
def test_the_lights_keep_apart_without_red_and_green_sight(one: str, other: str) -> None:
    root = next(rule.says for rule in RULES if rule.selector == ":root")
    lights = []
    for name in (one, other):
        colour = np.array([int(root[f"--{name}-line"][i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
        linear = np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)
        lights.append(DEUTERANOPE @ linear)
    assert np.linalg.norm(np.abs(lights[0] - lights[1]) ** (1 / 2.2)) > 0.3


# What is left of red, green and blue without cones for green (Machado, Oliveira and Fernandes, IEEE TVCG 15 (2009) 1291).
DEUTERANOPE = np.array([[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]])


BROWSER = find_browser()


@pytest.mark.skipif(BROWSER is None, reason="no browser on this machine")
def test_a_browser_shows_the_page_as_wide_as_a_phone_and_prints_it_on_sheets_of_a4(page: str, tmp_path: Path) -> None:
    assert BROWSER is not None
    (tmp_path / "page.html").write_text(page, encoding="utf-8")
    assert _on_a_phone(tmp_path, PHONE_FRAME) == ["390 wide, beyond it: none"]
    print_page(BROWSER, tmp_path / "page.html", tmp_path / "page.pdf")
    content = (tmp_path / "page.pdf").read_bytes()
    sheets = re.findall(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", content)
    assert {(round(float(w)), round(float(h))) for w, h in sheets} == {(595, 842)}
    assert 4 <= len(sheets) <= 12


@pytest.mark.skipif(BROWSER is None, reason="no browser on this machine")
@pytest.mark.parametrize("n_specimen", [1, 2])
def test_no_sheet_but_the_last_is_left_half_empty(make_posterior: MakePosterior, tmp_path: Path, n_specimen: int) -> None:
    page = _sheets_page(make_posterior(n_specimen=n_specimen), REASONS[:1], replace_advice=n_specimen == 1, as_large=True)
    n_sheet = _sheets(page, tmp_path)
    shares = filled((tmp_path / "page.pdf").read_bytes())
    assert len(shares) == n_sheet > 4
    assert min(shares[:-1]) > 0.5, shares


# As long as reasons are.
REASONS = tuple(
    Reason(
        gate,
        "amber",
        "the modulus changes by 2.1 of its standard deviations where this is taken otherwise than the experiment says, so that "
        "half of it rests on what was believed",
        "Measure that quantity again by another way, or press with a second ball of another radius and calibrate with both",
    )
    for gate in (
        "prior sensitivity",
        "rate",
        "drift",
        "signal",
        "size",
        "fit",
        "specimens",
        "shape",
        "noise",
        "clock",
        "learned",
        "tare",
    )
)


@pytest.mark.skipif(BROWSER is None, reason="no browser on this machine")
@pytest.mark.parametrize("n_reason", [0, 1, 3, 4, 6, 12])
def test_what_one_must_know_stands_on_one_sheet_and_all_else_behind_it(
    make_posterior: MakePosterior, tmp_path: Path, n_reason: int
) -> None:
    page = _sheets_page(make_posterior(), REASONS[:n_reason])
    first, _, rest = page.partition("</div>\n\n<section ")
    whole = f"{first}</div>{rest[rest.index('<footer') :]}"
    sheet = first.partition('<div class="first">')[2]
    wanted = ["verdict", "recommended padding at 8 N", "<i>E</i>", "<img", "padding thickness", "Holds only for"]
    places = [sheet.index(word) for word in wanted]
    assert places == sorted(places)
    assert all(f"<strong>{reason.gate}" in sheet for reason in REASONS[:n_reason])
    without_footer = whole[: whole.index("<footer")] + "</main></body></html>"
    assert _sheets(without_footer, tmp_path) == 1
    # What follows, be it a line, does so on the next one.
    assert _sheets(whole, tmp_path) == 2


@pytest.mark.skipif(BROWSER is None, reason="no browser on this machine")
@pytest.mark.parametrize("n_reason", [0, 1, 3, 6, 12])
def test_the_picture_of_a_specification_takes_what_room_the_first_sheet_has_and_no_more(
    make_posterior: MakePosterior, tmp_path: Path, n_reason: int
) -> None:
    page = _sheets_page(make_posterior(), REASONS[:n_reason], replace_advice=True, as_large=True)
    first, _, rest = page.partition("</div>\n\n<section ")
    assert ' tall">' in first
    without_footer = f"{first}</div></main></body></html>"
    assert rest
    assert _sheets(without_footer, tmp_path) == 1
    (share,) = filled((tmp_path / "page.pdf").read_bytes())
    assert share > 0.85


def test_letters_of_the_picture_of_a_specification_can_be_read_on_the_first_sheet(drawn: dict[str, Figure], page: str) -> None:
    (about,) = (said for tag, said, _ in Tree(page).found if tag == "img" and said["data-name"] == "conformity")
    figure = drawn[about["src"].split(",")[1]]
    tall = {rule.selector: rule.says["max-height"] for rule in RULES if ".tall" in rule.selector}
    small = min(float(t.get_fontsize()) for t in figure.findobj(Text) if t.get_visible() and t.get_text())
    for selector, column in (("#verdict .signal.tall", 80.0), ("#verdict .signal.tall.roomy", 92.0)):
        height = float(tall[f"{selector} figure img"].removesuffix("mm"))
        wide, high = figure.get_size_inches()
        assert height * wide / high == pytest.approx(column, rel=0.02)
        assert small * column / (25.4 * wide) >= 5.5


def test_reasons_that_are_too_many_stand_on_the_first_sheet_with_an_action_in_a_line_each_and_in_full_behind_it(
    make_posterior: MakePosterior,
) -> None:
    few, many = (_sheets_page(make_posterior(), REASONS[:n]) for n in (3, 12))
    assert 'class="lights lines paper"' not in few
    assert 'id="reasons"' not in few
    first, _, rest = many.partition("</div>\n\n<section ")
    lines = re.findall(r"<ul class=\"lights lines paper\">(.*?)</ul>", first, re.S)
    gates = [re.findall("<strong>(.*?)</strong>", line) for line in lines]
    assert gates == [[r.gate for r in REASONS[:6]], ["extrapolation", "coverage"]]
    assert lines[0].count('<span class="action">Measure that quantity again by another way …</span>') == 6
    assert "6 more, and all of it in full, on the next sheet." in first
    behind = rest.partition("</section>")[0]
    assert behind.startswith('id="reasons" class="paper">')
    assert [behind.count(f"<strong>{reason.gate}</strong>") for reason in REASONS] == [1] * 12
    assert behind.count(REASONS[0].finding) == behind.count(REASONS[0].action) == 12
    # On a screen, which has room for all of them, they stand at the head alone.
    assert first.count('<ul class="lights screen">') == 2
    shown = {(rule.medium, rule.selector): rule.says["display"] for rule in RULES if rule.selector in (".paper", ".screen")}
    assert shown == {("", ".paper"): "none", ("print", ".paper"): "block", ("print", ".screen"): "none"}


def _sheets(page: str, folder: Path) -> int:
    """How many sheets a page is printed on."""
    assert BROWSER is not None
    (folder / "page.html").write_text(page, encoding="utf-8")
    print_page(BROWSER, folder / "page.html", folder / "page.pdf")
    return len(re.findall(rb"/MediaBox \[", (folder / "page.pdf").read_bytes()))


PHONE_FRAME = """<!DOCTYPE html><iframe id="phone" style="width: 390px; height: 20000px; border: 0" src="page.html"></iframe>
<script>
onload = () => {
  const page = document.getElementById("phone").contentDocument;
  const beyond = [...page.querySelectorAll("*")].filter(e => e.getBoundingClientRect().right > 390.5 && !e.closest(".scroll"));
  const names = beyond.map(e => e.tagName + "." + e.className).join(" ") || "none";
  document.title = page.documentElement.scrollWidth + " wide, beyond it: " + names;
};
</script>
"""


@pytest.mark.skipif(BROWSER is None, reason="no browser on this machine")
def test_a_certificate_is_no_wider_than_a_phone_its_tables_included(make_posterior: MakePosterior, tmp_path: Path) -> None:
    assert BROWSER is not None
    posterior = make_posterior()
    instruments = (
        Instrument("testing machine", "A Maker of Machines", "with a long name 2530-50N", "123456789", "2026-01-12", "0.5"),
    )
    posterior = replace(posterior, experiment=replace(posterior.experiment, instruments=instruments))
    made = certify(posterior, verdict_of([]), Origin((), (), (), None, {}), "2026-11-23T00:00:00+00:00")
    (tmp_path / "page.html").write_text(certificate_page(made, "00" * 32, ""), encoding="utf-8")
    assert _on_a_phone(tmp_path, PHONE_FRAME.replace('&& !e.closest(".scroll")', "")) == ["390 wide, beyond it: none"]


def _on_a_phone(folder: Path, frame: str) -> list[str]:
    """What a frame says of the page.html of a folder: a window is never as narrow as a phone, a frame in it is."""
    (folder / "phone.html").write_text(frame, encoding="utf-8")
    words = ["--headless", "--disable-gpu", "--no-sandbox", "--allow-file-access-from-files", "--dump-dom"]
    run = [str(BROWSER), *words, f"--user-data-dir={folder / 'profile'}", (folder / "phone.html").as_uri()]
    shown = subprocess.run(run, capture_output=True, text=True, timeout=120, check=True).stdout
    return re.findall("<title>(.*?)</title>", shown)
