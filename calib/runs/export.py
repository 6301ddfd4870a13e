"""A run and a gripper in, a folder out with what its firmware needs: tables of the force that a reading means."""

from __future__ import annotations

import os
import secrets
import shutil
from pathlib import Path

from calib.checks import Verdict
from calib.decision import Gripper, GripperTables, invert
from calib.errors import Fault, InputError
from calib.files import require_folder, write_text
from calib.report import gripper_files
from calib.runs.folder import Run, load_recommendation, require_own_forward
from calib.runs.retreats import retreats_of


class NotUsableError(Exception):
    """The numbers of a run must not be used, and nothing is made of them; `verdict` says why."""

    def __init__(self, folder: Path, verdict: Verdict, so: str = "nothing is exported") -> None:
        self.folder, self.verdict, self.so = folder, verdict, so
        super().__init__(f"the verdict on {folder} is red: its numbers must not be used, and {so}")

    def __reduce__(self) -> tuple[type[NotUsableError], tuple[Path, Verdict, str]]:
        return type(self), (self.folder, self.verdict, self.so)


def export_in(run: Run, gripper: Gripper, folder: Path | str, *, seed: int = 1) -> GripperTables:
    """Turn the calibration of a run round for a gripper, and write what it needs into a new folder, all of it or nothing.

    Parameters
    ----------
    run : the calibration.
    gripper : what reads the sensor.
    folder : that is made; see `calib.report.gripper_files` for what is in it.
    seed : of the choice of draws.

    Returns
    -------
    The tables that were written.

    Raises
    ------
    NotUsableError
        If the verdict on the calibration is red.
    InputError
        If the folder exists, the model is not the one of the calibration, or as `calib.decision.invert` says.
    OSError
        If a file cannot be written, with the name of the folder.
    """
    folder = Path(folder)
    require_new(folder)
    made = force_tables(run, gripper, seed=seed)
    texts = gripper_files(made)
    part = folder.with_name(f".{folder.name}.{secrets.token_hex(4)}.part")
    try:
        part.mkdir()
        for name, text in texts.items():
            write_text(part / name, text)
        require_new(folder)
        os.rename(part, folder)
    except BaseException as error:
        shutil.rmtree(part, ignore_errors=True)
        if isinstance(error, OSError) and error.errno is not None:
            raise OSError(error.errno, error.strerror, str(folder)) from error
        raise
    return made


def force_tables(run: Run, gripper: Gripper, *, seed: int = 1, so: str = "nothing is exported") -> GripperTables:
    """Turn the calibration of a run round for a gripper, and write nothing.

    Parameters
    ----------
    run : the calibration; a recommendation in its folder tells for what force the padding is meant.
    gripper : what reads the sensor.
    seed : of the choice of draws.
    so : what comes of a verdict that is red, in words.

    Raises
    ------
    NotUsableError
        If the verdict on the calibration is red.
    InputError
        If the model is not the one of the calibration, the recommendation is not as it was written, or as
        `calib.decision.invert` says.
    """
    require_own_forward(run)
    if run.verdict.colour == "red":
        raise NotUsableError(run.folder, run.verdict, so)
    recommendation = load_recommendation(run.folder)
    return invert(
        run.posterior,
        run.forward,
        gripper,
        seed=seed,
        posterior_sha256=run.posterior_sha256,
        verdict=run.verdict,
        members=run.members,
        advised=None if recommendation is None else recommendation.requirement.force,
        retreats=retreats_of(run.posterior),
    )


def require_new(folder: Path) -> None:
    """Refuse a folder that is to be made where there is something already, or no place for it.

    Raises
    ------
    InputError
        If so.
    """
    require_folder(folder, "Create it first")
    if os.path.lexists(folder):
        raise InputError(Fault("exists and is not overwritten", folder, advice="Choose another -o"))
