"""Configuration of a bench (``bench.toml``)."""

from bench.config.bench_config import AgentSection, BenchConfig, ChannelSection, compute_identity, load_config
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
    "AgentSection",
    "AsciiLoadCellSection",
    "BenchConfig",
    "ChannelSection",
    "CoilAmplifierSection",
    "InstrumentSection",
    "LoadCellSection",
    "LvdtSection",
    "ModbusSection",
    "ThermometerSection",
    "compute_identity",
    "load_config",
]
