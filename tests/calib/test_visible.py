"""Texts of others: what a screen would act on is written out, and what cannot be shown is no name."""

from __future__ import annotations

import os

import pytest

from calib.cli.terminal import Console
from calib.visible import name_fault, visible


@pytest.mark.parametrize("text", ["\x1b[31mred", "\x1b]0;owned\x07", "a\rb", "a\u202eb", "a\x9bb", os.fsdecode(b"a\xff")])
def test_no_escape_sequence_reaches_the_terminal(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    Console().print(text, markup=False)
    said = capsys.readouterr().out
    assert said.isascii()
    assert said.rstrip("\n").isprintable()
    assert name_fault(text) != ""


@pytest.mark.parametrize("text", [r"a $x^$ b $\frac{$", "<script>", "{{ 7 }}", "emoji 😀", "../../x", "µm, é"])
def test_what_can_be_shown_stays_as_it_is(text: str) -> None:
    assert visible(text) == text
    assert name_fault(text) == ""
