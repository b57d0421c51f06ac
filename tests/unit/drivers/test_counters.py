from typing import NamedTuple

from hypothesis import given
from hypothesis import strategies as st

from drivers.counters import compute_step, split_at_gaps

PERIOD = 2**32


class Sample(NamedTuple):
    number: int
    key: str = ""


@given(st.integers(0, 10 * PERIOD), st.integers(-PERIOD // 2, PERIOD // 2 - 1))
def test_the_step_of_a_wrapped_counter_is_found(last, step):
    assert compute_step((last + step) % PERIOD, last, PERIOD) == step


def test_half_a_period_counts_as_backwards():
    assert compute_step(PERIOD // 2, 0, PERIOD) == -PERIOD // 2


def test_samples_are_split_at_gaps_and_where_the_key_changes():
    samples = [Sample(1), Sample(2), Sample(4), Sample(5, "bad"), Sample(6)]
    stretches = split_at_gaps(samples, lambda sample: sample.key)
    assert [[sample.number for sample in stretch] for stretch in stretches] == [[1, 2], [4], [5], [6]]


def test_without_samples_there_is_no_stretch():
    assert list(split_at_gaps([])) == []
