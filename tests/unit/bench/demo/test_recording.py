import pytest

from bench.demo.recording import record
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
    assert service.posted == ["/runs", "/agent/reset", "/runs"]
    assert messages == [
        "the run of quick is incomplete: following error 10 mm exceeds the limit of 8 mm; attempt 2 of 3"
    ]


def test_the_third_unclean_run_is_the_last():
    service = Service("incomplete", "lossy", "incomplete", "clean")
    with pytest.raises(RunError, match="quick is incomplete"):
        record(service, "quick", lambda share: None)
    assert service.posted.count("/runs") == 3
