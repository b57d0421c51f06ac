"""A ring of samples in an instrument, read in blocks over Modbus without loss.

The host writes the number of the sample that it wants and reads a block that begins there. Nothing moves on
before the host asks for the next number, so a block that did not come is simply read again. A block carries the
number of its first sample: an old one cannot pass for the one wanted. Where the ring has overrun, the block begins
at the oldest sample kept, and what was lost is counted. Reading is paced: no more often than ``every`` seconds, or
the wire would be asked for each sample alone.
"""

import threading
import time

from drivers.channel import Block, Stamp
from drivers.errors import BadReply, DriverError, NotConnected
from drivers.instrument import Clock, Health
from drivers.modbus_line import Answer
from drivers.modbus_registers import Registers
from drivers.modbus_samples import Layout, RingDecoder, Taken


class Ring:
    """Reads one instrument's samples block by block."""

    def __init__(self, registers: Registers, clock: Clock, every: float = 0.02, silence: float = 1.0) -> None:
        """Prepare; nothing is asked yet.

        Args:
            registers: of the instrument.
            clock: the bench clock.
            every: [s] between readings of the ring at least.
            silence: [s] without a good block after which the wire counts as gone.
        """
        self.layout = Layout(registers.map)
        self.decoder = RingDecoder(registers.line.name, self.layout)
        self.stamp: Stamp | None = None
        self._taking = threading.Lock()
        self._taken_ns = 0
        self._registers, self._clock, self._every, self._silence = registers, clock, every, silence
        self._next = 0.0
        self._failing_since: float | None = None
        self._words = "not connected"

    def start(self) -> None:
        """Check who answers, and begin with the next sample that it makes.

        Raises:
            NotConnected, NoReply, BadReply, Refused: it does not answer, or is another instrument.
        """
        name, map_ = self._registers.line.name, self._registers.map
        found, answer = self._registers.read_together("identity", "boot", "interval", "newest", "now")
        if found["identity"].raw != map_.identity:
            raise BadReply(
                f"{name}: answers as {found['identity'].raw:#06x}, a {map_.instrument} as {map_.identity:#06x}; "
                "check address and unit"
            )
        if found["interval"].raw * 1000 != self.layout.interval_ns:
            raise BadReply(
                f"{name}: samples every {found['interval'].raw} us, expected are "
                f"{self.layout.interval_ns // 1000} us; set the instrument's rate"
            )
        self.decoder.begin(found["boot"].raw, found["newest"].raw, found["now"].raw)
        self.stamp = Stamp(found["now"].raw * 1000, answer.sent_ns, answer.received_ns)
        self._next, self._failing_since, self._words = 0.0, None, ""

    def acquire(self, timeout: float) -> list[Block]:
        """Samples made since the last call, all that are there, waiting up to ``timeout`` [s] for the first.

        A block that did not come is read again; only a silence that lasts is an error.

        Raises:
            NotConnected: the wire has gone, nothing good has come for long, or the instrument has restarted.
        """
        deadline = time.monotonic() + timeout
        blocks: list[Block] = []
        while self._waits_until_due(deadline):
            try:
                more = self._take(blocks)
            except NotConnected:
                raise
            except DriverError as error:
                self._failed(error)
                more = False
            if blocks and (not more or time.monotonic() > deadline):
                break
        return blocks

    def age(self) -> float | None:
        """[s] since the newest sample was made, at most: its way over the wire included; none before the first."""
        newest_ns = self.decoder.newest_ns
        if newest_ns is None or self.stamp is None:
            return None
        return (self.stamp.device_ns - newest_ns + self._clock() - self.stamp.sent_ns) * 1e-9

    def device_ns(self, microseconds: int) -> int:
        """The instrument's clock [ns] from its wrapped microseconds, close to the last ones seen."""
        return self.decoder.device_ns(microseconds)

    @property
    def lost(self) -> int:
        """Samples that the ring did not keep for long enough."""
        return self.decoder.lost

    @property
    def status(self) -> int:
        """Its status register, from the newest block."""
        return self.decoder.status

    def health(self) -> Health:
        """Counts and state."""
        line = self._registers.line
        words = self._words if line.connected else "not connected"
        return Health(
            line.connected, line.received, self.lost, line.corrupted, line.resynchronised, line.last_ns, words
        )

    def _waits_until_due(self, deadline: float) -> bool:
        """Sleep until the ring may be read again; false where the deadline comes first."""
        now = time.monotonic()
        if self._next > deadline:
            time.sleep(max(0.0, deadline - now))
            return False
        time.sleep(max(0.0, self._next - now))
        return True

    def _take(self, blocks: list[Block]) -> bool:
        """Read the next block; whether more samples stand behind it."""
        # From before the question: how long an answer takes must not slow the pace.
        self._next = time.monotonic() + self._every
        # Asked for and read in one exchange: half as many requests.
        answer = self._registers.write_and_read(
            "wanted", self.decoder.wanted, self.layout.address, self.layout.length
        )
        taken = self._accepted(answer)
        self._failing_since, self._words = None, ""
        self.stamp = Stamp(taken.now_ns, answer.sent_ns, answer.received_ns)
        blocks.extend(taken.blocks)
        if taken.more:  # behind after a failure: caught up as fast as the wire carries
            self._next = 0.0
        return taken.more

    def state(self) -> dict[str, int]:
        """Where it stands: what a `RingDecoder` needs to decode the frames after ``at_ns`` as this one does."""
        with self._taking:
            return {"at_ns": self._taken_ns, **self.decoder.state()}

    def _accepted(self, answer: Answer) -> Taken:
        try:
            # Both or neither: a replay begins with the first frame after this stamp.
            with self._taking:
                self._taken_ns = answer.received_ns
                return self.decoder.take(answer.words, answer.received_ns)
        except NotConnected:
            self._words = "restarted"
            raise

    def _failed(self, error: DriverError) -> None:
        """Note a block that did not come.

        Raises:
            NotConnected: none has come for long.
        """
        now = time.monotonic()
        self._failing_since = now if self._failing_since is None else self._failing_since
        silent, self._words = now - self._failing_since, str(error)
        if silent > self._silence:
            raise NotConnected(
                f"{self._registers.line.name}: no good block for {silent:.1f} s, the limit is "
                f"{self._silence:.1f} s; last: {error}"
            ) from error
