"""What a newcomer calls first: the example, the version, completion by the shell, the schemas for an editor."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from calib.cli import app
from calib.experiment import design_schema, experiment_schema, read_experiment, shipped, specification_schema

DATASET = Path(__file__).parents[3] / "datasets" / "padded_sensor"


def _run(*words: object) -> Result:
    return CliRunner().invoke(app, [str(w) for w in words])


def test_the_example_is_the_shipped_data_and_can_be_calibrated(tmp_path: Path) -> None:
    folder = tmp_path / "my demo"
    assert _run("example", "-o", folder).exit_code == 0
    assert shipped() == DATASET
    assert sorted(p.name for p in folder.iterdir()) == sorted(p.name for p in DATASET.iterdir() if p.is_file())
    assert [s.name for s in read_experiment(folder / "experiment.toml").specimens] == ["sensor 1", "sensor 2"]


def test_what_to_do_next_can_be_pasted(tmp_path: Path) -> None:
    folder = tmp_path / "what's this $HOME"
    said = [shlex.split(line) for line in _run("example", "-o", folder).stdout.splitlines() if line.startswith("    ")]
    assert said == [
        ["calib", "calibrate", f"{folder}/experiment.toml", "-o", f"{folder}/RUN"],
        ["calib", "recommend", f"{folder}/RUN", "--force", "10 N", "--padding", "0 mm:9 mm"],
        ["calib", "recommend", f"{folder}/RUN", "--spec", f"{folder}/specification.toml"],
    ]


@pytest.mark.parametrize("kind", ["folder", "file", "link"])
def test_an_example_overwrites_nothing(tmp_path: Path, kind: str) -> None:
    there = tmp_path / "demo"
    if kind == "folder":
        there.mkdir()
    elif kind == "file":
        there.write_text("mine")
    else:
        there.symlink_to(tmp_path / "nowhere")
    result = _run("example", "-o", there)
    assert result.exit_code == 2
    assert "exists and is not overwritten" in " ".join(result.stderr.split())
    assert sorted(tmp_path.rglob("*")) == [there]


def test_an_example_needs_a_folder_to_be_in(tmp_path: Path) -> None:
    result = _run("example", "-o", tmp_path / "nowhere" / "demo")
    assert result.exit_code == 2
    assert "nowhere does not exist" in " ".join(result.stderr.split())
    assert not list(tmp_path.iterdir())


def test_the_version_is_that_of_the_package_and_of_what_the_numbers_come_from() -> None:
    said = _run("--version").stdout
    assert said.startswith(f"calib {version('dielectric-elastomer-calibration')} in ")
    assert f"numpy {version('numpy')}" in said
    assert f"emcee {version('emcee')}" in said


KINDS = [("experiment", experiment_schema()), ("design", design_schema()), ("specification", specification_schema())]


@pytest.mark.parametrize(("kind", "schema"), KINDS)
def test_a_schema_is_printed_or_written(tmp_path: Path, kind: str, schema: dict[str, object]) -> None:
    assert json.loads(_run("schema", kind).stdout) == schema
    path = tmp_path / f"{kind}.schema.json"
    result = _run("schema", kind, "-o", path)
    assert json.loads(path.read_text(encoding="utf-8")) == schema
    assert result.stdout.splitlines()[-1] == f"#:schema ./{kind}.schema.json"
    assert _run("schema", kind, "-o", path).exit_code == 2


def test_the_line_that_names_a_schema_may_stand_in_an_experiment_file(tmp_path: Path) -> None:
    folder = tmp_path / "demo"
    _run("example", "-o", folder)
    path = folder / "experiment.toml"
    before = read_experiment(path).specimens
    path.write_text("#:schema ./experiment.schema.json\n" + path.read_text(encoding="utf-8"), encoding="utf-8")
    assert read_experiment(path).specimens == before


# --- completion ---------------------------------------------------------------------------------------------------------

PROGRAM = f"""#!{sys.executable}
from calib.cli import app
app(prog_name="calib")
"""


#: What is typed -> what is offered.
COMPLETED = {
    ("cal",): ["calibrate"],
    ("surrogate", "tr"): ["train"],
    ("calibrate", "--see"): ["--seed"],
    ("schema", ""): ["experiment", "design", "specification"],
}


@pytest.mark.skipif(shutil.which("bash") is None, reason="bash completes")
def test_bash_completes_commands_options_and_choices(tmp_path: Path) -> None:
    program = tmp_path / "bin" / "calib"
    program.parent.mkdir()
    program.write_text(PROGRAM)
    program.chmod(0o755)
    env = {**os.environ, "HOME": str(tmp_path), "PATH": f"{program.parent}:{os.environ['PATH']}"}
    env["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    # The shell is the one among the processes above; "; exit" keeps bash from making way for its last command.
    shown = ["bash", "--norc", "-c", "calib --show-completion; exit $?"]
    script = subprocess.run(shown, env=env, capture_output=True, text=True, check=True).stdout
    for typed in COMPLETED:
        words = " ".join(shlex.quote(word) for word in ("calib", *typed))
        script += (
            f"COMP_WORDS=({words}); COMP_CWORD={len(typed)}; _calib_completion calib; (IFS=' '; echo \"${{COMPREPLY[*]}}\")\n"
        )
    said = subprocess.run(["bash", "--norc", "-c", script], env=env, capture_output=True, text=True, check=True).stdout
    assert [line.split() for line in said.splitlines()] == list(COMPLETED.values())
