"""Small changes of a state that several transitions share."""

from typing import Any

from bench.campaigns.document import Campaign, Methods, Step, describe_step, estimate_durations, expand_campaign
from bench.campaigns.engine.state import CampaignState, Item, Message, MessageKind


def start_campaign(campaign: Campaign, methods: Methods, now: float, operator: str = "") -> CampaignState:
    """Return the first state of a campaign.

    Args:
        campaign: the campaign.
        methods: its methods by name.
        now: UTC [s].
        operator: person who started it.
    """
    state = CampaignState(campaign=campaign, items=(), started=now, updated=now, operator=operator)
    steps = expand_campaign(campaign)
    state, items = make_items(state, steps, methods)
    state = state.model_copy(update={"items": items})
    return say(state, now, "note", f"campaign {campaign.name} started with {len(items)} steps", who=operator)


def make_items(
    state: CampaignState, steps: tuple[Step, ...], methods: Methods
) -> tuple[CampaignState, tuple[Item, ...]]:
    """Return new items with ids of their own, and the state that has counted them."""
    durations = estimate_durations(steps, methods)
    items = tuple(
        Item(id=f"s{number:04d}", step=step, label=describe_step(step, methods), expected_s=duration)
        for number, (step, duration) in enumerate(zip(steps, durations, strict=True), state.numbered + 1)
    )
    return state.model_copy(update={"numbered": state.numbered + len(items)}), items


def say(
    state: CampaignState, now: float, kind: MessageKind, text: str, who: str = "", item: str = ""
) -> CampaignState:
    """Add a message to a state."""
    message = Message(at=now, kind=kind, text=text, who=who, item=item)
    return state.model_copy(update={"outbox": (*state.outbox, message)})


def change_item(state: CampaignState, item_id: str, /, **values: Any) -> CampaignState:
    """Change an item."""
    items = tuple(item.model_copy(update=values) if item.id == item_id else item for item in state.items)
    return state.model_copy(update={"items": items})


def change(state: CampaignState, /, **values: Any) -> CampaignState:
    """Change fields of a state."""
    return state.model_copy(update=values)


def end_item(state: CampaignState, now: float, item_state: str, reason: str = "") -> CampaignState:
    """End the active item, with a restore point."""
    active = state.active
    if active is None:
        return state
    state = change_item(state, active.item, state=item_state, reason=reason, ended=now)
    item = state.get_item(active.item)
    text = f"step {item.id}, {item.label}: {item_state.replace('_', ' ')}{f'; {reason}' if reason else ''}"
    return say(change(state, active=None), now, "restore_point", text, item=item.id)


def end_campaign(state: CampaignState, now: float, status: str, reason: str) -> CampaignState:
    """End a campaign; an active step that does not stroke is left pending."""
    if state.active is not None:
        state = change_item(state, state.active.item, state="pending")
    done = sum(item.state == "done" for item in state.items)
    text = f"campaign {state.campaign.name} {status}: {reason}; {done} of {len(state.items)} steps are done"
    return say(change(state, status=status, reason=reason, active=None), now, "ended", text)
