"""`mrbench audit`, and the audit trail of commands that change a data folder."""

from bench.commands.audit.local_record import record
from bench.commands.audit.trail import audit

__all__ = ["audit", "record"]
