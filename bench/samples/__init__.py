"""Samples of recorded runs for viewers and clients: stored as columns, decimated, and as binary batches."""

from bench.samples.batches import decode_batches, encode_batches
from bench.samples.decimation import select_extremes
from bench.samples.store import SampleStore
from bench.samples.table import Channel, Column, SampleTable, SegmentRange, make_table

__all__ = [
    "Channel",
    "Column",
    "SampleStore",
    "SampleTable",
    "SegmentRange",
    "decode_batches",
    "encode_batches",
    "make_table",
    "select_extremes",
]
