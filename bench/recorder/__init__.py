"""Recording of a run in progress: aligned samples, commands, segment marks, readings and frames."""

from bench.recorder.bench_header import (
    LogMetadata,
    describe_clocks,
    describe_decoders,
    find_force_rate,
    make_attachments,
    make_channel_infos,
    make_run_header,
)
from bench.recorder.live_recorder import LiveRecorder
from bench.recorder.recording_thread import RecordingThread
from bench.recorder.run_recorder import EventReporter, RunRecorder

__all__ = [
    "EventReporter",
    "LiveRecorder",
    "LogMetadata",
    "RecordingThread",
    "RunRecorder",
    "describe_clocks",
    "describe_decoders",
    "find_force_rate",
    "make_attachments",
    "make_channel_infos",
    "make_run_header",
]
