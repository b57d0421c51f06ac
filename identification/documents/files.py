"""Output files of documents: path check before the computation, complete write after it."""

import sys
from pathlib import Path

from identification.documents.document import Document
from identification.errors import IdentificationError


def check_output_path(out: Path) -> None:
    """Check before a long computation that its result can be written.

    Raises:
        IdentificationError: the folder does not exist.
    """
    if str(out) != "-" and not out.parent.is_dir():
        raise IdentificationError(f"{out}: there is no folder {out.parent}; choose another place")


def write_document(out: Path, document: Document) -> None:
    """Write a document to a file, completely or not at all; ``-`` stands for standard output.

    Raises:
        IdentificationError: the file cannot be written.
    """
    text = document.model_dump_json(by_alias=True, indent=2) + "\n"
    if str(out) == "-":
        sys.stdout.write(text)
        return
    partial = out.with_name(out.name + ".partial")
    try:
        # Replaced in one step, because readers and later calls rely on complete documents.
        partial.write_text(text, encoding="utf-8")
        partial.replace(out)
    except OSError as error:
        raise IdentificationError(f"{out}: cannot be written ({error.strerror}); choose another place") from error


def describe_output_path(out: Path) -> str:
    """Return the destination of a document for a message."""
    return "printed" if str(out) == "-" else str(out)
