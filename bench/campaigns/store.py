"""Campaigns in the catalogue as their models; every change of a state is one transaction."""

import hashlib
import json
import time
import uuid
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from typing import NamedTuple

from bench.campaigns.document import (
    Campaign,
    CampaignError,
    Methods,
    Step,
    collect_step_methods,
    expand_campaign,
    list_runs,
    prefer_methods,
)
from bench.campaigns.engine import (
    CampaignState,
    Message,
    QueueEdit,
    apply_edit,
    collect_edit_methods,
    start_campaign,
)
from bench.campaigns.needs import check_approvals, check_worker
from bench.catalogue import CampaignChange, CampaignEventRow, CampaignNotificationRow, CampaignRow, Catalogue
from bench.methods import Method

NOTIFIED_KINDS = ("person_needed", "held_back", "ended")
"""Kinds of messages that the recipients of a campaign get."""
SIMULATED = "scenario "
"""Beginning of the name of a simulated plant as an executor; the name of its scenario follows."""
Transition = Callable[[CampaignState], CampaignState]


class StoredCampaign(NamedTuple):
    """A campaign as the catalogue has it."""

    id: str
    bench: str
    """`agent`, name of one of several benches, or `scenario NAME`."""
    created: datetime
    methods: dict[str, Method]
    state: CampaignState

    def read_time(self) -> float:
        """Return the UTC [s]; where the clock has gone back, the time of the latest change of the campaign."""
        return max(time.time(), self.state.updated)

    @property
    def is_simulated(self) -> bool:
        """True if it runs on the simulated plant, which moves no damper and identifies its runs itself."""
        return self.bench.startswith(SIMULATED)


class CampaignStore:
    """Campaigns of one catalogue; safe from any thread and process."""

    def __init__(self, catalogue: Catalogue, describe_worker: Callable[[], str] | None = None) -> None:
        """Use a catalogue.

        Args:
            catalogue: catalogue of the data folder.
            describe_worker: returns `ok`, or the reason why there is no worker; None where that is not known.
        """
        self._describe_worker = describe_worker
        self.catalogue = catalogue
        self.table = catalogue.campaigns

    def find_method(self, name: str, version: int | None = None) -> Method | None:
        """Return a version of a stored or shipped method, by default its newest; None if there is no such version.

        Raises:
            MethodError: the stored document is invalid.
        """
        found = self.catalogue.method_library.find(name, version)
        return None if found is None else found.method

    def check_needs(self, campaign: Campaign, steps: Sequence[Step], methods: Methods) -> None:
        """Check that a campaign may run on a bench, or that steps may be added to it.

        Args:
            campaign: document of the campaign.
            steps: its steps, or those that are added.
            methods: methods of these steps by name.

        Raises:
            CampaignError: a method is not approved although the campaign requires it.
            NoWorkerError: a condition needs results of runs, and no worker is connected.
            RunError: the state of the workers is not known.
        """
        check_approvals(self.catalogue.approvals, campaign, steps, methods)
        if self._describe_worker is not None:
            check_worker(campaign, steps, self._describe_worker)

    def create(
        self, campaign: Campaign, methods: Methods, bench: str, now: float, operator: str = ""
    ) -> StoredCampaign:
        """Add a campaign that has just started.

        Args:
            campaign: the document.
            methods: all its methods by name.
            bench: `agent`, name of one of several benches, or `scenario NAME`.
            now: UTC [s].
            operator: person who started it.
        """
        state = start_campaign(campaign, methods, now, operator)
        created = datetime.fromtimestamp(now, UTC)
        row = CampaignRow(
            id=f"{campaign.name}-{created:%Y%m%dT%H%M%S}-{uuid.uuid4().hex[:6]}",
            name=campaign.name,
            key=compute_key(campaign, methods),
            bench=bench,
            status=state.status,
            created=created,
            methods={name: _dump_method(method) for name, method in methods.items()},
            state=state.model_dump(mode="json", by_alias=True),
        )
        self.table.add(row, _make_events(row.id, state))
        return _parse(row)

    def get(self, campaign_id: str) -> StoredCampaign:
        """Return a campaign.

        Raises:
            CampaignError: there is none with this id.
        """
        row = self.table.get(campaign_id)
        if row is None:
            raise CampaignError(f"there is no campaign {campaign_id[:120]}")
        return _parse(row)

    def list_campaigns(self, limit: int, before: str | None = None) -> list[StoredCampaign]:
        """Return campaigns, newest first.

        Raises:
            CampaignError: there is no campaign ``before``.
        """
        last = None if before is None else self.table.get(before)
        if before is not None and last is None:
            raise CampaignError(f"there is no campaign {before[:120]}")
        return [_parse(row) for row in self.table.list_campaigns(limit, last)]

    def list_in_progress(self, bench: str | None = None) -> list[StoredCampaign]:
        """Return the campaigns that have not ended, oldest first; only those of one bench if it is given."""
        rows = self.table.list_in_progress()
        return [_parse(row) for row in rows if bench is None or row.bench == bench]

    def find_unfinished(self, campaign: Campaign, methods: Methods, bench: str) -> StoredCampaign | None:
        """Return the campaign of an equal document that has not ended on a bench, or None.

        A version of a method that was stored since makes no difference, because a campaign keeps its methods.
        """
        named = {run.method for run in list_runs(expand_campaign(campaign)) if isinstance(run.method, str)}
        followed = {name for name in named if self.find_method(name) is not None}
        for row in self.table.list_in_progress():
            kept = {name: method for name, method in _parse_methods(row).items() if name in followed}
            if row.bench == bench and row.key == compute_key(campaign, {**methods, **kept}):
                return _parse(row)
        return None

    def update(self, campaign_id: str, transition: Transition, methods: Methods | None = None) -> StoredCampaign:
        """Replace the state of a campaign by that after a transition.

        Args:
            campaign_id: id of the campaign.
            transition: returns the new state, or raises an error that leaves the old one.
            methods: methods to add to those of the campaign.

        Raises:
            CampaignError: there is no such campaign, or the transition refuses.
        """
        self.get(campaign_id)

        def make_change(row: CampaignRow) -> CampaignChange | None:
            before = CampaignState.model_validate(row.state)
            after = transition(before)
            if after == before and not methods:
                return None
            values = {"state": after.model_dump(mode="json", by_alias=True), "status": after.status}
            if methods:
                values["methods"] = {**row.methods, **{name: _dump_method(one) for name, one in methods.items()}}
            return CampaignChange(values, _make_events(campaign_id, after))

        return _parse(self.table.update(campaign_id, make_change))

    def edit(self, campaign_id: str, edit: QueueEdit, now: float, who: str = "") -> StoredCampaign:
        """Edit the queue of a campaign; the edit is recorded with who made it and when.

        Args:
            campaign_id: id of the campaign.
            edit: the edit; methods of its steps are added to those of the campaign. A method that the campaign has
                is that of the campaign, also if a newer version is stored.
            now: UTC [s].
            who: person or program.

        Raises:
            CampaignError: there is no such campaign, the edit is not possible in its present state, or a step that
                it adds can never be done, see `check_needs`.
        """
        stored, steps = self.get(campaign_id), collect_edit_methods(edit)
        present = stored.methods
        methods = collect_step_methods(steps, prefer_methods(present, self.find_method))
        for name, method in methods.items():
            if present.get(name, method) != method:
                raise CampaignError(
                    f"the campaign has another method or version {name}; use that, or give yours a name of its own"
                )
        if not stored.is_simulated:
            self.check_needs(_leave_out_stops(stored.state.campaign), steps, methods)
        known = present | dict(methods)
        return self.update(campaign_id, lambda state: apply_edit(state, edit, known, now, who), methods)


