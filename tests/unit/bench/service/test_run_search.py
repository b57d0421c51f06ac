"""Search for runs by the REST interface."""

from datetime import UTC, datetime, timedelta

import pytest

from bench.catalogue import JobRow, RunRow

STARTED = datetime(2026, 3, 1, 10, tzinfo=UTC)
RUNS = {
    "a": {"specimen": "damper 7", "method": "quick", "operator": "M. Curie", "outcome": "clean",
          "ending": "completed"},
    "b": {"specimen": "damper 7", "method": "paper_sines", "outcome": "incomplete", "ending": "tripped",
          "reason": "force 1 523 N exceeds the limit_of 1 500 N"},
    "c": {"specimen": "damper 8", "method": "quick", "outcome": "clean", "ending": "completed"},
}  # fmt: skip
FITS = {"a": 1500.0, "c": 2500.0}
EFFECTS = {"a": ["gas_spring", "backlash"], "c": ["gas_spring_2"]}


@pytest.fixture
def service(service):
    """Return a service with three runs, started a day apart, two of them with fit and diagnosis."""
    catalogue = get_catalogue(service)
    for day, (name, facts) in enumerate(RUNS.items()):
        started = STARTED + timedelta(days=day)
        catalogue.add(RunRow(id=name, log=f"{name}.mcap", started=started, state="ended", **facts))
    for name, k0 in FITS.items():
        add_job(catalogue, name, "identify", 1, {"parameters": {"k0": k0}, "rmse_n": 1.0, "noise_floor_n": 1.0})
        add_job(catalogue, name, "diagnose", 1, make_diagnosis(EFFECTS[name]))
    return service


def get_catalogue(service):
    return service.client.app.state.context.catalogue


def make_diagnosis(effects):
    return {
        "verdict": "explained", "effects": effects, "probability": 0.9, "before_n": 9.0, "after_n": 2.0,
        "noise_floor_n": 1.0, "shrinkage": 0.9, "shrinkage_ci95": None, "explanation": "",
    }  # fmt: skip


def add_job(catalogue, run, kind, hour, summary):
    made = STARTED + timedelta(hours=hour)
    catalogue.add(
        JobRow(id=f"{run}-{kind}-{hour}", run_id=run, kind=kind, key=f"{run}{kind}{hour}", settings={},
               state="done", created=made, finished=made, summary=summary, result="folder")
    )  # fmt: skip


def find(service, query):
    return [run["id"] for run in service.get(f"/runs?{query}")["items"]]


@pytest.mark.parametrize(
    ("query", "found"),
    [
        ("specimen=damper 7", ["b", "a"]),
        ("specimen=damper 7&method=quick", ["a"]),
        ("specimen=damper", []),
        ("outcome=clean", ["c", "a"]),
        ("ending=tripped", ["b"]),
        ("from=2026-03-02T10:00:00Z", ["c", "b"]),
        ("from=2026-03-02T12:00:00%2B02:00&to=2026-03-03T10:00:00Z", ["b"]),
        ("effect=gas_spring", ["a"]),
        ("effect=backlash", ["a"]),
        ("effect=gas", []),
        ("parameter=k0&parameter_min=1500", ["c", "a"]),
        ("parameter=k0&parameter_min=1600&parameter_max=1e4", ["c"]),
        ("parameter=k0&parameter_max=1499", []),
        ("parameter=alpha&parameter_min=0", []),
        ("text=CURIE", ["a"]),
        ("text=limit_of", ["b"]),
        ("text=%25", []),
        ("text=damper&limit=2", ["c", "b"]),
    ],
)
def test_runs_are_found_by_each_condition(service, query, found):
    assert find(service, query) == found


def test_only_the_newest_result_counts(service):
    add_job(get_catalogue(service), "a", "diagnose", 2, make_diagnosis(["seal_friction"]))
    add_job(get_catalogue(service), "a", "identify", 2, {"parameters": {"k0": 9.0}})
    assert find(service, "effect=gas_spring") == []
    assert find(service, "effect=seal_friction") == ["a"]
    assert find(service, "parameter=k0&parameter_max=10") == ["a"]


def test_a_search_is_continued_page_by_page(service):
    first = service.get("/runs?text=damper&limit=2")
    assert find(service, f"text=damper&limit=2&before={first['next']}") == ["a"]


@pytest.mark.parametrize(
    ("query", "message"),
    [
        ("from=2026-03-02T10:00:00", "from"),
        ("from=1772445600", "use ISO 8601 with a zone"),
        ("to=-1.5e9", "use ISO 8601 with a zone"),
        ("parameter=k0", "parameter_min or parameter_max"),
        ("parameter_min=3", "without parameter"),
        ("parameter=k0&parameter_min=3&parameter_max=2", "3 is above parameter_max 2"),
        ("parameter=k0'&parameter_min=3", "parameter"),
        ("parameter=k0&parameter_min=nan", "parameter_min"),
        ("outcome=good", "outcome"),
        ("text=", "text"),
        ("speciman=damper", "known are before, bench, effect, ending, from"),
    ],
)
def test_a_wrong_condition_is_refused_with_its_name(service, query, message):
    answer = service.client.get(f"/api/v1/runs?{query}")
    assert answer.status_code == 422
    assert message in answer.json()["detail"]
