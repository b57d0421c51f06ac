"""Run of a step: specimen, method and names of the next execution."""

from bench.campaigns.document import (
    CampaignError,
    Methods,
    NextStrokeStep,
    RunSpec,
    WarmUpStep,
    add_strokes,
    find_next_run,
    find_run,
    make_run_method,
    make_warm_up,
)
from bench.campaigns.engine.state import CampaignState, Execution, Item
from bench.methods import Method


def find_spec(state: CampaignState, item: Item) -> RunSpec:
    """Return the run that an item stands for: its own, the following one of a warm-up, or the preceding one.

    Raises:
        CampaignError: there is none.
    """
    own = find_run(item.step)
    if own is not None:
        return own
    index = state.items.index(item)
    before = [one.step for one in reversed(state.items[:index])]
    after = [one.step for one in state.items[index + 1 :]]
    nearest = [*after, *before] if isinstance(item.step, WarmUpStep) else before
    found = find_next_run(nearest)
    if found is None:
        raise CampaignError(f"step {item.id}, {item.label}, has no run that it belongs to; delete it")
    return found


def make_method(state: CampaignState, item: Item, methods: Methods) -> Method:
    """Return the whole method of an item's next run, also if that run continues after a checkpoint.

    Raises:
        CampaignError: the item has no run that it belongs to, or its method cannot be changed as needed.
    """
    method = make_run_method(methods, find_spec(state, item))
    if isinstance(item.step, WarmUpStep):
        return make_warm_up(method, item.step.warm_up.cycles)
    return add_strokes(method, item.strokes) if isinstance(item.step, NextStrokeStep) else method


def find_base_run(state: CampaignState, item: Item) -> str:
    """Return the id of the latest complete run that a `next_stroke` item builds on; empty without one.

    It is a run of the nearest preceding step with a method of its own, or of a `next_stroke` since.
    """
    if item.runs:
        return item.runs[-1]
    before = state.items[: state.items.index(item)]
    # The runs of an earlier step may be those of another specimen.
    first = max((index for index, one in enumerate(before) if find_run(one.step) is not None), default=0)
    runs = [one.runs[-1] for one in before[first:] if one.runs and not isinstance(one.step, WarmUpStep)]
    return runs[-1] if runs else ""


def make_execution(campaign_id: str, item: Item) -> Execution:
    """Return the next run of an item, whose log has a name that no other one has."""
    log = f"{campaign_id}-{item.id}-{item.executions + 1}.mcap"
    return Execution(log=log, resume_after=item.resume_after, continues=item.continues)
