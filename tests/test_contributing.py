"""What CONTRIBUTING.md and the page of the architecture say is so: recipes are followed in a copy, contracts compared."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from calib import catalogue

ROOT = Path(__file__).parents[1]
LAB = ROOT / "datasets" / "padded_sensor"


def _recipe(title: str) -> list[str]:
    """The blocks of code below a heading."""
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    section = re.split(r"^###? ", text.partition(f"### {title}\n")[2], maxsplit=1, flags=re.MULTILINE)[0]
    blocks = re.findall(r"^( *)```\w+\n(.*?)^ *```$", section, re.MULTILINE | re.DOTALL)
    assert blocks, title
    return [re.sub(f"^{indent}", "", block, flags=re.MULTILINE) for indent, block in blocks]


def _edit(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1, (path, old)
    path.write_text(text.replace(old, new), encoding="utf-8")


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with a copy of the packages, to which a nuisance, a channel, a reader and a section of the report are added."""
    folder = tmp_path_factory.mktemp("copy")
    for package in ("calib", "models"):
        shutil.copytree(ROOT / package, folder / package)
    calib = folder / "calib"

    nuisance, line = _recipe("An unknown of rig or specimen (a nuisance)")
    channel, unknowns = _recipe("A channel")[0].split("...\n")
    _edit(calib / "catalogue.py", "    *_SPREADS,\n", f"{nuisance}{unknowns}    *_SPREADS,\n")
    _edit(calib / "catalogue.py", (last := '            Channel("capacitance",'), f"{channel}{last}")
    old, new = (re.sub("^[-+]", "", one) for one in line.splitlines())
    _edit(calib / "problem" / "measurement.py", f"{old}\n", f"{new}\n")

    models = calib / "problem" / "channels.py"
    _edit(models, '        "force": ChannelModel(', f'{_recipe("A channel")[1]}        "force": ChannelModel(')
    _edit(models, "from models.response import", "import numpy as np\nfrom models.response import")

    families = calib / "lab" / "instruments" / "families"
    (families / "shimadzu.py").write_text(_recipe("A reader of lab files")[0], encoding="utf-8")
    module, template = _recipe("A section of the report")
    (calib / "report" / "sections" / "files.py").write_text(module, encoding="utf-8")
    (calib / "report" / "templates" / "files.html.j2").write_text(template, encoding="utf-8")
    return folder


def _python(copy: Path, code: str) -> str:
    """What a fresh Python prints that has the copy in the place of the packages."""
    environment = {**os.environ, "PYTHONPATH": str(copy)}
    run = subprocess.run([sys.executable, "-c", code], env=environment, cwd=copy, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return run.stdout


def test_a_nuisance_and_a_channel_are_calibrated_as_their_recipes_say(copy: Path) -> None:
    code = f"""
import calib
assert calib.__file__.startswith({str(copy)!r}), calib.__file__
experiment = calib.read_experiment({str(LAB / "experiment.toml")!r})
problem = calib.problem_from(experiment)
assert all("dissipation" in sweep.channels for sweep in problem.sweeps)
found = calib.first_answer(problem).parameters
for name in ("young_modulus", "capacitance_pickup", "loss_tangent", "dissipation_noise"):
    print(found[name].mean, found[name].sd)
"""
    modulus, pickup, loss, noise = (tuple(map(float, line.split())) for line in _python(copy, code).splitlines())
    assert abs(modulus[0] - 0.62e6) < 3 * modulus[1]
    assert abs(pickup[0]) < 3 * pickup[1]  # there is none in these data
    assert pickup[1] < 4.9e-12  # of 5e-12 before: they tell of it
    assert loss[0] == pytest.approx(0.0021, rel=0.01)  # as the file has it
    assert 2e-5 < noise[0] < 1e-4


def test_a_channel_that_stays_level_is_not_judged_by_how_much_it_changes(copy: Path) -> None:
    code = f"""
import calib
grades = calib.judge(calib.observe(calib.read_lab_file({str(LAB / "sensor1_lcr.csv")!r})))
print(*sorted({{grade.channel for grade in grades}}))
print(*(f"{{grade.check}} of {{grade.channel}}" for grade in grades if grade.level == "bad"), sep=", ")
print(*(grade.channel for grade in grades if grade.check == "signal"))
"""
    assert _python(copy, code).splitlines() == ["capacitance dissipation", "", "capacitance"]


def test_a_reader_is_found_without_being_listed(copy: Path) -> None:
    rows = "\n".join(f"{0.05 * k:.2f},{0.003 + 8 * max(0.0, 0.005 * k - 0.3) ** 1.5:.4f},{0.005 * k:.4f}" for k in range(300))
    (copy / "press.csv").write_text(f'"Trapezium X"\n"Time","Force","Disp."\n"s","N","mm"\n{rows}\n', encoding="utf-8")
    said = _python(copy, 'import calib; print(calib.read_lab_file("press.csv").recognised_as)')
    assert said.strip() == "Shimadzu Trapezium"


def test_a_section_of_the_report_is_found_without_being_listed(copy: Path) -> None:
    code = """
from types import SimpleNamespace
from calib.report.environment import templates
from calib.report.sections import section_modules
(files,) = (module for module in section_modules() if module.__name__.endswith(".files"))
made = files.section(SimpleNamespace(posterior=SimpleNamespace(sweeps=[SimpleNamespace(title="s", files=[("<a>.csv", "")])])))
print(templates().get_template(made.template).render(made.context))
assert files.section(SimpleNamespace(posterior=SimpleNamespace(sweeps=[]))) is None
"""
    assert "<li>s: <code>&lt;a&gt;.csv</code></li>" in _python(copy, code)


def test_names_of_unknowns_are_taken_apart_by_their_parser_alone() -> None:
    by_hand = re.compile(r"""\.(r?partition|r?split|r?index|r?find)\(['"]\[""")
    rooms = [path for path in (ROOT / "calib").rglob("*.py") if "lab" not in path.parts]
    assert [str(path.relative_to(ROOT)) for path in rooms if by_hand.search(path.read_text(encoding="utf-8"))] == []


def test_no_two_classes_share_a_name() -> None:
    where: dict[str, list[str]] = {}
    for package in ("calib", "models"):
        for module in sorted((ROOT / package).rglob("*.py")):
            for name in re.findall(r"^class ([A-Z]\w*)", module.read_text(), re.MULTILINE):
                where.setdefault(name, []).append(str(module.relative_to(ROOT)))
    assert {name: modules for name, modules in where.items() if len(modules) > 1} == {}


def test_every_row_of_the_catalogue_has_a_name_of_its_own() -> None:
    assert len(catalogue._ROWS) == len(catalogue.UNKNOWNS)


def test_the_page_of_the_architecture_has_the_contract_of_the_rooms_and_names_all_that_lies_on_the_ground() -> None:
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"]
    (rooms,) = (contract for contract in contracts if contract["name"].startswith("rooms of calib"))
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    assert " > ".join(rooms["layers"][1:]) in " ".join(page.split())
    ground = page.partition("### The ground")[2].partition("## Rooms of `models`")[0]
    modules = {path.stem for path in (ROOT / "calib").glob("*.py") if not path.stem.startswith("__")}
    assert modules - set(re.findall(r"`(\w+)`", ground)) == set()
    sentences = re.findall(r"[^.]{40,}\.", " ".join(page.split()))
    assert len(sentences) == len(set(sentences))
