"""Calibration certificates for tests."""

from datetime import UTC, datetime, timedelta

from bench.calibration import IssuedCertificate, parse_certificate


def make_certificate(channel="force", unit="N", **changes):
    """Return the document of a valid certificate, made last year and due in 100 days."""
    today = datetime.now(UTC).date()
    return {
        "schema": "mrbench.certificate/1",
        "channel": channel,
        "laboratory": "PTB Braunschweig",
        "number": "4711",
        "date": (today - timedelta(days=265)).isoformat(),
        "due": (today + timedelta(days=100)).isoformat(),
        "unit": unit,
        "points": [
            {"reference": -1000.0, "indicated": -1003.0},
            {"reference": 0.0, "indicated": 0.0},
            {"reference": 1000.0, "indicated": 1003.0},
        ],
        "uncertainty": {"value": 0.004, "kind": "relative", "coverage_factor": 2},
        "standard": "dead weights, PTB-2024-17",
        "note": "",
    } | changes


def shift(days):
    """Return a day relative to today as text."""
    return (datetime.now(UTC).date() + timedelta(days=days)).isoformat()


def issue_certificate(channel="force", unit="N", version=1, **changes):
    """Return a stored certificate."""
    document = parse_certificate(make_certificate(channel, unit, **changes), "test")
    return IssuedCertificate(id=f"id-{channel}", version=version, document=document)
