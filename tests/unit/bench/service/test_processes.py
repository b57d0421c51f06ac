"""Parts of the service without an application: log lines, lock, port, and the processes that it starts."""

import asyncio
import contextlib
import errno
import logging
import signal
import socket
import sys

import pytest

from bench.agent_protocol import AgentStatus, Reply, ShutDownCommand
from bench.errors import AgentUnreachableError, ConfigError
from bench.log_lines import KeyValueFormatter
from bench.processes import terminate
from bench.service import processes, serving
from bench.service.access import open_access, save_token
from bench.service.bench_agents import BenchPlace, is_local, make_agents
from bench.service.errors import ServiceError
from bench.service.middleware.request_log import RequestLogMiddleware
from bench.service.processes import is_answering, shut_down_idle_agent, start_agent
from bench.service.serving import ServeOptions


def format_line(message="run_ended", error=None, **extra):
    record = logging.makeLogRecord({"msg": message, "levelno": logging.INFO, "levelname": "INFO", **extra})
    record.created = 1_772_000_000.25
    if error is not None:
        record.exc_info = (type(error), error, error.__traceback__)
    return KeyValueFormatter().format(record)


class TestLogLines:
    """One line for each event."""

    def test_it_begins_with_time_level_and_event(self):
        assert format_line(run="run-1").endswith("Z info run_ended run=run-1")
        assert format_line().startswith("2026-02-25T")

    def test_special_characters_are_quoted_so_that_a_line_can_be_parsed(self):
        assert format_line(reason='two words, "quoted"\nand a second line') == format_line() + (
            ' reason="two words, \\"quoted\\"\\nand a second line"'
        )

    def test_empty_values_are_left_out_but_zero_is_not(self):
        assert format_line(outcome=None, reason="", lost=0) == format_line() + " lost=0"

    def test_a_traceback_stays_within_the_format_line(self):
        try:
            raise ValueError("a defect")
        except ValueError as error:
            found = format_line("defect", error)
        assert "\n" not in found
        assert "ValueError: a defect" in found


def send_request(method, status, kind="http", fails=None):
    """Send one request through the request log."""

    async def application(scope, receive, send):
        if fails is not None:
            raise fails
        if scope["type"] == "http":
            await send({"type": "http.response.start", "status": status})

    async def ignore(*message):
        return None

    scope = {"type": kind, "method": method, "path": "/api/v1/runs", "query_string": b"token=secret"}
    asyncio.run(RequestLogMiddleware(application)(scope, ignore, ignore))


class TestRequestLog:
    """Requests that change something or fail."""

    @pytest.fixture
    def lines(self, caplog):
        caplog.set_level(logging.INFO, "bench.service.middleware.request_log")
        return caplog

    @pytest.mark.parametrize(("method", "status", "written"), [("GET", 200, 0), ("GET", 404, 1), ("POST", 201, 1)])
    def test_a_successful_read_is_not_logged(self, lines, method, status, written):
        send_request(method, status)
        assert [record.status for record in lines.records] == [status] * written

    def test_an_unhandled_error_is_logged_with_status_500(self, lines):
        with pytest.raises(ZeroDivisionError):
            send_request("GET", 200, fails=ZeroDivisionError())
        assert [record.status for record in lines.records] == [500]

    def test_a_token_in_a_url_is_not_logged(self, lines):
        send_request("POST", 200)
        send_request("GET", 101, kind="websocket")
        assert len(lines.records) == 1
        assert "secret" not in str(vars(lines.records[0]))


