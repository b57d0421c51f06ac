"""Decoding of recorded frames by the drivers' own decoders."""

from drivers.replay.decoder import make_decoder
from drivers.replay.decoder_snapshot import snapshot_decoder

__all__ = [
    "make_decoder",
    "snapshot_decoder",
]
