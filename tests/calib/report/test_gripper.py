"""Files for a gripper, compiled, imported and read: every one says what the tables of Python say, to their last digits."""

from __future__ import annotations

import ast
import csv
import json
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from calib.checks import Reason, Verdict
from calib.decision import ForceTable, Gripper, GripperTables, Status, invert
from calib.errors import InputError
from calib.records import record_from_text
from calib.report import gripper_files
from calib.sampling.posterior import Posterior
from models.analytic import ClosedForm
from models.sensor import FloatArray

#: Names that no file may stumble over: no letters of C, twice the same letters, ends of comments and texts, trigraphs.
NAMES = ("*/ int main; /*", 'sensor "1" ??/', "sensor-1", "传感器\u202e\n\\")
AMBER = Verdict((Reason("learned", "amber", "Young's modulus is */ not\nlearned", 'Press "harder" */'),))
FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wdouble-promotion", "-Wundef", "-O1")

PROGRAM = """
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include "force_tables.h"

static const struct force_table *const floats[] = { %(floats)s };
static const struct force_table_int *const integers[] = { %(integers)s };

static void say(struct force_reading f)
{
    printf("%%.9g %%.9g %%.9g %%.9g ", (double)f.force, (double)f.lower, (double)f.upper, (double)f.sigma);
    printf("%%d\\n", (int)f.status);
}

int main(void)
{
    char kind[8];
    unsigned which;
    while (scanf("%%7s %%u", kind, &which) == 2) {
        if (strcmp(kind, "float") == 0) {
            float c, tare;
            struct force_reading f;
            if (scanf("%%f %%f", &c, &tare) != 2) return 1;
            f = force_from_capacitance(floats[which], c, tare);
            say(f);
        } else if (strcmp(kind, "ratio") == 0) {
            float r;
            struct force_reading f;
            if (scanf("%%f", &r) != 1) return 1;
            f = force_from_ratio(floats[which], r);
            say(f);
        } else if (strcmp(kind, "tare") == 0) {
            float tare_pF;
            if (scanf("%%f", &tare_pF) != 1) return 1;
            printf("%%d %%d 0 0 0\\n", force_tare_expected(floats[which], tare_pF),
                   force_tare_expected_int(integers[which], (int64_t)((double)tare_pF * 1000.0 + 0.5)));
        } else {
            int64_t c, tare;
            struct force_reading_int f;
            if (scanf("%%" SCNd64 " %%" SCNd64, &c, &tare) != 2) return 1;
            f = force_from_capacitance_int(integers[which], c, tare);
            printf("%%" PRId32 " %%" PRId32 " %%" PRId32 " %%" PRId32 " %%d\\n", f.force_uN, f.lower_uN, f.upper_uN, f.sigma_uN,
                   (int)f.status);
        }
    }
    printf("size %%u %%u\\n", (unsigned)sizeof(struct force_table), (unsigned)sizeof(struct force_table_int));
    return 0;
}
"""


@dataclass(frozen=True)
class Compiled:
    """A program that looks readings up in the tables of a header, and the bytes of its tables."""

    path: Path
    size: tuple[int, int]

    def ask(self, kind: str, which: int, rows: FloatArray) -> FloatArray:
        """What it says of readings, (n_reading, 5)."""
        words = [[f"{x:.0f}" if kind == "integer" else f"{x:.9g}" for x in row] for row in rows.tolist()]
        text = "".join(f"{kind} {which} {' '.join(row)}\n" for row in words)
        said = subprocess.run([self.path], input=text, capture_output=True, text=True, check=True, timeout=20).stdout
        return np.array([[float(x) for x in line.split()] for line in said.splitlines()[:-1]])


@pytest.fixture(scope="module")
def made(make_posterior: Callable[..., Posterior]) -> GripperTables:
    """Four tables with names that are hard to write, and a reason with words that are."""
    tables = invert(make_posterior(), ClosedForm(), Gripper(padding=3e-3, n_draw=100), verdict=AMBER)
    named = tuple(replace(table, name=name) for table, name in zip(tables.tables, NAMES, strict=True))
    return replace(tables, tables=named, fingerprint="ab" * 32, posterior_sha256="cd" * 32)


@pytest.fixture(scope="module")
def texts(made: GripperTables) -> Mapping[str, str]:
    return gripper_files(made)


