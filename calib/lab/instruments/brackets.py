"""From a header cell to the words outside of its brackets and what each of its brackets is: a unit, a factor, a remark."""

from __future__ import annotations

import re
import unicodedata
from functools import lru_cache
from itertools import pairwise

from calib.lab.instruments.factor_words import factor_words
from calib.lab.instruments.lexicon import (
    BOUNDS,
    COMMANDED,
    COMMANDED_BEGINNINGS,
    COMMANDED_ENDINGS,
    NOT_NOW,
    OTHER_ONE,
    REMARKS,
    RUNS,
    STATISTIC,
    WITH_REST,
    WITHOUT_BLANKS,
)
from calib.lab.instruments.meanings import meanings, plain_meanings
from calib.lab.instruments.reach import RANGE, RATED, REACH_BEHIND, REACH_WITHIN, is_reach, without_tolerance
from calib.lab.instruments.units import RECORDED, from_capitals, is_unit_of, looks_like_unit, mended

_OPENING, _CLOSING = "([{<", ")]}>"
_COMMENT = re.compile(r"^(?:[#%;]+|//)\s*(?=\S)")
# What R makes of "Time (s)" and "Compressive load (N)" as names of variables: "Time..s.", "Compressive.load..N.".
_OF_R = re.compile(r"(?P<name>[^\W\d_][\w.]*?)\.{1,2}(?P<unit>[^\W\d_]+)\.")
# The mark of a footnote behind a unit or a name: "Force (N)*", "Force* (N)", "Force (N) 1)", "Force¹ (N)", "Force (N*)"; of a
# symbol it may be a part: "C* (pF)", and a power: "Force² (N)".
_FOOTNOTE = re.compile(
    r"(?<=[)\]])\s?(?:[*†‡§¶]{1,3}|[¹²³⁴-⁹])$|(?<=[^\W\d_]{3})(?:[*†‡§¶]{1,3}|¹)(?=\s*[(\[]|$)|"
    r"(?<=[(\[\s][^\W\d_])[*†‡§¶¹](?=[)\]])|(?<=[(\[\s][^\W\d_]{2})[*†‡§¶¹](?=[)\]])"
)
# The same behind a unit alone, in a row of units.
_AT_UNIT = re.compile(r"(?<=[^\W\d_])\s?[*†‡§¶]{1,3}$")
_MARKS = frozenset("*†‡§¶¹²³⁴⁵⁶⁷⁸⁹")
# The same as a figure or a letter before a bracket that nothing opens.
_FIGURE = re.compile(r"(?<=[^\W\d_)\]])\s?[1-9]\)(?=\s*[(\[]|$)|(?<=[)\]])\s?[1-9a-c]\)$|(?<=[^\W_])\s[1-9a-c]\)$")
# A power of what stands before brackets, which is no number of a channel: "Force² (N)".
_SQUARED = re.compile(r"(?<=[^\W\d_])[²³](?=\s*[(\[]|$)")
# A remark behind the unit: "Force [N], tared".
_REMARK_BEHIND = re.compile(r"(?P<before>[^,;]*[)\]])\s?[,;]\s*(?P<remark>[^\W\d_][^()\[\]{},;]*)")
# The same with a unit by a point alone, as people write it for R: "Time.s", "Displacement.mm".
_BY_POINT = re.compile(r"(?P<name>[^\W\d_]{3,}(?:\.[^\W_]+)*)\.(?P<unit>[^\W\d_]{1,3})")
# A channel by its number, and its label, as loggers of Keysight write them: "101 <Force> (N)".
_LABELLED = re.compile(r"(?P<channel>\d{3,4}) <(?P<label>[^<>]+)>(?P<behind>.*)")
# What was taken off, behind the unit: "Force (N) tare 0.35 N"; where the zero lies is a parameter.
_TARE = re.compile(
    r"(?P<before>.*[)\]])\s*[,;]?\s*(?P<tare>(?:tared?|tara|tariert)\s?[:=]?\s?\d+(?:[.,]\d+)?\s?[^\W\d_]{0,3})", re.IGNORECASE
)
# With which ball a column was measured, behind its name: "Displacement 6mm ball (µm)".
_BALLS = "ball|kugel|sphere|sphère|bille|sfera|bola|esfera|kogel|kula|kulka|indenter|球"
#: The size of a ball, for patterns.
BALL = (
    rf"(?:[Øø⌀]\s?)?\d+(?:[.,]\d+)?[\s_-]?mm[\s_-]?(?:{_BALLS})|"
    rf"(?:{_BALLS})[\s_-]?(?:[Øø⌀]\s?|[dr]\s?=?\s?)?\d+(?:[.,]\d+)?[\s_-]?mm"
)
_WITH_BALL = re.compile(
    rf"(?P<before>[^()\[\]]*[^\W\d_])[\s_,;-]+(?P<ball>{BALL})(?P<behind>\s*[(\[].*|_[^\W\d_]+)", re.IGNORECASE
)
# What MATLAB makes of "Force (N)" as a name of a variable: "Force_N_"; where "Load_10_N_" has a stroke a factor may have been.
_OF_MATLAB = re.compile(r"(?P<name>[^\W\d_](?:[^\W_]|_(?![\d_]))*)_(?P<unit>[^\W\d_]+)_")
# "time_in_s", "force_in_mN": as people write "force in mN" for a program.
_IN_UNIT = re.compile(r"(?P<name>[^\W\d_]\w*?)_in_(?P<unit>[^\W\d_]+)")
# A unit that is said to be one: "Kraft (in N)", "Force [unit: N]".
_SAID_IN_BRACKETS = re.compile(
    r"([(\[])\s*(?:in|units?|einheit|unité|unidad|unità|unidade|jednostka|单位|単位)(?:\s*[:=：]\s*|\s+)(?P<unit>[^()\[\]]+?)\s*([)\]])",
    re.IGNORECASE,
)
# A symbol as TeX has it: "$C_p$", "$\\delta$", "$F_{\\mathrm{N}}$"; the Greek letters that stand for a length or a unit.
_OF_TEX = re.compile(r"\$([^$]{1,40})\$")
_GREEK = {r"\delta": "delta", r"\Delta": "Δ", r"\mu": "μ", r"\rm": "", r"\mathrm": "", r"\text": ""}
# "timeMs", "timeSec", "displacementMm", "forceN": the units that end such names, in the case that joins them.
_OF_JOINED = {unit.capitalize(): unit for unit in ("s", "sec", "ms", "us", "mm", "um", "nm", "N", "kN", "pF", "nF", "fF")}
_JOINED = re.compile(rf"(?P<name>[a-z]{{3,}})(?P<unit>{'|'.join(_OF_JOINED)})")
# Since when the seconds of a clock count, behind its unit: "(s since 01.01.1904)".
_SINCE = re.compile(r"(?<=[(\[])\s*(?P<unit>[^\W\d_]{1,12})\s+since\s+[^()\[\]]+?(?=\s*[)\]])", re.IGNORECASE)
# A symbol with its index, whose letter is no unit: "C_s (pF)".
_SYMBOL_OF_CIRCUIT = re.compile(r"^(c)_([ps])(?![^\W_])", re.IGNORECASE)
# Pointed brackets are brackets where they end a name: "Load<N>".
_POINTED = re.compile(r"^([^<>]+)<([^<>]{1,12})>$")
# "in 10 mN", "en 10 N", "in 10^-2 N": a number before the unit behind a name is a factor.
_BEFORE_UNIT = re.compile(r"\b(?:in|en|em|w|i)\s+(\d+(?:[.,/]\d+)?(?:(?:\^|\*\*|e)?[+-]?\d+)?)\s*[^\W\d]+$", re.IGNORECASE)
# "100ths", "1/100ths", "hundredths of", "Zehntel", "centésimas de", "hundreds of": into how many parts a unit is cut, in words.
_PARTS_OF_UNIT = re.compile(
    r"(?<![\w.,])(?:1\s?/\s?)?(?:10{1,6}(?:ths|e?[mn]?t?els?|[eè]mes?|(?=s\b)s)|(?:ten|hundred|thousand|million)ths?|"
    r"(?:zehn|zehntausend|hundert|hunderts|tausend|tausends|millions)tel|(?:dix|cent|mill|million)i[eè]mes?|"
    r"(?:d[eé]cim|cent[eé]sim|mil[eé]sim|d[eé]cimos|millesim)(?:as?|os?|[oi])?|tienden?|honderdsten?|duizendsten?|"
    r"dziesiąt\w+|setn\w+|tysięczn\w+|(?:tens|hundreds|thousands|dozens|zehner|hunderter|tausender|dizaines|centaines|milliers|"
    r"decenas|centenas|miles|decine|centinaia|migliaia))(?![\w.,]\w)(?!\w)",
    re.IGNORECASE,
)
# x10, 1e-1, *10^3, ×1000, :10: what the numbers of a column are to be multiplied by, or were.
_FACTOR = re.compile(
    r"(?:[x×*·/÷:@]\s*(?:10\s*(?:\^|\*\*)?\s*[+-]?\d*|\d+(?:[.,]\d+)?(?:e[+-]?\d+)?)|10\s*(?:\^|\*\*)\s*[+-]?\d+|10-\d+|"
    r"\d+(?:[.,]\d+)?e[+-]?\d+|e[+-]\d+|0[.,]\d+)",
    re.IGNORECASE,
)
# The ratio of an amplifier, a divider or a lever: "1:10", "Übersetzung 1:5", "lever 2:1".
_RATIO = re.compile(r"(?<![\w.:/])(?!(\d+)\s?:\s?\1(?!\d))[1-9]\d*\s?:\s?[1-9]\d*(?![\w.:/])")
# The same before a name; "2 Load" is a channel, "10 N cell" a cell of that reach.
_LEADING = re.compile(
    r"\s*(?:(?:x ?10+|[*×·/:@÷]\s*\d[\d.,e^+-]*)(?=[\s_])|(?!1\s*[x×*·])\d+(?:[.,]\d+)?(?:e[+-]?\d+|\s?(?:\^|\*\*)\s?[+-]?\d+)?"
    r"(?:\s?[×*·]\s?|\s?x\s|\s(?:times|mal|fois)\s)(?=[^\W\d])|(?P<power>10{1,8}|0[.,]0*1|10\^-?\d+|1?e[+-]?\d+)\s+(?=(?P<word>[^\W\d_]+)))",
    re.IGNORECASE,
)
# Where a channel is wired: "Linear:Digital Position", "8800 (0,1):Load", "Dev1/ai0", "AI0".
_WIRING = re.compile(r"[^:]*:[^:]+|\d{4}\s*\(\d+,\s*\d+\)|(?:dev\d+/)?a[io]\d+|0x[0-9a-f]+", re.IGNORECASE)
# The range of an instrument or the frequency of a meter: "500 N", "0-5 N", "1 kHz", "load cell 10 N", "LVDT ±5 mm".
_RANGE = re.compile(
    r"(?:(?i:load ?cell|cell|lvdt|kraftmessdose|transducer|loadcell),? (?:up to |bis )?)?(?:at |@ ?)?"
    r"(?:±|0\s?(?:-|–|to|bis|\.{2,3})\s?)?\d+(?:[.,]\d+)?\s?(?:[mkµu]?N|kg|lbf?|[kM]?Hz|mm|V|mV)"
    r"(?: load cell| cell| range| (?:Kraftm|M)ess(?:dose|bereich)| Dose)?"
)
# The same without its unit, "FS=10", "range 10", or without a number: "high range", "auto-range".
_IN_WORDS = rf"(?:high|low|wide|narrow|auto(?:matic)?|full|hoher|niedriger|großer|kleiner)[ -]?(?:{RANGE})"
_REACH_ALONE = re.compile(rf"(?:{RATED}|{RANGE})[ :=]{{1,2}}(?:±\s?)?\d+(?:[.,]\d+)?|{_IN_WORDS}", re.IGNORECASE)
_REACH_IN_WORDS = re.compile(rf"(?<![^\W_]){_IN_WORDS}(?![^\W_])", re.IGNORECASE)
# At which frequency, voltage and range a meter measured: "@ 100 kHz, 1 V", "[1 kHz; 1 V]", "-1kHz", "(f=1 kHz)", "bei 1 kHz".
_ONE = (
    r"(?:(?:f|freq|frequency|osc|level|u|v|vac)\.?\s?=\s?)?\d+(?:[.,]\d+)?\s?"
    r"(?:[kM]?Hz|m?V(?:\s?(?:rms|eff|pp|p-p|ac|dc))?)(?![^\W_])|"
    rf"(?:auto-?\s?)?(?:{RANGE})[\s:=]{{1,2}}\d+(?:[.,]\d+)?\s?[pnuµμm]?F(?![^\W_])|"
    rf"\d+(?:[.,]\d+)?\s?[pnuµμm]?F[\s_-](?:{RANGE})(?![^\W_])"
)
_ALL_ONE = re.compile(_ONE, re.IGNORECASE)
_OF = r"(?:@|at\s|bei\s|mit\s|à\s|a\s|à une fréquence de\s|con\s|przy\s|bij\s|vid\s|ved\s|em\s|при\s)"
_MANY = rf"(?:{_OF}\s?)?(?:{_ONE})(?:\s?(?:[,;/@&_\s]|\s(?:and|und|et|y|e|i|en|och|og|и)\s)\s?{_OF}?(?:{_ONE}))*"
_CONDITIONS = re.compile(
    rf"(?:[\s,;_-]*[(\[]\s?(?P<inside>{_MANY})\s?[)\]]|(?:[\s,;_-]+|(?=@))(?P<bare>{_MANY}))", re.IGNORECASE
)
# "filtered 10 Hz", "10 Hz low pass": the frequency is none that the readings are of; "moving average 5", "median of 5": no
# statistic of many readings that stand elsewhere.
_WINDOW = (
    r"(?:[\s,:=-]*(?:of|over|aus|von|über|de|sur|di|su|n\s?=)?\s?\d{1,4}(?![\w.,]*\d)"
    r"(?:\s?(?:-?points?|pts?|samples?|readings|values|punkte|messwerten?|werten?)(?![^\W_]))?)?"
)
_FILTERED = re.compile(
    r"\b(?:filter(?:ed)?|low-?pass(?:ed)?|gefiltert)[\s,:@]*(?:at\s)?\d+(?:[.,]\d+)?\s*k?Hz\b|"
    r"(?<![^\W_])lp[\s_]?\d+(?:[.,]\d+)?\s?k?Hz(?![^\W_])|"
    r"(?<![\w.,])\d+(?:[.,]\d+)?\s*k?Hz[\s-](?:low[\s-]?pass|tiefpass|filter)(?:ed|[\s-]?filter)?(?![^\W_])|"
    r"(?<![^\W_])(?:(?:moving|running|rolling|sliding|boxcar|gleitende[rsmn]?|rollende[rsmn]?)[\s-]"
    r"(?:median|average|avg\.?|mean|mittelwert|mittel)|"
    r"(?:moyenne|médiane|mediana|media|média|promedio) (?:glissante|mobile|m[óo]vil|móvel)|"
    r"(?:filtre|filtro) (?:m[ée]dian[oa]?|de (?:la )?mediana|passe[\s-]bas|de paso bajo|passa[\s-]?basso)|"
    r"(?:median|(?:savitzky|sav)[\s-]?gol(?:ay)?|butterworth|kalman|bessel|gauss(?:ian)?|boxcar|low[\s-]?pass|tiefpass)[\s-]?"
    rf"(?:filter(?:ed|ung)?|gefiltert)|savitzky[\s-]?golay|butterworth)(?![^\W_]){_WINDOW}|"
    r"(?:(?<=[(\[,;)\]])|(?<=[(\[,;)\]]\s)|(?<![^\W_])(?=medi\w+ (?:of|aus|over|über|de|di) \d))m[ée]dian[eao]?"
    r"(?:\s(?:of|aus|over|über|de|di|von)|\s?n\s?=)?\s?\d{1,3}(?:\s?(?:-?points?|pts?|samples?|readings|values|punkten?|(?:mess)?werten?))?"
    r"(?=\s*(?:[()\[\],;]|$))",
    re.IGNORECASE,
)
# Since when a clock counts, behind the unit of a time or before it; since the last of many readings it is a step.
_SINCE_OR_FROM = r"(?:since|from|seit|ab|depuis|à partir d[eu']|desde|dal(?:l[a'])?|sinds|od|från)"
_SINCE_WORD = re.compile(rf"(?<![^\W_])(?:{_SINCE_OR_FROM}|after|nach|après|después|dopo)(?![^\W_])", re.IGNORECASE)
_SINCE_BEHIND = re.compile(
    r"(?P<before>[^()\[\]]*[^\W\d_][^()\[\]]*[(\[]\s*(?P<unit>[^\W\d_]{1,12})\s*[)\]])\s*,?\s*"
    rf"(?:{_SINCE_OR_FROM}|after|nach|après|después de|dopo)\s?(?P<what>[^()\[\]]+)",
    re.IGNORECASE,
)
_SINCE_WITHIN = re.compile(
    rf"(?P<name>[^()\[\]]*?[^\W\d_])[\s,]+{_SINCE_OR_FROM}\s(?P<what>[^()\[\]]+?)"
    r"(?P<behind>\s*[(\[]\s*(?P<unit>[^\W\d_]{1,12})\s*[)\]])",
    re.IGNORECASE,
)
# Under what and with what a column was measured, which changes nothing of it: "at 23 °C", "1 mm/min", "res. 0.1 µm",
# "class 0.5", "S/N 20331", "±0.5 %", "cal. 2025-03".
_NUMBER = r"[-+]?\d+(?:[.,]\d+)?"
_AT = r"(?:at|@|bei|à)"
_DAY = r"(?:(?:19|20)\d\d(?:[-/.]\d{1,2}){0,2}|\d{1,2}[-/.](?:\d{1,2}[-/.])?(?:19|20)\d\d)"
_OF_MEASURING = (
    rf"(?:(?:{_AT}|v\s?=|(?:test )?speed:?|rate:?)\s*)?{_NUMBER}\s?(?:[mµμun]m|in)\s?/\s?(?:s|sec|min|h)|"
    rf"(?:(?:{_AT}|T\s?=)\s*)?{_NUMBER}\s?(?:(?:°|deg)\s?[CF]|℃)|(?:{_AT}\s*)?{_NUMBER}\s?%\s?(?:RH|r\.?\s?[FH]\.?)|"
    rf"(?:res(?:olution)?|auflösung|résolution)[\s.:=]*{_NUMBER}\s?[^\W\d_]{{1,3}}|"
    rf"(?:[2345]|two|three|four|five|zwei|drei|vier)[ -]?(?:wires?|leads?|terminals?|leiter|draht)"
    r"(?:[ -]?(?:messung|connection|method))?|4TP|"
    rf"(?:accuracy )?(?:class|klasse|classe)[\s:]*{_NUMBER}|"
    r"(?:s/?n|ser(?:ial|ien)?[. ]?-?(?:no|nr|num(?:ber|mer)?)?)[.:# ]{0,3}(?=[\w-]*\d{3})[\w-]+|"
    rf"(?:±|\+/-)\s?{_NUMBER}\s?(?:%|[^\W\d_]{{1,3}})?(?: (?:of reading|rdg|FS))?|"
    rf"(?:cal(?:ibrat(?:ed|ion))?|kal(?:ibriert|ibrierung)?)[\s.:]*(?:(?:on|am|vom|due|until|bis)\s)?{_DAY}"
)
_CONDITION = re.compile(_OF_MEASURING, re.IGNORECASE)
# The same behind the brackets of a name, and before them.
_CONDITION_BEHIND = re.compile(
    rf"(?P<before>.*[)\]])\s*[,;]?\s*(?P<condition>{_OF_MEASURING})",
    re.IGNORECASE,
)
# With which cell a force was measured: "Force measured by the 10 N load cell (N)"; and in which circuit a capacitance.
_BY_CELL = re.compile(
    r"(?P<before>[^()\[\]]*?[^\W\d_])\s+(?:(?:as\s)?(?:measured|recorded|gemessen|mesurée?|misurat[oa]|medid[oa])\s+)?"
    r"(?:by|with|from|via|using|mit|von|über|par|avec|con|da|dalla)\s+(?:(?:the|an?|der|dem|einer|l[ea]|une?|una)\s+)?"
    r"(?:\d+(?:[.,]\d+)?\s?(?:[mk]?N|kg)\s+)?(?:load ?cell|cell|(?:kraft)?messdose|kraftaufnehmer|kraftsensor|force sensor|"
    r"capteur(?: de force)?|cellule(?: de charge)?|cell?ula de carga|celda de carga|cella di carico)"
    r"(?:\s+\d+(?:[.,]\d+)?\s?(?:[mk]?N|kg))?(?P<behind>\s*[(\[].*)",
    re.IGNORECASE,
)
_CIRCUIT_BEHIND = re.compile(
    r"(?<=[^\W\d_]),\s*(parallel|series|serie|seriell|reihe|parall[eè]le|série|paralelo)(?![^\W_])", re.IGNORECASE
)
_CONDITION_WITHIN = re.compile(
    rf"(?P<before>[^()\[\]]*[^\W\d_])\s*[,;]?\s*(?={_AT}\s*\d)(?P<condition>{_OF_MEASURING})(?P<behind>\s*[(\[].*)",
    re.IGNORECASE,
)
# Words with a bracket of their own behind a name and its unit: "Force (N) at 23 (°C)", "Force (N) on sensor (2)".
_WORDS_BEHIND = re.compile(
    r"(?P<first>[^()\[\]]*[^\W\d_][^()\[\]]*[(\[]\s*(?P<unit>[^()\[\]]+?)\s*[)\]])\s+(?P<words>[^()\[\]/|,;]*[^\W\d_][^()\[\]/|,;]*?)\s*"
    r"[(\[](?P<inside>[^()\[\]]+)[)\]]"
)
# "N, tared", "mm; crosshead".
_UNIT_AND_REMARK = re.compile(r"(?P<unit>[^\s,;]+)\s*[,;]\s*(?P<remark>\S[^,;]*)")
# Minutes with seconds behind a comma, which is the decimal mark elsewhere: "(min,s)".
_MINUTES_AND_SECONDS = re.compile(r"(?:m|mm|min),\s?(?:s|ss|sec)", re.IGNORECASE)
# "compression negative", "tension: +".
_SENSE = re.compile(
    r"\b(?:(?P<push>compress\w*|push\w*|druck)|(?P<pull>tension|tensile|pull\w*|zug))\s*"
    r"(?:(?:is\s+|[:=]\s*)?(?P<word>positive?\b|negative?\b|pos\b|neg\b|plus\b|minus\b|[+-]ve\b)|[:=]\s*(?P<mark>[+-])\s*(?:$|[)\],;]))",
    re.IGNORECASE,
)
# A word behind these is no unit: "Seconds of the hour", "seconds_of_hour".
_NO_UNIT = re.compile(
    r"(?<![^\W_])(?:of|per|by|from|since|after|der|des|pro|seit|del|della|dell|de|du|da|do|dans|par|por|le|la|l|el|il|the|a)"
    r"[\s_'’]+[^\W\d_]{3,}$",
    re.IGNORECASE,
)
# The unit before the whole that a time is of, or before what it is since.
_OF_A_WHOLE = re.compile(
    r"(?P<unit>[^\W\d_]+)[\s_]+(?:of|since|after|from|der|des|seit|del|della|dell|de|du|depuis|desde|dal|da|do)[\s_'’]",
    re.IGNORECASE,
)
# What is left of a way or a time, in more than one word.
_LEFT = re.compile(
    r"(?<![^\W_])(?:to go|dtg|to (?:the )?(?:target|goal|setpoint|end|limit)|(?:distance|time|way) left)(?![^\W_])"
)
# Where words are joined by their capitals: "TargetForce".
_CAMEL = re.compile(r"(?<=[a-z]{2})(?=[A-Z][a-z]{2})")
# From the least to the largest of several readings.
_PEAK_TO_PEAK = re.compile(
    r"(?<![^\W_])(?:p-p|p2p|pk-pk|pk2pk|peak[ -]to[ -]peak|spitze-spitze|crête à crête)(?![^\W_])", re.IGNORECASE
)
# Letters of a symbol, which is written in capitals in any header.
_SYMBOL = 2
# Units in capitals that a symbol and any name of a capacitance may have, too: none is in petafarads.
_OF_SYMBOLS = ("PF", "NF", "UF")
# A name, and the unit that ends it: "CAP (PF)", "CAP_PF", "CAP, PF".
_LAST_WORD = re.compile(r"(?P<name>.*[\s_,/(\[{<])(?P<unit>[^\W\d_]+)(?P<behind>[)\]}>]?)")
# A unit of force in small letters behind a name in small letters, as databases write all names: "force_n", "load_kn".
_SMALL = re.compile(r"(?P<name>[a-z][a-z\d]*(?:[_.][a-z\d]+)*)_(?P<unit>n|kn)")
# What the interface of a robot calls the places and forces of its tool along x, y and z: "actual_TCP_force_2".
_OF_TOOL = re.compile(r"actual_TCP_(?P<what>pose|force)_(?P<axis>[012])", re.IGNORECASE)
# A power of ten times a unit behind a stroke, by which what stands before it is divided: "F / 10^-3 N".
_OVER_POWER = re.compile(
    r"(?P<name>[^/]+?)\s*/\s*(?P<unit>(?:10(?:\^|\*\*) ?-?\d{1,2}|10-\d{1,2}|1?[eE]-\d{1,2}) ?[·*]? ?(?P<of>[^\W\d_]+))"
)
_INDEX = re.compile(
    r"(?:(?:ch|chan|channel|kanal|sensor|cell|load cell|no|nr|#)[ ._#]*)?(?P<index>\d{1,3}|[a-f])", re.IGNORECASE
)
# What a converter, an encoder or a motor counts, and words that stand beside it: "raw ADC counts", "encoder ticks".
_COUNTED = re.compile(
    r"(?:counts?|cts?|cnts?|raw|bits?|digits?|ticks?|(?:micro-?)?steps?|puls(?:es?)?|impulses?|increments?|incr|adc|adu|lsb|codes?|"
    r"inkremente?|schritte|rohwerte?|rohdaten|brut|crudo|grezzo|pasos?|passi)"
)
_BESIDE_COUNTED = re.compile(r"encoder|motor|stepper|sensor|values?|units?|readings?|data|a/d|\d{1,2}")
#: Letters of a name that may be understood.
LONGEST = 120
# "C" and "F" are units too, as are "A" and "V".
_LETTER = re.compile(r"[A-H]")


