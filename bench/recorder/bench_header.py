"""Header and attachments of a log: description of the bench, its instruments and its method."""

import platform
from collections.abc import Callable, Mapping
from datetime import date, timedelta
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import orjson

from bench.calibration import IssuedCertificate, make_attachment, make_log_text
from bench.config import CHANNEL_UNITS, AsciiLoadCellSection, BenchConfig, ChannelSection, LoadCellSection
from bench.errors import RunError
from bench.log import DECODERS_FILE, ChannelInfo, Identity, RunHeader
from bench.methods import Method
from bench.rig import ClockMap, Rig
from drivers import load_wire_file
from drivers.load_cell import LoadCell
from drivers.replay import snapshot_decoder
from drivers.transport import load_register_map

RESAMPLING_NOTE = (
    "samples are taken at the load cell's own conversions on the bench clock; displacement is interpolated by a "
    "cubic, drive and actuator position linearly, temperature holds its latest reading"
)
NO_CALIBRATION = "none given"


class Attachment(NamedTuple):
    """File kept inside a log."""

    name: str
    media_type: str
    data: bytes


class LogMetadata(NamedTuple):
    """Content of a log apart from its samples, marks and events."""

    header: RunHeader
    attachments: list[Attachment]
    describe_decoders: Callable[[], Attachment]
    """Returns the decoder snapshots; called when the recording of frames begins, so that replay starts there."""
    describe_clocks: Callable[[], dict[str, str]]
    """Returns the description of each device's clock; called at the end of the run."""


def make_run_header(
    method: Method,
    identity: Identity,
    config: BenchConfig,
    rig: Rig,
    maps: Mapping[str, ClockMap],
    bench_ns: int,
    certificates: Mapping[str, IssuedCertificate] = MappingProxyType({}),
) -> RunHeader:
    """Make the header that is written when the log is opened.

    Args:
        method: method of the run.
        identity: specimen, operator and start; the start is UTC now.
        config: configuration of the bench.
        rig: instruments of the bench.
        maps: clock map of each instrument by name.
        bench_ns: bench clock now [ns].
        certificates: certificates that apply, by channel.
    """
    return RunHeader(
        id=identity.make_run_id(method.name),
        specimen=identity.specimen,
        method=method.name,
        method_sha256=method.compute_sha256(),
        operator=identity.operator,
        drive_kind=rig.drive_kind,
        drive_unit="A" if rig.drive_unit == "A" else "V",
        source="run",
        versions={"mrbench": version("mrbench"), "python": platform.python_version(), "numpy": np.__version__},
        utc_offset=(identity.started - timedelta(microseconds=bench_ns / 1000)).isoformat(),
        velocity_from="smoothed displacement",
        resampled=RESAMPLING_NOTE,
        calibration=_describe_calibration(config, rig, certificates, identity.started.date()),
        clocks=describe_clocks(rig, maps),
        channels=make_channel_infos(config, rig),
    )


def describe_clocks(rig: Rig, maps: Mapping[str, ClockMap]) -> dict[str, str]:
    """Describe each device's clock as JSON: its channels, rate deviation [ppm], offset [s] and error bound [s]."""
    descriptions = {}
    for one in rig.instruments:
        clock = maps[one.name]
        is_known = clock.is_known
        values = {
            "channels": [channel.name for channel in one.instrument.channels],
            "ppm": round(clock.estimate_rate() * 1e6, 3) if is_known else None,
            "offset_s": float(clock.map_instants(0)) * 1e-9 if is_known else None,
            "clock_error_bound_s": clock.compute_error_bound() if is_known else None,
        }
        descriptions[one.name] = orjson.dumps(values).decode()
    return descriptions


def make_attachments(
    method: Method,
    config: BenchConfig,
    rig: Rig,
    source: Path | None,
    certificates: Mapping[str, IssuedCertificate] = MappingProxyType({}),
) -> list[Attachment]:
    """Collect method, configuration, instruments and certificates.

    Args:
        method: method of the run.
        config: configuration of the bench.
        rig: instruments of the bench.
        source: file of the configuration; None without one.
        certificates: certificates that apply, by channel.

    Raises:
        RunError: a certificate that the configuration names cannot be read.
    """
    attachments = [Attachment("method.json", "application/json", method.to_json().encode())]
    if source is not None:
        attachments.append(Attachment("bench.toml", "application/toml", _read_bytes(source)))
    instruments = orjson.dumps(_describe_instruments(rig), option=orjson.OPT_INDENT_2)
    attachments.append(Attachment("instruments.json", "application/json", instruments))
    applying = [certificates[name] for name in _find_channel_sections(config, rig) if name in certificates]
    attachments += [_make_certificate_attachment(issued) for issued in applying]
    return attachments + _read_certificates(config, Path() if source is None else source.parent)


