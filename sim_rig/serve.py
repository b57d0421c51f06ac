"""Every instrument of the rig on its own wire, and the ``bench.toml`` that reaches them all."""

import json
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple, cast

import numpy as np

from sim_rig.canopen_actuator import CanopenActuator
from sim_rig.clock import Clock
from sim_rig.device_clock import DeviceClock
from sim_rig.drive_senses import Machine, torque_for
from sim_rig.errors import WireError
from sim_rig.faults import FaultProxy, WireFault
from sim_rig.live_rig import LiveRig
from sim_rig.modbus_coil_amplifier import CoilAmplifierDevice
from sim_rig.modbus_device import wire_file
from sim_rig.modbus_frames import MBAP
from sim_rig.modbus_lvdt import LvdtDevice
from sim_rig.modbus_requests import Device
from sim_rig.modbus_server import ModbusServer
from sim_rig.modbus_thermometer import ThermometerDevice
from sim_rig.scenario import Scenario
from sim_rig.sensors import CHANNELS
from sim_rig.serial_ascii_load_cell import serial_ascii_load_cell
from sim_rig.serial_load_cell import serial_load_cell
from sim_rig.settings import Sensor
from sim_rig.socketcand_server import SocketcandServer

_SYNC = 0x80
"""Identifier of its frame."""
_LONGEST_UP = 3_600_000_000_000
"""[ns] that an instrument may have been switched on before the rig's clock began."""

_MADE_ANEW = "# Reaches the simulated rig for as long as it runs; made anew each time it is started."
"""First line of the file: what does not say so of itself was written by somebody, and is not replaced."""
_LIMITS = (
    "# Nothing can break here, and rig and agent share their cores with whatever else goes on, so that setpoints",
    "# may leave tens of milliseconds late. On hardware, leave these out: then it is 8 mm and 0.6 m/s.",
    "following_error = { indicate = 0.01, trip = 0.03 }",
    "actuator_velocity = { trip = 2.0 }",
)

Faults = dict[str, tuple[WireFault, ...]]
Section = dict[str, str | int | float | bool]
"""Of ``bench.toml``."""


@dataclass(frozen=True)
class Choices:
    """Which wire an instrument is on, where there is a choice."""

    lvdt: Literal["tcp", "rtu"] = "tcp"
    load_cell: Literal["pty", "tcp", "ascii"] = "pty"


class Wire(NamedTuple):
    """How one instrument is reached."""

    instrument: str
    protocol: str
    """For a person."""
    settings: Section
    """Its section of ``bench.toml``."""

    @property
    def where(self) -> str:
        """Address, for a person."""
        settings = self.settings
        return str(settings.get("url") or f"{settings['interface']}://{settings['host']}:{settings['port']}")


class SyncLine:
    """The line by which the SYNC of the bus starts the amplifier's table; a `sim_rig.socketcand_server.Node`."""

    def __init__(self, trigger: Callable[[int], object]) -> None:
        self._trigger = trigger

    def join(self, send: Callable[[int, bytes, int], None], now_ns: int) -> None:
        """It has nothing to say."""

    def take(self, identifier: int, data: bytes, now_ns: int) -> None:
        """A frame has passed."""
        if identifier == _SYNC:
            self._trigger(now_ns)

    def tick(self, now_ns: int) -> None:
        """Nothing happens by itself."""


