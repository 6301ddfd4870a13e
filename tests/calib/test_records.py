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
        ('{"kind": "run", "format": 1}', "it has no checksum"),
        ('{"kind": "run", "format": 1, "checksum": 7}', "its checksum is not that of its content"),
        ("[" * 100_000, "nested too deeply"),
        ('{"kind": ' + "9" * 5000 + "}", "digits"),
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


CONTENT = {"seed": 7, "mean": 0.1 + 0.2, "name": "a", "none": None, "list": [1, 2.5, {"deep": [True]}], "unknown": np.nan}
OTHERS: tuple[object, ...] = (None, True, 0, 1, 2.5, -1e400, "", "7", [], {}, [None], math.nan, 10**400)


def test_no_value_of_a_record_is_changed_renamed_or_left_out_unseen() -> None:
    text = record_to_text("run", 1, CONTENT)
    whole = json.loads(text)
    changed = [{**whole, key: other} for key in whole for other in OTHERS if repr(other) != repr(whole[key])]
    changed += [{k: v for k, v in whole.items() if k != key} for key in whole]
    changed += [{f"{k} " if k == key else k: v for k, v in whole.items()} for key in whole]
    changed.append({**whole, "more": 1})
    for record in changed:
        with pytest.raises(ValueError, match=r"what it is|not a run|is not known|checksum"):
            record_from_text("run", 1, json.dumps(record))


def test_no_byte_of_a_record_is_changed_to_another_content() -> None:
    text, rng = record_to_text("run", 1, CONTENT), np.random.default_rng(1)
    content, n_read = record_from_text("run", 1, text), 0
    for at in rng.integers(0, len(text), 400):
        other = text[:at] + chr(int(rng.integers(32, 127))) + text[at + 1 :]
        try:
            found = record_from_text("run", 1, other)
        except ValueError:
            continue
        n_read += 1
        assert found == content
    assert n_read < 40  # a blank for a blank, or the same letter


def test_the_checksum_holds_whatever_the_blanks_the_order_and_the_names_that_are_numbers() -> None:
    text = record_to_text("run", 1, {"rows": {2: "b", 10: "a"}, "exact": math.nan}, indent=None, exact=True)
    turned = json.dumps(dict(reversed(json.loads(text).items())), indent=4)
    assert record_from_text("run", 1, turned)["rows"] == {"2": "b", "10": "a"}
