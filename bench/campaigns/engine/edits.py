"""Edits of the queue while a campaign runs: add, move, delete, release, and one thing now."""

from typing import Annotated, Any, Literal

from pydantic import Field, NonNegativeInt, TypeAdapter, ValidationError

from bench.campaigns.document import (
    AnyStep,
    CampaignError,
    Methods,
    PromptSpec,
    PromptStep,
    find_run,
    get_method_name,
)
from bench.campaigns.engine.changes import change, change_item, make_items, say
from bench.campaigns.engine.executions import find_spec
from bench.campaigns.engine.state import CampaignState, Item
from bench.validation import FrozenModel, describe_validation_error


class AddEdit(FrozenModel):
    """Addition of steps."""

    edit: Literal["add"]
    steps: tuple[AnyStep, ...] = Field(min_length=1, max_length=1000, description="Steps to add, in order.")
    before: str | None = Field(default=None, description="Pending item before which they are put; null: the end.")


class MoveEdit(FrozenModel):
    """Move of a pending item."""

    edit: Literal["move"]
    item: str = Field(description="Id of the pending item.")
    position: NonNegativeInt = Field(description="New position among the pending items, from 0.")


class DeleteEdit(FrozenModel):
    """Deletion of a pending item; it stays on the record as skipped."""

    edit: Literal["delete"]
    item: str = Field(description="Id of the pending item.")


class PauseEdit(FrozenModel):
    """Insertion of a pause; the campaign waits there until a person answers."""

    edit: Literal["pause"]
    before: str | None = Field(default=None, description="Pending item before which it is put; null: the end.")
    text: str = Field(
        default="Pause: answer to continue", min_length=1, max_length=1000, description="Request to the person."
    )


class DoNowEdit(FrozenModel):
    """One step between two runs, also during a pause; a rest or prompt in progress begins again afterwards.

    It is refused during a run. A campaign that is paused stays so.
    """

    edit: Literal["do_now"]
    step: AnyStep = Field(description="Step to begin next.")


class ReleaseEdit(FrozenModel):
    """Another attempt of an item that was held back, has failed or was skipped."""

    edit: Literal["release"]
    item: str = Field(description="Id of the item.")


QueueEdit = Annotated[
    AddEdit | MoveEdit | DeleteEdit | PauseEdit | DoNowEdit | ReleaseEdit, Field(discriminator="edit")
]
"""One edit of the queue."""


def parse_edit(text: str, origin: str) -> QueueEdit:
    """Return the edit of a JSON text; ``origin`` names the text in messages.

    Raises:
        CampaignError: it is no edit; the message names the position.
    """
    try:
        edit: QueueEdit = TypeAdapter(QueueEdit).validate_json(text)
    except ValidationError as error:
        raise CampaignError(f"{origin} is not an edit: {describe_validation_error(error)}") from None
    return edit


def apply_edit(
    state: CampaignState, edit: QueueEdit, methods: Methods, now: float, who: str = ""
) -> CampaignState:
    """Return the state after an edit of its queue.

    Args:
        state: the present state.
        edit: the edit.
        methods: methods of the campaign by name, those of the edit included.
        now: UTC [s].
        who: person or program, for the record.

    Raises:
        CampaignError: the edit is not possible in the present state.
    """
    if state.has_ended:
        raise CampaignError(f"campaign {state.campaign.name} is {state.status}; its queue cannot be edited")
    match edit:
        case AddEdit():
            state, text = _add(state, edit.steps, edit.before, methods)
        case PauseEdit():
            step = PromptStep(prompt=PromptSpec(text=edit.text))
            state, text = _add(state, (step,), edit.before, methods)
        case MoveEdit():
            state, text = _move(state, edit)
        case DeleteEdit():
            item = _get_pending(state, edit.item)
            state = change_item(state, item.id, state="skipped", reason="deleted", ended=now)
            text = f"deleted {item.id}, {item.label}"
        case DoNowEdit():
            state, text = _do_now(state, edit, methods)
        case ReleaseEdit():
            state, text = _release(state, edit.item)
    _check_relations(state)
    return say(state, now, "edit", text, who)