@lru_cache(maxsize=8192)
def tidy(cell: str) -> str:
    """A header cell without the mark of a comment before it and with the usual characters for those that look the same.

    >>> tidy("# Load<N>"), tidy("Compressive.load..N."), tidy("Max..N..s."), tidy("CAP_PF")
    ('Load(N)', 'Compressive load (N)', 'Max..N..s.', 'CAP_pF')
    >>> tidy("RawForce_N_"), tidy("Stiffness_N_mm_"), tidy("Depth__m_"), tidy("Load_10_N_")
    ('Raw Force (N)', 'Stiffness_N_mm_', 'Depth__m_', 'Load_10_N_')
    >>> tidy("Displacement.mm"), tidy("101 <Force> (N)"), tidy("Load.A")
    ('Displacement (mm)', 'Force 101 (N)', 'Load.A')
    >>> tidy("time_in_s"), tidy("forceN"), tidy("capacitancePf"), tidy(r"$C_p$ (pF)"), tidy("Time (s since 1.1.1904)")
    ('time (s)', 'force (N)', 'capacitance (pF)', 'Cp (pF)', 'Time (s)')
    >>> tidy("Kraft (in N)"), tidy("Force [unit: mN]"), tidy("Weg (in Mikrometer)"), tidy("Weg (in)")
    ('Kraft (N)', 'Force [mN]', 'Weg (Mikrometer)', 'Weg (in)')
    >>> tidy("Displacement (mm ±0.002)"), tidy("Force (N) ± 0.01"), tidy("Force ±0.5% (N)"), tidy("Weg 6mm Kugel (µm)")
    ('Displacement (mm)', 'Force (N)', 'Force (N)', 'Weg (μm) (6mm Kugel)')
    """
    if len(cell) > LONGEST:
        return cell
    cell = mended(cell).strip()
    cell = _SQUARED.sub(lambda m: f"^{unicodedata.normalize('NFKC', m[0])}", "".join(_around_footnote(cell)))
    cell = unicodedata.normalize("NFKC", cell.replace("\u02da", "°")).replace("\u2212", "-").strip()
    cell = without_tolerance(usual_case(cell))
    cell = _with_one_remark(cell)
    cell = _SINCE.sub(lambda m: m["unit"] if is_unit_of(m["unit"], "time") else m[0], _OF_TEX.sub(_plain_symbol, cell))
    cell = _SAID_IN_BRACKETS.sub(lambda m: f"{m[1]}{m['unit']}{m[3]}" if looks_like_unit(m["unit"]) else m[0], cell)
    cell = _without_beginning(cell)
    of_tool = _OF_TOOL.fullmatch(cell)
    if of_tool is not None:
        return f"{'Force' if of_tool['what'].lower() == 'force' else 'Position'} {'xyz'[int(of_tool['axis'])]}"
    in_unit = _IN_UNIT.fullmatch(cell)
    if in_unit is not None and looks_like_unit(in_unit["unit"]):
        return f"{in_unit['name']} ({in_unit['unit']})"
    if joined := unit_of_joined(cell):
        return f"{cell[: -len(joined)]} ({joined})"
    for form in (REACH_BEHIND, _CONDITION_BEHIND, REACH_WITHIN, _CONDITION_WITHIN):
        if (measured := form.fullmatch(cell)) is not None:
            behind = measured.groupdict().get("behind") or ""
            return tidy(f"{measured['before']}{behind} ({measured['condition']})")
    of_tare = _TARE.fullmatch(cell)
    if of_tare is not None:
        return tidy(f"{of_tare['before']} ({of_tare['tare']})")
    by_cell = _BY_CELL.fullmatch(cell)
    if by_cell is not None:
        return tidy(f"{by_cell['before']}{by_cell['behind']} (load cell)")
    if (circuit := _CIRCUIT_BEHIND.search(cell)) is not None:
        return tidy(f"{cell[: circuit.start()]} ({circuit[1]}){cell[circuit.end() :]}")
    with_ball = _WITH_BALL.fullmatch(cell)
    if with_ball is not None:
        return tidy(f"{with_ball['before']}{with_ball['behind']} ({with_ball['ball'].replace('_', ' ')})")
    if small := unit_of_small_letters(cell):
        return f"{cell[: -len(small)]}{small}"
    of_power = _OVER_POWER.fullmatch(cell)
    if of_power is not None and looks_like_unit(of_power["of"]):
        return f"{of_power['name']} ({of_power['unit']})"
    of_r = _OF_R.fullmatch(cell)
    if of_r is not None and ".." not in of_r["name"] and looks_like_unit(of_r["unit"]):
        return f"{of_r['name'].replace('.', ' ')} ({of_r['unit']})"
    by_point = _BY_POINT.fullmatch(cell)
    if by_point is not None and looks_like_unit(by_point["unit"]) and not is_letter(by_point["unit"]):
        return f"{by_point['name'].replace('.', ' ')} ({by_point['unit']})"
    labelled = _LABELLED.fullmatch(cell)
    if labelled is not None:
        return f"{labelled['label']} {labelled['channel']}{labelled['behind']}"
    of_matlab = _OF_MATLAB.fullmatch(cell)
    if of_matlab is not None and looks_like_unit(of_matlab["unit"]):
        *before, last = of_matlab["name"].split("_")
        if not (before and looks_like_unit(last)):
            return f"{re.sub(r'(?<=[a-z])(?=[A-Z])', ' ', of_matlab['name'])} ({of_matlab['unit']})"
    cell = _FILTERED.sub("filtered", cell)
    cell = _REMARK_BEHIND.sub(r"\g<before> (\g<remark>)", cell) if _REMARK_BEHIND.fullmatch(cell) else cell
    cell = _SYMBOL_OF_CIRCUIT.sub(r"\1\2", cell)
    return _COMMENT.sub("", _POINTED.sub(r"\1(\2)", cell))


