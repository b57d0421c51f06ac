"""Expected end of a campaign."""

import pytest

from bench.campaigns.document import Campaign
from bench.campaigns.engine import Active, CampaignState, Item
from bench.campaigns.expected_end import estimate_remaining

REST = {"rest": {"until_temperature_c": 25.0}}
PROMPT = {"prompt": {"text": "Mount the next damper"}}


def run(specimen, method="quick"):
    return {"run": {"specimen": specimen, "method": method}}


def make_state(*items, active=None, updated=0.0, status="running"):
    """Return a state of items: (step, planned duration, state, begin, end)."""
    steps = [step for step, *_ in items]
    campaign = Campaign.model_validate({"schema": "mrbench.campaign/1", "name": "night", "steps": steps})
    queue = tuple(
        Item(id=f"s{n}", step=step, label="", expected_s=planned, state=state, started=begun, ended=ended)
        for n, (step, (_, planned, state, begun, ended)) in enumerate(zip(campaign.steps, items, strict=True))
    )
    return CampaignState(
        campaign=campaign, items=queue, started=0.0, updated=updated, operator="", active=active, status=status
    )


def test_before_any_step_has_ended_the_planned_durations_count():
    state = make_state((REST, 0.0, "pending", None, None), (run("A"), 60.0, "pending", None, None))
    assert estimate_remaining(state) == 60.0
    assert estimate_remaining(state.model_copy(update={"status": "stopping"})) == 0.0


def test_a_rest_until_a_temperature_takes_as_long_as_the_earlier_ones_on_average():
    state = make_state(
        (REST, 0.0, "done", 0.0, 100.0),
        (run("A"), 60.0, "done", 100.0, 170.0),
        (REST, 0.0, "done", 170.0, 370.0),
        (run("B"), 60.0, "failed", 370.0, 371.0),
        (REST, 0.0, "pending", None, None),
        (run("C"), 60.0, "pending", None, None),
        (run("C", "six_voltages"), 50.0, "pending", None, None),
    )
    # The failed run took one second and does not count; another method keeps its planned duration.
    assert estimate_remaining(state) == pytest.approx(150.0 + 70.0 + 50.0)


def test_the_time_that_the_active_step_has_taken_is_subtracted_and_persons_are_not_predicted():
    items = [
        (PROMPT, 0.0, "done", 0.0, 900.0),
        (REST, 0.0, "done", 900.0, 1000.0),
        (REST, 0.0, "active", 1000.0, None),
        (PROMPT, 0.0, "pending", None, None),
    ]
    active = Active(item="s2", phase="resting", since=1000.0)
    assert estimate_remaining(make_state(*items, active=active, updated=1030.0)) == pytest.approx(70.0)
    assert estimate_remaining(make_state(*items, active=active, updated=1500.0)) == 0.0