def _make_certificate_attachment(issued: IssuedCertificate) -> Attachment:
    name, data = make_attachment(issued)
    return Attachment(name, "application/json", data)


def _read_certificates(config: BenchConfig, folder: Path) -> list[Attachment]:
    # As a set, because several channels may name the same certificate.
    names = sorted({section.certificate for section in config.channels.values() if section.certificate})
    return [Attachment(Path(one).name, "application/octet-stream", _read_bytes(folder / one)) for one in names]


def describe_decoders(rig: Rig) -> Attachment:
    """Return a snapshot of each instrument's decoder."""
    snapshots = {one.name: snapshot_decoder(one.instrument) for one in rig.instruments}
    return Attachment(DECODERS_FILE, "application/json", orjson.dumps(snapshots))


def _read_bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise RunError(
            f"{path} cannot be read ({error.strerror}), but belongs in the log; correct its name in bench.toml"
        ) from None


def _describe_instruments(rig: Rig) -> dict[str, Any]:
    return {
        one.name: {
            "driver": one.driver,
            "address": one.address,
            "serial": one.instrument.serial if isinstance(one.instrument, LoadCell) else None,
            "channels": [
                {"name": channel.name, "unit": channel.unit, "low": channel.low, "high": channel.high}
                for channel in one.instrument.channels
            ],
        }
        for one in rig.instruments
    }


def _describe_calibration(
    config: BenchConfig, rig: Rig, certificates: Mapping[str, IssuedCertificate], day: date
) -> dict[str, str]:
    """Return for each channel its certificate as JSON; without one, the text of the configuration."""
    texts = {}
    for name, section in _find_channel_sections(config, rig).items():
        attached = f"; certificate {Path(section.certificate).name}" if section.certificate else ""
        issued = certificates.get(rig.drive_channel if name == "coil_drive" else name)
        text = f"{section.calibration or NO_CALIBRATION}{attached}"
        texts[name] = text if issued is None else make_log_text(issued, day, f"{section.calibration}{attached}")
    return texts


def make_channel_infos(config: BenchConfig, rig: Rig) -> dict[str, ChannelInfo]:
    """Return the acquisition of each recorded channel; the drive is that of the channel that measures it."""
    rates = _find_rates(config, rig)
    return {
        name: ChannelInfo(
            unit=rig.drive_unit if name == "coil_drive" else CHANNEL_UNITS[name],
            rate_hz=rates[name],
            filter=None
            if section.filter is None
            else {"kind": section.filter.kind, "order": section.filter.order, "cutoff_hz": section.filter.cutoff},
            delay_s=section.delay,
        )
        for name, section in _find_channel_sections(config, rig).items()
    }


def _find_channel_sections(config: BenchConfig, rig: Rig) -> dict[str, ChannelSection]:
    """Return the configuration of each recorded channel; the drive has that of the channel that measures it."""
    recorded = [name for name in CHANNEL_UNITS if name != "temperature" or rig.thermometer is not None]
    configured: Mapping[str, ChannelSection] = {str(name): section for name, section in config.channels.items()}
    sections = {name: configured.get(name, ChannelSection()) for name in recorded}
    return {**sections, "coil_drive": sections[rig.drive_channel]}


def _find_rates(config: BenchConfig, rig: Rig) -> dict[str, float]:
    """Return the rate [Hz] at which each channel is sampled by its instrument."""

    def get_ring_buffer_rate(instrument: str) -> float:
        return float(load_register_map(instrument).document["ring"]["rate"])

    amplifier = get_ring_buffer_rate("coil_amplifier")
    return {
        "displacement": get_ring_buffer_rate("lvdt"),
        "force": find_force_rate(config),
        "actuator_position": 1 / rig.actuator.settings.cycle,
        "coil_voltage": amplifier,
        "coil_current": amplifier,
        "coil_drive": amplifier,
        "temperature": get_ring_buffer_rate("thermometer"),
    }


def find_force_rate(config: BenchConfig) -> float:
    """Return the rate [Hz] of the load cell, which is also that of the bench samples."""
    for section in config.instruments.values():
        if isinstance(section, LoadCellSection):
            return float(section.rate)
        if isinstance(section, AsciiLoadCellSection):
            break
    # A weighing indicator does not report its rate; this is the highest that it has.
    return float(max(load_wire_file("ascii_load_cell")["instrument"]["rates_hz"]))
