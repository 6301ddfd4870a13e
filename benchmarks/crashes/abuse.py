"""The number of an oddity (a name, a file, a folder, an environment) in, what a command makes of it out."""

from __future__ import annotations

import os
import re
from pathlib import Path

from crashes.case import Case, failed, with_verdict
from crashes.command import draw, start
from crashes.lab import Lab, difference, finished_copy
from crashes.oddities import ODDITIES
from crashes.oddity import both, memory

#: What is refused has to be refused within 2 s; a loaded machine gets this long [s].
QUICK = 15.0
_LIMIT = 90.0
_CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


def size(lab: Lab, asked: int) -> int:
    """All there are, or as many as asked for if that is less."""
    return min(asked, len(ODDITIES)) if asked else len(ODDITIES)


def case(lab: Lab, number: int) -> Case:
    """Meet one oddity.

    Parameters
    ----------
    lab : where.
    number : its place in the list.

    Returns
    -------
    What came of it.
    """
    odd = ODDITIES[number]
    place = lab.fresh(f"abuse-{number}")
    if odd.finished:
        finished_copy(lab.reference(recommended=True), place)
    odd.prepare(place)
    there = _listing(place)
    done = Case("abuse", number, odd.name)
    before = both(memory, draw, odd.before)
    ended = start(odd.words, place, lab.log, cold=odd.cold, before=before, environment=odd.environment).wait(_LIMIT)
    place.chmod(0o755)
    if ended.code not in odd.codes or ended.hung or "Traceback" in ended.text:
        return with_verdict(done, ended.crashed or "wrong", f"[{ended.code}], not one of {odd.codes}: {ended.last}")
    if ended.code == 2 and (bad := failed(done, ended, odd.names)):
        return bad
    if reaching := _CONTROL.search(ended.said + ended.complained):
        return with_verdict(done, "wrong", f"{reaching[0]!r} reaches the terminal")
    if "Warning: " in ended.text and ".py:" in ended.text:
        return with_verdict(done, "bad refusal", f"a warning for developers: {ended.last}")
    if ended.code == 2 and (new := sorted(_listing(place) - there)):
        return with_verdict(done, "bad refusal", f"refused, but wrote {', '.join(new[:3])}: {ended.last}")
    if odd.refused and ended.seconds > QUICK:
        return with_verdict(done, "hang", f"refused after {ended.seconds:.0f} s: {ended.last}")
    if ended.code == 2 and not ended.text.strip():
        return with_verdict(done, "bad refusal", "without a word")
    if odd.same and ended.code == 2:
        return with_verdict(done, "bad refusal", ended.last)
    if odd.same and (other := difference(place / odd.output, lab.reference())):
        return with_verdict(done, "wrong", other)
    page = place / odd.output / "report.html"
    if os.path.isfile(page) and "<script>alert" in page.read_text(encoding="utf-8"):
        return with_verdict(done, "wrong", "a name is markup of the page")
    return with_verdict(done, "right", f"[{ended.code}] in {ended.seconds:.1f} s: {ended.last[:120]}")


def _listing(place: Path) -> set[str]:
    return {os.fsencode(str(p.relative_to(place))).decode("utf-8", "replace") for p in place.rglob("*")}
