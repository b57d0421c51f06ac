"""Campaigns of the fake service: documents of the real models, changed by the real transitions."""

from collections.abc import Callable
from datetime import UTC, datetime
from typing import Any

from fastapi import APIRouter
from fastapi.responses import JSONResponse, Response

from bench.campaigns import (
    CampaignError,
    CampaignPlan,
    CampaignState,
    CampaignView,
    Methods,
    StoredCampaign,
    answer,
    apply_edit,
    collect_edit_methods,
    collect_methods,
    collect_step_methods,
    make_view,
    parse_campaign,
    pause,
    plan_campaign,
    resume,
    stop,
)
from bench.campaigns.engine import Observation, RunResult, advance, start_campaign
from bench.campaigns.engine.observation import ExecutionReport
from bench.campaigns.engine.state import ParameterResult, RunFact, Times
from bench.campaigns.store import _make_event
from bench.catalogue import CampaignEventRow
from bench.service.routes.campaigns.views import (
    AnswerRequest,
    CampaignPage,
    CommandRequest,
    EditRequest,
    PlanCampaignRequest,
    StartCampaignRequest,
    StopCampaignRequest,
    TestMessageResult,
    make_summary,
)

UNAPPROVED = "the campaign requires approved methods; not approved: quick"
STARTED = datetime(2025, 3, 4, 20, tzinfo=UTC).timestamp()
NIGHT = {
    "name": "night",
    "steps": {
        "matrix": {
            "specimens": ["MR-0042", "MR-0043", "MR-0044"],
            "methods": ["quick", "validation"],
            "drives": [None, 0.3],
            "repeats": 2,
            "before_specimen": [
                {"prompt": {"text": "Mount the next specimen and tighten the clevis", "note": True}}
            ],
        }
    },
    "notify": [{"mailto": "night@example.org"}, {"webhook": "https://hooks.example.org/T0KEN"}],
}
REFUSED = "the webhook at hooks.example.org was not notified: the connection was refused"
RESULT = "night@example.org was not notified: there is no mail server; set MRBENCH_SMTP=smtp://HOST:PORT"
IDENTIFIABLE = "k0 to 3 %"
UNTIDY = {3: ("failed", "displacement 26.4 mm is above the limit of 26.25 mm"), 4: ("skipped", "deleted"),
          12: ("held_back", "held back after 2 crashes of the bench: killed")}  # fmt: skip
ASKING = 18
"""Index of the step in progress: the prompt before the third specimen."""


class FakeCampaign:
    """One campaign with its events."""

    def __init__(self, campaign_id: str, document: dict[str, Any], operator: str = "M. Curie") -> None:
        campaign = parse_campaign(document, "the test")
        self.id, self.methods = campaign_id, dict(collect_methods(campaign))
        self.events: list[CampaignEventRow] = []
        self.keep(start_campaign(campaign, self.methods, STARTED, operator))

    def keep(self, state: CampaignState) -> CampaignView:
        """Keep a state and its messages, and return the view."""
        for message in state.outbox:
            event = _make_event(self.id, state, message)
            event.id = len(self.events) + 1
            for one in event.notifications:
                one.state, one.attempts, one.reason = "sent", 1, ""
            self.events.append(event)
        self.state = state.model_copy(update={"outbox": ()})
        return self.view()

    def view(self) -> CampaignView:
        """Return the campaign as the service does."""
        return make_view(self.stored(), self.events)

    def stored(self) -> StoredCampaign:
        """Return the campaign as the catalogue does."""
        return StoredCampaign(self.id, "agent", datetime.fromtimestamp(STARTED, UTC), self.methods, self.state)

    def proceed(self) -> CampaignView:
        """Begin the next step, and the run of it."""
        state = advance(self.state, Observation(), self.state.updated, self.id)
        if state.is_stroking:
            running = Observation(report=ExecutionReport(kind="running"))
            self.keep(state)
            state = advance(self.state, running, self.state.updated, self.id)
        return self.keep(state)


