"""The command `schema`: the JSON Schema of the TOML files, by which an editor helps to write them."""

from __future__ import annotations

import json
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from calib.cli.common import refusing_bad_input, say
from calib.errors import Fault, InputError
from calib.files import write_text


class Kind(StrEnum):
    """The files that have a schema."""

    experiment = "experiment"
    design = "design"
    specification = "specification"


def schema(
    of: Annotated[Kind, typer.Argument(metavar="[experiment|design|specification]", help="Kind of file.")] = Kind.experiment,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="File to write; must not exist yet [default: print it].")
    ] = None,
) -> None:
    """Print the JSON Schema of experiment, design or specification files, by which an editor completes and underlines.

    It has every key, with its unit, default and the reason for that. With -o it also says by which line a TOML file names it;
    taplo and the extension Even Better TOML of Visual Studio Code take it. `calib calibrate` and `calib simulate` check more
    than a schema can say.

    Example: `calib schema experiment -o experiment.schema.json`

    Exit codes: 0 done; 2 the file exists, or there is no place to write.
    """
    with refusing_bad_input():
        from calib.experiment import design_schema, experiment_schema, specification_schema

        schemas = {Kind.experiment: experiment_schema, Kind.design: design_schema, Kind.specification: specification_schema}
        text = json.dumps(schemas[of](), indent=2, ensure_ascii=False)
        if output is None:
            say(text)
            return
        if output.exists():
            raise InputError(Fault("the file exists and is not overwritten", output, advice="Choose another -o"))
        write_text(output, f"{text}\n")
        say(f"Written: {output}. First line of {of} files in the same folder, for editors:")
        say(f"#:schema ./{output.name}")
