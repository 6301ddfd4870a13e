"""What the numbers take for granted: the choices of model, contact and data that no uncertainty holds."""

from __future__ import annotations

from collections import Counter

from calib.catalogue import UNKNOWNS, UnknownName
from calib.experiment import Experiment, MaterialLaw, beyond_simplest, unedited_in_words, variants_of
from calib.problem import specimen_and_ball
from calib.report.put_in import put_in_effects
from calib.report.section import Results, Section
from calib.sampling import Posterior
from models.sensor import Base

ORDER = 48

#: What each law of sensor and padding takes for granted, as heading and text.
LIMITS_OF_LAWS: dict[MaterialLaw, tuple[str, str]] = {
    "neo-hookean": (
        "Neo-Hookean, nearly incompressible silicone",
        "One modulus describes a layer; stiffening at large strain is not modelled.",
    ),
    "gent": (
        "Gent's law, nearly incompressible silicone",
        "A modulus and a stiffening at large strain describe a layer, the stiffening the same in sensor and padding; "
        "stiffening of another shape than Gent's is not modelled.",
    ),
}

# What each base takes for granted, as heading and text.
_LIMITS_OF_BASES: dict[Base, tuple[str, str]] = {
    "bonded": (
        "The base is taken as bonded",
        "Sensor and padding are modelled as stuck to each other and to the rigid finger. This choice outweighs all noise: "
        "on a slippery base the same curve would mean about 1.9 times the Young's modulus.",
    ),
    "slippery": (
        "The base is taken as slippery",
        "Sensor and padding stick to each other and slide on the rigid finger without friction. This choice outweighs all "
        "noise: on a bonded base the same curve would mean about half the Young's modulus, and friction of the finger makes it "
        "smaller, too, by 5 to 10 % at a coefficient of 0.2.",
    ),
}
_RUBBING_BASE = (
    "One friction of the base for all presses",
    "Sensor and padding stick to each other and slide on the rigid finger by Coulomb's law, by the same coefficient whatever "
    "the pressure; they do not lift off.",
)

#: Instrument of each channel, what its gain error does, and a prior for it as one writes it.
_GAINS = {
    "force": (
        "load cell",
        "An error of its gain goes straight into the modulus: 0.5 % of the force are 0.5 % of the modulus.",
        UNKNOWNS["force_gain"].example,
    ),
    "capacitance": (
        "LCR meter",
        "An error of its gain goes straight into the permittivity, or into the dielectric thickness.",
        UNKNOWNS["capacitance_gain"].example,
    ),
}


def section(results: Results) -> Section:
    """Show what the numbers take for granted, as a list."""
    said = [
        *_shared(results),
        *(
            (f"Taken as put in: {words}", f"{effect[0].upper()}{effect[1:]}. {why}")
            for words, effect, why in put_in_effects(results)
        ),
    ]
    return Section("limits", "What the numbers take for granted", "Limits", "limits.html.j2", {"limits": said}, of_draws=False)


def _shared(results: Results) -> list[tuple[str, str]]:
    """What the numbers take for granted: of an average, what all of its models do."""
    first, *others = [limits(p) for p in [m.posterior for m in results.members] or [results.posterior]]
    return [said for said in first if all(said in other for other in others)]


def limits(posterior: Posterior) -> list[tuple[str, str]]:
    """List what the numbers of this posterior take for granted, as (heading, text)."""
    e = posterior.experiment
    unknown = {p.parameter for p in posterior.parameters} | {UnknownName.parse(n).parameter for n in posterior.fixed}
    return [
        *_guesses(e),
        _RUBBING_BASE if e.base_rubs else _LIMITS_OF_BASES[e.base],
        _contact(e),
        _loading(posterior),
        (
            "Fringe fields are left out",
            "The capacitance is that of thin deformed rings between the electrodes; stray fields at the rim are not in it, a "
            "constant one goes into the parasitic capacitance.",
        ),
        LIMITS_OF_LAWS[e.law],
        _padding_material(e),
        *_pooling(e),
        *_repeated(posterior),
        *_derived(e, unknown),
        *_instruments(posterior, unknown),
        *_model(e),
    ]


def _loading(posterior: Posterior) -> tuple[str, str]:
    """What the model leaves out of the material's time, and what the records show of it."""
    of_force = [grade for s in posterior.sweeps for grade in s.grades if grade.channel == "force"]
    lost = [g.number for g in of_force if g.check == "hysteresis"]
    fallen = [-g.number for g in of_force if g.check == "change in the hold"]
    shown = [f"unloading gives back {100 * max(lost):.2g} % less than loading took"] if max(lost, default=0.0) > 0 else []
    shown += [f"force falls by {100 * max(fallen):.2g} % in a hold"] if max(fallen, default=0.0) > 0 else []
    text = "The material is elastic in the model: no hysteresis, no rate, no creep. Unloading and holds are not fitted."
    if shown:
        text += f" Here {' and '.join(shown)} (at most)."
    elif of_force and not (lost or fallen):
        text += (
            " These records hold neither, so that nothing tells how much there is of it: log on while the ball is taken off."
        )
    return "Only the loading branch is used", text


def _repeated(posterior: Posterior) -> list[tuple[str, str]]:
    """Presses of a specimen under the same ball, which repeat what the model leaves out."""
    presses = Counter(map(specimen_and_ball, posterior.sweeps))
    (specimen, _), most = max(presses.items(), key=lambda pair: pair[1])
    if most == 1 or posterior.experiment.discrepancy == "off":
        return []
    return [
        (
            "What the model leaves out is the same in every press of a specimen under one ball",
            f"{specimen} was pressed {most} times with the same ball, which averages noise, contact and zeros, not what the "
            "model leaves out. Another ball tells more; it is taken to have a misfit of its own, as is every other specimen.",
        )
    ]


