"""The load cell's clock beside the bench's: asked for between its samples, without waiting for the answer.

The adapter on the line hands bytes over some milliseconds late, but at a beat of its own: a question whose answer
just catches the next batch is answered quickly, and tells the most. So most questions are asked at the moment
after a batch that was best so far, and the others everywhere in between, to find a better one.
"""

from collections.abc import Callable

from drivers.channel import Stamp
from drivers.instrument import Clock
from drivers.load_cell_frames import CONTRACT, Acknowledgement, Request, encode
from drivers.load_cell_stream import SampleStream

_COMMAND: int = CONTRACT["commands"]["read_clock"]
_PERIOD_NS = round(CONTRACT["deadlines"]["clock_s"] * 1e9)
_REPLY_NS = round(CONTRACT["deadlines"]["reply_s"] * 1e9)
_AT_FIRST = ((64, 5_000_000), (256, 40_000_000))
"""Up to so many questions, [ns] from one to the next: the sooner the clock's rate is known, the sooner a run may
begin."""
_BEAT_NS = 8_000_000
"""[ns] over which questions are spread to find the best moment; an adapter's beat is shorter."""
_NEAR_NS = 300_000
"""[ns] around the best moment."""
_EXPLORED = 3
"""Of so many questions, one looks for a better moment."""
_FORGET = 1.02
"""Factor by which the quickest answer fades with each slower one."""
_GOLDEN = 0.6180339887498949
"""Its multiples without their whole turns are evenly spread, however many there are."""


class ClockReader:
    """Asks for the clock now and then."""

    def __init__(self, stream: SampleStream, clock: Clock, baud: int) -> None:
        """Nothing has been asked yet.

        Args:
            stream: takes what the instrument sends.
            clock: the bench clock [ns].
            baud: [bit/s]; the answer's own time on the line is known from it, and is no uncertainty.
        """
        self.stamp: Stamp | None = None
        """The newest reading of its clock."""
        answer = len(encode(Acknowledgement(0, 0, 0, 0))) * CONTRACT["line"]["bits_per_character"]
        self._answer_ns = int(answer / baud * 1e9)
        self._stream, self._clock = stream, clock
        self.restart()

    def restart(self) -> None:
        """The instrument has been connected anew."""
        self.stamp = None
        self._known = True
        self._token: int | None = None
        self._asked = self._sent_ns = self._due_ns = self._after_ns = 0
        self._best_ns, self._quickest = 0, float("inf")

    def patience(self) -> float:
        """[s] until there is something to ask, at least."""
        return max(self._moment() - self._clock(), 0) * 1e-9

    def idle(self) -> float:
        """[s] for which the line need not be read at once: no answer is due, and no beat before a question."""
        if not self._known:
            return float("inf")
        waiting = self._token is not None and self._clock() - self._sent_ns < _REPLY_NS
        return 0.0 if waiting else max(self._due_ns - _BEAT_NS - self._clock(), 0) * 1e-9

    def attend(self, token: Callable[[], int], write: Callable[[bytes], None]) -> None:
        """Take an answer that has come; ask again when it is time.

        Args:
            token: makes one for a request.
            write: sends a request.

        Raises:
            NotConnected, NoReply: as ``write`` does.
        """
        self._take()
        now = self._clock()
        waiting = self._token is not None and now - self._sent_ns < _REPLY_NS
        if now < self._moment() or waiting or not self._known or self._stream.rate is None:
            return
        self._asked += 1
        self._due_ns = now + next((every for many, every in _AT_FIRST if self._asked < many), _PERIOD_NS)
        self._token = token()
        # Tokens come round again, see `Dialogue`.
        self._stream.answers.pop(self._token, None)
        self._after_ns = now - (self._stream.last_ns or now)
        # Before it is written: however long that takes, the clock is read after this.
        self._sent_ns = self._clock()
        write(encode(Request(self._token, _COMMAND, 0)))

    def _moment(self) -> int:
        """When to ask next [ns]: once it is due, at the wanted time after a batch, or after two beats at any."""
        turn = self._asked * _GOLDEN % 1
        exploring = self._asked % _EXPLORED == 0 or self._quickest == float("inf")
        after = turn * _BEAT_NS if exploring else self._best_ns + (turn - 0.5) * _NEAR_NS
        wanted = (self._stream.last_ns or 0) + round(max(after, 0.0))
        return min(max(self._due_ns, wanted), self._due_ns + 2 * _BEAT_NS)

    def _take(self) -> None:
        answer = None if self._token is None else self._stream.answers.get(self._token)
        if not isinstance(answer, Acknowledgement) or self._token is None or answer.command != _COMMAND:
            return
        received_ns = self._stream.answered_ns[self._token]
        self._token = None
        self._known = answer.code == CONTRACT["codes"]["done"]
        if not self._known:
            return
        took = received_ns - self._sent_ns
        if took <= self._quickest:
            self._best_ns, self._quickest = self._after_ns, took
        else:
            self._quickest *= _FORGET
        left_ns = max(received_ns - self._answer_ns, self._sent_ns)
        self.stamp = Stamp(self._stream.unwrapped(answer.value) * 1000, self._sent_ns, left_ns)
