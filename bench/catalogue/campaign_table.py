"""Campaigns and their events in the catalogue: each change reads and writes the state in one transaction."""

from collections.abc import Callable, Sequence
from datetime import datetime
from typing import Any, NamedTuple

from sqlalchemy import Engine, select, tuple_
from sqlalchemy.orm import sessionmaker

from bench.catalogue.database import begin_write
from bench.catalogue.models import CampaignEventRow, CampaignNotificationRow, CampaignRow, NotificationState


class CampaignChange(NamedTuple):
    """New state of a campaign, and the events that belong to it."""

    values: dict[str, Any]
    """Value by column of the campaign."""
    events: Sequence[CampaignEventRow]


class ClaimedNotification(NamedTuple):
    """Message of which an attempt has begun."""

    notification: CampaignNotificationRow
    event: CampaignEventRow


class CampaignTable:
    """Campaigns of a catalogue; safe from any thread and process. Returned rows are copies."""

    def __init__(self, engine: Engine) -> None:
        """Use an open database."""
        self._engine = engine
        self._sessions = sessionmaker(engine, expire_on_commit=False)

    def add(self, row: CampaignRow, events: Sequence[CampaignEventRow]) -> None:
        """Add a campaign with its first events."""
        with self._sessions.begin() as session:
            session.add(row)
            session.flush()
            session.add_all(events)

    def get(self, campaign_id: str) -> CampaignRow | None:
        """Return the campaign with an id, or None."""
        with self._sessions() as session:
            return session.get(CampaignRow, campaign_id)

    def list_campaigns(self, limit: int, before: CampaignRow | None = None) -> Sequence[CampaignRow]:
        """Return campaigns, newest first; only those after ``before`` in this order."""
        query = select(CampaignRow).order_by(CampaignRow.created.desc(), CampaignRow.id.desc()).limit(limit)
        if before is not None:
            query = query.where(tuple_(CampaignRow.created, CampaignRow.id) < tuple_(before.created, before.id))
        with self._sessions() as session:
            return session.scalars(query).all()

    def list_in_progress(self) -> Sequence[CampaignRow]:
        """Return the campaigns that have not ended, oldest first."""
        query = select(CampaignRow).where(CampaignRow.status.not_in(("done", "stopped")))
        with self._sessions() as session:
            return session.scalars(query.order_by(CampaignRow.created, CampaignRow.id)).all()

    def update(self, campaign_id: str, make_change: Callable[[CampaignRow], CampaignChange | None]) -> CampaignRow:
        """Change a campaign; no other process changes it meanwhile.

        Args:
            campaign_id: id of the campaign, which exists.
            make_change: returns the change of the present row, or None for none.

        Returns:
            The campaign after the change.
        """
        with begin_write(self._engine) as session:
            row = session.get_one(CampaignRow, campaign_id, with_for_update=True)
            made = make_change(row)
            if made is not None:
                for name, value in made.values.items():
                    setattr(row, name, value)
                session.add_all(made.events)
            session.commit()
            return row

    def list_events(self, campaign_id: str, limit: int, after: int = 0) -> Sequence[CampaignEventRow]:
        """Return events of a campaign in order, those after an id."""
        query = select(CampaignEventRow).where(
            CampaignEventRow.campaign_id == campaign_id, CampaignEventRow.id > after
        )
        with self._sessions() as session:
            return session.scalars(query.order_by(CampaignEventRow.id).limit(limit)).all()

    def list_newest_events(self, campaign_id: str, limit: int) -> Sequence[CampaignEventRow]:
        """Return the newest events of a campaign, oldest first."""
        query = select(CampaignEventRow).where(CampaignEventRow.campaign_id == campaign_id)
        with self._sessions() as session:
            newest = session.scalars(query.order_by(CampaignEventRow.id.desc()).limit(limit)).all()
        return newest[::-1]

    def claim_notification(self, now: datetime, until: datetime) -> ClaimedNotification | None:
        """Begin an attempt to send a message that is due; no other process begins one before ``until``.

        Args:
            now: UTC.
            until: UTC at which the message is due again, should this process end before it records the result.

        Returns:
            The message that is due longest, with its event, or None.
        """
        row = CampaignNotificationRow
        due = select(row).where(row.state == "due", row.next_attempt <= now).order_by(row.next_attempt).limit(1)
        with self._sessions() as session:
            if session.scalars(due).first() is None:
                return None
        with begin_write(self._engine) as session:
            claimed = session.scalars(due.with_for_update(skip_locked=True)).first()
            if claimed is None:
                return None
            claimed.attempts += 1
            claimed.next_attempt = until
            event = session.get_one(CampaignEventRow, claimed.event_id)
            session.commit()
            return ClaimedNotification(claimed, event)

    def record_attempt(
        self, notification_id: int, state: NotificationState, reason: str = "", again: datetime | None = None
    ) -> None:
        """Record the result of an attempt to send a message, and when it is made again."""
        with self._sessions.begin() as session:
            row = session.get_one(CampaignNotificationRow, notification_id)
            row.state, row.reason, row.next_attempt = state, reason, again
