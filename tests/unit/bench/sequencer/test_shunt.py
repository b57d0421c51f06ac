"""Shunt of the load cell: checks before a run, and off at every end of a section."""

import pytest

from bench.errors import RunError
from bench.safety import Action
from bench.sequencer.playback import PlaybackSection
from bench.sequencer.shunt import MARGIN, check_shunt, use_shunt
from drivers.errors import NoReplyError, RefusedError
from tests.support.fake_rig import FakeLoadCell
from tests.support.methods import hold, programme

REST = programme(hold("a", 0.2))
SHUNT = programme(hold("a", 0.2), hold("b", 0.3, shunt=True))
LIMITS = {"force": {Action.INDICATE: 500.0, Action.CONTROLLED_STOP: 1500.0}}


def section(number):
    """Return the section of one of both segments."""
    return PlaybackSection(SHUNT, *((0, 200), (200, 500))[number])


def test_method_without_the_shunt_needs_none():
    cell = FakeLoadCell(refusal=RefusedError("cell: no shunt"))
    check_shunt(REST, cell, LIMITS)
    with use_shunt(None, section(0)):
        assert cell.calls == []


def test_check_leaves_the_shunt_off():
    cell = FakeLoadCell()
    check_shunt(SHUNT, cell, LIMITS)
    assert cell.calls == ["shunt off"]


@pytest.mark.parametrize(
    ("cell", "limits", "message"),
    [
        (
            FakeLoadCell(refusal=RefusedError("cell: no shunt")),
            LIMITS,
            "segment b: .* be switched: cell: no shunt",
        ),
        (
            FakeLoadCell(force=-1600.0),
            LIMITS,
            "too much: force -1600 N exceeds the limit of 1500 N; raise the limit",
        ),
        (FakeLoadCell(), {"force": {Action.HOLD: 999.0}}, "force 1000 N exceeds the limit of 999 N"),
    ],
)
def test_shunt_that_the_bench_cannot_use_is_refused(cell, limits, message):
    with pytest.raises(RunError, match=message):
        check_shunt(SHUNT, cell, limits)


@pytest.mark.parametrize(("cell", "limits"), [(FakeLoadCell(force=None), LIMITS), (FakeLoadCell(force=9e3), {})])
def test_force_or_limit_that_is_not_known_is_no_reason_to_refuse(cell, limits):
    check_shunt(SHUNT, cell, limits)
    assert cell.is_on is False


def test_segment_that_is_longer_than_the_shunt_may_be_on_is_refused():
    cell = FakeLoadCell()
    check_shunt(programme(hold("b", 55.0, shunt=True)), cell, LIMITS)
    with pytest.raises(RunError, match=r"needed for 55\.5 s, but cell allows 55 s, with 5 s in reserve; shorten"):
        check_shunt(programme(hold("b", 55.5, shunt=True)), cell, LIMITS)


def test_shunt_is_on_within_its_section_for_a_bounded_time():
    cell = FakeLoadCell()
    with use_shunt(cell, section(1)):
        assert cell.is_on
    assert cell.calls == ["shunt on", "shunt off"]
    assert cell.durations == [pytest.approx(0.3 + MARGIN)]


def test_shunt_is_off_after_an_error_which_is_reported():
    cell = FakeLoadCell()
    with pytest.raises(ZeroDivisionError), use_shunt(cell, section(1)):
        raise ZeroDivisionError
    assert not cell.is_on


def test_failed_command_is_followed_by_the_command_to_switch_off():
    cell = FakeLoadCell(refusal=NoReplyError("cell: shunt received no reply"))
    with pytest.raises(NoReplyError, match="no reply"), use_shunt(cell, section(1)):
        pytest.fail("the section was played")
    assert cell.calls == ["shunt on", "shunt off"]


def test_first_error_is_reported_if_the_shunt_does_not_answer_either():
    cell = FakeLoadCell(late_refusal=NoReplyError("cell: no reply"))
    with pytest.raises(ZeroDivisionError), use_shunt(cell, section(1)):
        raise ZeroDivisionError
    cell = FakeLoadCell(late_refusal=NoReplyError("cell: no reply"))
    with pytest.raises(NoReplyError), use_shunt(cell, section(1)):
        pass


def test_section_with_the_shunt_needs_a_load_cell():
    message = "test_method needs a shunt, but no load cell can switch one"
    with pytest.raises(RunError, match=message), use_shunt(None, section(1)):
        pytest.fail("the section was played")
