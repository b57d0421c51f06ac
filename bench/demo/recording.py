"""One run by way of the service: started, followed to its end, and to the end of its identification."""

import time
from collections.abc import Callable
from typing import Any

from bench.demo.rest import Rest
from bench.errors import RunError

_LOOK = 0.25
"""[s] between two looks."""
_SPARE = 60.0
"""[s] that a run may take beyond its plan."""
_IDENTIFIED_WITHIN = 900.0
"""[s]"""
_ATTEMPTS = 3
"""Runs of a method: where a busy machine holds up rig or bench for too long, the interlocks rightly end one."""
_OVER = ("done", "failed", "cancelled")


class RunSpoiledError(RunError):
    """A run has ended, but not cleanly."""


def record(
    rest: Rest, method: str, progress: Callable[[float], None], tell: Callable[[str], None] = lambda text: None
) -> str:
    """Run a method, once more where the run was spoiled.

    Args:
        rest: the service.
        method: a shipped one.
        progress: told the share done, 0 to 1.
        tell: told why it is run once more.

    Returns:
        Id of the run.

    Raises:
        RunError: it could not be started, was never recorded cleanly, or does not end.
    """
    for attempt in range(1, _ATTEMPTS):
        try:
            return _run(rest, method, progress)
        except RunSpoiledError as spoiled:
            tell(f"{spoiled}; once more ({attempt + 1} of {_ATTEMPTS})")
            rest.post("/agent/reset", {})
    return _run(rest, method, progress)


def _run(rest: Rest, method: str, progress: Callable[[float], None]) -> str:
    run = rest.post("/runs", {"method": method, "operator": "demo"})
    deadline = time.monotonic() + (run["duration_s"] or 0.0) + _SPARE
    while run["state"] == "running":
        if time.monotonic() > deadline:
            raise RunError(f"the run of {method} has not ended {_SPARE:g} s after its plan")
        if done := run["progress"]:
            progress(done["elapsed_s"] / done["duration_s"])
        time.sleep(_LOOK)
        run = rest.get(f"/runs/{run['id']}")
    if run["outcome"] != "clean":
        raise RunSpoiledError(f"the run of {method} is {run['outcome'] or run['state']}: {run['reason']}")
    return str(run["id"])


def await_fit(rest: Rest, run_id: str) -> None:
    """Wait for the worker.

    Raises:
        RunError: the identification failed, or takes too long.
    """
    deadline = time.monotonic() + _IDENTIFIED_WITHIN
    while not (job := _identification(rest, run_id)) or job["state"] not in _OVER:
        if time.monotonic() > deadline:
            raise RunError(f"the identification of {run_id} has not ended within {_IDENTIFIED_WITHIN:g} s")
        time.sleep(_LOOK)
    if job["state"] != "done":
        raise RunError(f"the identification of {run_id} {job['state']}: {job['error']}")


def _identification(rest: Rest, run_id: str) -> dict[str, Any] | None:
    jobs: list[dict[str, Any]] = rest.get(f"/runs/{run_id}")["jobs"]
    return jobs[-1] if jobs else None
