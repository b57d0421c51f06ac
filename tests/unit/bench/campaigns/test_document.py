"""Campaign documents: refusals in one sentence, order of a matrix, and the dry run."""

import pytest

from bench.campaigns import (
    CampaignError,
    collect_methods,
    format_plan,
    load_campaign,
    parse_campaign,
    plan_campaign,
)
from bench.campaigns.document import (
    add_strokes,
    expand_campaign,
    find_run,
    get_step_kind,
    make_run_method,
    make_warm_up,
)
from bench.methods import compile_method

RUN = {"run": {"specimen": "MR-1", "method": "quick"}}
REPEAT = {"repeat": {"step": RUN, "until": {"parameter": "k0"}, "at_most": 3}}
MATRIX = {"specimens": ["MR-1", "MR-2"], "methods": ["quick", "validation"], "drives": [0.1, 0.4], "repeats": 2}


def campaign(steps, **more):
    return parse_campaign({"name": "night", "steps": steps, **more}, "the request")


@pytest.mark.parametrize(
    ("document", "place", "reason"),
    [
        ({"steps": []}, "the document", "at least one step"),
        ({"steps": [{"rest": {}}]}, "steps.0.rest", "either seconds or until_temperature_c"),
        ({"steps": [4.5]}, "steps.0", "exactly one of the keys run, rest"),
        ({"steps": [{"rust": {}}]}, "steps.0", "exactly one of the keys run, rest"),
        ({"steps": [{"warm_up": {"cycles": 3, "until_temperature_c": 30}}]}, "steps.0.warm_up", "either cycles"),
        ({"steps": [{"next_stroke": {"at_most": 2}}]}, "the document", "no run precedes it"),
        (
            {"steps": [{"repeat": {"step": RUN, "until": {"parameter": "k0"}, "at_most": 3}}]},
            "ci_percent",
            "missing",
        ),
        ({"steps": {"matrx": 1}}, "steps.matrix", "missing"),
        ({"steps": [RUN], "name": "a b"}, "name", "pattern"),
        ({"steps": [RUN], "notify": [{"webhook": "ftp://a"}]}, "notify", "pattern"),
        ({"steps": [RUN], "on_failure": "hope"}, "on_failure", "retry"),
    ],
)
def test_a_fault_is_refused_with_its_position(document, place, reason):
    with pytest.raises(CampaignError) as refused:
        parse_campaign({"name": "night", **document}, "the request")
    message = str(refused.value)
    assert message.startswith("the request is not a campaign: ")
    assert place in message
    assert reason in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("run", "reason"),
    [
        ({"method": "nonsense"}, "there is no method nonsense"),
        ({"method": "/etc/passwd"}, "there is no method"),
        ({"method": "quick", "drive": 0.9}, "0.9 V exceeds the limit of method quick, 0.5 V"),
        ({"method": {"name": "quick"}}, "is not a method"),
    ],
)
def test_a_method_that_cannot_be_run_is_refused(run, reason):
    with pytest.raises(CampaignError, match=reason):
        collect_methods(campaign([{"run": {"specimen": "MR-1", **run}}]))


def test_a_matrix_has_every_cell_as_often_as_asked_and_specimens_stay_together():
    runs = [find_run(step) for step in expand_campaign(campaign({"matrix": MATRIX}))]
    cells = [(run.specimen, run.method, run.drive) for run in runs]
    assert len(cells) == 16
    assert all(cells.count(cell) == 2 for cell in cells)
    assert [specimen for specimen, _, _ in cells] == ["MR-1"] * 8 + ["MR-2"] * 8


def test_a_random_order_follows_from_the_seed():
    def order(seed):
        return expand_campaign(campaign({"matrix": MATRIX | {"order": "random"}}, seed=seed))

    assert order(1) == order(1)
    assert order(1) != order(2)
    assert sorted(map(str, order(1))) == sorted(map(str, order(2)))


def test_steps_before_specimens_and_runs_are_added():
    matrix = {"specimens": ["A", "B"], "methods": ["quick"], "repeats": 2}
    before = {"before_specimen": [{"prompt": {"text": "mount"}}], "before_run": [{"rest": {"seconds": 5}}]}
    kinds = [get_step_kind(step) for step in expand_campaign(campaign({"matrix": matrix | before}))]
    assert kinds == ["prompt", "rest", "run", "rest", "run"] * 2


CELL_REPEAT = {"repeat": {"until": {"parameter": "k0", "ci_percent": 2}, "at_most": 4}}
NEXT = {"next_stroke": {"at_most": 2}}


def expand_matrix(**more):
    matrix = {"specimens": ["A", "B"], "methods": ["quick"], "drives": [0.1, 0.2], **more}
    return expand_campaign(campaign({"matrix": matrix}))


