"""A whole bench whose processes are killed by SIGKILL at random moments of runs and jobs, and what must hold then.

``python -m tests.support.killed_bench FOLDER KILLS SEED`` repeats it as often as wanted, for the evidence. Each
round starts a run or lets the jobs of earlier ones go on, waits for a random moment and kills one part or all.
Then it does what a technician would: it starts rig and service again, and resets a trip. The service starts agent
and worker again. Jobs are the quick ones of `tests.support.quick_jobs`, so that no kill waits for a fit.
"""

import random
import re
import subprocess
import threading
import time
from collections import Counter
from dataclasses import dataclass, field

from bench.client import ClientError
from tests.support.bench_processes import ENVIRONMENT, MRBENCH, PARTS, BenchProcesses, wait_for
from tests.support.killed_bench_checks import Records, check_records
from tests.support.live_bench import method
from tests.support.statements import StatementWatch
from tests.support.tally import Tally, repeat

VICTIMS = (*PARTS, "all")
LATEST_KILL = 10.0
"""Latest moment of a kill after the start of a run [s]: the run takes about six seconds, its jobs about five."""
LATEST_NEXT_KILL = 4.0
"""Latest moment of a kill that follows another one without a run between them [s]."""
KILLS_OF_ONE_BENCH = 20
RUN_SHARE = 0.5
"""Share of the kills before which a run is started; the others meet a recovering bench, or jobs."""


class StartedRun:
    """Request of a run in a thread, so that a kill may meet it."""

    def __init__(self, bench):
        self.run, self.refusal, self.has_answer = None, "", True
        self._client, self._thread = bench.client, threading.Thread(target=self._start)
        self._thread.start()

    def wait(self):
        self._thread.join()
        return self

    def _start(self):
        try:
            self.run = self._client.start(method(), "MR-0042").id
        except ClientError as error:
            self.refusal, self.has_answer = str(error), error.status is not None


@dataclass
class Result(Tally):
    """Kills of one or several benches, what they met, and what was wrong afterwards."""

    kills: Counter = field(default_factory=Counter)
    accepted: list = field(default_factory=list)
    refusals: Counter = field(default_factory=Counter)
    lost: int = 0
    """Number of starts whose service was killed before it answered."""
    unanswered: list = field(default_factory=list)
    """Starts without an answer although no one has killed the service."""
    statements: Counter = field(default_factory=Counter)
    """Number of answers by path."""
    untrue: list = field(default_factory=list)
    records: Records = field(default_factory=Records)

    def note(self, started, killed):
        """Note the answer to a start during which parts were killed."""
        if started.run is not None:
            self.accepted.append(started.run)
        elif started.has_answer:
            self.refusals[re.sub(r"/\S+|\d\S*", "...", started.refusal)] += 1
        elif "service" in killed:
            self.lost += 1
        else:
            self.unanswered.append(started.refusal)

    def list_rows(self):
        """Return name and value of each row of the table."""
        records = self.records
        starts = f"{len(self.accepted)} accepted, {self.refusals.total()} refused, {self.lost} with the service"
        return {
            "kills": dict(self.kills), "starts": starts, "refusals": dict(self.refusals),
            "starts without an answer": self.unanswered, "runs by outcome": dict(records.outcomes),
            "logs": dict(records.logs), "jobs": dict(records.results), "attempts of jobs": dict(records.attempts),
            "statements": dict(self.statements), "untrue statements": self.untrue, "problems": records.problems,
        }  # fmt: skip


def execute_round(bench, draw, result):
    """Wait for a random moment of a run or of what follows one, kill, and start again what is missing."""
    victim, is_run, moment = draw.choice(VICTIMS), draw.random() < RUN_SHARE, draw.random()
    started = None
    if is_run:
        await_ready(bench)
        started = StartedRun(bench)
    _pause(moment * (LATEST_KILL if is_run else LATEST_NEXT_KILL))
    killed = [name for name in (PARTS if victim == "all" else (victim,)) if bench.kill(name)]
    result.kills[victim] += bool(killed)
    restart(bench)
    if started is not None:
        result.note(started.wait(), killed)


def restart(bench):
    """Start again what nothing else starts again."""
    if not bench.is_alive("rig"):
        bench.start_rig()
    if not bench.is_alive("service"):
        bench.start_service()


def await_ready(bench):
    """Wait until a run can be started; reset trips, and end an agent whose rig is another one now."""
    handled = 0.0

    def is_ready():
        nonlocal handled
        status = bench.get("/bench")
        # An older status says nothing about what was done since.
        if status is None or status["utc_s"] < handled:
            return False
        if status["state"] == "tripped":
            handle_trip(bench, status)
            handled = time.time()
        is_connected = all(one["connected"] for one in status["instruments"])
        return status["state"] == "idle" and not status["notice"] and is_connected

    wait_for(is_ready, lambda: f"not ready: {bench.get('/bench')} {bench.get('/health')}")


def handle_trip(bench, status):
    """Reset a trip, or end the agent if its rig is another one now."""
    if status["notice"]:
        command = [*MRBENCH, "rig", "--end", "--force", "--config", bench.toml.name]
        subprocess.run(command, cwd=bench.folder, env=ENVIRONMENT, capture_output=True, timeout=60, check=False)
    else:
        bench.post("/bench/reset")


def _pause(seconds):
    """Wait for a random moment: no condition is waited for."""
    time.sleep(seconds)


def kill_at_random(folder, kills, seed):
    """Kill parts of a bench in a folder at random moments, and return the result."""
    bench, draw, result = BenchProcesses(folder), random.Random(seed), Result()
    try:
        bench.start_rig()
        bench.start_service()
        with StatementWatch(bench) as watch:
            while result.kills.total() < kills:
                execute_round(bench, draw, result)
            await_ready(bench)
            result.records = check_records(bench, result.accepted)
        result.statements, result.untrue = watch.count(), watch.find_untrue()
        return result
    finally:
        bench.end()


if __name__ == "__main__":
    repeat(kill_at_random, Result(), KILLS_OF_ONE_BENCH)
