"""Lossless reading of an instrument's ring buffer over Modbus, block by block.

The host writes the number of the next sample and reads a block that begins there. The instrument changes nothing
until the next number is written, so a block that did not arrive is read again. A block contains the number of its
first sample, so an old block cannot pass for the requested one. If the ring buffer has overrun, the block begins
at the oldest sample that is kept, and the lost samples are counted. Polls are at least one poll period apart,
otherwise each would return a single sample.
"""

import threading
import time

from drivers.channel import ClockReading, SampleBlock
from drivers.errors import DriverError, InvalidReplyError, NotConnectedError
from drivers.instrument import Clock, Health
from drivers.modbus.sample_decoder import BlockReadout, ModbusDecoder, RingBufferLayout
from drivers.transport import RegisterReply, Registers


class RingBufferReader:
    """Reader of one instrument's samples."""

    def __init__(
        self,
        registers: Registers,
        clock: Clock,
        poll_period: float = 0.02,
        silence_timeout: float = 1.0,
    ) -> None:
        """Prepare; nothing is sent yet.

        Args:
            registers: registers of the instrument.
            clock: bench clock [ns].
            poll_period: least time between polls [s].
            silence_timeout: [s] without a good block after which the line counts as gone.
        """
        self.layout = RingBufferLayout(registers.map)
        self.decoder = ModbusDecoder(registers.line.name, self.layout)
        self.clock_reading: ClockReading | None = None
        self._registers, self._clock = registers, clock
        self._poll_period, self._silence_timeout = poll_period, silence_timeout
        self._snapshot_lock = threading.Lock()
        self._last_block_ns = 0
        self._next_poll = 0.0
        self._failure_start: float | None = None
        self._message = "not connected"

    def start(self) -> None:
        """Check the instrument's identity, and begin with its next sample.

        Raises:
            NotConnectedError, NoReplyError, InvalidReplyError, RefusedError: the expected instrument does not
                reply.
        """
        values, reply = self._registers.read_group("identity", "boot", "interval", "newest", "clock")
        self._check_identity(values["identity"].raw)
        self._check_interval(values["interval"].raw)
        self.decoder.begin(values["boot"].raw, values["newest"].raw, values["clock"].raw)
        self.clock_reading = ClockReading(values["clock"].raw * 1000, reply.sent_ns, reply.received_ns)
        self._next_poll, self._failure_start, self._message = 0.0, None, ""

    def _check_identity(self, identity: int) -> None:
        name, map_ = self._registers.line.name, self._registers.map
        if identity != map_.identity:
            raise InvalidReplyError(
                f"{name}: its identity is {identity:#06x}, that of a {map_.instrument} is "
                f"{map_.identity:#06x}; check address and unit"
            )

    def _check_interval(self, interval_us: int) -> None:
        if interval_us * 1000 != self.layout.interval_ns:
            raise InvalidReplyError(
                f"{self._registers.line.name}: it samples every {interval_us} us, expected are "
                f"{self.layout.interval_ns // 1000} us; set the instrument's rate"
            )

    def acquire(self, timeout: float) -> list[SampleBlock]:
        """Return all samples since the last call, waiting up to ``timeout`` [s] for the first.

        A block that did not arrive is read again; only a lasting silence is an error.

        Raises:
            NotConnectedError: the line is gone, no good block has arrived within the silence timeout, or the
                instrument has restarted.
        """
        deadline = time.monotonic() + timeout
        blocks: list[SampleBlock] = []
        while self._wait_until_due(deadline):
            has_more = self._try_read_block(blocks)
            if blocks and (not has_more or time.monotonic() > deadline):
                break
        return blocks

    def compute_age(self) -> float | None:
        """Return the largest possible age of the latest sample [s], transfer included; None before the first."""
        newest_ns = self.decoder.newest_ns
        if newest_ns is None or self.clock_reading is None:
            return None
        return (self.clock_reading.device_ns - newest_ns + self._clock() - self.clock_reading.sent_ns) * 1e-9

    def unwrap_clock(self, microseconds: int) -> int:
        """Return the device clock without its wraps [ns], from a reading near the last ones."""
        return self.decoder.unwrap_clock(microseconds)

    @property
    def lost(self) -> int:
        """Samples that were overwritten before they were read."""
        return self.decoder.lost

    @property
    def status(self) -> int:
        """Status register in the latest block."""
        return self.decoder.status

    def get_health(self) -> Health:
        """Return counts and state."""
        line = self._registers.line
        message = self._message if line.connected else "not connected"
        return Health(
            line.connected, line.received, self.lost, line.corrupted, line.resynchronised, line.last_ns, message
        )

    def snapshot(self) -> dict[str, int]:
        """Return the state from which a `ModbusDecoder` decodes the frames after ``at_ns``."""
        with self._snapshot_lock:
            return {"at_ns": self._last_block_ns, **self.decoder.snapshot()}

    def _wait_until_due(self, deadline: float) -> bool:
        """Sleep until the next poll, and return True; return False at the deadline if that is earlier."""
        now = time.monotonic()
        if self._next_poll > deadline:
            time.sleep(max(0.0, deadline - now))
            return False
        time.sleep(max(0.0, self._next_poll - now))
        return True

    def _try_read_block(self, blocks: list[SampleBlock]) -> bool:
        """Read the next block as `_read_block` does; record a failure, after which it is read again."""
        try:
            return self._read_block(blocks)
        except NotConnectedError:  # reading again helps neither after a restart nor on a line that is gone
            raise
        except DriverError as error:
            self._record_failure(error)
            return False

    def _read_block(self, blocks: list[SampleBlock]) -> bool:
        """Read the next block, and return whether the instrument has more samples."""
        # Counted from before the request: the duration of the reply must not lengthen the period.
        self._next_poll = time.monotonic() + self._poll_period
        # Start number and block in one exchange: half as many requests.
        reply = self._registers.write_and_read(
            "block_start", self.decoder.next_number, self.layout.address, self.layout.length
        )
        readout = self._decode_reply(reply)
        self._failure_start, self._message = None, ""
        self.clock_reading = ClockReading(readout.clock_ns, reply.sent_ns, reply.received_ns)
        blocks.extend(readout.blocks)
        if readout.has_more:  # behind after a failure: catch up at the speed of the line
            self._next_poll = 0.0
        return readout.has_more

    def _decode_reply(self, reply: RegisterReply) -> BlockReadout:
        try:
            # Both or neither: a replay begins with the first frame after this time.
            with self._snapshot_lock:
                self._last_block_ns = reply.received_ns
                return self.decoder.decode_block(reply.words, reply.received_ns)
        except NotConnectedError:
            self._message = "restarted"
            raise

    def _record_failure(self, error: DriverError) -> None:
        """Record that a block did not arrive.

        Raises:
            NotConnectedError: no good block has arrived within the silence timeout.
        """
        now = time.monotonic()
        self._failure_start = now if self._failure_start is None else self._failure_start
        silence, self._message = now - self._failure_start, str(error)
        if silence > self._silence_timeout:
            raise NotConnectedError(
                f"{self._registers.line.name}: no good block for {silence:.1f} s, the limit is "
                f"{self._silence_timeout:.1f} s; last error: {error}"
            ) from error
