"""Audit trail: who did what, when, from where, with old and new value, in a chain of hashes."""

from bench.audit.chain import AUDIT_FILE, AuditChain, get_agent_trail
from bench.audit.entry import Act, AuditEntry, Head, Source, parse_head
from bench.audit.export import EXPORT_FORMATS, ExportFormat, export_entries
from bench.audit.query import AuditFilter, list_newest, list_oldest
from bench.audit.redaction import redact
from bench.audit.verification import Verification, compare_imports, verify_chain
from bench.audit.writer import AuditWriter

__all__ = [
    "AUDIT_FILE",
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
    "get_agent_trail",
    "list_newest",
    "list_oldest",
    "parse_head",
    "redact",
    "verify_chain",
]
