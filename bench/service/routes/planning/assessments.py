"""Assessment of what strokes can identify, one at a time, and kept for each content of a method."""

import threading
from functools import lru_cache
from typing import Any

from bench.errors import MethodError, RunError
from bench.methods import Method, Programme, compile_method
from bench.runs import FORESEE_COMMAND, assess_design

MAX_SAMPLES = 2_000_000
"""Largest number of samples of an assessed method, which limits its memory; half an hour at 1 kHz."""
_CACHED = 200
"""Number of assessments that are kept."""
_LOWEST_PRIORITY = ("nice", "-n", "19")
"""Command that leaves the processor to the rig agent."""
_assessing = threading.Lock()
"""Held during an assessment, so that there is one at a time, and an equal request waits for its result."""


def assess_programme(programme: Programme) -> dict[str, Any]:
    """Return the `mrbench.foresight/1` document of a programme; that of an equal method is kept.

    Raises:
        RunError: the assessment fails, or the method is too long for it.
    """
    try:
        with _assessing:
            return _assess(programme.method.to_json())
    except MethodError as error:
        raise RunError(str(error)) from None


@lru_cache(_CACHED)
def _assess(document: str) -> dict[str, Any]:
    programme = compile_method(Method.model_validate_json(document), MAX_SAMPLES)
    return assess_design(programme, command=(*_LOWEST_PRIORITY, *FORESEE_COMMAND))
