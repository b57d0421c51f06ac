"""Campaigns of a data folder, opened by a command; the service may run meanwhile."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from bench.agent_protocol import get_sender
from bench.audit import AUDIT_FILE, Act, AuditChain, redact
from bench.campaigns import CampaignStore
from bench.catalogue import CATALOGUE_FILE, Catalogue, find_catalogue, make_sqlite_url, open_database
from bench.errors import RunError


@contextmanager
def open_store(data: Path, *, is_created: bool = False) -> Iterator[CampaignStore]:
    """Open the campaigns of a data folder.

    Args:
        data: data folder.
        is_created: create folder and catalogue if they are missing.

    Raises:
        BenchError: there is no catalogue, or it cannot be opened.
    """
    folder = data.resolve()
    if is_created:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RunError(f"{folder} cannot be created: {error.strerror}; use another --data") from None
    url = make_sqlite_url(folder / CATALOGUE_FILE) if is_created else find_catalogue(folder)
    catalogue = Catalogue(open_database(url), folder)
    try:
        yield CampaignStore(catalogue)
    finally:
        catalogue.close()


def record(data: Path, action: str, campaign: str, old: Mapping[str, object], new: Mapping[str, object]) -> None:
    """Write a change by a command to the audit trail of the data folder, also beside a running service.

    Args:
        data: data folder.
        action: command.
        campaign: id of the campaign.
        old: former state.
        new: arguments; empty ones are left out.

    Raises:
        AuditError: the trail cannot be written; the change stays.
    """
    values = redact({name: value for name, value in new.items() if value})
    act = Act(
        actor=get_sender().actor, action=action, target=campaign, old=dict(old) or None, new=values, outcome="ok"
    )
    AuditChain(data.resolve() / AUDIT_FILE).append(act)