def footnote_of(cell: str, *, of_unit: bool = False) -> str:
    """The mark of a footnote that a header cell bears: "*", a figure or a letter; "" if it bears none.

    Parameters
    ----------
    cell : as written.
    of_unit : whether it is of a row of units, where a letter before the mark is no symbol, as "C*" may be one.

    >>> [footnote_of(cell) for cell in ("Force (N)*", "Force (N) 1)", "Force¹ (N)", "Force² (N)", "C*", "Force (N) (1)")]
    ['*', '1', '1', '', '', '']
    >>> footnote_of("N *", of_unit=True), footnote_of("N 1)", of_unit=True)
    ('*', '1')
    """
    if len(cell) > LONGEST:
        return ""
    cell = cell.strip()
    before, behind = _around_footnote(cell)
    if of_unit and before == cell and (match := _AT_UNIT.search(cell)) is not None:
        before = cell[: match.start()]
    return unicodedata.normalize("NFKC", cell[len(before) : len(cell) - len(behind)]).strip(" )")


def _around_footnote(cell: str) -> tuple[str, str]:
    """What stands before the mark of a footnote in a cell, and behind it; the whole and "" where it has none."""
    form = _FIGURE if cell.count(")") > cell.count("(") else _FOOTNOTE
    match = form.search(cell) if form is _FIGURE or not _MARKS.isdisjoint(cell) else None
    return (cell, "") if match is None else (cell[: match.start()], cell[match.end() :])


