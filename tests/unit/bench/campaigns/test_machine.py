"""State machine: every transition, as a pure function; kills and edits at random."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.campaigns import CampaignError
from bench.campaigns.document import collect_methods
from bench.campaigns.engine import Observation, advance, answer, apply_edit, compute_interval, pause, resume, stop
from bench.campaigns.engine.edits import AddEdit, DeleteEdit, DoNowEdit, MoveEdit, PauseEdit, ReleaseEdit
from tests.unit.bench.campaigns.simulated_bench import ID, SimulatedBench, result, start

RUN = {"run": {"specimen": "MR-1", "method": "quick"}}
OTHER = {"run": {"specimen": "MR-2", "method": "quick"}}
REST = {"rest": {"seconds": 100}}
COOL = {"rest": {"until_temperature_c": 25, "timeout_s": 600}}
PROMPT = {"prompt": {"text": "Mount the next specimen", "note": True}}
STROKE = {"name": "s", "motion": {"kind": "sine", "amplitude_m": 0.01, "frequency_hz": 1}, "cycles": 3,
          "drive": {"kind": "constant", "value": 0.1}}  # fmt: skip


def states(bench):
    return [item.state for item in bench.state.items]


def test_all_steps_are_done_in_order_with_restore_points_around_each():
    bench = SimulatedBench(start([RUN, REST, OTHER]))
    assert bench.run().status == "done"
    assert states(bench) == ["done"] * 3
    assert [fact.specimen for fact in bench.state.facts] == ["MR-1", "MR-2"]
    begun, ended = ([text for text in bench.texts("restore_point") if word in text] for word in ("begins", "done"))
    assert len(begun) == len(ended) == 3
    times = bench.state.times
    assert (times.stroking_s, times.rest_s) == (40.0, 100.0)
    assert bench.texts("ended") == ["campaign night done: all steps have ended; 3 of 3 steps are done"]


def test_a_prompt_waits_for_its_answer_and_the_time_is_held():
    bench = SimulatedBench(start([PROMPT, RUN]))
    assert bench.run().needs_person
    bench.step()
    bench.step()
    with pytest.raises(CampaignError, match="needs a note"):
        answer(bench.state, bench.now)
    bench.store(answer(bench.state, bench.now, "B", note="12 N m"))
    assert bench.run().status == "done"
    assert bench.state.items[0].note == "12 N m"
    assert bench.state.times.held_s >= 2
    with pytest.raises(CampaignError, match="asks for nothing"):
        answer(bench.state, bench.now, note="x")


def test_a_run_keeps_the_temperature_at_its_end():
    bench = SimulatedBench(start([RUN, RUN]))
    bench.step()
    bench.temperature = 24.5
    bench.run()
    assert [fact.temperature_c for fact in bench.state.facts] == [24.5, 24.5]
    assert SimulatedBench(start([RUN])).run().facts[0].temperature_c is None


def test_a_rest_ends_at_its_temperature():
    bench = SimulatedBench(start([COOL]))
    bench.temperature = 24.0
    assert bench.run().status == "done"
    assert "24.00 °C" in bench.state.items[0].reason


def test_a_temperature_that_is_never_reached_ends_with_the_reason():
    bench = SimulatedBench(start([COOL, RUN], on_failure="skip"))
    bench.temperature = 30.0
    assert bench.run().status == "done"
    assert states(bench) == ["failed", "done"]
    assert "25 °C was not reached within 600 s; the thermometer shows 30.00 °C" in bench.state.items[0].reason


def test_a_warm_up_repeats_its_block_until_the_temperature():
    bench = SimulatedBench(start([{"warm_up": {"until_temperature_c": 30}}, RUN]))
    bench.temperature = 22.0
    for _ in range(6):
        bench.step()
    bench.temperature = 31.0
    bench.run()
    assert states(bench) == ["done", "done"]
    assert len(bench.state.items[0].runs) > 1
    assert len(bench.state.facts) == 1


@pytest.mark.parametrize(
    ("policy", "expected", "status"),
    [("skip", ["failed", "done"], "done"), ("stop", ["failed", "pending"], "stopped")],
)
def test_the_policy_after_a_failure(policy, expected, status):
    bench = SimulatedBench(start([RUN, OTHER], on_failure=policy))
    bench.outcomes[0] = {"outcome": "incomplete", "ending": "tripped", "reason": "force 1600 N exceeds the limit"}
    assert bench.run().status == status
    assert states(bench) == expected
    assert "1600 N" in bench.state.items[0].reason


def test_a_retry_repeats_a_step_as_often_as_allowed_and_then_stops():
    bench = SimulatedBench(start([RUN, OTHER], on_failure="retry", retries=2))
    bench.outcomes = {k: {"outcome": "incomplete", "ending": "tripped", "reason": "wire"} for k in range(3)}
    assert bench.run().status == "stopped"
    assert len(bench.logs) == 3
    assert bench.state.items[0].parts == ("run-0", "run-1", "run-2")


@pytest.mark.parametrize(("choice", "status"), [("retry", "done"), ("skip", "done"), ("stop", "stopped")])
def test_a_person_decides_on_a_failure(choice, status):
    bench = SimulatedBench(start([RUN, OTHER]))
    bench.outcomes[0] = {"outcome": "incomplete", "ending": "tripped", "reason": "wire"}
    assert bench.run().needs_person
    with pytest.raises(CampaignError, match="retry, skip or stop"):
        answer(bench.state, bench.now, note="?")
    bench.store(answer(bench.state, bench.now, "B", choice=choice))
    assert bench.run().status == status


def test_a_trip_stops_if_asked():
    bench = SimulatedBench(start([RUN, OTHER], stop_on=[{"trip": True}]))
    bench.outcomes[0] = {"outcome": "incomplete", "ending": "tripped", "reason": "force"}
    assert bench.run().status == "stopped"
    assert "has tripped: force" in bench.state.reason


def test_a_run_that_a_person_stops_pauses_the_campaign_and_continues_after_its_checkpoint():
    bench = SimulatedBench(start([RUN]))
    bench.outcomes[0] = {"outcome": "incomplete", "ending": "stopped", "reason": "Esc", "checkpoint": "10mm_1Hz"}
    assert bench.run().status == "paused"
    bench.store(resume(bench.state, bench.now, "B"))
    bench.step()
    execution = bench.state.active.execution
    assert (execution.resume_after, execution.continues) == ("10mm_1Hz", "run-0")
    assert bench.run().status == "done"
    assert bench.state.items[0].runs == ("run-1",)


def test_a_pause_ends_the_run_at_its_checkpoint_and_a_stop_ends_after_the_run():
    bench = SimulatedBench(start([RUN, OTHER]))
    bench.outcomes[0] = {"outcome": "incomplete", "ending": "stopped", "checkpoint": "10mm_1Hz"}
    bench.step()
    bench.store(pause(bench.state, bench.now, "B"))
    assert bench.state.status == "pausing"
    assert bench.run().status == "paused"
    assert states(bench) == ["pending", "pending"]
    with pytest.raises(CampaignError, match="paused already"):
        pause(bench.state, bench.now)
    bench.store(resume(bench.state, bench.now))
    bench.step()
    bench.store(stop(bench.state, bench.now, "B"))
    assert bench.state.status == "stopping"
    assert bench.run().status == "stopped"
    assert states(bench) == ["done", "pending"]
    with pytest.raises(CampaignError, match="is stopped"):
        resume(bench.state, bench.now)


def test_an_interval_is_that_of_all_repetitions_together():
    value, half = compute_interval([result(10.0, 2.0), result(12.0, 2.0)], "k0")
    assert value == pytest.approx(11.0)
    assert half == pytest.approx(2.0 / 2**0.5)
    assert compute_interval([], "k0") is None


def test_a_repetition_ends_when_the_interval_is_narrow():
    goal = {"parameter": "k0", "ci_percent": 6}
    bench = SimulatedBench(start([{"repeat": {"step": RUN, "until": goal, "at_most": 9}}]))
    bench.results = {f"run-{k}": result(100.0, 10.0) for k in range(9)}
    assert bench.run().status == "done"
    assert len(bench.state.items[0].runs) == 3  # 10 % / sqrt(3) = 5.8 %
    assert "after 3 runs" in bench.state.items[0].reason


def test_a_repetition_ends_at_its_limit_and_says_so():
    goal = {"parameter": "k0", "ci_percent": 1}
    bench = SimulatedBench(start([{"repeat": {"step": RUN, "until": goal, "at_most": 2}}]))
    bench.results = {f"run-{k}": result(100.0, 10.0) for k in range(2)}
    assert bench.run().status == "done"
    assert "which is the limit" in bench.state.items[0].reason


def test_proposed_strokes_are_added_until_the_diagnosis_is_settled():
    bench = SimulatedBench(start([RUN, {"next_stroke": {"at_most": 5}}]))
    bench.results = {"run-0": result(1, 1, STROKE), "run-1": result(1, 1, STROKE), "run-2": result(1, 1)}
    assert bench.run().status == "done"
    assert bench.state.items[1].runs == ("run-1", "run-2")
    assert len(bench.state.items[1].strokes) == 2
    assert "settled after 2 proposed strokes" in bench.state.items[1].reason


def test_proposed_strokes_of_a_cell_never_build_on_the_run_of_another_cell():
    matrix = {"specimens": ["MR-1", "MR-2"], "methods": ["quick"], "after_run": [{"next_stroke": {"at_most": 2}}]}
    bench = SimulatedBench(start({"matrix": matrix}, on_failure="skip"))
    bench.results = {"run-0": result(1, 1, STROKE), "run-1": result(1, 1)}
    bench.outcomes = {2: {"outcome": "incomplete", "ending": "tripped", "reason": "the rod is too fast"}}
    assert bench.run().status == "done"
    assert states(bench) == ["done", "done", "failed", "failed"]
    assert bench.state.items[1].runs == ("run-1",)
    assert "no complete run precedes it" in bench.state.items[3].reason
    assert len(bench.logs) == 3


def test_a_cell_is_repeated_to_its_goal_before_its_proposed_strokes():
    goal = {"parameter": "k0", "ci_percent": 8}
    after = [{"repeat": {"until": goal, "at_most": 5}}, {"next_stroke": {"at_most": 2}}]
    bench = SimulatedBench(start({"matrix": {"specimens": ["MR-1"], "methods": ["quick"], "after_run": after}}))
    bench.results = {"run-0": result(100, 10), "run-1": result(100, 10, STROKE), "run-2": result(100, 10)}
    assert bench.run().status == "done"
    assert [item.runs for item in bench.state.items] == [("run-0", "run-1"), ("run-2",)]
    assert {fact.specimen for fact in bench.state.facts} == {"MR-1"}


@pytest.mark.parametrize(
    ("condition", "reason"),
    [
        ({"drift": {"parameter": "k0", "percent": 5}}, "k0 of MR-1 with quick has drifted by 10 % in run run-1"),
        ({"verdict": "unexplained"}, "the diagnosis of run run-1 is unexplained"),
    ],
)
def test_results_stop_a_campaign(condition, reason):
    bench = SimulatedBench(start([RUN, RUN, RUN, RUN], stop_on=[condition]))
    bench.results = {"run-0": result(100, 1), "run-1": result(110, 1, verdict="unexplained")}
    assert bench.run().status == "stopped"
    assert reason in bench.state.reason
    assert states(bench) == ["done", "done", "pending", "pending"]


@pytest.mark.parametrize("condition", [{"drift": {"parameter": "k0", "percent": 5}}, {"verdict": "unexplained"}])
def test_the_next_run_waits_for_the_results_that_may_stop_the_campaign(condition):
    rest = {"rest": {"seconds": 60}}
    bench = SimulatedBench(start([RUN, RUN, rest, RUN], stop_on=[condition]))
    bench.results = {"run-0": result(100, 1)}
    for _ in range(30):
        bench.step()
    # The rest needs no results; the run after it does.
    assert states(bench) == ["done", "done", "done", "pending"]
    assert (bench.state.awaited_run, bench.state.needs_lease) == ("run-1", True)
    bench.results["run-1"] = result(110, 1, verdict="unexplained")
    assert bench.run().status == "stopped"
    assert (states(bench)[-1], bench.state.awaited_run) == ("pending", "")


def test_a_campaign_ends_when_the_last_results_have_arrived_or_cannot():
    stop_on = [{"drift": {"parameter": "k0", "percent": 5}}]
    bench = SimulatedBench(start([RUN, RUN], stop_on=stop_on))
    bench.results = {"run-0": result(100, 1)}
    for _ in range(10):
        bench.step()
    assert (states(bench), bench.state.status) == (["done", "done"], "running")
    bench.results["run-1"] = result(100, 1, failure="identify failed: too few samples")
    assert bench.run().status == "done"
    assert bench.state.reason.endswith("stop_on was not checked for runs without results: run-1")


def test_a_missing_result_fails_with_its_reason_or_after_its_time():
    goal = {"diagnosis": "settled"}
    step = {"repeat": {"step": RUN, "until": goal, "at_most": 2}}
    bench = SimulatedBench(start([step, step], on_failure="skip"))
    bench.results = {"run-0": result(1, 1, failure="identify failed: too few samples")}
    for _ in range(6):
        bench.step()
    assert "too few samples" in bench.state.items[0].reason
    bench.now += 4 * 3600
    bench.run()
    assert "did not arrive within 3 h" in bench.state.items[1].reason


def test_a_step_that_crashes_the_bench_twice_is_held_back_and_released():
    bench = SimulatedBench(start([RUN, OTHER]))
    for _ in range(2):
        bench.store(advance(bench.state, Observation(), bench.now, ID))
        assert bench.state.active.phase == "starting"
        bench.die()
    assert states(bench) == ["held_back", "pending"]
    assert "held back after 2 crashes" in bench.texts("held_back")[0]
    bench.store(apply_edit(bench.state, ReleaseEdit(edit="release", item="s0001"), {}, bench.now, "B"))
    assert bench.run().status == "done"
    assert states(bench) == ["done", "done"]


def test_a_run_without_samples_belongs_to_its_step_and_is_not_continued():
    bench = SimulatedBench(start([RUN, OTHER]))
    for sampled, checkpoint in ((True, "10mm_1Hz_0.2V"), (False, "")):
        bench.store(advance(bench.state, Observation(), bench.now, ID))
        bench.die(checkpoint, has_log=True, has_samples=sampled)
    item = bench.state.items[0]
    assert len(item.parts) == 2
    assert (item.continues, item.resume_after) == (item.parts[0], "10mm_1Hz_0.2V")


def test_a_person_is_told_once_that_the_bench_is_not_ready():
    bench = SimulatedBench(start([RUN]))
    bench.obstacle = "the rig agent is tripped: force"
    for _ in range(700):
        bench.step()
    assert bench.texts("person_needed") == ["the next step cannot begin: the rig agent is tripped: force"]
    bench.obstacle = ""
    assert bench.run().status == "done"


def test_the_queue_is_edited_and_every_edit_is_recorded():
    bench = SimulatedBench(start([RUN, OTHER]))
    methods = collect_methods(bench.state.campaign)

    def edit(one):
        bench.store(apply_edit(bench.state, one, methods, bench.now, "B"))

    edit(AddEdit(edit="add", steps=[REST], before="s0002"))
    edit(MoveEdit(edit="move", item="s0002", position=0))
    edit(DeleteEdit(edit="delete", item="s0001"))
    edit(DoNowEdit(edit="do_now", step=PROMPT))
    assert [item.id for item in bench.state.pending] == ["s0004", "s0002", "s0003"]
    assert len(bench.texts("edit")) == 4
    assert all(message.who == "B" for message in bench.messages if message.kind == "edit")


@pytest.mark.parametrize("step", [REST, PROMPT])
def test_one_thing_now_is_done_before_a_rest_or_prompt_in_progress_which_then_begins_again(step):
    bench = SimulatedBench(start([step, OTHER]))
    bench.store(advance(bench.state, Observation(), bench.now, ID))
    assert bench.state.active.phase in ("resting", "asking")
    methods = collect_methods(bench.state.campaign)
    bench.store(apply_edit(bench.state, DoNowEdit(edit="do_now", step=RUN), methods, bench.now, "B"))
    assert [item.id for item in bench.state.pending] == ["s0003", "s0001", "s0002"]
    bench.run()
    if bench.state.needs_person:
        bench.store(answer(bench.state, bench.now, "B", "done"))
    assert bench.run().status == "done"
    assert [fact.item for fact in bench.state.facts] == ["s0003", "s0002"]


def test_one_thing_now_waits_for_the_answer_to_a_failure():
    bench = SimulatedBench(start([RUN]))
    bench.outcomes[0] = {"outcome": "incomplete", "ending": "tripped", "reason": "force"}
    bench.run()
    with pytest.raises(CampaignError, match="answer it first"):
        apply_edit(bench.state, DoNowEdit(edit="do_now", step=REST), {}, bench.now)


def test_a_pause_in_the_queue_waits_there_for_a_person():
    bench = SimulatedBench(start([RUN, OTHER]))
    edit = PauseEdit(edit="pause", before="s0002", text="Check the clevis")
    bench.store(apply_edit(bench.state, edit, {}, bench.now, "B"))
    assert bench.run().needs_person
    assert [fact.item for fact in bench.state.facts] == ["s0001"]
    assert bench.texts("person_needed") == ["Check the clevis"]
    bench.store(answer(bench.state, bench.now, "B"))
    assert bench.run().status == "done"
    edit = next(one for one in bench.messages if one.kind == "edit")
    assert (edit.who, edit.text) == ("B", "added s0003 Check the clevis")


@pytest.mark.parametrize(
    ("edit", "reason"),
    [
        (DeleteEdit(edit="delete", item="s0001"), "s0001 is active"),
        (MoveEdit(edit="move", item="nonsense", position=0), "there is no step nonsense"),
        (DoNowEdit(edit="do_now", step=REST), "possible between two runs"),
        (ReleaseEdit(edit="release", item="s0002"), "s0002 is pending"),
        (AddEdit(edit="add", steps=[{"run": {"specimen": "a", "method": "multisine"}}]), "there is no method"),
    ],
)
def test_an_edit_that_is_not_possible_is_refused(edit, reason):
    bench = SimulatedBench(start([RUN, OTHER]))
    bench.step()
    with pytest.raises(CampaignError, match=reason):
        apply_edit(bench.state, edit, collect_methods(bench.state.campaign), bench.now)


EVENTS = st.lists(
    st.one_of(
        st.tuples(st.just("step"), st.integers(1, 6)),
        st.tuples(st.just("kill"), st.booleans()),
        st.tuples(st.sampled_from(["pause", "resume", "add", "delete", "move", "do_now"]), st.integers(0, 5)),
    ),
    max_size=40,
)


def edit_at_random(bench, methods, kind, number):
    pending = bench.state.pending
    if kind == "add":
        return apply_edit(bench.state, AddEdit(edit="add", steps=[OTHER]), methods, bench.now)
    if kind == "do_now":
        return apply_edit(bench.state, DoNowEdit(edit="do_now", step=OTHER), methods, bench.now)
    if kind in ("pause", "resume"):
        return {"pause": pause, "resume": resume}[kind](bench.state, bench.now)
    chosen = pending[number % len(pending)].id if pending else "none"
    one = DeleteEdit(edit="delete", item=chosen)
    if kind == "move":
        one = MoveEdit(edit="move", item=chosen, position=number)
    return apply_edit(bench.state, one, methods, bench.now)


@given(EVENTS)
@settings(max_examples=150, deadline=None)
def test_kills_and_edits_at_random_lose_and_repeat_nothing(events):
    bench = SimulatedBench(start([RUN, REST, OTHER, RUN, OTHER]))
    methods = collect_methods(bench.state.campaign)
    for kind, number in events:
        if kind == "step":
            for _ in range(number):
                bench.step()
        elif kind == "kill":
            # A kill between the stored state and the act: the run may not have begun, or not have ended.
            report, bench.report = bench.report, None
            bench.store(advance(bench.state, Observation(report=report), bench.now, ID))
            bench.die("10mm_1Hz", has_log=number)
        else:
            try:
                bench.store(edit_at_random(bench, methods, kind, number))
            except CampaignError:
                continue
    if bench.state.status in ("paused", "pausing"):
        bench.store(resume(bench.state, bench.now))
    bench.run()
    complete = [report.run for report in bench.logs.values() if report.kind == "ended"]
    facts = [fact.run for fact in bench.state.facts]
    assert sorted(facts) == sorted(complete)  # every finished run counts exactly once
    for item in bench.state.items:
        assert item.state in ("done", "skipped", "held_back")
        assert len(item.runs) == (1 if item.state == "done" and hasattr(item.step, "run") else 0)
        assert (item.crashes >= 2) == (item.state == "held_back")
    assert bench.state.status == "done"
