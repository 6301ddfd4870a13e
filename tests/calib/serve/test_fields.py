"""What a lab file's page advises is said in its own fields, not in options of the command line; and what was said is kept."""

from __future__ import annotations

import html
import re
from pathlib import Path

import numpy as np
import pytest
from letting_in import let_in
from small_lab import EXPERIMENT, write_press

from calib.serve import Workspace, open_workspace
from calib.serve.fields import by_fields, in_fields
from calib.serve.looking import WHERES, form_of, said_from

T = np.linspace(0, 30, 61)
D = np.where(T < 20, T / 20, 1 - (T - 20) / 10)
F = 4 * np.clip(D - 0.1, 0, None) ** 1.5 + 0.003 * np.sin(7 * T)


@pytest.fixture
def space(tmp_path: Path) -> Workspace:
    """A folder without an experiment."""
    space = open_workspace(tmp_path / "new")
    (space.folder / "lab").mkdir()
    return space


def _file(space: Workspace, header: str, *columns: np.ndarray, digits: int = 4) -> str:
    rows = [",".join(f"{value:.{digits}f}" for value in row) for row in zip(*columns, strict=True)]
    path = space.folder / "lab" / "press.csv"
    path.write_text("\n".join([*([header] if header else []), *rows, ""]), encoding="utf-8")
    return "lab/press.csv"


def _said(page: str) -> str:
    """What a page says, without the command that would do the same."""
    return html.unescape(re.sub(r"<[^>]+>", "", re.sub(r'<div class="command">.*?</div>', "", page, flags=re.DOTALL)))


@pytest.mark.parametrize(
    ("header", "columns", "links"),
    [
        ("Time (s),Displacement (mm),Force", (T, D, F), ["units_force"]),
        ("Time (s),Displacement (mm),Load 1 (N),Load 2 (N)", (T, D, F, 0.5 * F), ["columns_force"]),
        ("Time (s),A (mm),B (mm),Force (N)", (T, D, 2 * D, F), ["columns_displacement"]),
        ("", (T, D, F), ["columns_time", "columns_displacement", "columns_force"]),
        ("Time (s),Displacement (mm),Force (kN)", (T, D, F * 1e3), ["units_force"]),
        ("Time,Displacement (mm),Force (N)", (T, D, F), ["units_time"]),
        ("Time (s),Displacement (mm),Force (N),Df", (T, D, F, 0 * T + 0.01), []),
    ],
)
def test_a_file_page_advises_in_its_own_fields(
    space: Workspace, header: str, columns: tuple[np.ndarray, ...], links: list[str]
) -> None:
    name = _file(space, header, *columns)
    page = let_in(space).get(f"/file?name={name}").text
    assert not re.search(r"--[a-z]", _said(page)), _said(page)
    fields = set(re.findall(r' id="(\w+)"', page))
    linked = re.findall(r'(?:<a href="#|data-field=")(\w+)"', page)
    assert set(linked) <= fields
    assert set(links) <= set(linked)


def test_options_become_links_with_what_is_to_be_said_and_all_else_stays() -> None:
    said = 'Say --units time=h:min:s, or leave it out: --columns time=none. As `--where "Frequency (Hz)=1000"` or --sheet NAME'
    assert in_fields(said) == (
        'Say "Unit of time": h:min:s, or leave it out: "Column of time": none. '
        'As "Only rows where column "Frequency (Hz)" holds": 1000 or "Sheet"'
    )
    assert in_fields('--sign "compression negative", --units "force=1e-3 N"; --units of each') == (
        '"Which way": compression negative, "Unit of force": 1e-3 N; "Unit" of each'
    )
    assert in_fields("--columns time=1 --columns force=2") == '"Column of time": 1, "Column of force": 2'
    for kept in ("nothing -- at all", "calib read x --output y", "a--units", "--units-of"):
        assert in_fields(kept) == kept
    assert str(by_fields('--columns "force=<b>"')) == '<a href="#columns_force">Column of force</a>: &lt;b&gt;'


def test_advice_of_a_lab_file_that_another_page_meets_leads_to_the_page_of_the_file(space: Workspace) -> None:
    _file(space, "Time (s),Displacement (mm),Force,Capacitance (pF)", T, D, F, 97 + F / 4)
    (space.folder / "experiment.toml").write_text(EXPERIMENT.replace(', units = { force = "N" }', ""), encoding="utf-8")
    answer = let_in(space).get("/check/found", headers={"x-part": "1"})
    said = _said(answer.text)
    assert "has no unit" in said
    assert not re.search(r"--[a-z]", said), said
    assert "on the page of lab/press.csv" in said


def test_a_file_that_asks_for_two_columns_of_rows_asks_for_the_other_once_one_is_answered(space: Workspace) -> None:
    rows = ["Channel,Frequency (Hz),Time (s),Displacement (mm),Force (N),Capacitance (pF)"]
    for t, d, f in zip(T, D, F, strict=True):
        for channel, hertz in ((1, 1000), (1, 10000), (2, 1000), (2, 10000)):
            rows.append(f"{channel},{hertz},{t:.3f},{d:.4f},{f * channel:.4f},{97 + f / 4 + channel:.4f}")
    (space.folder / "lab" / "long.csv").write_text("\n".join([*rows, ""]), encoding="utf-8")
    page = let_in(space)
    form = {"name": "lab/long.csv"}
    asked = page.get("/file?name=lab/long.csv").text
    assert "Rows where Channel holds 2" in _said(asked)
    form |= {"where_column": "Channel", "where_value": "2"}
    asked = page.post("/file/correct", data=form).text
    assert "Rows where Channel" not in _said(asked)
    assert "Rows where Frequency (Hz) holds 1000" in _said(asked)
    form |= {"where_column_2": "Frequency (Hz)", "where_value_2": "1000"}
    assert "rows are used" in page.post("/file/correct", data=form).text


def test_rows_may_be_chosen_by_several_columns_and_none_is_lost(space: Workspace) -> None:
    form = {"units_dissipation": "%", "columns_frequency": "3"}
    for k, (column, value) in zip(WHERES, (("Channel", "2"), ("Frequency (Hz)", "1000"), ("Run", "1")), strict=False):
        form |= {f"where_column{k}": column, f"where_value{k}": value}
    said = said_from(form)
    assert said.reading.where == {"Channel": "2", "Frequency (Hz)": "1000", "Run": "1"}
    assert {key: value for key, value in form_of(said).items() if value} == form
    write_press(space.folder / "lab" / "press.csv")
    page = let_in(space)
    shown = page.post("/file/correct", data={"name": "lab/press.csv", **form}).text
    for key, value in form.items():
        assert re.search(rf'name="{key}"[^>]* value="{re.escape(value)}"', shown), key
    # One further pair is there to be filled in.
    assert f'name="where_column{WHERES[3]}"' in shown
    refused = page.post("/file/correct", data={"name": "lab/press.csv", **form, "where_column_2": "Channel"})
    assert refused.status_code == 422
    assert "cannot hold two values at once" in refused.text
