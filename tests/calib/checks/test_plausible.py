"""What is implausible before anything is sampled: sound labs pass, planted slips are named; and what the data will tell."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from calib.checks import Plausibility, in_units, plausibility, scaled, ways_out
from calib.checks.plausible.base_friction import COEFFICIENT
from calib.checks.plausible.ranges import UNLIKELY, Range, farthest, ranges_of
from calib.checks.plausible.slips import slips_of
from calib.errors import Fault, InputError
from calib.experiment import Experiment, Specimen, SweepFiles
from calib.lab import Points, Sweep, repeated_channels
from calib.lab.reduction import NoiseEstimate
from calib.priors import Fixed, HalfNormal, LogNormal, Normal, Prior, TruncatedNormal, Uniform
from calib.problem import build_problem, log_likelihood
from calib.problem.synthetic import Rig, synthetic_sweep
from calib.runs.before import kept_reasons
from calib.sampling import first_answer
from models.analytic import ClosedForm
from models.response import Forward
from models.sensor import design_from
from models.surrogate import FAMILIES, load_surrogate

TRUTH: dict[str, float] = {
    "young_modulus": 0.62e6,
    "relative_permittivity": 2.83,
    "sensor_radius": 10e-3,
    "sensor_thickness": 0.75e-3,
    "padding_thickness": 1.62e-3,
    "dielectric_thickness": 0.16e-3,
}
PRIORS: dict[str, Prior] = {
    "young_modulus": LogNormal(0.7e6, 1.6),
    "relative_permittivity": Normal(2.8, 0.15),
    "parasitic_capacitance": Normal(0.0, 0.5e-12),
}


@dataclass(frozen=True)
class Lab:
    """An experiment and its sweeps, measured by the closed form."""

    experiment: Experiment
    sweeps: tuple[Sweep, ...]

    def sweep(self, change: Callable[[Sweep], Sweep]) -> Lab:
        """The same with all sweeps changed."""
        return replace(self, sweeps=tuple(change(s) for s in self.sweeps))

    def shared(self, **priors: Prior) -> Lab:
        """The same with other priors of material and rig."""
        return replace(self, experiment=replace(self.experiment, priors={**self.experiment.priors, **priors}))

    def thickness(self, name: str, k: float) -> Lab:
        """The same with a thickness of every specimen entered as k times what it is."""
        own = tuple(replace(s, priors={**s.priors, name: scaled(s.priors[name], k)}) for s in self.experiment.specimens)
        return replace(self, experiment=replace(self.experiment, specimens=own))

    def check(self) -> Plausibility:
        """What is said of it."""
        return plausibility(build_problem(self.experiment, self.sweeps, ClosedForm()))


def _lab(
    seed: int = 0,
    *,
    force_alone: bool = False,
    others: Mapping[str, float] | None = None,
    load_step: float = 0.0,
    compliance: float = 1e-6,
) -> Lab:
    """One specimen; or two, if what differs in the second is given."""
    rng = np.random.default_rng(seed)
    names = ["sensor 1"] if others is None else ["sensor 1", "sensor 2"]
    specimens: list[Specimen] = []
    sweeps: list[Sweep] = []
    for name in names:
        truth = {**TRUTH, **((others or {}) if name == "sensor 2" else {})}
        design = design_from({**truth, "indenter_radius": 5e-3})
        rig = Rig(0.1e-3, compliance, 0.2, 0.2e-12, load_step=load_step)
        tie: Literal["none", "force"] = "none" if force_alone else "force"
        sweep = synthetic_sweep(ClosedForm(), design, 0.55e-3, rig, rng, specimen=name, tie=tie, n_points=16)
        sweeps.append(_recorded(sweep, len(sweeps)))
        sds = {"sensor_thickness": 0.02e-3, "padding_thickness": 0.02e-3, "dielectric_thickness": 0.006e-3}
        thick = {n: Normal(truth[n], sd) for n, sd in sds.items()}
        specimens.append(Specimen(name, (SweepFiles("", None, None, 5e-3),), thick))
    experiment = Experiment(
        "lab", Path("experiment.toml"), "", 5e-3, 10e-3, "sensor", PRIORS, tuple(specimens), "closed form", "on"
    )
    return Lab(experiment, tuple(sweeps))


def _recorded(sweep: Sweep, seed: int) -> Sweep:
    """The same with noise in the tester's record, which synthetic sweeps have none of."""
    assert sweep.track is not None
    noise = sweep.noise["force"] * np.random.default_rng([seed, 1]).standard_normal(sweep.track.force.size)
    return replace(sweep, track=replace(sweep.track, force=sweep.track.force + noise))