class ServedRig:
    """A live rig with its wires open; a context manager."""

    def __init__(
        self,
        scenario: Scenario,
        clock: Clock,
        choices: Choices = Choices(),
        faults: Faults | None = None,
        block: int = 2,
    ) -> None:
        """Build it; nothing is served before it is entered.

        Args:
            scenario: what is real.
            clock: the rig's time.
            choices: of wires.
            faults: on the wires, by instrument.
            block: samples that the plant lets come together.

        Raises:
            PlantError: the specimen has no finite force at rest.
            WireError: a fault is on a wire that is none of TCP.
        """
        self.rig = LiveRig(scenario, clock, block=block)
        self.wires: list[Wire] = []
        self.clocks: dict[str, DeviceClock] = {}
        """Each device's clock: for tests and measurements."""
        self._scenario, self._clock, self._choices = scenario, clock, choices
        self._faults = dict(faults or {})
        self._open = ExitStack()
        # Chances of its own: a wire more or less changes no reading.
        self._offsets = np.random.default_rng([scenario.seed, 4711])

    def __enter__(self) -> "ServedRig":
        try:
            self._serve()
        except BaseException:
            self._open.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._open.close()

    def _serve(self) -> None:
        self._open.enter_context(self.rig)
        try:
            amplifier = self._amplifier()
            self._load_cell()
            self._lvdt()
            self._modbus("thermometer", ThermometerDevice(self.rig, self._clock_of("thermometer")))
            self._actuator(amplifier)
        except OSError as error:
            raise WireError(f"a wire of the rig cannot be opened: {error}") from error
        if self._faults:
            named = ", ".join(sorted(self._faults))
            raise WireError(f"wire faults stand for {named}: no instrument of that name is on a TCP wire")

    def _clock_of(self, device: str) -> DeviceClock:
        """A device's clock: as far off as the scenario says, and switched on at some time before."""
        clock = getattr(self._scenario.clocks, device)
        self.clocks[device] = DeviceClock(int(self._offsets.integers(_LONGEST_UP)), clock.ppm)
        return self.clocks[device]

    def _amplifier(self) -> CoilAmplifierDevice:
        unit = self._scenario.drive_unit
        device = CoilAmplifierDevice(self.rig, self._clock_of("coil_amplifier"), unit)
        # Looked after by the plant's thread, too: its output has to move between two questions.
        self._modbus("coil_amplifier", cast("Device", device), mode="voltage" if unit == "V" else "current")
        self.rig.attend = [device.advance]
        return device

    def _lvdt(self) -> None:
        device = LvdtDevice(self.rig, self._clock_of("lvdt"))
        if self._choices.lvdt == "tcp":
            return self._modbus("lvdt", device)
        document = wire_file("lvdt")
        line = {name: document["serial"][name] for name in ("baud", "parity", "stop_bits")}
        server = ModbusServer(device, document["unit"], baud=line["baud"]).listen_pty()
        self._open.enter_context(server)
        self._reached("lvdt", "Modbus RTU on a pty", {"url": server.address, "unit": document["unit"], **line})
        return None

    def _modbus(self, name: str, device: Device, **settings: str) -> None:
        unit: int = wire_file(name)["unit"]
        server = ModbusServer(device, unit, MBAP).listen()
        self._open.enter_context(server)
        url = self._behind_faults(name, server.address)
        self._reached(name, "Modbus TCP", {"url": url, "unit": unit, **settings})

    def _load_cell(self) -> None:
        choice, clock = self._choices.load_cell, self._clock_of("load_cell")
        address = "127.0.0.1:0" if choice == "tcp" else "pty"
        if choice == "ascii":
            adapter, _ = serial_ascii_load_cell(self.rig, address)
            driver, baud = "ascii_load_cell", wire_file("ascii_load_cell")["line"]["baud"]
        else:
            adapter, _ = serial_load_cell(self.rig, address, clock)
            driver, baud = "load_cell", wire_file("load_cell")["line"]["baud"]
        self._open.enter_context(adapter)
        url = self._behind_faults("load_cell", adapter.address)
        kind = "lines of text" if choice == "ascii" else "framed stream"
        line = "a TCP socket" if choice == "tcp" else "a pty"
        self._reached("load_cell", f"{kind} on {line}", {"driver": driver, "url": url, "baud": baud})

    def _actuator(self, amplifier: CoilAmplifierDevice) -> None:
        """The drive: its encoder knows where it is, for the specimen is clamped and it could not be homed."""
        clock = self._clock_of("actuator")
        torque = round(torque_for(self._scenario.actuator.force), 3)
        machine = Machine(torque=torque, ppm=clock.ppm, clock_offset_ns=clock.offset_ns)
        drive = CanopenActuator(self.rig, referenced=True, machine=machine)
        server = SocketcandServer([drive, SyncLine(amplifier.trigger)], self._clock)
        self._open.enter_context(server)
        host, port = self._behind_faults("actuator", f"tcp://127.0.0.1:{server.port}").split("/")[2].split(":")
        settings: Section = {"interface": "socketcand", "host": host, "port": int(port), "channel": "can0"}
        # A drive that is only simulated shares a busy machine with whoever leads it, and may be kept waiting.
        settings |= {"node": 5, "clamped": True, "stale_after": 0.2, "torque": torque}
        self._reached("actuator", "CANopen, CiA 402, over socketcand", settings)

    def _behind_faults(self, name: str, url: str) -> str:
        """Where an instrument is reached through its faults, if its wire has any."""
        scheme, _, place = url.partition("://")
        if not place or name not in self._faults:
            return url
        host, port = place.split(":")
        proxy = FaultProxy((host, int(port)), self._clock, self._faults.pop(name))
        self._open.enter_context(proxy)
        return f"{scheme}://{proxy.host}:{proxy.port}"

    def _reached(self, name: str, protocol: str, settings: Section) -> None:
        self.wires.append(Wire(name, protocol, {"driver": name, **settings}))


