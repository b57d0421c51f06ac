"""`mrbench check`: checks of the channels in a data folder, and their control charts."""

from bench.commands.check.dispatch import check

__all__ = ["check"]
