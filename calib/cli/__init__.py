"""The words of a command line in, tables on a terminal and an exit code out; knows no physics and no statistics."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import typer
from typer.core import TyperGroup

from calib.cli import (
    average,
    batch,
    calibrate,
    certificate,
    check,
    cite,
    compare,
    diff,
    doctor,
    example,
    export,
    figures,
    lab,
    measurements,
    prove,
    refine,
    runs,
    schema,
    serve,
    simulate,
    surrogate,
    verify,
    version,
)
from calib.cli.stopping import stoppable
from calib.cli.terminal import every_character
from calib.visible import visible

__all__ = ["app"]


# What typer refuses a command line with; the class itself has no public name.
_UsageError: Any = typer.BadParameter.__base__


@contextmanager
def _quoting_visibly() -> Iterator[None]:
    """Write out what a terminal would act on where typer quotes a word of the command line."""
    try:
        yield
    except _UsageError as error:
        error.message = visible(error.message or "")
        raise


class _Commands(TyperGroup):
    """The commands, each of which ends when it is told to, and says on any terminal what it has to say."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the options before the command."""
        with _quoting_visibly():
            return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """Run the command that was asked for."""
        with _quoting_visibly(), every_character(), stoppable():
            return super().invoke(ctx)


app = typer.Typer(
    name="calib",
    cls=_Commands,
    no_args_is_help=True,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="""
Find out what a soft capacitive sensor really is (modulus, permittivity, thicknesses, each with its uncertainty) from the files
of a testing machine and an LCR meter, and which padding to build next.

A first calibration, from lab files to recommendation:

    calib init sensor1_instron.csv sensor1_lcr.csv -o experiment.toml

    calib check experiment.toml

    calib calibrate experiment.toml -o run1

    calib recommend run1 --force "10 N" --padding "0 mm:9 mm"

Then open run1/report.html. Without files of your own, begin with `calib example -o demo`.

Exit codes: 0 done (and usable); 1 all results were written, but not the page or words that show them; 2 something is wrong
with the input, nothing was written; 3 all is written, but the verdict is red (with --strict: amber), or what was looked at is
not as it should be, and a last line says which; 130 stopped by Ctrl-C, 143 by SIGTERM, what was computed is kept where it has a
place.
""",
)

_FROM_LAB, _CALIBRATION, _MODEL = "From the lab", "Calibration", "Model of the sensor"
app.callback()(version.callback)
app.command("cite", rich_help_panel=_FROM_LAB)(cite.cite)
app.command("doctor", rich_help_panel=_FROM_LAB)(doctor.doctor)
app.command("example", rich_help_panel=_FROM_LAB)(example.example)
app.command("init", rich_help_panel=_FROM_LAB)(lab.init)
app.command("read", rich_help_panel=_FROM_LAB)(lab.read)
app.command("serve", rich_help_panel=_FROM_LAB)(serve.serve)
app.command("schema", rich_help_panel=_FROM_LAB)(schema.schema)
app.command("unknowns", rich_help_panel=_FROM_LAB)(lab.unknowns)
app.command("check", rich_help_panel=_CALIBRATION)(check.check)
app.command("calibrate", rich_help_panel=_CALIBRATION)(calibrate.calibrate)
app.command("recommend", rich_help_panel=_CALIBRATION)(runs.recommend)
app.command("next", rich_help_panel=_CALIBRATION)(measurements.next_measurement)
app.command("batch", rich_help_panel=_CALIBRATION)(batch.batch)
app.command("compare", rich_help_panel=_CALIBRATION)(compare.compare)
app.command("diff", rich_help_panel=_CALIBRATION)(diff.diff)
app.command("average", rich_help_panel=_CALIBRATION)(average.average)
app.command("report", rich_help_panel=_CALIBRATION)(runs.report)
app.command("figures", rich_help_panel=_CALIBRATION)(figures.figures)
app.command("export", rich_help_panel=_CALIBRATION)(export.export)
app.command("force", rich_help_panel=_CALIBRATION)(export.force_of)
app.command("certificate", rich_help_panel=_CALIBRATION)(certificate.certificate)
app.command("prove", rich_help_panel=_CALIBRATION)(prove.prove)
app.command("verify", rich_help_panel=_CALIBRATION)(verify.verify)
app.command("simulate", rich_help_panel=_MODEL)(simulate.simulate)

_of_key = typer.Typer(
    no_args_is_help=True, rich_markup_mode="markdown", help="The key of a laboratory, with which it signs certificates."
)
_of_key.command("new")(certificate.new_key)
app.add_typer(_of_key, name="key", rich_help_panel=_CALIBRATION)

_of_surrogate = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="markdown",
    help="The fast stand-in for the finite elements: describe it, check it, train another, refine it.",
)
_of_surrogate.command("info")(surrogate.info)
_of_surrogate.command("validate")(surrogate.validate)
_of_surrogate.command("train")(surrogate.train)
_of_surrogate.command("refine")(refine.refine)
app.add_typer(_of_surrogate, name="surrogate", rich_help_panel=_MODEL)
