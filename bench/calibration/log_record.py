"""Certificates in the log of a run: a text for each channel in the metadata, and the documents as attachments."""

from collections.abc import Mapping
from datetime import date
from typing import Any

import orjson

from bench.calibration.validity import IssuedCertificate, describe_due, find_state

_REPEATED = "coil_drive"
"""Channel that repeats a measured one."""


def make_log_text(issued: IssuedCertificate, day: date, note: str) -> str:
    """Return the entry of a channel in the metadata record `calibration`, as JSON.

    Args:
        issued: certificate that applies to the channel.
        day: day of the start of the run.
        note: text on the channel's calibration in bench.toml; empty without one.
    """
    certificate = issued.document
    values = {
        "certificate": issued.id,
        "version": issued.version,
        "state": find_state(certificate, day),
        **certificate.model_dump(mode="json", include={"laboratory", "number", "date", "due", "unit", "standard"}),
        "uncertainty": certificate.uncertainty.model_dump(),
        "gain_error": certificate.gain_error,
        "gain_standard_uncertainty": certificate.gain_uncertainty,
        "overdue": describe_due(certificate, day) if find_state(certificate, day) == "overdue" else "",
        "note": note,
    }
    return orjson.dumps(values).decode()


def make_attachment(issued: IssuedCertificate) -> tuple[str, bytes]:
    """Return name and content of a certificate as an attachment of a log."""
    document = issued.model_dump(mode="json", by_alias=True)
    return f"certificate-{issued.document.channel}.json", orjson.dumps(document, option=orjson.OPT_INDENT_2)


def list_overdue(record: Mapping[str, str]) -> list[str]:
    """Return, in words, the channels in a metadata record `calibration` whose certificate was overdue."""
    entries = (read_entry(text) for channel, text in record.items() if channel != _REPEATED)
    return [str(entry["overdue"]) for entry in entries if entry.get("overdue")]


def read_entry(text: str) -> dict[str, Any]:
    """Return the content of a channel's entry; empty for a channel without certificate."""
    try:
        entry = orjson.loads(text)
    except orjson.JSONDecodeError:  # the plain text of a channel without certificate
        return {}
    return entry if isinstance(entry, dict) else {}
