"""Verification of the audit trail: every alteration is found, and an untouched trail is not accused."""

import json
import random

import pytest

from bench.audit import AuditChain, Head, Source, compare_imports, parse_head, verify_chain
from bench.audit.entry import compute_sha256, encode_canonically
from bench.errors import AuditError
from tests.support.audit_trails import list_all, make_act, write_trail

FIELDS = (
    "seq",
    "utc",
    "actor",
    "origin",
    "action",
    "target",
    "old",
    "new",
    "outcome",
    "prev",
    "sha256",
    "request",
)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "audit.jsonl"


def flip_bit(lines, drawn):
    number = drawn.randrange(len(lines))
    line = bytearray(lines[number])
    line[drawn.randrange(len(line))] ^= 1 << drawn.randrange(8)
    lines[number] = bytes(line)


def change_field(lines, drawn):
    """Change one field, with its own hash made right again, as somebody who knows the format would."""
    number = drawn.randrange(len(lines) - 1)
    entry = json.loads(lines[number])
    name = drawn.choice(FIELDS)
    entry[name] = entry[name] + 1 if name == "seq" else f"{drawn.random()}"
    if name != "sha256":
        entry["sha256"] = compute_sha256(entry)
    lines[number] = encode_canonically(entry) + b"\n"


def delete(lines, drawn):
    del lines[drawn.randrange(len(lines) - 1)]


def duplicate(lines, drawn):
    number = drawn.randrange(len(lines))
    lines.insert(drawn.randrange(len(lines) + 1), lines[number])


def exchange(lines, drawn):
    one, other = drawn.sample(range(len(lines)), 2)
    lines[one], lines[other] = lines[other], lines[one]


def insert(lines, drawn):
    number = drawn.randrange(len(lines))
    entry = json.loads(lines[number]) | {"actor": "user:mallory"}
    entry["sha256"] = compute_sha256(entry)
    lines.insert(number + drawn.randrange(2), encode_canonically(entry) + b"\n")


def reformat(lines, drawn):
    number = drawn.randrange(len(lines))
    lines[number] = json.dumps(json.loads(lines[number])).encode() + b"\n"


def blank(lines, drawn):
    lines.insert(drawn.randrange(len(lines) + 1), b"\n")


ALTERATIONS = (flip_bit, change_field, delete, duplicate, exchange, insert, reformat, blank)


@pytest.mark.parametrize("alter", ALTERATIONS)
def test_a_hundred_of_a_hundred_alterations_are_found(path, alter):
    write_trail(path, 12)
    untouched = path.read_bytes()
    assert not verify_chain(path).fault
    missed = []
    for seed in range(100):
        lines = untouched.splitlines(keepends=True)
        alter(lines, random.Random(seed))
        path.write_bytes(b"".join(lines))
        if not verify_chain(path).fault:
            missed.append(seed)
    assert missed == []


def test_the_first_bad_entry_is_named_with_its_reason(path):
    write_trail(path, 6)
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join([*lines[:3], lines[3].replace(b"user:u2", b"user:u9"), *lines[4:]]))
    result = verify_chain(path)
    assert result.entries == 3
    assert result.fault == "line 4: its content does not have its hash; it was altered (seq 4)"
    path.write_bytes(b"".join(lines[:3] + lines[4:]))
    assert "entry 4 belongs here; entries were removed, inserted or exchanged" in verify_chain(path).fault


def test_a_cut_end_is_found_by_a_head_exported_earlier(path):
    chain = write_trail(path, 12)
    head, lines = chain.get_head(), path.read_bytes().splitlines(keepends=True)
    for kept in range(len(lines)):
        path.write_bytes(b"".join(lines[:kept]))
        assert not verify_chain(path).fault
        assert f"the end is missing: {13 - kept} entries, from {kept + 1} to 13" in verify_chain(path, head).fault
    chain.append(make_act(1))  # the writer goes on after the cut, which hides nothing
    assert verify_chain(path, head).fault


def test_rewritten_entries_with_new_hashes_are_found_by_the_head(path):
    chain = write_trail(path, 12)
    head = chain.get_head()
    other = path.with_name("other")
    for entry in list_all(path)[1:]:
        changed = entry.model_copy(update={"actor": "user:other"} if entry.seq == 5 else {})
        AuditChain(other).append(make_act(1, **changed.model_dump(include={"actor", "utc", "target"})))
    assert not verify_chain(other).fault
    assert "it is not the entry of the head exported earlier" in verify_chain(other, head).fault


def test_later_entries_do_not_disturb_an_earlier_head(path):
    chain = write_trail(path, 3)
    head = chain.get_head()
    chain.append(make_act(4))
    assert not verify_chain(path, head).fault
    assert verify_chain(path, head).entries == 5


def test_a_head_is_read_from_text():
    head = Head(12, "ab" * 32)
    assert parse_head(f'{{"head": "{head}"}}') == head
    assert parse_head(f"5:{'cd' * 32}\nhead,{head}\n") == head
    with pytest.raises(AuditError, match="give SEQ:SHA256"):
        parse_head("12")


def test_nothing_readable_is_an_error(path):
    with pytest.raises(AuditError, match="cannot be read"):
        verify_chain(path)


def import_entries(own, entries):
    chain = AuditChain(own)
    identity = str(entries[0].new)
    for entry in entries:
        source = Source(chain=identity, seq=entry.seq, prev=entry.prev, sha256=entry.sha256)
        copied = entry.model_dump(exclude={"seq", "prev", "sha256", "source"})
        chain.append(make_act(1, **copied, source=source))


def test_imported_entries_are_verified_within_their_own_chain(path, tmp_path):
    other = tmp_path / "agent.jsonl"
    write_trail(other, 6)
    entries = list_all(other)
    import_entries(path, entries)
    result = verify_chain(path)
    assert (result.fault, len(result.imported)) == ("", 7)
    assert compare_imports(result, other) == ""
    left_out = tmp_path / "left-out.jsonl"
    import_entries(left_out, [*entries[:3], *entries[4:]])
    assert "entry 5 of the rig agent does not follow its entry 3" in verify_chain(left_out).fault
    forged = tmp_path / "forged.jsonl"
    import_entries(forged, [*entries[:3], entries[3].model_copy(update={"actor": "user:other"})])
    assert "its content is not that of entry 4 of the rig agent" in verify_chain(forged).fault


def test_a_cut_or_rewritten_trail_of_the_agent_differs_from_what_was_imported(path, tmp_path):
    other = tmp_path / "agent.jsonl"
    write_trail(other, 6)
    import_entries(path, list_all(other))
    lines = other.read_bytes().splitlines(keepends=True)
    other.write_bytes(b"".join(lines[:5]))
    assert "entry 6 of the rig agent was imported, but is missing there" in compare_imports(
        verify_chain(path), other
    )
    AuditChain(other).append(make_act(77))
    assert "entry 6 of the rig agent was imported, but is another one there" in compare_imports(
        verify_chain(path), other
    )
