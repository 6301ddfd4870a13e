"""From a zip archive to the names of what is in it, as far as a damaged one tells, for the formats that are archives."""

from __future__ import annotations

import zipfile
from collections.abc import Sequence
from pathlib import Path

#: The first bytes of an archive with something in it.
BEGINNING = b"PK\x03\x04"
#: What an archive holds that is a workbook.
WORKBOOK = "xl/workbook.xml"

# As much of a damaged archive as is looked at.
_SEEN = 1_000_000


def names_inside(path: Path) -> Sequence[str]:
    """List what an archive holds; of one that cannot be opened `WORKBOOK` if it begins as a workbook does, else nothing."""
    try:
        with zipfile.ZipFile(path) as archive:
            return archive.namelist()
    except (OSError, zipfile.BadZipFile, ValueError, EOFError, NotImplementedError):
        # The list stands at the end of the file; its first entries tell a workbook that is cut short.
        with path.open("rb") as file:
            return [WORKBOOK] if b"xl/" in file.read(_SEEN) else []
