"""Supervision of the rig agent: it is started again when it dies, and replaced when its configuration is outdated.

An agent belongs to one ``bench.toml``. One that is busy or tripped is never ended here; a notice says what to do.
"""

import logging
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

from bench.agent_protocol import AgentStatus, Message, Reply, ShutDownCommand, StatusCommand
from bench.config import compute_identity, load_config
from bench.errors import AgentUnreachableError, ConfigError
from bench.service.agent_monitor import AgentLink, PublishedMessage

CHECK_PERIOD: Final = 2.0
"""Time between two checks [s]."""
MAX_RESTART_PAUSE: Final = 30.0
"""Longest pause between two starts of an agent that keeps dying [s]."""
_SILENCE = 5.0
"""Time without a reply after which an agent that was not started here counts as ended [s]."""
_LOG = logging.getLogger(__name__)

StartFunction = Callable[[], "subprocess.Popen[bytes]"]


class SupervisedAgent:
    """Connection to an agent that is kept running; as a context manager, it runs the thread that checks it.

    Args:
        config: ``bench.toml``.
        link: connection to the agent.
        log: file that receives the agent's output.
        start: starts an agent; None if another supervisor does.
        process: the running agent, if this service has started it.
    """

    def __init__(
        self,
        config: Path,
        link: AgentLink,
        log: Path,
        start: StartFunction | None,
        process: "subprocess.Popen[bytes] | None" = None,
    ) -> None:
        self._config, self._link, self._log, self._start = config, link, log, start
        self._process = process
        self.has_started = process is not None
        """True once this service has started an agent."""
        self._agent_section = load_config(config).agent
        self._pause = 1.0
        self._replied_at = self._start_at = time.monotonic()
        self._absence = self._notice = ""
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._check_periodically, name="agent-supervisor", daemon=True)

    def __enter__(self) -> "SupervisedAgent":
        """Start the checks."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """End the checks; the agent continues."""
        self._stopping.set()
        self._thread.join()

    def send(self, command: Message, timeout: float = 5.0) -> Reply:
        """Send one command and wait for its reply, up to a timeout [s].

        Raises:
            AgentUnreachableError: no reply arrived; the message says why the agent ended, if that is known.
        """
        try:
            reply = self._link.send(command, timeout)
        except AgentUnreachableError as error:
            raise AgentUnreachableError(self._absence or str(error)) from error
        return reply.model_copy(update={"status": self._add_notice(reply.status)}) if reply.status else reply

    def subscribe(self, stopping: threading.Event) -> Iterator[PublishedMessage]:
        """Yield the messages that the agent publishes, and None at intervals while it is silent."""
        for message in self._link.subscribe(stopping):
            yield self._add_notice(message) if isinstance(message, AgentStatus) else message

    def check(self, now: float) -> None:
        """Check the agent once, at a monotonic time [s]; start or replace it if needed."""
        try:
            status = self._link.send(StatusCommand(), CHECK_PERIOD).status
        except AgentUnreachableError:
            self._handle_absence(now)
            return
        self._replied_at, self._absence = now, ""
        if now - self._start_at > MAX_RESTART_PAUSE:
            self._pause = 1.0
        self._notice = "" if status is None else self._compare_configuration(status)

    def _check_periodically(self) -> None:
        while not self._stopping.wait(CHECK_PERIOD):
            try:
                self.check(time.monotonic())
            except Exception:  # supervision must not end, whatever a file or a process does
                _LOG.exception("agent_check_failed")

    def _add_notice(self, status: AgentStatus) -> AgentStatus:
        if not self._notice:
            return status
        return status.model_copy(update={"notice": self._notice, "warnings": (*status.warnings, self._notice)})

    def _handle_absence(self, now: float) -> None:
        if self._start is None:
            return
        if self._process is not None and self._process.poll() is None:
            self._absence = f"the rig agent (process {self._process.pid}) does not reply; see {self._log}"
            return
        if self._process is None and now - self._replied_at < _SILENCE:
            return
        self._report_end()
        if now >= self._start_at:
            self._process, self.has_started = self._start(), True
            _LOG.info("agent_started", extra={"pid": self._process.pid, "log": str(self._log)})
            self._start_at = now + self._pause
            self._pause = min(2.0 * self._pause, MAX_RESTART_PAUSE)

    def _report_end(self) -> None:
        """Log the end of an agent once, and keep its reason for the page."""
        if self._process is None and self._absence:
            return
        reason = "it does not reply" if self._process is None else describe_end(self._process, self._log)
        _LOG.warning("agent_ended", extra={"pid": self._process.pid if self._process else None, "why": reason})
        self._absence = f"the rig agent ended: {reason}; it is started again within {MAX_RESTART_PAUSE:g} s"
        self._process = None

    def _compare_configuration(self, status: AgentStatus) -> str:
        """Return what a person has to know of an agent with another configuration; end it if it is idle."""
        try:
            config = load_config(self._config)
        except ConfigError as error:
            return f"{error}; the rig agent keeps its former configuration"
        if compute_identity(config) == status.config_identity:
            return ""
        if config.agent != self._agent_section:
            return f"{self._config} has other addresses of the rig agent; start the service again"
        if status.state == "idle":
            _LOG.info("agent_replaced", extra={"why": f"{self._config} has changed"})
            self._link.send(ShutDownCommand())
            return "the rig agent is replaced, because bench.toml has changed"
        if status.state == "tripped":
            return (
                "bench.toml has changed since the rig agent was started; reset the trip, or end the agent with "
                "`mrbench rig --end --force`; then it is replaced"
            )
        return f"bench.toml has changed, but the rig agent is {status.state}; it is replaced as soon as it is idle"


def describe_end(process: "subprocess.Popen[bytes]", log: Path) -> str:
    """Return why an ended process has ended: its signal, a request, or the last line of its output."""
    if process.returncode < 0:
        return f"killed by {signal.Signals(-process.returncode).name}"
    if process.returncode == 0:
        return "it was asked to end"  # its last line says where it listened
    lines = log.read_text("utf-8", errors="replace").strip().splitlines() if log.is_file() else []
    return lines[-1].removeprefix("mrbench: ") if lines else f"exit status {process.returncode}"
