"""Errors of the bench.

BenchError
├── MethodError      a method document asks for what cannot be compiled or exceeds its own limits
├── ConfigError      bench.toml does not describe a bench
├── RunError         a run could not be carried out
│   └── Interlocked  an interlock forbids what was to be sent
├── AgentUnreachable the rig agent does not answer
├── LogError         a log cannot be read, written or mended
├── RecordingError   a recording made elsewhere cannot be taken in
└── ReportError      a report or a demo cannot be made

Each message says what failed, the value and the limit with unit, and what to do. ``exit_code`` tells the
command line that the message is for a person and needs no traceback.
"""


class BenchError(Exception):
    """Base of everything that the bench raises on purpose."""

    exit_code = 1


class MethodError(BenchError):
    """A method asks for what cannot be compiled, or exceeds its own limits."""


class RunError(BenchError):
    """A run could not be carried out."""


class AgentUnreachable(BenchError):  # noqa: N818 - reads as the sentence it makes
    """The rig agent does not answer."""


class LogError(BenchError):
    """A log cannot be read, written or mended."""


class RecordingError(BenchError):
    """A recording made elsewhere cannot be taken in."""


class ReportError(BenchError):
    """A report or a demo cannot be made."""


class ConfigError(BenchError):
    """``bench.toml`` does not describe a bench."""


class Interlocked(RunError):  # noqa: N818 - reads as the sentence it makes
    """An interlock forbids what was to be sent."""
