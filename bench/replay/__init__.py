"""Plays a log back: its raw frames through the decoders that made it, its samples to a live view."""

from bench.replay.compare import replay_frames
from bench.replay.player import parse_speed, play_log

__all__ = [
    "parse_speed",
    "play_log",
    "replay_frames",
]
