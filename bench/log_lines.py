"""Structured program logs: one line for each event, `time level event key=value ...`."""

import json
import logging
import sys
from datetime import UTC, datetime

_STANDARD_ATTRIBUTES = set(vars(logging.makeLogRecord({}))) | {"message", "asctime"}
_UNQUOTED_CHARACTERS = set("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._:/+-")


class KeyValueFormatter(logging.Formatter):
    """Formatter for an event and its values, which are passed as `extra`."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line; a traceback is part of it, as one JSON string."""
        values = {name: value for name, value in vars(record).items() if name not in _STANDARD_ATTRIBUTES}
        if record.exc_info:
            values["traceback"] = self.formatException(record.exc_info)
        pairs = "".join(
            f" {name}={_format_value(value)}" for name, value in values.items() if value not in (None, "")
        )
        time = datetime.fromtimestamp(record.created, UTC)
        event = " ".join(record.getMessage().split())
        return f"{time:%Y-%m-%dT%H:%M:%S.%f}Z {record.levelname.lower()} {event}{pairs}"


class RepeatedFailure:
    """Failure of a repeated action, logged once when it begins and once when it ends.

    Args:
        log: receives the lines.
        began: name of the log line when the failure begins, or its cause changes.
        ended: name of the log line when the action succeeds again.
    """

    def __init__(self, log: logging.Logger, began: str, ended: str) -> None:
        self._log, self._began, self._ended = log, began, ended
        self._cause = ""
        self._count = 0

    def note(self, error: Exception) -> None:
        """Note one failure."""
        self._count += 1
        if (cause := repr(error)) != self._cause:
            self._cause = cause
            self._log.error(self._began, extra={"why": cause})

    def clear(self) -> None:
        """Note a success."""
        if self._cause:
            self._log.warning(self._ended, extra={"failures": self._count})
        self._cause, self._count = "", 0


def _format_value(value: object) -> str:
    text = str(value)
    return text if set(text) <= _UNQUOTED_CHARACTERS else json.dumps(text, ensure_ascii=False)


def log_to_stderr() -> None:
    """Send all logs of the process to standard error; libraries only from level warning."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(KeyValueFormatter())
    logging.basicConfig(level=logging.WARNING, handlers=[handler], force=True)
    logging.getLogger("bench").setLevel(logging.INFO)
    # Dask logs every connection that a killed worker leaves open. The jobs report the failures that matter.
    logging.getLogger("distributed").setLevel(logging.ERROR)