def _times_force(k: float) -> Callable[[Sweep], Sweep]:
    def change(sweep: Sweep) -> Sweep:
        def points(name: str, p: Points) -> Points:
            force = None if p.force is None else k * p.force
            return replace(p, value=k * p.value if name == "force" else p.value, force=force)

        channels = {name: points(name, p) for name, p in sweep.channels.items()}
        return replace(sweep, channels=channels, noise={**sweep.noise, "force": k * sweep.noise["force"]})

    return change


def _times_travel(k: float) -> Callable[[Sweep], Sweep]:
    def change(sweep: Sweep) -> Sweep:
        def points(p: Points) -> Points:
            return p if p.displacement is None else replace(p, displacement=k * p.displacement)

        assert sweep.track is not None
        track = replace(sweep.track, displacement=k * sweep.track.displacement)
        return replace(sweep, channels={name: points(p) for name, p in sweep.channels.items()}, track=track)

    return change


def _said(found: Plausibility) -> str:
    return "\n".join(f"{r.level} {r.gate}: {r.finding}. {r.action}" for r in found.reasons)


# --- sound labs, and slips ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("force_alone", [False, True], ids=["force and capacitance", "force alone"])
@pytest.mark.parametrize("seed", range(3))
def test_nothing_is_said_against_a_sound_lab(seed: int, force_alone: bool) -> None:
    found = _lab(seed, force_alone=force_alone).check()
    assert not found.reasons, _said(found)
    assert found.first is not None
    assert found.outlook is not None


@pytest.mark.parametrize("force_alone", [False, True], ids=["force and capacitance", "force alone"])
def test_a_diameter_of_the_ball_for_its_radius_is_asked_for(force_alone: bool) -> None:
    lab = _lab(force_alone=force_alone).sweep(lambda s: replace(s, indenter_radius=2 * s.indenter_radius))
    said = _said(lab.check())
    assert "half this radius of the ball (5 mm)" in said
    assert "young_modulus about 0.6" in said
    assert "whether its diameter was entered for its radius" in said


def test_newtons_called_kilonewtons_are_red_and_named() -> None:
    found = _lab(force_alone=True).sweep(_times_force(1e3)).check()
    assert found.verdict.colour == "red"
    assert found.outlook is None
    (reason,) = found.reasons
    assert reason.gate == "force"
    assert "N measured" in reason.finding
    assert "unit of the force column: with a thousandth of this force" in reason.action


def test_a_modulus_in_kilopascals_is_red_and_named() -> None:
    found = _lab(force_alone=True).shared(young_modulus=LogNormal(0.7e3, 1.6)).check()
    assert found.verdict.colour == "red"
    assert "unit of young_modulus: kPa or MPa" in _said(found)


def test_a_diameter_of_the_disc_is_red_and_told_as_a_permittivity() -> None:
    lab = _lab()
    found = replace(lab, experiment=replace(lab.experiment, sensor_radius=20e-3)).check()
    assert found.verdict.colour == "red"
    said = _said(found)
    assert "it means a relative permittivity of 0.7" in said
    assert "with half this radius of the sensor's disc all would be as expected" in said


def test_a_dielectric_that_is_both_dielectrics_is_asked_for() -> None:
    lab = _lab()
    found = lab.thickness("dielectric_thickness", 2.0).check()
    assert found.verdict.colour == "red"
    assert "number of dielectrics" in _said(found)


def test_noise_in_the_place_of_a_capacitance_is_red() -> None:
    rng = np.random.default_rng(3)

    def noisy(sweep: Sweep) -> Sweep:
        points = sweep.channels["capacitance"]
        value = points.value[0] + 1e-14 * rng.standard_normal(points.value.size)
        return replace(sweep, channels={**sweep.channels, "capacitance": replace(points, value=value)})

    found = _lab().sweep(noisy).check()
    assert found.verdict.colour == "red"
    assert "a capacitance change of" in _said(found)


def test_files_of_two_specimens_that_are_mixed_up_are_asked_for() -> None:
    lab = _lab(others={"sensor_thickness": 0.95e-3, "padding_thickness": 2.4e-3})
    one, other = lab.sweeps
    mixed = replace(lab, sweeps=(replace(other, specimen=one.specimen), replace(one, specimen=other.specimen)))
    assert not lab.check().reasons
    said = _said(mixed.check())
    assert "files of sensor 1 and sensor 2 exchanged" in said


