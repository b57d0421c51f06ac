"""Evaluation of complete runs: goals of repetitions, and proposed strokes."""

from bench.campaigns.document import IntervalGoal, NextStrokeStep, RepeatStep
from bench.campaigns.engine.changes import change, change_item, end_item, say
from bench.campaigns.engine.conditions import RESULT_TIMEOUT, describe_interval
from bench.campaigns.engine.endings import fail
from bench.campaigns.engine.executions import find_base_run, make_execution
from bench.campaigns.engine.state import Active, CampaignState, Item, RunResult


def needs_evaluation(state: CampaignState, item: Item) -> bool:
    """Return whether an item begins with the results of an earlier run instead of a run."""
    is_repeated = isinstance(item.step, RepeatStep) and bool(item.runs)
    return (is_repeated or isinstance(item.step, NextStrokeStep)) and not item.resume_after


def find_evaluated_run(state: CampaignState) -> str:
    """Return the id of the run whose results are awaited; empty if none are."""
    if state.active is None or state.active.phase != "evaluating":
        return ""
    item = state.get_item(state.active.item)
    if isinstance(item.step, NextStrokeStep):
        return find_base_run(state, item)
    return item.runs[-1] if isinstance(item.step, RepeatStep) and item.runs else ""


def is_awaiting_diagnosis(state: CampaignState) -> bool:
    """Return whether the awaited results are those of a diagnosis."""
    if state.active is None:
        return False
    step = state.get_item(state.active.item).step
    return not (isinstance(step, RepeatStep) and isinstance(step.repeat.until, IntervalGoal))


def evaluate(state: CampaignState, now: float, campaign_id: str) -> CampaignState:
    """Return the state after the results of the latest run, if they have arrived."""
    active = state.active
    if active is None:
        return state
    item = state.get_item(active.item)
    if not isinstance(item.step, RepeatStep | NextStrokeStep):
        return end_item(state, now, "done")
    run = find_evaluated_run(state)
    if not run:
        return fail(state, now, "no complete run precedes it")
    result = state.results.get(run)
    if result is None or (is_awaiting_diagnosis(state) and not result.is_diagnosed and not result.failure):
        return _check_timeout(state, run, active.since, now)
    if result.failure:
        return fail(state, now, f"run {run} has no result: {result.failure}")
    return _decide(state, item, result, now, campaign_id)


def _check_timeout(state: CampaignState, run: str, since: float, now: float) -> CampaignState:
    if now - since < RESULT_TIMEOUT:
        return state
    return fail(state, now, f"the results of run {run} did not arrive within {RESULT_TIMEOUT / 3600:g} h")


def _decide(state: CampaignState, item: Item, result: RunResult, now: float, campaign_id: str) -> CampaignState:
    if isinstance(item.step, NextStrokeStep):
        return _decide_next_stroke(state, item, item.step, result, now, campaign_id)
    if not isinstance(item.step, RepeatStep):
        return state
    goal, at_most = item.step.repeat.until, item.step.repeat.at_most
    if isinstance(goal, IntervalGoal):
        known = [state.results[run] for run in item.runs if run in state.results]
        is_reached, text = describe_interval(known, goal)
    else:
        is_reached = result.next_stroke is None
        text = "the diagnosis is settled" if is_reached else "the diagnosis proposes a further stroke"
    text = f"{text} after {len(item.runs)} runs"
    if is_reached or len(item.runs) >= at_most:
        return end_item(state, now, "done", text if is_reached else f"{text}, which is the limit")
    return _run_again(say(state, now, "note", text, item=item.id), item, now, campaign_id)


def _decide_next_stroke(
    state: CampaignState, item: Item, step: NextStrokeStep, result: RunResult, now: float, campaign_id: str
) -> CampaignState:
    if result.next_stroke is None:
        return end_item(state, now, "done", f"the diagnosis is settled after {len(item.runs)} proposed strokes")
    if len(item.runs) >= step.next_stroke.at_most:
        return end_item(state, now, "done", f"not settled after {len(item.runs)} strokes, which is the limit")
    # Each complete run has played one stroke more; a stroke whose run failed is proposed again.
    strokes = (*item.strokes[: len(item.runs)], result.next_stroke)
    state = change_item(state, item.id, strokes=strokes)
    state = say(state, now, "note", f"proposed stroke {len(strokes)} is added", item=item.id)
    return _run_again(state, state.get_item(item.id), now, campaign_id)


def _run_again(state: CampaignState, item: Item, now: float, campaign_id: str) -> CampaignState:
    """Request the next run, unless the campaign is to pause or to stop first."""
    if state.status in ("pausing", "stopping"):
        return change(change_item(state, item.id, state="pending"), active=None)
    started = state.active.started if state.active is not None else now
    execution = make_execution(campaign_id, item)
    active = Active(item=item.id, phase="starting", since=now, execution=execution, started=started)
    return change(state, active=active)
