"""Makes a run of a command, and carries it out under the limits that hold meanwhile."""

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from bench.agent.bench_thread import BenchThread
from bench.agent.header import LogFacts, clock_words, decoders, documents, run_header
from bench.agent.messages import RunCommand
from bench.agent.run import Run, order
from bench.agent.warden import Warden
from bench.methods import Method
from bench.rig.acquisition import Acquisition
from bench.rig.config import BenchConfig
from bench.rig.instruments import Rig
from bench.rig.priority import HASTE, pause_collection, raise_priority, resume_collection
from bench.safety.interlocks import Interlocks
from bench.safety.limits import specimen_matrix, stricter
from bench.sequencer.plan import RunPlan
from bench.sequencer.sequencer import Sequencer

_CLOCK_KNOWN = 20.0
"""[s] after which a device's clock is known to a few parts in a million; before, it is better taken as right."""
_CLOCKS_SETTLE = 4.0
"""[s] from opening the wires until their clocks are mapped well enough for a log."""


class Runner:
    """What a run needs of the agent.

    Args:
        config: of the bench.
        source: its file, kept in every log; logs go beside it.
        rig: the instruments.
        interlocks: that judge.
        warden: that acts on them.
        acquisition: that reads the instruments.
        bench: that records.
        clock: of the bench [ns].
        tell: told of what happens: kind, words, bench clock [ns].
    """

    def __init__(
        self,
        config: BenchConfig,
        source: Path | None,
        rig: Rig,
        interlocks: Interlocks,
        warden: Warden,
        acquisition: Acquisition,
        bench: BenchThread,
        clock: Callable[[], int],
        tell: Callable[..., None],
    ) -> None:
        self.opened_ns = 0
        """Bench clock when the wires were opened [ns]."""
        self._config, self._source, self._rig = config, source, rig
        self._interlocks, self._warden, self._acquisition = interlocks, warden, acquisition
        self._bench, self._clock, self._tell = bench, clock, tell

    def made(self, command: RunCommand) -> tuple[Run, LogFacts]:
        """The run that a command asks for, and what its log says of itself; nothing moves yet.

        Raises:
            MethodError, RunError: it cannot be run.
        """
        what = order(command, self._rig, self._config.rig.specimen, self._folder())
        plan = RunPlan()
        sequencer = Sequencer(
            self._rig.actuator,
            self._rig.amplifier,
            self._interlocks,
            plan,
            self._clock,
            self._tell,
            self._warden.late,
            self._warden.trip,
            self.set_led,
            partial(self._limit_by, what.method),
            self._amplifier_rate,
        )
        run = Run(what, plan, sequencer, self._bench, self._clock, self._tell)
        # Read now: a certificate that is missing is to be known before anything moves.
        kept = documents(what.method, self._config, self._rig, self._source)
        maps = self._acquisition.maps
        header = run_header(what.method, what.identity, self._config, self._rig, maps, self._clock())
        return run, LogFacts(header, kept, partial(decoders, self._rig), partial(clock_words, self._rig, maps))

    def carry_out(self, run: Run, facts: LogFacts) -> None:
        """Play and record a run to its end, whatever that is; the limits are then the bench's own again."""
        self._let_clocks_settle()
        # The way to where a method begins may lie outside of where the method stays.
        self._limit_by(run.what.method, without="displacement")
        self._interlocks.expect_force(self._clock())
        # An instrument that comes back begins its numbers and its clock anew, and would be set up mid-stroke.
        self._acquisition.reconnect, self._warden.plan = False, run.plan
        raise_priority(-HASTE)
        pause_collection()
        try:
            run.carry_out(facts, self._warden.settled, self._acquisition.maps)
        finally:
            resume_collection()
            self._warden.plan = None
            self._interlocks.expect_force(None)
            self._interlocks.matrix = self._config.limits.matrix()
            self._acquisition.reconnect = True

    def set_led(self, led: bool) -> None:
        """While nobody leads the rod, it has to be asked for samples."""
        self._acquisition.led = led

    def _let_clocks_settle(self) -> None:
        """Wait, right after the wires were opened, until enough answers tell where the devices' clocks stand."""
        left = self.opened_ns + round(_CLOCKS_SETTLE * 1e9) - self._clock()
        time.sleep(max(left * 1e-9, 0.0))

    def _limit_by(self, method: Method, without: str = "") -> None:
        """Let a method's limits hold beside the fixture's."""
        specimen = {name: steps for name, steps in specimen_matrix(method).items() if name != without}
        self._interlocks.matrix = stricter(self._config.limits.matrix(), specimen)

    def _amplifier_rate(self) -> float:
        """How fast the amplifier's clock is, as a share; nothing as long as it has not been watched for long."""
        known = self._clock() - self.opened_ns >= _CLOCK_KNOWN * 1e9
        return self._acquisition.maps[self._rig.amplifier.name].rate() if known else 0.0

    def _folder(self) -> Path:
        base = Path() if self._source is None else self._source.parent
        return base / self._config.rig.folder
