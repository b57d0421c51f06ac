"""Setup steps between two runs, and steps that are done during a pause."""

import pytest

from bench.campaigns import CampaignError, CampaignRunner, PlantBench
from bench.campaigns.document import collect_methods, expand_campaign, parse_campaign, plan_campaign
from bench.campaigns.engine import ExecutionReport, Observation, answer, apply_edit, pause, recover, resume, stop
from bench.campaigns.engine.edits import AddEdit, DoNowEdit
from bench.commands.campaign.catalogue import open_store
from tests.unit.bench.campaigns.simulated_bench import ID, SimulatedBench, start

RUN = {"run": {"specimen": "MR-1", "method": "quick"}}
REST = {"rest": {"seconds": 100}}
PROMPT = {"prompt": {"text": "Check the clevis"}}
TARE, HOME = {"setup": {"step": "tare"}}, {"setup": {"step": "home"}}
MOVE = {"setup": {"step": "move", "position_m": 0.0125}}
RUNNING = ExecutionReport(kind="running")


def report(kind, reason="", **more):
    return ExecutionReport(kind=kind, reason=reason, **more)


def outcome(bench, number=0):
    item = bench.state.items[number]
    return item.state, item.reason


def do_now(bench, step):
    edit = DoNowEdit(edit="do_now", step=step)
    bench.store(apply_edit(bench.state, edit, collect_methods(bench.state.campaign), bench.now, "B"))


def run_to(bench, phase):
    while bench.state.active is None or bench.state.active.phase != phase:
        bench.step()
    return bench


def interrupt(bench, reason="killed"):
    bench.store(recover(bench.state, Observation(report=report("crashed", reason)), bench.now, ID))


def test_setup_steps_are_done_in_order_with_their_results_and_count_as_held():
    bench = SimulatedBench(start([TARE, RUN, MOVE]))
    bench.setup_reports = [
        report("ended", "3.10 N are subtracted"),
        RUNNING,
        RUNNING,
        report("ended", "at 12.5 mm"),
    ]
    assert bench.run().status == "done"
    assert bench.prepared == ["s0001", "s0003"]
    assert outcome(bench) == ("done", "3.10 N are subtracted")
    assert outcome(bench, 2) == ("done", "at 12.5 mm")
    assert [item.label for item in bench.state.items][::2] == ["setup step tare", "setup step move to 12.5 mm"]
    assert bench.state.times.stroking_s == 20.0
    assert bench.state.times.held_s >= 4.0


def test_a_matrix_and_its_dry_run_have_setup_steps():
    matrix = {"specimens": ["MR-1"], "methods": ["quick"], "before_run": [TARE], "before_specimen": [HOME]}
    document = parse_campaign({"name": "night", "steps": {"matrix": matrix}}, "the test")
    assert [type(step).__name__ for step in expand_campaign(document)] == ["BenchSetupStep"] * 2 + ["RunStep"]
    plan = plan_campaign(document, collect_methods(document))
    assert [(one.kind, one.duration_s) for one in plan.steps[:2]] == [("setup", 20.0), ("setup", 1.0)]
    assert plan.duration_s == pytest.approx(plan.stroking_s + 21.0)


@pytest.mark.parametrize(
    ("setup", "reason"),
    [({"step": "move"}, "needs position_m"), ({"step": "tare", "position_m": 0.1}, "no other setup step takes it"),
     ({"step": "dance"}, "'home'")],
)  # fmt: skip
def test_a_setup_step_with_a_wrong_target_is_refused(setup, reason):
    with pytest.raises(CampaignError, match=reason):
        parse_campaign({"name": "night", "steps": [{"setup": setup}]}, "the test")


@pytest.mark.parametrize(
    ("policy", "state", "status"),
    [("skip", "failed", "done"), ("stop", "failed", "stopped"), ("ask", "active", "running")],
)
def test_a_failure_has_the_reason_of_the_agent_and_the_policy_of_the_campaign(policy, state, status):
    bench = SimulatedBench(start([TARE, RUN], on_failure=policy))
    bench.setup_reports = [report("refused", "the load cell does not answer")]
    assert bench.run().status == status
    assert outcome(bench) == (state, "the load cell does not answer")


