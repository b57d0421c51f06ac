"""Certificate document: refusals with a reason, gain and its uncertainty."""

import json

import pytest

from bench.calibration import CertificateError, parse_certificate, read_certificate
from tests.support.certificates import make_certificate

RISING = [{"reference": 0, "indicated": 0}, {"reference": 200, "indicated": 200}]
FALLING = [*RISING, {"reference": 100, "indicated": 300}]
REVERSED = [{"reference": 0, "indicated": 0}, {"reference": 200, "indicated": -200}]


def parse(**changes):
    return parse_certificate(make_certificate(**changes), "force.json")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"points": FALLING}, "reference 100 N of point 3 is not above 200 N of point 2"),
        ({"points": REVERSED}, "indicated -200 N of point 2 is not above 0 N of point 1"),
        ({"points": FALLING[:1]}, "points: Tuple should have at least 2 items"),
        ({"date": "2026-03-02", "due": "2026-03-01"}, "due date 2026-03-01 is before the date of calibration"),
        ({"channel": "velocity"}, "channel: Input should be 'displacement', 'force'"),
        ({"uncertainty": {"value": -1, "kind": "absolute", "coverage_factor": 2}}, "uncertainty.value"),
        ({"uncertainty": {"value": 1, "kind": "absolute", "coverage_factor": 0}}, "uncertainty.coverage_factor"),
        ({"unit": "kN"}, "unit 'kN' is not that of channel force; convert points and uncertainty to N"),
        ({"channel": "displacement"}, "convert points and uncertainty to m"),
        ({"due": 1_800_000_000}, "due: give a day as text"),
        ({"due": "20270302"}, "due: '20270302' is not a day"),
        ({"number": "  "}, "number"),
        ({"colour": "red"}, "colour: no such key"),
    ],
)
def test_an_invalid_certificate_is_refused_with_its_reason(changes, words):
    with pytest.raises(CertificateError) as refused:
        parse(**changes)
    assert words in str(refused.value)
    assert str(refused.value).startswith("force.json: ")


def test_the_gain_is_the_slope_of_the_points():
    assert parse().gain_error == pytest.approx(0.003)


def test_an_offset_is_no_gain():
    points = [{"reference": 0, "indicated": 5}, {"reference": 100, "indicated": 105}]
    assert parse(points=points).gain_error == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize(
    ("uncertainty", "expected"),
    [
        ({"value": 0.004, "kind": "relative", "coverage_factor": 2}, 0.002),
        ({"value": 0.004, "kind": "relative", "coverage_factor": 1}, 0.004),
        ({"value": 3.0, "kind": "absolute", "coverage_factor": 2}, 0.0015),
    ],
)
def test_the_uncertainty_of_the_gain_is_a_standard_uncertainty(uncertainty, expected):
    assert parse(uncertainty=uncertainty).gain_uncertainty == pytest.approx(expected)


def test_a_file_is_read(tmp_path):
    path = tmp_path / "force.json"
    path.write_text(json.dumps(make_certificate()))
    assert read_certificate(path) == parse()


def test_a_file_that_cannot_be_read_is_named(tmp_path):
    with pytest.raises(CertificateError, match=r"missing\.json cannot be read"):
        read_certificate(tmp_path / "missing.json")
    (tmp_path / "text.json").write_text("force: 1")
    with pytest.raises(CertificateError, match=r"text\.json is not a JSON file"):
        read_certificate(tmp_path / "text.json")
