"""One run: what was asked for, who carries it out, what became of it."""

import contextlib
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from bench.agent.bench_thread import BenchThread
from bench.agent.header import LogFacts
from bench.agent.messages import RunCommand, RunOutcome, RunStatus
from bench.agent.recording import Recording
from bench.errors import BenchError, RunError
from bench.methods import Method, Programme, compile_method
from bench.methods.compile import BETWEEN
from bench.methods.document import method_of
from bench.recorder.live import LiveRecorder
from bench.rig.clock_map import ClockMap
from bench.rig.instruments import Rig
from bench.run_from_plant import Identity
from bench.sequencer.passages import after_segment, passages
from bench.sequencer.plan import RunPlan
from bench.sequencer.sequencer import Sequencer
from drivers.errors import DriverError

_LAST_SAMPLES = 2.0
"""[s] for the samples of a run's last moment to come; the LVDT's take tens of milliseconds."""
_AFTER = 0.2
"""[s] that are recorded after everything has come to rest."""
_LOOK = 0.02
"""[s] between two looks while waiting."""


@dataclass(frozen=True)
class Order:
    """What is to be run, checked as far as that goes before anything moves."""

    programme: Programme
    first: int
    """Sample of the programme to begin with."""
    identity: Identity
    path: Path
    """The log."""

    @property
    def method(self) -> Method:
        """The method that is run."""
        return self.programme.method


def order(command: RunCommand, rig: Rig, specimen: str, folder: Path) -> Order:
    """What a command asks for.

    Args:
        command: as it came.
        rig: on which it is to run.
        specimen: that is mounted, where the command does not say.
        folder: where logs go.

    Raises:
        MethodError: the method is none, or cannot be compiled within its limits.
        RunError: this bench cannot run it, or there is no place for the log.
    """
    programme = compile_method(method_of(command.method, "what was sent"))
    method = programme.method
    if method.drive_kind != rig.drive_kind:
        raise RunError(
            f"method {method.name} drives by {method.drive_kind}, this bench by {rig.drive_kind}; take another "
            "method, or set the mode of the coil amplifier in bench.toml"
        )
    first = after_segment(programme, command.resume_after) if command.resume_after else 0
    passages(programme, rig.amplifier.table_capacity, first)
    identity = Identity(command.specimen or specimen, command.operator, datetime.now(UTC))
    path = Path(command.log) if command.log else folder / f"{identity.run_id(method)}.mcap"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RunError(f"{path.parent}: logs cannot go there ({error.strerror}); choose another folder") from None
    return Order(programme, first, identity, path)


class Run:
    """One run on the rig.

    Args:
        what: is to be run.
        plan: what is commanded when.
        sequencer: plays it.
        bench: records it.
        clock: of the bench [ns].
        tell: told of what happens: kind, words, bench clock [ns].
    """

    def __init__(
        self,
        what: Order,
        plan: RunPlan,
        sequencer: Sequencer,
        bench: BenchThread,
        clock: Callable[[], int],
        tell: Callable[[str, str, int], None],
    ) -> None:
        self.what, self.plan, self.sequencer = what, plan, sequencer
        self.log: LiveRecorder | None = None
        self._bench, self._clock, self._tell = bench, clock, tell
        self._reason = ""
        self._outcome: RunOutcome | None = None
        self._lost: dict[str, int] = {}
        self._started = datetime.now(UTC)

    def carry_out(
        self,
        facts: LogFacts,
        settled: Callable[[], str],
        maps: Mapping[str, ClockMap],
    ) -> None:
        """Play and record it; returns when everything is at rest and the log is closed.

        Args:
            facts: what the log says beside what happens in it.
            settled: waits until a trip has done its work, and says why it tripped; empty where it did not.
            maps: of the instruments' clocks, by name.
        """
        try:
            self.log = LiveRecorder(self.what.path, facts.header, maps=maps)
        except BenchError as error:
            self._outcome, self._reason = "incomplete", str(error)
            return
        try:
            self._play(facts)
        except (BenchError, DriverError) as error:
            self._reason = str(error)
        except Exception as error:  # the log is closed and the next run waits, whatever happened
            self._reason = f"the run failed: {error!r}; this is a defect"
        tripped = settled()
        # A trip makes setpoints fail, and those end the run: of several reasons it is the first.
        self._reason = tripped or self._reason or self.sequencer.stopped
        self._await_samples(self._clock() + round(_AFTER * 1e9))
        try:
            self._close(facts.clocks)
        except Exception as error:  # without an outcome the run would seem to go on for ever
            self._reason = f"its log does not end in good order: {error!r}; this is a defect"
            self._outcome = "incomplete"
            log, self.log = self.log, None
            if log is not None:
                with contextlib.suppress(Exception):
                    log.close("incomplete", self._reason)

    def status(self) -> RunStatus:
        """How far it is."""
        what, method = self.what, self.what.method
        elapsed, segment = self.plan.progress(self._clock())
        over = self._outcome is not None
        return RunStatus(
            id=what.identity.run_id(method),
            method=method.name,
            specimen=what.identity.specimen,
            operator=what.identity.operator,
            log=str(what.path),
            started=self._started.isoformat(),
            duration_s=what.programme.duration,
            elapsed_s=elapsed,
            segment="" if over or segment == BETWEEN else what.programme.segments[segment].name,
            outcome=self._outcome,
            reason=self._reason if over else "",
            lost=self._lost if over else self._bench.lost(),
        )

    def _play(self, facts: LogFacts) -> None:
        if self.log is None:
            return
        for document in [*facts.documents, facts.decoders()]:
            self.log.attach(document.name, document.media_type, document.data)
        programme, name = self.what.programme, self.what.method.name
        self._bench.record(Recording(self.log, programme, self.plan, self._tell_at, self._clock()))
        resumed = f" from {programme.time[self.what.first]:.1f} s on" if self.what.first else ""
        self._tell("state", f"run of method {name} started{resumed}", self._clock())
        self.sequencer.run(programme, self.what.first)

    def _tell_at(self, time_ns: int, kind: str, text: str) -> None:
        self._tell(kind, text, time_ns)

    def _await_samples(self, until_ns: int) -> None:
        """Until samples of the last moment have come; where a channel is dead, they will not."""
        deadline = time.monotonic() + _LAST_SAMPLES
        while self._bench.newest_ns < until_ns and time.monotonic() < deadline:
            time.sleep(_LOOK)

    def _close(self, clocks: Callable[[], dict[str, str]]) -> None:
        if self.log is None:
            return
        self._tell("state", "run finished" if not self._reason else f"run ended: {self._reason}", self._clock())
        lost = self._bench.finish()
        for channel, count in lost.items():
            self.log.lost(channel, count)
        lost = {**lost, **self.log.dropped}
        outcome: RunOutcome = "incomplete"
        try:
            self.log.clocks(clocks())
            closed = self.log.close("incomplete" if self._reason else None, self._reason)
            outcome = "incomplete" if closed == "truncated" else closed
        except BenchError as error:
            self._reason = str(error)
        # The outcome last: who sees one takes all else for final.
        self._lost = lost
        self._outcome = outcome
        self.log = None
