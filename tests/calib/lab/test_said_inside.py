"""What a container says beside its readings, at any depth, acts as a line above a table does, or is told as not read."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import openpyxl
import pytest
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter
from openpyxl.comments import Comment
from openpyxl.packaging.custom import StringProperty
from scipy.io import savemat
from turning_press import DIGITS, turning_press

from calib.errors import InputError
from calib.lab import LabTable, Reading, read_lab_file

PRESS = {q: np.round(v, DIGITS[q]) for q, v in turning_press(halves=60).columns.items()}
NAMES = {"time": "Time", "displacement": "Extension", "force": "Load", "capacitance": "Cap"}
UNITS = {"time": "s", "displacement": "mm", "force": "N", "capacitance": "pF"}
WHOLE = {f"{NAMES[q]}_{UNITS[q]}": PRESS[q] for q in ("time", "displacement", "force")}
WITH_CAP = {**WHOLE, "Cap_pF": PRESS["capacitance"]}
N_ROW = len(PRESS["time"])

#: What is said of a column, or of the whole file: keys and values, which may be blocks.
Said = Mapping[str, Any]


# --- what is said of the force -------------------------------------------------------------------------------------------


def tdms(path: Path, said: Said, *, of: str = "force", quantities: tuple[str, ...] = ("time", "displacement", "force")) -> Path:
    """A channel with its properties, as LabVIEW writes them, among those that it writes by itself."""
    own = {"NI_ChannelName": "Dev1/ai0", "NI_Scaling_Status": "unscaled", "monotony": "no"}
    with TdmsWriter(str(path)) as writer:
        channels = [
            ChannelObject("Press", NAMES[q], PRESS[q], properties={"unit_string": UNITS[q], **own, **(said if q == of else {})})
            for q in quantities
        ]
        writer.write_segment([RootObject(), GroupObject("Press"), *channels])
    return path


def json_channels(path: Path, said: Said) -> Path:
    """Channels of JSON, each with its name, its unit and its list."""
    channels = [
        {"name": NAMES[q], "unit": UNITS[q], "data": PRESS[q].tolist(), **(said if q == "force" else {})}
        for q in ("time", "displacement", "force")
    ]
    path.write_text(json.dumps({"channels": channels}), encoding="utf-8")
    return path


def json_objects(path: Path, said: Said) -> Path:
    """An object of JSON for each column."""
    columns = {
        NAMES[q]: {"unit": UNITS[q], "values": PRESS[q].tolist(), **(said if q == "force" else {})}
        for q in ("time", "displacement", "force")
    }
    path.write_text(json.dumps(columns), encoding="utf-8")
    return path


def mat_structs(path: Path, said: Said) -> Path:
    """A struct of MATLAB for each column."""
    columns = {
        NAMES[q]: {"unit": UNITS[q], "data": PRESS[q][:, None], **(said if q == "force" else {})}
        for q in ("time", "displacement", "force")
    }
    savemat(path, {"press": columns})
    return path


def mat_list(path: Path, said: Said) -> Path:
    """A list of structs of MATLAB, one for each column."""
    kinds = [(member, "O") for member in ("name", "unit", "data", *said)]
    rows = [
        (
            NAMES[q],
            UNITS[q],
            PRESS[q][:, None],
            *(value if q == "force" else 1.0 - ("Offset" in said) for value in said.values()),
        )
        for q in ("time", "displacement", "force")
    ]
    savemat(path, {"channels": np.array(rows, dtype=kinds)})
    return path


def mat_attributes(path: Path, said: Said) -> Path:
    """A file of version 7.3 whose arrays have attributes beside those of MATLAB."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in WHOLE.items():
            stored = file.create_dataset(name, data=values[None, :])
            stored.attrs["MATLAB_class"] = np.bytes_("double")
            for key, value in said.items() if name == "Load_N" else ():
                stored.attrs[key] = value
    return as_matlab(path)


def as_matlab(path: Path) -> Path:
    """The same with the words before it by which MATLAB's files are known."""
    data, head = path.read_bytes(), b"MATLAB 7.3 MAT-file, by hand".ljust(124) + b"\x00\x02IM"
    path.write_bytes(head + data[len(head) :])
    return path