def test_a_mix_up_without_which_the_data_are_a_million_times_as_probable_is_red_though_no_prior_is_contradicted() -> None:
    lab = _lab(others={"dielectric_thickness": 0.186e-3})
    one, other = lab.sweeps
    changed = {"capacitance": one.channels["capacitance"]}, {"capacitance": other.channels["capacitance"]}
    mixed = replace(
        lab,
        sweeps=(
            replace(one, channels={**one.channels, **changed[1]}, clock_offset=other.clock_offset),
            replace(other, channels={**other.channels, **changed[0]}, clock_offset=one.clock_offset),
        ),
    )
    reasons = mixed.check().reasons
    assert {(r.gate, r.level) for r in reasons} == {("files", "red"), ("prior", "amber")}
    # Exchanging both files of the two does as well: it is one question, and one reason that names all ways.
    (said,) = (r.finding for r in reasons if r.gate == "files")
    both = r"exchanged \(or their capacitance files instead: 10\^\d+ times\) the data would be 10\^\d+ times as probable"
    assert re.search(rf"with the force and capacitance files of sensor 1 and sensor 2 {both}", said)


def test_a_thickness_that_no_gauge_could_tell_so_well_is_amber() -> None:
    lab = _lab()
    own = tuple(replace(s, priors={**s.priors, "sensor_thickness": Normal(0.75e-3, 2e-8)}) for s in lab.experiment.specimens)
    found = replace(lab, experiment=replace(lab.experiment, specimens=own)).check()
    assert "the prior of sensor_thickness[sensor 1] knows it to 20 nm" in _said(found)
    assert found.verdict.colour == "amber"


@pytest.mark.parametrize(("low", "high", "side"), [(0.3e6, 0.6e6, "most"), (0.65e6, 2e6, "least")])
def test_a_truth_beyond_the_end_of_a_prior_is_amber_and_the_end_is_named(low: float, high: float, side: str) -> None:
    found = _lab().shared(young_modulus=Uniform(low, high)).check()
    (reason,) = (r for r in found.reasons if r.gate == "prior")
    end = high if side == "most" else low
    assert "young_modulus at the end of its prior: about 0." in reason.finding
    assert f"at {side} {end / 1e6:g} MPa allowed" in reason.finding


def test_a_prior_that_ends_where_there_is_nothing_beyond_may_be_leant_on() -> None:
    assert not _lab(compliance=0.0).shared(machine_compliance=Uniform(0.0, 1e-4)).check().reasons


def test_a_capacitance_of_another_specimen_is_not_green() -> None:
    lab = _lab()
    other = _lab(others={"sensor_thickness": 0.95e-3, "dielectric_thickness": 0.24e-3}).sweeps[1].channels["capacitance"]
    found = lab.sweep(lambda s: replace(s, channels={**s.channels, "capacitance": other})).check()
    assert found.verdict.colour != "green"


def test_one_file_that_was_entered_for_two_specimens_is_red() -> None:
    lab = _lab(others={"dielectric_thickness": 0.165e-3, "padding_thickness": 1.5e-3})
    first, second = (replace(s, files=(("log.csv", "ab" * 32),)) for s in lab.sweeps)
    apart = replace(lab, sweeps=(first, second)).check()
    assert "same readings" not in {reason.gate for reason in apart.reasons}
    twice = replace(second, channels={**second.channels, "capacitance": first.channels["capacitance"]})
    found = replace(lab, sweeps=(first, twice)).check()
    (reason,) = [r for r in found.reasons if r.gate == "same readings"]
    assert (found.verdict.colour, reason.level) == ("red", "red")
    assert reason.finding == "sensor 1 and sensor 2 have the same readings of capacitance"


def test_files_that_are_named_as_those_of_another_specimen_are_asked_for() -> None:
    lab = _lab(others={"dielectric_thickness": 0.165e-3})
    first, second = lab.experiment.specimens

    def found(of_first: str, of_second: str) -> Plausibility:
        specimens = [
            replace(s, sweeps=(replace(s.sweeps[0], force=Path(name)),)) for s, name in ((first, of_first), (second, of_second))
        ]
        return replace(lab, experiment=replace(lab.experiment, specimens=tuple(specimens))).check()

    assert not found("s1_press.csv", "s2_press.csv").reasons
    exchanged = found("s2_press.csv", "s1_press.csv")
    (reason,) = exchanged.reasons
    assert (reason.gate, reason.level) == ("names", "amber")
    assert "the file s2_press.csv, entered for sensor 1, is named like one of sensor 2" in reason.finding
    assert reason in kept_reasons(exchanged)  # a run keeps it


def _pressed(seed: int, step: float = 0.0) -> Sweep:
    """One press of 40 points of one truth, saved by itself; `step` [F] is the meter's."""
    design = design_from({**TRUTH, "indenter_radius": 5e-3})
    rig = Rig(0.1e-3, 1e-6, 0.2, 0.2e-12)
    rng = np.random.default_rng(seed)
    sweep = synthetic_sweep(ClosedForm(), design, 0.55e-3, rig, rng, specimen=f"sensor {seed}", tie="force", n_points=40)
    points = sweep.channels["capacitance"]
    read = points.value if step == 0 else step * np.round(points.value / step)
    told = NoiseEstimate(sweep.noise["capacitance"], 1.0, step, 1.0, 1000, 1000, 40, 0)
    channels = {**sweep.channels, "capacitance": replace(points, value=read)}
    own = replace(sweep, channels=channels, readings={"capacitance": told}, files=((f"{seed}.csv", f"{seed:064x}"),))
    return _recorded(own, seed)


