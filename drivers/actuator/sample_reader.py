"""Sample reader of the servo drive: reads frames from the bus, and the drive's clock now and then."""

import contextlib
import time
from typing import Any

from drivers.actuator.sample_decoder import TIME_STAMP, ActuatorDecoder, CountScale
from drivers.actuator.servo_drive import METRES_PER_COUNT
from drivers.channel import SampleBlock
from drivers.errors import InvalidReplyError, NoReplyError, RefusedError
from drivers.instrument import Clock
from drivers.polling import ACTUATOR_SCHEDULE
from drivers.transport import CanBus, CanopenNode

_CLOCK_PERIOD_NS = 100_000_000
"""Time between two readings of the drive's clock [ns]."""


class SampleReader:
    """Reader of the drive's samples.

    Args:
        bus: CAN bus of the drive.
        node: CANopen node of the drive.
        clock: bench clock [ns].
        cycle: time between two setpoints [s].
    """

    def __init__(self, bus: CanBus, node: CanopenNode, clock: Clock, cycle: float) -> None:
        self._bus, self._node, self._clock, self._cycle = bus, node, clock, cycle
        self._clock_request_ns = 0
        self.start(0.0, 1.0)
        # A lambda, since `start` makes a new decoder and the bus cannot remove a listener.
        bus.add_listener(lambda frame: self.decoder.add_frame(frame))

    def start(self, origin: float, rated_torque: float) -> None:
        """Begin with a new decoder, after the drive has been set up; origin [m from home], rated torque [N m]."""
        self.decoder = self.make_decoder(origin, rated_torque)

    def make_decoder(self, origin: float, rated_torque: float) -> ActuatorDecoder:
        """Make a decoder of the drive's frames; origin [m from home], rated torque [N m]."""
        # The drive reports its torque in thousandths of the rated torque (CiA 402, 6077h).
        scale = CountScale(METRES_PER_COUNT, METRES_PER_COUNT, rated_torque / 1000)
        return ActuatorDecoder(self._node.mappings, self._node.node_id, scale, origin, self._cycle)

    def acquire(self, timeout: float) -> list[SampleBlock]:
        """Return the samples since the last call, waiting up to ``timeout`` [s] for the first.

        Raises:
            NotConnectedError: the bus is gone.
            NoReplyError: the drive's heartbeat is lost.
        """
        self._request_clock()
        deadline = time.monotonic() + timeout
        while True:
            time.sleep(ACTUATOR_SCHEDULE.compute_wait(self._clock()))
            self._bus.drain()
            if blocks := self.decoder.pop_blocks():
                return blocks
            if time.monotonic() >= deadline:
                self._node.heartbeat.check_alive()
                return []

    def _request_clock(self) -> None:
        """Read the drive's clock if it is due."""
        if self._clock() - self._clock_request_ns < _CLOCK_PERIOD_NS:
            return
        self._clock_request_ns = self._clock()
        # A clock that was not read is requested again; the heartbeat shows whether the drive is there.
        with contextlib.suppress(NoReplyError, InvalidReplyError, RefusedError):
            # The decoder takes the reply from the frames, as in a replay.
            self._node.read_number(TIME_STAMP)

    def snapshot(self, origin: float, rated_torque: float) -> dict[str, Any]:
        """Return the decoder's state with its settings; origin [m from home], rated torque [N m]."""
        return {
            "decoder": "actuator",
            "layouts": [
                {**mapping._asdict(), "fields": [list(field) for field in mapping.fields]}
                for mapping in self._node.mappings
            ],
            "node_id": self._node.node_id,
            "rated_torque": rated_torque,
            "origin": origin,
            "cycle": self._cycle,
            "state": self.decoder.snapshot(),
        }
