"""Mountings: which steps separate the runs of a specimen."""

import pytest

from bench.campaign_report.mountings import number_mountings
from bench.commands.campaign.catalogue import open_store
from tests.support.campaign_reports import prompt_step, run_step, store_campaign

RUN, OTHER = run_step(), run_step("MR-2")
REST = {"rest": {"seconds": 60}}


@pytest.mark.parametrize(
    ("steps", "states", "numbers"),
    [
        ([RUN, RUN, REST, RUN], {}, [1, 1, 1]),
        ([RUN, prompt_step(), RUN, RUN], {}, [1, 2, 2]),
        ([RUN, prompt_step("MOUNT it again"), RUN], {}, [1, 2]),
        ([RUN, prompt_step("Check the oil"), RUN], {}, [1, 1]),
        ([RUN, prompt_step(), RUN], {1: ("skipped", "deleted")}, [1, 1]),
        ([RUN, {"setup": {"step": "tare"}}, RUN, {"setup": {"step": "mount"}}, RUN], {}, [1, 1, 2]),
        ([RUN, {"setup": {"step": "mount"}}, RUN], {1: ("failed", "no reference")}, [1, 1]),
        ([prompt_step(), RUN, prompt_step(), prompt_step(), RUN], {}, [1, 2]),
        ([RUN, OTHER, RUN, RUN, OTHER], {}, [1, 1, 2, 2, 2]),
    ],
)
def test_a_change_of_the_specimen_or_an_answered_prompt_begins_a_mounting(tmp_path, steps, states, numbers):
    with open_store(tmp_path, is_created=True) as store:
        state = store_campaign(store, steps, [], states).state
    assert list(number_mountings(state).values()) == numbers


def test_a_step_that_was_released_again_counts_the_prompts_between_once(tmp_path):
    with open_store(tmp_path, is_created=True) as store:
        state = store_campaign(store, [RUN, prompt_step(), RUN, RUN], []).state
    first, second, third = state.facts
    released = state.model_copy(update={"facts": (second, first, third)})
    assert number_mountings(released) == {first.run: 1, second.run: 1, third.run: 1}


def test_the_times_of_answers_do_not_decide(tmp_path):
    with open_store(tmp_path, is_created=True) as store:
        state = store_campaign(store, [RUN, prompt_step(), RUN], []).state
    late = tuple(
        item.model_copy(update={"ended": item.ended + 1e6}) if item.note else item for item in state.items
    )
    assert list(number_mountings(state.model_copy(update={"items": late})).values()) == [1, 2]
