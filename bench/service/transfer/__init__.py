"""Files that come in and go out: uploads of recordings, and commands that convert files for a request."""

from bench.service.transfer.command import run_command
from bench.service.transfer.folder import make_folder, remove_leftovers, send_temporary_file
from bench.service.transfer.intake import MAX_UPLOAD_SIZE, ReceivedFile, import_files
from bench.service.transfer.names import make_log_name

__all__ = [
    "MAX_UPLOAD_SIZE",
    "ReceivedFile",
    "import_files",
    "make_folder",
    "make_log_name",
    "remove_leftovers",
    "run_command",
    "send_temporary_file",
]
