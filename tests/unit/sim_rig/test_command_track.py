import numpy as np
import pytest

from sim_rig.command_track import HeldTrack, JoinedTrack


def test_a_held_command_stands_until_the_next():
    track = HeldTrack(0.1)
    track.add(20, 0.2)
    track.add(30, 0.3)
    assert track.at(np.array([0, 19, 20, 29])).tolist() == [0.1, 0.1, 0.2, 0.2]
    assert track.at(np.array([30, 31])).tolist() == [0.3, 0.3]


def test_of_two_commands_of_one_instant_the_later_stands():
    track, joined = HeldTrack(0.0), JoinedTrack(0.0, 10)
    for value in (1.0, 2.0):
        track.add(5, value)
        joined.add(5, value)
    assert track.at(np.array([5])).tolist() == [2.0]
    assert joined.at(np.array([15])).tolist() == [2.0]


def test_frequent_commands_are_joined_by_straight_lines_and_come_later_by_the_take_up():
    track = JoinedTrack(0.0, 10)
    for at in range(0, 100, 4):
        track.add(at, 3.0 * at)
    assert track.at(np.arange(10, 100)) == pytest.approx(3.0 * np.arange(0, 90))


def test_a_single_command_is_not_followed_before_it_came():
    track = JoinedTrack(1.0, 10)
    track.add(100, 2.0)
    assert track.at(np.array([0, 99, 100, 105, 110, 500])).tolist() == [1.0, 1.0, 1.0, 1.5, 2.0, 2.0]


def test_a_way_commanded_beforehand_is_followed_however_far_apart_its_points_are():
    track = JoinedTrack(0.0, 10)
    for at in range(0, 300, 60):
        track.add(at + 60, 3.0 * (at + 60), since_ns=at)
    assert track.at(np.arange(10, 310)) == pytest.approx(3.0 * np.arange(300))


def test_a_way_commanded_beforehand_is_taken_back_by_a_command_for_an_earlier_instant():
    track = JoinedTrack(0.0, 10)
    track.add(60, 60.0, since_ns=0)
    track.add(120, 120.0, since_ns=60)
    track.add(70, 5.0)
    assert track.at(np.array([70, 80, 200])).tolist() == pytest.approx([60.0, 5.0, 5.0])


def test_a_command_that_comes_too_late_is_followed_from_where_the_plant_is():
    track = JoinedTrack(0.0, 10)
    track.add(100, 1.0)
    assert track.at(np.array([150])).tolist() == [1.0]
    track.add(105, 2.0)
    assert track.at(np.array([150, 151])).tolist() == [2.0, 2.0]


def test_tracks_forget_what_lies_behind():
    held, joined = HeldTrack(0.0), JoinedTrack(0.0, 2)
    for at in range(1000):
        held.add(at, at)
        joined.add(at, at)
        held.at(np.array([at]))
        joined.at(np.array([at]))
    assert len(held._points) == 1
    assert len(joined._vertices) < 5
