"""Entry of the audit trail, its canonical JSON, and its hash.

One line holds one entry as canonical JSON: ASCII, sorted keys, no spaces. ``sha256`` is the hash of the canonical
JSON of all other fields, and ``prev`` is the ``sha256`` of the entry before. An auditor can compute both with any
program.
"""

import hashlib
import json
import re
from datetime import UTC, datetime
from typing import Any, Final, NamedTuple

from pydantic import Field

from bench.errors import AuditError
from bench.validation import FrozenModel

FIRST_PREV: Final = "0" * 64
"""``prev`` of the first entry."""
LOCAL: Final = "local"
"""Origin of an act on the machine itself."""
_HEAD = re.compile(r"(\d+):([0-9a-f]{64})")
_NAMED_HEAD = re.compile(rf"\bhead\W{{1,5}}{_HEAD.pattern}")
"""Head in an export, which may contain others in its entries."""


def _make_utc() -> str:
    return datetime.now(UTC).isoformat(timespec="microseconds")


class Source(FrozenModel):
    """Place of an imported entry in the chain from which it was imported."""

    chain: str = Field(description="id of that chain, from its first entry")
    seq: int = Field(description="number of the entry there")
    prev: str = Field(description="its `prev` there")
    sha256: str = Field(description="its `sha256` there")


class Act(FrozenModel):
    """Act that is to be recorded; it gets its place in the chain when it is written."""

    utc: str = Field(
        default_factory=_make_utc, description="time of the act, UTC, ISO 8601; numbers give the order"
    )
    actor: str = Field(description="who: `user:NAME`, `token:LABEL`, `local:ACCOUNT`, `campaign:ID`, `bench`, ...")
    origin: str = Field(default=LOCAL, description="where from: address of the client, or `local`")
    peer: str = Field(default="", description="sender as the rig agent itself has seen it; empty elsewhere")
    request: str = Field(default="", description="id of the request, the same in service and rig agent")
    action: str = Field(description="what: method and path template, or command of the rig agent")
    target: str = Field(default="", description="on what: ids of the objects; empty for the bench itself")
    old: Any = Field(default=None, description="former value; null if nothing stored was changed")
    new: Any = Field(default=None, description="new value, without secrets; a large one as its size and hash")
    outcome: str = Field(default="", description="result: status with the reason of a refusal, or `ok`")
    source: Source | None = Field(default=None, description="place in the rig agent's chain; null for own entries")


class AuditEntry(Act):
    """Act with its place in the chain."""

    seq: int = Field(description="number, from 1")
    prev: str = Field(description="SHA-256 of the entry before; zeros for the first one")
    sha256: str = Field(description="SHA-256 of the canonical JSON of all other fields")

    def get_head(self) -> "Head":
        """Return number and hash of the entry."""
        return Head(self.seq, self.sha256)

    def to_line(self) -> bytes:
        """Return the line of the entry, with its end."""
        return encode_canonically(self.model_dump()) + b"\n"


class Head(NamedTuple):
    """Number and hash of an entry. Kept elsewhere, it later shows that nothing up to this entry was changed."""

    seq: int
    sha256: str

    def __str__(self) -> str:
        return f"{self.seq}:{self.sha256}"


EMPTY_HEAD: Final = Head(0, FIRST_PREV)
"""Head of a chain without entries."""
FIELDS: Final = frozenset(AuditEntry.model_fields)
"""Fields of an entry in a file."""


def parse_head(text: str) -> Head:
    """Return the head in a text of the form SEQ:SHA256, or in an export.

    Raises:
        AuditError: there is none.
    """
    found = _NAMED_HEAD.search(text) or _HEAD.search(text)
    if found is None:
        raise AuditError("no head of an audit trail; give SEQ:SHA256, or a file that `mrbench audit head` wrote")
    return Head(int(found[1]), found[2])


def encode_canonically(value: Any) -> bytes:
    """Return the canonical JSON of a value: ASCII, sorted keys, no spaces."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False).encode("ascii")


def compute_sha256(fields: dict[str, Any]) -> str:
    """Return the hash of an entry from its fields; ``sha256`` itself does not count."""
    return hashlib.sha256(encode_canonically({k: v for k, v in fields.items() if k != "sha256"})).hexdigest()


def chain_act(act: Act, before: Head) -> AuditEntry:
    """Return an act as the entry that follows a head."""
    fields = {**act.model_dump(include=set(Act.model_fields)), "seq": before.seq + 1, "prev": before.sha256}
    return AuditEntry(**fields, sha256=compute_sha256(fields))
