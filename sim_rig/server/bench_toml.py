"""The ``bench.toml`` that reaches the wires of the simulated rig."""

import json
from pathlib import Path
from typing import NamedTuple

from sim_rig.errors import WireError
from sim_rig.scenario import Scenario, Sensor
from sim_rig.sensors import CHANNELS

_GENERATED_MARK = "# Reaches the simulated rig for as long as it runs"
"""Start of a generated file: a file without it was written by a person and is not replaced."""
_LIMITS = (
    "# The simulated rig cannot be damaged. It shares its processor cores with the agent and other processes, so",
    "# setpoints may leave tens of milliseconds late. Remove these lines on hardware: then 8 mm, 0.6 m/s apply.",
    "following_error = { indicate = 0.01, trip = 0.03 }",
    "actuator_velocity = { trip = 2.0 }",
)

TomlSection = dict[str, str | int | float | bool]
"""One section of ``bench.toml``."""


class Wire(NamedTuple):
    """The wire of one instrument."""

    instrument: str
    protocol: str
    """Protocol as text for a person."""
    settings: TomlSection
    """Section of the instrument in ``bench.toml``."""

    @property
    def address(self) -> str:
        """Address as text for a person."""
        settings = self.settings
        return str(settings.get("url") or f"{settings['interface']}://{settings['host']}:{settings['port']}")


def make_bench_toml(wires: list[Wire], scenario: Scenario) -> str:
    """Return the configuration that reaches these wires, with what the instruments report of their channels."""
    lines = [f"{_GENERATED_MARK}; written again at each start."]
    specimen = ", ".join(str(value) for value in scenario.specimen.model_dump().values())
    lines += ["", "[rig]", 'name = "simulated rig"', f"specimen = {json.dumps(specimen)}"]
    for wire in wires:
        lines += ["", f"[instruments.{wire.instrument}]"]
        lines += [f"{key} = {json.dumps(value)}" for key, value in wire.settings.items()]
    for name in CHANNELS:
        # The drive is measured by the channel of voltage or current.
        if name != "coil_drive":
            lines += ["", f"[channels.{name}]", *_format_channel(getattr(scenario.sensors, name))]
    lines += ["", "[limits]", *_LIMITS]
    return "\n".join(lines) + "\n"


def _format_channel(sensor: Sensor) -> list[str]:
    """Return the lines of a channel: what its data sheet would state."""
    lines = [f"delay = {sensor.delay!r}", 'calibration = "as reported by the simulated instrument"']
    if sensor.filter is not None:
        low_pass = sensor.filter
        lines.append(
            f'filter = {{ kind = "{low_pass.kind}", order = {low_pass.order}, cutoff = {low_pass.cutoff!r} }}'
        )
    return lines


def write_bench_toml(path: Path, wires: list[Wire], scenario: Scenario) -> None:
    """Write the configuration atomically, as a waiting process reads the file as soon as it exists.

    Raises:
        WireError: it cannot be written, or would replace a file written by a person.
    """
    try:
        if path.exists() and not _is_generated(path):
            raise WireError(f"{path}: was written by hand and is not replaced; choose another file with --out")
        draft = path.with_name(f".{path.name}.draft")
        draft.write_text(make_bench_toml(wires, scenario), "utf-8")
        draft.replace(path)
    except OSError as error:
        raise WireError(f"{path}: cannot be written ({error.strerror}); choose another file with --out") from error


def remove_bench_toml(path: Path) -> None:
    """Remove the configuration that a rig wrote; a file written by a person stays.

    A process that waits for the file would connect to closed ports otherwise.

    Raises:
        WireError: it cannot be removed.
    """
    try:
        if path.exists() and _is_generated(path):
            path.unlink(missing_ok=True)
    except OSError as error:
        raise WireError(
            f"{path}: cannot be replaced ({error.strerror}); choose another file with --out"
        ) from error


def _is_generated(path: Path) -> bool:
    return _GENERATED_MARK in path.read_text("utf-8", errors="replace")


def format_table(wires: list[Wire]) -> str:
    """Return the wires as a table for a person, one line each."""
    rows = [
        ("instrument", "wire", "reached at"),
        *((wire.instrument, wire.protocol, wire.address) for wire in wires),
    ]
    widths = [max(len(row[column]) for row in rows) for column in (0, 1)]
    return "\n".join(f"{name:{widths[0]}}  {protocol:{widths[1]}}  {where}" for name, protocol, where in rows)
