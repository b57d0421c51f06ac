"""Configuration of a bench (``bench.toml``): its instruments, their addresses, and the limits of the fixture.

It is written by hand for a real bench, and by ``mrbench sim`` for the simulated one. Everything is checked when it
is read, and an error names file, section, key, value and the permitted values.
"""

import hashlib
import tomllib
from collections import Counter
from pathlib import Path
from typing import Literal, Self, TypeAlias

from pydantic import Field, NonNegativeFloat, PositiveFloat, ValidationError, model_validator

from bench.config.instruments import OPTIONAL_ROLES, ROLES, InstrumentSection
from bench.config.limits import LimitsSection, SilenceSection
from bench.errors import ConfigError
from bench.validation import FrozenModel, format_position, get_first_error


class FilterSection(FrozenModel):
    """Analogue low-pass in front of a converter, as in its data sheet."""

    kind: Literal["butterworth"] = Field(default="butterworth", description="family of the filter")
    order: int = Field(default=2, ge=1, le=8, description="[1] number of poles")
    cutoff: PositiveFloat = Field(description="[Hz] frequency of 3 dB attenuation")


class ChannelSection(FrozenModel):
    """Properties of one channel that its instrument does not report; written to every log."""

    filter: FilterSection | None = Field(default=None, description="low-pass of the channel, if it has one")
    delay: NonNegativeFloat = Field(
        default=0.0, description="[s] delay of conversion and transfer, apart from the filter's"
    )
    calibration: str = Field(default="", description="calibration: laboratory, date and uncertainty")
    certificate: str = Field(default="", description="file of the certificate, which is attached to every log")


class RigSection(FrozenModel):
    """Name, folder and specimen of the bench."""

    name: str = Field(default="bench", description="display name of the bench")
    folder: str = Field(default="runs", description="folder of the logs, relative to that of bench.toml")
    specimen: str = Field(default="", description="mounted damper, used if a run does not name one")


class AgentSection(FrozenModel):
    """Addresses of the rig agent, only needed if clients are on other machines; port * is any free one."""

    commands: str = Field(
        default="",
        description="ZeroMQ address for commands, tcp://HOST:PORT or ipc:///FOLDER/NAME; by default a socket that "
        "only this user reaches",
    )
    samples: str = Field(
        default="", description="ZeroMQ address of publications; by default the next port, or NAME.samples"
    )
    key: str = Field(
        default="agent.key",
        description="file with the key of TCP connections, relative to bench.toml; created at the first start",
    )


ChannelName: TypeAlias = Literal[
    "displacement", "force", "actuator_position", "coil_voltage", "coil_current", "temperature"
]
CHANNEL_UNITS: dict[str, str] = {
    "displacement": "m",
    "force": "N",
    "actuator_position": "m",
    "coil_voltage": "V",
    "coil_current": "A",
    "temperature": "degC",
}
"""Unit of each channel in a log."""


class CalibrationSection(FrozenModel):
    """Consequences of overdue calibrations and failed checks."""

    overdue: Literal["mark", "refuse"] = Field(
        default="mark",
        description="mark: the log of a run names its overdue channels; refuse: it does not start",
    )
    failed_check: Literal["mark", "refuse"] = Field(
        default="mark",
        description="mark: the log of a run names the channels of which a latest check has failed; refuse: it "
        "does not start, except for a check",
    )
    check_interval_days: PositiveFloat | None = Field(
        default=None, description="[days] largest age of a channel's latest zero check; by default any"
    )


class BenchConfig(FrozenModel):
    """Content of ``bench.toml``."""

    instruments: dict[str, InstrumentSection] = Field(
        description="instruments by name; the names appear in logs and messages"
    )
    channels: dict[ChannelName, ChannelSection] = Field(default={}, description="properties of the channels")
    limits: LimitsSection = Field(default=LimitsSection(), description="limits of the fixture")
    silence: SilenceSection = Field(default=SilenceSection(), description="actions for silent instruments")
    rig: RigSection = Field(default=RigSection(), description="name, folder and specimen of the bench")
    agent: AgentSection = Field(default=AgentSection(), description="addresses of the rig agent")
    calibration: CalibrationSection = Field(
        default=CalibrationSection(), description="consequences of overdue calibrations and failed checks"
    )

    @model_validator(mode="after")
    def _check_roles(self) -> Self:
        counts: Counter[str] = Counter(section.driver for section in self.instruments.values())
        for role, drivers in ROLES.items():
            count = sum(counts[driver] for driver in drivers)
            if count > 1 or (count == 0 and role not in OPTIONAL_ROLES):
                allowed = "one of them, or none" if role in OPTIONAL_ROLES else "one of them"
                raise ValueError(f"{count} instruments with driver {' or '.join(drivers)}; a bench has {allowed}")
        return self


def load_config(path: Path) -> BenchConfig:
    """Read and check a configuration.

    Raises:
        ConfigError: the file cannot be read or is not valid; the message names the position.
    """
    try:
        return BenchConfig.model_validate(tomllib.loads(path.read_text("utf-8")))
    except OSError as error:
        raise ConfigError(
            f"{path}: cannot be read ({error.strerror}); create it, or let `mrbench sim` write one"
        ) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: not a TOML file: {error}") from None
    except ValidationError as error:
        raise ConfigError(f"{path}: {_describe_first_error(error)}") from None


def compute_identity(config: BenchConfig) -> str:
    """Return a text that differs for configurations with another content; comments do not count."""
    return hashlib.sha256(config.model_dump_json().encode()).hexdigest()[:16]


def _describe_first_error(error: ValidationError) -> str:
    """Return section, key, value and message of the first fault, and the number of further ones."""
    first, message = get_first_error(error)
    # pydantic adds the driver to the position, because it selects the form of the section.
    position = [
        step for index, step in enumerate(first["loc"]) if not (index == 2 and first["loc"][0] == "instruments")
    ]
    section = format_position(position[:-1])
    place = f"[{section}] {position[-1]}" if position else "the document"
    given = first["input"]
    value = f" = {given!r}" if isinstance(given, str | int | float | bool) else ""
    return f"{place}{value}: {message}"
