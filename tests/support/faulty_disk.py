"""Command line in place of mrbench, with a disk that stalls or becomes read-only while a log is written.

``python -m tests.support.faulty_disk stalls|read_only rig ...``. Both begin some syncs after the start of a log.
The fault is injected where logs are passed to the disk: a mounted file system does not stall when asked to.
"""

import errno
import os
import sys
import time
from types import SimpleNamespace

COMMAND = (sys.executable, "-m", "tests.support.faulty_disk")
GOOD_SYNCS = 4
"""Number of syncs before the fault: about a second of a log."""
STALL = 8.0
"""Duration of the one stall [s], in which more than half of the queue of the recorder fills."""


class FaultyDisk:
    """Replacement of `os.fsync`."""

    def __init__(self, fault):
        self._fault, self._syncs = fault, 0

    def sync(self, file):
        self._syncs += 1
        if self._fault == "read_only" and self._syncs > GOOD_SYNCS:
            raise OSError(errno.EROFS, os.strerror(errno.EROFS))
        if self._fault == "stalls" and self._syncs == GOOD_SYNCS:
            time.sleep(STALL)
        os.fsync(file)


def main(fault, *arguments):
    import bench.log.chunked_writer as log_files
    from bench.cli import main as run_mrbench

    log_files.os = SimpleNamespace(fsync=FaultyDisk(fault).sync)  # of logs alone
    sys.argv = ["mrbench", *arguments]
    return run_mrbench()


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
