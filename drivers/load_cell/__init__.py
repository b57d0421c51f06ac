"""Drivers of the load cells: a framed binary stream, and the text lines of a weighing indicator."""

from drivers.load_cell.ascii_decoder import AsciiLoadCellDecoder
from drivers.load_cell.ascii_load_cell import AsciiLoadCell
from drivers.load_cell.decoder import LoadCellDecoder
from drivers.load_cell.load_cell import LoadCell
from drivers.load_cell.stream_decoder import StreamDecoder

__all__ = [
    "AsciiLoadCell",
    "AsciiLoadCellDecoder",
    "LoadCell",
    "LoadCellDecoder",
    "StreamDecoder",
]
