"""Lease of the bench: one client holds it for a time, and nobody else starts anything meanwhile."""

import pytest

from bench.agent.state_machine import Lease
from bench.agent_protocol import LeaseCommand, Sender

NIGHT, PERSON = Sender(actor="campaign:night"), Sender(actor="local:anna")


def make_command(duration_s, sender=NIGHT):
    return LeaseCommand(description="campaign night of Anna", duration_s=duration_s, sender=sender)


@pytest.fixture
def now():
    return [100.0]


@pytest.fixture
def lease(now):
    return Lease(lambda: now[0])


def test_only_the_holder_may_start_something(lease):
    assert (lease.describe(), lease.find_obstacle(PERSON)) == (None, "")
    assert lease.take(make_command(15)) == ""
    assert lease.find_obstacle(NIGHT) == ""
    for other in (PERSON, None):
        assert lease.find_obstacle(other).startswith("campaign night of Anna holds the bench; nothing was started")
    assert (lease.describe().holder, lease.describe().description) == ("campaign:night", "campaign night of Anna")


def test_a_lease_that_is_not_renewed_ends_by_itself(lease, now):
    lease.take(make_command(15))
    now[0] += 14.9
    assert lease.find_obstacle(PERSON)
    lease.take(make_command(15))
    now[0] += 14.9
    assert lease.find_obstacle(PERSON)
    now[0] += 0.2
    assert (lease.find_obstacle(PERSON), lease.describe()) == ("", None)


def test_a_lease_is_given_back_by_its_holder_only(lease):
    lease.take(make_command(15))
    assert "holds the bench" in lease.take(make_command(0, PERSON))
    assert lease.find_obstacle(PERSON)
    assert lease.take(make_command(0)) == ""
    assert lease.take(make_command(15, PERSON)) == ""
    assert lease.find_obstacle(NIGHT)
