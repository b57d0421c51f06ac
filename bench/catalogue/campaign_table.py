"""Campaigns and their events in the catalogue: each change reads and writes the state in one transaction."""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from sqlalchemy import Engine, select, tuple_
from sqlalchemy.orm import Session, sessionmaker

from bench.catalogue.models import CampaignEventRow, CampaignRow


class CampaignChange(NamedTuple):
    """New state of a campaign, and the events that belong to it."""

    values: dict[str, Any]
    """Value by column of the campaign."""
    events: Sequence[CampaignEventRow]


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
        with self._begin_write() as session:
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

    def list_due(self, campaign_id: str) -> Sequence[CampaignEventRow]:
        """Return the events of a campaign whose notification is due."""
        query = select(CampaignEventRow).where(
            CampaignEventRow.campaign_id == campaign_id, CampaignEventRow.notification == "due"
        )
        with self._sessions() as session:
            return session.scalars(query.order_by(CampaignEventRow.id)).all()

    def set_notification(self, event_id: int, result: str) -> None:
        """Record the result of a notification."""
        with self._sessions.begin() as session:
            session.get_one(CampaignEventRow, event_id).notification = result

    def _begin_write(self) -> Session:
        session = self._sessions()
        if self._engine.dialect.name == "sqlite":
            session.connection().exec_driver_sql("BEGIN IMMEDIATE")
        return session
