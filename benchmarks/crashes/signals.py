"""A moment in, what comes of a calibration that is stopped then by SIGINT or SIGTERM, and of the advice that it prints, out."""

from __future__ import annotations

import random
import re
import shlex
import signal
import time
from dataclasses import replace

from crashes.case import Case, recovered, with_verdict
from crashes.command import run, start
from crashes.lab import Lab, difference

#: What the page promises [s], and what a loaded machine is allowed.
PROMISED, ALLOWED = 2.0, 10.0
OUTPUT = "the run's folder"


def size(lab: Lab, asked: int) -> int:
    """As many as asked for."""
    return asked


def case(lab: Lab, number: int) -> Case:
    """Stop a calibration, do what it advises, and compare.

    Parameters
    ----------
    lab : where.
    number : decides the signal and the moment.

    Returns
    -------
    What came of it; its seconds are those from the signal to the end.
    """
    rng = random.Random(number)
    which = rng.choice((signal.SIGINT, signal.SIGTERM))
    group = rng.random() < 0.5
    place = lab.fresh(f"signals-{number}")
    words = lab.calibrate(output=OUTPUT)
    moment = rng.uniform(0.0 if not lab.cold else 1.0, lab.length())
    running = start(words, place, lab.log, cold=lab.cold)
    time.sleep(moment)
    begun = time.monotonic()
    what = f"{which.name} at {moment:.2f} s to {'the group' if group else 'the process alone'}"
    if running.poll() is not None or not running.kill(which, group=group):
        running.wait()
        return Case("signals", number, what, note="not stopped: it had ended before")
    ended = running.wait(moment + 60.0)
    seconds = time.monotonic() - begun
    done = Case("signals", number, what, note=f"[{ended.code}] after {seconds:.1f} s", seconds=seconds)
    if ended.crashed and not (
        ended.code == -which and not (place / OUTPUT).exists()
    ):  # before it began there is nothing to say
        return with_verdict(done, ended.crashed, ended.last)
    if seconds > ALLOWED:
        return with_verdict(done, "hang", f"more than {ALLOWED:.0f} s: {ended.last}")
    words_advised = advised(ended.text)
    if ended.code not in (0, 3) and (place / OUTPUT).exists():
        if not words_advised:
            return with_verdict(done, "bad refusal", f"no command to go on with: {ended.last}")
        again = run(words_advised, place, lab.log, cold=lab.cold)
        if again.code not in (0, 3):
            return with_verdict(done, again.crashed or "bad refusal", f"what it advised: [{again.code}] {again.last}")
        if other := difference(place / OUTPUT, lab.reference()):
            return with_verdict(done, "wrong", other)
        return with_verdict(done, "right", "went on as advised")
    verdict = recovered(done, lab, place, output=OUTPUT)
    return replace(verdict, seconds=seconds)


def advised(text: str) -> list[str]:
    """The command that a message advises, as a shell would read it; nothing if it advises none."""
    for line in text.splitlines():
        if (found := re.search(r"\bcalib calibrate .*--resume.*", line.strip(" │"))) is not None:
            try:
                return shlex.split(found[0])[1:]
            except ValueError:
                return []
    return []
