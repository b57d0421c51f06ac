"""Scripted rig agents: they speak the protocol of an agent over its real sockets, without instruments.

python -m benchmarks.speed.scripted_agents FOLDER COUNT RATE

Agent N listens at FOLDER/bN and publishes at FOLDER/bN.samples: RATE samples a second in 25 batches, and four
statuses a second. The channels are those that the page draws, as sines, and `number`, the running number of the
sample, so that a listener sees every loss.
"""

import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

from bench.agent_protocol import (
    AgentStatus,
    AuditCommand,
    AuditPage,
    BenchDescription,
    Command,
    CommandServer,
    DescribeCommand,
    Publisher,
    Reply,
)
from bench.live import Channel, LiveBatch

BATCH_RATE = 25
"""Batches of each agent [1/s]."""
STATUS_EVERY = 6
"""Number of batches between two statuses."""
FREQUENCY = 2.0
"""Frequency of the sines [Hz]."""
_AMPLITUDES = {
    Channel("force", "N"): 800.0,
    Channel("displacement", "m"): 10e-3,
    Channel("velocity", "m/s"): 126e-3,
    Channel("coil_drive", "V"): 1.0,
    Channel("coil_current", "A"): 0.5,
    Channel("temperature", "degC"): 3.0,
}
CHANNELS = (*_AMPLITUDES, Channel("number", "1"))
_DESCRIPTION = BenchDescription(
    name="b", specimen="s", drive_kind="coil_v", drive_unit="V", limits={}, channels={}
)


def make_status() -> AgentStatus:
    """Return the status of an idle bench, made now."""
    return AgentStatus(state="idle", utc_s=time.time(), drive_kind="coil_v", drive_unit="V")


def make_batch(number: int, utc_s: float, rate: int) -> LiveBatch:
    """Return the batch with a running number; its samples are numbered, too."""
    count = rate // BATCH_RATE
    index = np.arange(number * count, (number + 1) * count, dtype=np.float32)
    sine = np.sin(2 * np.pi * FREQUENCY * index / rate)
    values = np.stack([*(amplitude * sine for amplitude in _AMPLITUDES.values()), index])
    return LiveBatch(number, utc_s, 1 / rate, CHANNELS, values.astype(np.float32))


def answer(command: Command) -> Reply:
    """Return the reply of an idle bench."""
    if isinstance(command, AuditCommand):
        return Reply(ok=True, audit=AuditPage(chain="", before="", lines=()))
    if isinstance(command, DescribeCommand):
        return Reply(ok=True, description=_DESCRIPTION)
    return Reply(ok=True, status=make_status())


def publish(publishers: list[Publisher], rate: int, stopping: threading.Event) -> None:
    """Publish at fixed times until the event is set."""
    begin, period = time.time(), 1 / BATCH_RATE
    number = 0
    while not stopping.wait(max(0.0, begin + number * period - time.time())):
        batch = make_batch(number, begin + (number - 1) * period, rate)
        for publisher in publishers:
            publisher.publish(batch)
            if number % STATUS_EVERY == 0:
                publisher.publish(make_status())
        number += 1


def main(folder: Path, count: int, rate: int) -> None:
    """Play the agents until standard input ends."""
    stopping = threading.Event()
    with ExitStack() as stack:
        servers = [stack.enter_context(CommandServer(f"ipc://{folder}/b{n}")) for n in range(count)]
        publishers = [stack.enter_context(Publisher(f"ipc://{folder}/b{n}.samples")) for n in range(count)]
        threads = [threading.Thread(target=server.serve, args=(answer, stopping)) for server in servers]
        threads.append(threading.Thread(target=publish, args=(publishers, rate, stopping)))
        for thread in threads:
            thread.start()
        print("ready", flush=True)
        sys.stdin.read()
        stopping.set()
        for thread in threads:
            thread.join()


@contextmanager
def play_agents(folder: Path, count: int, rate: int) -> Iterator[None]:
    """Play agents in a process of their own."""
    command = [sys.executable, "-m", "benchmarks.speed.scripted_agents", str(folder), str(count), str(rate)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    try:
        assert process.stdout is not None
        process.stdout.readline()
        yield
    finally:
        process.communicate()


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
