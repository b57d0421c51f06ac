"""Messages that wait for a listener, with a clock under the control of the test."""

import asyncio

import numpy as np
import orjson
import pytest

from bench.live import MAX_SEQUENCE, Channel, Listener, ListenerSettings, LiveBatch, LiveBroadcaster
from bench.live.listener import MAX_BURST, MAX_QUEUED_BATCHES, MAX_QUEUED_EVENTS, MAX_UNACKNOWLEDGED

CHANNELS = (Channel("force", "N"),)


def make_batch(sequence, count=1, channels=CHANNELS):
    """Return a batch whose newest sample was taken at the second of its number."""
    values = np.full((len(channels), count), sequence, np.float32)
    return LiveBatch(sequence, sequence - (count - 1) * 1e-3, 1e-3, channels, values)


def make_listener(now=100.0, **wishes):
    return Listener(ListenerSettings(**wishes), lambda: now)


def take(listener):
    """Return what may be sent now: sequence numbers of batches, and texts by topic."""
    due = asyncio.run(asyncio.wait_for(listener.take(), 5))
    numbers = [int.from_bytes(one[4:8], "little") for one in due if isinstance(one, bytes)]
    texts = [orjson.loads(one) for one in due if isinstance(one, str)]
    return numbers, {text["topic"]: text["data"] for text in texts}


def test_channels_are_announced_with_the_age_of_the_data_before_the_first_batch_and_when_they_change():
    listener = make_listener(now=33.5)
    listener.put_batch(make_batch(30))
    assert take(listener) == ([30], {"channels": {"channels": [{"name": "force", "unit": "N"}], "age_s": 3.5}})
    listener.put_batch(make_batch(31))
    assert take(listener) == ([31], {})
    listener.put_batch(make_batch(32, channels=(*CHANNELS, Channel("velocity", "m/s"))))
    numbers, texts = take(listener)
    assert (numbers, len(texts["channels"]["channels"])) == ([32], 2)


def test_a_slow_listener_gets_a_limited_number_of_the_newest_messages():
    listener = make_listener()
    for k in range(1000):
        listener.put_batch(make_batch(k))
        listener.put("event", "", '{"topic": "event", "data": 0}')
        listener.put("status", "", f'{{"topic": "status", "data": {k}}}')
        listener.put("job", f"job {k % 2}", f'{{"topic": "job {k % 2}", "data": {k}}}')
    events = list(listener._events)
    numbers, texts = take(listener)
    assert numbers == list(range(1000 - MAX_QUEUED_BATCHES, 1000))
    assert len(events) == MAX_QUEUED_EVENTS
    assert (texts["status"], texts["job 0"], texts["job 1"]) == (999, 998, 999)


def test_a_slow_listener_gets_decimated_batches():
    listener = make_listener()
    for k in range(MAX_QUEUED_BATCHES):
        listener.put_batch(make_batch(k, count=40))
    due = asyncio.run(listener.take())
    assert {int.from_bytes(one[16:20], "little") for one in due if isinstance(one, bytes)} == {10}


async def put_at_once(listener, numbers):
    """Return what a waiting listener gets after batches came in one turn of the event loop."""
    waiting = asyncio.ensure_future(listener.take())
    await asyncio.sleep(0)
    for k in numbers:
        listener.put_batch(make_batch(k, count=40))
    return [one for one in await waiting if isinstance(one, bytes)]


def test_a_listener_that_waits_gets_all_samples_of_batches_that_come_at_once():
    numbers = range(3 * MAX_QUEUED_BATCHES)
    due = asyncio.run(put_at_once(make_listener(), numbers))
    assert [int.from_bytes(one[4:8], "little") for one in due] == list(numbers)
    assert {int.from_bytes(one[16:20], "little") for one in due} == {40}


def test_batches_that_wait_after_the_service_was_held_up_are_limited():
    due = asyncio.run(put_at_once(make_listener(), range(2 * MAX_BURST)))
    assert len(due) == MAX_BURST


def test_a_stalled_listener_is_not_ready_while_it_waits():
    listener = make_listener(acknowledges=True)
    for k in range(MAX_UNACKNOWLEDGED + 1):
        listener.put_batch(make_batch(k))
        take(listener)

    async def resume():
        waiting = asyncio.ensure_future(listener.take())
        await asyncio.sleep(0)
        for k in range(100, 200):
            listener.put_batch(make_batch(k))
        listener.acknowledge(MAX_UNACKNOWLEDGED)
        return [one for one in await waiting if isinstance(one, bytes)]

    assert len(asyncio.run(resume())) == MAX_QUEUED_BATCHES


def test_a_stalled_listener_gets_nothing_more_and_after_it_resumes_the_newest():
    listener = make_listener(now=202.0, acknowledges=True)
    for k in range(MAX_UNACKNOWLEDGED + 1):
        listener.put_batch(make_batch(k))
        assert take(listener)[0] == [k]
    for k in range(MAX_UNACKNOWLEDGED + 1, 201):
        listener.put_batch(make_batch(k))
    listener.put("status", "", '{"topic": "status", "data": 1}')
    assert take(listener) == ([], {"status": 1})
    listener.acknowledge(MAX_UNACKNOWLEDGED)
    numbers, texts = take(listener)
    assert numbers == list(range(201 - MAX_QUEUED_BATCHES, 201))
    lost = 201 - MAX_QUEUED_BATCHES - MAX_UNACKNOWLEDGED - 1
    assert texts == {"lost": {"batches": lost, "age_s": 202.0 - (201 - MAX_QUEUED_BATCHES)}}


def test_an_acknowledgement_of_an_unknown_batch_changes_nothing():
    listener = make_listener(acknowledges=True)
    listener.put_batch(make_batch(5))
    take(listener)
    listener.acknowledge(77)
    assert list(listener._unacknowledged) == [5]


def test_a_listener_that_acknowledges_nothing_on_principle_is_not_held_back():
    listener = make_listener()
    for k in range(3 * MAX_UNACKNOWLEDGED):
        listener.put_batch(make_batch(k))
        assert take(listener)[0] == [k]


@pytest.mark.parametrize(("rate", "period"), [(1000.0, 1e-3), (500.0, 2e-3), (100.0, 10e-3), (1e-3, 20e-3)])
def test_samples_are_decimated_to_the_wished_rate(rate, period):
    listener = make_listener(rate_hz=rate)
    listener.put_batch(make_batch(1, count=40))
    (data,) = (one for one in asyncio.run(listener.take()) if isinstance(one, bytes))
    assert np.frombuffer(data, "<f4", 1, offset=20)[0] == pytest.approx(period)


def test_a_restarted_agent_and_a_full_turn_of_the_numbers_are_no_losses():
    listener = make_listener()
    for sequence in (50, 0, 1):
        listener.put_batch(make_batch(sequence))
        assert "lost" not in take(listener)[1]
    listener._last_sequence = MAX_SEQUENCE
    listener.put_batch(make_batch(0))
    assert "lost" not in take(listener)[1]


def test_a_late_listener_begins_with_the_latest_status_and_batch():
    broadcaster = LiveBroadcaster()
    broadcaster.publish("status", '{"topic": "status", "data": "idle"}')
    broadcaster.publish_batch(make_batch(8))
    with broadcaster.listen() as listener:
        numbers, texts = take(listener)
    assert (numbers, texts["status"], set(texts)) == ([8], "idle", {"clock", "status", "channels"})
    broadcaster.publish_batch(make_batch(9))
    assert not listener._batches