def _without_beginning(cell: str) -> str:
    """A name with a unit of time without the words behind it that say since when the time counts: "since start of hold"."""
    for form in (_SINCE_BEHIND, _SINCE_WITHIN) if _SINCE_WORD.search(cell) else ():
        match = form.fullmatch(cell)
        if match is not None and is_unit_of(match["unit"], "time") and not any(w in OTHER_ONE for w in words_in(match["what"])):
            return match["before"] if form is _SINCE_BEHIND else f"{match['name']}{match['behind']}"
    return cell


def _with_one_remark(cell: str) -> str:
    """A name with its unit, and words that have a bracket of their own behind it as one remark; a second unit stays one."""
    two = cell.endswith((")", "]")) and cell.count("(") + cell.count("[") > 1
    match = _WORDS_BEHIND.fullmatch(cell) if two else None
    of = [q for q in RECORDED if is_unit_of(match["unit"], q)] if match is not None else []
    if match is None or not of or any(is_unit_of(match["inside"], q) for q in of) or is_factor(match["inside"]):
        return cell
    return f"{match['first']} [{match['words']} {match['inside']}]"


def _plain_symbol(match: re.Match[str]) -> str:
    """A symbol of TeX in plain letters."""
    plain = re.sub(r"\\[A-Za-z]+", lambda m: _GREEK.get(m[0], m[0]), match[1])
    return re.sub(r"[{}\s]", "", plain)


