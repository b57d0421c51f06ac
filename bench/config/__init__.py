"""Configuration of a bench (``bench.toml``)."""

from bench.config.bench_config import BenchConfig, ChannelSection, load_config
from bench.config.instruments import (
    ActuatorSection,
    AsciiLoadCellSection,
    CoilAmplifierSection,
    InstrumentSection,
    LoadCellSection,
    LvdtSection,
    ModbusSection,
    ThermometerSection,
)

__all__ = [
    "ActuatorSection",
    "AsciiLoadCellSection",
    "BenchConfig",
    "ChannelSection",
    "CoilAmplifierSection",
    "InstrumentSection",
    "LoadCellSection",
    "LvdtSection",
    "ModbusSection",
    "ThermometerSection",
    "load_config",
]
