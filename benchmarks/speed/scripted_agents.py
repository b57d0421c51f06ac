"""Scripted rig agents: they speak the protocol of an agent over its real sockets, without instruments.

python -m benchmarks.speed.scripted_agents FOLDER COUNT

Agent N listens at FOLDER/bN and publishes at FOLDER/bN.samples: 100 samples a second in 25 batches, and four
statuses a second. The value of the channel `force` is the running number of the sample, so that a listener sees
every loss.
"""

import sys
import threading
import time
from contextlib import ExitStack
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

RATE, BATCH = 100.0, 4
"""Samples of each agent [1/s], and samples of a batch [1]."""
STATUS_EVERY = 6
"""Number of batches between two statuses."""
CHANNELS = tuple(
    Channel(name, unit)
    for name, unit in (("force", "N"), ("displacement", "m"), ("velocity", "m/s"), ("coil_drive", "V"))
)
_DESCRIPTION = BenchDescription(
    name="b", specimen="s", drive_kind="coil_v", drive_unit="V", limits={}, channels={}
)


def make_status() -> AgentStatus:
    """Return the status of an idle bench, made now."""
    return AgentStatus(state="idle", utc_s=time.time(), drive_kind="coil_v", drive_unit="V")


def make_batch(number: int, utc_s: float) -> LiveBatch:
    """Return the batch with a running number; its samples are numbered, too."""
    index = np.arange(number * BATCH, (number + 1) * BATCH, dtype=np.float32)
    values = np.stack([index, *(np.zeros_like(index) for _ in CHANNELS[1:])])
    return LiveBatch(number, utc_s, 1 / RATE, CHANNELS, values)


def answer(command: Command) -> Reply:
    """Return the reply of an idle bench."""
    if isinstance(command, AuditCommand):
        return Reply(ok=True, audit=AuditPage(chain="", before="", lines=()))
    if isinstance(command, DescribeCommand):
        return Reply(ok=True, description=_DESCRIPTION)
    return Reply(ok=True, status=make_status())


def publish(publishers: list[Publisher], stopping: threading.Event) -> None:
    """Publish at fixed times until the event is set."""
    begin, period = time.time(), BATCH / RATE
    number = 0
    while not stopping.wait(max(0.0, begin + number * period - time.time())):
        batch = make_batch(number, begin + (number - 1) * period)
        for publisher in publishers:
            publisher.publish(batch)
            if number % STATUS_EVERY == 0:
                publisher.publish(make_status())
        number += 1


def main(folder: Path, count: int) -> None:
    """Play the agents until standard input ends."""
    stopping = threading.Event()
    with ExitStack() as stack:
        servers = [stack.enter_context(CommandServer(f"ipc://{folder}/b{n}")) for n in range(count)]
        publishers = [stack.enter_context(Publisher(f"ipc://{folder}/b{n}.samples")) for n in range(count)]
        threads = [threading.Thread(target=server.serve, args=(answer, stopping)) for server in servers]
        threads.append(threading.Thread(target=publish, args=(publishers, stopping)))
        for thread in threads:
            thread.start()
        print("ready", flush=True)
        sys.stdin.read()
        stopping.set()
        for thread in threads:
            thread.join()


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
