"""Request and response models of campaigns."""

from datetime import datetime
from typing import Any

from pydantic import Field

from bench.campaigns import CampaignView, Choice, QueueEdit, StoredCampaign
from bench.service.views import BenchName, View

_WHO = Field(default="", max_length=200, description="person or program, for the record")


class StartCampaignRequest(View):
    """Request of a campaign."""

    campaign: dict[str, Any] = Field(description="document `mrbench.campaign/1`")
    operator: str = Field(default="", max_length=200, description="name of the operator")
    bench: BenchName | None = Field(default=None, description="name of the bench; required if there are several")


class PlanCampaignRequest(View):
    """Request of a dry run, or of a test message, for a campaign that is not started."""

    campaign: dict[str, Any] = Field(description="document `mrbench.campaign/1`")
    identifiability: bool = Field(
        default=True, description="also assess what each method can identify, which takes some seconds for each"
    )
    bench: BenchName | None = Field(default=None, description="name of the bench; needed if there are several")


class CommandRequest(View):
    """Pause or resume."""

    who: str = _WHO


class StopCampaignRequest(View):
    """Stop of a campaign."""

    who: str = _WHO
    now: bool = Field(default=False, description="also stop the run in progress, in a controlled way")


class AnswerRequest(View):
    """Answer to a question."""

    who: str = _WHO
    note: str = Field(default="", max_length=2000, description="note to a prompt, or reason of a choice")
    choice: Choice | None = Field(default=None, description="decision on a failed step")
    photo: str = Field(default="", description="photo as base64 of a JPEG or PNG file; empty without one")


class EditRequest(View):
    """Edit of the queue."""

    who: str = _WHO
    edit: QueueEdit = Field(description="add, move, delete, pause, do_now or release")


class CampaignSummary(View):
    """Campaign in a list."""

    id: str
    name: str
    bench: str = Field(
        description="`agent`, name of one of several benches, or `scenario NAME` for the simulated plant"
    )
    status: str
    reason: str
    created: datetime = Field(description="UTC")
    steps: int = Field(description="number of steps")
    done: int = Field(description="number of steps that are done")
    needs_person: bool = Field(description="true if it waits for an answer")


class CampaignPage(View):
    """One page of campaigns, newest first."""

    items: tuple[CampaignSummary, ...]
    next: str | None = Field(description="value of `before` for the next page; null on the last page")


class QueueView(View):
    """Campaign that holds the bench."""

    campaign: CampaignView | None = Field(description="campaign in progress; null if there is none")


class TestMessageResult(View):
    """Result of a test message."""

    result: str = Field(description="`sent`, or the reasons of failures")


def make_summary(campaign: StoredCampaign) -> CampaignSummary:
    """Return a campaign as an entry of a list."""
    state = campaign.state
    return CampaignSummary(
        id=campaign.id,
        name=state.campaign.name,
        bench=campaign.bench,
        status=state.status,
        reason=state.reason,
        created=campaign.created,
        steps=len(state.items),
        done=sum(item.state == "done" for item in state.items),
        needs_person=state.needs_person,
    )
