"""Upload of recordings made elsewhere."""

import gzip

import numpy as np
import pytest

from bench import cli
from bench.service.transfer import make_log_name
from tests.support.service_logs import write_complete_log, write_truncated_log


def make_csv(samples=400, force="10.0"):
    time = np.arange(samples) / 500
    rows = [f"{t:.4f},{0.01 * np.sin(6 * t):.6f},{force},0.2" for t in time]
    return "\n".join(["time_s,displacement_m,force_n,voltage_v", *rows]).encode()


def upload(client, *files, **fields):
    return client.post("/api/v1/logs", files=[("file", pair) for pair in files], data=fields)


def list_files(service):
    return sorted(
        path.name for path in service.data.iterdir() if path.suffix == ".mcap" or "transfer" in path.name
    )


@pytest.fixture
def commands_in_this_process(monkeypatch, capsys):
    """Run commands without a new process, which needs a second to start."""

    def run(arguments, error):
        try:
            cli.main(arguments)
        except SystemExit as end:
            if end.code:
                raise error(capsys.readouterr().err.strip().splitlines()[-1].removeprefix("mrbench: ")) from None

    monkeypatch.setattr("bench.service.transfer.intake.run_command", run)


def test_csv_files_become_one_run_that_is_identified(service, client):
    packed = ("b.csv.gz", gzip.compress(make_csv()))
    answer = upload(client, ("a.csv", make_csv()), packed, specimen="damper 7", drive_kind="coil_v")
    assert answer.status_code == 201, answer.text
    run = answer.json()
    facts = [run[name] for name in ("source", "specimen", "method", "outcome")]
    assert facts == ["import", "damper 7", "a, b", "clean"]
    assert answer.headers["location"] == f"/api/v1/runs/{run['id']}"
    assert [job["kind"] for job in service.get(f"/runs/{run['id']}")["jobs"]] == ["identify"]
    assert list_files(service) == [run["log"]]


def test_a_log_keeps_its_id_and_is_identified(service, client, tmp_path):
    path = write_complete_log(tmp_path / "made-elsewhere", "run-9")
    answer = upload(client, ("../../one.mcap", path.read_bytes()))
    assert answer.status_code == 201, answer.text
    run = answer.json()
    assert (run["id"], run["state"], run["log"].endswith("Z-one.mcap")) == ("run-9", "ended", True)
    assert (service.data / run["log"]).read_bytes() == path.read_bytes()
    assert [job["kind"] for job in service.get("/runs/run-9")["jobs"]] == ["identify"]
    again = upload(client, ("two.mcap", path.read_bytes()))
    assert (again.status_code, again.json()["type"]) == (409, "urn:mrbench:problem:run-exists")
    assert list_files(service) == [run["log"]]


def test_a_truncated_log_is_taken_and_can_be_repaired(service, client, tmp_path):
    run = upload(client, ("cut.mcap", write_truncated_log(tmp_path / "cut", "run-8").read_bytes())).json()
    assert (run["state"], run["jobs"]) == ("truncated", [])
    assert service.post("/runs/run-8/salvage")["state"] == "ended"


@pytest.mark.parametrize(
    ("files", "fields", "detail"),
    [
        ([("a.csv", make_csv(force="much"))], {}, "a.csv, row 2, column force_n: 'much' is not a number"),
        ([("a.csv", make_csv()), ("b.csv", make_csv(150))], {}, "b.csv, row 151: 150 samples, fewer than 200"),
        ([("a.csv", make_csv())], {"column": "force_n=LOAD"}, "a.csv, row 1: no column LOAD"),
        ([("a.csv", make_csv())], {"unit": "current_a=mA"}, "a.csv, row 1: no column current_a, whose unit"),
        ([("a.mcap", b"no log")], {}, "a.mcap: not an MCAP file"),
        ([("a.mcap", b""), ("b.csv", make_csv())], {}, "2 files with a log among them"),
        ([("a.mcap", b"")], {"specimen": "damper 7"}, "a log names its specimen and columns itself"),
        ([("a.xlsx", b"PK")], {}, "a.xlsx: the ending is not one of .csv, .csv.gz, .mcap"),
    ],
)  # fmt: skip
@pytest.mark.usefixtures("commands_in_this_process")
def test_a_refusal_is_one_sentence_and_keeps_nothing(service, client, files, fields, detail):
    answer = upload(client, *files, **fields)
    assert (answer.status_code, answer.json()["type"]) == (422, "urn:mrbench:problem:recording-refused")
    assert answer.json()["detail"].startswith(detail) or detail in answer.json()["detail"]
    assert "\n" not in answer.json()["detail"]
    assert str(service.data) not in answer.json()["detail"]
    assert list_files(service) == []
    assert service.get("/runs")["items"] == []


def test_the_refusal_of_a_command_in_a_process_is_its_last_line(service, client):
    answer = upload(client, ("a.csv", make_csv(force="")))
    assert answer.json()["detail"] == "a.csv, row 2, column force_n: the cell is empty; give a number"


def test_invalid_fields_are_refused(client):
    assert upload(client, ("a.csv", make_csv()), drive_kind="watt").status_code == 422
    assert upload(client, ("a.csv", make_csv()), column="mass=m").status_code == 422
    assert upload(client, ("a.csv", make_csv()), unit="force_n=stone").status_code == 422
    assert upload(client, ("a.csv", make_csv()), reverse="time_s").status_code == 422
    assert client.post("/api/v1/logs", data={"specimen": "damper 7"}).status_code == 422


def test_folders_of_interrupted_uploads_are_removed_at_the_next_start(service):
    service.end()
    (service.data / ".transfer-x").mkdir()
    (service.data / ".transfer-x" / "import.mcap").write_bytes(b"half")
    service.start()
    assert list_files(service) == []


def test_the_name_of_a_log_contains_no_folder_and_no_control_character():
    assert make_log_name("/etc/../a\x00b\n.csv.gz").endswith("Z-a_b_.mcap")
    assert make_log_name("...").endswith("Z-unnamed.mcap")
    assert len(make_log_name("x" * 5000)) < 200
