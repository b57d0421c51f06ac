"""List of the channels as JSON, in the order in which a batch contains them."""

from typing import Any

import orjson

from bench.errors import LiveDataError
from bench.live.batch import Channel


def describe_channels(channels: tuple[Channel, ...]) -> list[dict[str, str]]:
    """Return the channels for JSON."""
    return [channel._asdict() for channel in channels]


def parse_channels(content: bytes | list[Any]) -> tuple[Channel, ...]:
    """Return the channels of a list, or of its JSON.

    Raises:
        LiveDataError: it is not a list of channels.
    """
    try:
        described = orjson.loads(content) if isinstance(content, bytes) else content
        return tuple(Channel(str(one["name"]), str(one["unit"])) for one in described)
    except (ValueError, KeyError, TypeError) as error:
        raise LiveDataError(f"not a list of channels ({error!r}); use the version of the service") from error
