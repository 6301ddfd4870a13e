"""What a line of words between rows says: nothing of them, that another specimen follows, or that the rig was changed."""

from __future__ import annotations

import re

from calib.lab.instruments.lexicon import OF_TESTERS, TURNS
from calib.lab.instruments.lines import is_comment

#: Words by which a line or a name speaks of a specimen.
SPECIMEN = re.compile(
    r"specimen|sample|test ?piece|probe\b|prüfling|prüfkörper|éprouvette|échantillon|probeta|muestra|试样|試験片|サンプル", re.I
)
# "Status: Running" among the rows, as testers write it.
_STATUS = re.compile(
    r"[\W_]*(?:test |machine )?(?:status|state|zustand|statut|état|estado|stato|stan)\s*[:=]\s*(?P<words>[^\d,;\t]+)", re.I
)
# "--- unloading ---".
_BETWEEN_DASHES = re.compile(r"[-=*~#>]{2,}\s*(?P<words>[^\W\d_][^\d,;\t]*?)\s*[-=*~#<]*")
# "Page 2 of 3", as a program writes it that prints a table.
_PAGE = re.compile(
    r"[-=*~\s]*(?:page|seite|página|pagina|pág\.?|strona|sida|side|страница|стр\.?|第)\s*\d+\s*"
    r"(?:(?:of|von|de|di|sur|z|av|из|/)\s*\d+|页|頁|ページ)?[-=*~\s]*",
    re.IGNORECASE,
)
# The same at the end of a line that stands on every page.
NUMBER_OF_PAGE = re.compile(rf"(?<![^\W_]){_PAGE.pattern}$", re.IGNORECASE)
# A line that numbers or names a run, of another ball or specimen for all that it says.
RUN = re.compile(
    r"(?<![^\W_])(?:run|test|trial|experiment|versuch|messung|muster|serie|series|batch|essai|mesure|ensayo|prova|próba|pomiar|"
    r"опыт|образец|测试|试验|測定|試験)\s*(?:no\.?|nr\.?|#|:)?\s*(?:\d+|[a-z])(?![^\W_])",
    re.IGNORECASE,
)
# A line that is nothing but a name with a number: "# S2", "# sensor B7", "File: press_02.csv".
_NAME_ALONE = re.compile(
    r"[#%/;*\s\"']*(?:[a-z]{1,3}[ _-]?\d{1,3}|(?:sensors?|capteur|balls?|kugel|electrode|elektrode|spot|pad|taxel|channel)"
    r"\s*(?:no\.?|nr\.?|#|:|=)?\s*[a-z]{0,3}[ _-]?\d{1,3}|(?:file|filename|datei|fichier|archivo)\s*[:=]\s*\S.*)[\s,;\"'=-]*",
    re.IGNORECASE,
)
# So much of a remark is looked at.
_LONGEST_REMARK = 200


def is_remark(line: str) -> bool:
    """Whether a line of text among the rows changes nothing of them.

    Such are a comment that names no specimen or run, a tester's status, what it does between dashes, a word alone
    that the ball turns or waits, and the number of a page.
    """
    plain = line.strip().strip(",;\t")
    if plain.strip(' "').lower() in TURNS:
        return True
    status = _STATUS.fullmatch(plain) or _BETWEEN_DASHES.fullmatch(plain)
    if status is not None:
        return all(w in OF_TESTERS for w in re.split(r"[\W_]+", status["words"].lower()) if w)
    return _PAGE.fullmatch(plain) is not None or (is_comment(line) and not names_another(line) and not changes_the_rig(line))


def names_another(line: str) -> bool:
    """Whether a line may name another specimen, sensor, file or run."""
    return bool(SPECIMEN.search(line) or RUN.search(line) or _NAME_ALONE.fullmatch(line[:_LONGEST_REMARK]))


# What was changed for another, in either order of the words.
_CHANGED = (
    r"new|changed?|another|other|next|different|replaced|exchanged|swapped|neue[rsmn]?|andere[rsmn]?|nächste[rsmn]?|"
    r"gewechselt|getauscht|ausgetauscht|nouve(?:au|lle)|autre|chang[ée]e?|remplacée?|nuev[oa]|otr[oa]|cambiad[oa]|cambio de|"
    r"reemplazad[oa]|nuov[oa]|altr[oa]|cambiat[oa]|sostituit[oa]|nov[oa]|outr[oa]|trocad[oa]|nieuwe?|vervangen|nowy|nowa|inn[ay]"
)
_OF_RIG = (
    r"specimens?|samples?|test ?pieces?|sensors?|balls?|indenters?|tips?|probe[ns]?|prüfling|prüfkörper|kugel|stempel|"
    r"eindringkörper|éprouvette|échantillon|capteur|bille|poinçon|probeta|muestra|bola|punta|provino|campione|sfera|"
    r"amostra|esfera|monster|kogel|próbka|kulka|electrodes?|elektroden?|électrodes?|electrodos?|elettrod[oi]|"
    r"press(?:es)?|spots?|stelle"
)
_CHANGE_OF_RIG = re.compile(
    rf"(?<![^\W_])(?:(?:{_CHANGED})(?:\W+\w+)?\W+(?:{_OF_RIG})|(?:{_OF_RIG})\W+(?:\w+\W+)?(?:{_CHANGED}))(?![^\W_])"
    r"|(?:新|换|換|更换|交換|別の).{0,3}(?:试样|試験片|サンプル|样品|球|传感器|センサ)"
    rf"|(?<![^\W_])(?:moved|shifted|verschoben|déplacée?|movid[oa]|spostat[oa])(?:\W+\w+)?\W+(?:{_OF_RIG})(?![^\W_])"
    rf"|(?<![^\W_])(?:{_OF_RIG})(?![^\W_])[^.;]{{0,20}}(?:->|→|=>)",
    re.IGNORECASE,
)


def changes_the_rig(text: str) -> bool:
    """Whether words say that another specimen, sensor or ball was put in.

    Parameters
    ----------
    text : of a line or a cell.

    >>> [changes_the_rig(words) for words in ("# changed sample", "new ball 8 mm", "neue Probe", "sample touched", "hold")]
    [True, True, True, False, False]
    """
    return _CHANGE_OF_RIG.search(text[:_LONGEST_REMARK]) is not None
