"""Photos of operators, as files in the data folder."""

import base64
import binascii
from pathlib import Path

from bench.campaigns.document import CampaignError
from bench.campaigns.store import StoredCampaign
from bench.errors import LogError
from bench.log import write_atomically

MAX_PHOTO_SIZE = 3_000_000
"""[byte] Largest photo; base64 needs a third more, and a request has at most 4 MiB."""
_BEGINNINGS = {b"\xff\xd8\xff": ".jpg", b"\x89PNG\r\n\x1a\n": ".png"}
"""Extension by the first bytes of a file."""
_MEDIA_TYPES = {".jpg": "image/jpeg", ".png": "image/png"}


def decode_photo(encoded: str) -> bytes:
    """Return the content of a photo from its base64.

    Raises:
        CampaignError: it is no base64.
    """
    try:
        return base64.b64decode(encoded, validate=True)
    except (binascii.Error, ValueError):
        raise CampaignError("the photo is not valid base64; nothing was answered") from None


def read_photo(path: Path) -> bytes:
    """Return the content of a photo file.

    Raises:
        CampaignError: the file cannot be read.
    """
    try:
        return path.read_bytes()
    except OSError as error:
        raise CampaignError(f"the photo {path} cannot be read ({error.strerror}); nothing was answered") from None


def save_photo(folder: Path, campaign: StoredCampaign, content: bytes) -> str:
    """Write the photo to the question of a campaign into a folder and return its file name.

    Args:
        folder: data folder.
        campaign: campaign that asks.
        content: a JPEG or PNG file.

    Raises:
        CampaignError: nothing is asked, or the photo is too large, of another kind, or cannot be written.
    """
    active = campaign.state.active
    if active is None or not campaign.state.needs_person:
        raise CampaignError(f"campaign {campaign.state.campaign.name} asks for nothing at present")
    path = folder / f"{campaign.id}-{active.item}-photo{_find_extension(content)}"
    try:
        with write_atomically(path) as partial:
            partial.write_bytes(content)
    except LogError as error:
        raise CampaignError(str(error)) from None
    return path.name


def _find_extension(content: bytes) -> str:
    """Return the extension of a photo by its content.

    Raises:
        CampaignError: it is too large, or neither JPEG nor PNG.
    """
    if len(content) > MAX_PHOTO_SIZE:
        raise CampaignError(
            f"the photo has {len(content) / 1e6:.1f} MB, at most {MAX_PHOTO_SIZE / 1e6:g} MB are kept;"
            " reduce it; nothing was answered"
        )
    extension = next((end for begin, end in _BEGINNINGS.items() if content.startswith(begin)), None)
    if extension is None:
        raise CampaignError("the photo is neither JPEG nor PNG; nothing was answered")
    return extension


def get_media_type(path: Path) -> str:
    """Return the media type of a stored photo."""
    return _MEDIA_TYPES[path.suffix]