class TestServing:
    """Errors before the server starts."""

    def test_a_data_folder_is_used_by_one_service_at_a_time(self, tmp_path):
        folder = tmp_path / "new" / "runs"
        with (
            serving._lock_data_folder(folder),
            pytest.raises(ServiceError, match="another service uses"),
            serving._lock_data_folder(folder),
        ):
            pass
        with serving._lock_data_folder(folder):
            pass

    def test_a_folder_that_cannot_be_created_is_reported(self, tmp_path):
        (tmp_path / "file").write_text("")
        with (
            pytest.raises(ServiceError, match="use another --data"),
            serving._lock_data_folder(tmp_path / "file" / "runs"),
        ):
            pass

    def test_a_port_in_use_is_reported(self):
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            with (
                pytest.raises(ServiceError, match=f"127.0.0.1 port {port}: .*; use another --port"),
                serving._open_listener("127.0.0.1", port),
            ):
                pass

    def test_a_client_is_refused_until_the_agent_has_started(self, tmp_path, monkeypatch):
        """Without a refusal it would wait for as long as an agent takes to start."""
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        refusals = []

        def supervise(*_, **options):
            with socket.socket() as client:
                refusals.append(client.connect_ex(("127.0.0.1", port)))

        def run_server(app, listener, tls):
            with socket.create_connection(listener.getsockname()):
                refusals.append(0)

        monkeypatch.setattr(serving, "_supervise_agents", supervise)
        monkeypatch.setattr(serving, "_run_server", run_server)
        monkeypatch.setattr(serving, "log_to_stderr", lambda: None)
        serving.serve(ServeOptions(tmp_path, port=port), lambda line: None)
        assert refusals == [errno.ECONNREFUSED, 0]

    def test_a_port_that_is_taken_while_the_agent_starts_is_named(self, tmp_path, monkeypatch):
        """Two sockets may have one address until one of them listens."""
        with socket.create_server(("127.0.0.1", 0)) as free:
            port = free.getsockname()[1]
        with socket.socket() as other:
            other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)

            def supervise(*_, **options):
                other.bind(("127.0.0.1", port))
                other.listen()

            monkeypatch.setattr(serving, "_supervise_agents", supervise)
            monkeypatch.setattr(serving, "log_to_stderr", lambda: None)
            with pytest.raises(ServiceError, match=f"port {port}: address already in use; use another --port"):
                serving.serve(ServeOptions(tmp_path, port=port), lambda line: None)

    @pytest.mark.parametrize("address", ["5570", "tcp://host", "http://host:1", "tcp://host:port"])
    def test_an_invalid_address_of_the_agent_is_refused(self, address, tmp_path):
        with pytest.raises(ConfigError, match="not an address of a rig agent; give tcp://HOST:PORT"):
            make_agents([BenchPlace(address=address)])

    @pytest.mark.parametrize(
        ("address", "here"),
        [
            ("tcp://127.0.0.1:5570", True),
            ("tcp://localhost:1", True),
            ("ipc:///run/rig", True),
            ("tcp://rig:1", False),
        ],
    )
    def test_a_local_agent_is_recognised(self, address, here):
        assert is_local(address) is here

    def test_a_new_token_is_printed_on_a_terminal_only(self, tmp_path):
        shown = serving._format_address("http://h:1/", "abc", tmp_path, is_terminal=True)
        assert shown == "http://h:1/#token=abc"
        assert list(tmp_path.iterdir()) == []

    def test_a_new_token_without_a_terminal_is_in_a_file_of_its_owner(self, tmp_path):
        file = tmp_path / "token"
        printed = serving._format_address("http://h:1/", "abc", tmp_path, is_terminal=False)
        assert printed == f"http://h:1/ (the token is new; it is in {file})"
        assert (file.read_text(), file.stat().st_mode & 0o777) == ("abc", 0o600)
        again = serving._format_address("http://h:1/", None, tmp_path, is_terminal=False)
        assert "unchanged" in again
        assert str(file) in again

    def test_the_file_of_an_old_token_is_removed(self, tmp_path):
        save_token(tmp_path, open_access(tmp_path)[1])
        open_access(tmp_path, new=True)
        assert not (tmp_path / "token").exists()

    def test_output_of_processes_can_be_read_by_their_owner_only(self, tmp_path):
        log = tmp_path / "worker.log"
        log.write_text("of an earlier version\n")
        processes._start_process([sys.executable, "-c", "print('ready')"], log).wait()
        assert log.read_text() == "of an earlier version\nready\n"
        assert log.stat().st_mode & 0o777 == 0o600


