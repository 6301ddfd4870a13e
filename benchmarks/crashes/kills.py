"""A moment in, what comes of a calibration that is killed then (the process alone, or its group) and gone on with out."""

from __future__ import annotations

import random
import time

from crashes.case import Case, recovered, with_verdict
from crashes.command import alive, start
from crashes.lab import Lab

#: Workers of a killed calibration have to be gone after this long [s].
_GONE = 10.0


def size(lab: Lab, asked: int) -> int:
    """As many as asked for."""
    return asked


def case(lab: Lab, number: int) -> Case:
    """Kill a calibration once to three times at random, then go on.

    Parameters
    ----------
    lab : where.
    number : decides the moments, and whether the process or its group is killed.

    Returns
    -------
    What came of it.
    """
    rng = random.Random(number)
    group, times = rng.random() < 0.5, rng.choice((1, 1, 2, 3))
    processes = rng.choice((0, 0, 0, 2)) if lab.cold else 0
    place = lab.fresh(f"kills-{number}")
    moments = []
    for index in range(times):
        moment = rng.uniform(0, lab.length() * (1 if index == 0 else 0.5))
        more = ("--resume",) if (place / "RUN").exists() else ()
        running = start((*lab.calibrate(processes=processes), *more), place, lab.log, cold=lab.cold)
        time.sleep(moment)
        if (code := running.poll()) is not None and index == 0:  # it was done, or refused, before
            return case_of_earlier(lab, number, moment, code)
        if code is None:
            running.kill(group=group)
            running.wait()
            moments.append(f"{moment:.2f} s")
        if not group:
            begun = time.monotonic()
            while (left := alive(running.pid)) and time.monotonic() - begun < _GONE:
                time.sleep(0.05)
            if left:
                done = Case("kills", number, f"{' '.join(moments)}, process alone")
                return with_verdict(done, "hang", f"{len(left)} workers are there {_GONE:.0f} s after")
    what = f"SIGKILL at {', '.join(moments)} to {'the group' if group else 'the process alone'}, {processes} workers"
    return recovered(Case("kills", number, what), lab, place)


def case_of_earlier(lab: Lab, number: int, moment: float, code: int) -> Case:
    """A calibration that had ended before its kill, as the machine was faster than when it was timed: kill one earlier."""
    place = lab.fresh(f"kills-{number}")
    running = start(lab.calibrate(), place, lab.log, cold=lab.cold)
    time.sleep(moment * random.Random(number).uniform(0.1, 0.6))
    killed = running.poll() is None
    if killed:
        running.kill()
        running.wait()
    what = f"SIGKILL earlier than {moment:.2f} s" if killed else f"not killed: ended with {code} before"
    return recovered(Case("kills", number, what), lab, place)
