"""Reports on setup steps of the bench: done, failed, stopped by a person, or interrupted by a crash.

Only an interrupted `tare` or `clear-tare` begins again by itself. A move could go to another place, because
positions count from another zero after a restart of the agent. Homing, and what a person has done at the bench,
is not repeated without a person either.
"""

from bench.campaigns.document import BenchSetupStep, StopOnTrip
from bench.campaigns.engine.changes import change, end_campaign, end_item, say
from bench.campaigns.engine.endings import (
    count_crash,
    fail,
    hold_for_person,
    put_back,
)
from bench.campaigns.engine.observation import ExecutionReport
from bench.campaigns.engine.state import CampaignState
from bench.setup_steps import SetupStep

REPEATED_STEPS: tuple[SetupStep, ...] = ("tare", "clear-tare")
"""Setup steps that begin again by themselves after an interruption, because repeating them changes nothing."""


def take_setup_report(state: CampaignState, report: ExecutionReport, now: float) -> CampaignState:
    """Return the state after a report on the setup step in progress."""
    active = state.active
    if active is None:
        return state
    match report.kind:
        case "running":
            return change(state, active=active.model_copy(update={"phase": "preparing"}))
        case "absent":
            return change(state, active=active.model_copy(update={"phase": "starting"}))
        case "ended":
            return end_item(state, now, "done", report.reason)
        case "refused":
            return _take_failure(state, report, now)
        case "crashed":
            return _take_interruption(state, report.reason, now)


def _take_failure(state: CampaignState, report: ExecutionReport, now: float) -> CampaignState:
    """Take a setup step that has failed; one that a person has ended pauses the campaign."""
    if report.ending in ("stopped", "aborted"):
        if state.status in ("pausing", "stopping"):
            return put_back(state)
        reason = f"{_describe(state)} was {report.ending} by a person: {report.reason}"
        return hold_for_person(state, now, reason)
    if report.ending == "tripped" and any(isinstance(one, StopOnTrip) for one in state.campaign.stop_on):
        return end_campaign(state, now, "stopped", f"{_describe(state)} has tripped: {report.reason}")
    return fail(state, now, report.reason)


def _take_interruption(state: CampaignState, reason: str, now: float) -> CampaignState:
    active = state.active
    step = None if active is None else state.get_item(active.item).step
    if active is None or not isinstance(step, BenchSetupStep):
        return state
    if step.setup.step not in REPEATED_STEPS:
        return fail(state, now, f"{reason}; check the bench before it is repeated", is_repeatable=False)
    state, is_held_back = count_crash(state, reason, now)
    if is_held_back:
        return state
    return say(put_back(state), now, "note", f"step {active.item} is repeated: {reason}", item=active.item)


def _describe(state: CampaignState) -> str:
    return "" if state.active is None else state.get_item(state.active.item).label
