"""Audit trails for tests: small ones, and a process that appends until it is killed."""

import sys
import time
from pathlib import Path

from bench.audit import Act, AuditChain, list_newest

COMMAND = (sys.executable, "-m", "tests.support.audit_trails")


def make_act(number=1, **changes):
    given = {"actor": f"user:u{number % 3}", "action": "PATCH /specimens/{serial}", "target": f"d{number}"}
    return Act(
        **{**given, "old": {"n": number}, "new": {"n": number + 1, "text": "über"}, "outcome": "200", **changes}
    )


def write_trail(path, count=12):
    """Write a trail of `count` entries after its first one, and return the chain."""
    chain = AuditChain(path)
    for number in range(count):
        chain.append(make_act(number))
    return chain


def list_all(path):
    """Return all entries, the oldest first."""
    return list_newest(path, 10_000)[::-1]


def list_requests(service):
    """Return the entries of requests to a service, the oldest first."""
    return [one for one in list_all(service.data / "audit.jsonl") if " /" in one.action]


def find_last_request(service):
    return list_requests(service)[-1]


def wait_for(condition):
    """Return what a condition returns as soon as it holds."""
    deadline = time.monotonic() + 10
    while not (found := condition()):
        assert time.monotonic() < deadline
        time.sleep(0.01)
    return found


def main(path, name):
    """Append entries, and print the number of each one that is on the disk."""
    chain = AuditChain(Path(path))
    number = 0
    while True:
        number += 1
        entry = chain.append(make_act(number, actor=name, new="x" * 300))[0]
        print(entry.seq, entry.sha256, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