def test_a_press_saved_anew_with_fewer_digits_is_known_by_its_noise() -> None:
    first = _pressed(1)
    points, noise = first.channels["capacitance"], first.noise["capacitance"]
    rounded = replace(points, value=points.value + np.random.default_rng(3).uniform(-0.2, 0.2, 40) * noise)
    again = replace(first, specimen="sensor 2", channels={"capacitance": rounded}, track=None, files=(("2.csv", "2" * 64),))
    assert repeated_channels(first, again) == ("capacitance",)


@pytest.mark.parametrize("cut", [0, 7])
def test_a_press_that_was_zeroed_is_known_again(cut: int) -> None:
    first = _pressed(1)
    points = first.channels["force"]
    assert points.displacement is not None
    zeroed = Points(points.value[cut:] - 0.3, points.n_effective[cut:], displacement=points.displacement[cut:] + 1e-3)
    again = replace(first, specimen="sensor 2", channels={"force": zeroed}, track=None, files=(("2.csv", "2" * 64),))
    assert repeated_channels(first, again) == ("force",)
    assert repeated_channels(again, first) == ("force",)


def test_readings_that_were_averaged_are_known_again() -> None:
    first = _pressed(1)
    points = first.channels["force"]
    assert points.displacement is not None
    between = 0.5 * (points.displacement[1:] + points.displacement[:-1])
    force = np.interp(between, points.displacement, points.value)
    averaged = Points(force, 2 * points.n_effective[1:], displacement=between)
    again = replace(first, specimen="sensor 2", channels={"force": averaged}, track=None, files=(("2.csv", "2" * 64),))
    assert repeated_channels(first, again) == ("force",)


@pytest.mark.parametrize("shift", [3.7e-6, 0.21e-3])
def test_readings_that_were_averaged_and_zeroed_anew_are_known_again(shift: float) -> None:
    first = replace(_pressed(1), contact=0.1e-3)
    points = first.channels["force"]
    assert points.displacement is not None
    between = 0.5 * (points.displacement[1:] + points.displacement[:-1])
    force = np.interp(between, points.displacement, points.value) - 0.2
    averaged = Points(force, 2 * points.n_effective[1:], displacement=between + shift)
    again = replace(
        first,
        specimen="sensor 2",
        channels={"force": averaged},
        track=None,
        files=(("2.csv", "2" * 64),),
        contact=first.contact + shift + 2e-6,  # as found in other bins
    )
    assert repeated_channels(first, again) == ("force",)


def test_presses_of_one_truth_are_not_one_record_whatever_the_step_of_the_meter() -> None:
    for step in (0.0, 5e-15, 1e-13):
        presses = [_pressed(seed, step) for seed in range(20)]
        assert not any(repeated_channels(a, b) for a, b in combinations(presses, 2))


def test_a_refusal_names_the_slip_that_is_behind_it() -> None:
    lab = _lab()
    fault = Fault("refused", Path("experiment.toml"))
    thin = lab.thickness("sensor_thickness", 0.1)
    first, *more = ways_out([fault], thin.experiment, thin.sweeps, ClosedForm())
    assert first is fault
    assert [m.message for m in more] == ["a slip may be the cause"]
    assert "decimal point of sensor_thickness: with ten times this sensor_thickness" in str(more[0])


def test_no_slip_is_named_where_none_helps() -> None:
    lab = _lab(force_alone=True).sweep(_times_force(0.02))
    found = lab.check()
    assert found.verdict.colour != "green"
    assert "would be as expected" not in found.reasons[0].action
    assert ways_out([], lab.experiment, lab.sweeps, ClosedForm()) == []


# --- slips and ranges by themselves -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "prior",
    [
        Normal(2.0, 0.3),
        LogNormal(0.7, 1.6),
        HalfNormal(3.0),
        Uniform(1.0, 2.0),
        TruncatedNormal(1.0, 0.5, 0.0, 3.0),
        Fixed(4.0),
    ],
    ids=lambda p: p.kind,
)
def test_a_scaled_prior_is_that_of_the_scaled_quantity(prior: Prior) -> None:
    z = np.linspace(-3, 3, 13)
    np.testing.assert_allclose(scaled(prior, 1000.0).ppf_normal(z), 1000.0 * prior.ppf_normal(z), rtol=1e-9)


