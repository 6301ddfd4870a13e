"""A batch: every specimen of a folder is a light, one that is wrong stops no other, and it goes on where it was stopped."""

from __future__ import annotations

import csv
import hashlib
import html
import json
import re
import shutil
import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner, Result

from calib.checks import Reason, Verdict, verdict_of
from calib.cli import app
from calib.decision import Batch, Inspected
from calib.decision.as_built import AsBuilt
from calib.decision.trend import trend_of
from calib.errors import InputError
from calib.experiment import Limit, Specification, read_sweeps
from calib.priors import Uniform
from calib.report import batch_page
from calib.runs import Run, batch_in, load_run, verify_batch
from calib.runs.batch import batch_csv
from calib.runs.export import NotUsableError
from calib.sampling.posterior import Posterior
from calib.sampling.storage import save_posterior
from models.analytic import ClosedForm
from models.sensor import design_from

SPECIFICATION = '[loads]\nforce = "2 N"\n[limits]\nstroke = { at_most = "0.1 mm" }\n'


def _press(folder: Path, name: str, seed: int, modulus: float = 0.62e6, thicker: float = 1.0, meter: bool = True) -> None:
    """Lab files of a specimen, drawn from the closed form: force over displacement, and capacitance over force."""
    layers = {"sensor_thickness": 0.74e-3, "padding_thickness": thicker * 1.1e-3, "relative_permittivity": 2.8}
    design = design_from({**layers, "young_modulus": modulus, "indenter_radius": 5e-3, "sensor_radius": 10e-3})
    rng, depth = np.random.default_rng(seed), np.linspace(-0.05e-3, 0.55e-3, 240)
    r = ClosedForm().respond(design, depth)
    force = r.force + 0.03 + 0.01 * rng.standard_normal(depth.size)
    reading = 1e3 * (depth + 0.05e-3 + 2e-6 * r.force)
    press = pd.DataFrame({"Displacement (mm)": reading, "Force (N)": force})
    press.to_csv(folder / f"{name}_press.csv", index=False, float_format="%.6f")
    if meter:
        capacitance = 1e12 * (r.capacitance + 0.4e-12 + 5e-15 * rng.standard_normal(depth.size))
        cap = pd.DataFrame({"Force (N)": force, "Cp (pF)": capacitance})
        cap.to_csv(folder / f"{name}_cap.csv", index=False, float_format="%.6f")


@pytest.fixture(scope="module")
def run(make_posterior: Callable[..., Posterior], tmp_path_factory: pytest.TempPathFactory) -> Run:
    """The calibration of two sensors of one material, without reproach."""
    folder = tmp_path_factory.mktemp("lot") / "run"
    folder.mkdir()
    save_posterior(make_posterior(), folder / "posterior.nc", ClosedForm())
    return _judged(load_run(folder), verdict_of([]))


