"""Threads: one that works in the background until it is ended, and one for an action with a time limit."""

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from types import TracebackType
from typing import Self, TypeVar

_T = TypeVar("_T")


class BackgroundThread(ABC):
    """Thread that runs while its context manager is open.

    Args:
        name: name of the thread.
        end_time: [s] time for which its end is waited for; None for as long as it takes.
    """

    def __init__(self, name: str, end_time: float | None = None) -> None:
        self._end_time = end_time
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def __enter__(self) -> Self:
        """Start the thread."""
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the thread if it was started; what it is doing is finished within the time for its end."""
        self.request_end()
        if self._thread.is_alive():
            self._thread.join(self._end_time)

    def request_end(self) -> None:
        """Let the thread end, without waiting for it."""
        self._stopping.set()

    @abstractmethod
    def _run(self) -> None:
        """Work until ``_stopping`` is set."""


def run_within(seconds: float, act: Callable[[], _T], name: str) -> _T:
    """Return what a function returns; after the time limit it is left to itself, whatever holds it up.

    Args:
        seconds: time limit [s].
        act: the function; its exceptions are passed on.
        name: name of its thread.

    Raises:
        TimeoutError: it has not ended in time.
    """
    results: list[_T] = []
    failures: list[Exception] = []

    def attempt() -> None:
        try:
            results.append(act())
        except Exception as error:
            failures.append(error)

    thread = threading.Thread(target=attempt, name=name, daemon=True)
    thread.start()
    thread.join(seconds)
    if thread.is_alive():
        raise TimeoutError
    if failures:
        raise failures[0]
    return results[0]
