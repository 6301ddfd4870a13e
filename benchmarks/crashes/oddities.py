"""Nothing in, the list of oddities that a calibration may meet out."""

from __future__ import annotations

import os
from dataclasses import replace

from crashes.lab import RECOMMEND
from crashes.oddity import (
    CALIBRATE,
    Oddity,
    at,
    backwards,
    both,
    broken_pipe,
    closed,
    everybody,
    experiment_file,
    few_files,
    folder,
    folder_of_others,
    full,
    lab_file,
    link,
    named,
    no_locks,
    nobody,
    of_text,
    read_only,
    to,
    umask,
)

_NAMES = {
    "half a formula": r"a $x^$ b $\\frac{$",
    "NUL": r"a\u0000b",
    "escape sequences": r"a\u001b[31mred\u001b]0;title\u0007",
    "C1 control": r"a\u009b31mred",
    "markup": r"<script>alert(1)</script>&amp;",
    "a formula of cells": r"=1+1|cmd",
    "300 characters": "a" * 300,
    "a path": r"../../etc/passwd",
    "a newline": r"a\nb",
    "right to left": r"a\u202eb\u200f",
    "emoji": "\U0001f9ea\U0001f469\u200d\U0001f52c",
    "blanks": "   ",
    "nothing": "",
    "brackets of rich": "[bold red]a[/bold] [link=file:///]",
    "brackets": "a[b]",
    "braces": "{{ 7 * 7 }} %s %(x)s {0}",
}
_HEAD = 'name = "a"\n[indenter]\nradius = "5 mm"\n[sensor]\nradius = "10 mm"\n'
_ZEROS = "Time (s),Extension (mm),Load (N)\n" + "".join(f"{i},{i / 100},0\n" for i in range(500))
_SPECIMEN = '[[specimens]]\nname = "a"\nforce = "press.csv"\n'
_PIPE = (0, 1, 2, 3, 141, -13)


def _refused(*found: Oddity) -> tuple[Oddity, ...]:
    """Oddities that have to be refused, and soon."""
    return tuple(replace(odd, codes=(2,), refused=True) for odd in found)


def _finished(*found: Oddity) -> tuple[Oddity, ...]:
    """Oddities on a folder with a finished run."""
    return tuple(replace(odd, finished=True) for odd in found)


