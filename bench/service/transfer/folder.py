"""Hidden folders for files that are being made, in the data folder, where the space is that recordings need."""

import shutil
from collections.abc import Callable
from pathlib import Path
from tempfile import mkdtemp

from fastapi.responses import FileResponse
from starlette.background import BackgroundTask

from bench.service.transfer.names import make_safe_name

PREFIX = ".transfer-"
"""Start of their names."""


def make_folder(data: Path) -> Path:
    """Create a hidden folder in the data folder.

    Raises:
        OSError: the data folder cannot be written to.
    """
    return Path(mkdtemp(prefix=PREFIX, dir=data))


def remove_leftovers(data: Path) -> None:
    """Delete the folders that a kill of the service has left."""
    for folder in data.glob(f"{PREFIX}*"):
        shutil.rmtree(folder, ignore_errors=True)


def send_temporary_file(
    data: Path, name: str, media_type: str, write: Callable[[str], None], *, inline: bool = False
) -> FileResponse:
    """Make a file and return it; it is deleted once it was sent.

    Args:
        data: data folder.
        name: name under which it is saved.
        media_type: of its content.
        write: writes the file to the given path.
        inline: shown by a browser instead of saved.
    """
    folder = make_folder(data)
    path = folder / make_safe_name(name)
    try:
        write(str(path))
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise
    response = FileResponse(
        path,
        stat_result=path.stat(),
        media_type=media_type,
        filename=path.name,
        content_disposition_type="inline" if inline else "attachment",
        background=BackgroundTask(shutil.rmtree, folder, ignore_errors=True),
    )
    del response.headers["etag"]  # the same content has another file each time
    return response
