"""Campaigns as programs and persons see them: state, queue, cells of the matrix, trends, messages."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime

from pydantic import Field

from bench.campaigns.delivery import RECIPIENT, name_recipient
from bench.campaigns.document import find_run, get_method_name, get_step_kind
from bench.campaigns.engine import CampaignState, Item, RunFact, RunResult, Times, get_half_width, group_runs
from bench.campaigns.expected_end import estimate_remaining
from bench.campaigns.store import StoredCampaign
from bench.catalogue import CampaignEventRow, CampaignNotificationRow
from bench.validation import FrozenModel

MAX_TRENDS = 200
"""Largest number of trends of a view."""


class ItemView(FrozenModel):
    """Step of the queue."""

    id: str
    kind: str = Field(description="run, rest, warm_up, repeat, next_stroke, prompt or setup")
    label: str = Field(description="the step for a person")
    state: str = Field(description="pending, active, done, skipped, failed or held_back")
    specimen: str = Field(description="empty for a step without a run of its own")
    method: str = Field(description="empty for a step without a run of its own")
    drive: float | None = Field(description="constant drive in the unit of the drive; null for the method's own")
    drive_unit: str = Field(description="V or A; empty for a step without a run of its own")
    runs: tuple[str, ...] = Field(description="ids of the complete runs")
    parts: tuple[str, ...] = Field(description="ids of incomplete runs, each continued or repeated by a later one")
    crashes: int = Field(description="number of times that the bench ended in the middle of this step")
    reason: str = Field(description="reason of a failure, or the result of a condition")
    note: str = Field(description="answer of the operator")
    photo: str = Field(description="file of the operator's photo; empty without one")
    started: datetime | None = Field(description="UTC")
    ended: datetime | None = Field(description="UTC")


class Question(FrozenModel):
    """Question to a person."""

    item: str = Field(description="id of the step")
    text: str
    needs_note: bool
    needs_photo: bool
    choices: tuple[str, ...] = Field(description="retry, skip, stop after a failure; empty for a prompt")


class CellView(FrozenModel):
    """Cell of the matrix: one specimen with one method and drive."""

    specimen: str
    method: str
    drive: float | None = Field(description="constant drive in the unit of the drive; null for the method's own")
    drive_unit: str = Field(description="V or A")
    states: tuple[str, ...] = Field(description="state of each step of the cell, in order")
    runs: tuple[str, ...] = Field(description="ids of the complete runs")


class TrendPoint(FrozenModel):
    """Value of a parameter in one run."""

    run: str
    at: datetime = Field(description="UTC of the end of the run")
    value: float
    half_width: float | None = Field(description="half of the 95 % interval; null without one")
    verdict: str = Field(description="verdict of the run's diagnosis; empty without one")


class TrendView(FrozenModel):
    """Parameter over the runs of one cell."""

    specimen: str
    method: str
    drive: float | None
    drive_unit: str = Field(description="V or A")
    parameter: str
    unit: str
    points: tuple[TrendPoint, ...]


class NotificationView(FrozenModel):
    """Message on an event to one recipient."""

    recipient: str = Field(description="e-mail address, or host of the webhook")
    state: str = Field(description="due: an attempt is to follow; sent; failed: none is to follow")
    attempts: int = Field(description="[1] number of attempts that have begun")
    next_attempt: datetime | None = Field(description="UTC of the next attempt; null without one")
    reason: str = Field(description="reason why the latest attempt has failed; empty if none has")


class EventView(FrozenModel):
    """Event of a campaign."""

    id: int
    at: datetime = Field(description="UTC")
    kind: str = Field(description="note, restore_point, edit, person_needed, held_back, failed or ended")
    text: str
    who: str = Field(description="person or program; empty for the campaign itself")
    item: str = Field(description="id of the step; empty for the campaign as a whole")
    notifications: tuple[NotificationView, ...] = Field(description="one for each recipient who is told")


class CampaignView(FrozenModel):
    """One campaign."""

    id: str
    name: str
    bench: str = Field(
        description="`agent`, name of one of several benches, or `scenario NAME` for the simulated plant"
    )
    status: str = Field(description="running, pausing, paused, stopping, done or stopped")
    reason: str = Field(description="reason of the status")
    created: datetime = Field(description="UTC")
    updated: datetime = Field(description="UTC; that of the simulated clock on the simulated plant")
    operator: str
    current: ItemView | None = Field(description="step in progress")
    phase: str = Field(
        description="starting, stroking, preparing, evaluating, resting or asking; empty between steps"
    )
    next: ItemView | None = Field(description="next step")
    waits_for: str = Field(description="reason why the next step cannot begin; empty if it can")
    question: Question | None = Field(description="question to a person; null if none is asked")
    expected_end: datetime | None = Field(description="UTC, without the time of persons; null after the end")
    times: Times = Field(description="times [s] in motion, at rest and held")
    temperature_c: float | None = Field(description="latest reading of the thermometer [°C]")
    items: tuple[ItemView, ...] = Field(description="queue, in order")
    cells: tuple[CellView, ...] = Field(description="cells of the matrix")
    trends: tuple[TrendView, ...] = Field(description="identified parameters over the campaign")
    events: tuple[EventView, ...] = Field(description="newest events, oldest first")


def make_view(campaign: StoredCampaign, events: Sequence[CampaignEventRow] = ()) -> CampaignView:
    """Return the view of a campaign with some of its events."""
    state = campaign.state
    units = {name: method.drive_unit for name, method in campaign.methods.items()}
    active = state.active
    current = None if active is None else state.get_item(active.item)
    following = state.next_item or next(iter(state.pending), None)
    return CampaignView(
        id=campaign.id,
        name=state.campaign.name,
        bench=campaign.bench,
        status=state.status,
        reason=state.reason,
        created=campaign.created,
        updated=_at(state.updated),
        operator=state.operator,
        current=None if current is None else _make_item(current, units),
        phase="" if active is None else active.phase,
        next=None if following is None else _make_item(following, units),
        waits_for=state.waits_for or _describe_awaited(state),
        question=_make_question(state, current),
        expected_end=None if state.has_ended else _at(state.updated + estimate_remaining(state)),
        times=state.times,
        temperature_c=state.temperature_c,
        items=tuple(_make_item(item, units) for item in state.items),
        cells=_make_cells(state, units),
        trends=make_trends(state, units)[:MAX_TRENDS],
        events=tuple(_make_event(event) for event in events),
    )


def _at(seconds: float) -> datetime:
    return datetime.fromtimestamp(seconds, UTC)


def _describe_awaited(state: CampaignState) -> str:
    return f"the results of run {state.awaited_run} are awaited, for stop_on" if state.awaited_run else ""


def _make_item(item: Item, units: Mapping[str, str]) -> ItemView:
    run = find_run(item.step)
    return ItemView(
        id=item.id,
        kind=get_step_kind(item.step),
        label=item.label,
        state=item.state,
        specimen=run.specimen if run else "",
        method=get_method_name(run) if run else "",
        drive=run.drive if run else None,
        drive_unit=units[get_method_name(run)] if run else "",
        runs=item.runs,
        parts=item.parts,
        crashes=item.crashes,
        reason=item.reason,
        note=item.note,
        photo=item.photo,
        started=None if item.started is None else _at(item.started),
        ended=None if item.ended is None else _at(item.ended),
    )


def _make_question(state: CampaignState, item: Item | None) -> Question | None:
    if item is None or state.active is None or not state.needs_person:
        return None
    if state.active.is_question:
        text = f"{item.label} has failed: {item.reason}"
        return Question(
            item=item.id, text=text, needs_note=False, needs_photo=False, choices=("retry", "skip", "stop")
        )
    prompt = getattr(item.step, "prompt", None)
    return Question(
        item=item.id,
        text=item.label,
        needs_note=bool(prompt and prompt.note),
        needs_photo=bool(prompt and prompt.photo),
        choices=(),
    )


def _make_cells(state: CampaignState, units: Mapping[str, str]) -> tuple[CellView, ...]:
    cells: dict[tuple[str, str, float | None], list[Item]] = {}
    for item in state.items:
        if (run := find_run(item.step)) is not None:
            cells.setdefault((run.specimen, get_method_name(run), run.drive), []).append(item)
    return tuple(
        CellView(
            specimen=specimen,
            method=method,
            drive=drive,
            drive_unit=units[method],
            states=tuple(item.state for item in items),
            runs=tuple(run for item in items for run in item.runs),
        )
        for (specimen, method, drive), items in cells.items()
    )


def make_trends(state: CampaignState, units: Mapping[str, str]) -> tuple[TrendView, ...]:
    """Return each identified parameter over the runs of each cell, oldest first; ``units`` of drives by method."""
    trends = []
    for (specimen, method, drive), facts in group_runs(state).items():
        found = [(fact, state.results[fact.run]) for fact in facts if fact.run in state.results]
        for name in dict.fromkeys(name for _, result in found for name in result.parameters):
            points = [_make_point(fact, result, name) for fact, result in found if name in result.parameters]
            unit = next(result.parameters[name].unit for _, result in found if name in result.parameters)
            trends.append(
                TrendView(
                    specimen=specimen,
                    method=method,
                    drive=drive,
                    drive_unit=units[method],
                    parameter=name,
                    unit=unit,
                    points=tuple(points),
                )
            )
    return tuple(trends)


def _make_point(fact: RunFact, result: RunResult, name: str) -> TrendPoint:
    parameter = result.parameters[name]
    half = get_half_width(parameter)
    return TrendPoint(
        run=fact.run,
        at=_at(fact.ended),
        value=parameter.value,
        half_width=None if half == float("inf") else half,
        verdict=result.verdict,
    )


def _make_event(event: CampaignEventRow) -> EventView:
    return EventView(
        id=event.id,
        at=event.at,
        kind=event.kind,
        text=event.text,
        who=event.who,
        item=event.item,
        notifications=tuple(_make_notification(one) for one in event.notifications),
    )


def _make_notification(row: CampaignNotificationRow) -> NotificationView:
    return NotificationView(
        recipient=name_recipient(RECIPIENT.validate_python(row.recipient)),
        state=row.state,
        attempts=row.attempts,
        next_attempt=row.next_attempt,
        reason=row.reason,
    )
