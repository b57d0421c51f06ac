"""PostgreSQL: interrupted connections, simultaneous writers, and what its text cannot contain."""

from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta

import pytest
from sqlalchemy.exc import IntegrityError

from bench.catalogue import (
    CampaignChange,
    CampaignEventRow,
    CampaignNotificationRow,
    CampaignRow,
    Catalogue,
    CatalogueUnavailableError,
    JobRow,
    RunFilter,
    RunRow,
    open_database,
)

NOW = datetime(2026, 3, 1, 10, tzinfo=UTC)
THREADS = 8


@pytest.fixture
def url(postgres_server):
    return postgres_server.make_catalogue()


@pytest.fixture
def catalogue(tmp_path, url):
    catalogue = Catalogue(open_database(url), tmp_path)
    catalogue.add(RunRow(id="run-1", method="quick", started=NOW, state="ended", log="run-1.mcap"))
    yield catalogue
    catalogue.close()


def make_job(number, kind="identify", hours=0, **changes):
    made = NOW + timedelta(hours=hours)
    values = {"run_id": "run-1", "kind": kind, "key": "k", "settings": {}, "state": "queued", "created": made}
    return JobRow(id=f"job-{number}", finished=made, **{**values, **changes})


def at_once(action):
    """Call a function with a number from several threads at once, and return the results."""
    with ThreadPoolExecutor(THREADS) as pool:
        return list(pool.map(action, range(THREADS)))


def test_an_interrupted_connection_is_replaced(catalogue, postgres_server, url):
    assert catalogue.get_run("run-1").method == "quick"
    postgres_server.disconnect(url)
    assert catalogue.get_run("run-1").method == "quick"


def test_a_connection_in_use_at_the_end_is_closed_when_it_is_returned(catalogue, url):
    engine = open_database(url)
    used = engine.connect()
    sent = used.connection.dbapi_connection
    Catalogue(engine, catalogue.folder).close()
    assert not sent.closed
    used.close()
    assert sent.closed


def test_a_database_that_is_away_is_an_error_of_ours_and_comes_back(catalogue, postgres_server, url):
    postgres_server.allow_connections(url, False)
    try:
        for _ in range(2):
            with pytest.raises(CatalogueUnavailableError, match="cannot be used at present") as lost:
                catalogue.get_run("run-1")
            assert "secret-word" not in str(lost.value)
    finally:
        postgres_server.allow_connections(url, True)
    assert catalogue.get_run("run-1").method == "quick"


def test_an_error_of_a_statement_stays_what_it_is(catalogue):
    with pytest.raises(IntegrityError):
        catalogue.add(RunRow(id="run-1", method="quick", started=NOW, state="ended", log="other.mcap"))


def test_equal_jobs_requested_at_once_have_one_row(catalogue):
    found = at_once(lambda number: catalogue.job_queue.request(make_job(number), lambda row: True))
    assert len({row.id for row, _ in found}) == 1
    assert [is_queued for _, is_queued in found].count(True) == 1


def test_a_job_ends_once_and_has_one_follow_up(catalogue):
    catalogue.job_queue.request(make_job(0), lambda row: True)

    def finish(number):
        follow_up = make_job(f"follow-{number}", "diagnose", key=f"d{number}")
        return catalogue.job_queue.finish("job-0", follow_up, state="done")

    ended = at_once(finish)
    assert sum(job is not None for job, _ in ended) == 1
    assert sum(following is not None for _, following in ended) == 1


def add_campaign(catalogue, count=0):
    row = CampaignRow(id="c", name="c", key="k", status="running", created=NOW, methods={}, state={"count": 0})
    due = [CampaignNotificationRow(recipient={"number": one}, next_attempt=NOW) for one in range(count)]
    event = CampaignEventRow(campaign_id="c", at=NOW, kind="ended", text="", notifications=due)
    catalogue.campaigns.add(row, [event])


def test_changes_of_a_campaign_at_once_are_all_kept(catalogue):
    add_campaign(catalogue)

    def count(row):
        return CampaignChange({"state": {"count": row.state["count"] + 1}}, [])

    at_once(lambda number: catalogue.campaigns.update("c", count))
    assert catalogue.campaigns.get("c").state == {"count": THREADS}


def test_each_message_that_is_due_is_claimed_by_one_sender(catalogue):
    add_campaign(catalogue, THREADS)
    later = NOW + timedelta(hours=1)
    claimed = [catalogue.campaigns.claim_notification(NOW, later) for _ in range(THREADS)]
    assert {one.notification.recipient["number"] for one in claimed} == set(range(THREADS))
    assert catalogue.campaigns.claim_notification(NOW, later) is None
    held = at_once(lambda number: catalogue.campaigns.claim_notification(later, later + timedelta(hours=1)))
    numbers = [one.notification.id for one in held if one is not None]
    assert len(numbers) == len(set(numbers)) > 0


def test_processes_that_open_a_new_database_at_once_migrate_it_once(postgres_server):
    url = postgres_server.make_database()
    for engine in at_once(lambda number: open_database(url)):
        engine.dispose()
    assert postgres_server.execute("SELECT count(*) FROM alembic_version", url) == [(1,)]


def test_a_character_that_the_server_cannot_store_is_replaced(catalogue):
    catalogue.notebook.add_note("run-1", "A", "before\0after")
    (note,) = catalogue.notebook.list_notes("run-1", 10)
    assert note.text == "before\N{REPLACEMENT CHARACTER}after"
    assert catalogue.get_run("run\0-1") is None


def find(catalogue, **selection):
    return [row.id for row in catalogue.list_runs(10, None, RunFilter(**selection))]


def test_a_search_finds_the_newest_result_whatever_becomes_of_it(catalogue):
    fits = {"old": 1.0, "new": 5.0}
    for hours, (name, value) in enumerate(fits.items()):
        summary = {"parameters": {"k0": value, "note": "text"}, "rmse_n": 1.0}
        catalogue.add(make_job(name, key=name, hours=hours, state="done", summary=summary))
    assert find(catalogue, parameter="k0", parameter_min=4.0, parameter_max=5.0) == ["run-1"]
    assert find(catalogue, parameter="k0", parameter_max=4.0) == []
    assert find(catalogue, parameter="note", parameter_min=0.0) == []
    catalogue.update_job("job-new", states=("done",), state="failed")
    assert find(catalogue, parameter="k0", parameter_max=4.0) == ["run-1"]
    catalogue.update_job("job-old", states=("done",), state="cancelled")
    assert find(catalogue, parameter="k0", parameter_min=0.0) == []


def test_a_search_finds_texts_in_any_case_and_effects_by_their_whole_name(catalogue):
    diagnosis = {"effects": ["gas_spring_2", "backlash", "backlash"], "verdict": "explained"}
    catalogue.add(make_job("d", "diagnose", state="done", summary=diagnosis))
    catalogue.add(make_job("e", "diagnose", key="e", state="failed", summary={"effects": ["gas_spring"]}))
    catalogue.notebook.add_note("run-1", "A", "Oil of the 2nd batch: 100% Öl_7")
    for text in ("oil OF", "100%", "ÖL_", "uic"):
        assert find(catalogue, text=text) == ["run-1"]
    for text in ("oil_of", "l_8", "100_"):
        assert find(catalogue, text=text) == []
    assert find(catalogue, effect="backlash") == ["run-1"]
    assert find(catalogue, effect="gas_spring") == []