def unit_of_joined(cell: str) -> str:
    """The unit that a capital joins to a name in small letters, as it is usually written; "" if none of its quantity does.

    >>> unit_of_joined("timeMs"), unit_of_joined("forceN"), unit_of_joined("sampleN"), unit_of_joined("forceMn")
    ('ms', 'N', '', '')
    """
    match = _JOINED.fullmatch(cell)
    unit = _OF_JOINED[match["unit"]] if match is not None else ""
    return unit if match is not None and any(is_unit_of(unit, m.quantity) for m in meanings(match["name"], (), "")) else ""


def usual_case(cell: str, below: str | None = None) -> str:
    """A header cell, or the unit below it, with a unit in capitals as it is usually written, where it can be no other.

    Parameters
    ----------
    cell : of the header.
    below : the unit below it; None if the cell's own unit is meant.

    >>> usual_case("CAP (PF)"), usual_case("CAP", "PF"), usual_case("Cap (PF)"), usual_case("Fz (PF)"), usual_case("FORCE (MN)")
    ('CAP (pF)', 'pF', 'Cap (pF)', 'Fz (PF)', 'FORCE (MN)')
    """
    if below is not None:
        return _usual_of(cell, below) or (_metres(cell, below) if _all_capitals(cell) else "") or below
    match, usual = _LAST_WORD.fullmatch(cell), unit_of_capitals(cell)
    return f"{match['name']}{usual}{match['behind']}" if match is not None and usual else cell


