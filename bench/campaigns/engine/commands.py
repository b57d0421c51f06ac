"""Commands of persons and programs on a campaign, as pure functions of its state.

Each is recorded with who gave it and when. A command that is not possible in the present state is refused.
"""

from typing import Literal, TypeAlias, cast, get_args

from bench.campaigns.document import CampaignError
from bench.campaigns.engine.changes import change, change_item, end_campaign, end_item, say
from bench.campaigns.engine.state import CampaignState

Choice: TypeAlias = Literal["retry", "skip", "stop"]
ANSWER_LENGTH = 2000
"""Largest number of characters of a note."""


def pause(state: CampaignState, now: float, who: str = "") -> CampaignState:
    """Pause at the next checkpoint of the run in progress, after a setup step, or at once between runs.

    Raises:
        CampaignError: the campaign has ended or is paused.
    """
    _check_running(state, "paused")
    state = say(state, now, "edit", "pause at the next checkpoint", who)
    items = tuple(item.model_copy(update={"is_during_pause": False}) for item in state.items)
    status = "pausing" if state.is_executing else "paused"
    return change(state, items=items, status=status, reason="paused on request")


def resume(state: CampaignState, now: float, who: str = "") -> CampaignState:
    """Continue a paused campaign; a pause that has not taken effect is withdrawn.

    Raises:
        CampaignError: the campaign is not paused.
    """
    if state.status not in ("paused", "pausing"):
        raise CampaignError(f"campaign {state.campaign.name} is {state.status}; only a paused one is resumed")
    return say(change(state, status="running", reason=""), now, "edit", "resumed", who)


def stop(state: CampaignState, now: float, who: str = "", reason: str = "") -> CampaignState:
    """Stop after the run or setup step in progress, or at once between runs.

    Raises:
        CampaignError: the campaign has ended.
    """
    _check_not_ended(state, "stopped")
    text = reason or "stopped on request"
    state = say(state, now, "edit", f"stop: {text}", who)
    if state.is_executing:
        return change(state, status="stopping", reason=text)
    return end_campaign(state, now, "stopped", text)


def answer(
    state: CampaignState, now: float, who: str = "", note: str = "", photo: str = "", choice: Choice | None = None
) -> CampaignState:
    """Answer a prompt, or decide on a failure.

    Raises:
        CampaignError: nothing is asked, or the answer lacks what is asked for.
    """
    active = state.active
    if active is None or not state.needs_person:
        raise CampaignError(f"campaign {state.campaign.name} asks for nothing at present")
    if len(note) > ANSWER_LENGTH:
        raise CampaignError(f"the note has {len(note)} characters, at most {ANSWER_LENGTH} are kept; shorten it")
    if active.is_question:
        return _decide(state, now, who, choice, note)
    _check_answer(state, note, photo)
    item = state.get_item(active.item)
    state = change_item(state, item.id, note=note, photo=photo)
    given = "; ".join(filter(None, (note, f"photo {photo}" if photo else "")))
    state = say(state, now, "edit", f"answered: {item.label}{f' ({given})' if given else ''}", who, item.id)
    return end_item(state, now, "done", note)


def _check_answer(state: CampaignState, note: str, photo: str) -> None:
    item = state.get_item(state.active.item) if state.active is not None else None
    prompt = getattr(getattr(item, "step", None), "prompt", None)
    if prompt is not None and prompt.note and not note.strip():
        raise CampaignError("this prompt needs a note; nothing was answered")
    if prompt is not None and prompt.photo and not photo:
        raise CampaignError("this prompt needs a photo; nothing was answered")


def _decide(state: CampaignState, now: float, who: str, choice: Choice | None, note: str) -> CampaignState:
    active = state.active
    if choice is None or active is None:
        raise CampaignError("a step has failed; answer with the choice retry, skip or stop")
    item = state.get_item(active.item)
    state = say(state, now, "edit", f"answered: {choice}{f' ({note})' if note else ''}", who, item.id)
    if choice == "retry":
        return change(change_item(state, item.id, state="pending", note=note), active=None)
    state = end_item(state, now, "failed", item.reason)
    if choice == "skip":
        return state
    return end_campaign(state, now, "stopped", f"step {item.id} has failed: {item.reason}")


def parse_choice(text: str | None) -> Choice | None:
    """Return a choice; None for none.

    Raises:
        CampaignError: the text is none of the choices.
    """
    if text is None:
        return None
    for choice in get_args(Choice):
        if text == choice:
            return cast(Choice, choice)
    raise CampaignError(f"{text[:40]} is none of the choices retry, skip and stop")


def _check_running(state: CampaignState, verb: str) -> None:
    _check_not_ended(state, verb)
    if state.status != "running":
        raise CampaignError(f"campaign {state.campaign.name} is {state.status} already; it cannot be {verb}")


def _check_not_ended(state: CampaignState, verb: str) -> None:
    if state.has_ended:
        raise CampaignError(f"campaign {state.campaign.name} is {state.status}; it cannot be {verb}")
