"""From the words beside a table to what they state of its numbers: factors ("Load gain: 10"), units ("force in mN"), zeros."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType

from calib.lab.instruments.brackets import no_record, words_in
from calib.lab.instruments.contrary import names_quantity
from calib.lab.instruments.factor_words import FIGURES, MULTIPLES, MULTIPLIED
from calib.lab.instruments.lexicon import DERIVED, RELATIVE
from calib.lab.instruments.numbers import is_missing
from calib.lab.instruments.other_quantities import is_of_another, was_not_measured
from calib.lab.instruments.units import is_unit_of, lab_factor, stands_for
from calib.lab.instruments.vocabulary import understand

#: Words for what readings are multiplied by.
SCALE = (
    r"gains?|amplif\w*|amplification|attenuat\w*|multipl\w+|scal(?:e|ing)s?(?:[ _-]?factors?)?|factors?|facteurs?|"
    r"\w*faktor(?:en)?|fattor[ei]|fator(?:es)?|échelles?|escalas?|scal[ae]|verst[äa]rk\w*|ganancias?|guadagn[oi]|ganhos?|wzmocnienie|"
    r"förstärkning|versterking|range|bereich|倍率|増幅率|增益|放大倍数|배율"
)
_NUMBER = r"\d+(?:[.,]\d+)?(?:e[+-]?\d+)?|10\^[+-]?\d+"
# "Load gain: 10", "Amplifier factor 2", "Range x10", "Gain 20 dB"; a number with another unit is a sensitivity or a capacity.
_FACTOR = re.compile(
    rf"(?P<before>.*?)(?<![^\W_])(?P<word>{SCALE})(?![^\W_])(?P<between>[^\d]*?)(?P<times>[x×*/]\s?|1\s?[:/]\s?)?"
    rf"(?P<number>{_NUMBER})\s*(?P<tail>[^\s,;\t]*)[\s,;\t\"')\]]*",
    re.IGNORECASE,
)
# "Amplifier offset 0.5": the number is of what stands behind the word of a factor.
_OF_OFFSETS = re.compile(r"offset|intercept|versatz|décalage|desfase", re.IGNORECASE)
# "Gain 10 on force": of what stands behind the number.
_ON = re.compile(
    rf"(?<![^\W_])(?P<word>{SCALE})(?![^\W_])[\s:=]*(?:(?:of|von)\s+)?[x×]?\s?(?P<number>{_NUMBER})\s?[x×]?\s*"
    r"(?:\(|(?<=[\sx×])(?:on|for|of|to|in|auf|für|von|bei|am|sur|pour|sul?|per|para|en|de|du)\s+)"
    r"(?:(?:the|der|die|das|dem|la|le|el|il)\s+|l['’])?(?P<what>[^\W\d_][^\d]*)",
    re.IGNORECASE,
)
_TIMES = re.compile(
    rf"(?P<before>[^\d]*?)[\s:=,;\t([]*(?:[x×*]\s?(?P<number>{_NUMBER})|(?P<first>10+)\s?[x×])[)\]\s,;\t\"]*", re.I
)
# Parts of a line that each state a number of their own: "Gains: Load 2, Disp 1", "Scale;Load;0.01;Extension;1".
_PARTS = re.compile(r"[;|\t]|,(?!\d)|(?<!\d),|(?<=[a-z)])\s*:\s|\s\band\b\s|\s\bund\b\s", re.IGNORECASE)
_PART = re.compile(rf"(?P<what>[^\d]*?)(?P<number>{_NUMBER})\s*(?P<tail>[^\s\d]*)(?P<rest>.*)", re.IGNORECASE)
_SCALE_WORD = re.compile(rf"(?<![^\W_])(?:{SCALE}|scaled|skaliert)(?![^\W_])", re.IGNORECASE)
_RANGE_WORD = re.compile(r"(?:range|bereich)$", re.IGNORECASE)
# "Mult force: 10", "Koeffizient Kraft 2,5", "F x 10", "Kraft mal 2 nehmen": a factor of the one quantity that the line names;
# in a line of several, or of none, it is a result or a count.
_OF_ONE = (
    re.compile(
        r"(?P<before>[^\d]*?)(?<![^\W_])(?:mult|coeff?s?|coefficients?|koeffizient(?:en)?|coeficientes?|coefficient[ei]|slope|steigung|"
        r"pente|pendiente|pendenza|teiler|divis(?:or|eur)|divider|divisore|mnożnik|násobitel|vermenigvuldig\w*|множитель)"
        rf"(?![^\W_])(?P<behind>[^\d/]*?)(?P<number>{_NUMBER})[\s!.]*",
        re.IGNORECASE,
    ),
    re.compile(
        rf"(?P<before>[^\d]*?)[\s:;,\t]+(?:mal|fois|por|veces|volte|maal|razy|krát|durch)(?P<behind>\s+)(?P<number>{_NUMBER})(?![\w.,:]*\d)"
        r"(?:\s+(?:nehmen|genommen|multipli\w+|rechnen|gerechnet|teilen|geteilt|divid\w+|zu \w+))?[\s!.]*",
        re.IGNORECASE,
    ),
    re.compile(
        rf"(?P<before>[^\d]*?)[\s:;,\t]+(?:mit|met|by|con|avec|par|por|per|[/:])(?P<behind>\s*)(?P<number>{_NUMBER})\s+(?:zu\s+)?"
        r"(?:multipli\w+|moltiplic\w+|malnehmen|vermenigvuldig\w*|divid\w+|teilen|rechnen)[\s!.]*",
        re.IGNORECASE,
    ),
    re.compile(rf"(?P<before>[FCdsz])(?P<behind>[\s:]*)[x×*]\s?(?P<number>{_NUMBER})[\s!.]*"),
)
# "Lever arm ratio 5", "Hebelverhältnis 1:5": of the load, whichever way it is.
_LEVER = re.compile(
    r"(?<![^\W_])(?:lever(?:[ _-]?arm)?|hebel(?:arm)?s?|bras de levier|levier|palanca|braccio|leva)[ _-]*(?:d[eiu]l?\s+)?"
    r"(?:(?:ratio|fa[ck]tor|verhältnis|übersetzung|rapport|relación|rapporto)[\s:=\t]*(?:1\s?[:/]\s?)?"
    rf"(?P<number>{_NUMBER})(?:\s?[:/]\s?1)?|[^\d;]{{0,20}}?(?P<one>\d+(?:[.,]\d+)?)\s?[:/]\s?(?P<other>\d+(?:[.,]\d+)?))"
    r"(?![\w:]|[.,]\d|\s?[^\W\d_])",
    re.IGNORECASE,
)
_SYMBOLS = {"F": "force", "C": "capacitance", "d": "displacement", "s": "displacement", "z": "displacement"}
_OF_FITS = re.compile(r"correl|korrel|regress|variat|variation|fit\b|determin|friction|reib|[rR]²|\bR2\b", re.IGNORECASE)
# "multiply Load column by 2", "divide the force by 1000".
_BY = re.compile(
    r"\b(?:multipl(?:y|ied|i[eé]\w*|izieren|iziert|icar|icare|icad[oa]s?)|moltiplica\w*|divid(?:e|ed|ieren|iert|ir|er|ere|id[oa]s?)|"
    r"divisée?s?|divise[rz]?|divis[oaie]|geteilt|teilen|scaled|skaliert|amplified|verstärkt|"
    r"reduced|increased|times)\b(?P<what>[^\d]*?)"
    rf"(?:\b(?:by|with|mit|durch|um|par|por|per)\s*(?:a\s+|the\s+)?(?:(?:calibration\s+)?factor\s+(?:of\s+)?)?)(?P<number>{_NUMBER})(?![\w.,]*\d)",
    re.IGNORECASE,
)
_SIZE = (
    r"(?:large|high|small|low|big|hoch|gro(?:ß|ss)|klein|niedrig|grande?s?|élevée?s?|haute?s?|faibles?|basse?s?|petite?s?|alt[oaie]s?|"
    r"bass[oaie]|baj[oa]s?|pequeñ[oa]s?|piccol[oaie])"
)
_BY_FACTOR = r"(?:(?:an? |the |einen? |den |un |el |le )?(?:fa[ck]tor|facteur|fattore|fator)\s+(?:of\s+|von\s+|d[ei]\s+)?)?"
# "all forces times 2", "10x too large", "too high by 9.81", "at 1/10 scale", "true force = column / 10".
_OTHERWISE = (
    re.compile(rf"(?P<what>[^\d]*)\btimes\s+(?P<number>{_NUMBER})(?![\w.,:]*\d)", re.IGNORECASE),
    re.compile(
        rf"(?P<what>[^\d]*?)(?P<number>{_NUMBER})\s*(?:x|×|times|fold|mal)?\s*(?:too|zu|trop|demasiado|troppo)\s+"
        rf"{_SIZE}",
        re.IGNORECASE,
    ),
    re.compile(
        rf"(?P<what>[^\d]*?)(?<![^\W_])(?:too|zu|trop|demasiado|troppo|te)\s+{_SIZE}\s+(?:by|um|d['’e]\s?|en|por|di)\s*"
        rf"{_BY_FACTOR}(?P<number>{_NUMBER})(?:\s?(?:times|mal|fois|veces|volte|[x×]))?(?![\w.,]*\d|\s?[%\w])",
        re.IGNORECASE,
    ),
    re.compile(rf"(?P<what>[^\d]*?)(?:1\s?[/:]\s?)(?P<number>{_NUMBER})\s+scale\b", re.IGNORECASE),
    re.compile(
        r"(?P<what>[^\d]*?)(?<![^\W_])(?:is|are|reads?|shows?|ist|sind|zeigt|est|sont|es|son|è|sono)\s+(?:only\s+|nur\s+)?"
        rf"1\s?/\s?(?P<number>{_NUMBER})\s+(?:of|der|des|vom|von|de|du|del|della)\s+(?:(?:the|la|il|le)\s+)?"
        r"(?:real|true|actual|tatsächlich\w*|wahr\w*|wirklich\w*|réel\w*|vrai\w*|verdader\w*|ver[ao]|reale|what)(?![^\W_])",
        re.IGNORECASE,
    ),
    re.compile(rf"(?P<what>[^\d=]*)=\s*[^\d]*[^\W\d]\S*\s*(?:[*/×]|\sx\s)\s*(?P<number>{_NUMBER})\s*$", re.IGNORECASE),
    re.compile(rf"(?P<what>[^\d=]*)=\s*(?P<number>{_NUMBER})\s*(?:[*×]|\sx\s)\s*[^\W\d].*", re.IGNORECASE),
    re.compile(
        rf"(?P<what>[^\d=]*)(?:=|\b(?:is|are|ist|sind|est|sont|es|son|è|sono))\s*(?P<number>{_NUMBER})\s?[x×][\s.!)]*", re.I
    ),
)
_PRODUCTS = _OTHERWISE[-3:]
# A sign of multiplication that is a word of the clock, too.
_TIMES_BEFORE = re.compile(r"\btimes\s+(?=\d)", re.IGNORECASE)
# A gauge that shows what a formula makes a reading of; its factor is that of a strain.
_GAUGE = re.compile(r"gau?ges?(?![\s_-]*(?:factor|fac\b|k\b))", re.IGNORECASE)
_COUNTED = re.compile(
    r"(?<![^\W_])(?:repeat\w*|repetition\w*|cycles?|runs?|press(?:es)?|measured|tested|tests?|averag\w*|wiederhol\w*|zyklen|gemessen|"
    r"lens|objecti[vf]\w*|zoom|optic\w*|répét\w*|essais?|repeti\w*|ensayos?|ripeti\w*|prove)(?![^\W_])",
    re.IGNORECASE,
)
# Numbers in words, behind or before the words of a factor.
_NUMBER_WORD = re.compile(
    r"(?P<link>(?<![^\W_])(?:by|durch|mit|par|por|per|um|times|mal|factor|faktor|facteur|"
    r"factor of|factor de|faktor von|facteur de|"
    rf"fattore)\s+(?:an?\s+)?)?(?P<word>(?<![^\W_])(?:{'|'.join(FIGURES)}))(?![^\W_])(?P<times>\s+(?:times|mal|fois|veces|volte)\b)?",
    re.IGNORECASE,
)
# "Values of force are doubled", "Kraft halbiert", "force shows half of the load": not of what happened in a test.
_DOUBLED = re.compile(
    rf"(?<![^\W_])(?:{MULTIPLIED}|réduite?s? de moitié|reducid[oa]s? a la mitad|"
    r"(?:reads?|shows?|is|are|was|were|only|zeigt|ist|sind|nur|est|sont|es|son|è|sono)(?: only| nur)? "
    r"(?:(?:die|das|l[ae]|el|il) )?"
    rf"(?:{MULTIPLES})|(?:half|twice) as (?:large|high|much|big|small|low))"
    r"(?=\s*(?:$|[.,;!)]|(?:by|in|due|because|of|the|its|what|here|throughout|as|par|por|per|durch|aus|im|versehentlich|irrtümlich|"
    r"de|du|d[ei]l(?:la)?|der|des|dans|en|el|la|il|le|than)(?![^\W_])))",
    re.IGNORECASE,
)
# "half of the cell's reading", "die Hälfte der Anzeige": a part of what an instrument shows, or a multiple.
_OF_READING = re.compile(
    rf"(?<![^\W_])(?:{MULTIPLES})\s+(?:(?:of|the|what|der|des|von|de|du|del|della|dell['’])(?![^\W_])\s*|l['’]|la\s)+[^\d.;,]{{0,40}}?"
    r"(?<![^\W_])(?:readings?|values?|signals?|outputs?|counts?|anzeige|messwert\w*|wert(?:e|s|es)?|lecture|valeurs?|lectura|valor(?:es)?|"
    r"lettura|valor[ei])(?![^\W_])",
    re.IGNORECASE,
)
# "subtract 0.35 N from force", "0,35 N abziehen", "add 0.2 mm to the displacement": what is left to be done; what was, is not.
_AMOUNT = r"(?P<number>\d+(?:[.,]\d+)?)\s?(?P<unit>[^\W\d_]{1,3})"
_OFFSET = re.compile(
    r"(?<![^\W_])(?:subtract|deduct|add|soustraire|retrancher|ajouter|restar|sumar|sottrarre|aggiungere|subtrair|somar|aftrekken)"
    rf"\s+{_AMOUNT}(?![^\W_])|"
    r"(?P<before>(?<![\w.,])\d+(?:[.,]\d+)?)\s?(?P<of>[^\W\d_]{1,3})\s+(?:(?:from|von|de|to|zu)\s+[^\d.;]{1,30}?\s)?"
    r"(?:abziehen|abzuziehen|addieren|zu addieren|(?:(?:to|must|should|needs to) be|à|da|a) "
    r"(?:subtracted|deducted|added|soustraire|retrancher|ajouter|sottrarre|aggiungere|restar))(?![^\W_])",
    re.IGNORECASE,
)
# "Time in samples", "force column is in raw counts": counts of something, in no unit.
_IN_COUNTS = re.compile(
    r"(?:the |die |der |le |la )?(?P<what>[^\d:;,=]{1,30}?)\s+(?:columns?\s+|values?\s+|readings?\s+|spalte\s+|werte\s+)?"
    r"(?:(?:is|are|given|recorded|logged|stored|ist|sind|est|sont|es|son|è|sono)\s+)*(?:in|en|em)\s+(?:raw\s+)?(?:adc\s+)?"
    r"(?:samples?|counts?|ticks?|frames?|scans|digits?|lsbs?|adc units|abtastwerten|abtastungen|échantillons|muestras|campioni|"
    r"amostras)"
    r"(?:\s*[,;(].*|[.!\s]*)",
    re.IGNORECASE,
)
_OF_TESTS = re.compile(
    r"ranges?\b|bereich|preload|vorlast|vorkraft|précharge|precarga|precarico|steps?\b|schritt|increment|limit|stiff|steif|number|"
    r"anzahl|target|setpoint|sollwert|noise|rausch|resol|auflös|sampl|filter|interval|corrected|korrigiert|corrigée?|corregid|"
    r"corrett|already|bereits|schon|déjà|\bya\b|già|\bnot?\b|nicht|kein|\bpas\b|\bnon\b",
    re.IGNORECASE,
)
# "Attenuator 10:1 on load", "Spannungsteiler Kraft 1:2".
_RATIO = re.compile(
    r"(?<![^\W\d_])(?:scaling|skalierung|"
    r"attenuat\w*|(?:voltage[ -])?divider|gears?|gearbox|pulley|amplif\w*|(?:spannungs)?teiler|"
    r"abschwächer|dämpfungsglied|"
    r"getriebe|untersetzung|übersetzung|atténuateur|diviseur|réducteur|démultiplication|atenuador|divisor|reductor[a]?|engranaje|"
    r"attenuatore|partitore|riduttore|verstärk\w*)(?![^\W\d_])[^\d]{0,30}?(?P<one>\d+(?:[.,]\d+)?)\s?[:/]\s?(?P<other>\d+(?:[.,]\d+)?)(?![\d.:/])",
    re.IGNORECASE,
)
_OF_COUNTS = re.compile(
    r"(?<![^\W_])(?:applied|increas\w*|number|taken|measured|was|were|interval|resol\w*|aufgebracht)(?![^\W_])", re.I
)
# "time in 1/10 s", "Zeit in Zehntelsekunden", "force in hundredths of N": parts of a unit.
_PART_OF_UNIT = re.compile(
    r"(?P<what>[^\d]*?)(?<![^\W_])(?:in|en|em|as)\s+(?:1\s?[/⁄]\s?10+\s?(?:of\s+an?\s+)?|"
    r"(?:tenths?|hundredths?|thousandths?|zehnteln?|hundertsteln?|tausendsteln?|dixièmes?|centièmes?|millièmes?|décimas?|decimas?|"
    r"centésimas?|milésimas?|decimi|centesimi|millesimi)\s*-?(?:(?:of an?|of|von|d['’]|de|di)\s*)?)"
    r"(?P<unit>[^\W\d]+)[\s.!)]*",
    re.IGNORECASE,
)
# "gain x10 not corrected in capacitance column", "amplifier gain 10 not yet divided out of force": what was left to be done.
_NOT_DONE = re.compile(
    r"\b(?:not|never|nicht|non|pas|sin|no)\b(?: (?:yet|been|noch|be|ancora|encore))* (?:correct|divid|appli|compensat|account|"
    r"remov|includ|consider|taken|multipl|scal|convert|korrigi|kompensi|berücksichtig|angew|verrechn|corrig|appliq|compens)\w*|"
    r"\b(?:uncorrected|unkorrigiert|noch nicht|pending|(?:to|must|should|needs to) be (?:applied|corrected|divided|multiplied)|"
    r"anzuwenden|zu (?:multiplizieren|verrechnen))\b",
    re.IGNORECASE,
)
# What a factor of the readings is called, too, where it is said to be left to do: by itself it says how they were made.
_OF_CALIBRATION = re.compile(r"cal(?:ibrat\w*)?\b|kalibrier", re.IGNORECASE)
_BY_MARK = re.compile(r"(?<![^\W_])[x×](?=\s?\d)", re.IGNORECASE)
_CONSTANT = re.compile(
    r"\b(?:(?:cal|calibration|correction|conversion|kalibrier|korrektur)[ .-]{0,2}"
    r"(?:constants?|coefficients?|konstante|koeffizient)|sensitivity|empfindlichkeit|sensibilité|sensibilidad|sensibilità)\b",
    re.IGNORECASE,
)
# "data normalised to maximum", "force normalized": numbers without a unit.
_NORMALISED = re.compile(
    r"(?P<what>.*?)\b(?:normali[sz]ed|normiert|normalisiert|normalisée?s?|normalizad[oa]s?|normalizzat[oaie])\b(?P<rest>.*)",
    re.IGNORECASE,
)
_NOT_NORMALISED = re.compile(
    r"\b(?:not|un|nicht|non|pas|no|temperature|by (?:area|thickness))\b|normali\w+\s*[:=]", re.IGNORECASE
)
# "1 count = 0.01 N", "in units of 10 mN": numbers that are not in the unit itself.
_COUNTS = re.compile(
    r"(?:\b1\s*(?:count|unit|digit|lsb|division|div|skt|einheit|step|schritt)\s*(?:=|≙|is|corresponds to|entspricht)\s*|"
    r"\b(?:units?|einheit(?:en)?)\s*(?:=|:|of|von)\s*)"
    rf"(?P<number>{_NUMBER})\s*(?P<unit>[^\s\d,;()]+)",
    re.IGNORECASE,
)
# "Time unit: 100 ms", "Time in units of 100 ms", "Unit of time: 100 ms"; a time without the word is an interval, or how long.
_TIME_UNIT = re.compile(
    rf"(?:\b(?:time|zeit|temps|tiempo|tempo)[ _-]?(?:in )?(?:units?|einheit(?:en)?|base)\b|"
    rf"\b(?:units?|einheit) (?:of|der) (?:time|zeit)\b)[^\d]*?(?P<number>{_NUMBER})\s*(?P<unit>[^\s\d,;()]+)",
    re.IGNORECASE,
)
# "displayed value x 0.01 = N", "counter x 0.1 = s", "reading * 0.01 N", "Force scale factor: 0.01 N/unit", "Kraft in 0,01 N".
_BY_UNIT = (
    re.compile(
        rf"(?P<what>.*?)\b(?:values?|readings?|counters?|counts?|displayed|columns?|raw|numbers?|werte?|anzeige|ablesung)\b"
        rf"[^\d=]*?[x×*·/÷]\s*(?P<number>{_NUMBER})\s*(?:=\s*)?(?:in\s+)?(?P<unit>[^\W\d]\w*)\s*",
        re.IGNORECASE,
    ),
    re.compile(
        rf"(?P<what>[^\d]*?)\s(?P<number>{_NUMBER})\s*(?P<unit>[^\W\d]+)\s*/\s*(?:unit|count|digit|lsb|div|bit|step)s?\s*", re.I
    ),
    re.compile(rf"(?P<what>[^\d]*?)\b(?:in|en|em)\s+(?P<number>{_NUMBER})\s*(?P<unit>[^\W\d]+)\s*", re.IGNORECASE),
)
_STEPS_OF_READING = re.compile(r"resol|auflös|précision|risol|least|smallest", re.IGNORECASE)
#: Factors of something else than the readings.
OF_OTHERS = re.compile(
    r"full[ -]*scales?(?! *fac)|\bscale[ -]?bars?\b|pleine *échelle|fondo *scala|fondo de *escala|"
    r"gau?ge|safety|shape|form|quality|dissipation|loss|power|duty|crest|averag|decim|sampl|filter|zoom|lapse|magnif|pid|"
    r"propor|integral|deriv|feedback|control|loop|tuning|\b[pid][ _-]?gain|servo|calibrat|kalibrier|poisson|\bk[ -]?fac|"
    r"plot|graph|chart|axis|stress|strain|time(?!s)|rate|speed|print|colou?r|grey|gray|image|video|camera|friction|"
    r"verlust|gütefaktor|sicherheit|temperat|thermo|humid|feucht|expan|hx ?71\d|ads1\d+|\badc\b|nau7802",
    re.IGNORECASE,
)
_LONGEST = 120
# What parts the clauses of a line.
_CLAUSE = re.compile(r"[,;.](?!\d)")
# What a line without a figure has that states a factor in words.
_IN_WORDS = re.compile(
    rf"(?<![^\W_])(?:{MULTIPLIED}|{MULTIPLES}|{'|'.join(FIGURES)})(?![^\W_])|double|doub|half|halb|fach|fold|moiti|dupli|trip|"
    r"tenth|hundred|thousand|zehnt|hundert|tausend|ième|d[eé]cim|(?:cent|mill?)[eé]sim",
    re.IGNORECASE,
)

# "force now in mN", "Load: kN", "all values in gf", "switched to kN", "units: mN".
_IN_UNIT = re.compile(
    r"(?P<before>.*?)(?:\b(?:in|to|into|as|en|auf|nach|now)|[:=>→])\s*[(\[\"']?(?P<unit>[^\s()\[\],;.!?\"'\d]{1,12})[)\]\"']?[\s.,;!?\"]*",
    re.I,
)
_UNITS = re.compile(
    r"\b(?:units?|einheit(?:en)?|unité[s]?|unidad(?:es)?|unità|eenhe(?:id|den)|enhet(?:er)?|enhed(?:er)?|jednostk[ai])\b|单位|単位|단위",
    re.I,
)
# "force x2 from here", "Kraft mal 10 ab hier".
_TIMES_FROM = re.compile(
    rf"(?<![^\W\d_])(?:[x×*]|mal|times)\s?{_NUMBER}\s+"
    r"(?:from (?:here|now)|now|since|ab (?:hier|jetzt)|à partir|desde|da qui|od)(?![^\W_])",
    re.IGNORECASE,
)
_RANGE = re.compile(
    r"\b(?:range|gain|scale(?![ -]?bar)|scaling|factor|calib\w*|load ?cell|amplifier|messbereich|bereich|faktor|verstärkung|"
    r"umgeschaltet)\b"
    r"|量程|レンジ|倍率",
    re.I,
)
# Words of units that are words of a language, too.
_WORDS = ("in", "d", "s", "m", "h", "a", "x", "-", "min", "#", "1", "none", "cycles", "c")
_NO_UNITS = ("", "in", "a", "x", "-", "#", "1", "none", "cycles", "c")
_ALL = re.compile(r"\b(?:all|values|readings|data|numbers|columns|everything|werte|daten|alle|valeurs|valores)\b", re.I)
_QUANTITIES = ("force", "displacement", "capacitance", "time")
# What a column is, behind its own name: "- force: normal force, millinewtons", "`disp` - depth in metres, positive down".
_EXPLAINED = re.compile(
    r"(?:[-*•+]\s+)?[`'\"]*(?P<name>[^\W\d][\w.]*(?: \w+)?)[`'\"]*"
    r"(?:\s*[(\[](?P<unit>[^()\[\]]+)[)\]](?=\s*[:=–—-]\s*[^\W\d]\S*\s))?\s*(?:[:=]\s*|\s[-–—]\s+)(?P<text>[^\W\d].*)"
)
# What is told of an instrument or a test in the same way.
_OF_INSTRUMENT = re.compile(
    r"capacity|range|bereich|accura|genauigk|sensitiv|speed|rate(?![^\W\d_])|thresh|limit|full.?scale|trigger|steps?(?![^\W\d_])|"
    r"interval|nominal|rated",
    re.IGNORECASE,
)
_CLAUSES, _IN = (
    re.compile(r"\s*[,;()\[\]]+\s*|\.\s+|\s[-–—]\s"),
    re.compile(r"(?:.*\s)?(?:in|en|em)\s+(?:(?P<last>\S+)|(?P<unit>\S{2,})\s.*)", re.I),
)

# What a tester, a meter or its user calls it to set a zero anew, language by language: words, and those without blanks beside.
_ZERO_WORDS = "|".join(
    (
        r"(?:re|auto)?[ -]?zero(?:ed|ing|s|es|set)?|zero'd|re-?set(?:s|ted|ting)?|tare[ds]?|taring|nulled|nulling",
        r"re-?balanced?|balancing|(?:load|force|cell|bridge) balanced?|balance (?:load|force|cell|bridge)",
        r"offset (?:nulled|adjusted|corrected|removed|set)|(?:open|short|open/?short)[ -]correction",
        r"null|nullung|nullen|genullt|abgenullt|null(?:punkt|abgleich|setz|stell|still)\w*|zurück(?:ge)?setz\w*|rücksetz\w*",
        r"tara|tarier(?:en|t|ung)|austariert",
        r"zéros?|(?:re)?mise? à (?:z[ée]ro|0)|raz|tarer?|taré|tarage|réinitialis\w*",
        r"(?:a|puesta a) cero|cero|tarad[oa]|tarar|reinici\w*|restablec\w*",
        r"azzer\w*|tarat[oa]|tarare|taratura|reimpost\w*|resettat[oa]",
        r"zerad[oa]|zerar|zeragem|zerou|tarou|tarado",
        r"(?:op )?nul|nulstel\w*|genuld|tarra|tarreren|getarreerd|gereset",
        r"(?:wy)?zerowa\w*|tarowa\w*|wytarowa\w*|zresetowa\w*",
        r"vynul\w*|nulov\w*|tárov\w*|resetov\w*",
        r"noll(?:ad|at|ning|ställ\w*|a|as|aus|ataan|attu)?|nulstil\w*|nullstil\w*|nulpunkt\w*|tarer(?:a|ad|ing|et)|taara\w*|återställ\w*",
        r"(?:le|ki)?nulláz\w*|(?:ki)?táráz\w*|sıfır\w*|dara\w*",
        r"aducere la zero|tarare|ničla|niciranje|nuliranje|poništ\w*|μηδεν\w*|απόβαρο\w*",
        r"(?:об|за)нул\w*|сброс\w*|ноль|нуль|тара|тариров\w*",
    )
)
_JOINED = "去皮|清零|归零|歸零|置零|调零|調零|重置|复位|復位|零点|零點|リセット|ゼロ|風袋|零調|영점|제로|리셋|용기 ?무게"
_ANEW = re.compile(rf"(?<![^\W_])(?:{_ZERO_WORDS})(?![^\W_])|{_JOINED}", re.IGNORECASE)
# The clock's zero is none of a reading's, and what was not done changes nothing.
_OF_CLOCKS = re.compile(r"\b(?:time[rs]?|clock|stopwatch|uhr|zeit|counter|cycle count|chrono\w*|temporizador)\b", re.IGNORECASE)

_BLANKS = re.compile(r"(\s)\1+")


def stated_factors(lines: Sequence[str], first: int = 1) -> Mapping[str, tuple[str, int]]:
    """Find the factors that lines beside a table state: quantity, "" for none in particular -> the words and their line.

    Parameters
    ----------
    lines : as written.
    first : 1-based line of the first of them.

    >>> dict(stated_factors(["Load gain: 10", "Gauge factor 2.1", "Load cell capacity: 500 N"]))
    {'force': ('Load gain: 10', 1)}
    >>> [*stated_factors(["# NOTE: multiply Load column by 2 (bridge of 2024)"])]
    ['force']
    """
    found: dict[str, tuple[str, int]] = {}
    for number, written in enumerate(lines, first):
        if len(written) > _LONGEST:
            continue
        # Between names far apart a pattern has as many places to try as there are blanks, each with all that follow.
        line = _BLANKS.sub(r"\1", written)
        told = any(c.isdigit() for c in line) or _NORMALISED.match(line) or _IN_WORDS.search(line) or _IN_COUNTS.search(line)
        if told:
            for quantity in _factors_of(line.strip(" \t,;#%\"'")):
                found.setdefault(quantity, (written.strip()[:60], number))
    return MappingProxyType(found)


def what_is_stated(line: str) -> str:
    """What a line states of which `stated_factors` finds that it states something: "an offset", "counts" or "a factor"."""
    return "an offset" if _OFFSET.search(line) else "counts" if _IN_COUNTS.search(line) else "a factor"


def _factors_of(line: str) -> tuple[str, ...]:
    """Of which quantities a line states a factor, "" for any; none if it states none."""
    line = _NUMBER_WORD.sub(
        lambda m: m[0].replace(m["word"], FIGURES[m["word"].lower()]) if m["link"] or m["times"] else m[0], line
    )
    told = _BY.search(line)
    if told is not None and not _is_one(told["number"]) and not _of_others(line[: told.start("number")]):
        return (next((q for part in (told["what"], line[: told.start()]) if (q := quantity_of(part))), ""),)
    normalised = _NORMALISED.match(line)
    if normalised is not None:
        of = next((q for part in (normalised["what"], normalised["rest"]) if (q := quantity_of(part))), None)
        everything = _ALL.search(line) is not None or not normalised["what"].strip()
        return () if _NOT_NORMALISED.search(line) or (of is None and not everything) else (of or "",)
    left = _NOT_DONE.search(line)
    if (
        left is not None
        and (scale := _SCALE_WORD.search(line) or _CONSTANT.search(line) or _BY_MARK.search(line))
        and not _of_others(line)
    ):
        number = re.search(_NUMBER, line[scale.end() :])
        if number is not None and not _is_one(number[0]) and _RANGE_WORD.search(scale[0]) is None:
            rest = line[scale.end() :][number.end() :]
            return (next((q for part in (rest, line[: scale.start()]) if (q := quantity_of(part))), ""),)
    on = _ON.search(line)
    of = quantity_of(on["what"]) if on is not None and not _RANGE_WORD.search(on["word"]) else None
    if on is not None and of is not None and not _is_one(on["number"]) and not _of_others(line):
        return (of,)
    tick = _TIME_UNIT.search(line)
    if tick is not None and is_unit_of(tick["unit"], "time") and not _is_one(tick["number"]):
        return ("time",)
    counts = _COUNTS.search(line)
    if counts is not None and not _STEPS_OF_READING.search(line):
        return tuple(q for q in _QUANTITIES[:3] if is_unit_of(counts["unit"], q) and not _is_one(counts["number"]))
    for pattern in _BY_UNIT:
        match = pattern.fullmatch(line)
        of = quantity_of(match["what"]) if match is not None else None
        # Of what is named the first words may be those of another factor, but not those of a time.
        known = match is not None and (of == "time" or not OF_OTHERS.search(match["what"]))
        if match is not None and known and of is not None and is_unit_of(match["unit"], of) and not _is_one(match["number"]):
            return (of,)
    part = _PART_OF_UNIT.fullmatch(line)
    of = quantity_of(part["what"]) if part is not None and not _STEPS_OF_READING.search(part["what"]) else None
    if part is not None and of is not None and is_unit_of(part["unit"].lower(), of):
        return (of,)
    if (ratio := _RATIO.search(line)) is not None and ratio["one"] != ratio["other"]:
        return _named_in_clause(line, ratio)
    if (doubled := _DOUBLED.search(line)) is not None and not _of_others(line) and not _OF_TESTS.search(line):
        return _named_in_clause(line, doubled)
    if (part_of := _OF_READING.search(line)) is not None and not _OF_TESTS.search(line):
        return _named_in_clause(line, part_of) or ("",)
    offset, counted = _OFFSET.search(line), _IN_COUNTS.fullmatch(line)
    if offset is not None and not _OF_TESTS.search(line) and (of_offset := _named_in_clause(line, offset)):
        return tuple(q for q in of_offset if is_unit_of(offset["unit"] or offset["of"], q))
    if counted is not None and (of := quantity_of(counted["what"])) is not None and not _OF_COUNTS.search(counted["what"]):
        return (of,)
    for pattern in _OTHERWISE:
        match = pattern.match(line)
        others = OF_OTHERS.search(_GAUGE.sub("", line) if pattern in _PRODUCTS else line)
        if match is not None and not _is_one(match["number"]) and others is None:
            quantity = quantity_of(match["what"]) or quantity_of(_TIMES_BEFORE.sub(" ", line))
            if pattern is _PRODUCTS[-1] and _COUNTED.search(line):
                continue
            if quantity is not None or pattern not in _PRODUCTS:
                return (quantity or "",)
    lever = _LEVER.search(line)
    if lever is not None and (lever["one"] != lever["other"] if lever["one"] else not _is_one(lever["number"])):
        return ("force",)
    for pattern in _OF_ONE:
        match = pattern.fullmatch(line)
        if match is not None and not _is_one(match["number"]) and not _OF_FITS.search(line) and not _of_others(line):
            symbol, words = match["before"], f"{match['before']} {match['behind']}"
            named = [_SYMBOLS[symbol]] if symbol in _SYMBOLS else [q for q in _QUANTITIES if names_quantity(words, q)]
            return tuple(named) if len(named) == 1 and named != ["time"] else ()
    match = _FACTOR.fullmatch(line)
    if match is not None:
        tail, word = match["tail"].lower().rstrip(")]"), match["word"].lower()
        factor = tail in ("", "x", "×", "db", "times", "fold", "fach", "mal")
        if word in ("range", "bereich") and not match["times"] and tail not in ("x", "×"):
            factor = False
        if _OF_OFFSETS.search(match["between"]):
            return ()
        if not factor or _is_one(match["number"]) or OF_OTHERS.search(f"{match['before']} {match['word']} {match['between']}"):
            return ()
        return (next((q for part in (match["before"], match["between"]) if (q := quantity_of(part))), ""),)
    return _factors_of_parts(line)


def _named_in_clause(line: str, match: re.Match[str]) -> tuple[str, ...]:
    """The quantities that are named in the part of a line, between marks, in which something was found."""
    first = max((m.end() for m in _CLAUSE.finditer(line, 0, match.start())), default=0)
    end = _CLAUSE.search(line, match.end())
    clause = line[first : end.start() if end is not None else len(line)]
    return tuple(q for q in _QUANTITIES[:3] if names_quantity(clause, q))


def _of_others(text: str) -> bool:
    """Whether words are of the factor of something else than the readings, that of a calibration aside."""
    return OF_OTHERS.search(_OF_CALIBRATION.sub("", text)) is not None


def _factors_of_parts(line: str) -> tuple[str, ...]:
    """Of which quantities the parts of a line state factors: each its own, or of what the part before it named."""
    scaled, named = False, ""
    found: list[str] = []
    for part in (p.strip() for p in _PARTS.split(line)):
        word = _SCALE_WORD.search(part)
        if OF_OTHERS.search(part):
            scaled = False
            continue
        match, alone = _PART.match(part), _TIMES.fullmatch(part)
        quantity = quantity_of(match["what"] if match is not None else part)
        scaled = scaled or (word is not None and _RANGE_WORD.search(word[0]) is None)
        if alone is not None and (own := quantity_of(alone["before"])) is not None:
            found += [] if _is_one(alone["number"] or alone["first"]) else [own]
        elif scaled and match is not None and not _is_one(match["number"]) and _is_no_unit(match["tail"]):
            # A cell by itself, or a number behind "scale", is of what the part before named.
            before = named if word is not None or not match["what"].strip(" :=([") else ""
            of = quantity or quantity_of(f"{match['tail']} {match['rest']}") or before
            found += [of] if of else []
        named = quantity or named
    return tuple(found)


def _is_no_unit(tail: str) -> bool:
    """Whether what stands behind a number leaves it a factor."""
    return tail.lower().rstrip(")],") in ("", "x", "×", "db", "times", "fold", "fach", "mal", "#") or "(" in tail


def _is_one(number: str) -> bool:
    """Whether a number changes nothing: a factor of 1, or of 0, which is none, or no decibel."""
    return re.fullmatch(r"[01](?:[.,]0*)?|10\^[+-]?0", number) is not None


def quantity_of(text: str) -> str | None:
    """The quantity that is named in a few words."""
    parts = [w for w in re.split(r"[\s:=,;_()\[\]/]+", text) if w]
    for size in range(min(len(parts), 3), 0, -1):
        for start in range(len(parts) - size + 1):
            words = " ".join(parts[start : start + size])
            heading = understand(words) or understand(re.sub(r"(?:s|(?:mess)?werten?)$", "", words))
            if heading is not None and len(heading.name) > 1 and stands_for(heading.quantity) in _QUANTITIES:
                return stands_for(heading.quantity)
    return None


def stated_units(line: str) -> Iterator[tuple[str, str]]:
    """The quantities and units of a line such as "Force in mN" or "All loads in gf".

    >>> list(stated_units("Force in mN")), list(stated_units("pressed in air"))
    ([('force', 'mN')], [])
    """
    match = _IN_UNIT.fullmatch(line.strip(" \t,;#%\"'")) if len(line) <= _LONGEST else None
    explained = _explained(line)
    if match is None or (explained is not None and is_no_reading(*explained[:2])):
        return
    unit, quantity = match["unit"], quantity_of(match["before"])
    if quantity is None and unit not in _WORDS and _ALL.search(match["before"]):
        quantity = next((q for q in _QUANTITIES if is_unit_of(unit, q)), None)
    if quantity is not None and is_unit_of(unit, quantity) and unit not in ("-", "#", "x"):
        yield quantity, unit


def explained_units(line: str) -> Iterator[tuple[str, str]]:
    """The quantity and unit of a line that says what a column is behind its own name, and has the unit in one of its parts.

    >>> list(explained_units("# displacement: indenter travel in metres, positive into the sensor"))
    [('displacement', 'metres')]
    >>> list(explained_units("# - force: normal force, millinewtons")), list(explained_units("force: maximum force, N"))
    ([('force', 'millinewtons')], [])
    """
    explained = _explained(line)
    if explained is None or is_no_reading(*explained[:2]):
        return
    quantity, text, unit = explained
    if _OF_INSTRUMENT.search(text) or stated_factors([text]):
        return
    parts = [part.strip(" .`'\"") for part in _CLAUSES.split(text)]
    units = [unit, *(of["last"] or of["unit"] if (of := _IN.fullmatch(part)) is not None else part for part in parts)]
    own = [unit for unit in units if unit.lower() not in _NO_UNITS and is_unit_of(unit, quantity)]
    if len({lab_factor(unit, quantity) for unit in own}) == 1:
        yield quantity, own[0]


def _explained(line: str) -> tuple[str, str, str] | None:
    """The quantity whose name begins a line, what the line says of it, and the unit in brackets between both."""
    match = _EXPLAINED.fullmatch(line.strip(' \t,;#%/!"')) if len(line) <= _LONGEST else None
    heading = understand(match["name"]) if match is not None else None
    if match is None or heading is None or heading.unit is not None or heading.index or heading.name_doubt:
        return None
    quantity = stands_for(heading.quantity)
    return (quantity, match["text"], match["unit"] or "") if quantity in _QUANTITIES else None


def is_no_reading(quantity: str, text: str) -> bool:
    """Whether what is said of a column makes it no record of its quantity.

    Parameters
    ----------
    quantity : of whose unit the column is.
    text : what is said of it.
    """
    said = DERIVED | RELATIVE if quantity == "capacitance" else DERIVED
    return (
        bool(no_record(text))
        or any(word in said for word in words_in(text))
        or is_of_another(text, quantity)
        or was_not_measured(text)
    )


def speaks_of_scale(text: str) -> bool:
    """Whether words among the rows say that these are in another unit or range from there on.

    >>> speaks_of_scale("# force now in mN"), speaks_of_scale("units: mN"), speaks_of_scale("# range x10")
    (True, True, True)
    >>> speaks_of_scale("# hold for 10 s"), speaks_of_scale("# unloading begins")
    (False, False)
    """
    if _UNITS.search(text) or stated_factors([text]) or next(stated_units(text), None):
        return True
    if _RANGE.search(text) or (len(text) <= _LONGEST and _TIMES_FROM.search(text)):
        return True
    words = re.findall(r"(?<![\w.,\d])(?<!\d )[^\s()\[\],;:=!?\d]{2,4}(?![\w])", text)
    return any(w not in _WORDS and any(is_unit_of(w, q) for q in _QUANTITIES[:3]) for w in words)


def speaks_of_zero(text: str) -> bool:
    """Whether a few words say that a zero is set anew.

    Parameters
    ----------
    text : a cell or a line.

    >>> [speaks_of_zero(words) for words in ("# tare", "Kraft genullt", "RAZ", "载荷清零", "auto-zero", "Load balanced")]
    [True, True, True, True, True, True]
    >>> [speaks_of_zero(words) for words in ("# hold", "unloading", "target 5 N", "timer reset", "start", "NULL", "0")]
    [False, False, False, False, False, False, False]
    """
    short = len(text) <= _LONGEST and not is_missing(text)
    return short and _ANEW.search(text) is not None and not _OF_CLOCKS.search(text)
