"""Photos of persons in a campaign report, reduced to the size at which a page shows them."""

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

from bench.campaigns import CampaignState
from bench.report.layout import Picture

LARGEST_SIDE = 1200
"""[pixel] Longest side of a photo in a report."""
MAX_PHOTOS = 100
"""Largest number of photos in a report, those of the newest answers."""
_PART_OF_WIDTH = 0.6
"""[1] Part of the text's width that a photo fills at most; an upright one fills less."""
_QUALITY = 85


def make_photos(state: CampaignState, folder: Path) -> Mapping[str, Picture]:
    """Return the photos of the answers that can be shown, by the id of their step.

    Args:
        state: state of the campaign.
        folder: data folder with the photos.
    """
    items = [item for item in state.items if item.photo][-MAX_PHOTOS:]
    made = ((item, _reduce(folder / item.photo)) for item in items)
    return {
        item.id: Picture(
            f"Photo to step {item.id}: {item.label}", item.note or item.photo, content, "image/jpeg", part
        )
        for item, (content, part) in made
        if content
    }


def name_photo(item: str) -> str:
    """Return the name of the picture of a step's photo."""
    return f"photo-{item}"


def _reduce(path: Path) -> tuple[bytes, float]:
    """Return a photo as a small JPEG file, and the part of the width that it fills; empty if it cannot be read."""
    # Only here: service and worker import this package at once, and show no photo.
    from PIL import Image, ImageOps

    try:
        with Image.open(path) as opened:
            photo = ImageOps.exif_transpose(opened).convert("RGB")
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError):
        return b"", 0.0
    photo.thumbnail((LARGEST_SIDE, LARGEST_SIDE))
    buffer = BytesIO()
    photo.save(buffer, "JPEG", quality=_QUALITY)
    return buffer.getvalue(), _PART_OF_WIDTH * min(1.0, photo.width / photo.height)
