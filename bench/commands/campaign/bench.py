"""`mrbench campaign run` on the instruments of a bench, executed by the service of the data folder."""

import time
from pathlib import Path

import typer

from bench.campaigns import (
    CampaignError,
    CampaignStore,
    StoredCampaign,
    collect_methods,
    expand_campaign,
    find_problems,
    load_campaign,
    make_view,
)
from bench.commands.audit import record
from bench.commands.campaign.catalogue import open_store
from bench.config import choose_bench, find_bench, find_place, get_executor, load_config
from bench.disk import find_usable_space
from bench.folder_lock import is_locked

_POLL_PERIOD = 0.5
"""[s] Time between two looks at the catalogue."""
_EVENTS = 200
"""Number of events that are read at once."""


def run_on_bench(path: Path, config: Path | None, bench: str, data: Path, operator: str, *, as_json: bool) -> None:
    """Start a campaign on the bench of a running service, or follow it, until it ends.

    The campaign goes on if this command is ended.

    Args:
        path: file of the campaign.
        config: ``bench.toml``, which tells the benches of the service apart; None if a bench is named.
        bench: name of a bench of the service.
        data: data folder of the service.
        operator: person, for the record.
        as_json: print the final state as JSON.

    Raises:
        BenchError: configuration or campaign is invalid, no service runs, or the bench is held.
    """
    if config is not None:
        load_config(config)
    check_served(data, config or Path("bench.toml"))
    with open_store(data) as store:
        name = _choose_named_bench(data, bench) if config is None else find_bench(data, config)
        campaign = find_or_create(store, path, operator, get_executor(name))
        ended = _follow(store, campaign, is_quiet=as_json)
        if as_json:
            events = store.table.list_newest_events(ended.id, _EVENTS)
            typer.echo(make_view(ended, events).model_dump_json(indent=2))


def _choose_named_bench(data: Path, bench: str) -> str:
    """Return the name of a bench of the service whose agent writes into the data folder."""
    name = choose_bench(data, bench)
    if "://" in (place := find_place(data, name)):
        raise CampaignError(
            f"the agent of bench {name} is at {place}; start its campaigns in the page or over REST"
        )
    return name


def check_served(data: Path, config: Path) -> None:
    """Check that a service holds the lock of a data folder.

    Raises:
        CampaignError: none does.
    """
    if not is_locked(data):
        raise CampaignError(f"no service uses {data}; start it: mrbench serve --config {config} --data {data}")


def find_or_create(store: CampaignStore, path: Path, operator: str, executor: str) -> StoredCampaign:
    """Return the unfinished campaign of an equal document on a bench, or a new one.

    Args:
        store: campaigns of the data folder.
        path: file of the campaign.
        operator: person, for the record.
        executor: executor of the bench, as the catalogue calls it.

    Raises:
        BenchError: the campaign is invalid or cannot be run, or another one holds the bench.
    """
    document = load_campaign(path)
    methods = collect_methods(document, store.find_method, allow_files=True)
    unfinished = store.find_unfinished(document, methods, executor)
    if unfinished is not None:
        return unfinished
    if held := store.list_in_progress(executor):
        raise CampaignError(f"campaign {held[0].id} holds the bench; stop it, or wait for its end")
    steps = expand_campaign(document)
    store.check_needs(document, steps, methods)
    if problems := find_problems(steps, methods, find_usable_space(store.catalogue.folder)):
        raise CampaignError(f"the campaign cannot be run: {problems[0]}")
    created = store.create(document, methods, executor, time.time(), operator)
    record(store.catalogue.folder, "campaign run", created.id, {}, {"name": document.name, "operator": operator})
    return created


def _follow(store: CampaignStore, campaign: StoredCampaign, *, is_quiet: bool) -> StoredCampaign:
    """Print the events of a campaign until it ends, and return it."""
    latest = 0
    while True:
        present = store.get(campaign.id)
        for event in store.table.list_events(campaign.id, _EVENTS, latest):
            latest = event.id
            if not is_quiet:
                typer.echo(event.text, err=True)
        if present.state.has_ended:
            return present
        time.sleep(_POLL_PERIOD)
