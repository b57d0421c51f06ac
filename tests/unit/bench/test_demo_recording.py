import pytest

from bench.demo.recording import record
from bench.errors import RunError


class Service:
    """Answers as the service does; each run ends at once, with the next outcome."""

    def __init__(self, *outcomes):
        self.outcomes, self.asked = list(outcomes), []

    def post(self, path, content):
        self.asked.append(path)
        if path != "/runs":
            return {}
        outcome = self.outcomes.pop(0)
        reason = "" if outcome == "clean" else "following error 10 mm exceeds the limit of 8 mm"
        return {
            "id": f"run{self.asked.count('/runs')}", "state": "ended", "outcome": outcome, "reason": reason,
            "duration_s": 1.0,
        }  # fmt: skip


def test_a_clean_run_is_taken():
    service = Service("clean")
    assert record(service, "quick", lambda share: None) == "run1"
    assert service.asked == ["/runs"]


def test_a_spoiled_run_is_made_once_more_after_a_reset_and_says_why():
    service, told = Service("incomplete", "clean"), []
    assert record(service, "quick", lambda share: None, told.append) == "run2"
    assert service.asked == ["/runs", "/agent/reset", "/runs"]
    assert told == [
        "the run of quick is incomplete: following error 10 mm exceeds the limit of 8 mm; once more (2 of 3)"
    ]


def test_the_third_spoiled_run_is_the_last():
    service = Service("incomplete", "lossy", "incomplete", "clean")
    with pytest.raises(RunError, match="quick is incomplete"):
        record(service, "quick", lambda share: None)
    assert service.asked.count("/runs") == 3
