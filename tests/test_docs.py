"""What stands in docs from the code is what the code says; `python tests/test_docs.py` writes it anew."""

from __future__ import annotations

from pathlib import Path

from calib.catalogue import reasons_list, unknowns_table

UNKNOWNS = Path(__file__).parents[1] / "docs" / "unknowns.md"
BEGIN, END = "<!-- from calib/catalogue.py: begin -->\n", "<!-- from calib/catalogue.py: end -->\n"


def written_anew(text: str) -> str:
    """The text of docs/unknowns.md with what stands between its marks taken from the catalogue."""
    before, rest = text.split(BEGIN)
    _, after = rest.split(END)
    return f"{before}{BEGIN}\n{unknowns_table()}\nWhy these defaults:\n\n{reasons_list()}\n{END}{after}"


def test_the_documented_unknowns_are_those_of_the_catalogue() -> None:
    text = UNKNOWNS.read_text(encoding="utf-8")
    assert written_anew(text) == text, "write docs/unknowns.md anew: python tests/test_docs.py"


if __name__ == "__main__":
    UNKNOWNS.write_text(written_anew(UNKNOWNS.read_text(encoding="utf-8")), encoding="utf-8")