def _leave_out_stops(campaign: Campaign) -> Campaign:
    """Return a campaign without its conditions to stop, which were checked at its start."""
    return campaign.model_copy(update={"stop_on": ()})


def compute_key(campaign: Campaign, methods: Methods) -> str:
    """Return the hash of a campaign and its methods."""
    content = {
        "campaign": campaign.to_document(),
        "methods": {name: _dump_method(method) for name, method in methods.items()},
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _dump_method(method: Method) -> object:
    return method.model_dump(mode="json", by_alias=True, exclude_defaults=True)


def _parse(row: CampaignRow) -> StoredCampaign:
    state = CampaignState.model_validate(row.state)
    return StoredCampaign(row.id, row.bench, row.created, _parse_methods(row), state)


def _parse_methods(row: CampaignRow) -> dict[str, Method]:
    return {name: Method.model_validate(document) for name, document in row.methods.items()}


def _make_events(campaign_id: str, state: CampaignState) -> Sequence[CampaignEventRow]:
    return [_make_event(campaign_id, state, message) for message in state.outbox]


def _make_event(campaign_id: str, state: CampaignState, message: Message) -> CampaignEventRow:
    recipients = state.campaign.notify if message.kind in NOTIFIED_KINDS else ()
    # The clock of this machine decides when a message is due; that of a simulated plant runs faster.
    due = datetime.now(UTC)
    return CampaignEventRow(
        campaign_id=campaign_id,
        at=datetime.fromtimestamp(message.at, UTC),
        kind=message.kind,
        text=message.text,
        who=message.who,
        item=message.item,
        notifications=[
            CampaignNotificationRow(recipient=one.model_dump(mode="json"), next_attempt=due) for one in recipients
        ],
    )
