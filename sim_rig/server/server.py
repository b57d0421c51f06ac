"""Server of the simulated rig: every instrument on its own wire."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from typing import Literal, cast

import numpy as np

from sim_rig.errors import WireError
from sim_rig.instruments import (
    CoilAmplifierDevice,
    DriveMechanics,
    SensorDevice,
    ServoDriveDevice,
    compute_torque,
    load_wire_file,
    make_ascii_load_cell,
    make_load_cell,
)
from sim_rig.live import DeviceClock, LiveRig, RigClock
from sim_rig.protocols import MBAP, FaultProxy, ModbusDevice, ModbusServer, SocketcandServer, WireFault
from sim_rig.scenario import Scenario
from sim_rig.server.bench_toml import TomlSection, Wire

_SYNC_ID = 0x80
"""CAN identifier of the SYNC frame."""
_MODBUS_POLL = 0.05
"""[s] between two turns of a Modbus server without requests; its instrument does not depend on them."""
_MAX_UPTIME_NS = 3_600_000_000_000
"""[ns] largest time for which an instrument was switched on before the rig's clock began."""

WireFaults = dict[str, tuple[WireFault, ...]]
"""Faults of TCP wires, by instrument."""


@dataclass(frozen=True)
class TransportOptions:
    """Wires of the instruments that have a choice."""

    lvdt: Literal["tcp", "rtu"] = "tcp"
    load_cell: Literal["pty", "tcp", "ascii"] = "pty"


class SyncLine:
    """SYNC line from the CAN bus to the amplifier's step table; a `CanNode` of the socketcand server."""

    def __init__(self, trigger: Callable[[int], object]) -> None:
        self._trigger = trigger

    def join(self, send: Callable[[int, bytes, int], None], now_ns: int) -> None:
        """Do nothing: the line only listens."""

    def receive(self, identifier: int, data: bytes, now_ns: int) -> None:
        """Trigger the table by a SYNC frame."""
        if identifier == _SYNC_ID:
            self._trigger(now_ns)

    def tick(self, now_ns: int) -> None:
        """Do nothing: the line has no time-driven behaviour."""

    def acts_by_itself(self, now_ns: int) -> bool:
        """Return False: the line only listens."""
        return False


