"""Errors of the bench.

BenchError
├── MethodError            a method cannot be compiled or exceeds its own limits
├── ConfigError            bench.toml is not a valid configuration
├── RunError               a run failed or could not be started
│   └── InterlockError     an interlock refused a command
├── AgentUnreachableError  the rig agent does not reply
│   └── NoRigError         the service has no rig
├── SecretFileError        a file with a secret is missing, or other users may read it
├── LiveDataError          a live batch cannot be read
├── LogError               a log cannot be read, written or repaired
├── RecordingError         a recording cannot be imported
├── AuditError             the audit trail cannot be written or was altered
└── ReportError            a report or a demo cannot be made

Each message states what failed, the value and the limit with unit, and what to do. ``exit_code`` marks an error
whose message is for a person: the command line prints it without a traceback.
"""


class BenchError(Exception):
    """Base class of all errors that the bench raises on purpose."""

    exit_code = 1


class MethodError(BenchError):
    """A method cannot be compiled or exceeds its own limits."""


class LiveDataError(BenchError):
    """A live batch or its list of channels cannot be read."""


class RunError(BenchError):
    """A run failed or could not be started."""


class AgentUnreachableError(BenchError):
    """The rig agent does not reply."""


class NoRigError(AgentUnreachableError):
    """The service was started without a rig."""


class SecretFileError(BenchError):
    """A file with a secret is missing, or other users may read it."""


class LogError(BenchError):
    """A log cannot be read, written or repaired."""


class EmptyLogError(LogError):
    """A log without its end contains no sample, so nothing of it can be kept."""


class RecordingError(BenchError):
    """A recording cannot be imported."""


class AuditError(BenchError):
    """The audit trail cannot be written or read, or was altered."""


class ReportError(BenchError):
    """A report or a demo cannot be made."""


class ConfigError(BenchError):
    """``bench.toml`` is not a valid configuration."""


class InterlockError(RunError):
    """An interlock refused a command."""
