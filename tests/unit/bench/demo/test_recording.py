import pytest

from bench.demo.recording import await_job, cancel_jobs, record
from bench.errors import RunError


class Service:
    """Service whose runs end at once, each with the next outcome."""

    def __init__(self, *outcomes):
        self.outcomes, self.posted = list(outcomes), []

    def post(self, path, content):
        self.posted.append(path)
        if path != "/runs":
            return {}
        outcome = self.outcomes.pop(0)
        reason = "" if outcome == "clean" else "following error 10 mm exceeds the limit of 8 mm"
        return {
            "id": f"run{self.posted.count('/runs')}", "state": "ended", "outcome": outcome, "reason": reason,
            "duration_s": 1.0,
        }  # fmt: skip


def test_a_clean_run_is_not_repeated():
    service = Service("clean")
    assert record(service, "quick", lambda share: None) == "run1"
    assert service.posted == ["/runs"]


def test_an_unclean_run_is_repeated_after_a_reset_with_its_reason():
    service, messages = Service("incomplete", "clean"), []
    assert record(service, "quick", lambda share: None, messages.append) == "run2"
    assert service.posted == ["/runs", "/bench/reset", "/runs"]
    assert messages == [
        "the run of quick is incomplete: following error 10 mm exceeds the limit of 8 mm; attempt 2 of 3"
    ]


def test_the_third_unclean_run_is_the_last():
    service = Service("incomplete", "lossy", "incomplete", "clean")
    with pytest.raises(RunError, match="quick is incomplete"):
        record(service, "quick", lambda share: None)
    assert service.posted.count("/runs") == 3


class Jobs:
    """Service with jobs that stop some requests after they were cancelled; one has just ended."""

    def __init__(self, **states):
        self.states, self.asked = states, []

    def get(self, path):
        items = [
            {"id": name, "kind": name, "state": state, "error": "lost"} for name, state in self.states.items()
        ]
        if path.startswith("/runs/"):
            return {"jobs": items}
        unfinished = [job for job in items if job["state"] in ("queued", "running")]
        self.states |= dict.fromkeys(self.asked, "cancelled")
        return {"items": unfinished}

    def post(self, path, content):
        name = path.split("/")[2]
        assert name not in self.asked
        self.asked.append(name)
        if name == "ended":
            raise RunError("the service refused: the job has ended")


def test_all_unfinished_jobs_are_cancelled_once_and_waited_for():
    service = Jobs(identify="running", diagnose="queued", ended="running", done="done")
    cancel_jobs(service)
    assert service.asked == ["identify", "diagnose", "ended"]
    assert set(service.states.values()) == {"cancelled", "done"}


def test_the_job_of_the_wanted_kind_is_awaited_and_its_failure_is_told():
    service = Jobs(identify="done", diagnose="failed")
    assert await_job(service, "run1", "identify")["id"] == "identify"
    with pytest.raises(RunError, match="the job diagnose of run1 failed: lost"):
        await_job(service, "run1", "diagnose")
