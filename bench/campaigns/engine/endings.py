"""Endings of runs: complete, incomplete, refused or crashed, and the policy after a failure."""

from bench.campaigns.document import StopOnTrip, WarmUpStep
from bench.campaigns.engine.changes import change, change_item, end_campaign, end_item, say
from bench.campaigns.engine.executions import find_spec, make_execution
from bench.campaigns.engine.observation import ExecutionReport
from bench.campaigns.engine.state import Active, CampaignState, RunFact

COMPLETE_OUTCOMES = ("clean", "lossy")
"""Outcomes of a run whose method was played to its end."""
MAX_CRASHES = 2
"""Number of crashes after which a step is held back."""


def take_report(state: CampaignState, report: ExecutionReport, now: float, campaign_id: str) -> CampaignState:
    """Return the state after a report on the active execution."""
    active = state.active
    if active is None:
        return state
    match report.kind:
        case "running":
            return change(state, active=active.model_copy(update={"phase": "stroking"}))
        case "absent":
            # The request was never sent; the same execution is requested again.
            return change(state, active=active.model_copy(update={"phase": "starting"}))
        case "refused":
            return fail(state, now, report.reason)
        case "crashed":
            return _take_crash(_count_execution(state, report), report, now)
        case "ended":
            state = _count_execution(state, report)
            if report.outcome in COMPLETE_OUTCOMES:
                return _take_complete(state, report, now, campaign_id)
            return _take_incomplete(state, report, now)


def _count_execution(state: CampaignState, report: ExecutionReport) -> CampaignState:
    active = state.active
    if active is None:
        return state
    item = state.get_item(active.item)
    times = state.times.model_copy(update={"stroking_s": state.times.stroking_s + report.duration_s})
    return change(change_item(state, item.id, executions=item.executions + 1), times=times)


def _take_complete(state: CampaignState, report: ExecutionReport, now: float, campaign_id: str) -> CampaignState:
    active = state.active
    if active is None:
        return state
    item = state.get_item(active.item)
    if isinstance(item.step, WarmUpStep):
        state = change_item(state, item.id, runs=(*item.runs, report.run), resume_after="", continues="")
        return _continue_warm_up(state, now, campaign_id)
    spec = find_spec(state, item)
    method = spec.method if isinstance(spec.method, str) else str(spec.method.get("name", ""))
    fact = RunFact(
        run=report.run,
        item=item.id,
        specimen=spec.specimen,
        method=method,
        drive=spec.drive,
        ended=now,
        duration_s=report.duration_s,
        outcome=report.outcome,
        temperature_c=state.temperature_c,
    )
    state = change_item(state, item.id, runs=(*item.runs, report.run), resume_after="", continues="")
    state = change(state, facts=(*state.facts, fact))
    evaluating = Active(item=item.id, phase="evaluating", since=now, started=active.started)
    return change(state, active=evaluating)


def _continue_warm_up(state: CampaignState, now: float, campaign_id: str) -> CampaignState:
    """End a warm-up that has reached its goal, or begin its next block."""
    active = state.active
    if active is None:
        return state
    item = state.get_item(active.item)
    target = item.step.warm_up.until_temperature_c if isinstance(item.step, WarmUpStep) else None
    temperature = state.temperature_c
    if target is None:
        return end_item(state, now, "done")
    if temperature is not None and temperature >= target:
        return end_item(state, now, "done", f"{temperature:.2f} °C after {now - active.started:.0f} s")
    if state.status in ("pausing", "stopping"):
        return put_back(state)
    if active.deadline is not None and now >= active.deadline:
        shown = "nothing" if temperature is None else f"{temperature:.2f} °C"
        limit = active.deadline - active.started
        return fail(
            state, now, f"{target:g} °C was not reached within {limit:.0f} s; the thermometer shows {shown}"
        )
    execution = make_execution(campaign_id, item)
    return change(
        state, active=active.model_copy(update={"phase": "starting", "since": now, "execution": execution})
    )


