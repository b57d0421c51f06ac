"""Simultaneous stop of several instruments."""

import threading
import time
from types import SimpleNamespace

from bench.safety.trip import bring_to_rest
from drivers.errors import NoReplyError


def instrument(name, make_safe):
    return SimpleNamespace(name=name, make_safe=make_safe)


def test_no_instrument_waits_for_another_and_every_failure_is_named():
    release, stopped = threading.Event(), threading.Event()

    def refuse():
        raise NoReplyError("no reply")

    begin = time.monotonic()
    result = bring_to_rest(
        [
            instrument("hanging", lambda: release.wait(30)),
            instrument("quick", stopped.set),
            instrument("dead", refuse),
            instrument("defect", lambda: 1 / 0),
        ],
        timeout=0.2,
    )
    assert time.monotonic() - begin < 10
    release.set()
    assert stopped.is_set()
    assert list(result.seconds) == ["quick"]
    assert "not at rest after 0.2 s" in result.failures["hanging"]
    assert result.failures["dead"] == "no reply"
    assert "division by zero" in result.failures["defect"]
    assert "defect: ZeroDivisionError" in str(result)