class RigServer:
    """A live rig with its wires open; a context manager."""

    def __init__(
        self,
        scenario: Scenario,
        clock: RigClock,
        transports: TransportOptions = TransportOptions(),
        faults: WireFaults | None = None,
        batch: int = 2,
    ) -> None:
        """Build the rig; the wires open when the context is entered.

        Args:
            scenario: damper, effects, sensors and faults.
            clock: the rig's time.
            transports: wires of the instruments that have a choice.
            faults: of TCP wires, by instrument.
            batch: samples that the plant simulates together.

        Raises:
            PlantError: the specimen has no finite force at rest.
            WireError: a fault names an instrument without a TCP wire.
        """
        self.rig = LiveRig(scenario, clock, batch=batch)
        self.wires: list[Wire] = []
        self.clocks: dict[str, DeviceClock] = {}
        """Clock of each device, for tests and measurements."""
        self._scenario, self._clock, self._transports = scenario, clock, transports
        self._faults = dict(faults or {})
        self._resources = ExitStack()
        # A separate generator, so that the choice of wires does not change any reading.
        self._random = np.random.default_rng([scenario.seed, 4711])

    def __enter__(self) -> "RigServer":
        try:
            self._serve_all()
        except BaseException:
            self._resources.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._resources.close()

    def _serve_all(self) -> None:
        self._resources.enter_context(self.rig)
        try:
            amplifier = self._serve_amplifier()
            self._serve_load_cell()
            self._serve_lvdt()
            self._serve_modbus(
                "thermometer", SensorDevice("thermometer", self.rig, self._make_clock("thermometer"))
            )
            self._serve_actuator(amplifier)
        except OSError as error:
            raise WireError(f"a wire of the rig cannot be opened: {error}") from error
        if self._faults:
            names = ", ".join(sorted(self._faults))
            raise WireError(f"wire faults for {names}: no instrument of that name is on a TCP wire; remove them")

    def _make_clock(self, device: str) -> DeviceClock:
        """Return a device's clock with the scenario's rate error and a random offset from its uptime."""
        clock = getattr(self._scenario.clocks, device)
        self.clocks[device] = DeviceClock(int(self._random.integers(_MAX_UPTIME_NS)), clock.ppm)
        return self.clocks[device]

    def _serve_amplifier(self) -> CoilAmplifierDevice:
        unit = self._scenario.drive_unit
        device = CoilAmplifierDevice(self.rig, self._make_clock("coil_amplifier"), unit)
        # Advanced by the plant's thread, as its output changes between two requests.
        self._serve_modbus(
            "coil_amplifier", cast("ModbusDevice", device), mode="voltage" if unit == "V" else "current"
        )
        self.rig.periodic_tasks = [device.follow_time]
        return device

    def _serve_lvdt(self) -> None:
        device = SensorDevice("lvdt", self.rig, self._make_clock("lvdt"))
        if self._transports.lvdt == "tcp":
            return self._serve_modbus("lvdt", device)
        document = load_wire_file("lvdt")
        line = {name: document["serial"][name] for name in ("baud", "parity", "stop_bits")}
        server = ModbusServer(device, document["unit"], baud=line["baud"], poll=_MODBUS_POLL).listen_pty()
        self._resources.enter_context(server)
        self._add_wire("lvdt", "Modbus RTU on a pty", {"url": server.address, "unit": document["unit"], **line})
        return None

    def _serve_modbus(self, name: str, device: ModbusDevice, **settings: str) -> None:
        unit: int = load_wire_file(name)["unit"]
        server = ModbusServer(device, unit, MBAP, poll=_MODBUS_POLL).listen()
        self._resources.enter_context(server)
        url = self._insert_fault_proxy(name, server.address)
        self._add_wire(name, "Modbus TCP", {"url": url, "unit": unit, **settings})

    def _serve_load_cell(self) -> None:
        transport, clock = self._transports.load_cell, self._make_clock("load_cell")
        address = "127.0.0.1:0" if transport == "tcp" else "pty"
        if transport == "ascii":
            adapter, _ = make_ascii_load_cell(self.rig, address)
            driver, baud = "ascii_load_cell", load_wire_file("ascii_load_cell")["line"]["baud"]
        else:
            adapter, _ = make_load_cell(self.rig, address, clock, shunt=self._scenario.sensors.force.shunt)
            driver, baud = "load_cell", load_wire_file("load_cell")["line"]["baud"]
        self._resources.enter_context(adapter)
        url = self._insert_fault_proxy("load_cell", adapter.address)
        kind = "lines of text" if transport == "ascii" else "framed stream"
        line = "a TCP socket" if transport == "tcp" else "a pty"
        self._add_wire("load_cell", f"{kind} on {line}", {"driver": driver, "url": url, "baud": baud})

    def _serve_actuator(self, amplifier: CoilAmplifierDevice) -> None:
        """Serve the drive, referenced from the start: with a clamped specimen it could not be homed."""
        clock = self._make_clock("actuator")
        torque = round(compute_torque(self._scenario.actuator.force), 3)
        mechanics = DriveMechanics(torque=torque, ppm=clock.ppm, clock_offset_ns=clock.offset_ns)
        drive = ServoDriveDevice(self.rig, referenced=True, mechanics=mechanics)
        server = SocketcandServer([drive, SyncLine(amplifier.trigger)], self._clock)
        self._resources.enter_context(server)
        host, port = (
            self._insert_fault_proxy("actuator", f"tcp://127.0.0.1:{server.port}").split("/")[2].split(":")
        )
        settings: TomlSection = {"interface": "socketcand", "host": host, "port": int(port), "channel": "can0"}
        # A longer timeout than on hardware: the simulated drive shares its processor with the agent and may be
        # late.
        settings |= {"node": 5, "clamped": True, "setpoint_timeout": 0.2, "torque_limit": torque}
        self._add_wire("actuator", "CANopen, CiA 402, over socketcand", settings)

    def _insert_fault_proxy(self, name: str, url: str) -> str:
        """Return the address of an instrument, through a fault proxy if its wire has faults."""
        scheme, _, address = url.partition("://")
        if not address or name not in self._faults:
            return url
        host, port = address.split(":")
        proxy = FaultProxy((host, int(port)), self._clock, self._faults.pop(name))
        self._resources.enter_context(proxy)
        return f"{scheme}://{proxy.host}:{proxy.port}"

    def _add_wire(self, name: str, protocol: str, settings: TomlSection) -> None:
        self.wires.append(Wire(name, protocol, {"driver": name, **settings}))