def test_every_slip_has_a_slip_that_undoes_it_and_none_changes_what_it_is_not_about() -> None:
    lab = _lab(others={"sensor_thickness": 0.95e-3})
    slips = list(slips_of(lab.experiment, lab.sweeps))
    assert {s.gate for s in slips} >= {"ball", "sensor's disc", "thicknesses", "files", "unit of force", "unit of modulus"}
    for slip in slips:
        assert slip.experiment.specimens[0].name == "sensor 1"
        assert [s.title for s in slip.sweeps] == [s.title for s in lab.sweeps]
    halved = next(s for s in slips if s.without.startswith("half this radius of the ball"))
    back = next(s for s in slips_of(halved.experiment, halved.sweeps) if s.without.startswith("twice this radius of the ball"))
    assert [s.indenter_radius for s in back.sweeps] == [s.indenter_radius for s in lab.sweeps]


def test_force_that_the_model_does_not_reach_is_no_surprise() -> None:
    lab = _lab(force_alone=True)
    problem = build_problem(lab.experiment, lab.sweeps, ClosedForm())
    force = next(r for r in ranges_of(problem) if r.seen == "force")
    assert force.low < force.observed < force.high
    assert abs(force.away) < UNLIKELY


def test_the_depth_is_shown_and_not_judged_twice() -> None:
    far = Range("a", "depth", 1.0, 0.1, 0.05, 0.2, 50.0, 1.0)
    assert farthest([far, replace(far, seen="force", away=1.0)]) == 1.0


def test_numbers_have_three_digits_and_no_exponent() -> None:
    assert in_units("load_zero", 5001.2) == "5,001 N"
    assert in_units("young_modulus", 0.62e6, unit=False) == "0.620"
    assert in_units("parasitic_capacitance", 0.0) == "0 pF"


# --- what the data will tell --------------------------------------------------------------------------------------------


def test_what_the_data_will_tell_is_what_they_tell() -> None:
    found = _lab(force_alone=True).check()
    assert found.outlook is not None
    told = {str(t.name): t for t in found.outlook.unknowns}
    assert told["young_modulus"].contraction > 0.9
    assert told["young_modulus"].expected_sd < 0.3 * told["young_modulus"].prior_sd
    assert told["padding_thickness[sensor 1]"].contraction < 0.6
    assert told["padding_thickness[sensor 1]"].prior_sd == pytest.approx(0.02e-3, rel=1e-3)
    assert not any(name.endswith(("_noise", "_discrepancy")) for name in told)


def test_what_the_data_will_tell_of_a_lot_stands_before_what_they_tell_of_its_specimens() -> None:
    lab = _lab(force_alone=True)
    found = replace(lab, experiment=replace(lab.experiment, pooling="partial")).check()
    assert found.outlook is not None
    told = {str(t.name): t for t in found.outlook.unknowns}
    assert list(told)[:4] == ["young_modulus", "young_modulus_spread", "sensor_thickness", "sensor_thickness_spread"]
    assert told["young_modulus"].contraction > 0.9
    assert told["young_modulus"].expected_sd > told["young_modulus[sensor 1]"].expected_sd
    # Of one specimen nothing is learned of a spread, and of the lot's thickness hardly more than a microscope did.
    assert told["young_modulus_spread"].contraction < 0.15
    assert told["padding_thickness"].contraction < 0.6


def test_a_ridge_is_told_in_words_with_what_would_break_it() -> None:
    found = _lab().check()
    assert found.outlook is not None
    pairs = {frozenset(name.parameter for name in ridge.names): ridge for ridge in found.outlook.ridges}
    ridge = pairs[frozenset({"relative_permittivity", "dielectric_thickness"})]
    assert ridge.correlation > 0.6
    assert "what is left in doubt of one is of both" in ridge.in_words


@pytest.mark.parametrize("seed", [1, 4])
def test_a_tare_at_the_touch_is_said_to_do_what_it_does(seed: int) -> None:
    found = _lab(seed, force_alone=True).check()
    assert found.outlook is not None
    tare = {one.cause: one for one in found.outlook.unseen}["load_step"]
    assert "load_step = " in tare.in_words
    sound, moved = (
        first_answer(build_problem(lab.experiment, lab.sweeps, ClosedForm()))
        for lab in (_lab(seed, force_alone=True, load_step=by) for by in (0.0, tare.size))
    )
    name = str(tare.name)
    before, after = sound.parameters[name], moved.parameters[name]
    shift = (after.mean - before.mean) / before.sd
    assert tare.shift == pytest.approx(shift, rel=0.35, abs=0.1)


