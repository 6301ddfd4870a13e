"""From the words and units in a header cell to the quantity they stand for, or the reason why the column is no record."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from types import MappingProxyType

from calib.lab.instruments.brackets import (
    LONGEST,
    bends_itself,
    ends_without_unit,
    factor_in,
    footnote_of,
    index_in,
    is_factor,
    is_letter,
    is_remark,
    is_wiring,
    kind_of_unit,
    leading_factor,
    no_record,
    not_now,
    parted,
    says_sense,
    tidy,
    unit_of_a_whole,
    without_brackets,
    without_conditions,
    words_in,
)
from calib.lab.instruments.factor_words import factor_before_symbol, free_number
from calib.lab.instruments.lexicon import MASSES, MEANS, NAMES, ONLY_WITH_UNIT, PROCESSED, QUALIFIERS, UNIT_WORDS
from calib.lab.instruments.meanings import PLAIN, Meaning, doubt_of, meanings, other_axis
from calib.lab.instruments.reach import RANGE, REACHES
from calib.lab.instruments.units import RECORDED, SI_UNIT, is_unit_of, lab_factor, looks_like_unit, may_be_meant

#: Quantities whose unit must be written in the file.
NEEDS_UNIT = ("time", "displacement", "force", "capacitance", "capacitance_series")

#: Example of a well-written header cell, for advice.
EXAMPLE: Mapping[str, str] = MappingProxyType(
    {
        "time": "Time (s)",
        "displacement": "Extension (mm)",
        "force": "Load (N)",
        "capacitance": "Cp (pF)",
        "capacitance_series": "Cs (pF)",
        "dissipation": "D",
        "quality": "Q",
        "frequency": "Frequency (Hz)",
        "cycle": "Cycle count",
        "status": "Status",
    }
)

_TAIL = re.compile(r"^(?P<name>.+?)\s*(?:_|/|,|:|\||\sin\s|\s)\s*(?P<unit>[^\s_/,:|]+)$")
# Words that are units within brackets only: of plain numbers, and centiseconds, which are a series capacitance, too.
_NO_TAIL = ("x", "#", "-", "1", "none", "cycles", "cs")
# Letters of a name that may be the beginning of a longer one.
_CUT = 9
_APART = " ,;:/"
# What the clocks of microcontrollers are called, by what they count.
_NAMES_OF_UNITS = ("millis", "micros")
# How far a load cell reaches, behind its name or before it: "Load cell 5 kN (N)", "load_10N_N", "10 N cell (mN)".
_REACH = r"\d+(?:[.,]\d+)?\s?(?:[mkµu]?N|k?g|k?gf|lbf?)"
_CAPACITY = re.compile(
    rf"(?P<name>.*?[^\W\d_])[\s_,-]+(?:(?i:{REACHES})[\s:=]+)?(?P<capacity>{_REACH})(?P<tail>[\s_,/]+[^\W\d_]+)?|"
    rf"(?P<first>{_REACH})[\s_]+(?P<behind>[^\W\d].*)"
)
# What may be a factor behind a name: "Capacitance x1E-12", "Load * 0.1", "Force*10"; "x1" is none.
_FACTOR_BEHIND = re.compile(
    r"(?P<name>.*?[^\W\d_])(?:\s+|(?=[*×÷·/]))"
    r"(?P<factor>(?![x×*·/÷]?\s?1$)(?:(?:[x×*·/÷]\s?)?[\d.,eE^+-]+|\d+(?:[.,]\d+)?\s?[x×]))"
)
# How a time of day is written: "mm:ss:ff", "h:min:s", "min,s".
_CLOCK_FORM = re.compile(r"[a-z]{1,5}(?:[:.][a-z]{1,5}){1,3}|(?:m|mm|min),\s?(?:s|ss|sec)", re.IGNORECASE)
# Of which run or specimen a column is, behind its unit: "Time (s) S1", "Force [N] run 2".
_OF_A_RUN = re.compile(
    r"(?P<name>.+[)\]])[\s_]*(?:s|p|specimen|sample|run|test|trial|rep|probe|prüfling|essai|prova|muestra)[\s_.#-]*(?P<index>\d{1,2})$",
    re.IGNORECASE,
)
# Which of several alike it is, behind its name: "Force No. 1 (N)".
_NUMBERED = re.compile(r"(?<=[^\W\d_]) (?:no|nr)\.? ?(?P<index>\d{1,2})(?=\s*[(\[])", re.IGNORECASE)
# Of which run a column is, before its name, as Logger Pro writes it: "Latest: Force (N)", "Data Set 1:Time(s)".
_RUN_BEFORE = re.compile(
    r"(?:primary|secondary|latest|data ?set|datensatz|run|trial|test|measurement|messung|versuch|essai|mesure|prova|ensayo)"
    r"(?:[ _#]?(?P<index>\d{1,2}))?\s*:\s*(?P<name>.+)",
    re.IGNORECASE,
)
# The letters that formulas have for a quantity, which may be units of another: "Weg s (mm)", "Depth h (mm)".
_SYMBOLS: Mapping[str, str] = MappingProxyType({"displacement": "shdxzwlu", "force": "FPL", "capacitance": "C", "time": "t"})
# "Normal load, P (N)", "Capacitance, C_p (pF)": the letter of formulas behind a name.
_NAME_AND_SYMBOL = re.compile(r"(?P<name>.*[^\W\d_]{2}),\s*(?P<symbol>[^\W\d_](?:_?[^\W\d_])?)")
# "Indentation $\\delta$ (mm)", "Indentation δ (mm)": what an approach is called in formulas, behind the name of one.
_AND_DELTA = re.compile(r"(?P<name>.*[^\W\d_]{3}),?\s(?:δ|delta)")
# These letters, and their indices; "Position, x (mm)" and "Force, F_t (N)" may be of another direction.
_BEHIND_COMMA: Mapping[str, str] = MappingProxyType(
    {"displacement": "shdzwuδ", "force": "FPLNW", "capacitance": "C", "time": "t"}
)
_INDICES: Mapping[str, str] = MappingProxyType({"displacement": "z", "force": "nNz", "capacitance": "psPS"})
# The symbol of a force along the normal, whose index is no unit where another stands behind it: "F_N [mN]".
_NORMAL_FORCE = re.compile(
    r"\$?(?P<letter>[Ff])_(?P<index>[Nn]|\{[Nn]\}|\{?\\mathrm\{[Nn]\}\}?)\$?(?P<behind>\s*[(\[]\s*(?P<bracket>[^()\[\]]+?)\s*[)\]]|"
    r"(?:\s*[/,]\s*|_|\s+in\s+)(?P<bare>[^\W\d_]+))?"
)
# What an LCR meter measures, at a frequency and a voltage that may stand beside its name.
_OF_A_METER = ("capacitance", "capacitance_series", "dissipation", "quality")
# Which of its values a meter shows, before what it is: "Primary (Cp)", "Param 1: Cs", "Secondary (D)".
_OF_ITS_VALUES = re.compile(
    r"(?:primary|secondary|main|sub|prim?\.?|sec\.?|(?:param(?:eter)?|value|display|measurement) ?[1-4A-D])"
    r"(?: (?:param(?:eter)?|value|display|measurement))?\s*"
    r"(?:[(\[](?P<inside>[^()\[\]]+)[)\]]|[:=-]\s*(?P<behind>[^\s()\[\]]+))(?P<rest>.*)",
    re.IGNORECASE,
)
#: How reasons begin for which a column is not read, where nothing is known of what it is.
UNKNOWN = ("not understood", "two units", "a letter without a unit")
#: How the reason begins of a column that may be the change of a quantity.
MAY_BE_A_CHANGE = "may be a change of "
#: A function of what was measured.
FUNCTION = re.compile(r"\b(?:log\d*|ln|lg|sqrt|exp)\b|√|(?<=[^\W\d])(?:\^\s?[2-9]|\*\*\s?[2-9]|[²³])", re.IGNORECASE)
# "Force exp (N)", "F_exp (N)", "Force (exp.) [N]", "exp. force (N)": of the experiment, as its unit tells; "exp(F)" has none.
_OF_EXPERIMENT = re.compile(
    r"(?P<before>[^()\[\]]*[^\W\d_])(?:[\s_,-]+exp\.?|\s*[(\[]exp\.?[)\]])(?P<behind>(?:[\s_,/]*[(\[]|[\s_,/]+)[^\W\d_]+[)\]]?|)|"
    r"exp(?:\.\s?|[\s_])(?P<name>[^\W\d].*)",
    re.IGNORECASE,
)
_SERIES = re.compile(r"series|serie|reihe|\bcs\b|cs-|ls-|\bser\b", re.IGNORECASE)
_PARALLEL = re.compile(r"parallel|\bcp\b|cp-|\bpar\b|parall[eè]le", re.IGNORECASE)
# A setting of a meter, such as "Range" or "Meas. range (ohm)"; the range of a load is a statistic.
_SETTING = re.compile(rf"(?:(?:meter|measurement|lcr|current|impedance|auto) )?(?:{RANGE})")
# Units that are spelled out, which some write in the place of a name; "meter" is an instrument.
_SPELLED_UNIT = re.compile(
    r"(?:milli|micro)?(?:seconds|secondes|sekunden|segundos|secondi)|minut(?:es|en|os)|[a-z]*newtons?|[a-z]+farads?|"
    r"[a-z]+m[eéè]t(?:er|re|ro|ri)s?|microns|inches",
    re.IGNORECASE,
)
_KNOWN_BY_WORDS = (
    (r"\btemp\b|temperatur|température|temperatura|온도|温度", "a temperature: not used"),
    (r"humid|feuchte|humidité", "a humidity: not used"),
    (r"stiffness|steifigk|raideur|rigidez|\bspring (?:rate|constant)|feder(?:rate|konstante)", "a stiffness: not used"),
    (
        r"speed|velocity|\brates?\b|(?:mess|abtast|dehn|kraft|weg|last|sample|strain|load|data|scan)rate\b|geschwindigkeit|vitesse",
        "a rate: not used",
    ),
    (r"stress|spannung|contrainte|pressure|(?<!ein)druck$|naprężenie|応力|应力|응력", "a stress or pressure: not used"),
    (r"strain|(?<!aus)dehnung|odkształcenie|ひずみ|应变|변형률", "a strain: not used"),
    (r"r[eé][sz]onan", "a frequency of resonance, no capacitance without the inductance of its circuit: not used"),
    (r"energy|\bwork\b|energie|arbeit", "an energy: not used"),
    (r"^row ?names?$", "names of the rows: not used"),
)
# Names of one letter mean many things; their unit decides.
_STRAIN = re.compile(r"%|mm/mm|m/m|in/in|strain|[µu]ε|[µu]strain")


@dataclass(frozen=True)
class Heading:
    """A header cell that was understood.

    Attributes
    ----------
    quantity : what the column holds.
    rank : its preference among the names of the quantity, 0 is best.
    name : in lower case, without unit and brackets.
    unit : in the name, None if it is not there.
    index : which of several alike: "2" of "Load 2", "b" of "Force_B", "" where the name has none.
    processed : whether the name says that the readings were worked on: filtered, corrected.
    unit_doubt : why the unit or a factor cannot be told, which the user's `units` settles; "" if it can.
    name_doubt : why it is not sure that the column is meant, which the user's `columns` settles; "" if it is.
    letter : whether the name is a single letter, which means other things elsewhere.
    not_understood : what stands in brackets, where nothing but that leaves the name in doubt.
    """

    quantity: str
    rank: int
    name: str
    unit: str | None
    index: str = ""
    processed: bool = False
    unit_doubt: str = ""
    name_doubt: str = ""
    letter: bool = False
    not_understood: tuple[str, ...] = ()


def words(name: str) -> str:
    """Write a name in lower case with single spaces: `Z_Position` -> "z position"."""
    return re.sub(r"[\s_]+", " ", unicodedata.normalize("NFKC", name).strip().lower()).strip(" .:")


def without_run(cell: str) -> str:
    """A header cell without the run that stands before its name.

    >>> without_run("Data Set 1:Time(s)"), without_run("Latest: Force (N)"), without_run("Time (s)")
    ('Time(s)', 'Force (N)', 'Time (s)')
    """
    match = _RUN_BEFORE.fullmatch(cell.strip())
    return match["name"] if match is not None else cell


# More names than the longest line has: they are looked at many times while a file is read.
_MOST_NAMES = 16384


def understood_names(quantity: str) -> str:
    """List the names that a quantity may have in a header, for advice."""
    return ", ".join(f'"{n}"' for n in NAMES[quantity][:6])


@lru_cache(maxsize=_MOST_NAMES)
def understand(cell: str, unit_below: str = "") -> Heading | None:
    """Tell what a column holds from its header cell, in any of the languages and spellings that are known.

    Every bracket of the cell is looked at: a unit, a wiring or a remark, a factor, a statistic.

    Parameters
    ----------
    cell : such as "Load", "Load (N)", "CP[F]", "force_N", "Position(Linear:Digital Position) (mm)", "Fz, N".
    unit_below : unit in a units row under the cell, "" if none. It decides where a letter means two things (D, d, F, f).

    Returns
    -------
    None if the cell is not understood, or says that the column is no record; `why_unread` has the reason.

    >>> understand("Compressive load (kN)").quantity, understand("Compressive load (kN)").unit
    ('force', 'kN')
    >>> understand("d", "mm").quantity, understand("D").quantity
    ('displacement', 'dissipation')
    >>> understand("Force (peak hold) (N)"), understand("Load (kN) (N)").unit_doubt
    (None, 'two units, "kN" and "N"')
    """
    found = _interpret(cell, unit_below)
    if isinstance(found, Heading):
        return found
    twice = _TWICE.fullmatch(cell.strip())
    return understand(twice["name"], unit_below) if twice is not None else None


# What programs put behind a name of which a table has two: "time_s.1", "time_s_x", "time_s_lcr".
_TWICE = re.compile(r"(?P<name>.*[^\W\d_)\]]\W?)(?:\.\d{1,2}|[_ ](?:x|y|lcr|meter|instron|tester|left|right))", re.IGNORECASE)


def why_unread(cell: str, unit_below: str = "") -> str:
    """Say why a column is not read whose header cell `understand` makes nothing of.

    Parameters
    ----------
    cell, unit_below : as of `understand`.

    >>> why_unread("T (°C)"), why_unread("Force (max) (N)"), why_unread("Operator")
    ('a temperature: not used', '"max" is a statistic, no record', 'not understood')
    """
    found = _interpret(cell, unit_below)
    return found if isinstance(found, str) else "not used"


def as_a_record(cell: str, unit_below: str = "") -> Heading | None:
    """Read a header cell as if it did not say that the column is no record, by which factor to multiply it, or in which unit.

    Parameters
    ----------
    cell, unit_below : as of `understand`.

    Returns
    -------
    The heading of the name alone, with the unit that stands there, be it none of the quantity; None if it is not understood, or
    if name and unit together are the usual ones of something else: a compression in per cent is a strain.

    >>> as_a_record("Load setpoint (N)").quantity, as_a_record("Extension (max) [x10] (mm)").quantity
    ('force', 'displacement')
    >>> as_a_record("Load (kPa)").quantity, as_a_record("Compression (%)")
    ('force', None)
    """
    cut = without_brackets(tidy(cell))
    if cut is None:
        return None
    units = [part for b in cut[1] for part in parted(b) if looks_like_unit(part)]
    outside = re.sub(r"/([^\W\d_]+)$", lambda of: "" if no_record(of[1]) else of[0], cut[0])
    name = " ".join(part for part in re.split(r"[\s_]+", outside) if not no_record(part))
    found = understand(f"{name} ({units[-1]})" if units and not unit_below else name, unit_below)
    if found is not None:
        return found
    unit, alone = unit_below or (units[-1] if units else ""), understand(name)
    of_share = alone is not None and alone.quantity == "displacement" and _STRAIN.fullmatch(unit)
    of_charge = alone is not None and kind_of_unit(unit, charge=True) == "an electric charge" and "charge" in alone.name
    return replace(alone, unit=unit) if alone is not None and unit and not of_share and not of_charge else None


def as_a_mean(cell: str, unit_below: str = "") -> Heading | None:
    """Read a header cell that says that its column is a mean of readings as the name of what they are of; None if it does not.

    Parameters
    ----------
    cell, unit_below : as of `understand`.

    >>> as_a_mean("force mean (N)").quantity, as_a_mean("force max (N)"), as_a_mean("mean of max force (N)")
    ('force', None, None)
    >>> as_a_mean("Cp mean of 8 (pF)").quantity, as_a_mean("Force (N, avg of 10)").unit
    ('capacitance', 'N')
    """
    if not any(character.isalpha() for character in cell):
        return None
    cell = _OF_READINGS.sub("mean", cell)
    said = words_in(re.sub(r"[()\[\]{}]", " ", cell))
    if not any(word in MEANS for word in said) or any(word not in MEANS and no_record(word) for word in said):
        return None
    return as_a_record(cell, unit_below)


# Of how many readings each value is the mean, as a meter averages: "mean of 8", "avg of 16 samples"; of specimens it is none.
_OF_READINGS = re.compile(
    r"(?<![^\W_])(?:mean|average|avg\.?|averaged|mittel|mittelwert|moyenne|media|promedio)\s(?:of|over|aus|von|über|de|sur|di|su)\s"
    r"(?:n\s?=\s?)?\d{1,4}(?![\d.,])(?:\s(?:readings?|samples|points|values|messwerten|messungen|mesures|medidas|letture))?"
    r"(?=\s*(?:[()\[\],;]|$))",
    re.IGNORECASE,
)


def is_mean_of_readings(cell: str) -> bool:
    """Whether a header cell says of how many readings each of its values is the mean, as a meter averages.

    >>> is_mean_of_readings("Capacitance (mean of 8) (pF)"), is_mean_of_readings("Cp (mean of 8 specimens) (pF)")
    (True, False)
    """
    return _OF_READINGS.search(cell) is not None


# What stands behind the brackets of a name with its unit, in brackets of its own or not.
_BEHIND_UNIT = re.compile(
    r"(?P<first>[^()\[\]]*[^\W\d_][^()\[\]]*[(\[]\s*(?P<unit>[^()\[\]]+?)\s*[)\]])\s*[,;]?\s*(?P<words>.+)"
)


def words_passed_by(cell: str) -> str:
    """The words behind the unit of a name that is understood of which nothing says what they are; "" if there are none.

    How a column was measured and worked on, how far the instrument reaches, and of which run it is, are known.

    >>> [words_passed_by(f"Force (N) {words}") for words in ("x", "left", "cell 2", "(rel.)", "measured", "max. 20 N", "run 2")]
    ['x', 'left', 'cell 2', 'rel.', '', '', '']
    """
    match = _BEHIND_UNIT.fullmatch(cell.strip()) if len(cell) <= LONGEST else None
    if match is None or not looks_like_unit(match["unit"]) or _OF_A_RUN.fullmatch(tidy(cell)) or footnote_of(cell):
        return ""
    said = match["words"].strip(" ()[],;")
    words_said = [w for w in re.split(r"[\s.,;:()\[\]/-]+", said.lower()) if w]
    known = QUALIFIERS | PROCESSED
    if not words_said or all(w in known for w in words_said) or any(w in PROCESSED or w in MEANS for w in words_said):
        return ""
    alone = tidy(match["first"])
    told = is_wiring(said) or says_sense(said) or without_conditions(cell)[1] or tidy(cell) in (alone, f"{alone} (filtered)")
    return "" if told or said.startswith("_") or any(meanings(words(said), (), "")) else said


def heading_as(quantity: str, cell: str, unit_below: str = "") -> Heading:
    """Read a header cell as the name of a quantity that the user says it is; only its units and factors can be in doubt then.

    Parameters
    ----------
    quantity : one of `SI_UNIT`.
    cell, unit_below : as of `understand`.
    """
    cell = _without_its_index(cell, unit_below)
    measured = _without_experiment(tidy(cell)) if quantity in NEEDS_UNIT[1:] else cell
    of_quantity = any(unit and is_unit_of(unit, quantity) for unit in (unit_below, *_units_written(measured)))
    cell = measured if measured != cell and of_quantity else cell
    cell = without_conditions(tidy(cell))[0] if quantity in _OF_A_METER else tidy(cell)
    cut = without_brackets(cell)
    outside, brackets = cut if cut is not None else (cell, ())
    brackets = tuple(part for bracket in brackets for part in parted(bracket))
    name, tail = next((n for n in _with_tail(outside) if is_unit_of(n[1], quantity)), (outside, ""))
    # One letter beside a bracket is a symbol, such as N of a normal force.
    whole = is_unit_of(outside, quantity) and SI_UNIT[quantity] and not (brackets and len(outside) == 1)
    tail = tail or (outside if whole else "")
    tail = tail or (unit_of_a_whole(outside) if quantity == "time" else "")
    unit, doubt = _unit_of(quantity, [*brackets, *([tail] if tail else [])], unit_below)
    if unit is None and not doubt and not unit_below:
        odd = [b for b in brackets if looks_like_unit(b) and not is_letter(b)]
        unit = odd[-1] if odd else None
    doubt = doubt or ("" if brackets or unit_below else _unsure_tail(outside, tail))
    doubt = doubt or _second_unit(quantity, outside, unit or unit_below)
    factor = leading_factor(cell) or factor_in(outside) or factor_before_symbol(outside)
    function = FUNCTION.search(outside)
    doubt = doubt or (f'the factor "{factor}" beside its unit' if factor else "")
    doubt = doubt or next((d for bracket in brackets if (d := _may_be_factor(quantity, bracket))), "")
    doubt = doubt or (f'"{function[0]}" in its name: the readings are a function of it' if function else "")
    return Heading(quantity, 0, words(name), unit, unit_doubt=doubt)


def _may_be_factor(quantity: str, bracket: str) -> str:
    """Why a bracket may say by what the readings are to be multiplied: it has a number of which nothing tells what it is."""
    number = free_number(bracket) if SI_UNIT[quantity] else ""
    clock = quantity == "time" and _CLOCK_FORM.fullmatch(bracket)
    if not number or clock or is_unit_of(bracket, quantity) or is_wiring(bracket) or index_in(bracket) or says_sense(bracket):
        return ""
    of_mean = is_mean_of_readings(f"({bracket})") or any(m.quantity == quantity for m in meanings(words(bracket), (), ""))
    return "" if of_mean else f'"{bracket}" in its name may be a factor, or what was taken off'


def _second_unit(quantity: str, outside: str, unit: str) -> str:
    """Why the unit is in doubt of a name with another one among its words: "N" of "Force in N or mN"; "" if there is none.

    A word behind a number says how far an instrument reaches; one that is a word of a language is a unit at the end alone.
    """
    if not unit or not is_unit_of(unit, quantity) or not SI_UNIT[quantity]:
        return ""
    said = [word for word in re.split(r"[\s_,;:|/]+", outside) if word]
    if len(said) == 1 and len(said[0]) == 1:
        return ""  # a symbol, such as N of a normal force
    own, at_end = lab_factor(unit, quantity), len(said) > 1 and not ends_without_unit(outside)
    for k, word in enumerate(said):
        plain = word.lower() not in UNIT_WORDS or (at_end and k == len(said) - 1)
        behind_number = k > 0 and said[k - 1][-1:].isdecimal()
        if plain and not behind_number and is_unit_of(word, quantity) and lab_factor(word, quantity) != own:
            return f'two units, "{word}" and "{unit}"'
    return ""


def is_of_experiment(cell: str) -> bool:
    """Whether "exp" in a name is read as a word for the experiment, as it is beside a unit of what stands there.

    >>> is_of_experiment("Force exp (N)"), is_of_experiment("exp(F) (N)"), is_of_experiment("Exp. time (s)")
    (True, False, False)
    """
    return _without_experiment(tidy(cell)) != tidy(cell) and understand(cell) is not None


def _without_experiment(cell: str) -> str:
    """A cell without the word that says that its column is of the experiment: "Force (N)" of "Force exp (N)"."""
    match = _OF_EXPERIMENT.fullmatch(cell)
    return cell if match is None else match["name"] or f"{match['before']}{match['behind']}"


def _units_written(cell: str) -> list[str]:
    """What may be the unit of a cell: its brackets, and the word behind its name."""
    cut = without_brackets(cell)
    return [*cut[1], *(tail for _, tail in _with_tail(cut[0]))] if cut is not None else []


def unit_of_normal_force(cell: str, unit_below: str = "") -> str:
    """The unit that stands behind the symbol of a normal force, or below it; "" of any other name, or where none stands.

    Parameters
    ----------
    cell, unit_below : as of `understand`.

    >>> [unit_of_normal_force(cell) for cell in ("F_N [mN]", "F_N", "F_T (N)")], unit_of_normal_force("F_N", "kN")
    (['mN', '', ''], 'kN')
    """
    match = _NORMAL_FORCE.fullmatch(cell.strip()) if len(cell) <= LONGEST else None
    unit = (match["bracket"] or match["bare"] or unit_below) if match is not None else ""
    return unit if unit and is_unit_of(unit, "force") else ""


def _without_its_index(cell: str, unit_below: str) -> str:
    """A cell with the symbol of a normal force without what sets its index apart; any other as it is."""
    match = _NORMAL_FORCE.fullmatch(cell.strip()) if unit_of_normal_force(cell, unit_below) else None
    return f"{match['letter']}n{match['behind'] or ''}" if match is not None else cell


@lru_cache(maxsize=_MOST_NAMES)
def _interpret(cell: str, unit_below: str) -> Heading | str:
    """The heading of a cell, or why there is none."""
    # Of columns without names there are thousands in a damaged file, each with its number for one.
    if len(cell) > LONGEST or (cell.isdecimal() and not unit_below):
        return "not understood"
    if factor := leading_factor(cell):
        return f'the factor "{factor}" stands before its name'
    if machine := bends_itself(cell):
        return machine
    cell = _without_its_index(cell, unit_below)
    cell = _NUMBERED.sub(r" \g<index>", _OF_A_RUN.sub(r"\g<name> \g<index>", tidy(cell)))
    of_run = _RUN_BEFORE.fullmatch(cell)
    if of_run is not None and not understand(cell[: of_run.start("name")]):
        found = _interpret(of_run["name"], unit_below)
        return replace(found, index=found.index or of_run["index"] or "") if isinstance(found, Heading) else found
    if (measured := _without_experiment(cell)) != cell:
        found = _interpret(measured, unit_below)
        of_quantity = isinstance(found, Heading) and is_unit_of(found.unit or unit_below or "?", found.quantity)
        if isinstance(found, Heading) and of_quantity and found.quantity in NEEDS_UNIT[1:]:
            return found
    if (of_value := _OF_ITS_VALUES.fullmatch(cell)) is not None:
        found = _interpret(f"{of_value['inside'] or of_value['behind']}{of_value['rest']}", unit_below)
        if isinstance(found, Heading) and found.quantity in _OF_A_METER:
            return found
    plain, conditions = without_conditions(cell)
    if conditions:
        found = _interpret(plain, unit_below)
        if isinstance(found, Heading) and found.quantity in _OF_A_METER:
            return replace(found, rank=found.rank + PLAIN, index=found.index or conditions.lower())
    if spelled := spelled_unit(cell):
        quantity, written = spelled
        unit, doubt = _unit_of(quantity, [written], unit_below)
        return Heading(quantity, len(NAMES[quantity]), words(cell), unit, unit_doubt=doubt)
    cut = without_brackets(cell)
    if cut is None or (len(cell) > 1 and looks_like_unit(cell) and not any(words(cell) in names for names in NAMES.values())):
        return "not understood"
    brackets = tuple(part for bracket in cut[1] for part in parted(bracket))
    outside, factor = _without_factor(cut[0], cell)
    brackets = (*brackets, factor) if factor else brackets
    if (of_symbol := _NAME_AND_SYMBOL.fullmatch(outside)) is not None:
        behind = " ".join(f"({b})" for b in brackets)
        found = _interpret(f"{of_symbol['name']} {behind}".strip(), unit_below)
        if isinstance(found, Heading) and _is_its_symbol(of_symbol["symbol"], found.quantity, (*brackets, unit_below)):
            own = _interpret(f"{of_symbol['symbol']} {behind}".strip(), unit_below) if found.quantity == "capacitance" else ""
            return own if isinstance(own, Heading) else found
    if (of_delta := _AND_DELTA.fullmatch(outside)) is not None:
        found = _interpret(f"{of_delta['name']} {' '.join(f'({b})' for b in brackets)}".strip(), unit_below)
        there = any(unit and is_unit_of(unit, "displacement") for unit in (*brackets, unit_below))
        if there and isinstance(found, Heading) and found.quantity == "displacement":
            return found
    outside, capacity = _without_capacity(outside, (*brackets, unit_below))
    if capacity:
        found = _interpret(f"{outside} {' '.join(f'({b})' for b in brackets)}", unit_below)
        return replace(found, index=found.index or capacity.lower()) if isinstance(found, Heading) else found
    if (in_both := _in_two_languages(outside, brackets, unit_below)) is not None:
        return in_both
    for name, tail in (*_with_tail(outside), (_bare(outside), "")):
        inside = [*brackets, tail] if tail else list(brackets)
        plain = words(name)
        readings = list(meanings(plain, inside, unit_below))
        if tail and readings and _is_symbol(tail, readings[0].quantity, (*brackets, unit_below)):
            return _weighed(readings, plain, brackets, unit_below)
        if tail and readings and not any(is_unit_of(tail, m.quantity) for m in readings):
            # What stands behind the name is no unit of it: "Load A", "Time N"; or one in another case: "Load_MN".
            if not is_letter(tail) and (looks_like_unit(tail) or any(may_be_meant(tail, m.quantity) for m in readings)):
                return _weighed(readings, plain, inside, unit_below)
            continue
        if readings:
            found = _weighed(readings, plain, inside, unit_below)
            doubt = _unsure_tail(outside, tail) if isinstance(found, Heading) and not (brackets or unit_below) else ""
            doubt = _factor_behind(outside) or doubt
            return replace(found, unit_doubt=found.unit_doubt or doubt) if isinstance(found, Heading) and doubt else found
        if whole := _cut_name(plain, [*inside, unit_below]):
            return _weighed(list(meanings(whole, inside, unit_below)), whole, inside, unit_below)
    without_tail = next((words(name) for name, _ in _with_tail(outside)), "")
    return f"axis {axis}: not used" if (axis := other_axis(without_tail)) else _reason(words(outside), brackets, unit_below)


# A name in Chinese, Japanese or Korean before or behind one in Latin letters, with a blank or nothing between them.
_EASTERN = r"[\u3040-\u30ff\u3400-\u9fff\uac00-\ud7a3]+"
_TWO_LANGUAGES = re.compile(
    rf"(?P<first>{_EASTERN}|[A-Za-z][A-Za-z .]*?)[\s_/:-]*(?P<second>{_EASTERN}|[A-Za-z][A-Za-z .]*)"
    r"(?P<tail>[,/_]\s?[^\W\d_]+)?"
)


def _in_two_languages(outside: str, brackets: Sequence[str], unit_below: str) -> Heading | None:
    """What a name is that stands there twice, in letters of the East and in Latin ones: "时间 Time", "Load荷重"; else None."""
    match = None if outside.isascii() else _TWO_LANGUAGES.fullmatch(outside)
    if match is None or match["first"].isascii() == match["second"].isascii():
        return None
    behind = " ".join(f"({b})" for b in (*brackets, (match["tail"] or "").strip(" ,/_")) if b)
    one, other = (understand(f"{match[part]} {behind}".strip(), unit_below) for part in ("first", "second"))
    alike = one is not None and other is not None and (one.quantity, one.index) == (other.quantity, other.index)
    if one is None or other is None or not alike:
        return None
    return min(one, other, key=lambda heading: (not heading.processed, bool(heading.letter), heading.rank))


def _is_symbol(tail: str, quantity: str, units: Sequence[str]) -> bool:
    """Whether a letter behind a name is what formulas have for its quantity, where a unit of that stands beside it."""
    there = any(unit and is_unit_of(unit, quantity) for unit in units)
    return there and tail in _SYMBOLS.get(quantity, "") and not is_unit_of(tail, quantity)


def _is_its_symbol(symbol: str, quantity: str, units: Sequence[str]) -> bool:
    """Whether a letter behind a name and a comma, with an index that says nothing else, is what formulas have for it."""
    letter, index = symbol[:1], symbol[1:].strip("_")
    there = any(unit and is_unit_of(unit, quantity) for unit in units)
    return there and letter in _BEHIND_COMMA.get(quantity, "") and (not index or index in _INDICES.get(quantity, ""))


def _without_factor(outside: str, cell: str) -> tuple[str, str]:
    """The words outside of the brackets without a factor that ends them, and that: "x1E-12" of "Capacitance (F) x1E-12".

    A plain number is one behind brackets only: the force of "Force x2 (N)" may be of an axis.
    """
    match = _FACTOR_BEHIND.fullmatch(outside)
    if match is None or not is_factor(match["factor"]):
        return outside, ""
    behind = re.search(rf"[)\]}}]\s*{re.escape(match['factor'])}\s*$", cell) is not None
    return (match["name"], match["factor"]) if behind or re.search(r"[eE^*×÷·/]", match["factor"]) else (outside, "")


def _without_capacity(outside: str, units: Sequence[str]) -> tuple[str, str]:
    """The words outside of the brackets without how far the cell reaches, and that: "5 kN" of "Load cell 5 kN (N)".

    It is one where the unit of the readings stands beside it; else "5 kN" is a number and the unit.
    """
    match = _CAPACITY.fullmatch(outside)
    if match is None:
        return outside, ""
    tail = (match["tail"] or "").strip(" _,/")
    if not any(unit and is_unit_of(unit, "force") for unit in (*units, tail)):
        return outside, ""
    name = (match["name"] or match["behind"]).strip(" _,/-")
    return f"{name} {tail}".strip(), (match["capacity"] or match["first"]).replace(" ", "")


def spelled_unit(cell: str) -> tuple[str, str] | None:
    """Quantity and unit of a header cell that is nothing but a unit spelled out; None if it is more, or none.

    >>> spelled_unit("Millimeters"), spelled_unit("newtons"), spelled_unit("Meter")
    (('displacement', 'Millimeters'), ('force', 'newtons'), None)
    """
    if _SPELLED_UNIT.fullmatch(cell) is None:
        return None
    return next(((q, u) for u in (cell, cell.lower()) for q in RECORDED if is_unit_of(u, q)), None)


_BEGINNINGS = MappingProxyType({quantity: "\n" + "\n".join(names) for quantity, names in NAMES.items()})


def _cut_name(name: str, units: Sequence[str]) -> str:
    """The name that one cut to a fixed width is the beginning of, as "Standardkr" of testers: by a unit of one quantity alone.

    "" if it is of none, or of several.
    """
    if len(name) < _CUT:
        return ""
    whole = {
        quantity: next(n for n in names if n.startswith(name))
        for quantity, names in NAMES.items()
        if f"\n{name}" in _BEGINNINGS[quantity] and any(u and is_unit_of(u, quantity) for u in units)
    }
    return next(iter(whole.values())) if len(whole) == 1 else ""


def _bare(outside: str) -> str:
    """The words without the marks between them and a unit; a minus before them is no such mark."""
    return outside.strip(_APART).rstrip(f"{_APART}-")


def _with_tail(outside: str) -> Iterator[tuple[str, str]]:
    """The words of a cell as a name with its unit behind it, if they are one: "force_N", "Time, s", "Weg in mm"."""
    match = _TAIL.match(_bare(outside)) if len(outside) <= LONGEST else None
    if match is None or match["unit"] in _NO_TAIL or ends_without_unit(outside):
        return
    miscased = len(match["unit"]) > 1 and any(may_be_meant(match["unit"], quantity) for quantity in NEEDS_UNIT)
    if looks_like_unit(match["unit"]) or miscased:
        yield _bare(match["name"]), match["unit"]


# A number between blanks before a unit, "Load cell 5 kN", and the instrument that is called as its unit.
_NUMBER_AND_UNIT = re.compile(r".*[^\W\d_][.:]? +(?P<said>\d+(?:[.,]\d+)? +\S+)")
_INSTRUMENT = re.compile(r".*[^\W\d_] +(?P<said>mi[ck]rom(?:eter|etre|ètre|etro))", re.IGNORECASE)


def _unsure_tail(outside: str, tail: str) -> str:
    """Why the word behind a name may be no unit of its readings; "" if it is sure to be one."""
    reach, instrument = (form.fullmatch(outside.strip()) if tail else None for form in (_NUMBER_AND_UNIT, _INSTRUMENT))
    if reach is not None:
        return f'"{reach["said"]}" in its name may be how far the instrument reaches or what was set, and "{tail}" no unit'
    return f'"{instrument["said"]}" in its name may be an instrument, and no unit' if instrument is not None else ""


def _factor_behind(outside: str) -> str:
    """Why readings may have been multiplied or divided, as a sign and a number in a name say: "Force raw/2"; "" if not."""
    factor = factor_in(outside)
    return f'the factor "{factor}" stands in its name' if factor[:1] in tuple("/*×·÷") else ""


def _weighed(readings: Sequence[Meaning], name: str, inside: Sequence[str], unit_below: str) -> Heading | str:
    """The one meaning that the units and other brackets leave, or why none is left."""
    letter = (len(re.sub(r"[ \d]", "", name)) == 1 and name.isascii()) or readings[0].letter
    written = [b for b in inside if b]
    fitting = [m for m in readings if any(is_unit_of(b, m.quantity) for b in (*written, unit_below) if b)]
    if not fitting and len(readings) > 1:
        # A unit in another case tells which of several it is, and is asked about: "f_mn".
        meant = [m for m in readings if any(may_be_meant(b, m.quantity) for b in (*written, unit_below) if b)]
        readings = meant if len({m.quantity for m in meant}) == 1 else readings
    if not fitting and len(readings) > 1:
        other = kind_of_unit(unit_below or (written[-1] if written else ""), charge=name in ("q", "charge"))
        if other:
            return f"{other}: not used"
        if written or unit_below:
            return "not understood"
        fitting = [m for m in readings if not SI_UNIT[m.quantity]]
        if not fitting:
            return "a letter without a unit"
    of_place = "stage" in name.split() and name not in NAMES["displacement"]
    if not fitting and (name in ONLY_WITH_UNIT or of_place or not MASSES.isdisjoint(name.split())):
        other = kind_of_unit(unit_below or (written[-1] if written else ""))
        return f"{other}: not used" if other and not other.startswith("in ") else "not understood"
    meaning = (fitting or list(readings))[0]
    quantity = meaning.quantity
    if name == "df" and any(is_unit_of(unit, "force") for unit in (*written, unit_below) if unit):
        return f"{MAY_BE_A_CHANGE}a force: not used"
    if not fitting:
        reason = _of_something_else(quantity, name, [*written, *([unit_below] if unit_below else [])], letter=letter)
        if reason:
            return reason
    for bracket in written:
        clock = quantity == "time" and _CLOCK_FORM.fullmatch(bracket)
        if not (clock or is_unit_of(bracket, quantity) or is_wiring(bracket)) and (
            reason := not_now(bracket) or no_record(bracket)
        ):
            return reason
    unit, unit_doubt = _unit_of(quantity, written, unit_below)
    if unit is None and not (unit_doubt or unit_below) and name in _NAMES_OF_UNITS:
        unit = name
    index, name_doubt, processed = meaning.index, meaning.doubt, meaning.processed
    unknown: list[str] = []
    for bracket in written:
        if is_unit_of(bracket, quantity) or is_factor(bracket):
            continue
        plain = words(bracket)
        if quantity.startswith("capacitance") and (_SERIES.search(bracket) or _PARALLEL.search(bracket)):
            series, parallel = bool(_SERIES.search(bracket)), bool(_PARALLEL.search(bracket))
            if series and parallel:
                unknown.append(bracket)
            elif series and name in NAMES["capacitance"][:4]:
                name_doubt = f'the name says Cp, "{bracket}" a series capacitance'
            elif series:
                quantity = "capacitance_series"
            else:
                name = "cp" if quantity == "capacitance" else name
        elif plain in ("x", "y"):
            name_doubt = f'"{bracket}" is another axis'
        elif doubt := doubt_of(quantity, re.split(r"[ .,;/-]+", plain)):
            name_doubt = f'"{bracket}": {doubt}'
        elif quantity == "time" and _CLOCK_FORM.fullmatch(bracket):
            unit = unit or bracket
        elif quantity == "force" and plain in ("abs", "absolute"):
            name_doubt = f'"{bracket}" may mean that the sign is lost'
        elif (
            is_remark(bracket)
            or (plain in ("t", "time") and any(is_unit_of(b, quantity) for b in (*written, unit_below) if b))
            or is_wiring(bracket)
            or says_sense(bracket)
            or any(m.quantity == quantity for m in meanings(plain, (), ""))
            or f"{name} {plain}" in NAMES[quantity]
        ):
            continue
        elif any(w in PROCESSED for w in re.split(r"[ .,;/-]+", plain)):
            processed = True
        elif index_in(bracket):
            index = index_in(bracket)
        else:
            unknown.append(bracket)
    remarks: tuple[str, ...] = ()
    if unknown and (unit is not None or unit_below):
        remarks = () if name_doubt else tuple(unknown)
        name_doubt = name_doubt or f'"{unknown[0]}" in brackets is not understood'
    elif unknown and unit is None:
        unit = unknown[-1]
    return Heading(quantity, meaning.rank, name, unit, index, processed, unit_doubt, name_doubt, letter, remarks)


def _unit_of(quantity: str, written: Sequence[str], unit_below: str) -> tuple[str | None, str]:
    """The unit among the brackets of a name, and why it is in doubt."""
    units = [b for b in written if b and is_unit_of(b, quantity)]
    own = unit_below if unit_below and is_unit_of(unit_below, quantity) else ""
    if SI_UNIT[quantity] == "":
        # Of a plain number a bracket with a power of ten is the unit.
        units = [u for u in units if u.lower() not in ("x",)]
    different = {lab_factor(u, quantity): u for u in units}
    if len(different) > 1:
        return units[-1], "two units, " + " and ".join(f'"{u}"' for u in different.values())
    factors = [b for b in written if b and is_factor(b) and b not in units]
    if factors:
        shown = units[-1] if units else own or "unit"
        return (
            units[-1] if units else None,
            f'the factor "{factors[0]}" in its name: the readings may have been multiplied by it, or have to be ({shown})',
        )
    # A letter such as A or C beside a unit is no second unit, anything else is; F, the sign of a force, too, is the farad.
    others = [b for b in written if b and looks_like_unit(b) and b not in units and not is_wiring(b)]
    others = [b for b in others if not is_letter(b) or (b == "F" and quantity in ("time", "displacement"))]
    others = [b for b in others if b not in ("-", "1", "#", "x") and not no_record(b)]
    if others and (units or own):
        return (units[-1] if units else None), f'two units, "{others[0]}" and "{(units or [own])[-1]}"'
    if units:
        return units[-1], ""
    return None, ""


def _of_something_else(quantity: str, name: str, units: Sequence[str], *, letter: bool) -> str:
    """Why a column with the name of a quantity is something else by its unit; "" where the unit is wrong or unknown."""
    for unit in units:
        if unit in ("-", "1", "#", "x"):
            continue
        kind = kind_of_unit(unit, charge=name in ("charge", "q"))
        if kind and quantity == "displacement" and _STRAIN.fullmatch(unit):
            return "a share or strain: not used"
        if kind and (letter or quantity not in ("time", "cycle", "status")):
            known = any(is_unit_of(unit, q) for q in ("time", "displacement", "force", "capacitance", "frequency"))
            if letter or not known:
                return f"{kind}: not used"
    return ""


def _reason(name: str, brackets: Sequence[str], unit_below: str) -> str:
    """Why a name that means no quantity is not read."""
    if _SETTING.fullmatch(name):
        return "a range of the instrument: not used"
    if (function := FUNCTION.search(name)) is not None:
        return f'"{function[0]}" makes it a function of a reading: not used'
    for pattern, reason in _KNOWN_BY_WORDS:
        if re.search(pattern, name):
            return reason
    for text in (name, *brackets):
        if not looks_like_unit(text) and (reason := not_now(text) or no_record(text)):
            return reason
    if axis := other_axis(name):
        return f"axis {axis}: not used"
    _, tail = next(_with_tail(name), ("", ""))
    for unit in (*brackets, unit_below, tail):
        kind = kind_of_unit(unit) if unit and not is_letter(unit) else ""
        if kind and not kind.startswith("in "):
            return f"{kind}: not used"
    return "not understood"
