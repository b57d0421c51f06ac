"""The run log (MCAP): writing, reading, repair and export."""

from bench.log.atomic_file import write_atomically
from bench.log.export import FORMATS, Format, export_log, make_columns
from bench.log.header import ChannelInfo, Identity, RunHeader, serialise_values, utc_at
from bench.log.log_context import LogContext
from bench.log.mcap_file import DAMAGE_ERRORS, MAGIC, convert_file_errors, is_closed
from bench.log.messages import (
    EVENT,
    INSTRUMENT,
    MESSAGES,
    NS_PER_SECOND,
    SAMPLE,
    SAMPLE_FIELDS,
    TOPIC_FAMILIES,
    WIRE,
    Outcome,
    Phase,
    list_sample_units,
    make_message_schema,
)
from bench.log.reader import Log, LoggedSegment, check_complete, check_profile, read_log
from bench.log.readings import (
    DECODERS_FILE,
    ClockMapProtocol,
    make_frames_message,
    make_readings_messages,
    parse_blocks,
    parse_frames,
)
from bench.log.salvage import salvage_log
from bench.log.velocity import SMOOTHING_WINDOW, smooth_velocity
from bench.log.writer import LogWriter, SegmentMark

__all__ = [
    "DAMAGE_ERRORS",
    "DECODERS_FILE",
    "EVENT",
    "FORMATS",
    "INSTRUMENT",
    "MAGIC",
    "MESSAGES",
    "NS_PER_SECOND",
    "SAMPLE",
    "SAMPLE_FIELDS",
    "SMOOTHING_WINDOW",
    "TOPIC_FAMILIES",
    "WIRE",
    "ChannelInfo",
    "ClockMapProtocol",
    "Format",
    "Identity",
    "Log",
    "LogContext",
    "LogWriter",
    "LoggedSegment",
    "Outcome",
    "Phase",
    "RunHeader",
    "SegmentMark",
    "check_complete",
    "check_profile",
    "convert_file_errors",
    "export_log",
    "is_closed",
    "list_sample_units",
    "make_columns",
    "make_frames_message",
    "make_message_schema",
    "make_readings_messages",
    "parse_blocks",
    "parse_frames",
    "read_log",
    "salvage_log",
    "serialise_values",
    "smooth_velocity",
    "utc_at",
    "write_atomically",
]