@pytest.fixture(scope="module")
def compiled(texts: Mapping[str, str], tmp_path_factory: pytest.TempPathFactory) -> Compiled:
    """The header compiled with all warnings as errors; where there is no compiler, tests that need it are skipped."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("there is no C compiler (cc)")
    folder = tmp_path_factory.mktemp("gripper")
    (folder / "force_tables.h").write_text(texts["force_tables.h"], encoding="utf-8")
    names = [table["identifier"] for table in json.loads(texts["force_tables.json"])["tables"]]
    pointers = {"floats": ", ".join(f"&{n}" for n in names), "integers": ", ".join(f"&{n}_int" for n in names)}
    (folder / "program.c").write_text(PROGRAM % pointers, encoding="utf-8")
    subprocess.run([compiler, *FLAGS, "program.c", "-o", "program"], cwd=folder, check=True, timeout=60)
    said = subprocess.run([folder / "program"], input="", capture_output=True, text=True, check=True).stdout.split()
    return Compiled(folder / "program", (int(said[1]), int(said[2])))


@pytest.fixture(scope="module")
def module(texts: Mapping[str, str]) -> ModuleType:
    """The Python file, run as it is."""
    made = ModuleType("force_tables")
    exec(compile(texts["force_tables.py"], "force_tables.py", "exec"), vars(made))
    return made


def _readings(table: ForceTable, tare: float, n: int = 300) -> FloatArray:
    """Capacitances from far below rest to far beyond the range, and densely about the rows of the table."""
    ratio = np.concatenate(
        [np.linspace(-0.2, 2 * table.ratio[-1], n), np.linspace(table.ratio[0], table.ratio[-1], n), table.ratio]
    )
    return np.asarray(tare * (1 + np.sort(ratio)), dtype=float)


@pytest.mark.parametrize("which", range(4))
@pytest.mark.parametrize("tare", [97.3, 412.5])
def test_floats_of_c_are_those_of_python(compiled: Compiled, made: GripperTables, which: int, tare: float) -> None:
    table = made.tables[which]
    c0 = float(np.float32(tare))
    c = _readings(table, c0).astype(np.float32).astype(float)
    said, meant = compiled.ask("float", which, np.stack([c, np.full(c.size, c0)], axis=1)), table.force_at(c, c0)
    full = table.end
    for k, column in enumerate((meant.force, meant.lower, meant.upper, meant.sigma)):
        # What a float of the ratio can hold of a force near zero is a millionth of the full scale.
        np.testing.assert_allclose(said[:, k], column, rtol=1e-4, atol=2e-6 * full)
        if k < 3:
            assert np.all(np.diff(said[:, k]) >= 0)
    edges = np.array([table.below, table.touch, table.ratio[-1]])
    clear = np.min(np.abs((c / c0 - 1)[:, None] - edges), axis=1) > 1e-6
    np.testing.assert_array_equal(said[clear, 4], meant.status[clear])
    assert set(said[:, 4]) == {Status.VALID, Status.NO_CONTACT, Status.BEYOND_RANGE, Status.BELOW_REST}


@pytest.mark.parametrize("which", range(4))
@pytest.mark.parametrize("tare", [97_300_000, 8_123_456_789])
def test_integers_of_c_are_those_of_python_as_far_as_they_count(
    compiled: Compiled, made: GripperTables, which: int, tare: int
) -> None:
    table = made.tables[which]
    c = np.round(_readings(table, tare))
    c = c[c <= 9e9]
    said, meant = compiled.ask("integer", which, np.stack([c, np.full(c.size, float(tare))], axis=1)), table.force_at(c, tare)
    steepest = max(float(np.max(np.diff(column) / np.diff(table.ratio))) for column in (table.force, table.lower, table.upper))
    # Half a micronewton of the result and of the rows, and a billionth and a half of the reading and of where rows are.
    quantum = 1.5e-6 + 2e-9 * steepest
    assert quantum < 1e-4 * table.end
    for k, column in enumerate((meant.force, meant.lower, meant.upper)):
        np.testing.assert_allclose(said[:, k] * 1e-6, column, rtol=0, atol=quantum)
        assert np.all(np.diff(said[:, k]) >= 0)
    np.testing.assert_allclose(said[:, 3] * 1e-6, meant.sigma, rtol=0, atol=2 * quantum)
    edges = np.array([table.below, table.touch, table.ratio[-1]])
    clear = np.min(np.abs((c / tare - 1)[:, None] - edges), axis=1) > 2e-9
    np.testing.assert_array_equal(said[clear, 4], meant.status[clear])


def test_c_answers_what_is_no_reading_with_a_status(compiled: Compiled) -> None:
    nan, inf = float("nan"), float("inf")
    bad = np.array([[nan, 97.0], [97.0, nan], [inf, 97.0], [97.0, inf], [-inf, 97.0], [0.0, 97.0], [97.0, 0.0], [-1.0, 97.0]])
    assert set(compiled.ask("float", 0, bad)[:, 4]) == {Status.BAD_INPUT}
    assert set(compiled.ask("ratio", 0, np.array([[nan], [inf], [-inf]]))[:, 4]) == {Status.BAD_INPUT}
    # The largest and the smallest that floats and the integers take.
    wild = compiled.ask("float", 0, np.array([[1e30, 1e-30], [1e-30, 1e30], [1e-38, 1e-38]]))
    assert wild[:, 4].tolist() == [Status.BAD_INPUT, Status.BELOW_REST, Status.NO_CONTACT]
    assert np.all(np.isfinite(wild))
    bad = np.array([[0.0, 97e6], [97e6, 0.0], [-5.0, 97e6], [9_000_000_001.0, 97e6], [97e6, 9_000_000_001.0]])
    assert set(compiled.ask("integer", 0, bad)[:, 4]) == {Status.BAD_INPUT}
    wild = compiled.ask("integer", 0, np.array([[9e9, 1.0], [1.0, 9e9], [1.0, 1.0]]))
    assert wild[:, 4].tolist() == [Status.BEYOND_RANGE, Status.BELOW_REST, Status.NO_CONTACT]


@pytest.mark.parametrize("which", range(len(NAMES)))
def test_a_tare_that_is_doubted_is_not_expected_in_firmware_either(
    compiled: Compiled, module: ModuleType, made: GripperTables, which: int
) -> None:
    table = made.tables[which]
    under_load = float(table.tare[2] * (1 + np.interp(2.0, table.force, table.ratio)))
    tares = np.array([table.tare[1], under_load, *np.linspace(0.97 * table.tare[0], 1.05 * table.tare[2], 40)])
    expected = [table.tare_doubt(float(tare)) is None for tare in tares]
    assert expected[:2] == [True, False]
    said = compiled.ask("tare", which, tares[:, None] * 1e12)
    assert said[:, 0].tolist() == said[:, 1].tolist() == expected
    assert [module.tare_expected(module.TABLES[table.name], float(tare) * 1e12) for tare in tares] == expected


def test_a_table_takes_less_than_4_kilobytes(compiled: Compiled, texts: Mapping[str, str]) -> None:
    assert sum(compiled.size) <= 4096
    assert f"takes {compiled.size[0]} bytes as float" in texts["force_tables.h"]


def test_a_header_of_which_nothing_or_one_version_is_used_compiles(texts: Mapping[str, str], tmp_path: Path) -> None:
    if (compiler := shutil.which("cc")) is None:
        pytest.skip("there is no C compiler (cc)")
    (tmp_path / "force_tables.h").write_text(texts["force_tables.h"], encoding="utf-8")
    (tmp_path / "a.c").write_text(
        '#include "force_tables.h"\n#include "force_tables.h"\nint a(void) { return 0; }\n', encoding="utf-8"
    )
    for define in ("UNUSED", "FORCE_TABLES_NO_FLOAT", "FORCE_TABLES_NO_INTEGER"):
        subprocess.run([compiler, *FLAGS, f"-D{define}", "-c", "a.c", "-o", "a.o"], cwd=tmp_path, check=True, timeout=60)
    assert (
        "float "
        not in subprocess.run(
            [compiler, "-DFORCE_TABLES_NO_FLOAT", "-E", "-P", "a.c"], cwd=tmp_path, check=True, capture_output=True, text=True
        ).stdout
    )


def test_the_python_file_says_the_same_without_our_packages(
    module: ModuleType, made: GripperTables, texts: Mapping[str, str]
) -> None:
    assert list(module.TABLES) == list(NAMES)
    for table in made.tables:
        c = _readings(table, 97.3)
        meant = table.force_at(c, 97.3)
        said = np.array([module.force_from_capacitance(module.TABLES[table.name], x, 97.3) for x in c])
        for k, column in enumerate((meant.force, meant.lower, meant.upper, meant.sigma)):
            np.testing.assert_allclose(said[:, k], column, rtol=1e-9, atol=1e-9)
        edges = np.array([table.below, table.touch, table.ratio[-1]])
        clear = np.min(np.abs((c / 97.3 - 1)[:, None] - edges), axis=1) > 1e-11
        np.testing.assert_array_equal(said[clear, 4], meant.status[clear])
    for pair in ((float("nan"), 1.0), (1.0, float("inf")), (0.0, 1.0), (1.0, -1.0)):
        assert module.force_from_capacitance(module.TABLES[NAMES[0]], *pair).status == Status.BAD_INPUT
    imported = {n.module for n in ast.walk(ast.parse(texts["force_tables.py"])) if isinstance(n, ast.ImportFrom)}
    assert imported <= sys.stdlib_module_names
    assert not any(isinstance(n, ast.Import) for n in ast.walk(ast.parse(texts["force_tables.py"])))


def test_the_readme_shows_what_works_in_python(
    module: ModuleType, made: GripperTables, texts: Mapping[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    (code,) = re.findall(r"^```python\n(.*?)^```", texts["README.md"], re.DOTALL | re.MULTILINE)
    assert len(code.splitlines()) == 4
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, "force_tables", module)
        exec(code, {})
    expected = made.tables[-1].force_at(100.0, 97.5)  # of the design, which was asked for
    fits, *said = capsys.readouterr().out.split()
    assert fits == str(made.tables[-1].tare_doubt(97.5e-12) is None)
    assert [float(x) for x in said[:3]] == pytest.approx([float(expected.force), float(expected.lower), float(expected.upper)])
    assert said[3] == str(expected.status == Status.VALID)


def test_the_readme_shows_what_compiles_in_c(texts: Mapping[str, str], tmp_path: Path) -> None:
    if (compiler := shutil.which("cc")) is None:
        pytest.skip("there is no C compiler (cc)")
    (code,) = re.findall(r"^```c\n(.*?)^```", texts["README.md"], re.DOTALL | re.MULTILINE)
    first, second, *lines_of_both = code.splitlines()
    once, inside = lines_of_both[:2], lines_of_both[2:]
    assert len(inside) == 3
    (tmp_path / "force_tables.h").write_text(texts["force_tables.h"], encoding="utf-8")
    lines = [first, second, "void act_on(float, float, float);", "void on_reading(float);", "void tare_again(void);"]
    lines += [
        "void on_reading(float capacitance) {",
        *inside,
        "}",
        "void at_rest(float);",
        "void at_rest(float c) {",
        "tare = c;",
        *once,
        "}",
    ]
    (tmp_path / "a.c").write_text("\n".join(lines) + "\n", encoding="utf-8")
    subprocess.run([compiler, *FLAGS, "-DFORCE_TABLES_NO_INTEGER", "-c", "a.c"], cwd=tmp_path, check=True, timeout=60)


def test_csv_and_json_hold_every_row(made: GripperTables, texts: Mapping[str, str]) -> None:
    lines = [line for line in texts["force_tables.csv"].splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    assert len(rows) == sum(table.ratio.size for table in made.tables)
    np.testing.assert_allclose([float(r["upper_N"]) for r in rows], np.concatenate([t.upper for t in made.tables]), rtol=1e-8)
    read = record_from_text("force tables", 1, texts["force_tables.json"])
    for table, plain in zip(made.tables, read["tables"], strict=True):
        assert plain["name"] == table.name
        np.testing.assert_array_equal(plain["ratio"], table.ratio)
        np.testing.assert_array_equal(plain["lower_N"], table.lower)
    assert read["posterior_sha256"] == "cd" * 32
    assert read["level"] == 0.9


def test_taxels_have_what_a_simulator_needs_and_null_for_what_is_not_known(
    made: GripperTables, texts: Mapping[str, str]
) -> None:
    taxels = record_from_text("simulated taxels", 1, texts["taxels.json"])["taxels"]
    for table, taxel in zip(made.tables, taxels, strict=True):
        assert taxel["hysteresis"] is taxel["relaxation"] is taxel["temperature"] is None
        points = taxel["working_points"]
        assert [p["stiffness_N_per_m"] for p in points] == [p.stiffness[0] for p in table.points]
        assert all(a["stiffness_N_per_m"] < b["stiffness_N_per_m"] for a, b in pairwise(points))
        assert all(p["noise_sd_N"] <= p["force_sd_N"] for p in points)


def test_every_file_says_amber_and_why(texts: Mapping[str, str]) -> None:
    assert set(texts) == {
        "force_tables.h",
        "force_tables.py",
        "force_tables.csv",
        "force_tables.json",
        "taxels.json",
        "README.md",
    }
    for name, text in texts.items():
        head = text[:2500]
        assert "amber" in head.lower(), name
        assert "Young's modulus is" in head, name


def test_of_what_is_red_no_file_is_written_and_the_readme_says_that_green_may_not_last(
    made: GripperTables, texts: Mapping[str, str]
) -> None:
    red = Verdict((Reason("convergence", "red", "the chains have not converged", "Go on"),))
    one = (replace(made.tables[0], verdict=red), *made.tables[1:])
    for void in (replace(made, verdict=red), replace(made, tables=one)):
        with pytest.raises(InputError, match="their numbers must not be used"):
            gripper_files(void)
    assert "of a run whose verdict is red nothing here may be used" in " ".join(texts["README.md"].split())


def test_identifiers_of_c_are_its_own_and_each_another(texts: Mapping[str, str]) -> None:
    found = [table["identifier"] for table in json.loads(texts["force_tables.json"])["tables"]]
    assert found == ["force_of_int_main", "force_of_sensor_1", "force_of_sensor_1_2", "force_of_sensor"]


def test_forces_that_integers_cannot_hold_are_refused(made: GripperTables) -> None:
    huge = replace(made.tables[0], end=2200.0)
    with pytest.raises(InputError, match=r"2200 N at .* is more than a table holds"):
        gripper_files(replace(made, tables=(huge,)))
