"""What can be done before a run, by name; apart from the messages, so that the command line lists it at once."""

from typing import Literal, TypeAlias

Step: TypeAlias = Literal["home", "move", "mount", "centre", "unmount", "tare", "clear-tare"]
"""What can be done before a run."""
MOVING: tuple[Step, ...] = ("home", "move")
"""Those in which the rod moves."""
