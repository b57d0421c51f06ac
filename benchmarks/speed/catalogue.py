"""Time of lists and searches in a catalogue of runs with a fit and a diagnosis each, without HTTP.

python -m benchmarks catalogue
python -m benchmarks.speed.catalogue --runs 100000 [--catalogue postgresql://USER@HOST/EMPTY_DATABASE]
"""

import argparse
import statistics
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from sqlalchemy import Engine, insert, text

from bench.catalogue import Catalogue, JobRow, RunFilter, RunRow, make_sqlite_url, open_database
from benchmarks.common import print_line

RUN_COUNT = 10_000
PAGE = 50
_SPECIMENS = 500
_BATCH = 10_000
"""Number of runs that are added in one transaction."""
_REPEATS = 30
_PARAMETERS = (
    "alpha_0",
    "alpha_1",
    "c0_0",
    "c0_1",
    "c1_0",
    "c1_1",
    "k0",
    "k1",
    "x0",
    "gamma",
    "beta",
    "A",
    "n",
    "eta",
)
_EFFECTS = ("gas_spring", "backlash", "seal_friction", "viscous_heating", "displacement_delay")
_FIRST = datetime(2024, 1, 1, tzinfo=UTC)


def run(count: int = RUN_COUNT, url: str | None = None, list_goal: int = 30, search_goal: int = 100) -> None:
    """Print the median time of a page of the list and of each kind of search.

    Args:
        count: number of runs.
        url: empty database; None for a new SQLite file.
        list_goal: requirement for the list [ms].
        search_goal: requirement for a search [ms].
    """
    with TemporaryDirectory() as folder:
        engine = open_database(url or make_sqlite_url(Path(folder) / "catalogue.db"))
        catalogue = Catalogue(engine, Path(folder))
        fill_catalogue(engine, count)
        with engine.connect() as connection:
            empty = _measure(lambda: connection.execute(text("select 1")).all())
        print(
            f"catalogue: pages of {PAGE} of {count} runs with their jobs, two each; {engine.dialect.name}, no HTTP"
        )
        print_line("baseline: an empty query of the same database", 1e3 * empty, "ms", "")
        newest = 1e3 * _measure(lambda: _load(catalogue, RunFilter()))
        print_line("list, newest page", newest, "ms", f"at most {list_goal}")
        for name, selection in _make_searches(count).items():
            took = 1e3 * _measure(partial(_load, catalogue, selection))
            print_line(name, took, "ms", f"at most {search_goal}")
        catalogue.close()


def _load(catalogue: Catalogue, selection: RunFilter) -> int:
    rows = catalogue.list_runs(PAGE + 1, None, selection)
    catalogue.list_jobs_of_runs([row.id for row in rows], PAGE)
    return len(rows)


def _measure(action: Callable[[], object]) -> float:
    """Return the median time of an action [s]."""
    times = []
    for _ in range(_REPEATS):
        began = time.perf_counter()
        action()
        times.append(time.perf_counter() - began)
    return statistics.median(times)


def _make_searches(count: int) -> dict[str, RunFilter]:
    month = _FIRST + timedelta(days=100)
    return {
        f"specimen with {count // _SPECIMENS} runs": RunFilter(specimen="MR-0007"),
        "one week": RunFilter(started_from=month, started_to=month + timedelta(days=7)),
        "text that no run contains": RunFilter(text="nothing"),
        "text of two letters that no run contains": RunFilter(text="zz"),
        "text that every run contains": RunFilter(text="meyer"),
        "tag that no run has": RunFilter(tag="spare"),
        "effect that every fifth run has": RunFilter(effect="backlash"),
        "effect that no run has": RunFilter(effect="remanence"),
        "parameter range with one run in a hundred": RunFilter(
            parameter="k0", parameter_min=1000.0, parameter_max=1010.0
        ),
        "parameter range without a run": RunFilter(parameter="k0", parameter_min=1e9),
        "specimen, ending and effect together": RunFilter(
            specimen="MR-0007", ending="completed", effect="backlash"
        ),
    }


def fill_catalogue(engine: Engine, count: int) -> None:
    """Add runs with a fit and a diagnosis each to an open database."""
    random = np.random.default_rng(77)
    for first in range(0, count, _BATCH):
        numbers = range(first, min(first + _BATCH, count))
        runs, jobs = zip(*_make_rows(numbers, random), strict=True)
        with engine.begin() as connection:
            connection.execute(insert(RunRow), list(runs))
            connection.execute(insert(JobRow), [job for pair in jobs for job in pair])
    if engine.dialect.name == "postgresql":
        with engine.begin() as connection:
            connection.execute(text("ANALYZE"))  # the server does so itself a minute after such a change


def _make_rows(
    numbers: range, random: np.random.Generator
) -> Iterator[tuple[dict[str, Any], tuple[dict[str, Any], ...]]]:
    """Yield runs with their two jobs."""
    for number in numbers:
        started = _FIRST + timedelta(hours=number)
        made = {
            "id": f"run-{number:05}", "method": "quick", "specimen": f"MR-{number % _SPECIMENS:04}",
            "operator": "A. Meyer",
            "started": started, "state": "ended", "outcome": "clean", "ending": "completed",
            "log": f"{number}.mcap",
        }  # fmt: skip
        values = {
            name: float(value) for name, value in zip(_PARAMETERS, random.uniform(500, 1500, 14), strict=True)
        }
        fit = {"rmse_n": 1.3, "noise_floor_n": 1.2, "result": "converged", "parameters": values}
        gap = {
            "verdict": "explained", "effects": [_EFFECTS[number % 5]], "explanation": 30 * "Words. ",
            "probability": 0.97, "before_n": 3.1, "after_n": 1.3, "noise_floor_n": 1.2,
            "shrinkage": 0.95, "shrinkage_ci95": [0.91, 0.97],
        }  # fmt: skip
        yield made, (_make_job(number, "identify", started, fit), _make_job(number, "diagnose", started, gap))


def _make_job(number: int, kind: str, made: datetime, summary: dict[str, Any]) -> dict[str, Any]:
    return {
        "id": f"{kind}-{number}", "run_id": f"run-{number:05}", "kind": kind, "key": f"{kind}-{number}",
        "settings": {}, "state": "done", "created": made, "finished": made, "summary": summary, "result": "folder",
    }  # fmt: skip


def main() -> None:
    """Measure a catalogue of any size in any database."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.speed.catalogue", description=__doc__)
    parser.add_argument("--runs", type=int, default=RUN_COUNT, help="number of runs")
    parser.add_argument("--catalogue", metavar="URL", help="empty database; by default a new SQLite file")
    asked = parser.parse_args()
    goals = (30, 100) if asked.runs <= RUN_COUNT else (200, 200)  # [ms]
    run(asked.runs, asked.catalogue, *goals)


if __name__ == "__main__":
    main()
