"""Lines of the simulated weighing indicator."""

import math

import pytest

from sim_rig.instruments.ascii_load_cell import AsciiLoadCellDevice


@pytest.mark.parametrize(
    ("unit", "force", "line"),
    [
        ("N", 123.46, b"ST,GS,+00123.5  N\r\n"),
        ("kN", -123.46, b"ST,GS,-00.1235 kN\r\n"),
        ("kg", 9.80665, b"ST,GS,+0001.00 kg\r\n"),
        ("lb", 44.482216, b"US,GS,+0010.00 lb\r\n"),
        ("N", 10000.0, b"US,GS,+10000.0  N\r\n"),
        ("N", 10000.1, b"OL,GS,+-------  N\r\n"),
        ("N", -10000.1, b"OL,GS,+-------  N\r\n"),
        ("N", math.nan, b"OL,GS,+-------  N\r\n"),
    ],
)
def test_reading_is_a_line_in_its_unit(signals, unit, force, line):
    signals.samples["force"] = [(0, force)]
    ((at_ns, text),) = AsciiLoadCellDevice(signals, unit).poll(0)
    assert (at_ns, text[2:]) == (0, line[2:])


@pytest.mark.parametrize(("change", "state"), [(9.9, b"ST"), (-9.9, b"ST"), (10.1, b"US"), (-10.1, b"US")])
def test_reading_moves_if_it_changes_by_a_thousandth_of_full_scale(signals, change, state):
    signals.samples["force"] = [(0, change)]
    assert AsciiLoadCellDevice(signals, "N").poll(0)[0][1][:2] == state


def test_readings_are_a_period_apart(signals):
    signals.now = 50
    device = AsciiLoadCellDevice(signals, "N", rate=20)
    assert [at for at, _ in device.poll(100_000_050)] == [50, 50_000_050, 100_000_050]
    assert device.poll(150_000_049) == []


def test_tare_subtracts_the_present_reading_and_a_stuck_cell_repeats_its_last(signals):
    device = AsciiLoadCellDevice(signals, "N", rate=10)
    signals.samples["force"] = [(0, 100.0), (100_000_000, 70.0), (200_000_000, 500.0)]
    device.poll(0)
    device.press_tare()
    assert device.poll(100_000_000)[0][1] == b"US,NT,-00030.0  N\r\n"
    device.stuck = True
    assert device.poll(200_000_000)[0][1] == b"ST,NT,-00030.0  N\r\n"
    device.press_tare()
    assert device.poll(300_000_000)[0][1] == b"ST,GS,+00070.0  N\r\n"
