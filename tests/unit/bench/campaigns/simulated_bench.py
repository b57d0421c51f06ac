"""A bench for tests of campaigns: runs are facts in memory, and the process may die at any step."""

from bench.campaigns.document import collect_methods, parse_campaign
from bench.campaigns.engine import ExecutionReport, Observation, RunResult, advance, recover, start_campaign

ID = "night-1"


def start(steps, now=1000.0, **more):
    document = parse_campaign({"name": "night", "steps": steps, **more}, "the test")
    return start_campaign(document, collect_methods(document), now, "A. Meyer")


class SimulatedBench:
    """Executes a campaign; all that it remembers is what a disk would: logs of complete and truncated runs."""

    def __init__(self, state, run_time=20.0):
        self.state, self.now, self.run_time = state, state.updated, run_time
        self.logs = {}
        self.outcomes = {}
        self.messages = list(state.outbox)
        self.temperature = None
        self.results = {}
        self.obstacle = ""
        self.report = None
        self.answers = True
        self.setup_reports, self.prepared = [], []

    def store(self, state):
        """Store a state as the catalogue does: as a document, without its messages."""
        self.messages += state.outbox
        self.state = type(state).model_validate(state.model_dump(mode="json", by_alias=True))

    def step(self):
        """Make one transition, act on it, and let time pass."""
        report, self.report = self.report, None
        seen = Observation(
            report=report, temperature_c=self.temperature, results=self.results, obstacle=self.obstacle
        )
        self.store(advance(self.state, seen, self.now, ID))
        active = self.state.active
        if active is not None and active.execution is None and active.phase in ("starting", "preparing"):
            self.prepare(active)
        elif active is not None and active.phase == "starting":
            self.play(active.execution.log)
        elif self.state.active is not None and active.phase == "resting":
            self.now = active.deadline
        else:
            self.now += 1.0

    def prepare(self, active):
        """Execute a setup step; its reports are those of the test, the last one `ended`."""
        if active.phase == "starting":
            self.prepared.append(active.item)
        self.now += 1.0
        self.report = self.setup_reports.pop(0) if self.setup_reports else ExecutionReport(kind="ended")

    def play(self, log):
        assert log not in self.logs, "a log is never written twice"
        default = {"outcome": "clean", "ending": "completed"}
        given = self.outcomes.pop(len(self.logs), default)
        self.now += self.run_time
        self.logs[log] = ExecutionReport(
            **({"kind": "ended", "run": f"run-{len(self.logs)}", "duration_s": self.run_time} | given)
        )
        self.report = self.logs[log]

    def die(self, checkpoint="", has_log=False, has_samples=True):
        """Lose everything but the stored state and the logs; then continue."""
        self.report = None
        self.now += 60.0
        active = self.state.active
        report = None
        if self.state.is_stroking and active.execution is not None:
            report = self.logs.get(active.execution.log)
            if report is None:
                run = f"part-{len(self.logs)}" if has_log else ""
                report = ExecutionReport(
                    kind="crashed",
                    run=run,
                    checkpoint=checkpoint if has_log else "",
                    reason="killed",
                    has_samples=has_samples,
                )
                if has_log:
                    self.logs[active.execution.log] = report
        self.store(recover(self.state, Observation(report=report), self.now, ID))

    def run(self, limit=2000):
        """Run until the campaign ends or waits for a person."""
        for _ in range(limit):
            if self.state.has_ended or self.state.status == "paused" or self.state.needs_person:
                return self.state
            self.step()
        raise AssertionError(f"no end after {limit} steps: {self.state.active}")

    def texts(self, kind):
        return [message.text for message in self.messages if message.kind == kind]


def result(value, half, stroke=None, **more):
    parameter = {"value": value, "low": value - half, "high": value + half, "unit": "N/m"}
    return RunResult(parameters={"k0": parameter}, next_stroke=stroke, is_diagnosed=True, **more)
