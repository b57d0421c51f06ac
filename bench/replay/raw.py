"""Raw content of a log: frames, readings and decoder snapshot of each instrument."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import orjson
from mcap.reader import make_reader

from bench.errors import LogError
from bench.log import (
    DAMAGE_ERRORS,
    DECODERS_FILE,
    INSTRUMENT,
    WIRE,
    check_complete,
    check_profile,
    convert_file_errors,
    parse_blocks,
    parse_frames,
)
from drivers import Frame, SampleBlock


class RawRecording(NamedTuple):
    """Raw content of a log about one instrument."""

    frames: list[Frame]
    blocks: list[SampleBlock]
    """Recorded readings."""
    description: dict[str, Any] | None
    """Snapshot of its decoder; None if the log contains none."""


def read_raw_recordings(path: Path) -> dict[str, RawRecording]:
    """Read frames and readings of a log by instrument; empty for a log that was recorded without wires.

    Raises:
        LogError: the file does not exist, is not an mrbench log, or is truncated or damaged.
    """
    try:
        frames, blocks = _read_frames_and_blocks(path)
        descriptions = _read_descriptions(path)
    except (*DAMAGE_ERRORS, orjson.JSONDecodeError, KeyError, ValueError) as error:
        raise LogError(f"{path}: the log is damaged ({error!r}); run `mrbench salvage {path}`") from error
    names = sorted({*frames, *blocks})
    return {
        name: RawRecording(frames.get(name, []), blocks.get(name, []), descriptions.get(name)) for name in names
    }


def _read_messages(path: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    with convert_file_errors(path), path.open("rb") as file:
        check_complete(path, file)
        reader = make_reader(file, validate_crcs=True)
        check_profile(path, reader.get_header().profile)
        for _, channel, message in reader.iter_messages(log_time_order=False):
            if channel.topic.startswith((WIRE, INSTRUMENT)):
                yield channel.topic, orjson.loads(message.data)


def _read_frames_and_blocks(path: Path) -> tuple[dict[str, list[Frame]], dict[str, list[SampleBlock]]]:
    frames: dict[str, list[Frame]] = {}
    blocks: dict[str, list[SampleBlock]] = {}
    for topic, content in _read_messages(path):
        if topic.startswith(WIRE):
            frames.setdefault(topic.removeprefix(WIRE), []).extend(parse_frames(content))
        elif topic.startswith(INSTRUMENT):
            blocks.setdefault(topic.removeprefix(INSTRUMENT), []).extend(parse_blocks(content))
    return frames, blocks


def _read_descriptions(path: Path) -> dict[str, Any]:
    with convert_file_errors(path), path.open("rb") as file:
        for document in make_reader(file).iter_attachments():
            if document.name == DECODERS_FILE:
                found: dict[str, Any] = orjson.loads(document.data)
                return found
    return {}
