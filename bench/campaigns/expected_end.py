"""Expected end of a campaign, from planned durations and from those that its earlier steps really took."""

from collections import defaultdict
from collections.abc import Mapping
from statistics import fmean

from bench.campaigns.document import get_step_kind
from bench.campaigns.engine import CampaignState, Item

Durations = Mapping[str, float]
"""Mean duration [s] of the steps of one content."""


def estimate_remaining(state: CampaignState) -> float:
    """Return the expected time [s] until the end of a campaign, without the time of persons.

    A step takes as long as the ended steps with the same condition or method took on average. Before there are
    any, its planned duration counts, in which a rest until a temperature takes no time.
    """
    known = _measure_durations(state)
    remaining = 0.0
    if state.status != "stopping":
        remaining = sum(_expect_duration(item, known) for item in state.pending)
    if state.active is not None:
        item = state.get_item(state.active.item)
        begun = state.active.since if item.started is None else item.started
        remaining += max(0.0, _expect_duration(item, known) - (state.updated - begun))
    return remaining


def _measure_durations(state: CampaignState) -> Durations:
    found = defaultdict[str, list[float]](list)
    for item in state.items:
        if item.state == "done" and item.started is not None and item.ended is not None:
            found[_describe_content(item)].append(item.ended - item.started)
    return {content: fmean(durations) for content, durations in found.items()}


def _expect_duration(item: Item, known: Durations) -> float:
    if get_step_kind(item.step) == "prompt":
        return 0.0
    return known.get(_describe_content(item), item.expected_s)


def _describe_content(item: Item) -> str:
    """Return what determines the duration of a step: its content without the specimen, and the planned duration.

    The content is not enough: a warm-up has the strokes of the next run.
    """
    content = item.step.model_dump(mode="json")
    for part in content.values():
        if isinstance(part, dict):
            part.pop("specimen", None)
    return f"{item.expected_s} {content}"
