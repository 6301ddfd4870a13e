"""The command `example`: the lab data that come with the package into a folder of the user's, ready to be calibrated."""

from __future__ import annotations

import shlex
import shutil
from pathlib import Path
from typing import Annotated

import typer

from calib.cli.common import refusing_bad_input, say
from calib.errors import Fault, InputError
from calib.files import require_folder


def example(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder to write; must not exist yet.")],
) -> None:
    """Write lab files of two specimens, their experiment file and a specification, to try everything on.

    The files are synthetic, with the faults of a real lab, and what a calibration should find stands in truth.json.

    Example: `calib example -o demo`

    Writes: demo/experiment.toml, specification.toml, README.md, the lab files, truth.json, and the script that made them.

    Exit codes: 0 done; 2 the folder exists, or there is no place to write.
    """
    with refusing_bad_input():
        from calib.experiment import shipped

        files = sorted(file for file in shipped().iterdir() if file.is_file())
        require_folder(output, "Create it first")
        try:
            output.mkdir()
        except FileExistsError:
            raise InputError(Fault("exists and is not overwritten", output, advice="Choose another -o")) from None
        try:
            for file in files:
                shutil.copyfile(file, output / file.name)
        except BaseException:
            shutil.rmtree(output, ignore_errors=True)
            raise
        run = output / "RUN"
        say(f"Written: {output} ({len(files)} files). What to do with them:")
        say("")
        for words in (
            ("calib", "calibrate", str(output / "experiment.toml"), "-o", str(run)),
            ("calib", "recommend", str(run), "--force", "10 N", "--padding", "0 mm:9 mm"),
            ("calib", "recommend", str(run), "--spec", str(output / "specification.toml")),
        ):
            say(f"    {shlex.join(words)}")
        say("")
        say(f"Then open {run / 'report.html'}.")
