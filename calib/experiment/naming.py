"""From the name of a lab file to what it says: of which specimen it is, which of several presses, and words for instruments."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

Role = Literal["word", "number", "force", "capacitance", "neutral", "stamp"]

# Whole words, in lower case, that stand for an instrument or for what it measures, and words that say nothing.
_ROLES: tuple[tuple[Role, re.Pattern[str]], ...] = (
    (
        "force",
        re.compile(
            r"force\w*|load|press\w*|indent(?:ation|ations|ing)?|compress\w*|comp|kraft\w*|druck\w*|instron\w*|bluehill|zwick\w*|"
            r"roell|testxpert|mts|mecmesin|shimadzu|utm|tester|displacement|travel|weg|fd|fz|mach|zug\w*|tensile|prüfmaschine|"
            r"pruefmaschine|力|压力|荷重|試験力"
        ),
    ),
    (
        "capacitance",
        re.compile(
            r"cap|caps|capacit\w*|kap|kapazit\w*|lcr\w*|hioki\w*|keysight|agilent|gw|instek|gwinstek|wayne|kerr|impedan\w*|cf|meter|"
            r"bridge|messbrücke|cp|cs|电容|容量|静電容量|im35\d\d|e4980al?"
        ),
    ),
    (
        "neutral",
        re.compile(r"raw|rawdata|data|daten|log|logs|logger|record|export|meas\w*|mess\w*|test\w*|versuch\w*|file|final"),
    ),
)
_ONE_LETTER = {"force": "f", "capacitance": "c"}

# Words before the number of a press, of several of one specimen, besides those for instruments.
_REPEAT = re.compile(
    r"run|rep|repeat|repetition|replicate|trial|sweep|take|try|cycle|wdh|wiederholung|zyklus|mess\w*|versuch|test"
)
_BALL = re.compile(r"ball|sphere|kugel|indenter|bille|bola")
# Words before the size of a ball; a letter alone is one before a number in mm, and "r" behind the number of a specimen.
_RADIUS, _DIAMETER = re.compile(r"r|rad|radius|rayon"), re.compile(r"d|dia|diam|diameter|durchmesser|diamètre|ø")
#: Words that may stand before the number of a specimen, and say nothing else.
_SPECIMEN = re.compile(r"s|sp|smp|sensor\w*|sensoren|specimen|sample|probe|probek\w*|muster|dut|device|nr|no|n|id")

_MODEL = re.compile(r"(?<![a-z0-9])(im ?35\d\d|e4980al?|(?:instron|zwick|mts)[ _-]?\d{3,4})(?![a-z0-9])", re.IGNORECASE)
_STAMP = re.compile(
    r"(?<!\d)(?:19|20)\d\d([-_. ]?)[01]\d\1[0-3]\d(?:[T _-]*[0-2]\d([-_.:h]?)[0-5]\d(?:\2[0-5]\d)?)?(?!\d)|"
    r"(?<!\d)[0-3]\d([-.])[01]\d\3(?:19|20)\d\d(?!\d)"
)
_EASTERN = re.compile(r"(静電容量|试验力|試験力|压力|荷重|电容|容量|力)")
_PIECE = re.compile(r"\d+(?:[.,]\d+(?=[ _-]?mm(?![^\W\d_])))?|[^\W\d_]+")
_HUMP = re.compile(r"(?<=[a-zäöüßé])(?=[A-ZÄÖÜ])|(?<=[A-Z])(?=[A-Z][a-z])")


@dataclass(frozen=True)
class Token:
    """One word or number of a name: its text (lower case, no leading zeros), what it stands for, and its place."""

    text: str
    role: Role
    start: int
    end: int


def tokens_of(title: str, kind: Literal["force", "capacitance", ""]) -> tuple[Token, ...]:
    """Cut a name into words and numbers and say what each stands for.

    A single F or C stands for the quantity in a name without a longer word for it: "A-01-C", "F1".

    Parameters
    ----------
    title : name of a file without its ending.
    kind : what the file holds; "" for a folder, whose name is of neither.

    >>> [(t.text, t.role) for t in tokens_of("Sensor_01 Kapazität", "capacitance")]
    [('sensor', 'word'), ('1', 'number'), ('kapazität', 'capacitance')]
    """
    found: list[Token] = []
    taken: list[tuple[int, int, Role]] = [(*m.span(), "stamp") for m in _STAMP.finditer(title)]
    taken += [(*m.span(), "neutral") for m in _MODEL.finditer(title)]
    cuts = {i for start, end, _ in taken for i in (start, end)}
    cuts |= {i for m in _EASTERN.finditer(title) for i in m.span()} | {m.start() for m in _HUMP.finditer(title)}
    for piece in _PIECE.finditer(title):
        inside = [piece.start(), *sorted(c for c in cuts if piece.start() < c < piece.end()), piece.end()]
        for start, end in pairwise(inside):
            text = unicodedata.normalize("NFKC", title[start:end]).casefold()
            role: Role = next((r for a, b, r in taken if a <= start and end <= b), _role(text))
            found.append(Token(_plain(text), role, start, end))
    if kind and not any(t.role in ("force", "capacitance") for t in found):
        letters = [i for i, t in enumerate(found) if t.text == _ONE_LETTER[kind]]
        if letters and len(found) > 1:
            at = letters[-1]
            found[at] = Token(found[at].text, kind, found[at].start, found[at].end)
    return tuple(found)


def _plain(text: str) -> str:
    """A number without leading zeros and with a point, such as that of a ball of 2,5 mm; a word as it is."""
    if text.isdecimal():
        return str(int(text))
    return text.replace(",", ".")


def _role(text: str) -> Role:
    if text[:1].isdecimal():
        return "number"
    return next((role for role, words in _ROLES if words.fullmatch(text)), "word")


def key_of(tokens: Iterable[Token], *, stamps: bool = True, specimen_words: bool = True) -> tuple[str, ...]:
    """The words and numbers by which a name tells specimens and presses apart, in order.

    Parameters
    ----------
    tokens : of the name.
    stamps : whether dates count.
    specimen_words : whether words such as "sensor" and "s", which say nothing before a number, count.

    >>> key_of(tokens_of("press_s01", "force")), key_of(tokens_of("S1 cap", "capacitance"))
    (('s', '1'), ('s', '1'))
    """
    roles = ("word", "number", "stamp") if stamps else ("word", "number")
    return tuple(t.text for t in tokens if t.role in roles and (specimen_words or not _SPECIMEN.fullmatch(t.text)))


def numbers_of(key: Iterable[str]) -> tuple[str, ...]:
    """The numbers of a key; those of two records of one press agree."""
    return tuple(text for text in key if text[:1].isdecimal())


def split_repeat(tokens: Sequence[Token]) -> tuple[tuple[Token, ...], tuple[Token, ...]]:
    """Split off the end of a name that says which of several presses of one specimen this is: "run 2", "press 1", "ball 5mm".

    A number alone says no such thing: "A 2" may be another specimen. Neither does one that follows the word for the machine at
    the beginning ("press 2"), as nothing would be left of the name.

    >>> [[t.text for t in part] for part in split_repeat(tokens_of("s1_press_2", "force"))]
    [['s', '1'], ['press', '2']]
    >>> [[t.text for t in part] for part in split_repeat(tokens_of("s1 5mm ball", "force"))]
    [['s', '1'], ['5', 'mm', 'ball']]
    >>> [[t.text for t in part] for part in split_repeat(tokens_of("s1_R2.5mm_F", "force"))]
    [['s', '1'], ['r', '2.5', 'mm', 'f']]
    """
    own = tuple(tokens)
    first_ones = _size_at(own, 0, own[_SIZE:])
    if first_ones and key_of(own[first_ones:]):
        return own[first_ones:], own[:first_ones]
    for i in range(1, len(own)):
        size = _size_at(own, i, own[:i])
        if size and key_of(own[:i]) and _says_no_more(own[i + size :]):
            return own[:i], own[i:]
        word, rest = own[i], own[i + 1 :]
        told = [t for t in rest if t.role in ("word", "number")]
        counted = word.role in ("force", "capacitance") or bool(_REPEAT.fullmatch(word.text))
        counted = counted and [t.role for t in told] == ["number"]
        ball = _BALL.fullmatch(word.text) and any(t.role == "number" for t in told)
        first = i
        if _BALL.fullmatch(word.text) and not told:  # "5mm ball"
            first -= 1 + (own[i - 1].text == "mm")
            ball = first > 0 and own[first].role == "number"
        if (counted or ball) and key_of(own[:first]):
            return own[:first], own[first:]
    return own, ()


# Tokens of the size of a ball at most: "r 2.5 mm".
_SIZE = 3
# What stands for the rest of a name that has the number of a specimen.
_NUMBERED = Token("1", "number", 0, 0)


def _size_at(own: Sequence[Token], i: int, rest: Sequence[Token]) -> int:
    """How many tokens from one on are the radius or the diameter of a ball, beside the rest of a name; 0 if they are none."""
    if i + 1 >= len(own) or own[i + 1].role != "number" or own[i].role != "word":
        return 0
    word, in_mm = own[i].text, i + 2 < len(own) and own[i + 2].text == "mm"
    numbered = any(t.role == "number" for t in rest)
    said = len(word) > 1 or in_mm or (word == "r" and numbered)
    return 2 + in_mm if said and (_RADIUS.fullmatch(word) or _DIAMETER.fullmatch(word)) else 0


def _says_no_more(rest: Sequence[Token]) -> bool:
    """Whether what follows the size of a ball are words for instruments, or the number of a press: no other specimen."""
    told = [t for t in rest if t.role in ("word", "number")]
    if told and told[0].role == "word" and _REPEAT.fullmatch(told[0].text):
        told = told[1:]
    elif told and not any(t.role in ("force", "capacitance") for t in rest):
        return False
    return [t.role for t in told] in ([], ["number"])


def is_ball(repeat: Sequence[Token]) -> bool:
    """Whether the end of a name speaks of a ball, so that presses may differ in it."""
    return any(_BALL.fullmatch(t.text) for t in repeat) or bool(repeat and _sized(repeat))


def _sized(repeat: Sequence[Token]) -> int:
    return _size_at(repeat, 0, (_NUMBERED,))


def radius_in_name(repeat: Sequence[Token]) -> str:
    """The radius of the ball [mm] that the end of a name tells: "2.5" of "R2.5mm", "5" of "r5" and "dia 10"; "" if none.

    >>> radius_in_name(split_repeat(tokens_of("s1_r8_force", "force"))[1]), radius_in_name(tokens_of("ball 5mm", ""))
    ('8', '')
    """
    if not (repeat and _sized(repeat)):
        return ""
    half = 1.0 if _RADIUS.fullmatch(repeat[0].text) else 0.5
    return f"{half * float(repeat[1].text):g}"


def ball_in_name(tokens: Sequence[Token]) -> tuple[Token, ...]:
    """The part of a name that is, or may be, the size of a ball, wherever it stands; () if there is none.

    Parameters
    ----------
    tokens : of the name.

    >>> [[t.text for t in ball_in_name(tokens_of(name, "force"))] for name in ("sensor r5 press", "5 mm ball s1", "s1 d 3")]
    [['r', '5'], ['5', 'mm', 'ball'], []]
    """
    own = tuple(tokens)
    for i, token in enumerate(own):
        if _RADIUS.fullmatch(token.text) or _DIAMETER.fullmatch(token.text):
            size = _size_at(own, i, (_NUMBERED,))
            if size:
                return own[i : i + size]
        if _BALL.fullmatch(token.text):
            in_mm = i > 1 and own[i - 1].text == "mm"
            if i + 1 < len(own) and own[i + 1].role == "number" and not in_mm:
                return own[i : i + 2 + (i + 2 < len(own) and own[i + 2].text == "mm")]
            if i > in_mm and own[i - 1 - in_mm].role == "number":
                return own[i - 1 - in_mm : i + 1]
    return ()


def counts_presses(repeats: Sequence[Sequence[Token]]) -> bool:
    """Whether ends of names such as "r1", "r2", "r3" count presses rather than name balls: from 1 on, no gap, no unit."""
    told = [[t.text for t in repeat if t.role in ("word", "number")] for repeat in repeats]
    numbers = sorted(int(t[1]) for t in told if len(t) == 2 and t[0] == "r" and t[1].isdecimal())
    return numbers == list(range(1, len(repeats) + 1))


def shown(title: str, tokens: Iterable[Token], *, instruments: bool = False) -> str:
    """Write the part of a name that some of its tokens make up, as it is spelled in it.

    Parameters
    ----------
    title : the name.
    tokens : of it; what lies between them goes with them, other words do not.
    instruments : whether words for instruments, and such that say nothing, are kept.

    >>> shown("S7_1-hioki", tokens_of("S7_1-hioki", "capacitance"))
    'S7_1'
    """
    kept = [t for t in tokens if instruments or t.role in ("word", "number", "stamp")]
    text = ""
    for before, token in zip([None, *kept], kept, strict=False):
        between = "" if before is None else title[before.end : token.start]
        text += (between if not re.search(r"\w", between.replace("_", "")) else " ") + title[token.start : token.end]
    text = re.sub(r"[\[\](),\x00-\x1f\x7f]+", " ", text)  # what the name of a specimen may not hold
    return re.sub(r"[ _-]*\s[ _-]*", " ", text).strip(" _-")
