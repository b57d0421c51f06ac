"""What a log says of the bench that made it: header, and the documents that go with it."""

import platform
from collections.abc import Callable, Mapping
from datetime import timedelta
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import orjson

from bench.errors import RunError
from bench.methods import Method
from bench.recorder.header import Channel, RunHeader
from bench.replay.raw import DESCRIPTIONS
from bench.rig.clock_map import ClockMap
from bench.rig.config import AsciiLoadCellSection, BenchConfig, ChannelSection, LoadCellSection
from bench.rig.instruments import Rig
from bench.run_from_plant import Identity
from drivers.ascii_load_cell_stream import CONTRACT as ASCII_LOAD_CELL
from drivers.modbus_registers import load_map
from drivers.replay import describe

RESAMPLED = (
    "samples stand at the load cell's own conversions on the bench clock; displacement is brought there along a "
    "cubic, drive and actuator position along straight lines, temperature holds its latest reading"
)
NOT_CALIBRATED = "none given"
_UNITS = {
    "displacement": "m",
    "force": "N",
    "actuator_position": "m",
    "coil_voltage": "V",
    "coil_current": "A",
    "temperature": "degC",
}


class Document(NamedTuple):
    """A file that is kept in the log."""

    name: str
    media_type: str
    data: bytes


class LogFacts(NamedTuple):
    """What a log says beside what happens in it."""

    header: RunHeader
    documents: list[Document]
    decoders: Callable[[], Document]
    """Where each instrument's decoder stands, asked for once frames are recorded: replays begin there."""
    clocks: Callable[[], dict[str, str]]
    """What is known of each device's clock, asked for in the end."""


def run_header(
    method: Method, identity: Identity, config: BenchConfig, rig: Rig, maps: Mapping[str, ClockMap], bench_ns: int
) -> RunHeader:
    """What is known when the log is opened.

    Args:
        method: that is run.
        identity: whose run it is; its start is UTC now.
        config: of the bench.
        rig: its instruments.
        maps: of their clocks, by name.
        bench_ns: bench clock now [ns].
    """
    return RunHeader(
        id=identity.run_id(method),
        specimen=identity.specimen,
        method=method.name,
        operator=identity.operator,
        drive_kind=rig.drive_kind,
        drive_unit="A" if rig.drive_unit == "A" else "V",
        source="run",
        versions={"mrbench": version("mrbench"), "python": platform.python_version(), "numpy": np.__version__},
        utc_offset=(identity.started - timedelta(microseconds=bench_ns / 1000)).isoformat(),
        velocity_from="smoothed displacement",
        resampled=RESAMPLED,
        calibration=_calibration(config, rig),
        clocks=clock_words(rig, maps),
        channels=_channels(config, rig),
    )


def clock_words(rig: Rig, maps: Mapping[str, ClockMap]) -> dict[str, str]:
    """Each device's clock as JSON: its channels, how fast it runs [ppm], and what its mapping leaves [s]."""
    words = {}
    for one in rig.named:
        clock = maps[one.name]
        facts: dict[str, Any] = {"channels": [channel.name for channel in one.instrument.channels]}
        facts |= {"ppm": None, "offset_s": None, "skew_s": None}
        if clock.known:
            facts |= {"ppm": round(clock.rate() * 1e6, 3), "skew_s": clock.skew()}
            facts["offset_s"] = float(clock.bench_ns(0)) * 1e-9
        words[one.name] = orjson.dumps(facts).decode()
    return words


def documents(method: Method, config: BenchConfig, rig: Rig, source: Path | None) -> list[Document]:
    """Method, configuration, instruments and certificates.

    Args:
        method: that is run.
        config: of the bench.
        rig: its instruments.
        source: the file of the configuration; none if there is none.

    Raises:
        RunError: a certificate that the configuration names is not there.
    """
    kept = [Document("method.json", "application/json", method.to_json().encode())]
    if source is not None:
        kept.append(Document("bench.toml", "application/toml", _bytes(source)))
    described = orjson.dumps(_instruments(rig), option=orjson.OPT_INDENT_2)
    kept.append(Document("instruments.json", "application/json", described))
    folder = Path() if source is None else source.parent
    named = sorted({section.certificate for section in config.channels.values() if section.certificate})
    kept += [Document(Path(one).name, "application/octet-stream", _bytes(folder / one)) for one in named]
    return kept


def decoders(rig: Rig) -> Document:
    """Where each instrument's decoder stands now."""
    found = {one.name: describe(one.instrument) for one in rig.named}
    return Document(DESCRIPTIONS, "application/json", orjson.dumps(found))


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise RunError(
            f"{path} belongs into the log and cannot be read ({error.strerror}); see bench.toml"
        ) from None


def _instruments(rig: Rig) -> dict[str, Any]:
    return {
        one.name: {
            "driver": one.driver,
            "address": one.address,
            "channels": [
                {"name": channel.name, "unit": channel.unit, "low": channel.low, "high": channel.high}
                for channel in one.instrument.channels
            ],
        }
        for one in rig.named
    }


def _calibration(config: BenchConfig, rig: Rig) -> dict[str, str]:
    return {
        name: (section.calibration or NOT_CALIBRATED)
        + (f"; certificate {Path(section.certificate).name}" if section.certificate else "")
        for name, section in _sections(config, rig).items()
    }


def _channels(config: BenchConfig, rig: Rig) -> dict[str, Channel]:
    rates = _rates(config, rig)
    return {
        name: Channel(
            unit=rig.drive_unit if name == "coil_drive" else _UNITS[name],
            rate_hz=rates[name],
            filter=None
            if section.filter is None
            else {"kind": section.filter.kind, "order": section.filter.order, "cutoff_hz": section.filter.cutoff},
            delay_s=section.delay,
        )
        for name, section in _sections(config, rig).items()
    }


def _sections(config: BenchConfig, rig: Rig) -> dict[str, ChannelSection]:
    """What is known of each channel that this bench records; the drive is the channel that measures it."""
    there = [name for name in _UNITS if name != "temperature" or rig.thermometer is not None]
    known: Mapping[str, ChannelSection] = {str(name): section for name, section in config.channels.items()}
    sections = {name: known.get(name, ChannelSection()) for name in there}
    return {**sections, "coil_drive": sections[rig.drive_channel]}


def _rates(config: BenchConfig, rig: Rig) -> dict[str, float]:
    """[Hz] at which each channel is sampled by its instrument."""

    def ring(instrument: str) -> float:
        return float(load_map(instrument).document["ring"]["rate"])

    amplifier = ring("coil_amplifier")
    return {
        "displacement": ring("lvdt"),
        "force": force_rate(config),
        "actuator_position": 1 / rig.actuator.settings.cycle,
        "coil_voltage": amplifier,
        "coil_current": amplifier,
        "coil_drive": amplifier,
        "temperature": ring("thermometer"),
    }


def force_rate(config: BenchConfig) -> float:
    """[Hz] at which the load cell samples, and the bench with it."""
    for section in config.instruments.values():
        if isinstance(section, LoadCellSection):
            return float(section.rate)
        if isinstance(section, AsciiLoadCellSection):
            break
    # An indicator does not say how often it sends; more often than this it cannot.
    return float(max(ASCII_LOAD_CELL["instrument"]["rates_hz"]))
