"""Acts on what the interlocks find: alarm, hold, controlled stop, trip.

Called on the threads of the wires, at the moment that a sample has come; a trip starts its own threads at once and
waits for nobody.
"""

import threading
from collections.abc import Callable, Mapping
from itertools import chain
from typing import Any

from bench.rig.acquisition import Batch
from bench.rig.clock_map import ClockMap
from bench.rig.instruments import Rig
from bench.safety.interlocks import Interlocks, following_error
from bench.safety.limits import Action, Verdict
from bench.safety.trip import DEADLINE, bring_to_rest
from bench.sequencer.plan import RunPlan
from drivers.channel import Block

_TOLD_CYCLES = 2
"""Cycles of lateness beyond which the log says so; a drive bridges less."""

Stop = Callable[[str, bool], None]
"""Ends the run in good order: why, and whether the rod is held."""


class Warden:
    """The interlocks at work.

    Args:
        rig: what is brought to rest in a trip.
        interlocks: that judge.
        clock: of the bench [ns].
        maps: of the instruments' clocks, by name.
        tell: told of what happens: kind, words, and as names what more is known.
        stop: ends a run in good order.
    """

    def __init__(
        self,
        rig: Rig,
        interlocks: Interlocks,
        clock: Callable[[], int],
        maps: Mapping[str, ClockMap],
        tell: Callable[..., None],
        stop: Stop,
    ) -> None:
        self.plan: RunPlan | None = None
        """What the rod was sent to, while a run leads it."""
        self._rig, self._interlocks, self._clock = rig, interlocks, clock
        self._maps, self._tell, self._stop = maps, tell, stop
        self._rest: threading.Thread | None = None
        self._cycle_ns = round(rig.actuator.settings.cycle * 1e9)

    def look(self, batch: Batch) -> None:
        """Judge what has just come."""
        now = self._clock()
        verdicts = self._interlocks.check(batch.blocks, now)
        if self.plan is not None and batch.instrument == self._rig.actuator.name:
            verdicts += self._interlocks.check_value(
                "following_error", self._following_error(batch, self.plan), now
            )
        for verdict in verdicts:
            self._act_on(verdict)

    def tick(self) -> None:
        """Judge what no sample tells: that none comes."""
        for verdict in self._interlocks.check((), self._clock()):
            self._act_on(verdict)

    def late(self, now_ns: int, late: float) -> None:
        """A setpoint left late [s]; the log says when, for then the rod may not have moved as it should."""
        if late * 1e9 > _TOLD_CYCLES * self._cycle_ns:
            self._tell(
                "late", f"a setpoint left {1e3 * late:.1f} ms late", quantity="setpoint_lateness", value=late
            )
        for verdict in self._interlocks.check_value("setpoint_lateness", late, now_ns):
            self._act_on(verdict)

    def act(self, action: Action, why: str, **more: Any) -> None:
        """Do what an action means; what more is known of its cause goes into the log."""
        if action is Action.TRIP:
            self.trip(why, **more)
        elif action is not Action.NONE:
            self._tell("alarm", why, **more)
            if action is not Action.INDICATE:
                self._stop(why, action is Action.HOLD)

    def trip(self, why: str, **more: Any) -> None:
        """Bring coil and actuator to rest at once, each in a thread of its own; latched."""
        if not self._interlocks.latch(why):
            return
        # To rest first, then words: to tell of it may wait for a lock, to act on it must not.
        self._rest = threading.Thread(target=self._bring_to_rest, name="trip", daemon=True)
        self._rest.start()
        self._tell("trip", why, **more)
        self._stop(why, False)

    def settled(self) -> str:
        """Wait until a trip has done its work; why it tripped, empty where it did not."""
        if self._rest is not None:
            self._rest.join(2 * DEADLINE)
        return self._interlocks.tripped

    def _act_on(self, verdict: Verdict) -> None:
        self.act(verdict.action, str(verdict), quantity=verdict.quantity, value=verdict.value, limit=verdict.limit)

    def _bring_to_rest(self) -> None:
        rest = bring_to_rest([self._rig.amplifier, self._rig.actuator])
        self._tell("state", f"brought to rest: {rest}")

    def _following_error(self, batch: Batch, plan: RunPlan) -> float:
        """Of all samples of a batch: their numbers say how many cycles they lie apart, lost ones included."""
        positions = [block for block in batch.blocks if block.channel == "actuator_position"]
        values = list(chain.from_iterable(block.values.tolist() for block in positions))
        numbers = chain.from_iterable(range(block.first, block.first + len(block.values)) for block in positions)
        newest = positions[-1].first + len(positions[-1].values) - 1
        taken_ns = self._taken_ns(batch.instrument, positions[-1])
        times = [taken_ns - (newest - number) * self._cycle_ns for number in numbers]
        return following_error(values, times, plan.position)

    def _taken_ns(self, instrument: str, block: Block) -> int:
        """Bench clock when a block's last sample was taken [ns]: a rod is not astray because it was read late."""
        clock = self._maps.get(instrument)
        if clock is None or not clock.known or block.device_ns is None:
            return block.received_ns
        return clock.instant(int(block.device_ns[-1]))
