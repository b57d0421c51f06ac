"""Cycle of a segment at a time of the programme."""

import pytest

from bench.methods import compile_method, load_method


@pytest.fixture(scope="module")
def programme():
    return compile_method(load_method("quick"))


def test_cycles_are_counted_from_the_begin_of_their_segment(programme):
    index = programme.segments[-1].index
    segment = programme.segments[index]
    begin, period = float(programme.time[segment.start]), 1 / segment.frequency
    cycles = round((segment.stop - segment.start) / programme.rate * segment.frequency)
    found = [programme.find_cycle(index, begin + k * period) for k in (0.01, 1.5, cycles - 0.5, cycles + 3.0)]
    assert found == [(1, cycles), (2, cycles), (cycles, cycles), (cycles, cycles)]
    assert programme.find_cycle(index, begin - 1.0) == (1, cycles)


def test_there_is_no_cycle_between_segments(programme):
    assert programme.find_cycle(-1, 0.0) is None