def unit_of_capitals(cell: str) -> str:
    """The unit in capitals that a header cell ends with, as it is usually written; "" if it has none that is written otherwise.

    >>> unit_of_capitals("CAP_PF"), unit_of_capitals("DISP_MM"), unit_of_capitals("Cap_PF"), unit_of_capitals("Cap_MF")
    ('pF', '', 'pF', '')
    """
    match = _LAST_WORD.fullmatch(cell)
    if match is None:
        return ""
    metres = match["behind"] and _all_capitals(match["name"])
    return _usual_of(match["name"], match["unit"]) or (_metres(match["name"], match["unit"]) if metres else "")


def _usual_of(name: str, unit: str) -> str:
    """The unit of a name in capitals as it is usually written; of a symbol, "CP", or a capacitance only a part of a farad."""
    of_farad = unit in _OF_SYMBOLS and (name.isupper() or _names(name, "capacitance"))
    return from_capitals(unit) if of_farad or _all_capitals(name) else ""


def _metres(name: str, unit: str) -> str:
    """The unit that "M" is for the name of a displacement in capitals, "" of any other: it is short for no other length."""
    return "m" if unit == "M" and _names(name, "displacement") else ""


def _names(name: str, quantity: str) -> bool:
    """Whether the words before a unit may name a quantity: "Cap (", "C in "."""
    plain = re.sub(r"[\W_]+", " ", name).strip().lower().removesuffix(" in")
    return any(m.quantity.startswith(quantity) for m in meanings(plain, (), ""))


def unit_of_small_letters(cell: str) -> str:
    """The unit of force that a name of a force in small letters ends with, as it is usually written; "" of any other.

    >>> unit_of_small_letters("force_n"), unit_of_small_letters("axial_load_kn"), unit_of_small_letters("Force_n")
    ('N', 'kN', '')
    >>> unit_of_small_letters("f_n"), unit_of_small_letters("disp_n"), unit_of_small_letters("force_mn")
    ('', '', '')
    """
    match = _SMALL.fullmatch(cell)
    if match is None:
        return ""
    found = [*meanings(match["name"].replace("_", " "), (), "")]
    named = len(match["name"]) > 1 and bool(found) and all(m.quantity == "force" for m in found)
    return f"{match['unit'][:-1]}N" if named else ""


def _all_capitals(name: str) -> bool:
    """Whether a name is written in capitals: "CAP", not a symbol such as "CP", which always is."""
    letters = [c for c in name if c.isalpha()]
    return len(letters) > _SYMBOL and name == name.upper() and name != name.lower()


def without_brackets(cell: str) -> tuple[str, tuple[str, ...]] | None:
    """The words of a cell outside of its brackets, and what stands in each of them; None if brackets do not match.

    >>> without_brackets("Load(8800 (0,1):Load) (kN)"), without_brackets("Position (z), mm")
    (('Load', ('8800 (0,1):Load', 'kN')), ('Position , mm', ('z',)))
    """
    outside: list[str] = []
    inside: list[str] = []
    found: list[str] = []
    depth = 0
    for character in cell:
        if character in _OPENING and not (character == "<" and depth == 0):
            depth += 1
            if depth == 1:
                inside = []
                continue
        elif character in _CLOSING and not (character == ">" and depth == 0):
            depth -= 1
            if depth < 0:
                return None
            if depth == 0:
                found.append("".join(inside).strip())
                outside.append(" ")
                continue
        (inside if depth else outside).append(character)
    if depth:
        return None
    return re.sub(r"\s+", " ", "".join(outside)).strip(), tuple(found)


def parted(bracket: str) -> tuple[str, ...]:
    """A unit and the remark that stands behind it in one bracket as two; the bracket alone where it is not such a pair.

    >>> parted("N, tared"), parted("N; compression negative"), parted("8800 (0,1)"), parted("N, kN")
    (('N', 'tared'), ('N', 'compression negative'), ('8800 (0,1)',), ('N', 'kN'))
    """
    match = _UNIT_AND_REMARK.fullmatch(bracket) if not _MINUTES_AND_SECONDS.fullmatch(bracket) else None
    return (match["unit"], match["remark"]) if match is not None and looks_like_unit(match["unit"]) else (bracket,)


def says_sense(text: str) -> int:
    """Which sign of a reading words say that compression has: 1, -1, or 0 where they say nothing of it.

    >>> says_sense("compression negative"), says_sense("N, tension = +"), says_sense("push +ve"), says_sense("pull: -")
    (-1, -1, 1, 1)
    >>> says_sense("Compression - Load"), says_sense("compression-load"), says_sense("compression +/- 5"), says_sense("Zug -")
    (0, 0, 0, 0)
    """
    match = _SENSE.search(text)
    if match is None:
        return 0
    negative = (match["word"] or match["mark"]).lower().startswith(("neg", "minus", "-"))
    return -1 if (match["push"] is not None) == negative else 1


def is_factor(text: str) -> bool:
    """Whether a bracket is a factor, or states a ratio: x10, 1e-1, *10^3, 1:10.

    >>> is_factor("x10"), is_factor("1e-1"), is_factor("10^-3"), is_factor("N")
    (True, True, True, False)
    >>> is_factor("1:10"), is_factor("lever 2 : 1"), is_factor("1:1"), is_factor("Dev1:2"), is_factor("Linear:Digital Position")
    (True, True, False, False, False)
    """
    if is_reach(text.strip()):
        return False
    return _FACTOR.fullmatch(text.strip()) is not None or _RATIO.search(text) is not None or bool(factor_words(text))


