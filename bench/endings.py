"""Endings of a run, shared by the agent's messages, the log and the catalogue."""

from collections.abc import Mapping
from typing import Literal, TypeAlias, cast, get_args

RunEnding: TypeAlias = Literal["completed", "stopped", "aborted", "tripped"]
"""Ending of a run, apart from its outcome, which describes the log.

completed: the method was played to its end; stopped: in a controlled way, by a person or a campaign; aborted: at
once, by a person; tripped: by the bench itself, after an interlock, a failed instrument or a failed recorder."""
STOP_REASON = "stopped on request"
"""Reason of a run that a person has stopped."""
ABORT_REASON = "aborted by a person"
"""Reason of a trip by a person."""
SHUT_DOWN_REASON = "the agent was shut down"
"""Reason of a run whose agent was ended in order."""
_LIMIT_WORDS = "exceeds the limit of"
"""Words in the reason of every run that an exceeded limit has ended."""


def derive_ending(outcome: str | None, reason: str) -> RunEnding | None:
    """Derive the ending of a run from an older log or catalogue, which contains none.

    Args:
        outcome: outcome of the log; None without one.
        reason: reason of the outcome.

    Returns:
        The ending, or None if outcome and reason do not determine it.
    """
    if outcome in ("clean", "lossy"):
        return "completed"
    if outcome != "incomplete":
        return None
    if reason in (STOP_REASON, SHUT_DOWN_REASON):
        return "stopped"
    return "tripped" if _LIMIT_WORDS in reason else None


def read_ending(record: Mapping[str, str]) -> RunEnding | None:
    """Return the ending in a log's metadata record `outcome`, or derive it for a log of an older version."""
    ending = record.get("ending")
    if ending in get_args(RunEnding):
        return cast(RunEnding, ending)
    return derive_ending(record.get("outcome"), record.get("reason", ""))