def _take_incomplete(state: CampaignState, report: ExecutionReport, now: float) -> CampaignState:
    """Take a run that ended early: paused by a command, stopped by a person, or tripped."""
    state = _keep_part(state, report)
    if state.status in ("pausing", "stopping"):
        return put_back(state)
    if report.ending in ("stopped", "aborted"):
        reason = f"run {report.run} was {report.ending} by a person: {report.reason}"
        return hold_for_person(state, now, reason)
    reason = report.reason or "the run ended early"
    if report.ending == "tripped" and any(isinstance(one, StopOnTrip) for one in state.campaign.stop_on):
        return end_campaign(state, now, "stopped", f"run {report.run} has tripped: {reason}")
    return fail(state, now, reason)


def _take_crash(state: CampaignState, report: ExecutionReport, now: float) -> CampaignState:
    active = state.active
    if active is None:
        return state
    state = _keep_part(state, report)
    reason = report.reason or "the bench ended in the middle of the run"
    state, is_held_back = count_crash(state, reason, now)
    if is_held_back:
        return state
    place = f"continues after {report.checkpoint}" if report.checkpoint else "is repeated"
    return say(put_back(state), now, "note", f"step {active.item} {place}: {reason}", item=active.item)


def count_crash(state: CampaignState, reason: str, now: float) -> tuple[CampaignState, bool]:
    """Count a crash of the bench in the active step; return the state, and whether the step was held back."""
    if state.active is None:
        return state, False
    item = state.get_item(state.active.item)
    state = change_item(state, item.id, crashes=item.crashes + 1)
    if item.crashes + 1 < MAX_CRASHES:
        return state, False
    text = f"held back after {MAX_CRASHES} crashes of the bench: {reason}"
    state = end_item(state, now, "held_back", text)
    return say(state, now, "held_back", f"step {item.id}, {item.label}: {text}", item=item.id), True


def _keep_part(state: CampaignState, report: ExecutionReport) -> CampaignState:
    """Keep an incomplete run, and the place at which the next one continues.

    A run without samples belongs to the step, but the next one continues the run before it.
    """
    active = state.active
    if active is None or not report.run:
        return state
    item = state.get_item(active.item)
    parts = (*item.parts, report.run)
    after = report.checkpoint or item.resume_after
    continues = report.run if report.has_samples else item.continues
    return change_item(state, item.id, parts=parts, resume_after=after, continues=continues)


def hold_for_person(state: CampaignState, now: float, reason: str) -> CampaignState:
    """Pause because a person has ended the active step, which begins again after the pause."""
    active = state.active
    state = say(put_back(state), now, "person_needed", f"{reason}; resume or stop the campaign")
    if active is not None:
        # A person who stops the step must not see it begin again at once.
        state = change_item(state, active.item, is_during_pause=False)
    return change(state, status="paused", reason=reason)


def put_back(state: CampaignState) -> CampaignState:
    """Make the active item pending again."""
    if state.active is None:
        return state
    return change(change_item(state, state.active.item, state="pending"), active=None)


def fail(state: CampaignState, now: float, reason: str, *, is_repeatable: bool = True) -> CampaignState:
    """Apply the policy of the campaign to a failure of the active step.

    Args:
        state: the present state.
        now: UTC [s].
        reason: reason of the failure, for a person.
        is_repeatable: whether it may be repeated without a person; else one is asked instead.
    """
    active = state.active
    if active is None:
        return state
    item = state.get_item(active.item)
    failures = item.failures + 1
    state = change_item(state, item.id, failures=failures, reason=reason)
    state = say(state, now, "failed", f"step {item.id}, {item.label}: {reason}", item=item.id)
    policy = state.campaign.on_failure
    if policy == "retry" and not is_repeatable:
        policy = "ask"
    if policy == "retry" and failures <= state.campaign.retries:
        return put_back(state)
    if policy == "skip":
        return end_item(state, now, "failed", reason)
    if policy == "ask":
        text = f"step {item.id}, {item.label}, has failed: {reason}; answer retry, skip or stop"
        asking = Active(item=item.id, phase="asking", since=now, is_question=True, started=active.started)
        return say(change(state, active=asking), now, "person_needed", text, item=item.id)
    state = end_item(state, now, "failed", reason)
    return end_campaign(state, now, "stopped", f"step {item.id} has failed: {reason}")