def _judged(run: Run, verdict: Verdict) -> Run:
    again = replace(run)
    vars(again)["verdict"] = verdict
    return again


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two sound specimens, one much stiffer, one without a meter, one with it alone, a copy, a torn file, a link, a picture."""
    folder = tmp_path_factory.mktemp("lab")
    _press(folder, "s01", 1)
    _press(folder, "s02", 2)
    _press(folder, "s03", 3, modulus=1.9e6)
    _press(folder, "s04", 4, meter=False)
    log = pd.DataFrame({"Time (s)": np.arange(50.0), "Cp (pF)": 97.0 + 0.01 * np.arange(50.0)})
    log.to_csv(folder / "s08_cap.csv", index=False)
    for kind in ("press", "cap"):
        shutil.copy(folder / f"s02_{kind}.csv", folder / f"s05_{kind}.csv")
    (folder / "s06_press.csv").write_bytes(b"\x07\x00\x9f torn off here" * 20)
    (folder / "s07_press.csv").symlink_to("s07_press.csv")
    (folder / "setup.jpg").write_bytes(b"\xff\xd8")
    return folder


class _Counting(Executor):
    """An executor that does at once what it is given, and knows how much that was; it may stop like a killed process."""

    def __init__(self, most: int = 1000) -> None:
        self.names: list[str] = []
        self.most = most

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        if len(self.names) >= self.most:
            threading.Timer(0.5, future.set_exception, [KeyboardInterrupt()]).start()
            return future
        self.names.append(args[1].name)
        future.set_result(fn(*args, **kwargs))
        return future


@pytest.fixture(scope="module")
def made(run: Run, lab: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Batch, Path]:
    """The batch of that folder, and where it was written."""
    folder = tmp_path_factory.mktemp("made") / "batch"
    return batch_in(run, lab, folder, _Counting(), like="sensor 1", seed=1, chain_seconds=0.0), folder


def _row(batch: Batch, name: str) -> Inspected:
    return next(row for row in batch.rows if row.name == name)


def _gates(row: Inspected) -> set[str]:
    return {reason.gate for reason in row.verdict.reasons}


def test_a_sound_specimen_is_known_as_well_as_its_readings_tell(made: tuple[Batch, Path]) -> None:
    row = _row(made[0], "s01")
    assert (row.light, row.own, row.belongs) == ("amber", (), "not told")
    (blind,) = made[0].of_lot.reasons  # a lot of two hardly knows how much its specimens differ
    assert "hardly told: one whose Young's modulus of the sensor is 25 % off would lie " in blind.finding
    assert row.how == "weighted draws"
    for quantity, truth in (("sensor_thickness", 0.74e-3), ("padding_thickness", 1.1e-3), ("young_modulus", 0.62e6)):
        mean, sd, low, high = row.estimates[quantity]
        assert low < mean < high
        assert abs(mean - truth) < 4 * sd


def test_what_does_not_belong_is_red_and_says_in_what(made: tuple[Batch, Path]) -> None:
    row = _row(made[0], "s03")
    assert row.light == "red"
    assert "belongs" in _gates(row)
    assert "does not belong to the lot" in next(r.finding for r in row.verdict.reasons if r.gate == "belongs")


def test_a_specimen_without_its_meter_is_no_better_than_amber(made: tuple[Batch, Path]) -> None:
    row = _row(made[0], "s04")
    assert row.light == "amber"
    assert "no capacitance" in row.verdict.reasons[0].finding
    assert row.belongs == "not told"


def test_a_meter_file_that_belongs_to_no_press_is_named(made: tuple[Batch, Path]) -> None:
    row = _row(made[0], "s08")
    assert row.light == "red"
    assert "s08_cap.csv" in row.verdict.reasons[0].finding


def test_no_number_stands_anywhere_of_what_must_not_be_used(made: tuple[Batch, Path]) -> None:
    batch, folder = made
    red = [row for row in batch.rows if row.verdict.colour == "red"]
    assert {"s02", "s03"} <= {row.name for row in red}
    with (folder / "batch.csv").open(encoding="utf-8", newline="") as file:
        cells = {line["specimen"]: line for line in csv.DictReader(file)}
    assert cells["s01"]["young_modulus"] != ""
    for row in red:
        assert not row.estimates
        assert row.conformity is None
        assert {cells[row.name][name] for name in ("young_modulus", "signal", "probability_of_conformity")} == {""}


def test_copies_are_red_on_both_sides_and_a_torn_file_is_a_red_row(made: tuple[Batch, Path]) -> None:
    batch = made[0]
    for name, other in (("s02", "s05"), ("s05", "s02")):
        row = _row(batch, name)
        assert row.light == "red"
        assert f"same bytes as those of {other}" in row.verdict.reasons[0].finding
    for name in ("s06_press.csv", "s07_press.csv"):
        torn = _row(batch, name)
        assert (torn.light, torn.how) == ("red", "none")
        assert torn.verdict.reasons[0].action.endswith("if it is no lab file")
    assert [file for file, _ in batch.left_out] == ["setup.jpg"]
    assert batch.verdict.colour == "red"


def test_files_of_the_lot_itself_are_not_counted_twice(run: Run, lab: Path, tmp_path: Path) -> None:
    sweeps = run.posterior.sweeps
    folder = tmp_path / "lab"
    folder.mkdir()
    _press(folder, "s01", 1)
    digest = hashlib.sha256((folder / "s01_press.csv").read_bytes()).hexdigest()
    own = replace(sweeps[0], files=(("s01_press.csv", digest),))
    posterior = replace(run.posterior, sweeps=(own, *sweeps[1:]))
    again = _judged(Run(run.folder, posterior, run.forward, run.posterior_sha256), verdict_of([]))
    found = batch_in(again, folder, tmp_path / "batch", _Counting(), like="sensor 1")
    assert found.rows[0].light == "red"
    assert "those of sensor 1 of the lot" in found.rows[0].verdict.reasons[0].finding


def _cut(path: Path, before: int, after: int) -> str:
    """What a file has left without some rows at either end."""
    head, *rows = path.read_text(encoding="utf-8").splitlines(keepends=True)
    return head + "".join(rows[before : len(rows) - after])


def test_a_specimen_of_the_lot_is_known_again_though_its_files_were_cut(run: Run, tmp_path: Path) -> None:
    lab, again = tmp_path / "lab", tmp_path / "again"
    lab.mkdir()
    again.mkdir()
    _press(lab, "lot1", 1)
    _press(again, "s01", 2)
    files = tuple((name, hashlib.sha256((lab / name).read_bytes()).hexdigest()) for name in ("lot1_press.csv", "lot1_cap.csv"))
    for kind in ("press", "cap"):
        # One lacks readings at both ends, and another one some before contact, which moves few of the points that a run keeps.
        (again / f"s02_{kind}.csv").write_text(_cut(lab / f"lot1_{kind}.csv", 3, 60), encoding="utf-8")
        (again / f"s03_{kind}.csv").write_text(_cut(lab / f"lot1_{kind}.csv", 2, 0), encoding="utf-8")
    first, *others = run.posterior.experiment.specimens
    entry = replace(first.sweeps[0], force=lab / "lot1_press.csv", capacitance=lab / "lot1_cap.csv")
    experiment = replace(run.posterior.experiment, specimens=(replace(first, sweeps=(entry,)), *others))
    sweeps = run.posterior.sweeps
    (read,) = read_sweeps(replace(experiment, specimens=(replace(first, sweeps=(entry,)),)))
    for lies_there in (True, False):
        kept = replace(sweeps[0] if lies_there else read, specimen="sensor 1", files=files)
        posterior = replace(run.posterior, experiment=experiment, sweeps=(kept, *sweeps[1:]))
        known = _judged(Run(run.folder, posterior, run.forward, run.posterior_sha256), verdict_of([]))
        if not lies_there:
            shutil.rmtree(lab)
            (again / "s02_press.csv").unlink()
            (again / "s02_cap.csv").unlink()
        batch = batch_in(known, again, tmp_path / f"batch {lies_there}", _Counting(), like="sensor 1", chain_seconds=0.0)
        assert _row(batch, "s01").light != "red"
        for name in ("s02", "s03") if lies_there else ("s03",):
            row = _row(batch, name)
            assert (row.light, row.how) == ("red", "none")
            assert "readings are those of sensor 1 of the lot, which counts them already" in row.verdict.reasons[0].finding


def test_a_part_of_another_ones_files_is_red_on_both_sides(run: Run, tmp_path: Path) -> None:
    for name, seed in (("s01", 1), ("s02", 2)):
        _press(tmp_path, name, seed)
    for kind in ("press", "cap"):
        (tmp_path / f"s03_{kind}.csv").write_text(_cut(tmp_path / f"s01_{kind}.csv", 5, 9), encoding="utf-8")
    batch = batch_in(run, tmp_path, tmp_path / "batch", _Counting(), like="sensor 1", chain_seconds=0.0)
    for name, other in (("s01", "s03"), ("s03", "s01")):
        (reason,) = _row(batch, name).verdict.reasons
        assert reason.level == "red"
        assert f"its readings, or a part, are those of {other}" in reason.finding
    assert _row(batch, "s02").light != "red"


def _resampled(path: Path) -> str:
    """A file of readings, two thirds as many, each between two of the first."""
    table = pd.read_csv(path)
    at = np.arange(0.25, len(table) - 1, 1.5)
    values = {name: np.interp(at, np.arange(len(table)), table[name]) for name in table}
    return str(pd.DataFrame(values).to_csv(index=False, float_format="%.6f"))


@pytest.mark.parametrize(("every", "first"), [(2, 0), (3, 1)])
def test_a_press_that_was_thinned_out_is_red_on_both_sides(every: int, first: int, run: Run, tmp_path: Path) -> None:
    for name, seed in (("s01", 1), ("s02", 2)):
        _press(tmp_path, name, seed)
    for kind in ("press", "cap"):
        table = pd.read_csv(tmp_path / f"s01_{kind}.csv")
        table[first::every].to_csv(tmp_path / f"s03_{kind}.csv", index=False, float_format="%.6f")
    batch = batch_in(run, tmp_path, tmp_path / "batch", _Counting(), like="sensor 1", chain_seconds=0.0)
    assert {row.name for row in batch.rows if row.light == "red"} == {"s01", "s03"}
    assert "its readings, or a part, are those of s03" in _row(batch, "s01").verdict.reasons[0].finding


def test_a_press_that_was_resampled_is_red_on_both_sides(run: Run, tmp_path: Path) -> None:
    for name, seed in (("s01", 1), ("s02", 2)):
        _press(tmp_path, name, seed)
    for kind in ("press", "cap"):
        (tmp_path / f"s03_{kind}.csv").write_text(_resampled(tmp_path / f"s01_{kind}.csv"), encoding="utf-8")
    batch = batch_in(run, tmp_path, tmp_path / "batch", _Counting(), like="sensor 1", chain_seconds=0.0)
    for name, other in (("s01", "s03"), ("s03", "s01")):
        row = _row(batch, name)
        assert row.light == "red"
        assert not row.estimates
        assert f"readings are those of {other}, saved in another way" in row.verdict.reasons[0].finding
    assert _row(batch, "s02").light != "red"


def test_a_label_that_is_that_of_another_newcomer_is_amber(run: Run, tmp_path: Path) -> None:
    for name, seed, label in (("s01", 1, "s02"), ("s02", 2, "s02"), ("s03", 3, "s03")):
        _press(tmp_path, name, seed)
        press = tmp_path / f"{name}_press.csv"
        press.write_text(f"Specimen label: {label}\n" + press.read_text(encoding="utf-8"), encoding="utf-8")
    batch = batch_in(run, tmp_path, tmp_path / "batch", _Counting(), like="sensor 1", chain_seconds=0.0)
    assert {row.name for row in batch.rows if "names" in _gates(row)} == {"s01"}
    (reason,) = (r for r in _row(batch, "s01").verdict.reasons if r.gate == "names")
    assert reason.finding == 'its file s01_press.csv says "s02" like one of s02'
    assert _row(batch, "s01").light == "amber"


def test_a_batch_goes_on_where_it_was_stopped_and_computes_again_what_has_changed(run: Run, lab: Path, tmp_path: Path) -> None:
    folder, mine = tmp_path / "batch", tmp_path / "lab"
    mine.mkdir()
    for k in (1, 2, 3):
        _press(mine, f"s0{k}", k)
    given: dict[str, Any] = {"like": "sensor 1", "chain_seconds": 0.0}
    with pytest.raises(KeyboardInterrupt):
        batch_in(run, mine, folder, _Counting(most=2), **given)
    kept = (folder / "inspected.jsonl").read_text(encoding="utf-8")
    assert len(kept.splitlines()) == 3  # which lot and files it is of, and the two that were done
    assert not (folder / "batch.json").exists()
    counting = _Counting()
    whole = batch_in(run, mine, folder, counting, **given)
    assert len(counting.names) == 1
    assert [row.name for row in whole.rows] == ["s01", "s02", "s03"]
    # A line that was not written to its end, or was changed, counts for nothing.
    of, *lines = (folder / "inspected.jsonl").read_text(encoding="utf-8").splitlines(keepends=True)
    changed = lines[0].replace('"effective":', '"effective": 1e9, "was":')
    (folder / "inspected.jsonl").write_text(of + changed + lines[1] + lines[2][:100], encoding="utf-8")
    _press(mine, "s02", 22)
    counting = _Counting()
    again = batch_in(run, mine, folder, counting, **given)
    assert len(counting.names) == len({json.loads(lines[0])["row"]["name"], json.loads(lines[2])["row"]["name"], "s02"})
    assert _row(again, "s01").estimates == _row(whole, "s01").estimates
    assert _row(again, "s02").estimates != _row(whole, "s02").estimates


def test_a_batch_takes_no_other_ones_place(run: Run, tmp_path: Path) -> None:
    folder, monday, tuesday = (tmp_path / name for name in ("out", "monday", "tuesday"))
    for k, week in enumerate((monday, tuesday)):
        week.mkdir()
        _press(week, f"s0{k}", k)
    given: dict[str, Any] = {"like": "sensor 1", "chain_seconds": 0.0}

    def make(files: Path, of: Run = run) -> list[str]:
        counting = _Counting()
        batch_in(of, files, folder, counting, **given)
        return counting.names

    def state() -> dict[str, bytes]:
        return {path.name: path.read_bytes() for path in folder.iterdir()}

    make(monday)
    before = state()
    with pytest.raises(InputError, match="would take its place") as refused:
        make(tuesday)
    (fault,) = refused.value.faults
    assert f"the batch of {monday} (1 specimen), given the lot {run.folder}" in fault.message
    assert "Choose another -o" in str(fault.advice)
    other = _judged(Run(tmp_path / "other", run.posterior, run.forward, "f" * 64), verdict_of([]))
    with pytest.raises(InputError, match="would take its place"):
        make(monday, other)
    # Nor does it while the first is not finished, or an older version wrote it.
    finished = folder / "batch.json"
    record = finished.read_bytes()
    finished.unlink()
    with pytest.raises(InputError, match="would take its place"):
        make(tuesday)
    finished.write_bytes(record)
    (folder / "inspected.jsonl").write_text("", encoding="utf-8")
    with pytest.raises(InputError, match="would take its place"):
        make(tuesday)
    for name, content in before.items():
        (folder / name).write_bytes(content)
    # The same files and lot go on, also from another place; more of them are added.
    assert make(monday) == []
    moved = tmp_path / "moved"
    monday.rename(moved)
    _press(moved, "s09", 9)
    assert make(moved) == ["s09"]
    (folder / "batch.json").write_text("{}", encoding="utf-8")
    (folder / "inspected.jsonl").unlink()
    with pytest.raises(InputError, match="does not say of which lab files"):
        make(moved)


def test_what_was_written_agrees_and_a_change_of_it_is_found(made: tuple[Batch, Path], lab: Path, tmp_path: Path) -> None:
    batch, folder = made
    rows = list(csv.DictReader((folder / "batch.csv").read_text(encoding="utf-8").splitlines()))
    assert [row["specimen"] for row in rows] == [row.name for row in batch.rows]
    assert float(rows[0]["young_modulus"]) == pytest.approx(batch.rows[0].estimates["young_modulus"][0], rel=1e-5)
    record = json.loads((folder / "batch.json").read_text(encoding="utf-8"))
    assert record["lot"]["updated"] is False
    assert record["lights"] == {light: batch.count(light) for light in ("green", "amber", "red")}
    assert {finding.state for finding in verify_batch(folder)} == {"fine"}
    copy = tmp_path / "copy"
    shutil.copytree(folder, copy)
    with (copy / "batch.csv").open("a", encoding="utf-8") as file:
        file.write("\n")
    assert [f.name for f in verify_batch(copy) if f.state != "fine"] == ["batch.csv"]


def test_the_page_says_what_is_wrong_and_escapes_names(made: tuple[Batch, Path]) -> None:
    batch = made[0]
    page = batch_page(replace(batch, rows=(replace(batch.rows[0], name="<b>=1+1</b>"), *batch.rows[1:])))
    assert "&lt;b&gt;=1+1&lt;/b&gt;" in page
    assert "does not belong to the lot" in page
    assert "The lot is not updated by these specimens" in page
    assert 'src="http' not in page


def test_a_batch_holds_for_what_its_lot_does(made: tuple[Batch, Path]) -> None:
    batch, folder = made
    told = "; ".join(batch.conditions)
    assert "padding bonded to the rigid base" in told
    (more,) = re.findall(
        r"a load cell that has come to read 1 % too low makes moduli 1 % too small, .* (\S+) % too large;", told
    )
    assert 0.5 < float(more) < 1.1
    assert "ball radius 5 mm, pressed without friction" in told
    assert told in html.unescape((folder / "batch.html").read_text(encoding="utf-8"))
    assert json.loads((folder / "batch.json").read_text(encoding="utf-8"))["conditions"] == list(batch.conditions)


def test_both_risks_are_those_of_what_passes_and_of_what_fails(made: tuple[Batch, Path]) -> None:
    sound = replace(_row(made[0], "s01"), verdict=verdict_of([]))

    def judged(probability: float, accepted: bool) -> Inspected:
        nan = float("nan")
        return replace(sound, conformity=AsBuilt(probability, 0.01, accepted, {}, 0.0, nan, nan))

    rows = (judged(0.99, True), judged(0.97, True), judged(0.5, False), replace(sound, conformity=None))
    risks = replace(made[0], rows=rows).risks
    assert risks is not None
    assert risks.consumers == pytest.approx((0.01 + 0.03) / 3)
    assert risks.producers == pytest.approx(0.5 / 3)
    stranger = replace(rows[0], verdict=verdict_of([Reason("belongs", "amber", "it does not belong", "Set it aside")]))
    assert replace(made[0], rows=(*rows, stranger)).risks == risks
    assert [row.light for row in rows] == ["green", "green", "red", "green"]
    table = batch_csv(replace(made[0], rows=rows)).splitlines()
    assert [line.split(",")[4] for line in table[1:]] == ["pass", "pass", "fail", "none"]


def test_a_drift_is_told_and_none_is_where_there_is_none() -> None:
    rng = np.random.default_rng(4)
    place = np.arange(40.0)
    sound = [trend_of("signal", place, 1 + 0.03 * rng.standard_normal(40), "name").drifts for _ in range(300)]
    assert sum(sound) <= 9
    drifting = trend_of("signal", place, 1 + 0.03 * rng.standard_normal(40) + 0.1 * place / 39, "name")
    assert drifting.drifts
    assert drifting.interval[0] < 0.1 < drifting.interval[1]
    # One that is far off makes no drift.
    value = 1 + 0.03 * rng.standard_normal(40)
    value[-1] = 9.0
    assert not trend_of("signal", place, value, "name").drifts
    # No share falls by more than all of it, however few and scattered.
    falling = trend_of("signal", np.arange(6.0), np.array([2.3, 0.4, 2.2, 0.3, 1.2, 0.2]), "name")
    assert -1 < falling.interval[0] < falling.change < 0
    assert "too few" in trend_of("signal", place[:4], value[:4], "name").in_words("the signal")


def test_a_red_lot_makes_no_batch_and_an_amber_one_no_green_light(run: Run, lab: Path, tmp_path: Path) -> None:
    red = _judged(run, verdict_of([Reason("convergence", "red", "the chains have not converged", "Go on")]))
    with pytest.raises(NotUsableError):
        batch_in(red, lab, tmp_path / "batch", like="sensor 1")
    assert not (tmp_path / "batch").exists()
    folder = tmp_path / "lab"
    folder.mkdir()
    _press(folder, "s01", 1)
    amber = _judged(run, verdict_of([Reason("model", "amber", "another model describes these data better", "Compare")]))
    batch = batch_in(amber, folder, tmp_path / "batch", _Counting(), like="sensor 1")
    assert [(row.light, row.own) for row in batch.rows] == [("amber", ())]
    assert "another model describes these data better" in {reason.finding for reason in batch.of_lot.reasons}
    assert batch.verdict.colour == "amber"


def test_what_draws_cannot_tell_and_balls_that_nobody_pressed_with_are_amber(run: Run, lab: Path, tmp_path: Path) -> None:
    folder = tmp_path / "lab"
    folder.mkdir()
    _press(folder, "s01", 1)
    limits = (Limit("height", "at_most", 9e-3),)
    asked = Specification(limits, (2.0,), probability=0.999999, ball=Uniform(100.0, 300.0), by_curvature=True)
    batch = batch_in(run, folder, tmp_path / "batch", _Counting(), like="sensor 1", specification=asked)
    (row,) = batch.rows
    assert row.conformity is not None
    told = {reason.gate: reason for reason in row.verdict.reasons}
    assert "leave open on which side of 99.9999 %" in told["specification"].finding
    assert re.match(r"Ask for [0-9.]+ % at most", told["specification"].action)
    assert "balls of 3.45 and 9.09 mm radius (measured with 5 mm)" in told["extrapolation"].finding
    assert row.light == "amber"


def _lit(row: Inspected, name: str, z: float, *reasons: Reason, passes: bool | None = None) -> Inspected:
    """A row as of a specimen that lies off its lot by z, with its reasons and whether it passes a specification."""
    shift = replace(row.strangers[0], specimen=name, quantity="young_modulus", z=z)
    nan = float("nan")
    judged = None if passes is None else AsBuilt(0.99 if passes else 0.5, 0.01, passes, {}, 0.0, nan, nan)
    return replace(row, name=name, strangers=(shift,), verdict=verdict_of(reasons), conformity=judged)


def test_what_does_not_belong_stands_out_of_an_amber_lot_that_is_told_once(made: tuple[Batch, Path]) -> None:
    against = Reason("lot", "amber", "the data pull against what was believed before", "Measure the padding again")
    strange = Reason("belongs", "amber", "it does not belong to the lot: s07 is 33 % stiffer", "Set it aside")
    sound = _row(made[0], "s01")
    rows = [_lit(sound, f"s{k:02}", 0.4, against) for k in range(5)]
    batch = replace(made[0], rows=(*rows, _lit(sound, "s07", 3.5, strange, against)), against=(against,), left_out=())
    assert [(row.light, row.belongs) for row in batch.rows] == [*[("amber", "yes")] * 5, ("red", "no")]
    assert [row.own for row in rows] == [()] * 5
    assert (batch.of_lot.colour, batch.verdict.colour) == ("amber", "red")
    page, table = batch_page(batch), batch_csv(batch)
    assert page.count("pull against what was believed before") == 1
    assert page.index("pull against") < page.index("1 of 6 specimens is red")
    assert "pull against" not in table
    read = list(csv.DictReader(table.splitlines()))
    assert [(r["light"], r["lot_light"], r["belongs"]) for r in read[-2:]] == [
        ("amber", "amber", "yes"),
        ("red", "amber", "no"),
    ]
    assert read[-1]["reasons"] == "red, belongs: it does not belong to the lot: s07 is 33 % stiffer"
    # Its numbers are not struck out: they are those of its own readings.
    assert 'class="unusable"' not in page


def test_what_does_not_belong_and_passes_all_the_same_is_amber_and_what_fails_is_red(made: tuple[Batch, Path]) -> None:
    strange = Reason("belongs", "amber", "it does not belong to the lot", "Set it aside")
    sound = _row(made[0], "s01")
    lights = [_lit(sound, "s07", 3.5, strange, passes=passes).light for passes in (True, False, None)]
    assert lights == ["amber", "red", "red"]
    assert _lit(sound, "s01", 0.4, passes=True).light == "green"


def test_a_folder_without_lab_files_is_refused_and_nothing_is_left(run: Run, tmp_path: Path) -> None:
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(InputError, match="there is no file in this folder"):
        batch_in(run, empty, tmp_path / "batch", like="sensor 1")
    (empty / "setup.jpg").write_bytes(b"\xff\xd8")
    with pytest.raises(InputError, match=r"no lab file in this folder, only setup\.jpg"):
        batch_in(run, empty, tmp_path / "batch", like="sensor 1")
    assert not (tmp_path / "batch").exists()


def _run(*words: object) -> Result:
    return CliRunner().invoke(app, [str(w) for w in words])


def test_the_command_says_the_lights_and_ends_with_3_where_one_is_red(run: Run, lab: Path, tmp_path: Path) -> None:
    folder = tmp_path / "lab"
    folder.mkdir()
    _press(folder, "s01", 1)
    spec = tmp_path / "spec.toml"
    spec.write_text(SPECIFICATION, encoding="utf-8")
    words = ("batch", run.folder, folder, "--like", "sensor 1", "--processes", 1, "--spec", spec)
    result = _run(*words)
    said = " ".join((result.stdout + result.stderr).split())
    assert result.exit_code == 3, said
    assert "The specimen is not shown to conform to the specification: s01" in said
    assert result.stderr.splitlines()[-1] == "Exit code 3: all is written, and red is s01: set them aside."
    assert sorted(p.name for p in (tmp_path / "lab_batch").iterdir()) == [
        "batch.csv",
        "batch.html",
        "batch.json",
        "inspected.jsonl",
    ]
    assert "which they do not update" in said
    assert _run("verify", tmp_path / "lab_batch").exit_code == 0
    bad = _run("batch", run.folder, folder)
    assert bad.exit_code == 2
    assert "--like NAME (sensor 1, sensor 2)" in " ".join(bad.stderr.split())
