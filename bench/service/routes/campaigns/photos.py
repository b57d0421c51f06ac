"""Photos of operators, as files in the data folder."""

import base64
import binascii
from pathlib import Path

from bench.campaigns import CampaignError
from bench.errors import LogError
from bench.log import write_atomically

_BEGINNINGS = {b"\xff\xd8\xff": ".jpg", b"\x89PNG\r\n\x1a\n": ".png"}
"""Extension by the first bytes of a file."""
_MEDIA_TYPES = {".jpg": "image/jpeg", ".png": "image/png"}


def save_photo(folder: Path, name: str, encoded: str) -> str:
    """Write a photo into a folder and return its file name.

    Args:
        folder: data folder.
        name: file name without extension.
        encoded: base64 of a JPEG or PNG file.

    Raises:
        CampaignError: it is neither, or cannot be written.
    """
    try:
        content = base64.b64decode(encoded, validate=True)
    except (binascii.Error, ValueError):
        raise CampaignError("the photo is not valid base64; nothing was answered") from None
    extension = next((end for begin, end in _BEGINNINGS.items() if content.startswith(begin)), None)
    if extension is None:
        raise CampaignError("the photo is neither JPEG nor PNG; nothing was answered")
    path = folder / f"{name}{extension}"
    try:
        with write_atomically(path) as partial:
            partial.write_bytes(content)
    except LogError as error:
        raise CampaignError(str(error)) from None
    return path.name


def get_media_type(path: Path) -> str:
    """Return the media type of a stored photo."""
    return _MEDIA_TYPES[path.suffix]
