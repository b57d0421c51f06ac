"""Signatures of reports in an audit trail.

A signature is an entry with the SHA-256 of the signed file. Only that file has it: a report that is made again
differs, if only by its time.
"""

from pathlib import Path
from typing import Any, Final

from bench.audit.entry import Act, AuditEntry
from bench.audit.query import find_entries

SIGNED: Final = "report signed"
"""Action of a signature. No request has this action, because its action begins with its method."""


def make_signature(actor: str, origin: str, request: str, target: str, content: dict[str, Any]) -> Act:
    """Return a signature as an act for the trail.

    Args:
        actor: who signs, such as ``user:mcurie``.
        origin: address of the client.
        request: id of the request.
        target: id of the run or of the campaign.
        content: `sha256` of the file, `meaning` of the signature, `full_name` of the person, and further facts.
    """
    return Act(
        actor=actor, origin=origin, request=request, action=SIGNED, target=target, new=content, outcome="ok"
    )


def find_signatures(path: Path, sha256: str) -> list[AuditEntry]:
    """Return the signatures of a file with a hash, the oldest first; imported entries are none.

    Args:
        path: file of the trail.
        sha256: hash of the file.

    Raises:
        AuditError: the trail cannot be read.
    """
    return list(find_entries(path, lambda entry: _is_signature(entry, sha256)))[::-1]


def _is_signature(entry: AuditEntry, sha256: str) -> bool:
    is_own = entry.action == SIGNED and entry.source is None
    return is_own and isinstance(entry.new, dict) and entry.new.get("sha256") == sha256
