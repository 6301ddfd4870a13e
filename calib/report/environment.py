"""The name of a template in, its text out, and the environment in which those of pages are written."""

from __future__ import annotations

from importlib import resources

import jinja2

from calib.hypertext import sentence


def template_text(name: str) -> str:
    """Read a file of `calib/report/templates`.

    Parameters
    ----------
    name : of the file.
    """
    return (resources.files("calib.report") / "templates" / name).read_text(encoding="utf-8")


def templates() -> jinja2.Environment:
    """The templates of pages: what they write is escaped, and a name that the context lacks is an error."""
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(template_text),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["sentence"] = sentence
    return environment