@pytest.mark.parametrize("force_alone", [True, False])
@pytest.mark.parametrize(
    ("cause", "made"),
    [
        ("force_gain", lambda s: _times_force(1.01)(s)),
        ("displacement_gain", lambda s: _times_travel(1.01)(s)),
        ("indenter_radius", lambda s: replace(s, indenter_radius=s.indenter_radius / 1.01)),
    ],
)
def test_what_is_taken_as_exact_is_said_to_do_what_its_error_does(
    cause: str, made: Callable[[Sweep], Sweep], force_alone: bool
) -> None:
    lab = _lab(force_alone=force_alone)
    outlook = lab.check().outlook
    assert outlook is not None
    (said,) = (one for one in outlook.unseen if one.cause == cause)
    assert f"{cause} = {{ normal" in said.in_words
    right, wrong = (
        first_answer(build_problem(lab.experiment, sweeps, ClosedForm())).parameters[str(said.name)]
        for sweeps in (lab.sweeps, lab.sweep(made).sweeps)
    )
    off = (wrong.mean - right.mean) / right.sd  # what is found where the error is there and is not known
    assert abs(off) > 0.05
    assert said.shift == pytest.approx(-off, abs=0.03)
    assert said.share == pytest.approx(said.shift * right.sd / right.mean, rel=0.1)


def test_what_is_named_is_not_taken_as_exact() -> None:
    outlook = _lab().shared(force_gain=Normal(1.0, 0.005)).check().outlook
    assert outlook is not None
    assert {one.cause for one in outlook.unseen} == {"displacement_gain", "indenter_radius"}


def test_a_thickness_that_is_fixed_is_said_to_do_what_its_error_does() -> None:
    lab = _lab()
    (specimen,) = lab.experiment.specimens
    ways = {}
    for k in (1.0, 1.01):
        own = replace(specimen, priors={**specimen.priors, "padding_thickness": Fixed(k * TRUTH["padding_thickness"])})
        ways[k] = replace(lab, experiment=replace(lab.experiment, specimens=(own,)))
    outlook = ways[1.0].check().outlook
    assert outlook is not None
    (said,) = (one for one in outlook.unseen if "thickness" in one.cause)
    assert said.in_words.startswith("if paddings are 1 % thicker than fixed, young_modulus moves by ")
    before, after = (
        first_answer(build_problem(w.experiment, w.sweeps, ClosedForm())).parameters["young_modulus"] for w in ways.values()
    )
    assert said.shift == pytest.approx((after.mean - before.mean) / before.sd, abs=0.05)
    assert said.shift > 0.05


def test_a_compliance_that_is_fixed_is_said_to_do_what_its_error_does() -> None:
    ways = [_lab().shared(machine_compliance=Fixed(value)) for value in (0.0, 1e-6)]
    outlook = ways[0].check().outlook
    assert outlook is not None
    (said,) = (one for one in outlook.unseen if one.cause == "machine_compliance")
    assert said.in_words.startswith("if the machine gives 1 µm/N more than fixed, young_modulus moves by ")
    assert "give a prior in [priors], such as machine_compliance = " in said.in_words
    before, after = (
        first_answer(build_problem(w.experiment, w.sweeps, ClosedForm())).parameters["young_modulus"] for w in ways
    )
    assert said.shift == pytest.approx((after.mean - before.mean) / before.sd, abs=0.05)
    assert said.share > 0.002


def test_a_poisson_ratio_of_a_foam_that_is_fixed_is_said_to_do_what_its_error_does() -> None:
    foam = load_surrogate(family=FAMILIES["foam"])
    design = design_from({**TRUTH, "padding_young_modulus": 0.3e6, "padding_poisson_ratio": 0.3, "indenter_radius": 5e-3})
    rng = np.random.default_rng(2)
    sweep = synthetic_sweep(foam, design, 0.5e-3, Rig(0.1e-3, 1e-6), rng, specimen="sensor 1", tie="none", n_points=16)
    found = {}
    for ratio in (0.3, 0.35):
        lab = _lab(force_alone=True).shared(
            padding_young_modulus=LogNormal(0.3e6, 1.6), padding_poisson_ratio=Fixed(ratio), machine_compliance=HalfNormal(2e-6)
        )
        foamed = replace(lab.experiment, padding_material="foam", model="surrogate")
        found[ratio] = build_problem(foamed, (_recorded(sweep, 1),), foam)
    outlook = plausibility(found[0.3]).outlook
    assert outlook is not None
    (said,) = (one for one in outlook.unseen if one.cause == "padding_poisson_ratio")
    assert said.in_words.startswith("if the padding's Poisson's ratio is 0.05 larger than fixed, ")
    before, after = (first_answer(problem).parameters[str(said.name)] for problem in found.values())
    assert said.shift == pytest.approx((after.mean - before.mean) / before.sd, abs=0.2)
    assert abs(said.shift) > 0.3


