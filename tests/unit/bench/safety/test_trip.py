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

    def stop():
        stopped.set()
        return ""

    begin = time.monotonic()
    result = bring_to_rest(
        [
            instrument("hanging", lambda: release.wait(30)),
            instrument("quick", stop),
            instrument("dead", refuse),
            instrument("unconfirmed", lambda: "Broken pipe"),
            instrument("defect", lambda: 1 / 0),
        ],
        timeout=0.2,
    )
    assert time.monotonic() - begin < 10
    release.set()
    assert stopped.is_set()
    assert list(result.seconds) == ["quick"]
    assert "no answer within 0.2 s" in result.failures["hanging"]
    assert result.failures["dead"] == "no reply"
    assert "division by zero" in result.failures["defect"]
    assert result.failures["unconfirmed"] == "Broken pipe"
    assert "defect: rest not confirmed: ZeroDivisionError" in str(result)


def test_stop_times_are_measured_from_the_begin():
    ticks = iter([100.0, 100.25, 100.5])
    result = bring_to_rest([instrument("rod", lambda: "")], timeout=10.0, clock=lambda: next(ticks))
    assert result.seconds == {"rod": 0.25}
    assert str(result) == "rod: rest confirmed after 250 ms"


def test_instruments_share_one_deadline():
    """When it is over by the clock, an instrument that hangs is not waited for."""
    release, now = threading.Event(), [0.0]

    def clock():
        now[0] += 20.0
        return now[0]

    begin = time.monotonic()
    hanging = [instrument(name, lambda: release.wait(30)) for name in ("a", "b")]
    result = bring_to_rest(hanging, timeout=15.0, clock=clock)
    assert time.monotonic() - begin < 10
    release.set()
    assert set(result.failures) == {"a", "b"}
