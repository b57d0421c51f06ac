"""Live samples of the client, against the service itself."""

import numpy as np
import pytest

from bench.client import ClientError
from bench.client.live import iterate_live
from bench.client.session import Session
from bench.live import Channel, LiveBatch


def make_batch(sequence, count=40):
    channels = (Channel("force", "N"), Channel("displacement", "m"))
    values = np.arange(2 * count, dtype=np.float32).reshape(2, count)
    return LiveBatch(sequence, 1000.0 + sequence, 1e-3, channels, values)


def publish_until(service, samples, sequence):
    """Return the next live samples; the agent publishes before, because a client joins at some moment."""
    service.agent.publish(make_batch(sequence))
    return next(samples)


def test_live_samples_are_arrays_with_units(service, bench):
    samples = bench.live()
    found = publish_until(service, samples, 4)
    assert found.units == {"time": "s", "force": "N", "displacement": "m"}
    np.testing.assert_allclose(found["time"], np.arange(40) * 1e-3, rtol=1e-6)
    np.testing.assert_array_equal(found["displacement"], np.arange(40.0, 80.0))
    assert (found.sequence, found.utc_s) == (4, 1004.0)
    assert found.age_s > 1e8
    service.agent.publish(make_batch(5))
    assert next(samples).sequence == 5
    samples.close()


def test_live_samples_are_decimated_on_request(service, bench):
    samples = bench.live(rate_hz=100.0)
    assert len(publish_until(service, samples, 0)["force"]) == 4
    samples.close()


def test_a_wrong_token_is_named(service):
    with pytest.raises(ClientError, match="no valid token"):
        next(iterate_live(Session(service.url, "wrong")))


def test_a_missing_service_is_named():
    with pytest.raises(ClientError, match="does not reply to /live"):
        next(iterate_live(Session("http://127.0.0.1:9", "token")))
