"""Checkpoints of methods, and what remains of a method after one."""

import pytest

from bench.errors import RunError
from bench.methods import (
    Method,
    compile_method,
    list_checkpoints,
    list_shipped_methods,
    load_method,
    make_remaining_method,
)
from tests.support.methods import constant, method_document, sine

STAIRCASE = {"kind": "staircase", "levels": [0.1, 0.3]}
WARM_UP = {
    "motion": {"kind": "sine", "amplitude_m": 0.005, "frequency_hz": 2.0},
    "cycles": 2,
    "drive": constant(0.1),
}


def make_method(conditioning=None):
    first, last = (sine(name, 0.01, 2.0, STAIRCASE, cycles=4) for name in ("a", "c"))
    segments = [first, sine("b", 0.005, 4.0, constant(0.4)), last]
    document = method_document(*segments)
    return Method.model_validate({**document, "conditioning": conditioning or {}})


@pytest.mark.parametrize("name", list_shipped_methods())
def test_every_shipped_method_has_a_checkpoint_and_can_be_resumed_after_each(name):
    method = load_method(name)
    checkpoints = list_checkpoints(compile_method(method))
    assert checkpoints
    for checkpoint in checkpoints:
        remaining = compile_method(make_remaining_method(method, checkpoint))
        names = [segment.name for segment in compile_method(method).segments]
        assert [segment.name for segment in remaining.segments] == names[names.index(checkpoint) + 1 :]


@pytest.mark.parametrize("name", ["a_0.3V", "a"])
def test_a_checkpoint_has_the_name_of_the_log_or_of_the_method(name):
    assert [segment.name for segment in make_remaining_method(make_method(), name).segments] == ["b", "c"]


def test_the_last_segment_is_no_checkpoint():
    assert list_checkpoints(compile_method(make_method())) == ("a_0.3V", "b")
    with pytest.raises(RunError, match=r"no segment after c_0\.3V; the run was complete"):
        make_remaining_method(make_method(), "c_0.3V")
    with pytest.raises(RunError, match=r"no checkpoint after d; its checkpoints: a_0\.3V, b, c_0\.3V"):
        make_remaining_method(make_method(), "d")


@pytest.mark.parametrize(
    ("conditioning", "cycles", "rest"),
    [
        ({"before": {"warm_up": WARM_UP, "rest_s": 3.0}, "between": {"rest_s": 1.0}}, 2, 3.0),
        ({"before": {"rest_s": 3.0}, "between": {"warm_up": WARM_UP, "rest_s": 1.0}}, 2, 1.0),
        ({"before": {"rest_s": 3.0}}, None, 3.0),
        ({}, None, None),
    ],
)
def test_a_resumed_run_begins_with_the_warm_up_that_the_method_asks_for(conditioning, cycles, rest):
    stage = make_remaining_method(make_method(conditioning), "b").conditioning.before
    assert (stage and stage.warm_up and stage.warm_up.cycles, stage and stage.rest_s) == (cycles, rest)
