"""Context manager of a log: leaving the block closes the log, whatever happened in it."""

from abc import ABC, abstractmethod
from types import TracebackType
from typing import Self

from bench.endings import RunEnding
from bench.log.messages import Outcome


class LogContext(ABC):
    """Log that is closed at the end of a ``with`` block; after an exception as ``incomplete``, with its reason."""

    _closed = False

    @abstractmethod
    def close(self, outcome: Outcome | None = None, reason: str = "", ending: RunEnding | None = None) -> object:
        """Close the log with an outcome; by default with the one that its counts imply."""

    def __enter__(self) -> Self:
        """Return the log itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the log unless it is closed."""
        if self._closed:
            return
        if kind is None:
            self.close()
        else:
            self.close("incomplete", f"{kind.__name__}: {error}")
