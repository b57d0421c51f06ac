"""Validity on a day, the certificate that applies, and the words on it."""

from datetime import date

import pytest

from bench.calibration import (
    IssuedCertificate,
    choose_current,
    describe_due,
    find_state,
    list_overdue,
    make_log_text,
    parse_certificate,
    read_entry,
)
from tests.support.certificates import make_certificate

DUE = date(2026, 3, 20)


def issue(name="a", version=1, **changes):
    document = make_certificate(**{"date": "2025-03-20", "due": DUE.isoformat(), **changes})
    return IssuedCertificate(id=name, version=version, document=parse_certificate(document, "test"))


@pytest.mark.parametrize(
    ("day", "state", "words"),
    [
        (date(2025, 3, 19), "not_yet_valid", ""),
        (date(2025, 3, 20), "valid", ""),
        (date(2026, 3, 5), "valid", ""),
        (
            date(2026, 3, 6),
            "due_soon",
            "force: calibration due on 2026-03-20, in 14 days (certificate 4711 of PTB",
        ),
        (date(2026, 3, 19), "due_soon", "in 1 day (certificate"),
        (date(2026, 3, 20), "due_soon", "due on 2026-03-20, today"),
        (date(2026, 3, 21), "overdue", "force: calibration overdue since 2026-03-20 (certificate 4711 of PTB"),
    ],
)
def test_state_and_words_on_a_day(day, state, words):
    certificate = issue().document
    assert find_state(certificate, day) == state
    assert words in describe_due(certificate, day)
    assert bool(describe_due(certificate, day)) == bool(words)


def test_the_newest_calibration_that_has_begun_applies():
    old, new, later = issue("old", date="2024-01-01"), issue("new"), issue("later", date="2026-01-01")
    coil = issue("coil", channel="coil_current", unit="A")
    assert choose_current([later, new, old, coil], date(2025, 6, 1)) == {"force": new, "coil_current": coil}


def test_nothing_applies_before_the_first_calibration():
    assert choose_current([issue()], date(2025, 1, 1)) == {}


def test_the_log_names_certificate_uncertainty_and_mark():
    text = make_log_text(issue(version=3), date(2026, 4, 1), "2.5 kN cell")
    entry = read_entry(text)
    assert (entry["certificate"], entry["version"], entry["state"], entry["due"]) == (
        "a",
        3,
        "overdue",
        "2026-03-20",
    )
    assert entry["gain_standard_uncertainty"] == pytest.approx(0.002)
    assert entry["note"] == "2.5 kN cell"
    record = {"force": text, "coil_drive": text, "displacement": "none given", "temperature": "12"}
    assert list_overdue(record) == [
        "force: calibration overdue since 2026-03-20 (certificate 4711 of PTB Braunschweig)"
    ]


def test_a_valid_channel_has_no_mark():
    assert list_overdue({"force": make_log_text(issue(), date(2026, 3, 20), "")}) == []
