"""State machine of a campaign: a pure function of state, observation and time.

`advance` makes at most one transition for each call. The executor of a campaign stores the new state before it
acts. A process that was killed at any moment thus finds where to continue.
"""

from bench.campaigns.document import BenchSetupStep, PromptStep, RestStep, WarmUpStep
from bench.campaigns.engine.changes import change, change_item, end_campaign, end_item, say
from bench.campaigns.engine.conditions import describe_unchecked, find_awaited_run, find_stop_reason
from bench.campaigns.engine.endings import fail, take_report
from bench.campaigns.engine.evaluation import evaluate, needs_evaluation
from bench.campaigns.engine.executions import make_execution
from bench.campaigns.engine.observation import ExecutionReport, Observation
from bench.campaigns.engine.setup_reports import take_setup_report
from bench.campaigns.engine.state import Active, CampaignState, Item

OBSTACLE_TIME = 300.0
"""[s] Time after which a person is told that the bench cannot start the next step."""


def advance(state: CampaignState, seen: Observation, now: float, campaign_id: str) -> CampaignState:
    """Return the state after one observation.

    Args:
        state: the present state.
        seen: observation of the bench.
        now: UTC [s].
        campaign_id: id of the campaign, for the names of logs.
    """
    state = _take_observation(_account(state, now), seen, now)
    if state.has_ended or state.is_held:
        return state
    if state.active is None:
        return _begin_next(state, seen, now, campaign_id)
    match state.active.phase:
        case "starting" | "stroking" | "preparing":
            return state if seen.report is None else _take_any_report(state, seen.report, now, campaign_id)
        case "evaluating":
            return evaluate(state, now, campaign_id)
        case "resting":
            return _rest(state, seen, now)
        case "asking":
            return state


def recover(state: CampaignState, seen: Observation, now: float, campaign_id: str) -> CampaignState:
    """Return the state after a process has taken over a campaign; the time since the last change was held."""
    gap = max(0.0, now - state.updated)
    times = state.times.model_copy(update={"held_s": state.times.held_s + gap})
    state = change(state, times=times, updated=max(now, state.updated))
    state = say(state, now, "note", f"the campaign continues after {gap:.0f} s without a process")
    if not state.is_executing or seen.report is None or state.has_ended:
        return state
    return _take_any_report(state, seen.report, now, campaign_id)


def _take_any_report(state: CampaignState, report: ExecutionReport, now: float, campaign_id: str) -> CampaignState:
    """Take a report on the run or the setup step in progress."""
    if state.is_stroking:
        return take_report(state, report, now, campaign_id)
    return take_setup_report(state, report, now)


def _account(state: CampaignState, now: float) -> CampaignState:
    """Add the time since the last change; that of strokes is added from the logs instead."""
    # A clock that steps back adds nothing, and a state never goes back in time.
    gap = max(0.0, now - state.updated)
    times = state.times
    if state.active is not None and state.active.phase == "resting":
        times = times.model_copy(update={"rest_s": times.rest_s + gap})
    elif not state.is_stroking and not state.has_ended:
        times = times.model_copy(update={"held_s": times.held_s + gap})
    return change(state, times=times, updated=max(now, state.updated))


def _take_observation(state: CampaignState, seen: Observation, now: float) -> CampaignState:
    is_waiting = state.active is None and not state.has_ended and not state.is_held
    values: dict[str, object] = {"waits_for": seen.obstacle if is_waiting else "", "awaited_run": ""}
    if seen.temperature_c is not None:
        values["temperature_c"] = seen.temperature_c
    known = {fact.run for fact in state.facts}
    if results := {run: result for run, result in seen.results.items() if run in known}:
        values["results"] = state.results | results
    return state.model_copy(update=values)


def _begin_next(state: CampaignState, seen: Observation, now: float, campaign_id: str) -> CampaignState:
    if state.status == "stopping":
        return end_campaign(state, now, "stopped", state.reason or "stopped on request")
    if state.status == "pausing":
        return say(change(state, status="paused"), now, "note", "the campaign is paused")
    if reason := find_stop_reason(state):
        return end_campaign(state, now, "stopped", reason)
    item = state.next_item
    needs_results = item is None or not isinstance(item.step, PromptStep | RestStep | BenchSetupStep)
    if needs_results and (awaited := find_awaited_run(state, now)):
        return change(state, awaited_run=awaited)
    if item is None:
        reasons = "all steps have ended", describe_unchecked(state)
        return end_campaign(state, now, "done", "; ".join(filter(None, reasons)))
    # A person or a rest needs no bench.
    if seen.obstacle and not isinstance(item.step, PromptStep | RestStep):
        return _wait_for_bench(state, seen.obstacle, now)
    return _begin(change(state, waits_since=None, is_wait_told=False), item, now, campaign_id)


def _wait_for_bench(state: CampaignState, obstacle: str, now: float) -> CampaignState:
    """Wait for the bench, and tell a person once if it takes long."""
    since = now if state.waits_since is None else state.waits_since
    is_due = not state.is_wait_told and now - since >= OBSTACLE_TIME
    if is_due:
        state = say(state, now, "person_needed", f"the next step cannot begin: {obstacle}")
    return change(state, waits_since=since, is_wait_told=state.is_wait_told or is_due)


def _begin(state: CampaignState, item: Item, now: float, campaign_id: str) -> CampaignState:
    """Begin an item; the stored state is the restore point before it."""
    started = item.started if item.started is not None else now
    state = change_item(state, item.id, state="active", started=started, reason="")
    state = say(state, now, "restore_point", f"step {item.id}, {item.label}: begins", item=item.id)
    active = Active(item=item.id, phase="starting", since=now, started=now)
    if isinstance(item.step, RestStep):
        seconds = item.step.rest.seconds
        deadline = now + (seconds if seconds is not None else item.step.rest.timeout_s)
        return change(state, active=active.model_copy(update={"phase": "resting", "deadline": deadline}))
    if isinstance(item.step, PromptStep):
        state = say(state, now, "person_needed", item.step.prompt.text, item=item.id)
        return change(state, active=active.model_copy(update={"phase": "asking"}))
    if needs_evaluation(state, item):
        return change(state, active=active.model_copy(update={"phase": "evaluating"}))
    if isinstance(item.step, BenchSetupStep):
        return change(state, active=active)
    if isinstance(item.step, WarmUpStep):
        active = active.model_copy(update={"deadline": now + item.step.warm_up.timeout_s})
    return change(state, active=active.model_copy(update={"execution": make_execution(campaign_id, item)}))


def _rest(state: CampaignState, seen: Observation, now: float) -> CampaignState:
    active = state.active
    step = state.get_item(active.item).step if active is not None else None
    if active is None or active.deadline is None or not isinstance(step, RestStep):
        return state
    target, temperature = step.rest.until_temperature_c, seen.temperature_c
    if target is None:
        return end_item(state, now, "done") if now >= active.deadline else state
    if temperature is not None and temperature <= target:
        return end_item(state, now, "done", f"{temperature:.2f} °C after {now - active.since:.0f} s")
    if now < active.deadline:
        return state
    shown = (
        "the thermometer shows nothing" if temperature is None else f"the thermometer shows {temperature:.2f} °C"
    )
    return fail(state, now, f"{target:g} °C was not reached within {step.rest.timeout_s:g} s; {shown}")
