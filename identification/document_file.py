"""A document to its file: whole or not at all, and refused before the work where it could not be written after."""

import sys
from pathlib import Path

from identification.errors import IdentificationError
from identification.results import Document


def check_place(out: Path) -> None:
    """Refuse before the work what could not be written after it.

    Raises:
        IdentificationError: there is no such folder.
    """
    if str(out) != "-" and not out.parent.is_dir():
        raise IdentificationError(f"{out}: there is no folder {out.parent}; choose another place")


def write_document(out: Path, document: Document) -> None:
    """Write a document to a file, whole or not at all, or to standard output for `-`.

    Raises:
        IdentificationError: the place cannot be written.
    """
    text = document.model_dump_json(by_alias=True, indent=2) + "\n"
    if str(out) == "-":
        sys.stdout.write(text)
        return
    partial = out.with_name(out.name + ".partial")
    try:
        # A document that is there is whole: readers and later calls may rely on it.
        partial.write_text(text, encoding="utf-8")
        partial.replace(out)
    except OSError as error:
        raise IdentificationError(f"{out}: cannot be written ({error.strerror}); choose another place") from error


def place_in_words(out: Path) -> str:
    """Where a document went, for the line that says what it says."""
    return "printed" if str(out) == "-" else str(out)
