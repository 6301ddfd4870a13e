"""A pause in, what comes of several commands on one run folder that far apart out: one owner, the others refused."""

from __future__ import annotations

import json
import random
import re
import time

from crashes.case import Case, with_verdict
from crashes.command import Ended, run, start
from crashes.lab import RECOMMEND, Lab, blocks, difference, finished_copy, summary

SEEDS = (5, 6)


def size(lab: Lab, asked: int) -> int:
    """As many as asked for."""
    return asked


def case(lab: Lab, number: int) -> Case:
    """Start several commands on one folder; every fourth case on a finished run, every eighth on one that was killed.

    Parameters
    ----------
    lab : where.
    number : decides the pauses and the seeds.

    Returns
    -------
    What came of it.
    """
    rng = random.Random(number)
    if number % 4 == 3:
        return _at_once(lab, number, rng)
    pause = rng.choice((0.0, rng.uniform(0, 0.1), rng.uniform(0, 1)))
    return _two_starts(lab, number, rng, pause, killed=number % 8 == 6)


def _two_starts(lab: Lab, number: int, rng: random.Random, pause: float, *, killed: bool) -> Case:
    place = lab.fresh(f"doubles-{number}")
    order = rng.sample(SEEDS, 2)
    more: tuple[str, ...] = ()
    if killed:  # two that go on with the same run
        order = [SEEDS[0], SEEDS[0]]
        first = start(lab.calibrate(seed=order[0]), place, lab.log, cold=lab.cold)
        while not blocks(place / "RUN") and first.poll() is None:
            time.sleep(0.01)
        first.kill()
        first.wait()
        more = ("--resume",)
    what = f"{'two resumptions' if killed else f'starts with seeds {order}'} {pause:.3f} s apart"
    running = [start((*lab.calibrate(seed=order[0]), *more), place, lab.log, cold=lab.cold)]
    time.sleep(pause)
    running.append(start((*lab.calibrate(seed=order[1]), *more), place, lab.log, cold=lab.cold))
    ended = [r.wait() for r in running]
    done = Case("doubles", number, what, note=f"exit codes {[e.code for e in ended]}")
    if bad := _bad(done, ended):
        return bad
    won = [i for i, e in enumerate(ended) if e.code in (0, 3)]
    if not won:
        return with_verdict(done, "bad refusal", f"none of them won: {ended[0].last} / {ended[1].last}")
    if len(won) == 2 and not killed:
        return with_verdict(done, "wrong", "both won")
    seed = order[won[-1]]
    said = json.loads((place / "RUN" / "summary.json").read_text())["seed"]
    if other := difference(place / "RUN", lab.reference(seed)):
        return with_verdict(done, "wrong", f"not the run of seed {seed} (summary.json says {said}): {other}")
    return with_verdict(done, "right", f"seed {seed} won")


def _bad(done: Case, ended: list[Ended]) -> Case | None:
    """The case as failed if one of several crashed, or was refused without a word on the folder."""
    for e in ended:
        if e.crashed:
            return with_verdict(done, e.crashed, f"[{e.code}] {e.last}")
        if e.code == 2 and "RUN" not in e.text:
            return with_verdict(done, "bad refusal", f"does not name the folder: {e.last}")
    return None


def _at_once(lab: Lab, number: int, rng: random.Random) -> Case:
    """Go on with, recommend from and report on a finished run, all at once."""
    place = lab.fresh(f"doubles-{number}")
    reference = lab.reference(recommended=True)
    finished_copy(reference, place)
    jobs = [
        (*lab.calibrate(), "--resume"),
        ("recommend", "RUN", *RECOMMEND),
        ("report", "RUN"),
        ("recommend", "RUN", *RECOMMEND),
    ]
    rng.shuffle(jobs)
    pauses = [rng.choice((0.0, rng.uniform(0, 0.3))) for _ in jobs]
    running = []
    for words, pause in zip(jobs, pauses, strict=True):
        time.sleep(pause)
        running.append(start(words, place, lab.log, cold=lab.cold))
    ended = [r.wait() for r in running]
    names = [f"{words[0]} [{e.code}]" for words, e in zip(jobs, ended, strict=True)]
    done = Case("doubles", number, f"{', '.join(names)} at once")
    if bad := _bad(done, ended):
        return bad
    if all(e.code == 2 for e in ended):
        return with_verdict(done, "bad refusal", f"none of them won: {ended[0].last}")
    if other := difference(place / "RUN", reference):
        return with_verdict(done, "wrong", other)
    after = run(("report", "RUN"), place, lab.log, cold=lab.cold)
    if after.code not in (0, 3):
        return with_verdict(done, after.crashed or "lost work", f"report afterwards: [{after.code}] {after.last}")
    if lab.verifies and (checked := run(("verify", "RUN"), place, lab.log, cold=lab.cold)).code != 0:
        return with_verdict(done, checked.crashed or "wrong", f"verify afterwards: [{checked.code}] {checked.last}")
    recommendation = place / "RUN" / "recommendation.json"
    if recommendation.exists() and summary(recommendation) != summary(reference / "recommendation.json"):
        return with_verdict(done, "wrong", "another recommendation")
    left = [p.name for p in (place / "RUN").rglob("*") if re.search(r"\.(part|tmp)", p.name)]
    return with_verdict(done, "bad refusal", f"left over: {left}") if left else done
