"""Files that tell whether they are whole."""

from __future__ import annotations

import pytest

from models.seal import sealed, unsealed


@pytest.mark.parametrize("content", [b"", b"\n", b"some bytes" * 100, sealed(b"twice")])
def test_what_was_sealed_comes_back(content: bytes) -> None:
    assert sealed(content).startswith(content)
    assert unsealed(sealed(content)) == content


def test_every_changed_missing_or_added_byte_is_seen() -> None:
    data = sealed(b"some bytes")
    for at in range(len(data)):
        flipped, doubled = data[:at] + bytes([data[at] ^ 1]) + data[at + 1 :], data[: at + 1] + data[at:]
        for other in (flipped, doubled, data[:at], data[at + 1 :]):
            with pytest.raises(ValueError, match=r"it is empty|no checksum|its checksum is not that of its content"):
                unsealed(other)
