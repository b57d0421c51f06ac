"""Exports and reports of a run in the formats of other tools."""

from urllib.parse import urlsplit

import pytest

from bench import cli
from bench.log import read_log
from tests.support.service_logs import write_complete_log, write_truncated_log

BEGINNINGS = {
    "export?format=csv": b"time_s,displacement_m,",
    "export?format=parquet": b"PAR1",
    "export?format=mat": b"MATLAB 5.0",
    "report?format=html": b"<!doctype html>",
    "report?format=pdf": b"%PDF-",
    "report?format=xlsx": b"PK",
}


@pytest.fixture
def run(service, client, monkeypatch, capsys):
    """Provide a run without a fit; commands run in this process, because a new one needs a second to start."""

    def run_here(arguments, error):
        try:
            cli.main(arguments)
        except SystemExit as end:
            if end.code:
                raise error(capsys.readouterr().err.strip().splitlines()[-1].removeprefix("mrbench: ")) from None

    for module in ("exports", "reports"):
        monkeypatch.setattr(f"bench.service.routes.exchange.{module}.run_command", run_here)
    write_complete_log(service.data / "one.mcap", "run-1")
    service.client.portal.call(client.app.state.context.registry.scan)
    return "/api/v1/runs/run-1"


def list_left(service):
    return [path.name for path in service.data.glob(".transfer-*")]


def test_a_run_without_a_fit_is_offered_in_all_formats_and_nothing_stays(service, client, run):
    files = service.get("/runs/run-1/files")["items"]
    offered = [file for file in files if file["kind"] in ("export", "report")]
    assert [
        urlsplit(file["path"])._replace(path=file["path"].split("/")[-1].split("?")[0]).geturl()
        for file in offered
    ] == list(BEGINNINGS)
    for file in offered:
        answer = client.get(file["path"])
        assert answer.status_code == 200, answer.text
        assert answer.headers["content-type"].split(";")[0] == file["media_type"]
        assert answer.content.startswith(BEGINNINGS[file["path"].rpartition("/")[2]]), file["path"]
    assert list_left(service) == []


def test_an_exported_csv_has_every_sample_of_the_log(service, client, run):
    lines = client.get(f"{run}/export?format=csv").text.splitlines()
    log = read_log(service.data / "one.mcap")
    assert len(lines) == 1 + len(log.samples["time"])
    assert float(lines[500].split(",")[3]) == log.samples["force"][499]


def test_a_log_without_an_end_is_refused_and_nothing_stays(service, client, run):
    write_truncated_log(service.data / "cut.mcap", "run-2")
    service.end()
    client = service.start()
    for path in ("export?format=csv", "report", "report?format=pdf"):
        answer = client.get(f"/api/v1/runs/run-2/{path}")
        assert answer.status_code in (404, 409), answer.text
    assert list_left(service) == []


def test_the_failure_of_a_command_is_named_and_nothing_stays(service, client, run):
    path = service.data / "one.mcap"
    path.write_bytes(path.read_bytes()[:-100])
    answer = client.get(f"{run}/export?format=csv")
    assert (answer.status_code, answer.json()["type"]) == (409, "urn:mrbench:problem:log-unusable")
    assert "truncated" in answer.json()["detail"]
    assert list_left(service) == []


def test_an_unknown_format_is_refused(client, run):
    assert client.get(f"{run}/export?format=doc").status_code == 422
    assert client.get(f"{run}/export").status_code == 422
