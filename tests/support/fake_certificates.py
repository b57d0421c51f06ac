"""Certificates and checks of the fake service: routes and stores of the service itself, intervals of its fit."""

import json
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast
from weakref import WeakValueDictionary

from fastapi import APIRouter, FastAPI
from sqlalchemy import StaticPool, create_engine

from bench.calibration import GAIN_FORMULA, combine_estimates, make_log_text, parse_certificate
from bench.catalogue import CertificateStore, IdempotencyKeys
from bench.catalogue.models import Base
from bench.config import DEFAULT_BENCH
from bench.service.benches import ServedBench, ServedBenches
from bench.service.problems import install_handlers
from bench.service.routes.planning import certificates, checks
from tests.support.certificates import issue_certificate, make_certificate, shift
from tests.support.fake_checks import describe_bench, fill_checks

_TABLE = {"points": [{"reference": 0.0, "indicated": 0.0}, {"reference": 0.05, "indicated": 0.04997}]}
_STORED = (
    make_certificate(number="4711-24", date=shift(-800), due=shift(-70)),
    make_certificate(number="4711-26", date=shift(-70), due=shift(295), note="2.5 kN cell, both directions"),
    make_certificate("displacement", "m", number="L-0815", date=shift(-357), due=shift(8), standard="gauge blocks",
                     uncertainty={"value": 4e-6, "kind": "absolute", "coverage_factor": 2}, **_TABLE),
    make_certificate("coil_voltage", "V", number="E-77", laboratory="Testo Industrial Services",
                     date=shift(-400), due=shift(-35), standard="Fluke 8588A"),
)  # fmt: skip


def add_certificate_routes(app: FastAPI, fit: Path) -> None:
    """Add the routes of certificates and checks with some in each usual state, and of the intervals of a fit."""
    engine = create_engine("sqlite://", poolclass=StaticPool, connect_args={"check_same_thread": False})
    Base.metadata.create_all(engine)
    store = CertificateStore(engine)
    for document in _STORED:
        store.add(parse_certificate(document, "fake"), "user:mcurie")
    catalogue = SimpleNamespace(
        certificates=store, checks=fill_checks(engine), idempotency_keys=IdempotencyKeys(engine)
    )
    only = SimpleNamespace(name=DEFAULT_BENCH, monitor=SimpleNamespace(describe_bench=describe_bench))
    benches = ServedBenches(cast("list[ServedBench]", [only]))
    app.state.context = SimpleNamespace(catalogue=catalogue, benches=benches, key_locks=WeakValueDictionary())
    install_handlers(app)
    for router in (certificates.router, checks.router):
        app.include_router(router, prefix="/api/v1")
    app.include_router(_fit_routes(json.loads(fit.read_text("utf-8"))), prefix="/api/v1")


def _fit_routes(fit: dict[str, Any]) -> APIRouter:
    router = APIRouter()

    @router.get("/runs/{run_id}/fit/calibration")
    async def calibrated(run_id: str) -> Any:
        day = datetime.now(UTC).date()
        channels = {"force": "N", "displacement": "m"}
        record = {name: make_log_text(issue_certificate(name, unit), day, "") for name, unit in channels.items()}
        parts = {
            part: {
                name: {"value": fit[part][name]["value"], "unit": fit[part][name]["unit"]} | one._asdict()
                for name, one in combine_estimates(fit[part], fit["parameters"]["n"]["value"], record).items()
            }
            for part in ("coordinates", "parameters")
        }
        return {"fit": f"job-{run_id}", "formula": GAIN_FORMULA} | parts

    return router
