"""The processes of the demo: the simulated rig, and a service that starts agent and worker itself."""

import contextlib
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from bench.agent.link import AgentClient
from bench.agent.messages import ShutDownCommand, StatusCommand
from bench.child_process import MRBENCH, end
from bench.demo.folder import DemoFolder
from bench.errors import AgentUnreachable, RunError
from bench.rig.config import load_config

_UP_WITHIN = 120.0
"""[s] for a process to be ready; the rig compiles at its first start."""
_THERE_WITHIN = 2.0
"""[s] for an agent to say that it is there."""
_DOWN_WITHIN = 30.0
"""[s] for a process to end in good order."""
_LOOK = 0.1
"""[s] between two looks."""


@contextlib.contextmanager
def processes(folder: DemoFolder) -> Iterator[str]:
    """Simulated rig, agent, service and worker, as long as the context lasts.

    Args:
        folder: where they leave their files and their words.

    Yields:
        The page's address, token included.

    Raises:
        RunError: one of them does not come up; its last words are in the message.
    """
    with contextlib.ExitStack() as running:
        with contextlib.suppress(OSError):  # where it stays, the rig says that it cannot write there
            folder.rig.unlink(missing_ok=True)  # an earlier demo's would lead the agent to ports that are closed
        rig = running.enter_context(_process(["sim", "--out", str(folder.rig)], folder.path / "rig.log"))
        _await(rig, folder.path / "rig.log", folder.rig.is_file)
        _configure(folder)
        running.callback(_end_agent, folder.config)
        # The demo talks to the service as the page does; a token of an earlier demo cannot be had any more.
        words = ["serve", "--config", str(folder.config), "--data", str(folder.data), "--port", "0", "--new-token"]
        said = folder.path / "service.log"
        service = running.enter_context(_process(words, said))
        _await(service, said, lambda: "#token=" in said.read_text("utf-8"))
        yield next(line for line in said.read_text("utf-8").splitlines() if "#token=" in line)


def _configure(folder: DemoFolder) -> None:
    """The rig's configuration, with free ports for the agent: another agent may hold the usual ones."""
    commands, samples = _free_ports(2)
    agent = f'\n[agent]\ncommands = "tcp://127.0.0.1:{commands}"\nsamples = "tcp://127.0.0.1:{samples}"\n'
    folder.config.write_text(folder.rig.read_text("utf-8") + agent, "utf-8")


def _free_ports(count: int) -> list[int]:
    # Held at the same time: a port that was let go may be given out again at once.
    with contextlib.ExitStack() as held:
        sockets = [held.enter_context(socket.create_server(("127.0.0.1", 0))) for _ in range(count)]
        return [one.getsockname()[1] for one in sockets]


@contextlib.contextmanager
def _process(words: list[str], said: Path) -> Iterator["subprocess.Popen[bytes]"]:
    """A command in a session of its own: Ctrl-C is for the demo, which ends its processes in their order."""
    with said.open("wb") as out:
        process = subprocess.Popen(
            [*MRBENCH, *words], stdin=subprocess.DEVNULL, stdout=out, stderr=out, start_new_session=True
        )
    try:
        yield process
    finally:
        end(process, _DOWN_WITHIN)


def _await(process: "subprocess.Popen[bytes]", said: Path, ready: Callable[[], bool]) -> None:
    deadline = time.monotonic() + _UP_WITHIN
    while not ready():
        if process.poll() is not None:
            lines = said.read_text("utf-8", errors="replace").strip().splitlines()
            raise RunError(f"a process of the demo ended at once: {lines[-1] if lines else 'without a word'}")
        if time.monotonic() > deadline:
            raise RunError(f"a process of the demo was not ready within {_UP_WITHIN:g} s; see {said}")
        time.sleep(_LOOK)


def _end_agent(config: Path) -> None:
    """End the agent, which outlives a service that was killed; one that ended in good order has ended it."""
    agent = load_config(config).agent
    client = AgentClient(agent.commands, agent.samples)
    with contextlib.suppress(AgentUnreachable):
        client.send(StatusCommand(), _THERE_WITHIN)
        client.send(ShutDownCommand(), _DOWN_WITHIN)
