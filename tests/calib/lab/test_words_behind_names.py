"""Words behind a name or its unit: how far an instrument reaches, which filter, since when, marks of footnotes, factors."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np
import pytest

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file
from calib.lab.instruments.vocabulary import understand

N = 60
TIME = np.arange(N) * 0.1
DEPTH = np.concatenate([np.linspace(0.0, 1.0, 36), np.linspace(1.0, 0.02, 24)])
FORCE = 7.0 * np.clip(DEPTH - 0.1, 0.0, None) ** 1.7 + 0.003 * np.sin(37.0 * np.arange(N))
ROWS = [f"{t:.2f};{d:.4f};{f:.4f}" for t, d, f in zip(TIME, DEPTH, FORCE, strict=True)]
NAMES = ("Time (s)", "Displacement (mm)", "Force (N)")


def _file(folder: Path, *names: str, above: str = "", units: str = "", below: str = "") -> Path:
    path = folder / "lab.csv"
    lines = [*([above] if above else []), ";".join(names), *([units] if units else []), *ROWS, *([below] if below else [])]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _read(folder: Path, force: str, reading: Reading | None = None, *, above: str = "", below: str = "") -> LabTable:
    return read_lab_file(_file(folder, *NAMES[:2], force, above=above, below=below), reading or Reading())


def _places(line: str) -> list[tuple[str, str]]:
    """A line above the names, and below the rows."""
    return [(line, ""), ("", f"\n{line}")]


def _is_force(table: LabTable, factor: float = 1.0) -> None:
    np.testing.assert_allclose(table.columns["force"], factor * FORCE, atol=1e-4 * factor)


def _typed(error: InputError) -> Reading:
    """What the first advice of a refusal says, typed as it stands."""
    tables: dict[str, dict[str, str]] = {"columns": {}, "units": {}}
    for option, said in zip(parts := shlex.split(error.faults[0].advice.replace(";", " ; ")), parts[1:], strict=False):
        if option in ("--columns", "--units"):
            quantity, _, value = said.partition("=")
            tables[option[2:]].setdefault(quantity, value.rstrip(","))
    return Reading(columns=tables["columns"], units={q: "N" if u == "..." else u for q, u in tables["units"].items()})


# ------------------------------------------------------------------------------------------- how far an instrument reaches


@pytest.mark.parametrize(
    "words",
    [
        "Bereich 20 N",
        "Messbereich 20 N",
        "gamme 20 N",
        "plage 0-20 N",
        "étendue de mesure 20 N",
        "échelle 20 N",
        "calibre 20 N",
        "rango 20 N",
        "alcance 20 N",
        "escala 20 N",
        "fondo scala 20 N",
        "fondo de escala: 20 N",
        "portata 20 N",
        "campo di misura 20 N",
        "bereik 20 N",
        "zakres pomiarowy 20 N",
        "mätområde 20 N",
        "rozsah 20 N",
        "量程20N",
        "範囲 20 N",
        "測定範囲 20 N",
        "범위 20 N",
        "диапазон 20 Н",
        "max. 20 N",
        "max 20 N",
        "max. capacity 20 N",
        "最大 20 N",
        "20 N max.",
        "20 N Bereich",
        "range: ±20 N",
        "bis 20 N",
        "up to 20 N",
    ],
)
@pytest.mark.parametrize(
    "form", ["Force ({}) (N)", "Force (N) {}", "Force [N] ({})", "Force (N), {}", "Force {} (N)", "Force [N, {}]"]
)
def test_the_reach_of_a_cell_in_any_language_is_no_statistic_and_no_factor(tmp_path: Path, words: str, form: str) -> None:
    _is_force(_read(tmp_path, form.format(words)))


def test_the_reach_of_a_sensor_may_stand_beside_its_unit_in_a_row_of_units(tmp_path: Path) -> None:
    for unit in ("N max. 20 N", "[N] Bereich 20 N", "(N) gamme 20 N"):
        path = _file(tmp_path, "Time", "Displacement", "Force", units=f"s;mm;{unit}")
        _is_force(read_lab_file(path))


@pytest.mark.parametrize("words", ["high range", "low range", "auto range", "hoher Messbereich"])
def test_which_range_a_cell_was_in_is_no_statistic(tmp_path: Path, words: str) -> None:
    _is_force(_read(tmp_path, f"Force ({words}) (N)"))


@pytest.mark.parametrize("words", ["max", "max 20", "max of 5", "peak 20 N", "range"])
def test_a_maximum_of_readings_stays_a_statistic(tmp_path: Path, words: str) -> None:
    for form in ("Force ({}) (N)", "Force (N) {}"):
        with pytest.raises(InputError, match="is a statistic"):
            _read(tmp_path, form.format(words))


@pytest.mark.parametrize("words", ["échelle 20", "scale 20", "factor 20 N", "gain 20"])
def test_a_scale_without_a_unit_stays_a_factor(tmp_path: Path, words: str) -> None:
    with pytest.raises(InputError, match="the factor"):
        _read(tmp_path, f"Force ({words}) (N)")


# ------------------------------------------------------------------------------------------------------------------ filters


@pytest.mark.parametrize(
    "name",
    [
        "Load (N) (median filter)",
        "Force (N, median of 5)",
        "Kraft (N), Median 3",
        "Force (median of 5) (N)",
        "Kraft [N] gleitender Median 5",
        "Kraft [N], Medianfilter 5",
        "Force median filtered (N)",
        "Force (filtre médian) (N)",
        "Force (N) moving average 5",
        "Force (moving average 5) (N)",
        "Force (N) rolling mean 10",
        "Force (N), moyenne glissante 5",
        "Fuerza (N) media móvil 5",
        "Force (N) Savitzky-Golay",
        "Load (N) drift corrected",
        "Load (N) offset corrected",
        "Load (N) baseline corrected",
        "Load (N, smoothed)",
        "Kraft [N] driftkorrigiert",
        "Force (N) dérive corrigée",
        "Force (N) lissée",
    ],
)
def test_a_filtered_force_is_read_and_told(tmp_path: Path, name: str) -> None:
    table = _read(tmp_path, name)
    _is_force(table)
    assert f'"{name}" was worked on after the measurement' in table.notes


def test_a_filtered_force_gives_way_to_the_raw_one(tmp_path: Path) -> None:
    path = tmp_path / "lab.csv"
    rows = [f"{row};{float(row.rsplit(';', 1)[1]) + 0.0005:.4f}" for row in ROWS]
    path.write_text("\n".join([";".join([*NAMES, "Force (N), median of 5"]), *rows]) + "\n", encoding="utf-8")
    _is_force(read_lab_file(path))


@pytest.mark.parametrize(
    "name",
    [
        "Force median (N)",
        "Force (median) (N)",
        "Force (N) median of 5 specimens",
        "Force (N, max of 5)",
        "Force (N) mean of 10 rows",
    ],
)
def test_a_median_without_a_window_stays_a_statistic(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="is a statistic"):
        _read(tmp_path, name)


def test_a_drift_is_no_force(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="what is drift is no record"):
        _read(tmp_path, "Load drift (N)")


@pytest.mark.parametrize(
    "name",
    [
        "Time (s) since start of hold",
        "Time since start of hold (s)",
        "Time (s), since contact",
        "Time (s) after hold",
        "Zeit [s] seit Beginn der Haltephase",
        "Temps (s) depuis le début du maintien",
        "Tiempo (s) desde el inicio",
    ],
)
def test_a_time_since_anything_is_a_time(tmp_path: Path, name: str) -> None:
    table = read_lab_file(_file(tmp_path, name, *NAMES[1:]))
    np.testing.assert_allclose(table.columns["time"], TIME, atol=1e-9)
    assert not any(name in note for note in table.notes)


def test_since_when_a_time_is_needs_no_note(tmp_path: Path) -> None:
    assert not any("Elapsed" in n for n in read_lab_file(_file(tmp_path, "Elapsed (s) since tare", *NAMES[1:])).notes)


def test_a_time_since_the_last_reading_is_no_clock(tmp_path: Path) -> None:
    assert "time" not in read_lab_file(_file(tmp_path, "Time (s) since last reading", *NAMES[1:])).columns


# ----------------------------------------------------------------------------------------------------------------- footnotes


@pytest.mark.parametrize(
    ("name", "mark"),
    [
        ("Force (N)*", "*"),
        ("Force (N) 1)", "1"),
        ("Force (N)¹", "1"),
        ("Force (N) a)", "a"),
        ("Force* (N)", "*"),
        ("Force¹ [N]", "1"),
        ("Force (N*)", "*"),
        ("Force (N)†", "†"),
    ],
)
def test_the_mark_of_a_footnote_is_told_with_the_line_that_begins_with_it(tmp_path: Path, name: str, mark: str) -> None:
    table = _read(tmp_path, name)
    _is_force(table)
    assert f'"{name}": the mark "{mark}" of a footnote is passed by' in table.notes
    for above, below in _places(f"{mark}) as the cell shows it"):
        told = [
            note for note in _read(tmp_path, name, above=above, below=below).notes if f'the mark "{mark}" of a footnote' in note
        ]
        assert [note.rpartition("says ")[2] for note in told] == ['"as the cell shows it"']


def test_a_mark_in_a_row_of_units_is_told_too(tmp_path: Path) -> None:
    for unit, mark in (("[N] *", "*"), ("N 1)", "1"), ("(N) **", "**")):
        table = read_lab_file(_file(tmp_path, "Time", "Displacement", "Force", units=f"s;mm;{unit}"))
        _is_force(table)
        assert f'"Force": the mark "{mark}" of a footnote is passed by' in table.notes
    _is_force(read_lab_file(_file(tmp_path, "Time", "Displacement", "Force", units="[s];[mm];[N] Zelle 2")))


def test_a_footnote_that_changes_the_readings_is_asked_about(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"half of the cell's reading.*states a factor"):
        _read(tmp_path, "Force (N)¹", below="\n¹ half of the cell's reading")
    with pytest.raises(InputError, match="states a factor"):
        _read(tmp_path, "Force (N)*", above="* values x10")
    with pytest.raises(InputError, match="--units force=mN or --units force=N"):
        _read(tmp_path, "Force (N)*", below="\n* in mN")
    _is_force(_read(tmp_path, "Force (N)*", Reading(units={"force": "2 N"}), below="\n* half of the cell's reading"), 2.0)


def test_times_a_number_is_of_the_column_with_the_mark_and_not_of_the_clock(tmp_path: Path) -> None:
    names = ("Time (s)", "Displacement (mm)*", "Force (N)**")
    with pytest.raises(InputError) as caught:
        read_lab_file(_file(tmp_path, *names, below="\n* as shown\n** times 10"))
    assert [fault.column for fault in caught.value.faults] == [3]
    with pytest.raises(InputError) as caught:
        _read(tmp_path, "Force (N)", above="values times 10")
    assert [fault.column for fault in caught.value.faults] == [3]


def test_a_star_at_a_symbol_may_be_a_part_of_it() -> None:
    assert understand("C*", "pF") is None
    assert understand("C* (pF)") is None


def test_a_power_of_a_name_is_no_footnote(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="a function of a reading"):
        _read(tmp_path, "Force² (N)")


# -------------------------------------------------------------------------------------------------- factors, asked for once


@pytest.mark.parametrize("name", ["Force*10 (N)", "Load (N) 2x", "Force/10 (N)", "Load 2x (N)", "Foo*10 (N)", "Force (N) x10"])
def test_a_factor_in_a_name_is_settled_by_what_the_first_advice_says(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError) as caught:
        _read(tmp_path, name)
    _is_force(_read(tmp_path, name, _typed(caught.value)))


@pytest.mark.parametrize("name", ["Force (N) at 23 (°C)", "Force (N) on sensor (2)", "Force [N] by channel [3]"])
def test_words_with_a_bracket_of_their_own_are_one_remark_for_whoever_names_the_column(tmp_path: Path, name: str) -> None:
    _is_force(_read(tmp_path, name, Reading(columns={"force": "3"})))


# ---------------------------------------------------------------------------------------------- remarks that change readings


@pytest.mark.parametrize(
    ("line", "quantity", "states"),
    [
        ("Displacement = gauge x 2", "displacement", "a factor"),
        ("Weg = Messuhr * 2", "displacement", "a factor"),
        ("Displacement is twice the gauge reading", "displacement", "a factor"),
        ("half of the cell's reading", "force", "a factor"),
        ("Kraft: die Hälfte der Anzeige", "force", "a factor"),
        ("Force: la moitié de la lecture", "force", "a factor"),
        ("Force scaling 2:1", "force", "a factor"),
        ("Correction: subtract 0.35 N from force", "force", "an offset"),
        ("Kraft: 0,35 N abziehen", "force", "an offset"),
        ("soustraire 0,35 N de la force", "force", "an offset"),
        ("0.2 mm to be added to the displacement: displacement", "displacement", "an offset"),
        ("Time in samples", "time", "counts"),
        ("Zeit in Abtastwerten", "time", "counts"),
        ("Force is in raw ADC counts", "force", "counts"),
    ],
)
def test_a_remark_that_changes_readings_is_asked_about_above_and_below(
    tmp_path: Path, line: str, quantity: str, states: str
) -> None:
    unit = {"displacement": "mm", "force": "N", "time": "s"}[quantity]
    for above, below in _places(line):
        with pytest.raises(InputError, match=f"states {states}.*--units {quantity}="):
            _read(tmp_path, "Force (N)", above=above, below=below)
        _is_force(_read(tmp_path, "Force (N)", Reading(units={quantity: unit}), above=above, below=below))


@pytest.mark.parametrize(
    "line",
    [
        "Gauge factor 2.1",
        "half of the specimens broke",
        "0.35 N was subtracted from force",
        "Number of samples: 500",
        "Force applied in steps",
        "Stress = F / 78.5",
        "Displacement = crosshead position",
        "half bridge",
        "Preload: add 0.5 N",
        "Displacement: add 0.1 mm per step",
        "Do not subtract 0.35 N from force",
    ],
)
def test_other_remarks_with_such_words_change_nothing(tmp_path: Path, line: str) -> None:
    _is_force(_read(tmp_path, "Force (N)", above=line))
    _is_force(_read(tmp_path, "Force (N)", below=f"\n{line}"))


# ------------------------------------------------------------------------------------------------ words that are passed by


@pytest.mark.parametrize("words", ["x", "left", "cell 2", "(rel.)"])
def test_words_behind_a_unit_that_are_passed_by_are_told(tmp_path: Path, words: str) -> None:
    table = _read(tmp_path, f"Load (N) {words}")
    _is_force(table)
    assert any(f'"{words.strip("()")}" behind its unit is passed by' in note for note in table.notes)


@pytest.mark.parametrize("words", ["", "measured", "raw", "at 23 °C", "max. 20 N", "± 0.01", "run 1"])
def test_words_that_are_known_to_change_nothing_are_not(tmp_path: Path, words: str) -> None:
    table = _read(tmp_path, f"Load (N) {words}".strip())
    _is_force(table)
    assert not any("behind its unit" in note for note in table.notes)


@pytest.mark.parametrize("name", ["Load (N) amplitude", "Force (N) p-p", "Force pk-pk (N)", "Kraft [N] Spitze-Spitze"])
def test_what_is_drawn_from_many_readings_is_no_force(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="is a statistic, no record"):
        _read(tmp_path, name)


def test_what_a_load_cell_is_fed_with_is_asked_about(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r'--columns "force=Load cell excitation .N.'):
        _read(tmp_path, "Load cell excitation (N)")


def test_a_rate_alone_is_held_against_the_times(tmp_path: Path) -> None:
    path = tmp_path / "lab.csv"
    rows = [f"{k};{row.split(';', 1)[1]}" for k, row in enumerate(ROWS)]
    for line, told in (("Rate: 10 Hz", True), ("Rate: 1 Hz", False), ("Sampling rate: 10 Hz", True)):
        path.write_text("\n".join([line, ";".join(NAMES), *rows]) + "\n", encoding="utf-8")
        notes = read_lab_file(path).notes
        assert any("the readings follow each other after 1 s" in note for note in notes) == told
