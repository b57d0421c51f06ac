"""Commands that copy a data folder and restore it."""

from bench.commands.backup.back_up import backup
from bench.commands.backup.restore import restore

__all__ = ["backup", "restore"]