def test_steps_follow_the_run_of_each_cell():
    steps = expand_matrix(before_run=[{"rest": {"seconds": 5}}], after_run=[NEXT, {"prompt": {"text": "look"}}])
    assert [get_step_kind(step) for step in steps] == ["rest", "run", "next_stroke", "prompt"] * 4


def test_a_repetition_without_a_step_repeats_the_run_of_its_cell_in_its_place():
    steps = expand_matrix(after_run=[CELL_REPEAT, NEXT])
    assert [get_step_kind(step) for step in steps] == ["repeat", "next_stroke"] * 4
    repeats = steps[::2]
    assert [(find_run(one).specimen, find_run(one).drive) for one in repeats] == [
        ("A", 0.1), ("A", 0.2), ("B", 0.1), ("B", 0.2),
    ]  # fmt: skip
    assert {(one.repeat.at_most, one.repeat.until.parameter) for one in repeats} == {(4, "k0")}
    document = campaign({"matrix": {"specimens": ["A"], "methods": ["quick"], "after_run": [CELL_REPEAT, NEXT]}})
    assert plan_campaign(document, collect_methods(document)).methods[0].runs == 4


def test_a_repetition_of_another_run_follows_that_of_the_cell():
    other = {"repeat": {**CELL_REPEAT["repeat"], "step": RUN}}
    steps = expand_matrix(after_run=[NEXT, other])
    assert [get_step_kind(step) for step in steps[:3]] == ["run", "next_stroke", "repeat"]
    assert find_run(steps[2]).specimen == "MR-1"


@pytest.mark.parametrize("place", ["before_specimen", "before_run"])
def test_a_proposed_stroke_before_the_first_run_of_a_matrix_is_refused(place):
    with pytest.raises(CampaignError, match=r"step 1 of the matrix .* no run precedes it; put it into after_run"):
        expand_matrix(**{place: [NEXT]})
    assert expand_matrix(before_specimen=[RUN], before_run=[NEXT])


def test_a_repetition_of_the_cell_that_is_not_first_is_refused_with_its_position():
    with pytest.raises(CampaignError, match=r"steps\.matrix: a repeat without step must be the first"):
        expand_matrix(after_run=[{"rest": {"seconds": 5}}, CELL_REPEAT])
    with pytest.raises(CampaignError, match=r"steps\.matrix\.after_run\.0\.repeat\.at_most"):
        expand_matrix(after_run=[{"repeat": {"until": {"diagnosis": "settled"}}}])


def test_the_methods_of_runs_are_changed_as_asked():
    document = campaign([RUN, {"run": {"specimen": "MR-1", "method": "quick", "drive": 0.2}}])
    methods = collect_methods(document)
    whole, constant = (make_run_method(methods, find_run(step)) for step in document.steps)
    assert {segment.drive_value for segment in compile_method(constant).segments} == {0.2}
    assert compile_method(constant).duration == compile_method(whole).duration
    warm_up = make_warm_up(whole, cycles=7)
    assert [segment.cycles for segment in warm_up.segments] == [7]
    longer = add_strokes(whole, [{"name": "x", "motion": {"kind": "hold"}, "duration_s": 1.0,
                                  "drive": {"kind": "constant", "value": 0.1}}])  # fmt: skip
    assert [segment.name for segment in longer.segments][-1] == "next_stroke_1"


def test_the_dry_run_adds_up_all_steps():
    rest = {"rest": {"until_temperature_c": 24, "timeout_s": 900}}
    repeat = {"repeat": {"step": RUN, "until": {"parameter": "k0", "ci_percent": 2}, "at_most": 4}}
    document = campaign([rest, {"warm_up": {"cycles": 5}}, RUN, repeat, {"prompt": {"text": "remount"}}])
    plan = plan_campaign(document, collect_methods(document), lambda programme: {"messages": ["enough"]}, 10**6)
    assert [step.kind for step in plan.steps] == ["rest", "warm_up", "run", "repeat", "prompt"]
    run, repeat_plan = plan.steps[2:4]
    assert plan.steps[0].longest_s == 900
    assert repeat_plan.longest_s == 4 * run.longest_s
    assert repeat_plan.heat_j == 4 * run.heat_j > 0
    assert plan.methods[0].runs == 5
    assert plan.methods[0].identifiability == ("enough",)
    assert plan.duration_s == sum(step.duration_s for step in plan.steps)
    assert "GB are free" in plan.problems[0]
    assert format_plan(plan)[-1].startswith("problem: ")


def test_a_file_is_loaded_or_refused(tmp_path):
    path = tmp_path / "c.json"
    with pytest.raises(CampaignError, match="cannot be read"):
        load_campaign(path)
    path.write_text("{")
    with pytest.raises(CampaignError, match="not JSON"):
        load_campaign(path)
