"""Processes of the demonstration: the simulated rig, and a service that starts agent and worker."""

import contextlib
import subprocess
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from bench.agent_protocol import AgentClient, ShutDownCommand, StatusCommand, find_agent
from bench.demo.folder import DemoFolder
from bench.errors import AgentUnreachableError, RunError
from bench.processes import MRBENCH_COMMAND, open_privately, terminate

_START_TIMEOUT = 120.0
"""Longest time [s] until a process is ready; the rig compiles code when it is first started."""
_STATUS_TIMEOUT = 2.0
"""Longest time [s] until an agent replies."""
_STOP_TIMEOUT = 30.0
"""Longest time [s] until a process ends by itself."""
_POLL_PERIOD = 0.1
"""Time [s] between two checks."""


@contextlib.contextmanager
def start_processes(folder: DemoFolder, rig_options: Sequence[str] = ()) -> Iterator[str]:
    """Run simulated rig, agent, service and worker while the context lasts.

    Args:
        folder: folder for their files and output.
        rig_options: options of ``mrbench sim`` that choose damper and wires; by default the damper has the
            hidden effect of the folder's seed.

    Yields:
        Address of the page, with the token.

    Raises:
        RunError: a process does not start; the message contains its last output line.
    """
    with contextlib.ExitStack() as stack:
        # The file of an earlier demo contains closed ports. If it cannot be deleted, the rig reports that itself.
        with contextlib.suppress(OSError):
            folder.config.unlink(missing_ok=True)
        hidden_effect = ["--draw", str(folder.seed), "--truth", str(folder.truth)]
        sim = ["sim", "--out", str(folder.config), *(rig_options or hidden_effect)]
        rig = stack.enter_context(_start_process(sim, folder.path / "rig.log"))
        _wait_until_ready(rig, folder.path / "rig.log", folder.config.is_file)
        stack.callback(_shut_down_agent, folder.config)
        # The token of an earlier demo may be known to others.
        serve = ["serve", "--config", str(folder.config), "--data", str(folder.data), "--port", "0", "--new-token"]
        output = folder.path / "service.log"
        service = stack.enter_context(_start_process(serve, output))
        _wait_until_ready(service, output, lambda: " (the token is new" in output.read_text("utf-8"))
        line = next(line for line in output.read_text("utf-8").splitlines() if " (the token is new" in line)
        yield f"{line.split()[0]}#token={(folder.data / 'token').read_text('ascii')}"


@contextlib.contextmanager
def _start_process(arguments: list[str], output: Path) -> Iterator["subprocess.Popen[bytes]"]:
    """Run a command in a separate session: Ctrl-C reaches only the demo, which ends its processes in order."""
    output.unlink(missing_ok=True)
    with open_privately(output) as file:
        process = subprocess.Popen(
            [*MRBENCH_COMMAND, *arguments],
            stdin=subprocess.DEVNULL,
            stdout=file,
            stderr=file,
            start_new_session=True,
        )
    try:
        yield process
    finally:
        terminate(process, _STOP_TIMEOUT)


def _wait_until_ready(process: "subprocess.Popen[bytes]", output: Path, is_ready: Callable[[], bool]) -> None:
    deadline = time.monotonic() + _START_TIMEOUT
    while not is_ready():
        if process.poll() is not None:
            lines = output.read_text("utf-8", errors="replace").strip().splitlines()
            raise RunError(f"a process of the demo ended at once: {lines[-1] if lines else 'without a message'}")
        if time.monotonic() > deadline:
            raise RunError(f"a process of the demo was not ready within {_START_TIMEOUT:g} s; see {output}")
        time.sleep(_POLL_PERIOD)


def _shut_down_agent(config: Path) -> None:
    """Shut down the agent if it is still running: it continues when its service is killed."""
    client = AgentClient(*find_agent(config))
    with contextlib.suppress(AgentUnreachableError):
        client.send(StatusCommand(), _STATUS_TIMEOUT)
        client.send(ShutDownCommand(), _STOP_TIMEOUT)