class FakeCampaigns:
    """Campaigns of the fake service: one that waits for a person, and one that was stopped."""

    def __init__(self) -> None:
        self.known = {"night-1": make_night(), "short-1": make_stopped()}

    def change(self, campaign_id: str, transition: Callable[[CampaignState, float], CampaignState]) -> Any:
        """Change a campaign, or return the refusal."""
        one = self.known[campaign_id]
        try:
            return one.keep(transition(one.state, one.state.updated))
        except CampaignError as error:
            return refuse(error)


def refuse(error: CampaignError) -> JSONResponse:
    """Return a refusal in the form of the service."""
    content = {"type": "about:blank", "title": "Not possible", "status": 409, "detail": str(error)}
    return JSONResponse(content, status_code=409, media_type="application/problem+json")


def make_stopped() -> FakeCampaign:
    """Return a campaign that was stopped, whose messages were not sent."""
    steps = [{"run": {"specimen": "MR-0042", "method": "quick"}}, {"rest": {"seconds": 600}}]
    made = FakeCampaign("short-1", {"name": "short", "steps": steps, "notify": NIGHT["notify"]})
    made.keep(stop(made.state, STARTED + 60, "B. Ohm"))
    sent = made.events[-1].notifications[1]
    sent.state, sent.attempts, sent.reason = "failed", 5, REFUSED
    return made


def make_night() -> FakeCampaign:
    """Return a campaign with steps in every state, which waits for the third specimen."""
    made = FakeCampaign("night-1", NIGHT)
    state = made.state
    items = [
        item if index >= ASKING else item.model_copy(update=make_past(index, item.step))
        for index, item in enumerate(state.items)
    ]
    done = [item for item in items if item.runs]
    facts = tuple(make_fact(item, number) for number, item in enumerate(done))
    results = {fact.run: make_result(fact, number) for number, fact in enumerate(facts)}
    times = Times(stroking_s=2891.0, held_s=1294.0, rest_s=3600.0)
    values = {"items": tuple(items), "facts": facts, "results": results, "times": times, "temperature_c": 27.31}
    made.keep(state.model_copy(update=values | {"updated": STARTED + 7800}))
    made.proceed()
    due = made.events[-1].notifications[1]
    due.state, due.reason, due.next_attempt = "due", REFUSED, datetime.fromtimestamp(STARTED + 7860, UTC)
    return made


def make_past(index: int, step: Any) -> dict[str, Any]:
    """Return what has become of a step before the one in progress."""
    state, reason = UNTIDY.get(index, ("done", ""))
    runs = (f"run-{index % 4}",) if state == "done" and hasattr(step, "run") else ()
    times = {"started": STARTED + 400 * index, "ended": STARTED + 400 * index + 380}
    return {"state": state, "reason": reason, "runs": runs, "crashes": 2 if state == "held_back" else 0} | times


def make_fact(item: Any, number: int) -> RunFact:
    """Return the complete run of a step."""
    run = item.step.run
    return RunFact(run=f"fact-{number}", item=item.id, specimen=run.specimen, method=run.method, drive=run.drive,
                   ended=item.ended, duration_s=180.0, outcome="clean")  # fmt: skip


def make_result(fact: RunFact, number: int) -> RunResult:
    """Return a fit whose stiffness drifts."""
    stiffness, damping = 2630.0 + 12.0 * number, 784.0 - 3.0 * number
    parameters = {
        "k0": ParameterResult(value=stiffness, low=stiffness - 40, high=stiffness + 40, unit="N/m"),
        "c0_a": ParameterResult(value=damping, low=None, high=None, unit="N·s/m"),
    }
    return RunResult(parameters=parameters, rmse_n=2.7, noise_floor_n=2.5, verdict="no_gap", is_diagnosed=True)


