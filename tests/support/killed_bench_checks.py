"""Records of a bench after kills: every run once, with a readable log, and one result of each job."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from bench.catalogue.scan import EMPTY_LOG_MESSAGE, NO_LOG_MESSAGE
from bench.errors import LogError
from bench.jobs.scheduler import MAX_ATTEMPTS
from bench.log import NS_PER_SECOND, read_log, salvage_log
from tests.support.bench_processes import wait_for
from tests.support.tally import Tally

RATE = 1000.0
"""Sampling rate of the runs [Hz]."""
ANALYSED = ("clean", "lossy")
"""Outcomes of runs that the service identifies and diagnoses by itself."""
FOLDERS = {"identify": "fit", "diagnose": "diagnosis"}
"""Kinds of the jobs of a run, and how their folders are named."""
NO_SAMPLE, EMPTY_LOG = "before it wrote a sample", "contains no sample"
"""Parts of messages: of the refusal to repair a log that contains nothing to keep, and of reading an empty one."""
LOG_STATES = ("complete", "salvaged", "without a sample", "no log")


@dataclass
class Records(Tally):
    """Content of the catalogue and the data folder after kills."""

    outcomes: Counter = field(default_factory=Counter)
    logs: Counter = field(default_factory=Counter)
    """Number of logs by `LOG_STATES`."""
    results: Counter = field(default_factory=Counter)
    """Number of jobs by kind and end."""
    attempts: Counter = field(default_factory=Counter)
    """Number of done jobs by their attempts."""
    problems: list = field(default_factory=list)


def check_records(bench, accepted):
    """Wait until everything is settled, and compare catalogue, logs and results.

    Args:
        bench: processes of the bench.
        accepted: ids of the runs whose start was confirmed.
    """
    runs, records = await_records(bench), Records()
    missing = set(accepted) - {run["id"] for run in runs}
    records.problems += [f"accepted run {one} is not in the catalogue" for one in sorted(missing)]
    in_catalogue = Counter(run["log"] for run in runs)
    for log in sorted(bench.data.glob("*.mcap")):
        if in_catalogue[log.name] != 1:
            records.problems.append(f"{log.name} is {in_catalogue[log.name]} times in the catalogue")
    for run in runs:
        records.problems += [f"run {run['id']}: {problem}" for problem in _check_run(bench, run, records)]
    leftovers = [*bench.data.glob(".*.*"), *bench.data.glob(".transfer-*"), *bench.data.glob(".samples/.*")]
    records.problems += [f"leftover {one.relative_to(bench.data)}" for one in leftovers]
    return records


def await_records(bench):
    """Wait until every run has ended and every job that follows is finished; return the runs.

    The queue may be long on a busy machine, so that only a queue without any progress is an error.
    """
    while not all(map(_is_settled, runs := _list_runs(bench))):
        before = _list_states(runs)
        wait_for(
            lambda before=before: _list_states(_list_runs(bench)) != before,
            lambda before=before: f"stuck: {before}",
            1.0,
        )
    return runs


def _list_states(runs):
    return [(run["id"], run["state"], *(f"{job['kind']} {job['state']}" for job in run["jobs"])) for run in runs]


def _list_runs(bench):
    page = wait_for(lambda: bench.get("/runs?limit=200"), lambda: "the service does not list its runs")
    return page["items"]


def _is_settled(run):
    jobs = {job["kind"]: job for job in run["jobs"]}
    awaits_job = run["outcome"] in ANALYSED and not ("diagnose" in jobs or _has_failed(jobs.get("identify")))
    return run["state"] != "running" and not awaits_job and all(job["finished"] for job in run["jobs"])


def _has_failed(job):
    return job is not None and job["state"] == "failed"


def _check_run(bench, run, records):
    """Count a run, its log and its results, and yield what is wrong with them."""
    records.outcomes[run["outcome"] or run["state"]] += 1
    yield from _check_log(bench, run, records)
    if run["outcome"] in ANALYSED:
        for kind in FOLDERS:
            yield from _check_jobs(bench, run, kind, records)
    elif run["jobs"]:
        yield f"{len(run['jobs'])} jobs of a run that is {run['outcome']}"


def _check_log(bench, run, records):
    path = bench.data / run["log"]
    if not path.exists():
        records.logs["no log"] += 1
        if run["reason"] != NO_LOG_MESSAGE:
            yield f"no log, but its reason is {run['reason']!r}"
        return
    if run["reason"] == EMPTY_LOG_MESSAGE:
        records.logs["without a sample"] += 1
        return
    state = "complete"
    if run["state"] == "truncated":
        state = "salvaged" if bench.post(f"/runs/{run['id']}/salvage") else _find_obstacle(path)
    elif run["outcome"] != "clean" and _is_without_sample(path):
        state = "without a sample"  # it ended while the bench moved to the first position
    records.logs[state] += 1
    if state not in LOG_STATES:
        yield state
    elif state != "without a sample":
        yield from _check_samples(path, run)


def _find_obstacle(path):
    """Return why a log cannot be repaired."""
    try:
        salvage_log(path, path.with_suffix(".repaired"))
    except LogError as error:
        return "without a sample" if NO_SAMPLE in str(error) else str(error)
    return "the service refused to repair the log"


def _is_without_sample(path):
    try:
        read_log(path)
    except LogError as error:
        return EMPTY_LOG in str(error)
    return False


def _check_samples(path, run):
    try:
        log = read_log(path)
    except LogError as error:
        yield str(error)
        return
    steps = np.diff(log.samples["time_ns"]) / NS_PER_SECOND * RATE
    if run["outcome"] == "clean" and not np.allclose(steps, 1.0, atol=0.01):
        yield f"clean, but a step between samples is {steps.max():.2f} periods"


def _check_jobs(bench, run, kind, records):
    jobs = [job for job in run["jobs"] if job["kind"] == kind]
    for job in jobs:
        records.results[f"{kind} {job['state']}"] += 1
        records.attempts[job["attempts"]] += job["state"] == "done"
    folders = list(bench.data.glob(f"{run['log'].removesuffix('.mcap')}.{FOLDERS[kind]}-*"))
    done = [job for job in jobs if job["state"] == "done"]
    given_up = [job for job in jobs if job["state"] == "failed" and job["attempts"] >= MAX_ATTEMPTS]
    if len(jobs) != 1 and not (kind == "diagnose" and not jobs and _has_given_up(run)):
        yield f"{len(jobs)} jobs {kind}"
    elif len(done) + len(given_up) != len(jobs):
        yield f"{kind} is {jobs[0]['state']}: {jobs[0]['error']}"
    if len(folders) != len(done):
        yield f"{len(folders)} results of {len(done)} jobs {kind}"


def _has_given_up(run):
    """Return whether the identification was started as often as the service tries; no diagnosis follows then."""
    return any(job["kind"] == "identify" and job["attempts"] >= MAX_ATTEMPTS for job in run["jobs"])
