"""Uploaded recordings: CSV files are imported to one log, a log is taken as it is.

Everything is prepared in a hidden folder and renamed at the end, so that no other part sees half a log.
"""

import asyncio
import shutil
from collections.abc import AsyncIterator, Iterator, Sequence
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path
from typing import IO, NamedTuple

from bench.catalogue import LogSummary, read_log_summary
from bench.errors import LogError, RecordingError
from bench.service.transfer.command import run_command
from bench.service.transfer.folder import make_folder
from bench.service.transfer.names import make_safe_name

MAX_UPLOAD_SIZE = 500_000_000
"""Largest upload [bytes]: a CSV of two hours at 1 kHz has about 400 MB."""
_CSV_ENDINGS = (".csv", ".csv.gz")
_LOG_ENDING = ".mcap"


class ReceivedFile(NamedTuple):
    """Uploaded file with the name that it had at its origin."""

    name: str
    content: IO[bytes]


@asynccontextmanager
async def import_files(
    data: Path, files: Sequence[ReceivedFile], options: Sequence[str], specimen: str
) -> AsyncIterator[tuple[Path, LogSummary]]:
    """Provide the log of uploaded files in a hidden folder, which is deleted afterwards.

    Args:
        data: data folder.
        files: one or several CSV files, or one log.
        options: further options of `mrbench import`, for CSV files only.
        specimen: damper under test, for CSV files only; empty if it is not known.

    Yields:
        Path of the log, to be renamed, and its summary.

    Raises:
        RecordingError: a file is refused, with its row and column, or cannot be stored.
    """
    given = [*options, *([f"--specimen={specimen}"] if specimen else [])]
    with _convert_disk_errors(data):
        folder = await asyncio.to_thread(make_folder, data)
    try:
        yield await asyncio.to_thread(_make_log, folder, files, given)
    finally:
        await asyncio.to_thread(shutil.rmtree, folder, ignore_errors=True)


def _make_log(folder: Path, files: Sequence[ReceivedFile], options: Sequence[str]) -> tuple[Path, LogSummary]:
    """Write the files into a folder, and return the path of their log and its summary."""
    with _convert_disk_errors(folder.parent):
        paths = [_store(folder / str(index), file) for index, file in enumerate(files)]
    log = _import(folder / "import.mcap", paths, options) if _are_csv(paths) else _take_log(paths, options)
    try:
        return log, read_log_summary(log)
    except LogError as error:
        raise RecordingError(str(error).replace(str(log), log.name)) from error


@contextmanager
def _convert_disk_errors(data: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise RecordingError(f"the upload cannot be stored in {data}: {reason}; nothing was kept") from error


def _store(folder: Path, file: ReceivedFile) -> Path:
    """Write a file into a folder of its own, because two files may have the same name."""
    folder.mkdir()
    path = folder / make_safe_name(file.name)
    with path.open("wb") as target:
        shutil.copyfileobj(file.content, target, 1 << 20)
    return path


def _are_csv(paths: Sequence[Path]) -> bool:
    return all(path.name.lower().endswith(_CSV_ENDINGS) for path in paths)


def _take_log(paths: Sequence[Path], options: Sequence[str]) -> Path:
    """Return the only file, which has to be a log."""
    known = (*_CSV_ENDINGS, _LOG_ENDING)
    unknown = next((path.name for path in paths if not path.name.lower().endswith(known)), None)
    if unknown is not None:
        raise RecordingError(f"{unknown}: the ending is not one of {', '.join(known)}; upload a recording")
    if len(paths) > 1:
        raise RecordingError(f"{len(paths)} files with a log among them; upload each log alone")
    if options:
        raise RecordingError(f"{paths[0].name}: a log names its specimen and columns itself; give the file only")
    return paths[0]


def _import(log: Path, files: Sequence[Path], options: Sequence[str]) -> Path:
    # The command in a process: it may need seconds and much memory for a long recording.
    run_command(["import", *options, "--out", str(log), "--", *map(str, files)], RecordingError)
    return log
