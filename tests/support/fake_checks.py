"""Checks of the fake service: a shifted load cell, displacement and shunt in control, and a new coil voltage."""

from datetime import UTC, datetime, timedelta
from types import SimpleNamespace

import numpy as np
from sqlalchemy import Engine
from sqlalchemy.orm import Session

from bench.catalogue import CheckStore, RunRow
from tests.support.checks import MOUNTED, make_records

_CHECKS = 26
_SHIFTED = 2
"""Number of checks since the zero of the load cell has moved."""


def fill_checks(engine: Engine) -> CheckStore:
    """Return a store with one check per day until yesterday."""
    generator = np.random.default_rng(4)
    start = datetime.now(UTC) - timedelta(days=_CHECKS)
    force = generator.normal(0.4, 0.8, _CHECKS)
    force[-_SHIFTED:] += 6.0
    channels = (
        *make_records(force.tolist(), 0.03, start=start),
        *make_records(generator.normal(2e-5, 3e-6, _CHECKS).tolist(), 4e-7, "displacement", "m", start),
        *make_records(generator.normal(0, 2e-4, 7).tolist(), 2e-5, "coil_voltage", "V", start),
    )
    shunt = make_records(generator.normal(1000.0, 0.2, _CHECKS).tolist(), 0.05, start=start, check="shunt")
    shunt = [one.model_copy(update={"run": f"shunt-{one.run}"}) for one in shunt]
    channels += tuple(shunt)
    store = CheckStore(engine)
    with Session(engine) as session, session.begin():
        for index in range(_CHECKS):
            session.add(_make_run(f"run-{index}", start + timedelta(days=index)))
            session.add(_make_run(f"shunt-run-{index}", start + timedelta(days=index), "shunt_check"))
    for run in {one.run for one in channels}:
        store.replace(run, [one for one in channels if one.run == run])
    return store


def describe_bench() -> SimpleNamespace:
    """Return what the charts need of the bench."""
    return SimpleNamespace(drive_kind="coil_v", specimen=MOUNTED)


def _make_run(name: str, started: datetime, method: str = "zero_check") -> RunRow:
    return RunRow(id=name, method=method, started=started, state="ended", log=f"{name}.mcap")
