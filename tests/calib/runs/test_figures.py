"""Figures for papers: every one of the report, by names that every system takes, the same each time, with its letters."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from calib.cli import app
from calib.decision import Requirement
from calib.report import plots_of_report
from calib.runs import figures_in, load_run, recommend_in
from calib.sampling.posterior import Posterior
from calib.sampling.storage import save_posterior
from models.analytic import ClosedForm


@pytest.fixture(scope="module")
def run(
    make_posterior: Callable[..., Posterior],
    undrawing: Callable[[], AbstractContextManager[None]],
    tmp_path_factory: pytest.TempPathFactory,
) -> Path:
    """A run that has not converged, of a specimen with an odd name, with a recommendation."""
    folder = tmp_path_factory.mktemp("run")
    posterior = make_posterior(converged=False, n_specimen=1)
    name = "Prüfling 7/α"
    renamed = replace(
        posterior,
        experiment=replace(posterior.experiment, specimens=(replace(posterior.experiment.specimens[0], name=name),)),
        sweeps=tuple(replace(s, specimen=name) for s in posterior.sweeps),
        parameters=tuple(replace(p, key=replace(p.key, specimen=name if p.specimen else "")) for p in posterior.parameters),
    )
    names = {old.name: new.name for old, new in zip(posterior.parameters, renamed.parameters, strict=True)}
    d = posterior.diagnostics
    d = replace(d, parameters={names[n]: s for n, s in d.parameters.items()}, tau={names[n]: t for n, t in d.tau.items()})
    save_posterior(replace(renamed, diagnostics=d), folder / "posterior.nc", ClosedForm())
    with undrawing():
        recommend_in(load_run(folder), Requirement(2.0, 0.5e-3, 3e-3, n_thickness=5, n_draw=50), seed=1)
    return folder


def test_every_figure_of_the_report_is_a_file_with_its_letters_and_a_caption(run: Path, tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["figures", str(run), "-o", str(tmp_path / "figures")])
    assert result.exit_code == 3, result.output
    assert "Red: do not use the numbers." in result.stdout
    files = sorted(path.name for path in (tmp_path / "figures").iterdir())
    shown = (run / "report.html").read_text(encoding="utf-8").count("<img ")
    assert f"Written: {shown} figures" in result.stdout
    assert files == [
        "capacitance-of-prufling-7.pdf",
        "captions.md",
        "change.pdf",
        "force-of-prufling-7.pdf",
        "pairs.pdf",
        "priors-of-material-and-rig.pdf",
        "priors-of-prufling-7.pdf",
        "traces-1.pdf",
        "traces-2.pdf",
    ]
    captions = (tmp_path / "figures" / "captions.md").read_text(encoding="utf-8")
    assert "Red: do not use the numbers." in captions
    assert "advice" not in captions
    assert all(f"**{name}** " in captions for name in files if name.endswith(".pdf"))
    for name in files[2:]:
        content = (tmp_path / "figures" / name).read_bytes()
        assert b"/FontFile2" in content, name  # TrueType, in the file
        assert b"/Type3" not in content
        assert b"/Image" not in content.replace(b"/ImageB", b"").replace(b"/ImageC", b"").replace(b"/ImageI", b""), name


def test_the_same_run_gives_the_same_bytes_in_place_of_the_earlier_ones(run: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    loaded = load_run(run)
    few = dict(list(plots_of_report(loaded.posterior, loaded.predictions).items())[:1])
    alike = {**few, "Force_of Prüfling 7 α": next(iter(few.values()))}
    monkeypatch.setattr("calib.runs.figures.plots_of_report", lambda *_: alike)
    first = [path.read_bytes() for path in figures_in(loaded)]
    again = figures_in(loaded)
    assert [path.read_bytes() for path in again] == first
    assert [path.stem for path in again[:-1]] == ["force-of-prufling-7", "force-of-prufling-7-2"]
    assert again[-1] == run / "figures" / "captions.md"


def test_what_is_no_folder_or_no_run_is_refused_by_name(run: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    for words, said in (
        ((run, "-o", tmp_path / "file"), "file"),
        ((run, "-o", tmp_path / "none" / "there"), "none"),
        ((tmp_path,), "no finished calibration"),
        ((run, "--format", "eps"), "'eps'"),
    ):
        result = CliRunner().invoke(app, ["figures", *map(str, words)])
        assert result.exit_code == 2, words
        assert said in result.stderr
        assert "Traceback" not in result.stderr
