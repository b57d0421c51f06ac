"""Records that are kept beside the logs: notes, tags, events, signatures of reports, copies of logs."""

from bench.catalogue.records.event_journal import EventJournal
from bench.catalogue.records.log_copies import LogCopies
from bench.catalogue.records.log_events import LogEvent, read_log_events
from bench.catalogue.records.notebook import Notebook
from bench.catalogue.records.report_signatures import ReportKind, SignatureMeaning, SignatureRow, SignatureStore

__all__ = [
    "EventJournal",
    "LogCopies",
    "LogEvent",
    "Notebook",
    "ReportKind",
    "SignatureMeaning",
    "SignatureRow",
    "SignatureStore",
    "read_log_events",
]
