"""Files in which no table is found, or none that is understood: no option that a refusal prints leads to the same message."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from hostile_press import press

from calib.errors import InputError
from calib.lab import Reading, read_lab_file

P = press(60, seed=3)
ROWS = list(zip(P.t, P.f, P.d, P.c, strict=True))
_OPTION = re.compile(r"""--(?P<option>columns|units|where|decimal|specimen) (?P<value>(?:"[^"]*"|'[^']*'|[^\s"',;)])+)""")
_SAID = {"time": "s", "displacement": "mm", "force": "N", "capacitance": "pF"}


def _table(row: str, *above: str) -> str:
    rows = [row % {"k": k, "t": t, "f": f, "d": d, "c": c, "f_": f.strip("-")} for k, (t, f, d, c) in enumerate(ROWS)]
    return "\n".join([*above, *rows]) + "\n"


FILES = {
    "words": "This is a letter about a sensor.\nIt has no numbers.\n" * 20,
    "letters and digits": _table("a%(k)sq%(f)sz"),
    "signs in a text": _table("t %(t)s;F-%(f_)s;x-%(d)s;"),
    "brackets": _table("%(t)s (%(f_)s) (%(d)s)"),
    "one number a line": _table("%(f)s"),
    "no names": _table("%(t)s,%(f)s,%(d)s"),
    "no names, blanks": _table("%(t)s   %(f)s   %(d)s"),
    "no names, tab and blanks": _table("%(t)s\t%(f)s  %(d)s"),
    "two columns": _table("%(t)s;%(c)s"),
    "lists": _table("[%(t)s, %(f)s, %(d)s]"),
    "logs": _table("%(t)s|rig|%(f)s|N|%(d)s|mm"),
    "dictionaries": _table("{'a': %(t)s, 'b': %(f)s, 'q': %(d)s}"),
    "SQL": _table("INSERT INTO press VALUES (%(t)s, %(f)s, %(d)s);"),
    "gnuplot": _table("%(t)s %(f)s %(d)s", "$data << EOD") + "EOD\nplot $data using 1:2\n",
    "unknown names": _table("%(t)s,%(f)s,%(d)s", "foo,bar,quux"),
    "unknown names with units": _table("%(d)s,%(f)s", "X (mm),Y (N)"),
    "two specimens in other units": _table("%(d)s,%(f)s,%(t)s,%(c)s", "X (mm),Y (N),X (um),Y (mN)"),
    "units below unknown names": _table("%(d)s,%(f)s,%(t)s,%(c)s", "X,Y,X,Y", "mm,N,um,mN"),
    "fewer names": _table("%(t)s,%(f)s,%(d)s", "foo,bar"),
    "a title": _table("%(t)s,%(f)s,%(d)s", "Results of Monday"),
    "an odd mark": _table("%(t)s~%(f)s~%(d)s", "log"),
    "a program": "for k in range(10):\n    print(k, 2 * k)\n" * 10,
    "messages": _table("%(t)s got force %(f)s\n%(t)s got gap %(d)s"),
    "prose": _table("at %(t)s the force was %(f)s and the gap was %(d)s"),
    "numbers among names": _table("%(t)s,%(f)s,%(d)s", "foo,12,13"),
    "JSON": '{"t": [0.0, 0.1, 0.2], "F": [0.0, 0.1, 0.2]}\n',
}


def _commands(advice: str) -> list[Reading]:
    """What the options of advice say: those that stand together as one, units of the file for dots, each alternative alone."""
    groups: list[dict[str, dict[str, str]]] = []
    end = -2
    for match in _OPTION.finditer(advice):
        option, value = match["option"], shlex.split(match["value"].rstrip(".:?"))[0]
        key, _, said = value.rpartition("=") if option in ("where", "columns", "units") else (option, "", value)
        said = _SAID[key] if option == "units" and set(said) <= {"."} else said or "2"
        if match.start() != end + 1 or key in groups[-1].get(option, {}):
            groups.append({})
        groups[-1].setdefault(option, {})[key] = said
        end = match.end()
    return [
        Reading(
            columns=group.get("columns", {}),
            units=group.get("units", {}),
            where=group.get("where", {}),
            decimal=group.get("decimal", {}).get("decimal", ""),
        )
        for group in groups
        if "specimen" not in group
    ]


def _message(path: Path, reading: Reading) -> str:
    try:
        read_lab_file(path, reading)
    except InputError as error:
        return "\n".join(fault.message for fault in error.faults)
    return ""


@pytest.mark.parametrize("name", FILES)
def test_no_option_of_a_refusal_leads_to_the_same_message(name: str, tmp_path: Path) -> None:
    path = tmp_path / "press.txt"
    path.write_text(FILES[name], encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_lab_file(path)
    message = "\n".join(fault.message for fault in caught.value.faults)
    for reading in _commands(str(caught.value)):
        again = _message(path, reading)
        assert again != message, reading
        assert "there is no column" not in again, reading


@pytest.mark.parametrize("name", ["words", "letters and digits", "signs in a text", "brackets", "a program"])
def test_a_file_without_a_table_is_told_what_a_table_looks_like(name: str, tmp_path: Path) -> None:
    path = tmp_path / "press.txt"
    path.write_text(FILES[name], encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_lab_file(path)
    said = str(caught.value)
    assert said.startswith(f"{path}:1: ")
    assert "--" not in said
    table = re.findall(r'"([^"]*;[^"]*;[^"]*)"', said)[-3:]
    path.write_text("\n".join(table) + "\n", encoding="utf-8")
    assert read_lab_file(path).columns.keys() == {"time", "displacement", "force"}


@pytest.mark.parametrize(("name", "line"), [("no names", 1), ("gnuplot", 2), ("a title", 2), ("tab", 1), ("unknown", 1)])
def test_a_refusal_of_a_table_without_names_stands_at_its_first_line(name: str, line: int, tmp_path: Path) -> None:
    path = tmp_path / "press.txt"
    path.write_text(next(text for key, text in FILES.items() if name in key), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_lab_file(path)
    assert caught.value.faults[0].line == line
