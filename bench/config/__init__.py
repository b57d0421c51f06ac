"""Configuration of a bench (``bench.toml``)."""

from bench.config.bench_config import (
    CHANNEL_UNITS,
    AgentSection,
    BenchConfig,
    CalibrationSection,
    ChannelName,
    ChannelSection,
    compute_identity,
    load_config,
)
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
    "CHANNEL_UNITS",
    "ActuatorSection",
    "AgentSection",
    "AsciiLoadCellSection",
    "BenchConfig",
    "CalibrationSection",
    "ChannelName",
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