def factor_in(text: str) -> str:
    """The factor among the words of a name, "" if there is none.

    >>> factor_in("Load *1E-3"), factor_in("Load/10"), factor_in("Kraft in 10 mN"), factor_in("Load cell 2")
    ('*1E-3', '/10', '10', '')
    >>> factor_in("x10 Load"), factor_in("x1 Load"), factor_in("F in 10^-2 N"), factor_in("F ÷ 10"), factor_in("1000 F")
    ('x10', '', '10^-2', '÷ 10', '1000')
    >>> factor_in("force_x1000"), factor_in("force_div10"), factor_in("Force gain 10"), factor_in("force_x1")
    ('x1000', 'div10', 'gain 10', '')
    >>> factor_in("dev3456/imps/0/sample.param1"), factor_in("F/10")
    ('', '/10')
    >>> factor_in("Load 100ths N"), factor_in("Kraft Hundertstel N"), factor_in("Force dixièmes de N"), factor_in("10th run")
    ('100ths', 'Hundertstel', 'dixièmes', '')
    """
    if leading := leading_factor(text):
        return leading
    text = text.replace("_", " ")
    if parts := _PARTS_OF_UNIT.search(text):
        return parts[0]
    if before := _BEFORE_UNIT.search(text):
        return before[1] if before[1] != "1" else ""
    match = re.search(
        rf"(?:(?<=[\s\w])(?=[*×·/÷])|(?<=\s)(?=[^\W\d]|@)){_FACTOR.pattern}(?!\w|[.,]\d|/\w|\s?(?:[kM]?Hz|m?V)\b)",
        text,
        re.IGNORECASE,
    )
    return match[0] if match and match[0].lower() not in ("x1", "×1") else factor_words(text)


def leading_factor(text: str) -> str:
    """The factor before a name, "" if there is none; "x1" is a channel.

    >>> leading_factor("x10 Load"), leading_factor("/10 Load"), leading_factor("x1 Load")
    ('x10', '/10', '')
    >>> leading_factor("10*d (mm)"), leading_factor("1000 F"), leading_factor("10 N cell (mN)"), leading_factor("2 Load")
    ('10*', '1000', '', '')
    """
    match = _LEADING.match(text)
    if match is None or (match["power"] and looks_like_unit(match["word"]) and not is_letter(match["word"])):
        return ""
    return match[0].strip()


def without_conditions(cell: str) -> tuple[str, str]:
    """A header cell without the frequency and voltage at which a meter measured, and these, "" if they do not stand in it.

    >>> without_conditions("Cp @ 100 kHz, 1 V (pF)"), without_conditions("Cp(1 kHz/1 V) (pF)"), without_conditions("Bias (1V)")
    (('Cp (pF)', '100 kHz, 1 V'), ('Cp (pF)', '1 kHz/1 V'), ('Bias', '1V'))
    >>> without_conditions("Cp (pF)"), without_conditions("5 V (pF)")
    (('Cp (pF)', ''), ('5 V (pF)', ''))
    """
    match = _CONDITIONS.search(cell) if len(cell) <= LONGEST else None
    if match is None or not cell[: match.start()].strip():
        return cell, ""
    rest = f"{cell[: match.start()]} {cell[match.end() :]}"
    return " ".join(rest.split()), (match["inside"] or match["bare"]).removeprefix("@").strip()


def goes_on_with_conditions(cell: str, behind: str) -> bool:
    """Whether a header cell with settings of a meter goes on with others in the next, cut from it by a comma.

    Parameters
    ----------
    cell, behind : of a header, one beside the other.

    >>> goes_on_with_conditions("Cp (pF) @ 1 kHz", "1 V"), goes_on_with_conditions("Cp (pF)", "1 V")
    (True, False)
    """
    return _ALL_ONE.fullmatch(behind.strip()) is not None and bool(without_conditions(cell)[1])


def is_wiring(text: str) -> bool:
    """Whether a bracket says where a channel is wired, how far an instrument reaches, or under what and with what was measured.

    >>> is_wiring("Dev1/ai0"), is_wiring("range ±5 mm"), is_wiring("at 23 °C"), is_wiring("cal. 2025-03")
    (True, True, True, True)
    >>> is_wiring("FS=10"), is_wiring("S/N 20331, cal 2026-01")
    (True, True)
    >>> is_wiring("x10"), is_wiring("cal. 2.5"), is_wiring("peak"), is_wiring("0.1 µm")
    (False, False, False, False)
    """
    if is_reach(text) or any(form.fullmatch(text) is not None for form in (_WIRING, _RANGE, _CONDITION, _REACH_ALONE)):
        return True
    parts = re.split(r"\s?[,;]\s", text)
    return len(parts) > 1 and all(map(is_wiring, parts))


def index_in(text: str) -> str:
    """Which of several alike a bracket names: "2" of "Ch 2", "b" of "cell B"; "" if it names none."""
    match = _INDEX.fullmatch(text.strip())
    return match["index"].lower() if match else ""


def is_letter(text: str) -> bool:
    """Whether a bracket is a letter that may be a unit or a name: A, C, F."""
    return _LETTER.fullmatch(text) is not None


def is_remark(text: str) -> bool:
    """Whether a bracket is a remark of known words that changes nothing: measured, absolute, load cell."""
    parts = words_in(text)
    return bool(parts) and all(p in REMARKS for p in parts)


def are_counts(text: str) -> bool:
    """Whether what stands in the place of a unit says that readings are counts, in no unit.

    >>> are_counts("raw ADC counts"), are_counts("24 bit"), are_counts("raw force"), are_counts("N")
    (True, True, False, False)
    """
    parts = [w for w in re.split(r"[\s_,;:()\[\]]+", text.lower()) if w] if len(text) <= LONGEST else []
    named = any(_COUNTED.fullmatch(w) for w in parts)
    return named and all(_COUNTED.fullmatch(w) or _BESIDE_COUNTED.fullmatch(w) for w in parts)


@lru_cache(maxsize=8192)
def no_record(text: str) -> str:
    """Why a name or a bracket with such words stands for no record: it was commanded, or is drawn from several readings.

    >>> no_record("load setpoint"), no_record("peak hold"), no_record("load")
    ('"setpoint" was commanded, not measured', '"peak" is a statistic, no record', '')
    >>> no_record("Kraftvorgabe"), no_record("TargetForce")
    ('"kraftvorgabe" was commanded, not measured', '"target" was commanded, not measured')
    >>> no_record("Force high range"), no_record("Force range")
    ('', '"range" is a statistic, no record')
    >>> no_record("Force p-p"), no_record("peak-to-peak")
    ('"p-p" is a statistic, no record', '"peak-to-peak" is a statistic, no record')
    """
    if (between := _PEAK_TO_PEAK.search(text)) is not None:
        return f'"{between[0].lower()}" is a statistic, no record'
    for found in words_in(_REACH_IN_WORDS.sub(" ", _CAMEL.sub(" ", text))):
        word = next((w for w in WITHOUT_BLANKS if found.startswith(w) or found.endswith(w)), found)
        if word in STATISTIC:
            return f'"{word}" is a statistic, no record'
        if word in BOUNDS:
            return f'"{word}" is a bound or a flag, not measured'
        if word in ("reference", "trigger"):
            return f'"{word}" was commanded, or is what others are compared with'
        if is_commanded(word):
            return f'"{word}" was commanded, not measured'
    return ""


