"""Routes of campaigns and of the queue of the bench."""

import asyncio
import time
from collections.abc import Callable
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Query, Response
from fastapi.responses import FileResponse

from bench.agent_protocol import StopCommand
from bench.campaigns import (
    CampaignError,
    CampaignPlan,
    CampaignState,
    CampaignStore,
    CampaignView,
    StoredCampaign,
    answer,
    collect_methods,
    decode_photo,
    expand_campaign,
    get_media_type,
    make_view,
    parse_campaign,
    pause,
    plan_campaign,
    resume,
    save_photo,
    send_test,
    stop,
)
from bench.disk import find_usable_space
from bench.service.audit import note_old
from bench.service.bench_check import compare_with_bench
from bench.service.benches import ServedBench
from bench.service.context import Context, ServiceContext
from bench.service.files import SnapshotResponse, describe_file
from bench.service.problems import make_conflict, make_not_found
from bench.service.requests import IDEMPOTENT, IdempotentRoute, Sender, get_author, get_operator
from bench.service.routes.campaigns.views import (
    AnswerRequest,
    CampaignPage,
    CommandRequest,
    EditRequest,
    PlanCampaignRequest,
    QueueView,
    StartCampaignRequest,
    StopCampaignRequest,
    TestMessageResult,
    make_summary,
)
from bench.service.routes.planning import assess_programme
from bench.service.views import BenchChoice

router = APIRouter(tags=["campaigns"], route_class=IdempotentRoute)
_PHOTO = describe_file("image/jpeg", "image/png")
_EVENTS = 200
"""Number of newest events in a view."""


@router.get("/campaigns")
def list_campaigns(
    context: Context,
    limit: Annotated[int, Query(ge=1, le=200, description="largest number of items")] = 50,
    before: Annotated[str | None, Query(description="`next` of the previous page")] = None,
) -> CampaignPage:
    """List the campaigns, newest first."""
    store = context.campaign_store
    if before is not None:
        _get(store, before)
    found = store.list_campaigns(limit + 1, before)
    items = tuple(make_summary(campaign) for campaign in found[:limit])
    return CampaignPage(items=items, next=items[-1].id if len(found) > limit else None)


@router.post("/campaigns", status_code=201, dependencies=[IDEMPOTENT])
async def start_campaign(
    request: StartCampaignRequest, context: Context, response: Response, sender: Sender
) -> CampaignView:
    """Start a campaign on the bench; it continues after any crash. Refused if a condition can never be met."""
    operator = get_operator(sender, request.operator)
    bench = context.benches.get(request.bench)
    campaign = await asyncio.to_thread(_start, context, bench, request.campaign, operator)
    response.headers["Location"] = f"/api/v1/campaigns/{campaign.id}"
    return campaign


def _start(context: ServiceContext, bench: ServedBench, content: dict[str, Any], operator: str) -> CampaignView:
    executor, store = bench.campaigns, context.campaign_store
    document = parse_campaign(content, "the request")
    methods = collect_methods(document, store.find_method)
    if not executor.is_local:
        raise CampaignError("the agent writes its logs on another machine; campaigns need them in the data folder")
    if held := store.list_in_progress(bench.executor):
        raise make_conflict(
            "bench-held",
            "The bench is held",
            f"campaign {held[0].id} is in progress; stop it, or wait for its end",
        )
    executor.check_start(document, expand_campaign(document), methods)
    campaign = store.create(document, methods, bench.executor, time.time(), operator)
    return _show(store, campaign)


@router.post("/campaigns/plan")
def plan(request: PlanCampaignRequest, context: Context) -> CampaignPlan:
    """Return the dry run of a campaign: time, heat, disk, limits and identifiability; nothing is started."""
    document = parse_campaign(request.campaign, "the request")
    methods = collect_methods(document, context.campaign_store.find_method)
    bench, unknown = context.benches.describe(request.bench)
    return plan_campaign(
        document,
        methods,
        assess_programme if request.identifiability else None,
        find_usable_space(context.data),
        None if bench is None else partial(compare_with_bench, bench),
        unknown,
    )


@router.post("/campaigns/test-message", dependencies=[IDEMPOTENT])
def try_recipients(request: PlanCampaignRequest) -> TestMessageResult:
    """Send a test message to the recipients in a document; nothing is started."""
    return TestMessageResult(result=send_test(parse_campaign(request.campaign, "the request")))


@router.get("/campaigns/{campaign_id}")
def get_campaign(campaign_id: str, context: Context) -> CampaignView:
    """Return a campaign with its queue, its cells, its trends and its newest events."""
    return _show(context.campaign_store, _get(context.campaign_store, campaign_id))


@router.patch("/campaigns/{campaign_id}", dependencies=[IDEMPOTENT])
def edit_campaign(campaign_id: str, request: EditRequest, context: Context, sender: Sender) -> CampaignView:
    """Edit the queue of a campaign while it runs; the edit is recorded with who made it and when."""
    store = context.campaign_store
    stored = _get(store, campaign_id)
    note_old(_describe(stored))
    now = stored.read_time()
    return _show(store, store.edit(campaign_id, request.edit, now, get_author(sender, request.who)))


