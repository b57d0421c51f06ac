"""Output of the coil amplifier over time."""

import pytest

from sim_rig.instruments.coil_output import CoilOutput, TableState

SECOND = 1_000_000_000


@pytest.mark.parametrize(("target", "levels"), [(4.0, (0, 1, 3, 4, 4)), (-4.0, (0, -1, -3, -4, -4))])
def test_output_ramps_to_its_target_at_its_slope(target, levels):
    output = CoilOutput(ramp=2.0)
    output.set_target(target, 5 * SECOND)
    times = (5.0, 5.5, 6.5, 7.0, 9.0)
    assert [output.compute_level(int(time * SECOND)) for time in times] == pytest.approx(levels)


def test_new_target_begins_at_the_present_level():
    output = CoilOutput(ramp=2.0)
    output.set_target(4.0, 0)
    output.set_target(-1.0, SECOND)
    assert output.compute_level(2 * SECOND) == pytest.approx(0.0)
    output.set_zero(2 * SECOND)
    assert (output.compute_level(2 * SECOND), output.target) == (0.0, 0.0)


def test_table_steps_at_its_instants_and_ends_at_its_last_level():
    output = CoilOutput(ramp=1.0)
    output.set_target(0.5, 0)
    output.arm([(10, 1.0), (20, 2.0), (30, 3.0)])
    output.trigger(SECOND)
    levels = [output.compute_level(SECOND + after) for after in (0, 9, 10, 19, 20, 29)]
    assert levels == [0.5, 0.5, 1.0, 1.0, 2.0, 2.0]
    assert output.table is TableState.RUNNING
    assert output.compute_level(SECOND + 30) == 3.0
    assert (output.table, output.target, output.started_ns) == (TableState.DONE, 3.0, SECOND)


def test_aborted_table_keeps_its_level_and_an_unarmed_one_does_not_start():
    output = CoilOutput(ramp=1.0)
    output.trigger(0)
    assert output.table is TableState.IDLE
    output.arm([(10, 1.0), (20, 2.0)])
    output.trigger(100)
    output.abort(115)
    assert (output.table, output.target, output.compute_level(10 * SECOND)) == (TableState.IDLE, 1.0, 1.0)
