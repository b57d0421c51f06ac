"""Live data: batches of samples of all channels, their decimation, and their distribution to listeners."""

from bench.live.batch import MAX_SEQUENCE, Channel, LiveBatch, decode_batch
from bench.live.batch_maker import BatchMaker
from bench.live.broadcaster import LiveBroadcaster, serialise_message
from bench.live.channels import describe_channels, parse_channels
from bench.live.decimation import decimate
from bench.live.listener import Listener, ListenerSettings

__all__ = [
    "MAX_SEQUENCE",
    "BatchMaker",
    "Channel",
    "Listener",
    "ListenerSettings",
    "LiveBatch",
    "LiveBroadcaster",
    "decimate",
    "decode_batch",
    "describe_channels",
    "parse_channels",
    "serialise_message",
]