def test_a_failure_is_retried_but_not_after_a_person_has_stopped_the_rod():
    bench = SimulatedBench(start([MOVE], on_failure="retry"))
    bench.setup_reports = [report("refused", "the drive is off")]
    assert bench.run().status == "done"
    assert bench.prepared == ["s0001", "s0001"]
    bench = SimulatedBench(start([MOVE], on_failure="retry"))
    bench.setup_reports = [RUNNING, report("refused", "stopped on request: 3 mm", ending="stopped")]
    assert bench.run().status == "paused"
    assert "was stopped by a person" in bench.state.reason
    assert bench.prepared == ["s0001"]
    bench.store(resume(bench.state, bench.now))
    assert bench.run().status == "done"


def test_a_trip_in_a_setup_step_stops_if_asked():
    bench = SimulatedBench(start([MOVE, RUN], stop_on=[{"trip": True}]))
    bench.setup_reports = [report("refused", "force 1600 N", ending="tripped")]
    assert bench.run().status == "stopped"
    assert "has tripped: force 1600 N" in bench.state.reason


def test_pause_and_stop_wait_for_the_end_of_a_setup_step_and_one_thing_now_is_refused():
    bench = SimulatedBench(start([HOME, RUN]))
    bench.setup_reports = [RUNNING, RUNNING, RUNNING]
    run_to(bench, "preparing")
    with pytest.raises(CampaignError, match="is in progress"):
        do_now(bench, TARE)
    bench.store(pause(bench.state, bench.now))
    assert bench.state.status == "pausing"
    assert bench.run().status == "paused"
    assert outcome(bench)[0] == "done"
    bench.store(resume(bench.state, bench.now))
    bench = SimulatedBench(start([HOME, RUN]))
    bench.setup_reports = [RUNNING]
    run_to(bench, "preparing")
    bench.store(stop(bench.state, bench.now))
    assert bench.run().status == "stopped"
    assert [item.state for item in bench.state.items] == ["done", "pending"]


def test_an_interrupted_tare_begins_again_and_is_held_back_after_two_crashes():
    bench = run_to(SimulatedBench(start([TARE, RUN])), "starting")
    interrupt(bench)
    assert outcome(bench)[0] == "pending"
    run_to(bench, "starting")
    assert bench.prepared == ["s0001", "s0001"]
    interrupt(bench)
    assert outcome(bench) == ("held_back", "held back after 2 crashes of the bench: killed")
    assert bench.run().status == "done"


@pytest.mark.parametrize("step", ["home", "mount", "centre", "unmount", "move"])
@pytest.mark.parametrize("policy", ["retry", "ask"])
def test_any_other_interrupted_setup_step_waits_for_a_person(step, policy):
    target = {"position_m": 0.01} if step == "move" else {}
    bench = SimulatedBench(start([{"setup": {"step": step} | target}, RUN], on_failure=policy))
    run_to(bench, "starting")
    interrupt(bench)
    assert bench.run().needs_person
    assert bench.prepared == ["s0001"]
    assert "check the bench before it is repeated" in outcome(bench)[1]
    bench.store(answer(bench.state, bench.now, "B", choice="retry"))
    assert bench.run().status == "done"
    assert bench.prepared == ["s0001", "s0001"]


def test_a_setup_step_is_added_and_done_now_by_edits():
    bench = SimulatedBench(start([REST, RUN]))
    run_to(bench, "resting")
    edit = AddEdit.model_validate({"edit": "add", "steps": [MOVE], "before": "s0002"})
    bench.store(apply_edit(bench.state, edit, {}, bench.now))
    do_now(bench, TARE)
    assert bench.run().status == "done"
    assert bench.prepared == ["s0004", "s0003"]