class FakeLink:
    """Connection to an agent that answers after a number of unanswered requests."""

    def __init__(self, silent=0, state="idle"):
        self.silent, self.status, self.sent = silent, AgentStatus(state=state), []

    def send(self, command, timeout=5.0):
        self.sent.append(command)
        if len(self.sent) <= self.silent:
            raise AgentUnreachableError("no rig agent answered")
        return Reply(ok=True, status=self.status)


def make_failing_command(message, status):
    return (sys.executable, "-c", f"import sys; print({message!r}, file=sys.stderr); sys.exit({status})")


class TestProcesses:
    """Agent that outlives the service, and worker that is restarted."""

    def test_the_message_of_an_agent_that_ends_at_once_is_reported(self, tmp_path):
        command = make_failing_command("mrbench: bench.toml: cannot be read", 1)
        with pytest.raises(ServiceError, match=r"ended at once: bench\.toml: cannot be read"):
            start_agent(tmp_path / "bench.toml", FakeLink(silent=10**9), tmp_path / "agent.log", command)

    def test_an_agent_that_never_answers_is_ended(self, tmp_path, monkeypatch):
        monkeypatch.setattr(processes, "AGENT_TIMEOUT", 0.05)
        ended = []
        monkeypatch.setattr(
            processes, "terminate", lambda process, within: (ended.append(within), terminate(process, within))
        )
        command = (sys.executable, "-c", "import time; time.sleep(60)")
        with pytest.raises(ServiceError, match=r"did not answer within 0\.05 s; see"):
            start_agent(tmp_path / "bench.toml", FakeLink(silent=10**9), tmp_path / "agent.log", command)
        assert ended == [processes._TERMINATE_TIMEOUT]

    def test_an_answering_agent_is_recognised(self):
        assert is_answering(FakeLink())
        assert not is_answering(FakeLink(silent=1))

    def test_an_idle_agent_is_shut_down_with_the_service(self):
        link = FakeLink()
        assert shut_down_idle_agent(link) == "the rig agent was idle and was shut down"
        assert isinstance(link.sent[-1], ShutDownCommand)

    def test_a_running_agent_continues(self):
        link = FakeLink(state="running")
        assert shut_down_idle_agent(link).startswith("the rig agent is running and continues")
        assert len(link.sent) == 1

    def test_a_silent_agent_is_reported(self):
        assert shut_down_idle_agent(FakeLink(silent=1)) == "the rig agent does not answer: no rig agent answered"

    def test_a_suspended_worker_is_killed(self, tmp_path, caplog):
        command = (sys.executable, "-c", "import time; time.sleep(600)")
        worker = processes._start_process(command, tmp_path / "worker.log")
        worker.send_signal(signal.SIGSTOP)
        processes._kill_silent(worker)
        assert worker.wait(60) == -signal.SIGKILL
        processes._kill_silent(None)  # that of another machine
        assert [record.message for record in caplog.records] == ["worker_silent"]

    def test_a_worker_that_ends_is_restarted(self, tmp_path, monkeypatch, caplog):
        caplog.set_level(logging.INFO, "bench.service.processes")
        begun = []
        start = processes._start_process

        def counted(command, log):
            begun.append(command)
            return start(command, log)

        async def skip_pause(pause):
            if len(begun) == 3:
                raise asyncio.CancelledError

        monkeypatch.setattr(processes, "_start_process", counted)
        monkeypatch.setattr(processes.asyncio, "sleep", skip_pause)
        with contextlib.suppress(asyncio.CancelledError):
            command = make_failing_command("no scheduler", 3)
            asyncio.run(processes._keep_alive(command, tmp_path / "worker.log", {}))
        assert len(begun) == 3
        assert (tmp_path / "worker.log").read_text().splitlines() == ["no scheduler"] * 3
        assert [record.status for record in caplog.records if record.message == "worker_ended"] == [3] * 3
