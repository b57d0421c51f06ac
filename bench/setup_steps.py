"""Names of the setup steps; apart from the messages, so that the command line can list them at once."""

from typing import Literal, TypeAlias

SetupStep: TypeAlias = Literal["home", "move", "mount", "centre", "unmount", "tare", "clear-tare"]
"""Operation before a run."""
MOVING_STEPS: tuple[SetupStep, ...] = ("home", "move")
"""Steps in which the rod moves."""