@pytest.mark.parametrize("step", [TARE, RUN, {"rest": {"seconds": 5}}])
def test_one_thing_now_is_done_during_a_pause_which_then_goes_on(step):
    bench = SimulatedBench(start([REST, RUN]))
    run_to(bench, "resting")
    bench.store(pause(bench.state, bench.now))
    do_now(bench, step)
    assert not bench.state.is_held
    for _ in range(12):
        bench.step()
    added = next(item for item in bench.state.items if item.id == "s0003")
    assert (added.state, bench.state.status, bench.state.is_held) == ("done", "paused", True)
    assert [bench.state.get_item(one).state for one in ("s0001", "s0002")] == ["pending", "pending"]
    assert any("during the pause" in text for text in bench.texts("edit"))
    bench.store(resume(bench.state, bench.now))
    assert bench.run().status == "done"


def test_a_prompt_during_a_pause_is_answered_and_the_campaign_stays_paused():
    bench = SimulatedBench(start([RUN]))
    bench.store(pause(bench.state, bench.now))
    do_now(bench, PROMPT)
    bench.step()
    assert bench.state.needs_person
    bench.store(answer(bench.state, bench.now, "B"))
    bench.step()
    assert (bench.state.status, bench.state.items[1].state) == ("paused", "pending")


def test_a_repetition_during_a_pause_does_all_its_runs():
    bench = SimulatedBench(start([RUN]))
    bench.store(pause(bench.state, bench.now))
    do_now(bench, {"repeat": {"step": RUN, "until": {"diagnosis": "settled"}, "at_most": 2}})
    run_to(bench, "evaluating")
    stroke = {"name": "s"}
    bench.results = {f"run-{k}": {"is_diagnosed": True, "next_stroke": stroke} for k in range(2)}
    for _ in range(8):
        bench.step()
    assert len(bench.state.items[0].runs) == 2
    assert (bench.state.items[0].state, bench.state.status) == ("done", "paused")


def test_a_step_that_a_person_ends_during_a_pause_does_not_begin_again():
    bench = SimulatedBench(start([RUN]))
    bench.store(pause(bench.state, bench.now))
    bench.setup_reports = [RUNNING, report("refused", "stopped on request", ending="stopped")]
    do_now(bench, MOVE)
    for _ in range(8):
        bench.step()
    assert bench.prepared == ["s0002"]
    assert (bench.state.items[0].state, bench.state.is_held) == ("pending", True)


def test_a_pause_ends_a_step_that_began_during_an_earlier_pause():
    bench = SimulatedBench(start([RUN]))
    bench.store(pause(bench.state, bench.now))
    do_now(bench, RUN)
    bench.outcomes[0] = {"outcome": "incomplete", "ending": "stopped", "checkpoint": "first"}
    run_to(bench, "starting")
    bench.store(pause(resume(bench.state, bench.now), bench.now))
    for _ in range(6):
        bench.step()
    assert (bench.state.status, bench.state.is_held, bench.state.items[0].state) == ("paused", True, "pending")


def test_on_the_simulated_plant_a_setup_step_takes_its_time_and_does_nothing_else(tmp_path):
    document = parse_campaign({"name": "night", "steps": [TARE, MOVE, REST]}, "the test")
    with open_store(tmp_path, is_created=True) as store:
        made = store.create(document, {}, "scenario default", 1000.0)
        bench = PlantBench(store.catalogue, "default", 1000.0)
        ended = CampaignRunner(store, made.id, bench).run()
        events = [event.text for event in store.table.list_newest_events(made.id, 20)]
    assert ended.state.status == "done"
    assert bench.now() == pytest.approx(1121.0)
    assert (ended.state.times.held_s, ended.state.times.rest_s) == (21.0, 100.0)
    assert "only lets the time" in ended.state.items[0].reason
    assert any(text.startswith("step s0002, setup step move to 12.5 mm: done") for text in events)
