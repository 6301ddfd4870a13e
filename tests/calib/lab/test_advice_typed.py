"""What refusals advise is typed as it is quoted: no option names a column, a quantity or a row that there is not."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping
from pathlib import Path

import pytest

from calib.errors import InputError
from calib.lab import Reading, read_lab_file

N = 60
_OPTION = re.compile(r"""--(?P<option>columns|units|where) (?P<value>(?:"[^"]*"|'[^']*'|[^\s"'])+)""")
_NEVER = ("no column", "more than one column", "there is no quantity", "unit asked for", "no rows", "no header row")

# Header -> how a row is written, of files that are refused.
FILES = {
    "Time (s),Displacement (mm),Force (N),C - 97 pF": "{t},{x},{f},{dc}",
    "Time (s),Displacement (mm),Force (N),C_meas (pF),C_corr (pF)": "{t},{x},{f},{c},{c2}",
    "Time (s),Displacement (mm),Force 1 (N),Force 2 (N)": "{t},{x},{f},{f2}",
    "Time (s),Displacement (mm) [x10],Force (N)": "{t},{x},{f}",
    "Time (s),Displacement (quux) (mm),Force (N),foo (mm)": "{t},{x},{f},{x2}",
    "Time (s),Displacement (mm),Force (N),Unit": "{t},{x},{f},mN",
    "Time (s),Displacement (mm),dF (N)": "{t},{x},{f}",
    "Time (s),Displacement (mm),Force (N),CH0_pF,CH1_pF": "{t},{x},{f},{c},{c2}",
    "Time (s),Displacement (mm),Force (kN) (N)": "{t},{x},{f}",
    "Time,Displacement (mm),Force (N)": "{t},{x},{f}",
    "Time (s),Displacement (mm),Force (MN)": "{t},{x},{f}",
    "Time (s),Channel,Displacement (mm),Force (N)": "{t},{k},{x},{kf}",
    "Time (s),Cp (pF),Cs (pF),D": "{t},{c},{far},0.002",
    "Time (s),Cp (read as pF),Cs (pF),D": "{t},{c},{far},0.002",
    "Time_MTS (s),Time_LCR (s),Displacement (mm),Force (N),Cp (pF)": "{t},{t2},{x},{f},{c}",
    'Time (s),Weg \'oben\' (mm),"Weg ""unten"" (mm)",Force (N)': "{t},{x},{x2},{f}",
    "# F: displacement [mm]\n# s: force [N]\nt (s),s,F": "{t},{x},{f}",
    "# s: force [N]\nt (s),s (mm),F (N)": "{t},{x},{f}",
    "": "{t} s;{x} mm;{f} N",
}


def _written(folder: Path, head: str, row: str) -> Path:
    lines = [head] if head else []
    for i in range(N):
        x = 0.0113 * min(i, 45)
        f, c = 0.5 * x**1.5 + 0.0001 * (i * 7 % 5), 97.3 + 2 * x * x + 0.0003 * (i * 3 % 7)
        values = {"k": i % 2, "t": f"{0.1 * i:.1f}", "t2": f"{0.13 * i + 5:.2f}", "x": f"{x:.4f}"}
        values |= {"x2": f"{0.9 * x + 0.01 * x * x:.4f}", "f": f"{f:.4f}", "f2": f"{1.3 * f + 0.02 * x:.4f}"}
        values |= {"kf": f"{f + (i % 2) * 0.4:.4f}", "c": f"{c:.4f}", "dc": f"{c - 97:.4f}"}
        values |= {"c2": f"{c * 1.01 + 0.3 * x:.4f}", "far": f"{c * 1.3:.4f}"}
        lines.append(row.format(**values))
    path = folder / "press.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def _commands(advice: str) -> list[dict[str, dict[str, str]]]:
    """The commands that advice quotes: options with nothing but a blank between them are one."""
    commands: list[dict[str, dict[str, str]]] = []
    end = -2
    for match in _OPTION.finditer(advice):
        if "..." in match["value"]:
            end = -2
            continue
        option, value = match["option"], match["value"].rstrip(";,.)?:")
        key, _, said = shlex.split(value)[0].rpartition("=") if option != "columns" else shlex.split(value)[0].partition("=")
        joined = match.start() == end + 1 and key not in commands[-1].get(option, {})
        if not joined:
            commands.append({})
        commands[-1].setdefault(option, {})[key] = said
        end = match.end()
    return commands


def _reading(command: Mapping[str, Mapping[str, str]]) -> Reading:
    return Reading(columns=command.get("columns", {}), units=command.get("units", {}), where=command.get("where", {}))


@pytest.mark.parametrize("head", FILES)
def test_what_a_refusal_quotes_can_be_typed_as_it_stands(tmp_path: Path, head: str) -> None:
    path = _written(tmp_path, head, FILES[head])
    with pytest.raises(InputError) as caught:
        read_lab_file(path)
    commands = [command for fault in caught.value.faults for command in _commands(fault.advice)]
    assert all("(read as" not in str(command) for command in commands if "(read as" not in head)
    read = 0
    for command in commands:
        try:
            read_lab_file(path, _reading(command))
            read += 1
        except InputError as error:
            for fault in error.faults:
                assert not fault.message.startswith(_NEVER), (command, fault.message)
    one_fault = len(caught.value.faults) == 1
    assert read or not one_fault or not commands, f"no command leads out: {caught.value}"