def lvm(path: Path, said: Said) -> Path:
    """A file of LabVIEW's text format with a line for each word in the header of its segment, a value for each channel."""
    none = {"Offset": "0", "Comment": "", "Status": ""}
    of_channels = [f"{key}\t{none.get(key, '1')}\t{value}" for key, value in said.items()]
    return lvm_of(path, segment=of_channels)


def lvm_of(path: Path, *, header: list[str] | None = None, segment: list[str] | None = None) -> Path:
    lines = [
        "LabVIEW Measurement",
        "Writer_Version\t2",
        "Separator\tTab",
        "Decimal_Separator\t.",
        "X_Columns\tOne",
        "Time_Pref\tRelative",
        *(header or []),
        "Date\t2026/03/12",
        "Time\t10:04:07",
        "***End_of_Header***",
        "",
        "Channels\t2",
        f"Samples\t{N_ROW}\t{N_ROW}",
        "Y_Unit_Label\tmm\tN",
        *(segment or []),
        "X_Dimension\tTime\tTime",
        "***End_of_Header***",
        "X_Value\tExtension\tLoad\tComment",
        *(f"{t}\t{x}\t{f}\t" for t, x, f in zip(*(PRESS[q] for q in ("time", "displacement", "force")), strict=True)),
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


OF_FORCE: dict[str, Callable[[Path, Said], Path]] = {
    "a.tdms": tdms,
    "b.json": json_channels,
    "c.json": json_objects,
    "d.mat": mat_structs,
    "e.mat": mat_list,
    "f.mat": mat_attributes,
    "g.lvm": lvm,
}


def refusal(path: Path, **said: Any) -> str:
    with pytest.raises(InputError) as refused:
        read_lab_file(path, Reading(**said))
    return str(refused.value)


def is_press(table: LabTable, force: float = 1.0) -> str:
    """All that is told, of a table that holds the press."""
    np.testing.assert_allclose(table.columns["displacement"], PRESS["displacement"] * 1e-3, atol=1e-12)
    np.testing.assert_allclose(table.columns["force"], PRESS["force"] * force, atol=1e-12)
    return " | ".join((*table.notes, *map(str, table.unread)))


FACTORS = ({"Gain": 10.0}, {"scale": 0.001}, {"Faktor": 0.1}, {"Slope": 2.5}, {"Offset": 0.5}, {"Verstärkung": 10.0})


def _may_be_a_field(name: str, key: str) -> bool:
    """Whether scipy can write a field of that name."""
    return key.isascii() or name not in ("d.mat", "e.mat")


@pytest.mark.parametrize(("name", "said"), [(n, said) for n in OF_FORCE for said in FACTORS if _may_be_a_field(n, *said)])
def test_a_factor_or_an_offset_of_a_channel_is_refused_and_settled_by_its_unit(
    tmp_path: Path, name: str, said: dict[str, float]
) -> None:
    ((key, value),) = said.items()
    path = OF_FORCE[name](tmp_path / name, said)
    message = refusal(path)
    assert f'"{key}" of "Load' in message
    assert f"of {value:g}: the readings" in message
    told = is_press(read_lab_file(path, Reading(units={"force": "N"})))
    assert key in told
    is_press(read_lab_file(path, Reading(units={"force": f"{value} N"})), value)


@pytest.mark.parametrize("name", OF_FORCE)
@pytest.mark.parametrize(
    "words", ["in mN", "force in mN, not N", "Kraft in mN", "multiply by 10", "readings are doubled", "sign inverted"]
)
def test_words_beside_a_channel_act_as_they_do_above_a_table(tmp_path: Path, name: str, words: str) -> None:
    path = OF_FORCE[name](tmp_path / name, {"Comment": words})
    assert f"Comment {words}" in " ".join(refusal(path).split())
    is_press(read_lab_file(path, Reading(units={"force": "N"})))


@pytest.mark.parametrize("name", OF_FORCE)
@pytest.mark.parametrize("words", ["not connected", "overload", "load cell U9C, 50 N"])
def test_other_words_beside_a_channel_are_told(tmp_path: Path, name: str, words: str) -> None:
    told = is_press(read_lab_file(OF_FORCE[name](tmp_path / name, {"Status": words})))
    assert f"Status {words}" in told or f"status {words}" in told


UNIT_KEYS = ("Unit", "Units", "unit_label", "Einheit", "unité")


@pytest.mark.parametrize(
    ("name", "key"),
    [(n, key) for n in OF_FORCE if n not in ("e.mat", "g.lvm") for key in UNIT_KEYS if _may_be_a_field(n, key)],
)
def test_a_channel_with_two_units_that_differ_has_none(tmp_path: Path, name: str, key: str) -> None:
    path = OF_FORCE[name](tmp_path / name, {key: "kN"})
    if name == "f.mat":  # the name has the other
        assert "kN" in refusal(path)
        return
    assert 'unknown unit "N or kN"' in refusal(path)
    told = is_press(read_lab_file(path, Reading(units={"force": "N"})))
    assert 'channel "Load" states two units, N and kN' in told
    is_press(read_lab_file(OF_FORCE[name](tmp_path / name, {key: "newton"})))


@pytest.mark.parametrize("name", OF_FORCE)
@pytest.mark.parametrize("said", [{"Gain": 1.0}, {"Offset": 0.0}, {"Range": "50 N"}, {"Sensitivity": "2 mV/V"}], ids=str)
def test_what_changes_no_reading_refuses_none(tmp_path: Path, name: str, said: Said) -> None:
    is_press(read_lab_file(OF_FORCE[name](tmp_path / name, said)))


def test_what_is_said_of_another_channel_does_not_act_on_the_force(tmp_path: Path) -> None:
    said = {"Gain": 100.0, "Offset": 2.0, "Comment": "in um", "Unit": "pF"}
    quantities = ("time", "displacement", "force", "capacitance")
    path = tdms(tmp_path / "a.tdms", said, of="capacitance", quantities=quantities)
    told = is_press(read_lab_file(path, Reading(columns={"capacitance": "none"})))
    assert "Cap Gain 100.0" in told
    assert '"Gain" of "Cap"' in refusal(path)
    path = tdms(tmp_path / "b.tdms", {"mode": "Cs-D"}, of="capacitance", quantities=quantities)
    assert "series capacitance" in refusal(path)
    path = tdms(tmp_path / "c.tdms", {"model": "Series 2580"}, of="force", quantities=quantities)
    is_press(read_lab_file(path))


def test_what_programs_write_for_themselves_is_quiet_and_hundreds_of_properties_are_told_shortly(tmp_path: Path) -> None:
    assert "NI_" not in is_press(read_lab_file(tdms(tmp_path / "a.tdms", {})))
    many = {f"Property {k}": f"value{k}" for k in range(400)}
    table = read_lab_file(tdms(tmp_path / "b.tdms", {**many, "Remark": "cell not connected"}))
    told = is_press(table)
    assert "400 more properties" in told
    assert "Remark cell not connected" in told
    assert len(told) < 2000
    assert '"Gain" of "Load"' in refusal(tdms(tmp_path / "c.tdms", {"Gain": 10.0, **many}))


# --- what is said of the whole -------------------------------------------------------------------------------------------


def _written(path: Path, document: Any) -> Path:
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def _lists(columns: Mapping[str, np.ndarray]) -> dict[str, list[float]]:
    return {name: values.tolist() for name, values in columns.items()}


def _rows(columns: Mapping[str, np.ndarray]) -> list[dict[str, float]]:
    return [dict(zip(columns, row, strict=True)) for row in zip(*_lists(columns).values(), strict=True)]


def json_beside(path: Path, said: Said, columns: Mapping[str, np.ndarray]) -> Path:
    return _written(path, {"meta": {"lab": {"run": 3, **said}}, "data": _lists(columns)})


def json_beside_columns(path: Path, said: Said, columns: Mapping[str, np.ndarray]) -> Path:
    return _written(path, {"settings": dict(said), **_lists(columns)})


def json_beside_rows(path: Path, said: Said, columns: Mapping[str, np.ndarray]) -> Path:
    return _written(path, {"info": dict(said), "rows": _rows(columns)})


def json_beside_named_rows(path: Path, said: Said, columns: Mapping[str, np.ndarray]) -> Path:
    rows = [list(row.values()) for row in _rows(columns)]
    return _written(path, {"columns": list(columns), "rows": rows, "attrs": dict(said)})


def json_in_a_list(path: Path, said: Said, columns: Mapping[str, np.ndarray]) -> Path:
    lines = [{key: value} if isinstance(value, (dict, float)) else f"{key}: {value}" for key, value in said.items()]
    return _written(path, {"notes": ["by hand", *lines], "data": _lists(columns)})


def json_line_by_line(path: Path, said: Said, columns: Mapping[str, np.ndarray]) -> Path:
    path.write_text("\n".join(map(json.dumps, ({"meta": dict(said)}, *_rows(columns)))) + "\n", encoding="utf-8")
    return path


def mat_beside(path: Path, said: Said, columns: Mapping[str, np.ndarray]) -> Path:
    savemat(path, {**{name: values[:, None] for name, values in columns.items()}, "info": {"lab": dict(said)}})
    return path


def mat_above(path: Path, said: Said, columns: Mapping[str, np.ndarray]) -> Path:
    savemat(path, {"test": {"raw": {name: values[:, None] for name, values in columns.items()}}, **said})
    return path


def mat_73(path: Path, said: Said, columns: Mapping[str, np.ndarray]) -> Path:
    def put(group: h5py.Group, members: Said) -> None:
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for key, value in members.items():
            if isinstance(value, dict):
                put(group.create_group(key), value)
                continue
            data = np.array([[ord(c)] for c in value], np.uint16) if isinstance(value, str) else np.array([[value]])
            group.create_dataset(key, data=data).attrs["MATLAB_class"] = np.bytes_(
                "char" if isinstance(value, str) else "double"
            )

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in columns.items():
            file.create_dataset(name, data=values[None, :]).attrs["MATLAB_class"] = np.bytes_("double")
        put(file.create_group("settings"), said)
    return as_matlab(path)


def tdms_settings(path: Path, said: Said, columns: Mapping[str, np.ndarray]) -> Path:
    """A group without channels, beside the one that has them."""
    flat = {
        f"{key} {inner}": one
        for key, value in said.items()
        for inner, one in (value.items() if isinstance(value, dict) else ())
    }
    flat |= {key: value for key, value in said.items() if not isinstance(value, dict)}
    with TdmsWriter(str(path)) as writer:
        channels = [ChannelObject("Press", name, values) for name, values in columns.items()]
        writer.write_segment([RootObject(), GroupObject("Press"), GroupObject("Settings", properties=flat), *channels])
    return path


OF_ALL: dict[str, Callable[[Path, Said, Mapping[str, np.ndarray]], Path]] = {
    "a.json": json_beside,
    "b.json": json_beside_columns,
    "c.json": json_beside_rows,
    "d.json": json_beside_named_rows,
    "e.json": json_in_a_list,
    "f.jsonl": json_line_by_line,
    "g.mat": mat_beside,
    "h.mat": mat_above,
    "i.mat": mat_73,
    "j.tdms": tdms_settings,
}


@pytest.mark.parametrize("name", OF_ALL)
@pytest.mark.parametrize(
    "said",
    [
        {"remark": "force in mN, not N"},
        {"load_gain": 10.0},
        {"loadGain": 10.0},
        {"scale": {"Load": 10.0}},
        {"scale": {"Load_N": 10.0}},
        {"Bemerkung": "Kraft mal 10"},
        {"remark": "Kraft und Weg vertauscht"},
    ],
    ids=str,
)
def test_words_in_a_block_act_as_they_do_above_a_table(tmp_path: Path, name: str, said: Said) -> None:
    path = OF_ALL[name](tmp_path / name, said, WHOLE)
    assert '"Load_N"' in refusal(path)
    settled = Reading(units={"force": "N"}, columns={"force": "Load_N", "displacement": "Extension_mm"})
    is_press(read_lab_file(path, settled))


@pytest.mark.parametrize("name", OF_ALL)
def test_other_words_in_a_block_are_told(tmp_path: Path, name: str) -> None:
    told = is_press(read_lab_file(OF_ALL[name](tmp_path / name, {"remark": "cell not connected", "operator": "lab"}, WHOLE)))
    assert "cell not connected" in told
    assert "sensor" not in told


@pytest.mark.parametrize("name", [name for name in OF_ALL if name not in ("e.json", "f.jsonl")])
def test_a_series_circuit_in_a_block_acts(tmp_path: Path, name: str) -> None:
    assert "is a series capacitance" in refusal(OF_ALL[name](tmp_path / name, {"lcr": {"mode": "Cs-D"}}, WITH_CAP))
    table = read_lab_file(OF_ALL[name](tmp_path / f"2{name}", {"lcr": {"mode": "Cp-D"}}, WITH_CAP))
    np.testing.assert_allclose(table.columns["capacitance"], PRESS["capacitance"] * 1e-12)


ORDINARY = {
    "sensor": {"thickness_mm": 0.74, "radius_mm": 10.0, "material": "Ecoflex 00-30"},
    "indenter": {"radius_mm": 5.0, "material": "steel"},
    "machine": {"model": "5943", "load_cell": {"capacity_N": 50.0, "serial": "20331", "calibrated": "2025-03-02"}},
    "lcr": {"frequency_Hz": 1000.0, "mode": "Cp-D", "averaging": 4.0},
    "camera": {"scale": 0.05},
    "amplifier": {"gain": 1.0, "offset": 0.0},
}


@pytest.mark.parametrize("name", [name for name in OF_ALL if name != "j.tdms"])
def test_an_ordinary_description_of_a_test_refuses_nothing(tmp_path: Path, name: str) -> None:
    is_press(read_lab_file(OF_ALL[name](tmp_path / name, ORDINARY, WITH_CAP)))


@pytest.mark.parametrize("write", [json_beside, mat_beside, mat_73])
def test_units_of_columns_are_taken_from_a_block_at_any_depth(tmp_path: Path, write: Any) -> None:
    columns = {"t": PRESS["time"], "x": PRESS["displacement"], "F": PRESS["force"]}
    ending = ".json" if write is json_beside else ".mat"
    is_press(read_lab_file(write(tmp_path / f"a{ending}", {"units": {"t": "s", "x": "mm", "F": "N"}}, columns)))


def test_columns_may_be_described_in_blocks_beside_them(tmp_path: Path) -> None:
    quantities = ("time", "displacement", "force")
    blocks = [{"name": NAMES[q], "unit": UNITS[q], "sensor": f"no {k}"} for k, q in enumerate(quantities)]
    rows = [list(row) for row in zip(*(PRESS[q].tolist() for q in quantities), strict=True)]
    lists = {NAMES[q]: PRESS[q].tolist() for q in quantities}
    by_name = {block["name"]: {"unit": block["unit"], "sensor": block["sensor"]} for block in blocks}
    for document in ({"columns": blocks, "data": rows}, {"columns": by_name, "data": lists}, {"head": blocks, **lists}):
        assert "sensor no 2" in is_press(read_lab_file(_written(tmp_path / "a.json", document)))
    gain = [*blocks[:2], {**blocks[2], "gain": 10}]
    assert "states a factor of 10" in refusal(_written(tmp_path / "b.json", {"columns": gain, "data": rows}))


def test_a_list_of_factors_beside_rows_is_a_row_of_them(tmp_path: Path) -> None:
    rows = [list(row.values()) for row in _rows(WHOLE)]
    for key, own in (("factors", [1, 1, 10]), ("scale", [1, 1, 0.1])):
        path = _written(tmp_path / "a.json", {"columns": list(WHOLE), "rows": rows, key: own})
        assert f'"{key}" in line 1 states a factor' in refusal(path)
        is_press(read_lab_file(path, Reading(units={"force": "N"})))
    savemat(tmp_path / "a.mat", {**{name: values[:, None] for name, values in WHOLE.items()}, "gains": [1.0, 1.0, 10.0]})
    assert '"gains" in line 1 states a factor' in refusal(tmp_path / "a.mat")


def test_words_in_as_many_rows_as_readings_are_a_column(tmp_path: Path) -> None:
    path = _written(tmp_path / "a.json", {**_lists(WHOLE), "state": ["in"] * 60 + ["out"] * (N_ROW - 60)})
    assert 'column 4 "state"' in is_press(read_lab_file(path))


def test_a_channel_is_called_by_the_name_that_is_understood(tmp_path: Path) -> None:
    channels = {
        f"ch{k}": {"name": NAMES[q], "unit": UNITS[q], "data": PRESS[q].tolist()}
        for k, q in enumerate(("time", "displacement", "force"))
    }
    table = read_lab_file(_written(tmp_path / "a.json", channels))
    is_press(table)
    assert table.sources["force"] == "Load (N)"


# --- LabVIEW's text, and lines that name their values --------------------------------------------------------------------


@pytest.mark.parametrize("tag", ["Description", "Notes", "Project", "UUT_Remark"])
def test_the_header_of_an_lvm_file_acts_as_lines_above_a_table_do(tmp_path: Path, tag: str) -> None:
    path = lvm_of(tmp_path / "a.lvm", header=[f"{tag}\tforce is in mN"])
    assert "a.lvm:7" in refusal(path) or "line 7" in refusal(path)
    is_press(read_lab_file(path, Reading(units={"force": "N"})))
    told = is_press(read_lab_file(lvm_of(tmp_path / "b.lvm", header=[f"{tag}\tcell not connected", "Operator\tlab"])))
    assert f"{tag} cell not connected" in told


def test_a_line_of_a_segment_with_one_value_is_of_all_its_channels_or_of_the_one_above_which_it_stands(tmp_path: Path) -> None:
    assert '"Gain 10" states a factor' in refusal(lvm_of(tmp_path / "a.lvm", segment=["Gain\t10"]))
    assert "mN" in refusal(lvm_of(tmp_path / "b.lvm", segment=["Comment\t\tin mN"]))
    assert '"Scale factor" of "Load"' in refusal(lvm_of(tmp_path / "c.lvm", segment=["Scale factor\t1\t10"]))
    block = ["***Start_Special***", "gain\t10", "***End_Special***"]
    assert "1 special block(s)" in is_press(read_lab_file(lvm_of(tmp_path / "d.lvm", segment=block)))


@pytest.mark.parametrize("words", ["NB force in mN, not N", "Load gain: 10"])
def test_lines_above_rows_that_name_their_values_act(tmp_path: Path, words: str) -> None:
    rows = (f"t_s:{t} x_mm:{x} force_N:{f}" for t, x, f in zip(*WHOLE.values(), strict=True))
    path = tmp_path / "a.txt"
    path.write_text("\n".join([words, *rows]) + "\n", encoding="utf-8")
    assert words in refusal(path)
    is_press(read_lab_file(path, Reading(units={"force": "N"})))


# --- workbooks -----------------------------------------------------------------------------------------------------------


def xlsx(path: Path, on_names: Mapping[int, str], *, description: str = "", custom: str = "") -> Path:
    """A workbook with comments on its names, by column, and with properties."""
    book = openpyxl.Workbook()
    sheet = book.active
    assert sheet is not None
    sheet.append([f"{NAMES[q]} ({UNITS[q]})" for q in UNITS])
    for row in zip(*(PRESS[q].tolist() for q in UNITS), strict=True):
        sheet.append(row)
    for column, words in on_names.items():
        sheet.cell(1, column).comment = Comment(words, "lab")
    book.properties.description = description
    if custom:
        book.custom_doc_props.append(StringProperty(name="Remark", value=custom))
    book.save(path)
    return path


def test_a_comment_on_a_name_is_of_its_column_alone(tmp_path: Path) -> None:
    path = xlsx(tmp_path / "a.xlsx", {3: "Gain 10"})
    assert '"Gain 10" in line 1 states a factor' in refusal(path)
    is_press(read_lab_file(path, Reading(units={"force": "N"})))
    path = xlsx(tmp_path / "b.xlsx", {4: "Gain 10"})
    assert 'column "Cap (pF)"' in refusal(path)
    assert 'column "Load (N)"' not in refusal(path)


def test_all_comments_of_a_few_are_quoted(tmp_path: Path) -> None:
    told = is_press(read_lab_file(xlsx(tmp_path / "a.xlsx", {1: "by hand", 3: "cell not connected"})))
    assert '"by hand" on cell A1, "cell not connected" on cell C1' in told


@pytest.mark.parametrize("custom", [False, True])
def test_properties_of_a_workbook_act_if_they_speak_of_the_readings(tmp_path: Path, custom: bool) -> None:
    def with_property(name: str, words: str) -> Path:
        return xlsx(tmp_path / name, {}, description="" if custom else words, custom=words if custom else "")

    path = with_property("a.xlsx", "force in mN, not N")
    assert "mN" in refusal(path)
    is_press(read_lab_file(path, Reading(units={"force": "N"})))
    assert "cell not connected" in is_press(read_lab_file(with_property("b.xlsx", "cell not connected")))
    assert "foam" not in is_press(read_lab_file(with_property("c.xlsx", "press of a foam, by the lab")))
