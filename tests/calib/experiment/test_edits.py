"""Which lines of an experiment file are still as the draft made them."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from calib.experiment.edits import GUESSES, MARK, Unedited, unedited_in_words, unedited_lines
from calib.experiment.experiment_file import read_experiment
from calib.experiment.record import experiment_from_json, experiment_to_json
from calib.experiment.toml_places import comments_in, locate_keys

DATASET = Path(__file__).parents[3] / "datasets" / "padded_sensor" / "experiment.toml"

TEXT = f"""\
base = "bonded"   {MARK} what it rests on
[indenter]
radius = "5 mm"   {MARK} radius of the ball
[sensor]
radius = "10 mm"
# electrode_radius = "10 mm"   {MARK} radius of the electrodes
[padding]
{MARK} nothing else is known; remove this line if so
[[specimens]]
name = "a {MARK} b"
force = "a.csv"   {MARK} choose where, one of the lines above
[specimens.priors]
sensor_thickness = {{ lognormal = ["0.8 mm", 1.5] }}   {MARK} mean and sd
padding_thickness = {{ lognormal = ["1.1 mm", 1.5] }}
# dielectric_thickness = {{ normal = ["0.16 mm", "0.01 mm"] }}   {MARK} of each of the two
"""


def _left(text: str) -> tuple[Unedited, ...]:
    return unedited_lines(text, tomllib.loads(text), locate_keys(text))


def _whats(text: str) -> list[str]:
    return [u.what for u in _left(text)]


def test_every_line_that_is_as_the_draft_made_it_is_found_with_its_number() -> None:
    of = f"a {MARK} b"
    assert _left(TEXT) == (
        Unedited(1, "base"),
        Unedited(3, "indenter radius"),
        Unedited(6, "electrode_radius"),
        Unedited(8, "nothing else is known"),
        Unedited(11, "force", of),
        Unedited(13, "sensor_thickness", of),
        Unedited(15, "dielectric_thickness", of),
    )


@pytest.mark.parametrize(
    ("old", "new", "done"),
    [
        ('"5 mm"', '"4 mm"', "indenter radius"),
        ('"5 mm"', '"5.0 mm"', "indenter radius"),
        (f"{MARK} radius of the ball", "# measured", "indenter radius"),
        (f"{MARK} radius of the ball", "", "indenter radius"),
        ('# electrode_radius = "10 mm"', 'electrode_radius = "9 mm"', "electrode_radius"),
        ("# electrode_radius", '# as measured\nelectrode_radius = "9 mm"\n# electrode_radius', "electrode_radius"),
        (f"{MARK} nothing else is known", "# known", "nothing else is known"),
        ('base = "bonded"', 'base = "slippery"', "base"),
        ('"a.csv"', '{ file = "a.csv", where = { "Frequency (Hz)" = "1000" } }', "force"),
        ('{ lognormal = ["0.8 mm", 1.5] }', '{ normal = ["0.8 mm", "0.1 mm"] }', "sensor_thickness"),
        ("# dielectric_thickness = { normal = [", "dielectric_thickness = { normal = [0, ", "dielectric_thickness"),
        ("[padding]", 'dielectric_thickness = "0.1 mm"\n[padding]', "dielectric_thickness"),
    ],
)
def test_a_line_is_done_once_its_value_is_another_or_the_mark_is_gone(old: str, new: str, done: str) -> None:
    assert old in TEXT
    before, after = _whats(TEXT), _whats(TEXT.replace(old, new, 1))
    assert done in before
    assert after == [what for what in before if what != done]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"5 mm"', "'5 mm'"),
        (f'"5 mm"   {MARK}', f'"5 mm" {MARK}'),
        ("\n[sensor]", "\n\n# a comment\n\n[sensor]"),
        ('# electrode_radius = "10 mm"', 'electrode_radius = "10 mm"'),
        ("# electrode_radius", "#electrode_radius"),
        ('"a.csv"', '{ file = "a.csv", specimen = 2 }'),
    ],
)
def test_a_line_that_only_looks_different_is_still_as_it_was(old: str, new: str) -> None:
    assert old in TEXT
    changed = TEXT.replace(old, new, 1)
    shown = [w.removeprefix("sensor ") for w in _whats(changed)]
    assert sorted(shown) == sorted(w.removeprefix("sensor ") for w in _whats(TEXT))


def test_a_hash_in_a_text_is_no_comment() -> None:
    text = f"a = '''\n{MARK} x'''\nb = \"\\\" {MARK}\" # one\n[c] # two\n\"d # e\" = 1"
    assert comments_in(text) == [(3, "# one"), (4, "# two")]
    assert _left(text) == ()


def test_a_line_of_a_draft_is_as_it_was_whatever_its_quantity() -> None:
    for at, guess in GUESSES.items():
        table = {"specimens": "[[specimens]]\n[specimens.priors]", "base": ""}.get(at[0], f"[{at[0]}]")
        line = f"{at[-1]} = {guess.value}   {MARK} {guess.task}"
        assert len(_left(f"{table}\n{line}\n")) == 1, at
        assert len(_left(f"{table}\n# {line}\n")) == 1, at
        assert _left(f"{table}\n{at[-1]} = 17   {MARK} {guess.task}\n") == (), at


def test_lines_of_many_specimens_are_told_together() -> None:
    many = [Unedited(10 * k, "padding_thickness", f"s{k}") for k in range(1, 8)]
    assert unedited_in_words(many) == (
        '7 lines marked EDIT are unchanged: lines 10, 20, 30 and 4 more padding_thickness of "s1", "s2", "s3" and 4 more'
    )
    assert unedited_in_words(many[:1]) == '1 line marked EDIT is unchanged: line 10 padding_thickness of "s1"'
    assert unedited_in_words([]) == ""


def test_the_shipped_experiment_has_none() -> None:
    assert read_experiment(DATASET).unedited == ()


def test_an_experiment_keeps_them(tmp_path: Path) -> None:
    text = DATASET.read_text(encoding="utf-8").replace('"5 mm"', f'"5 mm"  {MARK} radius')
    for file in DATASET.parent.glob("*.csv"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    (tmp_path / "e.toml").write_text(text, encoding="utf-8", newline="\r\n")
    experiment = read_experiment(tmp_path / "e.toml")
    assert experiment.unedited == (Unedited(6, "indenter radius"),)
    assert experiment_from_json(experiment_to_json(experiment)) == experiment