def bench_toml(wires: list[Wire], scenario: Scenario) -> str:
    """The configuration that reaches these wires, with what the instruments claim of their channels."""
    lines = [_MADE_ANEW]
    specimen = ", ".join(str(value) for value in scenario.specimen.model_dump().values())
    lines += ["", "[rig]", 'name = "simulated rig"', f"specimen = {json.dumps(specimen)}"]
    for wire in wires:
        lines += ["", f"[instruments.{wire.instrument}]"]
        lines += [f"{key} = {json.dumps(value)}" for key, value in wire.settings.items()]
    for name in CHANNELS:
        # The drive is measured by the channel of voltage or current.
        if name != "coil_drive":
            lines += ["", f"[channels.{name}]", *_claimed(getattr(scenario.sensors, name))]
    lines += ["", "[limits]", *_LIMITS]
    return "\n".join(lines) + "\n"


def _claimed(sensor: Sensor) -> list[str]:
    """What the data sheet of a channel would say, a line each."""
    lines = [f"delay = {sensor.delay!r}", 'calibration = "as reported by the simulated instrument"']
    if sensor.filter is not None:
        form = sensor.filter
        lines.append(f'filter = {{ kind = "{form.kind}", order = {form.order}, cutoff = {form.cutoff!r} }}')
    return lines


def write_bench_toml(path: Path, wires: list[Wire], scenario: Scenario) -> None:
    """Write it in one go: whoever waits for the file finds it whole.

    Raises:
        WireError: it cannot be written, or stands in the place of one that somebody else wrote.
    """
    try:
        if path.exists() and _MADE_ANEW not in path.read_text("utf-8", errors="replace"):
            raise WireError(f"{path}: was written by hand and is left as it is; choose another place with --out")
        draft = path.with_name(f".{path.name}.draft")
        draft.write_text(bench_toml(wires, scenario), "utf-8")
        draft.replace(path)
    except OSError as error:
        raise WireError(
            f"{path}: cannot be written ({error.strerror}); choose another place with --out"
        ) from error


def table(wires: list[Wire]) -> str:
    """The wires for a person, a line each."""
    rows = [
        ("instrument", "wire", "reached at"),
        *((wire.instrument, wire.protocol, wire.where) for wire in wires),
    ]
    widths = [max(len(row[column]) for row in rows) for column in (0, 1)]
    return "\n".join(f"{name:{widths[0]}}  {protocol:{widths[1]}}  {where}" for name, protocol, where in rows)
