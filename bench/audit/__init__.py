"""Audit trail: who did what, when, from where, with old and new value, in a chain of hashes."""

from bench.audit.agent_trail import find_agent_trail, make_agent_trail
from bench.audit.chain import AUDIT_FILE, AuditChain
from bench.audit.entry import EMPTY_HEAD, Act, AuditEntry, Head, Source, parse_head
from bench.audit.export import EXPORT_FORMATS, ExportFormat, export_entries
from bench.audit.lines import parse_entry
from bench.audit.query import AuditFilter, find_entry, list_newest, read_after, read_chain_id
from bench.audit.redaction import redact
from bench.audit.report_signatures import find_signatures, make_signature
from bench.audit.verification import Verification, compare_imports, verify_chain
from bench.audit.writer import AuditWriter

__all__ = [
    "AUDIT_FILE",
    "EMPTY_HEAD",
    "EXPORT_FORMATS",
    "Act",
    "AuditChain",
    "AuditEntry",
    "AuditFilter",
    "AuditWriter",
    "ExportFormat",
    "Head",
    "Source",
    "Verification",
    "compare_imports",
    "export_entries",
    "find_agent_trail",
    "find_entry",
    "find_signatures",
    "list_newest",
    "make_agent_trail",
    "make_signature",
    "parse_entry",
    "parse_head",
    "read_after",
    "read_chain_id",
    "redact",
    "verify_chain",
]
