"""Commands that copy a data folder, restore it, and move its catalogue to another database."""

from bench.commands.backup.back_up import backup
from bench.commands.backup.restore import restore
from bench.commands.backup.transfer import transfer

__all__ = ["backup", "restore", "transfer"]
