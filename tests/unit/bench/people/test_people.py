"""Roles, passwords, waits after failures, and codes for another device."""

from itertools import pairwise

import pytest

from bench.people import (
    CODE_LIFETIME,
    RIGHTS,
    ROLES,
    AttemptCounter,
    SignInCodes,
    check_password,
    compute_rights,
    find_roles,
    hash_password,
    is_password,
)


class Clock:
    def __init__(self):
        self.now = 1000.0

    def __call__(self):
        return self.now


def test_each_role_has_the_rights_of_those_before_it_and_more():
    for lower, higher in pairwise(ROLES):
        assert compute_rights(lower) < compute_rights(higher)
    assert compute_rights("administrator") == set(RIGHTS)


def test_everybody_may_stop():
    assert all("stop" in compute_rights(role) for role in ROLES)


def test_a_further_right_belongs_to_one_person():
    assert compute_rights("technician", ["reset_trip"]) - compute_rights("technician") == {"reset_trip"}
    assert find_roles("reset_trip") == ("engineer", "administrator")


def test_a_password_is_recognised_and_not_stored():
    stored = hash_password("correct horse battery")
    assert "correct" not in stored
    assert stored.startswith("$argon2id$")
    assert is_password("correct horse battery", stored)
    assert not is_password("correct horse batterz", stored)
    assert not is_password("correct horse battery", None)
    assert not is_password("correct horse battery", "no hash")


@pytest.mark.parametrize(
    ("password", "reason"),
    [
        ("short", "5 characters; give 12 to 200"),
        ("x" * 201, "201 characters"),
        ("abababababab", "fewer than 4 different"),
        ("my name is MCurie!", "contains the name"),
    ],
)
def test_a_weak_password_is_refused_with_a_reason(password, reason):
    with pytest.raises(ValueError, match=reason):
        check_password(password, "mcurie")


def test_failures_in_a_row_cause_waits_that_double_up_to_a_limit():
    clock = Clock()
    attempts = AttemptCounter(clock)
    for _ in range(4):
        attempts.record_failure("a")
        assert attempts.get_wait("a") == 0
    waits = []
    for _ in range(8):
        attempts.record_failure("a")
        waits.append(attempts.get_wait("a"))
        clock.now += waits[-1]
        assert attempts.get_wait("a") == 0
    assert waits == [30, 60, 120, 240, 480, 900, 900, 900]
    assert attempts.get_wait("b") == 0


def test_a_success_ends_the_count():
    attempts = AttemptCounter(Clock())
    for _ in range(4):
        attempts.record_failure("a")
    attempts.record_success("a")
    attempts.record_failure("a")
    assert attempts.get_wait("a") == 0


def test_many_names_do_not_fill_the_memory():
    attempts = AttemptCounter(Clock())
    for number in range(10_050):
        attempts.record_failure(f"name {number}")
    assert len(attempts._failures) == 10_000


def test_a_code_is_used_once_within_its_time():
    clock = Clock()
    codes = SignInCodes(clock)
    made = codes.create("mcurie")
    assert len(made.code) == 8
    assert codes.redeem(f"{made.code[:4]}-{made.code[4:]}") == "mcurie"
    assert codes.redeem(made.code) is None
    late = codes.create("mcurie")
    clock.now += CODE_LIFETIME
    assert codes.redeem(late.code) is None


def test_a_new_code_replaces_that_of_the_same_person_only():
    codes = SignInCodes(Clock())
    first, other, second = codes.create("a"), codes.create("b"), codes.create("a")
    assert codes.redeem(first.code) is None
    assert codes.redeem(other.code) == "b"
    assert codes.redeem(second.code) == "a"
