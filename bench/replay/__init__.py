"""Replay of a log: its raw frames through the drivers' decoders, its samples to live views."""

from bench.replay.compare import ReplayResult, replay_frames
from bench.replay.player import parse_speed, play_log
from bench.replay.selection import Selection

__all__ = [
    "ReplayResult",
    "Selection",
    "parse_speed",
    "play_log",
    "replay_frames",
]
