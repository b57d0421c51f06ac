"""Configuration of a bench (``bench.toml``), and names of the benches of a service."""

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
from bench.config.bench_names import (
    BENCHES_FILE,
    DEFAULT_BENCH,
    check_bench_name,
    choose_bench,
    find_bench,
    get_executor,
    write_benches,
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
    "BENCHES_FILE",
    "CHANNEL_UNITS",
    "DEFAULT_BENCH",
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
    "check_bench_name",
    "choose_bench",
    "compute_identity",
    "find_bench",
    "get_executor",
    "load_config",
    "write_benches",
]
