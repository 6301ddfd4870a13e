"""From the settings and results that stand beside a table, such as a test speed, to those that its readings contradict."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from calib.errors import Choice, Fault
from calib.lab.instruments.labtable import Reading
from calib.lab.instruments.moments import Moments, moments
from calib.lab.instruments.readings import ReadColumn
from calib.lab.instruments.sheet import Sheet
from calib.lab.instruments.stated import quantity_of
from calib.lab.instruments.unit_choice import unit_in_words
from calib.lab.instruments.units import is_unit_of, lab_factor, stands_for
from models.sensor import FloatArray

_LONGEST = 120
# What is told and what was read agree within such a factor.
_AGREE = 3.0
# How near a factor must come to one between units: of what is met exactly, and of what is only near it, such as a speed.
_EXACT, _NEAR = 0.015, 0.06
# The same of a capacitance, which may be that of another part or no more than meant: its units are thousands apart.
_OF_A_PART = 0.7
# How far off moments may be, as a share of the time between them, that tell a ratio of units.
_MOST_SLACK = 0.15
# By minutes and hours a test may last longer than its record by chance.
_BY_CHANCE = 0.003
# Of readings that are rarer than they were taken only some may be kept, unless their times differ by such numbers.
_LEAST_STEP = 5.0
# Powers of ten between the usual units of one quantity, as of N after mN.
_THOUSANDS = (3.0, 6.0)
# Figures of a number that is none that was chosen.
_FIGURES = 3
# A displacement moves steadily where such a share of its way is gone within so much of one speed.
_STEADY, _OF_WAY = 0.15, 0.3
_FEWEST, _STRETCHES = 20, 30
# Units that a column may be in whose header says another.
_UNITS: Mapping[str, tuple[str, ...]] = {
    "time": ("s", "ms", "min", "h", "us"),
    "displacement": ("mm", "um", "m", "cm", "in", "nm"),
    "force": ("N", "mN", "kN", "cN", "gf", "kgf", "lbf", "uN"),
    "capacitance": ("pF", "nF", "uF", "fF", "F"),
}
_NUMBER = r"(?<!\w)(?<!\d[.,])(?P<number>[+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)"
# "Test speed: 0.1 mm/s", "Rate 1","0.1","mm/s", "Sampling interval [ms];20", "C0 97.1 pF".
_TOLD = tuple(
    re.compile(
        rf"(?P<name>(?=[^:=\t;|]*[^\W\d])[^:=\t;|]+?){between}{_NUMBER}"
        rf"(?:[\s\"';,\t|]*(?P<unit>[^\s\d;,\t|\"'][^\s;,\t|\"']*))?"
    )
    for between in (r"[\s\"']*[:=;,\t|]+[\s\"':=;,\t|]*", r"\s+")
)
_UNIT_IN_NAME = re.compile(r"(?P<name>.*?)[\s,]*(?:[(\[](?P<inside>[^()\[\]]+)[)\]]|,\s*(?P<behind>\S+))\s*")
_SPEED = re.compile(
    r"speed|velocity|\brate\b(?! \w*(?:load|force))|geschw|vitesse|velocidad|velocit[àa]|velocidade|snelheid|"
    r"prędkość|hastighet|速度",
    re.I,
)
_SAMPLED = re.compile(
    r"sampl|acqui|abtast|messrate|erfass|\bdata\b|\blog|scan rate|record|échantillon|muestreo|campion|amostr|采样|サンプ", re.I
)
_RATE = re.compile(r"rate|freq|\bfs\b|takt", re.I)
# A rate of nothing else, in hertz, is that of the readings.
_RATE_ALONE = re.compile(r"(?:the )?(?:daq |reading |readout |update |meter )?rate|taux|tasa|taxa|frequenza di lettura", re.I)
_INTERVAL = re.compile(r"interval|period|\bstep|schritt|time|zeit|takt|pas\b", re.I)
_MOST = re.compile(
    r"(?<![^\W_])(?:max(?:\.|im\w*)?|peak|höchst\w*|spitzen\w*|f[ _-]?max|massim\w*|máxim\w*|pico|"
    r"picco|(?:larg|high|great|bigg)est|gr(?:ö|oe)(?:ß|ss)te?\w*|plus (?:grande?|haute?|élevée?|forte?)|mayor|m[áa]s alt[oa]|"
    r"maggiore|pi[ùu] (?:alt[oa]|grande)|grootste|hoogste|największ\w+|största|högsta)(?![^\W_])|"
    r"最大|max(?=[a-z]* ?(?:force|load|kraft))",
    re.I,
)
# "C0", "Cnom", "Capacitance", and what a capacitance is beside words such as "nominal", "at rest" and "of the sensor".
_AT_REST = re.compile(
    r"(?<![\w/])c[ _]?(?:0|nom)(?![\w/.])|(?:anfangs|grund|ruhe|ausgangs|leer)-?kapazit|电容|電容|静電容量|"
    r"^(?:capacitance|capacité|capacidad|capacità|capacitância|capaciteit|kapazität|kapacitet|kapacita|pojemność|[её]мкость)$",
    re.I,
)
_OF_REST = re.compile(
    r"(?<![^\W_])(?:nom(?:inal\w*|inell\w*)?|initial\w*|baseline|(?:at )?rest(?:ing)?|idle|unloaded|unpressed|uncompressed|"
    r"(?:zero|no|without)[ -]?load|start(?:ing)?|rated|typ(?:ical)?|sensors?|au repos|inicial\w*|iniziale|à vide|unbelastet\w*|"
    r"expected)(?![^\W_])|(?:nenn|soll)-?(?=kapazit)",
    re.I,
)
_OF_A_CHANGE = re.compile(r"change|delta|[ΔδΔ∆]|änderung|differen|noise|rausch|step|slope|gain|shift|drift|parallel|c/c", re.I)
_LASTED = re.compile(
    r"duration|dauer|durée|duración|durata|duração|elapsed|(?:test|total|run|prüf|gesamt)[ _-]?(?:time|zeit)\b", re.I
)
# What is said in another sense: of another stretch, of the instrument, or of what may be.
_OTHERWISE = re.compile(
    r"limit|capacity|load ?cell|allowed|permi|admis|zulässig|grenz|range|bereich|rating|rated|nenn|nomin|safe|"
    r"overload|stop|end ?(?:of|at)|abbruch|abschalt|"
    r"full ?scale|thresh|schwelle|trigger|pre[ -]?(?:load|test|speed)|vor(?:kraft|last|lauf)|anfahr|approach|"
    r"contact|return|retract|unload|"
    r"rück|entlast|zurück|retour|jog|position|tare|tara|hold|halte|dwell|pause|delay|wait|warte|relax|"
    r"pre-?cond|target|soll|ziel|"
    r"set ?point|baud|fan|scroll|display|filter|resol|accura|toler|uncert|date|datum|created|printed|start|shutter|strain|dehn|"
    r"per (?:cycle|step)|calib|kalib|stray|cable|reference|break|bruch|yield|motor|steps|sensor",
    re.I,
)
_BY_TIME = re.compile(
    r"(?P<length>[^\s/·*.^⁻-]+)\s*(?:/|per |·|\*|\.| )\s*(?P<time>s|sec|second|min|minute|h|ms)(?:\^?-1|⁻¹)?", re.I
)
_OFTEN = re.compile(r"(?P<thousand>[kM]?)(?:Hz|S/s|sps|1/s|/s|samples/s|samples/sec|pts/s|points/s|s\^?-1)")


@dataclass(frozen=True)
class _Told:
    """One setting or result: what it is of, its number in SI, line and words, and the unit it is said in, with its size."""

    kind: str
    value: float
    line: int
    shown: str
    unit: str
    size: float
    figures: int
    is_rate: bool


@dataclass(frozen=True)
class Contradicted:
    """What is told beside a table and contradicts its readings: notes, and faults where a unit explains it."""

    notes: tuple[str, ...] = ()
    faults: tuple[Fault, ...] = ()


def told_otherwise(
    sheet: Sheet, columns: Sequence[ReadColumn], values: Mapping[str, FloatArray], decimal: str, reading: Reading
) -> Contradicted:
    """Hold the speed, rate, maxima, capacitance at rest, duration, start and end told beside a table against its readings.

    They need not be of this record, nor of all of it: only what is off by the ratio of two units is refused, and what is off
    by some other large factor is noted. Of several that tell the same, such as two speeds, one that agrees is enough.

    Parameters
    ----------
    sheet, columns : the record, and those of its columns that are read.
    values : quantity -> readings in SI, nan where there is none that is used.
    decimal : the decimal mark of the readings.
    reading : a unit that is said once more is not doubted.
    """
    lines = sheet.lines_and_sheets
    values = {**{stands_for(q): v for q, v in values.items()}, **values}
    told = [found for number, line in sorted(lines.items()) if (found := _told_in(line, number, decimal)) is not None]
    notes: list[str] = []
    faults: list[Fault] = []
    sure: dict[str, str] = {}  # quantity -> its unit, by what is told of it alone
    of = {stands_for(c.quantity): c for c in columns}
    for kind, (quantities, measured_by, near) in _KINDS.items():
        own = [t for t in told if t.kind == kind]
        if not own or any(q not in of or q not in values for q in quantities):
            continue
        measured = [m for m in measured_by(values) if m > 0 and math.isfinite(m)]
        if not measured:
            continue
        if any(_ratio(t.value, m) <= _AGREE for t in own for m in measured):
            sure |= dict.fromkeys(quantities if len(quantities) == 1 else (), "")
            continue
        told_first, said = own[0], _words(own[0], measured[0])
        ways = [] if set(quantities) & set(reading.units) else _ways(told_first, measured, [of[q] for q in quantities], near)
        ways = [way for way in ways if sure.get(way[0]) != ""]
        ways = [way for way in ways if way[0] in sure] or ways
        if not ways or _may_be_chosen(told_first, measured, [of[q].factor for q in quantities], ways):
            notes.append(f"{said}: nothing in the file says which is right")
            continue
        if len(quantities) == 1:
            sure[ways[0][0]] = ways[0][1]
        faults.append(_fault(sheet, reading, of[ways[0][0]], told_first.line, said, ways))
    between = moments(lines)
    if between is not None and "time" in of and "time" in values:
        note, ways = _lasted_otherwise(between, values["time"], of["time"])
        sure_of = sure.get("time") == "" or "time" in reading.units or any("time=" in fault.advice for fault in faults)
        if ways and not sure_of:
            faults.append(_fault(sheet, reading, of["time"], between.line, note, ways))
        elif note:
            notes.append(f"{note}: nothing in the file says which is right")
    return Contradicted(tuple(notes), tuple(faults))


def _fault(sheet: Sheet, reading: Reading, column: ReadColumn, line: int, said: str, ways: Sequence[tuple[str, str]]) -> Fault:
    """The fault of a column whose readings another unit would make what is told."""
    right = Choice("units", (unit_in_words(sheet, column.index, column.heading, reading),), ways[0][0])
    mended = " or ".join(str(Choice("units", (unit,), quantity)) for quantity, unit in ways)
    return Fault(
        f'column "{sheet.names[column.index]}": {said}, as another unit would make it',
        sheet.text.path,
        line,
        column.index + 1,
        advice=f"If the line is right, say the unit that the readings are in: {mended}; if the header is: {right}",
        choice=Choice("units", (ways[0][1],), ways[0][0]),
    )


def _lasted_otherwise(between: Moments, time: FloatArray, column: ReadColumn) -> tuple[str, list[tuple[str, str]]]:
    """What to say of a record that lasts longer than from its beginning to its end, or is off that by a ratio of units.

    A test may begin long before its record and end long after it: of a shorter one only a ratio of units that is met within
    what the moments are written to is one.
    """
    (lasts, *_) = _lasted({"time": time}) or [0.0]
    if not lasts or abs(lasts - between.seconds) <= between.slack:
        return "", []
    said = f"{between.shown} are {between.seconds:g} s apart, but as it is read the record lasts {lasts:.4g} s"
    longer = lasts > (1 + _NEAR) * between.seconds + between.slack
    ways = []
    for unit in _UNITS["time"] if not column.clock else ():
        by = lab_factor(unit, "time") / column.factor
        off = abs(between.seconds - by * lasts)
        near, most = (_NEAR, _MOST_SLACK) if round(math.log10(by), 9) % 1 == 0 else (_BY_CHANCE, _BY_CHANCE)
        if by != 1 and off <= max(near * between.seconds, between.slack) <= most * between.seconds:
            ways.append(("time", unit))
    return (said if longer or ways else ""), ways


def _ratio(a: float, b: float) -> float:
    return max(a / b, b / a)


def _words(told: _Told, measured: float) -> str:
    what = {
        "speed": "the displacement moves at",
        "interval": "the readings follow each other after",
        "force": "the largest force is",
        "displacement": "the displacement goes as far as",
        "capacitance": "the readings begin at",
        "duration": "the record lasts",
    }[told.kind]
    return f'"{told.shown}" stands in line {told.line}, but as it is read {what} {measured / told.size:.4g} {told.unit}'


def _ways(told: _Told, measured: Sequence[float], columns: Sequence[ReadColumn], near: float) -> list[tuple[str, str]]:
    """The quantities and units that make of the readings what is told."""
    found = []
    for column in columns:
        quantity = stands_for(column.quantity)
        # Rows that are kept every few seconds have those for a unit; minutes and hours are as likely a wrong one.
        thinned = told.is_rate and told.value < measured[0] < _LEAST_STEP * column.factor
        if column.clock or (thinned and column.factor <= 1.0):
            continue
        power = -1 if quantity == "time" and told.kind == "speed" else 1
        units = [(unit, lab_factor(unit, quantity)) for unit in _UNITS[quantity]]
        usual = {"force": "N", "displacement": "mm"}.get(told.kind)
        if usual:
            units += [(f"{10.0**k:g} {usual}", 10.0**k * lab_factor(usual, quantity)) for k in (-2, -1, 1, 2)]
        for unit, factor in units:
            by = (factor / column.factor) ** power
            if any(abs(math.log(told.value / (by * m))) <= near for m in measured):
                found.append((quantity, unit))
                break
    return found


def _may_be_chosen(told: _Told, measured: Sequence[float], factors: Sequence[float], ways: Sequence[tuple[str, str]]) -> bool:
    """Whether a maximum is a round number above all readings, as of a limit, that no unit a thousand times larger would meet.

    A limit is ten or a hundred times what is reached more often than its very figures a thousand or a million times smaller.
    """
    if told.kind not in ("force", "displacement") or told.figures >= _FIGURES or told.value <= max(measured):
        return False
    usual = [(q, unit, factor) for (q, unit), factor in zip(ways, factors, strict=False) if unit in _UNITS[q]]
    by = [lab_factor(unit, quantity) / factor for quantity, unit, factor in usual]
    return not any(round(math.log10(ratio), 9) in _THOUSANDS for ratio in by)


# --- what is told --------------------------------------------------------------------------------------------------------


def tells_of_readings(line: str) -> bool:
    """Whether a line tells what can be held against readings: a speed, a rate, a largest force, a duration.

    >>> [tells_of_readings(line) for line in ("Max load: 5.0 N", "Sampling rate: 10 Hz", "Operator: 12")]
    [True, True, False]
    """
    return any(_told_in(line, 1, decimal) is not None for decimal in ".,")


def _told_in(line: str, number: int, decimal: str) -> _Told | None:
    """What a line tells, None if nothing that can be held against readings."""
    if len(line) > _LONGEST or not any(map(str.isdigit, line)):
        return None
    text = line.strip().lstrip("#%* \"'\ufeff").strip()
    # "note: Sampling rate: 100 Hz": a key may stand before.
    ways = (text, text.partition(":")[2].strip())
    match = next((m for way in ways for pattern in _TOLD if (m := pattern.match(way)) is not None), None)
    if match is None:
        return None
    name, written = match["name"].strip(" \"'"), match["number"]
    inside = _UNIT_IN_NAME.fullmatch(name)
    unit = match["unit"] or ""
    if inside is not None and _kind_of(inside["name"], inside["inside"] or inside["behind"], line) is not None:
        name, unit = inside["name"], inside["inside"] or inside["behind"]
    found = _kind_of(name, unit.strip(" .()[]"), line)
    # Of a capacitance "nominal" and "of the sensor" say nothing else.
    if found is None or _OTHERWISE.search(_OF_REST.sub("", line) if found[0] == "capacitance" else line):
        return None
    if decimal != "," and re.fullmatch(r"[+-]?\d{1,3},\d{3}", written):
        return None
    if decimal == "," and re.fullmatch(r"[+-]?\d{1,3}\.\d{3}", written):
        return None
    kind, shown, size = found
    value = abs(float(written.replace(",", ".")))
    if not value:
        return None
    figures = len(re.sub(r"[eE].*|\D", "", written).strip("0"))
    return _Told(
        kind,
        1 / (value * size) if shown == "Hz" else value * size,
        number,
        _shown(line),
        *_as_shown(shown, size),
        figures,
        shown == "Hz",
    )


def _shown(line: str) -> str:
    return " ".join(line.replace('"', "").split()).strip(" #;,")[:60]


def _as_shown(unit: str, size: float) -> tuple[str, float]:
    return ("s", 1.0) if unit == "Hz" else (unit, size)


def _kind_of(name: str, unit: str, line: str) -> tuple[str, str, float] | None:
    """What a name and a unit tell in a line, with the unit as it is shown and its size in SI."""
    often, moving = _OFTEN.fullmatch(unit), _BY_TIME.fullmatch(unit)
    rate = _RATE_ALONE.fullmatch(name.strip()) or (_RATE.search(name) and unit.startswith(("/", "S/")))
    if often is not None and (_SAMPLED.search(name) or rate):
        return "interval", "Hz", {"": 1.0, "k": 1e3, "M": 1e6}[often["thousand"]]
    if moving is not None and _SPEED.search(name):
        if is_unit_of(moving["length"], "displacement") and is_unit_of(moving["time"], "time"):
            return "speed", unit, lab_factor(moving["length"], "displacement") / lab_factor(moving["time"], "time")
        return None
    if is_unit_of(unit, "time"):
        sampled = _SAMPLED.search(name) and _INTERVAL.search(name)
        kind = "interval" if sampled or name.lower() == "interval" else "duration" if _LASTED.search(name) else ""
        return (kind, unit, lab_factor(unit, "time")) if kind else None
    if is_unit_of(unit, "capacitance"):
        at_rest = (_AT_REST.search(name) or _OF_REST.search(line)) and not _OF_A_CHANGE.search(line)
        return ("capacitance", unit, lab_factor(unit, "capacitance")) if at_rest else None
    for quantity in ("force", "displacement"):
        if is_unit_of(unit, quantity) and (most := _MOST.search(name)):
            rest = f"{name[: most.start()]} {name[most.end() :]}".strip()
            of = quantity_of(rest) if rest else (quantity if "f" in most[0].lower() else None)
            return (quantity, unit, lab_factor(unit, quantity)) if of == quantity else None
    return None


# --- what was read -------------------------------------------------------------------------------------------------------


def _speeds(values: Mapping[str, FloatArray]) -> list[float]:
    """The speeds at which the displacement goes a good part of its way, the fastest first; none where it goes by steps."""
    t, x = values["time"], values["displacement"]
    rows = np.flatnonzero(np.isfinite(t) & np.isfinite(x))
    if rows.size < _FEWEST:
        return []
    t, x = t[rows], x[rows]
    ends = np.unique(np.linspace(0, rows.size - 1, min(_STRETCHES, rows.size // 4) + 1).astype(int))
    passed, gone = np.diff(t[ends]), np.abs(np.diff(x[ends]))
    good = passed > 0
    if not np.all(good) or not np.sum(gone):
        return []
    speeds = gone / passed
    found = []
    for speed in speeds.tolist():
        alike = np.abs(speeds - speed) <= _STEADY * speed
        if speed > 0 and np.sum(gone[alike]) >= _OF_WAY * np.sum(gone):
            found.append(float(np.median(speeds[alike])))
    if not found:
        return []
    steps = np.abs(np.diff(x)) / np.where(np.diff(t) > 0, np.diff(t), np.nan)
    moving = steps[np.abs(np.diff(x)) > np.quantile(np.abs(np.diff(x)), 0.5)]
    # Where it rests between steps, each is faster than they are together.
    jumps = moving.size and float(np.nanmedian(moving)) > _AGREE * max(found)
    return [] if jumps else sorted(found, reverse=True)


def _intervals(values: Mapping[str, FloatArray]) -> list[float]:
    t = values["time"][np.isfinite(values["time"])]
    steps = np.diff(t)
    return [float(np.median(steps[steps > 0]))] if t.size >= _FEWEST and np.any(steps > 0) else []


def _largest(quantity: str) -> Callable[[Mapping[str, FloatArray]], list[float]]:
    def of(values: Mapping[str, FloatArray]) -> list[float]:
        there = values[quantity][np.isfinite(values[quantity])]
        return [float(np.max(np.abs(there))), float(np.ptp(there))] if there.size >= _FEWEST else []

    return of


def _first(values: Mapping[str, FloatArray]) -> list[float]:
    there = values["capacitance"][np.isfinite(values["capacitance"])]
    return [float(np.median(there[:5])), float(np.median(there))] if there.size >= _FEWEST else []


def _lasted(values: Mapping[str, FloatArray]) -> list[float]:
    t = values["time"][np.isfinite(values["time"])]
    return [float(np.ptp(t)), float(np.max(t))] if t.size >= _FEWEST else []


#: What may be told -> the quantities whose units it shows, how it is had from readings, and how near a ratio of units it is.
_KINDS: Mapping[str, tuple[tuple[str, ...], Callable[[Mapping[str, FloatArray]], list[float]], float]] = {
    "interval": (("time",), _intervals, _NEAR),
    "force": (("force",), _largest("force"), _EXACT),
    "displacement": (("displacement",), _largest("displacement"), _EXACT),
    "capacitance": (("capacitance",), _first, _OF_A_PART),
    "duration": (("time",), _lasted, _NEAR),
    "speed": (("displacement", "time"), _speeds, _NEAR),
}
