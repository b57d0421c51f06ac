"""Log files to arrays."""

from identification.logs.channel_info import ChannelFilter
from identification.logs.recording import PERIODIC_MOTIONS, Recording, Segment, Stretch, load

__all__ = [
    "PERIODIC_MOTIONS",
    "ChannelFilter",
    "Recording",
    "Segment",
    "Stretch",
    "load",
]
