"""Each message on an invalid method leads to the field that is to be changed."""

from copy import deepcopy

import pytest

from bench.errors import MethodError
from bench.methods import compile_method, load_method, parse_method
from tests.support.page_in_browser import node_test, run_module

pytestmark = node_test
RAMP = {"kind": "ramp", "start_m": 0.0, "end_m": 0.01, "corner_acceleration_mps2": 1e-6}
TABLE = {"kind": "table", "time_s": [0, 1], "displacement_m": [0, 0.001]}
LAST = "segments.2.motion"
UNCOUNTED = {"segments.2.cycles": None, "segments.2.duration_s": 8.0}
WIDE_NOISE = {"kind": "random", "spectrum": {"low_hz": 1.0, "high_hz": 9.0, "rms_m": 1e-3}, "seed": 1}
NOISE = {"kind": "random", "spectrum": {"low_hz": 1.0, "high_hz": 1.1, "rms_m": 1e-3}, "seed": 1}
PHASES = {"kind": "steps", "phase_cycles": [0, 0.25], "values": [0, 0.1]}

CASES = [
    ({"rate_hz": -1}, "rate_hz"),
    ({"name": "with space"}, "name"),
    ({"title": ""}, "title"),
    ({"limits.drive": 0.01}, "segments.0.drive.levels"),
    ({"limits.force_n": 0}, "limits.force_n"),
    ({"conditioning.before": {"rest_s": -1}}, "conditioning.before.rest_s"),
    ({"segments": []}, "segments"),
    ({"segments.1.name": "10mm_1Hz"}, ""),
    ({"segments.1.cycles": None}, "segments.1"),
    ({"segments.1.cycles": 1.5}, "segments.1.cycles"),
    ({"segments.1.motion.amplitude_m": -1}, "segments.1.motion.amplitude_m"),
    ({"segments.1.motion.amplitude_m": 0.03}, "segments.1.motion.amplitude_m"),
    ({"segments.1.motion.kind": "square"}, "segments.1.motion"),
    ({"segments.1.motion.frequency_hz": 200}, "rate_hz"),
    ({"segments.1.drive.levels": [0, None]}, "segments.1.drive.levels.1"),
    ({"segments.1.drive.levels": [0, 0.1, 0.2, 0.3]}, "segments.1.cycles"),
    ({"segments.1.centre_m": "x"}, "segments.1.centre_m"),
    ({"segments.2.cycles": None, "segments.2.duration_s": 1.3}, "segments.2.duration_s"),
    ({LAST: RAMP} | UNCOUNTED, "segments.2.motion.corner_acceleration_mps2"),
    ({LAST: RAMP}, "segments.2.cycles"),
    ({"segments.1.shunt": True}, "segments.1.shunt"),
    ({LAST: TABLE}, "segments.2.motion.displacement_m"),
    ({LAST: NOISE} | UNCOUNTED, "segments.2.duration_s"),
    ({LAST: WIDE_NOISE, "segments.2.drive": PHASES} | UNCOUNTED, "segments.2.drive.phase_cycles"),
]  # fmt: skip


def change(changes):
    """Return the method `quick` with values changed at dotted places."""
    document = deepcopy(load_method("quick").model_dump(mode="json", by_alias=True, exclude_defaults=True))
    for place, value in changes.items():
        owner = document
        *steps, last = (int(step) if step.isdigit() else step for step in place.split("."))
        for step in steps:
            owner = owner[step]
        owner[last] = value
    return document


def explain(document):
    with pytest.raises(MethodError) as refusal:
        compile_method(parse_method(document, "the request"))
    return str(refusal.value)


@pytest.fixture(scope="module")
def found():
    """Return the message and the place of each case."""
    questions = [
        {"method": document, "message": explain(document)} for document in (change(case) for case, _ in CASES)
    ]
    answers = run_module("locate_problems.mjs", "plan/method_problems.js", questions)
    return [(question["message"], answer) for question, answer in zip(questions, answers, strict=True)]


@pytest.mark.parametrize("index", range(len(CASES)), ids=[place or "method" for _, place in CASES])
def test_a_message_leads_to_its_field(found, index):
    message, answer = found[index]
    assert ".".join(map(str, answer["path"])) == CASES[index][1], message
    assert answer["text"]