def collect_edit_methods(edit: QueueEdit) -> tuple[Any, ...]:
    """Return the steps that an edit adds, whose methods the campaign may lack."""
    if isinstance(edit, AddEdit):
        return edit.steps
    return (edit.step,) if isinstance(edit, DoNowEdit) else ()


def _add(
    state: CampaignState, steps: tuple[AnyStep, ...], before: str | None, methods: Methods
) -> tuple[CampaignState, str]:
    index = len(state.items)
    if before is not None:
        index = state.items.index(_get_pending(state, before))
    state, added = _insert(state, steps, methods, index)
    labels = ", ".join(f"{item.id} {item.label}" for item in added)
    return state, f"added {labels}"


def _insert(
    state: CampaignState, steps: tuple[AnyStep, ...], methods: Methods, index: int
) -> tuple[CampaignState, tuple[Item, ...]]:
    for step in steps:
        run = find_run(step)
        if run is not None and get_method_name(run) not in methods:
            raise CampaignError(f"there is no method {get_method_name(run)}; give a stored one or its document")
    state, added = make_items(state, steps, methods)
    items = (*state.items[:index], *added, *state.items[index:])
    return change(state, items=items), added


def _move(state: CampaignState, edit: MoveEdit) -> tuple[CampaignState, str]:
    item = _get_pending(state, edit.item)
    others = [one for one in state.items if one is not item]
    pending = [one for one in others if one.state == "pending"]
    index = others.index(pending[edit.position]) if edit.position < len(pending) else len(others)
    items = (*others[:index], item, *others[index:])
    return change(state, items=items), f"moved {item.id}, {item.label}, to position {edit.position + 1}"


def _do_now(state: CampaignState, edit: DoNowEdit, methods: Methods) -> tuple[CampaignState, str]:
    state = _interrupt(state)
    pending = state.pending
    index = state.items.index(pending[0]) if pending else len(state.items)
    state, (added,) = _insert(state, (edit.step,), methods, index)
    state = change_item(state, added.id, is_during_pause=state.status == "paused")
    return state, f"now: {added.id} {added.label}{', during the pause' if state.status == 'paused' else ''}"


def _interrupt(state: CampaignState) -> CampaignState:
    """Put back a rest or a prompt in progress, which then begins again; refuse while anything else is."""
    active = state.active
    if active is None:
        return state
    item = state.get_item(active.item)
    if active.is_question:
        raise CampaignError(f"step {item.id}, {item.label}, has failed and waits for an answer; answer it first")
    if active.phase not in ("resting", "asking"):
        raise CampaignError(
            f"step {item.id}, {item.label}, is in progress; one thing now is possible between two runs: "
            "pause the campaign, or wait for the end of the run"
        )
    return change(change_item(state, item.id, state="pending"), active=None)


def _release(state: CampaignState, item_id: str) -> tuple[CampaignState, str]:
    item = _find(state, item_id)
    if item.state not in ("held_back", "failed", "skipped"):
        raise CampaignError(
            f"step {item.id} is {item.state}; only one that was held back, failed or skipped is released"
        )
    state = change_item(state, item.id, state="pending", crashes=0, failures=0, ended=None)
    return state, f"released {item.id}, {item.label}, after: {item.reason}"


def _check_relations(state: CampaignState) -> None:
    """Refuse an edit after which a pending step would have no run that it belongs to."""
    for item in state.pending:
        kind = next(iter(type(item.step).model_fields))
        if kind in ("warm_up", "next_stroke"):
            find_spec(state, item)


def _get_pending(state: CampaignState, item_id: str) -> Item:
    item = _find(state, item_id)
    if item.state != "pending":
        raise CampaignError(f"step {item.id} is {item.state}; only a pending one can be edited")
    return item


def _find(state: CampaignState, item_id: str) -> Item:
    for item in state.items:
        if item.id == item_id:
            return item
    raise CampaignError(f"there is no step {item_id[:40]} in campaign {state.campaign.name}")
