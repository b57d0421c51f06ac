"""The thread between acquisition and all who look on: brings samples together, records them, publishes them.

Nothing here is urgent: wires and setpoints have threads of their own, and the interlocks have judged each sample
before it comes here.
"""

import threading
import time
from collections import Counter
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from bench.agent.messages import Samples
from bench.agent.recording import Columns, Recording
from bench.errors import LogError
from bench.rig.acquisition import Batch
from bench.rig.alignment import AlignedSamples, Aligner

PERIOD = 0.1
"""[s] between two turns."""
LIVE_PERIOD = 0.1
"""[s] between two messages of samples."""
LIVE_RATE = 250.0
"""[Hz] of the samples in them, at most."""
_JOIN = 2.0
"""[s] for the thread to end."""


class BenchThread:
    """Takes batches, hands on bench samples; a context manager.

    Args:
        aligner: brings channels together.
        rate: [Hz] of bench samples.
        publish: takes samples for live views.
        beat: called every turn.
        failed: told that the log cannot be written.
    """

    def __init__(
        self,
        aligner: Aligner,
        rate: float,
        publish: Callable[[Samples], None],
        beat: Callable[[], None],
        failed: Callable[[LogError], None],
    ) -> None:
        self.newest_ns = -1
        """Bench clock of the newest bench sample [ns]."""
        self._aligner, self._publish, self._beat, self._failed = aligner, publish, beat, failed
        self._every = max(1, round(rate / LIVE_RATE))
        self._lock = threading.Lock()
        self._recording: Recording | None = None
        self._lost_before: Counter[str] = Counter()
        self._live: list[tuple[AlignedSamples, Columns]] = []
        self._published = 0.0
        self._defect = False
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="bench", daemon=True)

    def __enter__(self) -> "BenchThread":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join(_JOIN)

    def feed(self, batch: Batch) -> None:
        """Take a batch, on the thread of its wire."""
        self._aligner.feed(batch)

    def record(self, recording: Recording) -> None:
        """Record from now on."""
        with self._lock:
            # What was lost before the run began is no loss of the run's.
            self._lost_before = Counter(self._aligner.lost)
            self._recording, self._defect = recording, False

    def lost(self) -> dict[str, int]:
        """Samples lost since recording began, by channel."""
        with self._lock:
            return dict(Counter(self._aligner.lost) - self._lost_before)

    def finish(self) -> dict[str, int]:
        """Record no more; samples lost meanwhile, by channel."""
        with self._lock:
            if self._recording is not None:
                self._recording.end()
            self._recording = None
            return dict(Counter(self._aligner.lost) - self._lost_before)

    def _run(self) -> None:
        while not self._stopping.wait(PERIOD):
            for step in (self._turn, self._send_live, self._beat):
                try:
                    step()
                except Exception as error:
                    # A thread that died in silence would take the watch over the force along.
                    self._told_defect(error)

    def _told_defect(self, error: Exception) -> None:
        """Told once a run: what cannot be done now cannot be done a tenth of a second later."""
        if not self._defect:
            self._defect = True
            self._failed(
                LogError(f"bench samples are not looked after: {error!r}; this is a defect, the run ends")
            )

    def _turn(self) -> None:
        with self._lock:
            failure = self._take_ready()
        if failure is not None:  # told without the lock: whoever ends the run may want to know what was lost
            self._failed(failure)

    def _take_ready(self) -> LogError | None:
        """Record what is ready; why not, where the log cannot be written."""
        aligned = self._aligner.ready()
        if aligned is None:
            return None
        columns: Columns = aligned.columns
        self.newest_ns = int(aligned.time_ns[-1])
        failure = None
        if self._recording is not None:
            try:
                columns = self._recording.take(aligned)
            except LogError as error:
                self._recording, failure = None, error
        self._live.append((aligned, columns))
        return failure

    def _send_live(self) -> None:
        now = time.monotonic()
        if not self._live or now - self._published < LIVE_PERIOD:
            return
        live, self._live, self._published = self._live, [], now
        recording = self._recording  # read once: a run may end meanwhile
        names = live[-1][1].keys()
        self._publish(
            Samples(
                time_ns=np.concatenate([aligned.time_ns for aligned, _ in live])[:: self._every].tolist(),
                values={
                    name: _listed([columns.get(name) for _, columns in live], [len(a.time_ns) for a, _ in live])[
                        :: self._every
                    ]
                    for name in names
                },
                segment="" if recording is None else recording.segment,
            )
        )


def _listed(parts: list[npt.NDArray[np.float64] | None], sizes: list[int]) -> list[float | None]:
    """One column of several batches; None where there is no value."""
    whole = [np.full(size, np.nan) if part is None else part for part, size in zip(parts, sizes, strict=True)]
    return [None if value != value else value for value in np.concatenate(whole).tolist()]