def _guesses(e: Experiment) -> list[tuple[str, str]]:
    """What stands in the experiment file as its draft put it there."""
    said = unedited_in_words(e.unedited)
    if not said:
        return []
    return [("Guesses of the draft are taken as measured", f"In {e.file_name} {said}. The numbers above rest on them.")]


def _contact(e: Experiment) -> tuple[str, str]:
    if e.stick:
        return (
            "The ball is taken as sticking",
            "The sensor does not slip on the ball at all; less friction would make it softer.",
        )
    if e.rubs:
        return "One friction for all presses", "The ball rubs by Coulomb's law, by the same coefficient whatever the pressure."
    text = "The ball slides freely on the sensor; rubbing would make it stiffer, by tens of per cent at a friction of 0.3."
    if any(variant.name == "friction" for variant in variants_of(e)):
        example = UNKNOWNS["friction_coefficient"].example
        text += f" Where that cannot be ruled out, give friction_coefficient = {example} in [priors]."
    return "Friction is left out", text


def _padding_material(e: Experiment) -> tuple[str, str]:
    if e.padding_material == "sensor":
        return (
            "One silicone for sensor and padding",
            "Both have the same Young's modulus, as the experiment file says. Where they may differ, the modulus is known much "
            "worse: calib compare holds both against the data.",
        )
    if e.padding_material == "foam":
        return (
            "The padding is a foam",
            "Its modulus and Poisson's ratio are parameters of their own, neo-Hookean: cells that buckle are not modelled.",
        )
    return "Padding of its own material", "Its modulus is a parameter of its own; it trades off against the sensor's."


def _pooling(e: Experiment) -> list[tuple[str, str]]:
    """What specimens of one lot take for granted."""
    if e.pooling == "complete":
        return []
    return [
        (
            "The specimens are of one lot",
            "Moduli, permittivities and thicknesses of specimens scatter about those of the lot, normally or log-normally and "
            "independently of each other; stiffening and a padding of another material are the same in all.",
        )
    ]


def _derived(e: Experiment, unknown: set[str]) -> list[tuple[str, str]]:
    """What was derived because the experiment does not name it."""
    found = []
    if "dielectric_thickness" not in unknown:
        found.append(
            (
                "Dielectric thickness is derived",
                "No dielectric_thickness was given, so each dielectric is half the sensor. Electrodes and covers would make it "
                "thinner, and the permittivity absorbs the difference.",
            )
        )
    if "electrode_radius" not in unknown:
        found.append(
            (
                "Electrode radius is the disc radius",
                f"No electrode_radius was given, so the electrodes fill the disc ({e.sensor_radius * 1e3:g} mm). The "
                "capacitance change depends on it as much as on the modulus.",
            )
        )
    return found


def _instruments(posterior: Posterior, unknown: set[str]) -> list[tuple[str, str]]:
    """Which instruments are taken as exact though they were used."""
    found = []
    for channel, (instrument, effect, example) in _GAINS.items():
        used = any(channel in sweep.channels for sweep in posterior.sweeps)
        if used and f"{channel}_gain" not in unknown:
            advice = f"Give {channel}_gain = {example} in [priors], by its class or manual, to have that in the uncertainties."
            found.append((f"The {instrument} is taken as exact", f"{effect} {advice}"))
    if any("force" in sweep.channels for sweep in posterior.sweeps) and "displacement_gain" not in unknown:
        found.append(
            (
                "The travel is taken as exact",
                "An error of its gain goes into the modulus: travel that is read 1 % too large makes it about 1.5 % too small. "
                "Hold the crosshead against a dial gauge or gauge blocks; what the machine gives way is another matter. Give "
                f"displacement_gain = {UNKNOWNS['displacement_gain'].example} in [priors] to have that in the uncertainties.",
            )
        )
    if any(sweep.clock is not None for sweep in posterior.sweeps):
        found.append(
            (
                "Both clocks run at one rate",
                "Their offset is found, not their rate. A log whose times are counted, readings times a nominal interval, may "
                "run 1 or 2 % fast or slow, which looks like a padding of another modulus. Log the times that were measured.",
            )
        )
    if any("force" in sweep.channels for sweep in posterior.sweeps) and "load_step" not in unknown:
        found.append(
            (
                "The load cell keeps its zero",
                "A zero that was set anew at the touch, by less than the readings show, goes into contact point and modulus: "
                "one of two thousandths of the load may move it by several of its standard deviations; calib check says by how "
                "much one of a reading's noise does in this experiment. Where the machine may balance its cell while it "
                f"presses, give load_step = {UNKNOWNS['load_step'].example} in [specimens.priors].",
            )
        )
    return found


def _model(e: Experiment) -> list[tuple[str, str]]:
    """What was chosen, switched off, or taken for a first look."""
    found = []
    if chosen := beyond_simplest(e):
        found.append(
            (
                "The model is taken as known before these data",
                f"It has: {', '.join(chosen)}. If that was chosen because a simpler model did not describe these data, the "
                "choice was made on the same data, and no uncertainty on this page holds it. A part of the base that is not "
                "bonded, or a clock that runs fast, looks alike and would now be hidden in it: hold the model against a press "
                "that had no part in the choice.",
            )
        )
    if e.discrepancy == "off":
        found.append(
            (
                "Discrepancy is switched off",
                "Residuals are taken as independent noise. If they drift along the sweep, these uncertainties are too small.",
            )
        )
    if e.model == "closed form":
        found.append(
            (
                "The model is the closed form",
                "Hertz with a bonded-layer factor and a plate capacitance: good for a first look, wrong by a factor of up to "
                "two in the capacitance change. Use the surrogate or finite elements for numbers to build on.",
            )
        )
    return found