def test_a_foam_that_is_taken_as_incompressible_is_asked_for() -> None:
    design = design_from({**TRUTH, "padding_young_modulus": 0.3e6, "padding_poisson_ratio": 0.3, "indenter_radius": 5e-3})
    rng = np.random.default_rng(2)
    foam = load_surrogate(family=FAMILIES["foam"])
    sweep = synthetic_sweep(foam, design, 0.5e-3, Rig(0.1e-3, 1e-6), rng, specimen="sensor 1", tie="force", n_points=16)
    lab = _lab().shared(padding_young_modulus=LogNormal(0.3e6, 1.6))
    own = replace(lab.experiment, padding_material="own", model="surrogate")
    reasons = plausibility(build_problem(own, (_recorded(sweep, 1),), load_surrogate())).reasons
    (asked,) = (reason for reason in reasons if reason.gate == "model")
    assert "(foam as padding)" in asked.finding
    assert 'material = "foam"' in asked.action
    assert "calib compare" not in asked.action  # which has no foam among its models


def test_a_tare_is_not_said_where_its_step_is_unknown_or_force_ties_the_capacitance() -> None:
    lab = _lab(force_alone=True)
    own = tuple(replace(s, priors={**s.priors, "load_step": Normal(0.0, 5e-3)}) for s in lab.experiment.specimens)
    for other in (replace(lab, experiment=replace(lab.experiment, specimens=own)), _lab()):
        outlook = other.check().outlook
        assert outlook is not None
        assert "load_step" not in {one.cause for one in outlook.unseen}


def test_many_unknowns_are_checked_without_a_mode() -> None:
    lab = _lab(force_alone=True)
    names = [f"sensor {k}" for k in range(30)]
    specimens = tuple(replace(lab.experiment.specimens[0], name=name) for name in names)
    force, rng = lab.sweeps[0].channels["force"], np.random.default_rng(2)
    sd = lab.sweeps[0].noise["force"] / np.sqrt(force.n_effective)
    sweeps = tuple(
        replace(
            _recorded(lab.sweeps[0], k),
            specimen=name,
            channels={"force": replace(force, value=force.value + sd * rng.standard_normal(sd.size))},
        )
        for k, name in enumerate(names)
    )
    found = Lab(replace(lab.experiment, specimens=specimens), sweeps).check()
    assert not found.reasons
    assert found.first is None
    assert len({r.sweep for r in found.ranges}) == 30


def test_draws_none_of_which_is_covered_are_no_crash() -> None:
    lab = _lab()
    problem = build_problem(lab.experiment, lab.sweeps, ClosedForm())
    soft = np.zeros((2, len(problem.parameters)))
    soft[:, problem.names.index("young_modulus")] = -40.0  # no depth has this force
    assert np.all(np.isneginf(log_likelihood(problem, soft)))


SLIPPERY = design_from({**TRUTH, "young_modulus": 1.1e6, "padding_thickness": 1.1e-3, "indenter_radius": 5e-3}, base="slippery")


def _on_slippery_base(forward: Forward, friction: float = 0.0, of_ball: float = 0.0) -> tuple[Experiment, Sweep]:
    """A lab that takes its base for bonded, and its sweep, of a model on a slippery one that may rub, under a ball that may."""
    rig, rng = Rig(0.1e-3, 1e-6, 0.2, 0.2e-12), np.random.default_rng(0)
    design = replace(SLIPPERY, padding=replace(SLIPPERY.padding, base_friction_coefficient=friction))
    design = replace(design, indenter=replace(design.indenter, friction_coefficient=of_ball))
    slips = synthetic_sweep(forward, design, 0.6e-3, rig, rng, specimen="sensor 1")
    thick = {"sensor_thickness": Normal(0.75e-3, 0.02e-3), "padding_thickness": Normal(1.1e-3, 0.02e-3)}
    lab = _lab()
    (specimen,) = lab.experiment.specimens
    own = replace(specimen, priors={**thick, "dielectric_thickness": Normal(0.16e-3, 0.006e-3)})
    return replace(lab.experiment, specimens=(own,), model="surrogate"), slips


def test_a_base_that_slips_is_named_and_not_taken_for_a_ball_of_another_size() -> None:
    forward = load_surrogate(family=FAMILIES["slippery"])
    experiment, slips = _on_slippery_base(forward)
    found = plausibility(build_problem(experiment, [slips], load_surrogate()))
    assert found.verdict.colour == "red"
    (said,) = (reason for reason in found.reasons if reason.gate == "model")
    assert said.finding.startswith("under another model (slippery base) the data would be 10^")
    modulus = re.search(r"young_modulus about ([\d.]+) MPa", said.finding)
    assert modulus is not None
    assert float(modulus[1]) == pytest.approx(1.1, rel=0.1)
    assert not any("ball" in reason.gate for reason in found.reasons if reason.level == "red")
    right = plausibility(build_problem(replace(experiment, base="slippery"), [slips], forward))
    assert [reason.gate for reason in right.reasons] == ["base"]
    slow = plausibility(build_problem(replace(experiment, base="slippery", model="fem"), [slips], forward))
    assert [reason.finding for reason in slow.reasons] == [reason.finding for reason in right.reasons]


