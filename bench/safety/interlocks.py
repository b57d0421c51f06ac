"""Watches every sample that comes, and has the last word before anything is sent.

The interlocks know nothing of threads or wires: time and samples are handed in, verdicts come back. Fast limits
rest on the actuator's own encoder and on the load cell; the LVDT's samples are tens of milliseconds old when they
come, good for the record alone.
"""

import math
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence

from bench.errors import Interlocked
from bench.safety.limits import Action, Matrix, Quantity, Verdict, judge
from drivers.channel import Block

_WATCHED: dict[str, Quantity] = {
    "force": "force",
    "actuator_position": "displacement",
    "actuator_velocity": "actuator_velocity",
    "coil_current": "coil_current",
    "coil_voltage": "coil_voltage",
    "temperature": "temperature",
}
"""Quantity behind each channel; ``force_raw``, LVDT and torque are not limited."""
_AGAIN = 1.0
"""[s] after which an action that was taken already is reported again, if its cause stays."""


class Interlocks:
    """One matrix of limits at work; may be used from any thread.

    Args:
        matrix: of both tiers.
        drive: the quantity that is commanded of the coil.
    """

    def __init__(self, matrix: Matrix, drive: Quantity) -> None:
        self.matrix = matrix
        self._drive = drive
        self._latching = threading.Lock()
        self._tripped = ""
        self._force_ns: int | None = None
        self._told: dict[tuple[Quantity, Action], int] = {}

    @property
    def tripped(self) -> str:
        """Why everything was brought to rest; empty where it was not."""
        return self._tripped

    def latch(self, why: str) -> bool:
        """Refuse every write from now on; false where that was so already."""
        with self._latching:
            first = not self._tripped
            self._tripped = self._tripped or why
        return first

    def reset(self) -> None:
        """Allow writes again."""
        self._tripped = ""
        # What comes next is news, however soon it comes.
        self._told.clear()

    def expect_force(self, since_ns: int | None) -> None:
        """Expect force samples from an instant on [ns]; none for no longer."""
        self._force_ns = since_ns

    def check(self, blocks: Iterable[Block], now_ns: int) -> list[Verdict]:
        """What new samples ask for, strongest first.

        Args:
            blocks: as acquired.
            now_ns: bench clock.
        """
        found = [verdict for block in blocks for verdict in self._of_block(block)]
        found += self._judged("force_age", self.force_age(now_ns))
        return self._fresh(found, now_ns)

    def check_value(self, quantity: Quantity, value: float, now_ns: int) -> list[Verdict]:
        """What one value [in the quantity's unit] asks for."""
        return self._fresh(self._judged(quantity, value), now_ns)

    def force_age(self, now_ns: int) -> float:
        """[s] since the newest good force sample came; 0 before one was expected."""
        since = self._force_ns
        return 0.0 if since is None else (now_ns - since) * 1e-9

    def permit(self, position: float | None = None, drive: float | None = None) -> None:
        """The last word before a write.

        Args:
            position: [m] setpoint of the actuator.
            drive: [V or A] of the coil.

        Raises:
            Interlocked: everything was brought to rest, or the value itself is beyond what ends a run.
        """
        if self._tripped:
            raise Interlocked(f"nothing is sent after a trip ({self._tripped}); find the cause, then reset")
        for quantity, value in (("displacement", position), (self._drive, drive)):
            if value is not None:
                self._permit(quantity, value)  # type: ignore[arg-type]  # both are quantities

    def _permit(self, quantity: Quantity, value: float) -> None:
        if not math.isfinite(value):
            raise Interlocked(
                f"a commanded {quantity.replace('_', ' ')} of {value} is no number; nothing was sent"
            )
        verdict = judge(self.matrix, quantity, value)
        if verdict is not None and verdict.action >= Action.CONTROLLED_STOP:
            raise Interlocked(f"commanded {verdict}; nothing was sent")

    def _of_block(self, block: Block) -> Iterator[Verdict]:
        quantity = _WATCHED.get(block.channel)
        if quantity is None or not len(block.values):
            return
        worst = _largest(block.values.tolist())  # plain numbers: blocks are short, and arrays the slower way
        # A sample that is bad came in time, and says nothing of the force: it must not count as news of it.
        expected = self._force_ns is not None
        if expected and block.channel == "force" and block.quality != "bad" and not math.isnan(worst):
            self._force_ns = block.received_ns
        yield from self._judged(quantity, worst)

    def _judged(self, quantity: Quantity, value: float) -> list[Verdict]:
        verdict = judge(self.matrix, quantity, value)
        return [] if verdict is None else [verdict]

    def _fresh(self, verdicts: list[Verdict], now_ns: int) -> list[Verdict]:
        """Without what was reported a moment ago: a limit that stays exceeded is one alarm, not a thousand."""
        fresh = []
        for verdict in sorted(verdicts, key=lambda one: one.action, reverse=True):
            key = verdict.quantity, verdict.action
            # By action, too: what was an alarm a moment ago and is a trip now is news.
            if now_ns - self._told.get(key, -(2**62)) >= _AGAIN * 1e9:
                self._told[key] = now_ns
                fresh.append(verdict)
        return fresh


def _largest(values: Iterable[float]) -> float:
    """The value of largest magnitude that is a number, with its sign; NaN where none is."""
    return max((value for value in values if value == value), key=abs, default=math.nan)


def following_error(position: Sequence[float], time_ns: Sequence[int], command: Callable[[int], float]) -> float:
    """How far the rod is from where it was sent, at worst, with its sign [m].

    Args:
        position: [m] by the drive's encoder. Lists, since for a sample or two arrays are the slower way.
        time_ns: bench clock of these samples [ns].
        command: where the rod was sent at an instant of the bench clock [ns]: [m].
    """
    return _largest(place - command(instant) for place, instant in zip(position, time_ns, strict=True))
