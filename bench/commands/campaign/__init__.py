"""`mrbench campaign`: its actions, one module each."""

from bench.commands.campaign.dispatch import campaign

__all__ = ["campaign"]
