"""An installation in, what of it works out: each part with what was found, and what to do where it does not."""

from __future__ import annotations

import csv
import hashlib
import importlib
import math
import os
import platform
import shutil
import tempfile
from base64 import urlsafe_b64encode
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from packaging.requirements import Requirement

from calib.errors import InputError
from calib.files import require_folder
from calib.provenance import PROGRAM
from calib.report import BROWSERS, find_browser
from calib.runs.ownership import owned

if TYPE_CHECKING:
    from models.response import Forward

#: Works; is not there, and not needed for a calibration; does not work.
Health = Literal["fine", "missing", "broken"]

#: Free disk that a calibration with its checkpoint, report and figures is sure to fit into [bytes].
ROOM = 500_000_000

# Force [N] and capacitance change of the paper's sensor at a depth of 0.62 mm by an independent finite-element code, the third
# of the golden numbers in tests/models/fem/test_fem.py, and how near both models come to it there.
_DEPTH, _FORCE, _CHANGE = 0.62e-3, 5.9289927, 1.6862055e-2
_NEAR = {"force": (_FORCE, 5e-3), "capacitance change": (_CHANGE, 1.5e-2)}

# Extras for who works on the project itself.
_OF_DEVELOPERS = ("test", "benchmark")
_ANEW = f"pip install --force-reinstall {PROGRAM}"


@dataclass(frozen=True)
class Examined:
    """One part of an installation: its name, whether it works, what was found, and what to do if it does not."""

    name: str
    health: Health
    finding: str
    action: str = ""


def examine(folder: Path | str = ".", told: Callable[[Examined], None] = lambda found: None) -> tuple[Examined, ...]:
    """Look at what a calibration needs of this installation and of a folder, a few seconds long; nothing of it stays there.

    Parameters
    ----------
    folder : where lab files and runs are to lie.
    told : called with each finding as soon as it is there.
    """
    found = []
    for part in (_python, _places, _packages, _files, _surrogates, _forward_models, _extras, _browser, _machine):
        for one in _examined(part, Path(folder)):
            told(one)
            found.append(one)
    return tuple(found)


def _examined(part: Callable[[Path], Iterator[Examined]], folder: Path) -> Iterator[Examined]:
    """What one part says; if it ends with an error, as it may where an installation is broken, that."""
    try:
        yield from part(folder)
    except Exception as error:
        name = part.__name__.removeprefix("_").replace("_", " ")
        yield Examined(name, "broken", f"{type(error).__name__}: {error}", _ANEW)


def _python(_: Path) -> Iterator[Examined]:
    yield Examined("Python", "fine", f"{platform.python_version()} on {platform.platform(terse=True)}")


def _requirements() -> list[Requirement]:
    return [Requirement(line) for line in metadata.requires(PROGRAM) or ()]


def _wanting(requirement: Requirement) -> str:
    """Why a requirement is not met, in words; empty if it is."""
    try:
        version = metadata.version(requirement.name)
    except metadata.PackageNotFoundError:
        return f"{requirement.name} is not installed"
    if not requirement.specifier.contains(version, prereleases=True):
        return f"{requirement.name} {version} is installed, {requirement.specifier} is needed"
    return ""


def _packages(_: Path) -> Iterator[Examined]:
    """What is required: there, recent enough, and can be loaded."""
    try:
        needed = [r for r in _requirements() if r.marker is None or r.marker.evaluate({"extra": ""})]
    except metadata.PackageNotFoundError:
        yield Examined("packages", "broken", "the package is used without being installed", f"pip install {PROGRAM}")
        return
    wrong = [(r, why) for r in needed if (why := _wanting(r))]
    for requirement, why in wrong:
        yield Examined("packages", "broken", why, f'pip install "{requirement.name}{requirement.specifier}"')
    for requirement in needed:
        try:
            importlib.import_module(requirement.name.replace("-", "_"))
        except Exception as error:
            if requirement not in [r for r, _ in wrong]:
                why = f"{requirement.name} cannot be loaded ({type(error).__name__}: {error})"
                yield Examined("packages", "broken", why, f"pip install --force-reinstall {requirement.name}")
                wrong.append((requirement, why))
    if not wrong:
        shown = ", ".join(f"{name} {metadata.version(name)}" for name in ("numpy", "scipy", "emcee", "arviz", "matplotlib"))
        yield Examined("packages", "fine", f"{len(needed)} as needed, {shown}")


def _files(_: Path) -> Iterator[Examined]:
    """The files of this package, if they were installed and do not lie in a clone."""
    distribution = metadata.distribution(PROGRAM)
    here = Path(__file__).parents[1]
    # As it stands in the wheel's record: `Distribution.files` leaves out what is gone, from Python 3.12 on.
    rows = csv.reader((distribution.read_text("RECORD") or "").splitlines())
    kept = {Path(row[0]): row[1].removeprefix("sha256=") for row in rows if len(row) > 1 and row[1].startswith("sha256=")}
    own = {path: digest for path, digest in kept.items() if path.parts[0] in ("calib", "models")}
    if not own:
        yield Examined("package files", "fine", f"version {distribution.version}, used in place from {here}")
        return
    changed = [str(path) for path, digest in own.items() if _digest(Path(str(distribution.locate_file(path)))) != digest]
    if changed:
        shown = ", ".join(changed[:3]) + (f" and {len(changed) - 3} more" if len(changed) > 3 else "")
        yield Examined("package files", "broken", f"{shown}: not as installed", _ANEW)
    else:
        yield Examined("package files", "fine", f"version {distribution.version}, {len(own)} files as installed in {here}")


