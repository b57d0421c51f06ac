"""State of the identification workers, for threads outside the event loop of the service."""

import asyncio
from concurrent.futures import CancelledError

from bench.errors import RunError
from bench.jobs import JobEngine

_TIMEOUT = 3.0
"""[s] Time limit of an answer; the engine itself answers within one second."""


class WorkerState:
    """State of the workers, asked for in the event loop of the service."""

    def __init__(self, engine: JobEngine, loop: asyncio.AbstractEventLoop) -> None:
        """Use the engine of the jobs and the loop that it runs in."""
        self._engine, self._loop = engine, loop

    def describe(self) -> str:
        """Return `ok`, or the reason why there is no worker; must not be called in the event loop.

        Raises:
            RunError: there is no answer in time, such as at the end of the service.
        """
        if self._loop.is_closed():
            raise RunError("the service has ended; the state of its workers is not known")
        answer = asyncio.run_coroutine_threadsafe(self._engine.describe_state(), self._loop)
        try:
            return answer.result(_TIMEOUT)
        except (TimeoutError, CancelledError):
            answer.cancel()
            raise RunError(f"the state of the workers was not known within {_TIMEOUT:g} s; try again") from None