def campaign_routes(campaigns: FakeCampaigns) -> APIRouter:
    """Create the routes that read, plan and start campaigns."""
    router = APIRouter(prefix="/campaigns")

    @router.get("")
    async def listed() -> CampaignPage:
        items = tuple(make_summary(one.stored()) for one in campaigns.known.values())
        return CampaignPage(items=items, next=None)

    @router.post("/plan", response_model=CampaignPlan)
    async def plan(wanted: PlanCampaignRequest) -> Any:
        try:
            document = parse_campaign(wanted.campaign, "the request")
            assess = (lambda programme: {"messages": [IDENTIFIABLE]}) if wanted.identifiability else None
            return plan_campaign(document, collect_methods(document), assess, 42_000_000_000)
        except CampaignError as error:
            return refuse(error)

    @router.post("/test-message")
    async def try_recipients(wanted: PlanCampaignRequest) -> Any:
        notify = parse_campaign(wanted.campaign, "the request").notify
        return TestMessageResult(result="sent") if notify else refuse(CampaignError("it has no recipients"))

    @router.post("", status_code=201)
    async def start(wanted: StartCampaignRequest) -> Any:
        if wanted.campaign.get("methods") == "approved":
            return refuse(CampaignError(UNAPPROVED))
        made = FakeCampaign("morning-1", wanted.campaign, wanted.operator)
        campaigns.known = {made.id: made, **campaigns.known}
        return made.proceed()

    @router.get("/{campaign_id}")
    async def one(campaign_id: str) -> CampaignView:
        return campaigns.known[campaign_id].view()

    @router.get("/{campaign_id}/report")
    async def report(campaign_id: str, format: str = "html") -> Response:
        if campaign_id == "short-1":
            return refuse(CampaignError("the disk is full"))
        name = f'inline; filename="{campaign_id}.report.{format}"'
        return Response(f"report as {format}", headers={"Content-Disposition": name})

    add_commands(router, campaigns)
    return router


def add_commands(router: APIRouter, campaigns: FakeCampaigns) -> None:
    """Add the routes that change a campaign."""

    @router.patch("/{campaign_id}", response_model=CampaignView)
    async def edit(campaign_id: str, wanted: EditRequest) -> Any:
        one = campaigns.known[campaign_id]
        known: Methods = one.methods | dict(collect_step_methods(collect_edit_methods(wanted.edit)))
        return campaigns.change(
            campaign_id, lambda state, now: apply_edit(state, wanted.edit, known, now, wanted.who)
        )

    @router.post("/{campaign_id}/pause", response_model=CampaignView)
    async def hold(campaign_id: str, wanted: CommandRequest) -> Any:
        return campaigns.change(campaign_id, lambda state, now: pause(state, now, wanted.who))

    @router.post("/{campaign_id}/resume", response_model=CampaignView)
    async def go_on(campaign_id: str, wanted: CommandRequest) -> Any:
        return campaigns.change(campaign_id, lambda state, now: resume(state, now, wanted.who))

    @router.post("/{campaign_id}/stop", response_model=CampaignView)
    async def end(campaign_id: str, wanted: StopCampaignRequest) -> Any:
        return campaigns.change(campaign_id, lambda state, now: stop(state, now, wanted.who))

    @router.post("/{campaign_id}/answer", response_model=CampaignView)
    async def take_answer(campaign_id: str, wanted: AnswerRequest) -> Any:
        photo = "photo.jpg" if wanted.photo else ""
        changed = campaigns.change(
            campaign_id, lambda state, now: answer(state, now, wanted.who, wanted.note, photo, wanted.choice)
        )
        return campaigns.known[campaign_id].proceed() if isinstance(changed, CampaignView) else changed

    @router.get("/{campaign_id}/photos/{item_id}")
    async def get_photo(campaign_id: str, item_id: str) -> Response:
        return Response(f"photo of {campaign_id} {item_id}", media_type="image/jpeg")

    @router.post("/{campaign_id}/test-message")
    async def test(campaign_id: str) -> TestMessageResult:
        return TestMessageResult(result=RESULT)
