"""The draft of an experiment file, and which files it is made from: nothing is dropped without a word, nothing is guessed."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

from calib.catalogue import UNKNOWNS
from calib.errors import Choice, Fault, InputError
from calib.experiment.draft import experiment_text
from calib.experiment.edits import MARK, unedited_lines
from calib.experiment.experiment_file import read_experiment
from calib.experiment.lab_files import Found, Looked, look_through, said
from calib.experiment.pairing import pair
from calib.experiment.presses import Press, Pressed
from calib.experiment.sweeps import read_sweeps
from calib.experiment.toml_places import locate_keys
from calib.lab import LabTable, Reading, Unread

TESTER = "Time (s),Extension (mm),Load (N)\n"
LCR = "Time (s),Cp (pF),D\n"


def _press(scale: float = 1.0, start: float = 0.0) -> str:
    x = np.concatenate([np.linspace(-0.1, 0.6, 60), np.linspace(0.6, -0.1, 60)[1:]])
    force = scale * np.maximum(x, 0) ** 1.5 * 8 + 0.003 * np.sin(37.0 * np.arange(x.size))
    return "".join(f"{start + 0.1 * i:.2f},{d:.5f},{f:.4f}\n" for i, (d, f) in enumerate(zip(x, force, strict=True)))


def _log(c0: float = 97.3) -> str:
    x = np.concatenate([np.linspace(-0.1, 0.6, 60), np.linspace(0.6, -0.1, 60)])
    return "".join(f"{0.1 * i:.2f},{c0 + 3 * max(v, 0) ** 2:.4f},0.0012\n" for i, v in enumerate(x))


def _folder(tmp_path: Path) -> Path:
    """What a lab leaves in a folder."""
    lab = tmp_path / "lab"
    for folder in ("lcr", ".git", "empty", "run1"):
        (lab / folder).mkdir(parents=True)
    texts = {
        "s1_press.csv": TESTER + _press(),
        "lcr/S1 Kapazität.txt": LCR + _log(),
        "s2_press.csv": TESTER + _press(1.1),
        "s2_press copy.csv": TESTER + _press(1.1),
        "both.csv": TESTER + _press() + "\n" + TESTER + _press(2.0),
        "twice.csv": "Time (s),Extension (mm),Load (N),Load (N)\n"
        + "".join(f"{line},{line.split(',')[2]}9\n" for line in _press(1.2).splitlines()),
        "thicknesses.csv": "specimen,thickness\nA1,0.74\n",
        "temperature.csv": "Time (s),Temp (°C)\n0,20\n1,21\n",
        "notes.txt": "dear diary\n",
        "empty.csv": "",
        ".DS_Store": "x",
        "run1/run.json": "{}",
        "run1/summary.csv": "parameter,unit\n",
        "earlier.toml": '[[specimens]]\nname = "a"\n',
        "rows.csv": "time_s,displacement_m,force_N,branch,cycle,used,reason\n0,0,0,loading,1,True,\n",
        "curve.csv": "displacement_m,force_N,contact_radius_m,capacitance_F,capacitance_change\n0,0,0,0,0\n",
    }
    for name, text in texts.items():
        (lab / name).write_text(text, encoding="utf-8")
    for name in ("paper.PDF", "photo.png", "strange.bin"):
        (lab / name).write_bytes(bytes(range(256)))
    return lab


def test_every_file_of_a_folder_is_accounted_for(tmp_path: Path) -> None:
    lab = _folder(tmp_path)
    looked, own = look_through([lab])
    assert {p.name for p in own} == {"run1", "earlier.toml", "rows.csv", "curve.csv"}
    left_out = {f.shown: f.left_out[0] for f in looked if f.left_out}
    assert left_out.keys() == {
        *(".DS_Store", ".git/", "empty/", "empty.csv", "notes.txt", "paper.PDF", "photo.png", "strange.bin"),
        *("temperature.csv", "thicknesses.csv"),
    }
    assert (left_out[".DS_Store"], left_out[".git/"], left_out["photo.png"]) == (
        "a hidden file",
        "a hidden folder",
        "a picture",
    )
    assert left_out["empty/"] == "an empty folder"
    assert "PDF" in left_out["paper.PDF"]
    read = {f.shown: len(f.records) for f in looked if f.records}
    assert read == {
        **dict.fromkeys(("s1_press.csv", "lcr/S1 Kapazität.txt", "s2_press.csv", "s2_press copy.csv", "twice.csv"), 1),
        "both.csv": 2,
    }
    seen = {f.shown.split("/")[0] for f in looked} | {p.name for p in own}
    assert seen == {p.name for p in lab.iterdir()}
    assert [f.note for f in looked if f.note] == [
        "the same bytes as s2_press copy.csv: if it is a copy, leave it out, or one press is counted twice"
    ]


def test_a_draft_of_a_folder_can_be_read_and_has_a_mark_on_all_that_decides(tmp_path: Path) -> None:
    lab = _folder(tmp_path)
    looked, _ = look_through([lab])
    text = experiment_text(pair([r for f in looked for r in f.records]), tmp_path, looked)
    (tmp_path / "experiment.toml").write_text(text, encoding="utf-8")
    data = tomllib.loads(text)
    experiment = read_experiment(tmp_path / "experiment.toml")
    assert [s.name for s in experiment.specimens] == ["both 1", "both 2", "s1", "s2 copy", "s2", "twice"]
    assert data["specimens"][2]["capacitance"] == "lab/lcr/S1 Kapazität.txt"
    assert len(experiment.unedited) == text.count(MARK)
    whats = [u.what for u in experiment.unedited]
    for what in (
        *("indenter radius", "friction_coefficient", "sensor radius", "electrode_radius", "padding material", "young_modulus"),
        *(
            "relative_permittivity",
            "parasitic_capacitance",
            "machine_compliance",
            "base",
        ),
        "force",
    ):
        assert whats.count(what) == 1, what
    for what in ("sensor_thickness", "padding_thickness", "dielectric_thickness"):
        assert whats.count(what) == 6, what
    for f in looked:
        assert all(reason.split(":")[0] in text for reason in f.left_out), f.shown
    assert max(map(len, text.splitlines())) < 150


def test_guesses_of_a_draft_are_the_documented_defaults() -> None:
    text = experiment_text([Pressed("a", (Press(_found("a.csv"), _found("a.csv")),))], Path("/lab"))
    priors = tomllib.loads(text)["priors"]
    for name in ("young_modulus", "machine_compliance", "relative_permittivity", "parasitic_capacitance"):
        assert priors[name] == tomllib.loads(f"x = {UNKNOWNS[name].default}")["x"]


def test_without_capacitance_nothing_is_asked_that_only_matters_for_it(tmp_path: Path) -> None:
    (tmp_path / "press.csv").write_text(TESTER + _press())
    looked, _ = look_through([tmp_path / "press.csv"])
    text = experiment_text(pair(looked[0].records), tmp_path)
    assert not any(word in text for word in ("permittivity", "parasitic", "electrode_radius", "dielectric_thickness"))


def test_a_named_file_is_refused_with_its_faults_and_one_lying_there_with_a_reason(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("dear diary\n")
    (named,), _ = look_through([tmp_path / "notes.txt"])
    assert named.named
    assert named.faults
    (lying,), _ = look_through([tmp_path])
    assert not lying.named
    (tmp_path / "none").mkdir()
    with pytest.raises(InputError, match="no file in this folder"):
        look_through([tmp_path / "none"])


def test_one_specimen_that_cannot_be_read_does_not_take_the_others_with_it(tmp_path: Path) -> None:
    broken = _press().replace("0.5", "oops", 1)
    (tmp_path / "both.csv").write_text(TESTER + _press() + "\n" + TESTER + broken)
    (file,), _ = look_through([tmp_path])
    assert [r.reading.specimen for r in file.records] in ([1], [])
    assert file.left_out


# --- what a file leaves open ----------------------------------------------------------------------------------------------


def _found(name: str, *open: Fault, notes: tuple[str, ...] = (), unread: tuple[Unread, ...] = ()) -> Found:
    values = {c: np.arange(9.0) for c in ("time", "displacement", "force", "capacitance")}
    rows = np.arange(2, 11)
    sources = {c: c for c in values}
    table = LabTable(
        Path("/lab") / name, name, "LCR log", "", "utf-8", ",", ".", values, sources, rows, ("",) * 9, notes, unread
    )
    return Found(table, open=open, notes=notes)


def _choice(option: str, key: str, *alternatives: str) -> Fault:
    return Fault(f"{option} is open", choice=Choice(option, alternatives, key))


@pytest.mark.parametrize(
    ("option", "key", "alternatives", "reading"),
    [
        ("where", "Frequency (Hz)", ("1000", "10000"), Reading(where={"Frequency (Hz)": "1000"})),
        ("columns", "capacitance", ("CH0 (pF)", "CH1 (pF)"), Reading(columns={"capacitance": "CH0 (pF)"})),
        ("units", "force", ("N", "mN"), Reading(units={"force": "N"})),
        ("sheet", "", ("Tab 1", 'a "b"\\'), Reading(sheet="Tab 1")),
        ("sign", "force", ("compression positive", "compression negative"), Reading(sign={"force": "compression positive"})),
        ("decimal", "", (",", "."), Reading(decimal=",")),
        ("scale", "", ("micro",), Reading(scale="micro")),
        ("specimen", "", ("1", "2"), Reading(specimen=1)),
    ],
)
def test_a_choice_is_written_as_lines_that_take_the_place_of_the_files(
    option: str, key: str, alternatives: tuple[str, ...], reading: Reading
) -> None:
    fault = _choice(option, key, *alternatives)
    assert fault.choice is not None
    assert said(Reading(), fault.choice, alternatives[0]) == reading
    record = _found("a.csv", fault)
    text = experiment_text([Pressed("a", (Press(record, None),))], Path("/lab"))
    (marked,) = (line for line in text.splitlines() if f"{MARK} choose" in line)
    assert marked == f'force = "a.csv"   {MARK} choose {option}, one of the lines above'
    assert f"{option} is open" in text
    offered = [
        line[4:]
        for line in text.splitlines()
        if line.startswith("#   force = { file = ") and option in line and "a.csv" in line
    ]
    assert len(offered) == len(alternatives)
    for line, value in zip(offered, alternatives, strict=True):
        force = tomllib.loads(line)["force"]
        wanted = int(value) if option == "specimen" else value
        assert force == {"file": "a.csv", option: {key: wanted} if key else wanted}


def test_a_file_without_units_is_paired_and_its_units_are_asked_for_and_not_guessed(tmp_path: Path) -> None:
    (tmp_path / "s1_press.csv").write_text(TESTER + _press())
    (tmp_path / "s1_cap.csv").write_text("Zeit;Cp;D\n" + _log().replace(",", ";").replace(".", ","))
    looked, _ = look_through([tmp_path])
    text = experiment_text(pair([record for file in looked for record in file.records]), tmp_path, looked)
    asked = 'capacitance = { file = "s1_cap.csv", units = { time = "s", capacitance = "pF" } }'
    assert f"#   {asked}" in text
    assert "units of capacitance may also be nF, fF, F" in text
    (tmp_path / "as_drafted.toml").write_text(text)
    with pytest.raises(InputError, match="has no unit"):
        read_sweeps(read_experiment(tmp_path / "as_drafted.toml"))
    (line,) = (line for line in text.splitlines() if line.startswith("capacitance = "))
    (tmp_path / "chosen.toml").write_text(text.replace(line, asked))
    (sweep,) = read_sweeps(read_experiment(tmp_path / "chosen.toml"))
    assert np.median(sweep.channels["capacitance"].value) == pytest.approx(97.3e-12, rel=0.02)


def test_several_things_that_are_open_are_offered_together_and_many_are_cut_short() -> None:
    channels = tuple(f"CH{k} (pF)" for k in range(32))
    record = _found("a.csv", _choice("columns", "capacitance", *channels), _choice("where", "Range", "1", "2", "3"))
    text = experiment_text([Pressed("a", (Press(None, record),))], Path("/lab"))
    assert text.count("CH0 (pF)") == 1
    assert '#   capacitance = { file = "a.csv", columns = { capacitance = "CH0 (pF)" }, where = { Range = "1" } }' in text
    assert "CH31 (pF)" in text
    assert "where of Range may also be 2, 3" in text


def test_notes_and_unread_columns_stand_above_the_line_of_the_file() -> None:
    unread = (Unread('column 4 "T (°C)"', "a temperature"), Unread("lines 1 to 7", "above\nthe header \x07"))
    record = _found("a.csv", notes=("Cs converted to Cp",), unread=unread)
    lines = experiment_text([Pressed("a", (Press(record, record),))], Path("/lab")).splitlines()
    at = lines.index('force = "a.csv"')
    assert lines[at - 4 : at + 2] == [
        "# a.csv: LCR log",
        "#   note: Cs converted to Cp",
        '#   not used: column 4 "T (°C)": a temperature',
        "#   not used: lines 1 to 7: above the header",
        'force = "a.csv"',
        'capacitance = "a.csv"',
    ]


def test_what_a_file_says_cannot_break_the_draft_or_pass_for_a_mark() -> None:
    hostile = f'x = " ] \r\n {MARK} y\x00 = 1'
    record = _found('a"\\\n.csv', notes=(hostile,), unread=(Unread(hostile, hostile),))
    looked = [Looked(Path(f"/lab/b = 1 {MARK} c"), "b", left_out=(hostile,))]
    plain = experiment_text([Pressed("a", (Press(_found("a.csv"), None),))], Path("/lab"))
    text = experiment_text([Pressed('s"\\', (Press(record, None),))], Path("/lab"), looked)
    data = tomllib.loads(text)
    assert data["specimens"][0]["name"] == 's"\\'
    assert data["specimens"][0]["force"] == 'a"\\\n.csv'
    assert len(unedited_lines(text, data, locate_keys(text))) == plain.count(MARK)


def test_the_radius_that_names_tell_of_a_ball_stands_in_the_draft_to_be_checked(tmp_path: Path) -> None:
    for name in ("s1_r5", "s1_R8mm", "s2 ball 3mm", "s2 ball 5mm"):
        (tmp_path / f"{name}_press.csv").write_text(TESTER + _press())
        (tmp_path / f"{name}_lcr.csv").write_text(LCR + _log())
    looked, _ = look_through([tmp_path])
    text = experiment_text(pair([record for file in looked for record in file.records]), tmp_path, looked)
    data = tomllib.loads(text)
    radii = {s["name"]: [sweep.get("indenter_radius") for sweep in s["sweeps"]] for s in data["specimens"]}
    assert radii == {"s1": ["5 mm", "8 mm"], "s2": [None, None]}
    left = [u for u in unedited_lines(text, data, locate_keys(text)) if u.what == "indenter_radius"]
    assert [u.of for u in left] == ["s1", "s1", "s2", "s2"]
    done = text.replace(f'indenter_radius = "8 mm"   {MARK}', 'indenter_radius = "8 mm"   # measured:')
    assert len(unedited_lines(done, tomllib.loads(done), locate_keys(done))) == text.count(MARK) - 1


def test_a_ball_that_the_name_of_a_specimen_may_tell_is_open_until_it_is_decided(tmp_path: Path) -> None:
    for name in ("sensor r5", "sensor r8"):
        (tmp_path / f"{name} press.csv").write_text(TESTER + _press())
    looked, _ = look_through([tmp_path])
    text = experiment_text(pair([record for file in looked for record in file.records]), tmp_path, looked)

    def left(changed: str) -> list[str]:
        data = tomllib.loads(changed)
        return [u.of for u in unedited_lines(changed, data, locate_keys(changed)) if u.what == "indenter_radius"]

    assert left(text) == ["sensor r5", "sensor r8"]
    first, second = [line for line in text.splitlines() if "indenter_radius" in line]
    decided = text.replace(first, 'indenter_radius = "5 mm"').replace(f"{second}\n", "")
    assert left(decided) == []
    assert [s.get("indenter_radius") for s in tomllib.loads(decided)["specimens"]] == ["5 mm", None]