def ends_without_unit(name: str) -> bool:
    """Whether the last word of a name is none of its unit, be it one elsewhere, as it stands behind "of".

    >>> [ends_without_unit(name) for name in ("Seconds of day", "Force in newtons", "Force N")]
    [True, False, False]
    """
    return _NO_UNIT.search(name.strip()) is not None


def unit_of_a_whole(name: str) -> str:
    """The unit of a time that is of a whole, or since something: "seconds" of "Seconds of day"; "" of any other name.

    >>> [unit_of_a_whole(name) for name in ("Seconds of day", "ms_of_day", "Sekunden seit Mitternacht", "Time of day")]
    ['seconds', 'ms', 'sekunden', '']
    """
    match = _OF_A_WHOLE.match(name.strip())
    units = (match["unit"], match["unit"].lower()) if match is not None else ()
    return next((unit for unit in reversed(units) if is_unit_of(unit, "time")), "")


def not_now(text: str) -> str:
    """Why a name or a bracket with such words may be of what is left to be done, or of another run; "" if it is not.

    >>> not_now("Force to go"), [not_now(text)[:10] for text in ("Restweg", "Displacement last run", "Old force")]
    ('"to go" may be what is left, or of another run', ['"restweg" ', '"last run"', '"old force'])
    >>> not_now("Last (N)"), not_now("Last Messung"), not_now("At rest"), not_now("Old rig")
    ('', '', '', '')
    """
    said = words_in(_CAMEL.sub(" ", re.sub(r"[()\[\]]", " ", text)))
    left = _LEFT.search(" ".join(said))
    found = left[0] if left is not None else next((w for w in said if w.startswith(NOT_NOW) or _is_rest(w)), "")
    pairs = [*pairwise(said)] if not found else []
    of_runs = [
        (one, other)
        for one, other in pairs
        if (one in OTHER_ONE and other.removesuffix("s") in RUNS) and (one, other) != ("last", "messung")
    ]
    of_names = [
        (one, other)
        for one, other in pairs
        if (one in OTHER_ONE and any(plain_meanings(other))) or (other in OTHER_ONE and any(plain_meanings(one)))
    ]
    found = found or next((" ".join(pair) for pair in (*of_runs, *of_names)), "")
    return f'"{found}" may be what is left, or of another run' if found else ""


def bends_itself(name: str) -> str:
    """Why a name may be of how far the machine itself gives way under the load, rather than of the ball; "" if it is not.

    >>> bends_itself("Frame deflection (mm)"), bends_itself("Rahmendurchbiegung")[:20]
    ('"Frame deflection" may be how far the machine itself gives way', '"Rahmendurchbiegung"')
    >>> bends_itself("Deflection (machine)"), bends_itself("Compliance corrected machine path"), bends_itself("Deflection")
    ('', '', '')
    """
    outside = re.sub(r"[(\[].*", "", name).strip(" _,;:")
    text = _CAMEL.sub(" ", outside).replace("_", " ").lower()
    itself = _GIVES_WAY.search(text) and _MACHINE.search(text) and not _OF_SAMPLE.search(text)
    return f'"{outside}" may be how far the machine itself gives way' if itself else ""


# How far something bends, what of a machine does, and words by which it is the sample, or was taken off.
_GIVES_WAY = re.compile(r"d[eé]fle[xc]|complian|durchbieg|aufbieg|verform|d[eé]forma|nachgieb|fl[eé]xi[oó]n|flessione")
_MACHINE = re.compile(
    r"\bframe|machine?\b|\brig\b|\bload ?cell\b|rahmen|maschine|kraftmessdose|\bbâti\b|telaio|macchina|bastidor|máquina"
)
_OF_SAMPLE = re.compile(
    r"sample|specimen|probe|\bball\b|correct|korrig|corrig|compensat|kompens|total|gesamt|without|ohne|minus"
)


def _is_rest(word: str) -> bool:
    return word.startswith("rest") and word.removeprefix("rest") in WITH_REST


def is_commanded(word: str) -> bool:
    """Whether a word in lower case says that something was commanded, also one joined with others: `kraftvorgabe`.

    >>> is_commanded("setpoint"), is_commanded("sollposition"), is_commanded("wegvorgabe"), is_commanded("kraft")
    (True, True, True, False)
    """
    return word in COMMANDED or word.startswith(COMMANDED_BEGINNINGS) or word.endswith(COMMANDED_ENDINGS)


def words_in(text: str) -> list[str]:
    """The words of a name or a bracket, in lower case.

    >>> words_in("Force_mean (N)")
    ['force', 'mean', '(n)']
    """
    return [w for w in re.split(r"[\s_.,;:/+-]+", text.lower()) if w]


_OF_UNIT = (
    (r"°|deg|rad", "an angle"),
    (r"° ?[CFK]|deg ?[CF]|K|C|℃|℉", "a temperature"),
    (r"[kMG]?Pa|psi|ksi|bar|mbar|N/mm²|N/mm\^?2|N/m\^?2|kgf/cm\^?2", "a stress or pressure"),
    (r"%|mm/mm|m/m|in/in|[µu]ε|[µu]strain|strain", "a share or strain"),
    (r"[mkµu]?V", "a voltage"),
    (r"[mkµun]?A", "a current"),
    (r"[mkMG]?(?:Ω|ohms?|Ohms?|OHM)", "a resistance or impedance"),
    (r"[µum]?S", "a conductance"),
    (r"[pnuµm]?C", "an electric charge"),
    (r"[mk]?J|mWh", "an energy"),
    (r"[µum]?m/(?:s|min)|mm/(?:sec|s)|%/(?:s|min)|1/s|N/s", "a rate"),
    (r"[kmµu]?N/(?:[mµu]?m|in)|gf?/mm|lbf?/in", "a stiffness"),
    (r"N[·.* ]?mm?|N-mm?", "a torque"),
)


def kind_of_unit(unit: str, *, charge: bool = False) -> str:
    """What a column is by a unit of something that is not read: "a temperature" of °C; "" if the unit tells nothing.

    Parameters
    ----------
    unit : as written.
    charge : whether the name speaks of a charge, whose unit C is not degrees.
    """
    unit = tidy(unit)
    if charge and re.fullmatch(_OF_UNIT[8][0], unit):
        return "an electric charge"
    kind = next((kind for pattern, kind in _OF_UNIT if re.fullmatch(pattern, unit)), "")
    return kind or (f"in {unit}" if looks_like_unit(unit) else "")