def test_a_ball_that_rubs_on_a_slippery_base_is_named_and_found_where_it_is_unknown() -> None:
    forward = load_surrogate(family=FAMILIES["slippery-friction"])
    experiment, sweep = _on_slippery_base(forward, of_ball=0.3)
    slips = replace(experiment, base="slippery")
    found = plausibility(build_problem(slips, [sweep], load_surrogate(family=FAMILIES["slippery"])))
    (said,) = (reason for reason in found.reasons if reason.gate == "model")
    assert said.finding.startswith("under another model (with friction) the data would be 10^")
    named = replace(slips, priors={**slips.priors, "friction_coefficient": Uniform(0.0, 0.6)})
    right = plausibility(build_problem(named, [sweep], forward))
    assert [(reason.gate, reason.level) for reason in right.reasons] == [("base", "amber")]
    assert right.reasons[0].action.endswith('in [priors] and model = "fem" at the top of the file')  # for both frictions
    assert right.first is not None
    friction = right.first.parameters["friction_coefficient"]
    assert abs(friction.mean - 0.3) < 3 * friction.sd < 0.2


def test_a_base_that_rubs_is_named_with_what_to_write() -> None:
    experiment, rubs = _on_slippery_base(load_surrogate(family=FAMILIES["rubbing-base"]), 0.8)
    # At a glance, where the priors expect less of a capacitance than was read.
    found = plausibility(build_problem(experiment, [rubs], load_surrogate()))
    assert [(reason.gate, reason.level) for reason in found.reasons] == [("capacitance change", "red")]
    both = 'base = "slippery" (at the top of the file) and base_friction_coefficient = { uniform = [0, 1] } (in [priors])'
    assert "of which all would be as expected: slippery base, base = " in found.reasons[0].action
    assert found.reasons[0].action.endswith(f"; slippery base with friction, {both}")
    # And by the evidence, where they expect as much.
    (specimen,) = experiment.specimens
    wide = {name: Normal(prior.mean, 6 * prior.sd) for name, prior in specimen.priors.items() if isinstance(prior, Normal)}
    unsure = replace(experiment, specimens=(replace(specimen, priors=wide),))
    found = plausibility(build_problem(unsure, [rubs], load_surrogate()))
    (said,) = (reason for reason in found.reasons if reason.gate == "model")
    assert said.finding.startswith("under another model (slippery base with friction) the data would be 10^")
    assert f"if it is set {both}" in said.action


def test_friction_on_a_slippery_base_is_said_to_do_what_it_does() -> None:
    forward, rubs = (load_surrogate(family=FAMILIES[name]) for name in ("slippery", "rubbing-base"))
    labs = [_on_slippery_base(model, friction) for model, friction in ((forward, 0.0), (rubs, COEFFICIENT))]
    sound, off = (build_problem(replace(e, base="slippery"), [sweep], forward) for e, sweep in labs)
    (said,) = (reason for reason in plausibility(sound).reasons if reason.gate == "base")
    numbers = re.search(r"makes Young's modulus of the sensor ([\d.]+) % too large \(([\d.]+) of", said.finding)
    assert numbers is not None
    right, wrong = (first_answer(problem).parameters["young_modulus"] for problem in (sound, off))
    assert wrong.mean / right.mean - 1 == pytest.approx(float(numbers[1]) / 100, rel=0.3)
    assert (wrong.mean - right.mean) / right.sd == pytest.approx(float(numbers[2]), rel=0.3)
    named = replace(labs[1][0], base="slippery", priors={**labs[1][0].priors, "base_friction_coefficient": Uniform(0.0, 1.0)})
    for experiment, model in ((labs[0][0], load_surrogate()), (named, rubs)):
        answered = plausibility(build_problem(experiment, [labs[1][1]], model))
        assert "base" not in {reason.gate for reason in answered.reasons}
    fixed = replace(named, priors={**named.priors, "base_friction_coefficient": Fixed(0.4)})
    (said,) = (r for r in plausibility(build_problem(fixed, [labs[1][1]], rubs)).reasons if r.gate == "base")
    assert "is taken as 0.4 exactly: a coefficient of 0.5 there" in said.finding
    beyond = replace(named, priors={**named.priors, "base_friction_coefficient": Uniform(0.0, 6.0)})
    with pytest.raises(InputError, match=r"covers base_friction_coefficient from 0 to 1, got 3\. Give base_friction_coeff"):
        build_problem(beyond, [labs[1][1]], rubs)