_OF_NAMES = tuple(Oddity(f"a name is {what}", prepare=named(name)) for what, name in _NAMES.items())
_OF_LAB_FILES = tuple(
    Oddity(f"lab file is {what}", prepare=lab_file(make), names=("press.csv", "experiment.toml"))
    for what, make in (
        ("a FIFO", os.mkfifo),
        ("/dev/zero", link("/dev/zero")),
        ("/dev/null", link("/dev/null")),
        ("a folder", folder),
        ("a link to itself", link("press.csv")),
        ("a force of zeros", of_text(_ZEROS)),
    )
)
_OF_EXPERIMENTS = tuple(
    Oddity(f"experiment is {what}", prepare=experiment_file(make), names=("experiment.toml",))
    for what, make in (
        ("a FIFO", os.mkfifo),
        ("/dev/zero", link("/dev/zero")),
        ("a folder", folder),
        ("a link to nowhere", link("nowhere")),
        ("empty", of_text("")),
        ("zeros", of_text("\0" * 5000)),
        ("an integer of 5,000 digits", of_text(f"{_HEAD}x = {'9' * 5000}\n")),
        ("a number of 1e400", of_text(f"{_HEAD}x = 1e400\n")),
        ("a quantity of 5,000 digits", of_text(f'{_HEAD}dielectric_thickness = "{"9" * 5000} mm"\n{_SPECIMEN}')),
        ("50,000 keys", of_text(_HEAD + "".join(f"x{i} = 1\n" for i in range(50000)))),
        ("50,000 specimens", of_text(_HEAD + _SPECIMEN * 50000)),
        ("5,000 brackets", of_text(f"{_HEAD}x = {'[' * 5000}{']' * 5000}\n")),
        ("a key of 5,000 points", of_text(f"{_HEAD}{'.'.join(['x'] * 5000)} = 1\n")),
    )
)
_OF_FOLDERS = (
    *_refused(
        Oddity("RUN is a file", to("RUN.txt"), at("RUN.txt", of_text("mine")), names=("RUN.txt",)),
        Oddity("RUN is a link to itself", prepare=at("RUN", link("RUN")), names=("RUN",)),
        Oddity("RUN is a folder of other things", prepare=at("RUN", folder_of_others), names=("RUN",)),
        Oddity("RUN is in a folder that is not there", to("no/such/folder/RUN"), names=("no/such/folder",)),
        Oddity("RUN is below a file", to("press.csv/RUN"), names=("press.csv",)),
        Oddity("RUN is .", to(".")),
        Oddity("RUN is /", to("/")),
        Oddity("RUN is /dev/null", to("/dev/null"), names=("/dev/null",)),
        Oddity("RUN is in /proc", to("/proc/RUN"), names=("/proc",)),
        Oddity("RUN has 300 characters", to("R" * 300), output="R" * 300, names=("RRRR",)),
    ),
    Oddity("RUN is a link to nowhere", prepare=at("RUN", link("nowhere")), names=("RUN",)),
    Oddity("RUN is an empty folder", prepare=at("RUN", folder), names=("RUN",)),
    Oddity("RUN begins with a hyphen", to("-x"), output="-x"),
    Oddity("RUN has a newline", to("a\nb"), output="a\nb"),
    Oddity("RUN has an escape sequence", to("\x1b[31mRUN"), output="\x1b[31mRUN"),
    Oddity("RUN is not UTF-8", to(os.fsdecode(b"R\xffN")), output=os.fsdecode(b"R\xffN")),
    *(
        Oddity(f"RUN is {name}", to(name), output=name, same=True)
        for name in ("a b 'c' \"d\" $(touch pwned) `e` \\", "[red]RUN[bold]", "Größe 压力")
    ),
)
_OF_USERS = (
    *_refused(Oddity("folder is read-only", prepare=both(everybody, read_only), before=nobody, names=("RUN",))),
    Oddity("another user", prepare=everybody, before=nobody, same=True),
    *_finished(
        *(
            Oddity(f"{words[0]} of a run of root's by another user", words, everybody, nobody, codes=(2,), names=("RUN",))
            for words in ((*CALIBRATE, "--resume"), ("recommend", "RUN", *RECOMMEND), ("report", "RUN"))
        )
    ),
)
_OF_SURROUNDINGS = (
    Oddity("no HOME", environment={"HOME": None, "XDG_CONFIG_HOME": None, "MPLCONFIGDIR": None}, same=True),
    Oddity("TMPDIR is not there", environment={"TMPDIR": "/nonexistent"}, same=True),
    Oddity("TZ is odd", environment={"TZ": "Mars/Olympus+99:99"}, same=True),
    Oddity("no TERM", environment={"TERM": None}, same=True),
    Oddity("10 columns", environment={"COLUMNS": "10", "LINES": "1"}, same=True),
    Oddity("a clock that runs backwards", before=backwards, same=True),
    Oddity("umask 077", before=umask(0o077), same=True),
    Oddity("stdin is closed", before=closed(0), same=True),
    Oddity("24 open files", before=few_files, names=("RUN", "experiment", "press", "open files")),
    Oddity("no locks on this disk", before=no_locks, names=("RUN",)),
    Oddity("stdout is a closed pipe", before=broken_pipe, codes=_PIPE),
    Oddity("stdout is closed", before=closed(1)),
    Oddity("stdout and stderr are closed", before=both(closed(1), closed(2))),
    Oddity("stdout is full", before=full("/dev/full"), codes=(1,), names=("standard output",)),
    Oddity("unknowns to a closed pipe", ("unknowns",), before=broken_pipe, codes=_PIPE),
    *_finished(
        Oddity("report to a closed pipe", ("report", "RUN"), before=broken_pipe, codes=_PIPE),
        Oddity("HOME is not there", ("report", "RUN"), environment={"HOME": "/nonexistent"}, cold=True, codes=(0, 3)),
        *(
            Oddity(what, ("recommend", "RUN", *RECOMMEND), environment={"LC_ALL": "C", **more}, cold=True, codes=(0, 3))
            for what, more in (
                ("LC_ALL=C", {"PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}),
                ("output in ASCII", {"PYTHONIOENCODING": "ascii"}),
            )
        ),
    ),
)
_OF_OPTIONS = (
    Oddity("no budget", (*CALIBRATE, "--budget", "0"), codes=(2, 3)),
    Oddity("a budget of a tenth of a second", (*CALIBRATE, "--budget", "0.0017"), codes=(2, 3)),
    Oddity("a budget of infinity", (*CALIBRATE, "--budget", "inf")),
    Oddity("a seed of 2^70", (*CALIBRATE[:5], str(2**70), *CALIBRATE[6:])),
    *_refused(
        Oddity("a budget of nan", (*CALIBRATE, "--budget", "nan")),
        Oddity("surrogate is not there", (*CALIBRATE, "--surrogate", "none.npz"), names=("none.npz",)),
        Oddity("surrogate is /dev/zero", (*CALIBRATE, "--surrogate", "/dev/zero"), names=("/dev/zero",)),
        Oddity("surrogate is a folder", (*CALIBRATE, "--surrogate", ".")),
        Oddity("surrogate is a FIFO", (*CALIBRATE, "--surrogate", "fifo"), at("fifo", os.mkfifo), names=("fifo",)),
        Oddity("surrogate is the lab file", (*CALIBRATE, "--surrogate", "press.csv"), names=("press.csv",)),
        *(
            Oddity(f"{command} of {what}", (command, name, *more), names=(name,))
            for command, more in (("report", ()), ("recommend", RECOMMEND), ("compare", ("press.csv",)))
            for what, name in (("nothing", "none"), ("a file", "press.csv"), ("a folder without a run", "."))
        ),
        *_finished(
            *(
                Oddity(f"a force of {force[:9]!r}", ("recommend", "RUN", "--force", force))
                for force in ("0 N", "-1 N", "nan N", "1e400 N", "1e300 N", "5 mm", "9" * 5000 + " N", "")
            )
        ),
    ),
)
ODDITIES: tuple[Oddity, ...] = (
    *_OF_NAMES,
    *_refused(*_OF_LAB_FILES, *_OF_EXPERIMENTS),
    *_OF_FOLDERS,
    *(_OF_USERS if os.geteuid() == 0 else ()),
    *_OF_SURROUNDINGS,
    *_OF_OPTIONS,
)
