"""From bytes to the same with their SHA-256 at the end, and back only if no byte has changed since."""

from __future__ import annotations

from hashlib import sha256

_MARK = b"\nsha256 "
_LENGTH = len(_MARK) + 64 + 1


def sealed(content: bytes) -> bytes:
    """Give the content of a file a last line by which it can be told that it is whole.

    NetCDF 4 and zip readers find their content from its own sizes and take no notice of what stands behind it, so that other
    programs open a sealed file as it is.
    """
    return content + _seal(content)


def unsealed(data: bytes) -> bytes:
    """Give back the content that `sealed` was given, if it is that to the last byte: nothing else may be decoded.

    Raises
    ------
    ValueError
        If it is not, in words that say what may have happened.
    """
    content, found = data[:-_LENGTH], data[-_LENGTH:]
    if not data:
        raise ValueError("it is empty")
    if not found.startswith(_MARK):
        raise ValueError("its last line is no checksum: it is cut off, damaged, from another program, or from an older version")
    if found != _seal(content):
        raise ValueError("its checksum is not that of its content: it is damaged, or another program has changed it")
    return content


def _seal(content: bytes) -> bytes:
    return _MARK + sha256(content).hexdigest().encode() + b"\n"