def _digest(path: Path) -> str:
    """SHA-256 of a file as a wheel lists it; empty if it is not there."""
    try:
        content = path.read_bytes()
    except OSError:
        return ""
    return urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode("ascii")


def _surrogates(_: Path) -> Iterator[Examined]:
    """Each surrogate that comes with the package, by its checksum."""
    from models.surrogate import FAMILIES, NotShippedError, load_surrogate

    whole = []
    for family in FAMILIES.values():
        try:
            load_surrogate(None, family)
            whole.append(family.name)
        except NotShippedError:
            continue
        except (ValueError, OSError) as error:
            yield Examined("surrogates", "broken", str(error), _ANEW)
    if whole:
        yield Examined("surrogates", "fine", f"{', '.join(whole)}: whole, by their checksums")
    else:
        yield Examined("surrogates", "broken", "none is there", _ANEW)


def _forward_models(_: Path) -> Iterator[Examined]:
    """Finite elements and surrogate against a number of an independent code."""
    from models.fem import FiniteElements
    from models.surrogate import load_surrogate

    yield compared("finite elements", FiniteElements())
    yield compared("surrogate", load_surrogate())


def compared(name: str, forward: Forward) -> Examined:
    """Compare what a forward model computes of the paper's sensor with a number of an independent code.

    Parameters
    ----------
    name : of the part of the installation.
    forward : the model.
    """
    import numpy as np

    from models.examples import PAPER_SENSOR
    from models.sensor import design_from

    response = forward.respond(design_from(PAPER_SENSOR), np.array([_DEPTH]))
    computed = {"force": float(response.force[-1]), "capacitance change": float(response.capacitance_change[-1])}
    off = {what: computed[what] / true - 1 for what, (true, _) in _NEAR.items()}
    sizes = ", ".join(f"{what} {100 * o:+.2f} %" for what, o in off.items())
    near = all(math.isfinite(o) and abs(o) < _NEAR[what][1] for what, o in off.items())
    finding = f"{sizes} off an independent code"
    return Examined(name, "fine" if near else "broken", finding, "" if near else _ANEW)


def _places(folder: Path) -> Iterator[Examined]:
    """Where files are written: room, permission, locks."""
    try:
        with tempfile.TemporaryDirectory(prefix="calib-doctor-") as scratch:
            (Path(scratch) / "file").write_bytes(bytes(1000))
        yield Examined("temporary folder", "fine", tempfile.gettempdir())
    except OSError as error:
        action = "Make room there, or set the variable TMPDIR (TEMP on Windows) to a folder that can be written"
        yield Examined("temporary folder", "broken", f"cannot be written: {error.strerror or error}", action)
    elsewhere = "Go to a folder that you may write into, or give one with -o"
    try:
        place = folder.absolute()
        require_folder(folder / "run", "Give a folder that exists")
        with tempfile.TemporaryDirectory(prefix=".calib-doctor-", dir=folder) as scratch, owned(Path(scratch), "calib doctor"):
            pass
        free = shutil.disk_usage(folder).free
    except InputError as error:
        fault = error.faults[0]
        yield Examined("this folder", "broken", fault.message, fault.advice or elsewhere)
        return
    except OSError as error:
        yield Examined("this folder", "broken", f"{folder}: {error.strerror or error}", elsewhere)
        return
    yield Examined("this folder", "fine", f"{place}, can be written and locked")
    room = free >= ROOM
    finding = f"{free / 1e9:.1f} GB free, a calibration takes up to {ROOM / 1e9:g} GB"
    yield Examined("disk", "fine" if room else "broken", finding, "" if room else "Make room, or choose another disk")


def _extras(_: Path) -> Iterator[Examined]:
    """What can be installed beside."""
    extras: dict[str, list[Requirement]] = {}
    for requirement in _requirements():
        for name in metadata.metadata(PROGRAM).get_all("Provides-Extra") or ():
            if requirement.marker is not None and name not in _OF_DEVELOPERS and requirement.marker.evaluate({"extra": name}):
                extras.setdefault(name, []).append(requirement)
    for name, requirements in sorted(extras.items()):
        wrong = [why for r in requirements if (why := _wanting(r))]
        if wrong:
            yield Examined(f"extra {name}", "missing", "; ".join(wrong), f'pip install "{PROGRAM}[{name}]"')
        else:
            yield Examined(f"extra {name}", "fine", ", ".join(r.name for r in requirements))


def _browser(_: Path) -> Iterator[Examined]:
    """What prints reports."""
    found = find_browser()
    if found is None:
        action = f"Install one of {', '.join(BROWSERS)} for `calib report --pdf`, or print report.html from any browser"
        yield Examined("browser", "missing", "none was found that prints reports", action)
    else:
        yield Examined("browser", "fine", str(found))


def _machine(_: Path) -> Iterator[Examined]:
    """Processors that a calibration may use, and threads of linear algebra."""
    from threadpoolctl import threadpool_info

    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    libraries = sorted({f"{info['internal_api']}, {info['num_threads']} threads" for info in threadpool_info()})
    yield Examined("processors", "fine", "; ".join([f"{cores} to be used", *libraries]))
