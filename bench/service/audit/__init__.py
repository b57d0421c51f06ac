"""Audit trail of the service: its requests, its campaigns, and what the rig agent has recorded."""

from bench.service.audit.agent_import import AgentImport
from bench.service.audit.connection import RecordedConnection
from bench.service.audit.request_record import RequestRecord, note_old
from bench.service.audit.trail import AuditTrail

__all__ = [
    "AgentImport",
    "AuditTrail",
    "RecordedConnection",
    "RequestRecord",
    "note_old",
]
