"""Readings of the load cell's clock, requested between its samples without waiting for the reply.

The serial adapter delivers bytes in batches, some milliseconds apart. A request whose reply just makes the next
batch has the shortest round trip, and so the least uncertain reading. Most requests are therefore sent at the
phase after a batch with the shortest round trip so far. The others are spread over the batch period, to find a
better phase.
"""

import math
from collections.abc import Callable

from drivers.channel import ClockReading
from drivers.instrument import Clock
from drivers.load_cell.decoder import LoadCellDecoder
from drivers.load_cell.frames import CONTRACT, Acknowledgement, Request, encode_frame

_READ_CLOCK: int = CONTRACT["commands"]["read_clock"]
_PERIOD_NS = round(CONTRACT["deadlines"]["clock_s"] * 1e9)
_REPLY_TIMEOUT_NS = round(CONTRACT["deadlines"]["reply_s"] * 1e9)
_INITIAL_PERIODS = ((64, 5_000_000), (256, 40_000_000))
"""Number of a request, and the period [ns] up to it: a run can begin once the clock's rate is known."""
_BATCH_PERIOD_NS = 8_000_000
"""Time over which requests are spread to find the best phase [ns]; an adapter's batches are closer together."""
_PHASE_SPREAD_NS = 300_000
"""Spread of requests around the best phase [ns]."""
_EXPLORE_EVERY = 3
"""Requests of which one explores other phases."""
_FORGETTING_FACTOR = 1.02
"""Factor by which the shortest round trip grows with each longer one."""
_GOLDEN_RATIO = 0.6180339887498949
"""Fractional parts of its multiples are evenly spread, whatever their number."""


class ClockReader:
    """Periodic requests for the load cell's clock."""

    def __init__(self, decoder: LoadCellDecoder, clock: Clock, baud: int) -> None:
        """Prepare; nothing is sent yet.

        Args:
            decoder: decoder of the received bytes, which collects the replies.
            clock: bench clock [ns].
            baud: [bit/s]; it gives the duration of the reply on the line, which is not an uncertainty.
        """
        self.clock_reading: ClockReading | None = None
        """Latest reading."""
        reply_bits = len(encode_frame(Acknowledgement(0, 0, 0, 0))) * CONTRACT["line"]["bits_per_character"]
        self._reply_duration_ns = int(reply_bits / baud * 1e9)
        self._decoder, self._clock = decoder, clock
        self.restart()

    def restart(self) -> None:
        """Begin again, after the instrument was connected."""
        self.clock_reading = None
        self._supported = True
        self._token: int | None = None
        self._request_count = self._sent_ns = self._due_ns = self._phase_ns = 0
        self._best_phase_ns, self._best_round_trip = 0, math.inf

    def compute_wait(self) -> float:
        """Return the least time [s] until the next request."""
        return max(self._find_request_time() - self._clock(), 0) * 1e-9

    def compute_idle_time(self) -> float:
        """Return the time [s] without need to read the line: no reply is due, nor a batch before a request."""
        if not self._supported:
            return math.inf
        if self._is_waiting(self._clock()):
            return 0.0
        return max(self._due_ns - _BATCH_PERIOD_NS - self._clock(), 0) * 1e-9

    def poll(self, make_token: Callable[[], int], write: Callable[[bytes], None]) -> None:
        """Take a reply that has arrived, and send a request if one is due.

        Args:
            make_token: function that makes a token for a request.
            write: function that sends bytes.

        Raises:
            NotConnectedError, NoReplyError: raised by ``write``.
        """
        self._read_reply()
        now = self._clock()
        if (
            now < self._find_request_time()
            or self._is_waiting(now)
            or not self._supported
            or self._decoder.rate is None
        ):
            return
        self._request_count += 1
        periods = (period for count, period in _INITIAL_PERIODS if self._request_count < count)
        self._due_ns = now + next(periods, _PERIOD_NS)
        self._token = make_token()
        # Tokens repeat, see `CommandChannel`.
        self._decoder.replies.pop(self._token, None)
        self._phase_ns = now - (self._decoder.last_ns or now)
        # Before the write: however long that takes, the clock is read later.
        self._sent_ns = self._clock()
        write(encode_frame(Request(self._token, _READ_CLOCK, 0)))

    def _is_waiting(self, now_ns: int) -> bool:
        return self._token is not None and now_ns - self._sent_ns < _REPLY_TIMEOUT_NS

    def _find_request_time(self) -> int:
        """Return the time of the next request [ns]: when due, at the chosen phase, at most two batches late."""
        fraction = self._request_count * _GOLDEN_RATIO % 1
        exploring = self._request_count % _EXPLORE_EVERY == 0 or self._best_round_trip == math.inf
        phase = (
            fraction * _BATCH_PERIOD_NS if exploring else self._best_phase_ns + (fraction - 0.5) * _PHASE_SPREAD_NS
        )
        chosen_ns = (self._decoder.last_ns or 0) + round(max(phase, 0.0))
        return min(max(self._due_ns, chosen_ns), self._due_ns + 2 * _BATCH_PERIOD_NS)

    def _read_reply(self) -> None:
        reply = None if self._token is None else self._decoder.replies.get(self._token)
        if not isinstance(reply, Acknowledgement) or self._token is None or reply.command != _READ_CLOCK:
            return
        received_ns = self._decoder.reply_ns[self._token]
        self._token = None
        self._supported = reply.code == CONTRACT["codes"]["done"]
        if not self._supported:
            return
        round_trip = received_ns - self._sent_ns
        if round_trip <= self._best_round_trip:
            self._best_phase_ns, self._best_round_trip = self._phase_ns, round_trip
        else:
            self._best_round_trip *= _FORGETTING_FACTOR
        reply_sent_ns = max(received_ns - self._reply_duration_ns, self._sent_ns)
        device_ns = self._decoder.unwrap_clock(reply.value) * 1000
        self.clock_reading = ClockReading(device_ns, self._sent_ns, reply_sent_ns)
