"""Limits in the status of the agent, as they are in force."""

from bench.agent.status import make_limit_statuses
from bench.safety import Action, Interlocks


def test_the_limits_of_fixture_and_method_are_listed_as_they_are_in_force():
    interlocks = Interlocks({"force": {Action.TRIP: 5000.0}}, "coil_voltage")
    assert [(one.quantity, one.action, one.value) for one in make_limit_statuses(interlocks.limits)] == [
        ("force", "trip", 5000.0)
    ]
    with interlocks.use_limits({"force": {Action.CONTROLLED_STOP: 1500.0, Action.TRIP: 1875.0}}):
        assert [(one.action, one.value) for one in make_limit_statuses(interlocks.limits)] == [
            ("controlled_stop", 1500.0),
            ("trip", 1875.0),
        ]
