"""File of the audit trail: appended by several processes, also when these are killed or the disk is full."""

import errno
import json
import os
import random
import signal
import subprocess
import threading
import time
from itertools import pairwise
from pathlib import Path

import pytest

from bench.audit import AuditChain, AuditWriter, list_newest, read_after, verify_chain
from bench.audit.lines import read_backwards
from bench.errors import AuditError
from tests.support.audit_trails import COMMAND, make_act, write_trail

ROOT = Path(__file__).parents[4]


@pytest.fixture
def path(tmp_path):
    return tmp_path / "audit.jsonl"


def test_entries_follow_each_other_in_the_order_of_their_writing(path):
    chain = write_trail(path, 5)
    lines = [json.loads(line) for line in path.read_text().splitlines()]
    assert [line["seq"] for line in lines] == [1, 2, 3, 4, 5, 6]
    assert lines[0]["action"] == "chain begun"
    assert all(later["prev"] == earlier["sha256"] for earlier, later in pairwise(lines))
    assert (chain.get_head().seq, chain.get_head().sha256) == (6, lines[-1]["sha256"])
    assert path.stat().st_mode & 0o777 == 0o600


def test_lines_are_read_backwards_whatever_their_length(tmp_path):
    lines = [b"a" * size for size in (0, 1, 65535, 65536, 65537, 200_000, 3)]
    file = tmp_path / "lines"
    for end in (b"", b"\n"):
        file.write_bytes(b"\n".join(lines) + end)
        with file.open("rb") as opened:
            found = list(read_backwards(opened.fileno(), file.stat().st_size))
        assert found == ([b""] if end else []) + lines[::-1]


def test_pages_are_read_from_either_end(path):
    write_trail(path, 9)
    assert [one.seq for one in list_newest(path, 3)] == [10, 9, 8]
    assert [one.seq for one in list_newest(path, 3, before=8)] == [7, 6, 5]
    assert [json.loads(line)["seq"] for line in read_after(path, 0, 3)] == [1, 2, 3]
    assert [json.loads(line)["seq"] for line in read_after(path, 8, 3)] == [9, 10]
    assert read_after(path, 10, 3) == []
    assert list_newest(path.with_name("none"), 3) == []


@pytest.mark.parametrize("kept", [1, 40, 100_000])
def test_a_torn_line_is_completed_or_kept_and_reported(path, kept):
    write_trail(path, 3)
    whole = path.read_bytes()
    last = whole.splitlines()[-1]
    torn = last[:kept]
    path.write_bytes(whole[: -len(last) - 1] + torn)
    assert "incomplete" in verify_chain(path).fault
    AuditChain(path).append(make_act(7))
    entries = list_newest(path, 10)
    result = verify_chain(path)
    assert not result.fault
    if torn == last:
        assert (len(entries), result.kept) == (5, 0)
    else:
        assert (entries[1].action, entries[1].old, result.kept) == ("incomplete line kept", torn.decode(), 1)


def test_a_torn_line_of_zeros_and_a_huge_one_are_kept_in_part(path):
    write_trail(path, 2)
    for torn in (bytes(100), b"z" * 300_000):
        with path.open("ab") as file:
            file.write(torn)
        AuditChain(path).append(make_act(1))
        kept = list_newest(path, 2)[1]
        assert kept.old.startswith(torn[:50].decode())
        assert kept.outcome == f"{len(torn)} bytes without an end of the line"
    assert verify_chain(path).kept == 2
    assert not verify_chain(path).fault


def test_kills_lose_no_entry_that_was_acknowledged(path):
    """Two writers are killed again and again; everything that they reported is in the trail."""
    drawn, reported = random.Random(22), {}
    for _ in range(6):
        writers = [
            subprocess.Popen([*COMMAND, path, name], cwd=ROOT, stdout=subprocess.PIPE)
            for name in ("user:a", "user:b")
        ]
        for writer in writers:
            writer.stdout.readline()
        time.sleep(drawn.uniform(0.02, 0.2))
        for writer in writers:
            writer.send_signal(signal.SIGKILL)
            lines = writer.stdout.read().decode().splitlines(keepends=True)
            writer.wait()
            writer.stdout.close()
            reported |= dict(line.split() for line in lines if line.endswith("\n"))
    AuditChain(path).append(make_act(1))
    result = verify_chain(path)
    assert not result.fault, result.fault
    entries = {str(one.seq): one.sha256 for one in list_newest(path, result.entries)}
    assert len(reported) > 20
    assert reported.items() <= entries.items()
    assert {one.actor for one in list_newest(path, result.entries)} >= {"user:a", "user:b"}


def test_threads_write_one_chain(path):
    chains = [AuditChain(path), AuditChain(path)]

    def write(number):
        for _ in range(20):
            chains[number % 2].append(make_act(number))

    threads = [threading.Thread(target=write, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert verify_chain(path)[:1] == (81,)
    assert not verify_chain(path).fault


def test_a_full_disk_leaves_no_part_of_an_entry_and_the_next_attempt_succeeds(path, monkeypatch):
    chain = write_trail(path, 2)
    before = path.read_bytes()
    real, calls = os.pwrite, []

    def write_part(file, content, at):
        calls.append(at)
        if len(calls) > 1:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return real(file, content[:50], at)

    monkeypatch.setattr(os, "pwrite", write_part)
    with pytest.raises(AuditError, match="No space left on device"):
        chain.append(make_act(1))
    assert path.read_bytes() == before
    monkeypatch.undo()
    chain.append(make_act(1))
    assert not verify_chain(path).fault


def test_a_full_disk_leaves_a_torn_line_as_it_is(path, monkeypatch):
    write_trail(path, 2)
    with path.open("ab") as file:
        file.write(b'{"action":"half')
    before = path.read_bytes()

    def refuse(file, content, at):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, "pwrite", refuse)
    with pytest.raises(AuditError, match="No space left on device"):
        AuditChain(path).append(make_act(1))
    assert path.read_bytes() == before


def test_the_writer_keeps_what_the_disk_refuses_and_says_so(path, monkeypatch):
    def refuse(file):
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    with AuditWriter(path) as writer:
        writer.record(make_act(1)).result(5)
        assert writer.find_obstacle() == ""
        monkeypatch.setattr(os, "fsync", refuse)
        waiting = writer.record(make_act(2))
        deadline = time.monotonic() + 5
        while not writer.find_obstacle() and time.monotonic() < deadline:
            time.sleep(0.01)
        assert "Read-only file system" in writer.find_obstacle()
        assert not waiting.done()
        monkeypatch.undo()
        assert waiting.result(5).seq == 3
        assert writer.find_obstacle() == ""
    assert not verify_chain(path).fault


def test_what_no_longer_fits_into_memory_is_counted(path, monkeypatch):
    monkeypatch.setattr("bench.audit.writer.MOST_WAITING", 2)
    writer = AuditWriter(path)
    kept = [writer.record(make_act(number)) for number in range(5)]
    assert [one.done() for one in kept] == [False, False, True, True, True]
    with writer:
        kept[1].result(5)
    entries = list_newest(path, 9)
    assert (entries[0].action, entries[0].new) == ("entries lost", 3)


def test_a_value_that_is_no_json_does_not_end_the_writer(path):
    with AuditWriter(path) as writer:
        writer.record(make_act(1, new={"at": {1, 2}})).result(5)
        assert writer.record(make_act(2, new=float("nan"))).result(5).new == "nan"
    assert not verify_chain(path).fault
