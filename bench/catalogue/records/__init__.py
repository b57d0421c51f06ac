"""Records that are kept beside the logs: notes, tags and events."""

from bench.catalogue.records.event_journal import EventJournal
from bench.catalogue.records.log_events import LogEvent, read_log_events
from bench.catalogue.records.notebook import Notebook

__all__ = ["EventJournal", "LogEvent", "Notebook", "read_log_events"]
