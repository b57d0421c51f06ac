"""Structured logs: one line each, `time level event key=value ...`."""

import json
import logging
import sys
from datetime import UTC, datetime

_OWN = set(vars(logging.makeLogRecord({}))) | {"message", "asctime"}
_PLAIN = set("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._:/+-")


class OneLine(logging.Formatter):
    """An event with its particulars, which are given as `extra`."""

    def format(self, record: logging.LogRecord) -> str:
        """The line; a traceback stays in it, as one JSON text."""
        particulars = {name: value for name, value in vars(record).items() if name not in _OWN}
        if record.exc_info:
            particulars["traceback"] = self.formatException(record.exc_info)
        shown = "".join(
            f" {name}={_text(value)}" for name, value in particulars.items() if value not in (None, "")
        )
        time = datetime.fromtimestamp(record.created, UTC)
        event = " ".join(record.getMessage().split())
        return f"{time:%Y-%m-%dT%H:%M:%S.%f}Z {record.levelname.lower()} {event}{shown}"


def _text(value: object) -> str:
    text = str(value)
    return text if set(text) <= _PLAIN else json.dumps(text, ensure_ascii=False)


def log_to_stderr() -> None:
    """Have all logs of the process go to standard error, those of libraries from warnings on."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(OneLine())
    logging.basicConfig(level=logging.WARNING, handlers=[handler], force=True)
    logging.getLogger("bench").setLevel(logging.INFO)
    # Dask speaks of every connection that a killed worker leaves; what matters of it the jobs say.
    logging.getLogger("distributed").setLevel(logging.ERROR)