@router.post("/campaigns/{campaign_id}/pause")
def pause_campaign(campaign_id: str, request: CommandRequest, context: Context, sender: Sender) -> CampaignView:
    """Pause at the next checkpoint of the run in progress, after a setup step, or at once between runs."""
    return _change(context, campaign_id, lambda state, now: pause(state, now, get_author(sender, request.who)))


@router.post("/campaigns/{campaign_id}/resume")
def resume_campaign(campaign_id: str, request: CommandRequest, context: Context, sender: Sender) -> CampaignView:
    """Continue a paused campaign, an interrupted run after its checkpoint with the method's warm-up."""
    return _change(context, campaign_id, lambda state, now: resume(state, now, get_author(sender, request.who)))


@router.post("/campaigns/{campaign_id}/stop")
def stop_campaign(
    campaign_id: str, request: StopCampaignRequest, context: Context, sender: Sender
) -> CampaignView:
    """Stop after the run or setup step in progress; with `now`, that is stopped in a controlled way, too."""
    who = get_author(sender, request.who)
    view = _change(context, campaign_id, lambda state, now: stop(state, now, who))
    if request.now and view.phase in ("starting", "stroking", "preparing"):
        _stop_run(context, view.bench)
    return view


def _stop_run(context: ServiceContext, executor: str) -> None:
    """Stop the run of a campaign; one on the simulated plant ends with its campaign."""
    bench = context.benches.find_by_executor(executor)
    if bench is not None:
        bench.monitor.send_command(StopCommand())


@router.post("/campaigns/{campaign_id}/answer", dependencies=[IDEMPOTENT])
def answer_campaign(campaign_id: str, request: AnswerRequest, context: Context, sender: Sender) -> CampaignView:
    """Answer a prompt with a note and a photo, or decide on a failed step."""
    stored = _get(context.campaign_store, campaign_id)
    who = get_author(sender, request.who)
    photo = save_photo(context.data, stored, decode_photo(request.photo)) if request.photo else ""
    return _change(
        context,
        campaign_id,
        lambda state, now: answer(state, now, who, request.note, photo, request.choice),
    )


@router.get("/campaigns/{campaign_id}/photos/{item_id}", response_class=FileResponse, responses=_PHOTO)
def get_photo(campaign_id: str, item_id: str, context: Context) -> SnapshotResponse:
    """Return the photo that a person has added to the answer of a step."""
    items = _get(context.campaign_store, campaign_id).state.items
    photo = next((item.photo for item in items if item.id == item_id), "")
    path = context.data / photo
    if not photo or not path.is_file():
        raise make_not_found("photo", f"of step {item_id}")
    return SnapshotResponse(path, get_media_type(path), path.name, inline=True)


@router.post("/campaigns/{campaign_id}/test-message", dependencies=[IDEMPOTENT])
def send_test_message(campaign_id: str, context: Context) -> TestMessageResult:
    """Send a test message to the recipients of a campaign."""
    return TestMessageResult(result=send_test(_get(context.campaign_store, campaign_id).state.campaign))


@router.get("/queue")
def get_queue(context: Context, bench: BenchChoice = None) -> QueueView:
    """Return the campaign that holds the bench, with its queue."""
    store = context.campaign_store
    held = store.list_in_progress(context.benches.get(bench).executor)
    return QueueView(campaign=_show(store, held[0]) if held else None)


@router.patch("/queue", dependencies=[IDEMPOTENT])
def edit_queue(request: EditRequest, context: Context, sender: Sender, bench: BenchChoice = None) -> CampaignView:
    """Edit the queue of the campaign that holds the bench."""
    held = context.campaign_store.list_in_progress(context.benches.get(bench).executor)
    if not held:
        raise make_not_found("campaign", "in progress; start one: POST /api/v1/campaigns")
    return edit_campaign(held[0].id, request, context, sender)


def _get(store: CampaignStore, campaign_id: str) -> StoredCampaign:
    if store.table.get(campaign_id) is None:
        raise make_not_found("campaign", campaign_id)
    return store.get(campaign_id)


def _describe(campaign: StoredCampaign) -> dict[str, object]:
    """Return the state of a campaign before a change, for the audit trail: its status and its queue."""
    state = campaign.state
    return {"status": state.status, "queue": [f"{item.id} {item.state}" for item in state.items]}


def _show(store: CampaignStore, campaign: StoredCampaign) -> CampaignView:
    return make_view(campaign, store.table.list_newest_events(campaign.id, _EVENTS))


def _change(
    context: ServiceContext, campaign_id: str, transition: Callable[[CampaignState, float], CampaignState]
) -> CampaignView:
    """Change a stored campaign; its executor acts on it at its next step."""
    store = context.campaign_store
    stored = _get(store, campaign_id)
    note_old(_describe(stored))
    now = stored.read_time()
    return _show(store, store.update(campaign_id, lambda state: transition(state, now)))
