"""JSON records that say what they are."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from calib.records import record_from_text, record_to_text


def test_a_record_reads_back_as_it_was_written() -> None:
    content = {"name": "Prüfling 1", "numbers": [1.5, 0.1 + 0.2], "none": None, "yes": True, "inner": {"a": [1]}}
    text = record_to_text("run", 3, content)
    assert record_from_text("run", 3, text) == content
    assert json.loads(text)["kind"] == "run"
    assert json.loads(text)["format"] == 3
    assert "Prüfling" in text
    assert text.endswith("}\n")


def test_arrays_and_what_is_no_finite_number_become_what_json_knows() -> None:
    content = {
        "array": np.array([[1.0, math.nan], [math.inf, 0.25]]),
        "numbers": (np.float64(2.5), np.int64(3), np.bool_(True), -math.inf),
        "flags": np.array([True, False]),
    }
    found = record_from_text("run", 1, record_to_text("run", 1, content, indent=None))
    assert found == {"array": [[1.0, None], [None, 0.25]], "numbers": [2.5, 3, True, None], "flags": [True, False]}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time,force\n", "Expecting value"),
        ("[1]", "it does not say what it is"),
        ('{"seed": 1}', "it does not say what it is"),
        (record_to_text("checkpoint", 1, {}), "it is a checkpoint, not a run"),
        (record_to_text("run", 2, {}), "format 2 is not known, this version reads 1"),
        ('{"kind": "run"}', "format None is not known, this version reads 1"),
    ],
)
def test_another_kind_or_version_is_refused(text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        record_from_text("run", 1, text)


def test_content_must_not_say_what_the_record_is() -> None:
    with pytest.raises(ValueError, match="says its format itself"):
        record_to_text("run", 1, {"format": 2})


def test_what_json_cannot_hold_is_an_error() -> None:
    with pytest.raises(TypeError):
        record_to_text("run", 1, {"what": object()})
