"""What a log holds of instruments and wires, message by message."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import orjson
from mcap.reader import make_reader

from bench.errors import LogError
from bench.recorder.mcap_file import DAMAGE, file_errors
from bench.recorder.messages import INSTRUMENT, WIRE
from bench.recorder.reader import check_profile, check_whole
from bench.recorder.readings import blocks_of, frames_of
from drivers.channel import Block, Frame

DESCRIPTIONS = "decoders.json"
"""Attachment: what each instrument's decoder needs beside the frames, by name."""


class Raw(NamedTuple):
    """One instrument as a log has it."""

    frames: list[Frame]
    blocks: list[Block]
    """Its recorded readings."""
    description: dict[str, Any] | None
    """Of its decoder; none where the log has none."""


def read_raw(path: Path) -> dict[str, Raw]:
    """Frames and readings of a log, by instrument; empty for a log that was made without wires.

    Raises:
        LogError: there is no such file, it is no log of ours, is cut off or damaged.
    """
    frames: dict[str, list[Frame]] = {}
    blocks: dict[str, list[Block]] = {}
    try:
        for topic, content in _messages(path):
            if topic.startswith(WIRE):
                frames.setdefault(topic.removeprefix(WIRE), []).extend(frames_of(content))
            elif topic.startswith(INSTRUMENT):
                blocks.setdefault(topic.removeprefix(INSTRUMENT), []).extend(blocks_of(content))
        descriptions = _descriptions(path)
    except (*DAMAGE, orjson.JSONDecodeError, KeyError, ValueError) as error:
        raise LogError(f"{path}: the log is damaged ({error!r}); run `mrbench salvage {path}`") from error
    names = sorted({*frames, *blocks})
    return {name: Raw(frames.get(name, []), blocks.get(name, []), descriptions.get(name)) for name in names}


def _messages(path: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    with file_errors(path), path.open("rb") as file:
        check_whole(path, file)
        reader = make_reader(file, validate_crcs=True)
        check_profile(path, reader.get_header().profile)
        for _, channel, message in reader.iter_messages(log_time_order=False):
            if channel.topic.startswith((WIRE, INSTRUMENT)):
                yield channel.topic, orjson.loads(message.data)


def _descriptions(path: Path) -> dict[str, Any]:
    with file_errors(path), path.open("rb") as file:
        for document in make_reader(file).iter_attachments():
            if document.name == DESCRIPTIONS:
                found: dict[str, Any] = orjson.loads(document.data)
                return found
    return {}
