"""Events in the catalogue."""

from datetime import timedelta

import pytest

from bench.catalogue import Catalogue, open_database, scan_logs
from bench.catalogue.records import read_log_events
from bench.log import LogWriter
from tests.support.logs import MILLISECOND, header, times, values, write_log
from tests.support.service_logs import STARTED


@pytest.fixture
def catalogue(tmp_path, catalogue_url):
    catalogue = Catalogue(open_database(catalogue_url), tmp_path)
    yield catalogue
    catalogue.close()


def write_alarm_log(path):
    with LogWriter(path, header(utc_offset=STARTED.isoformat())) as log:
        log.write_samples(times(500, 1000 * MILLISECOND), values(500))
        log.write_event(1500 * MILLISECOND, "alarm", "setpoint lateness 33 ms exceeds 20 ms")
        log.count_lost("actuator_position", 142)
    return path


def test_events_of_a_log_have_their_time(tmp_path):
    (event,) = read_log_events(write_alarm_log(tmp_path / "one.mcap"))
    assert (event.kind, event.text) == ("alarm", "setpoint lateness 33 ms exceeds 20 ms")
    assert event.time_s == pytest.approx(0.5)
    assert event.at == STARTED + timedelta(seconds=1.5)


def test_the_events_of_a_log_replace_those_recorded_live(catalogue, tmp_path):
    catalogue.event_journal.record("state", "the agent is ready", None)
    write_alarm_log(tmp_path / "one.mcap")
    scan_logs(catalogue, lambda path: False)
    catalogue.event_journal.record("alarm", "live", "run-1")
    assert [row.text for row in catalogue.event_journal.list_of_run("run-1", 10)][-1] == "live"
    catalogue.event_journal.replace("run-1", read_log_events(tmp_path / "one.mcap"))
    (event,) = catalogue.event_journal.list_of_run("run-1", 10)
    assert event.time_s == pytest.approx(0.5)
    assert {row.run_id for row in catalogue.event_journal.list_newest(10)} == {None, "run-1"}


def test_losses_and_alarms_stand_at_the_run(catalogue, tmp_path):
    write_alarm_log(tmp_path / "one.mcap")
    (row,) = scan_logs(catalogue, lambda path: False)
    found = catalogue.get_run(row.id)
    assert (found.outcome, found.lost) == ("lossy", {"actuator_position": 142})
    assert found.alarms == ["setpoint lateness 33 ms exceeds 20 ms"]


def test_events_of_runs_of_older_versions_are_read_by_the_scan(catalogue, tmp_path):
    write_log(tmp_path / "one.mcap")
    scan_logs(catalogue, lambda path: False)
    catalogue.event_journal.replace("run-1", [])
    catalogue.update_run("run-1", alarms=None, lost=None)
    scan_logs(catalogue, lambda path: False)
    assert [row.text for row in catalogue.event_journal.list_of_run("run-1", 10)] == ["run finished"]
    assert catalogue.get_run("run-1").lost == {}


def test_an_event_of_an_unknown_run_is_kept(catalogue):
    catalogue.event_journal.record("trip", "force", "run-9")
    (event,) = catalogue.event_journal.list_newest(10)
    assert (event.run_id, event.text) == (None, "force")
