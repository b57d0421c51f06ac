"""Signatures of reports and audit trail of the fake service; models and trail are the real ones."""

import hashlib
import shutil
import tempfile
import weakref
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from fastapi import APIRouter, FastAPI, Request
from fastapi.responses import HTMLResponse, JSONResponse

from bench.audit import Act, AuditChain, Source, make_signature, read_chain_id
from bench.service.routes import audit
from bench.service.routes.signing.views import CopyView, SignatureList, SignatureRequest, SignatureView
from tests.support.fake_people import FakePeople

EARLIER = datetime(2025, 3, 4, 9, 40, tzinfo=UTC)
Problem = Callable[..., JSONResponse]


class FakeTrail:
    """Audit trail in a temporary folder, with a request, a refusal, a long value and a stop at the bench."""

    def __init__(self) -> None:
        folder = tempfile.mkdtemp()
        weakref.finalize(self, shutil.rmtree, folder)
        self.path = Path(folder) / "audit.jsonl"
        self.chain = AuditChain(self.path)
        self.get_head = self.chain.get_head
        limits = {"stroke_m": 0.025, "velocity_mps": 0.4, "force_n": 1500.0, "drive": None, "temperature_c": 60.0}
        more = {"actor": "user:mcurie", "origin": "10.0.0.7", "utc": "2025-03-04T09:20:00.000000+00:00"}
        acts = [
            Act(**more, action="POST /runs/{run_id}/notes", target=f"run-{n}", outcome="201") for n in range(60)
        ]
        self.chain.append(
            *acts,
            Act(**more, action="PATCH /specimens/{serial}", target="MR-0042", old={"limits": limits},
                new={"limits": limits | {"force_n": 1800.0}}, outcome="200"),
            Act(**more | {"actor": "user:vguest"}, action="POST /runs", new={"method": "quick"},
                outcome="403 Visiting Guest (viewer) lacks the right operate"),
            self._import_stop(),
        )  # fmt: skip

    def _import_stop(self) -> Act:
        """Return a stop of the rig agent's own trail as an import of it."""
        own = AuditChain(self.path.with_name("agent.jsonl"))
        entry = own.append(Act(actor="local:rig", action="stop", peer="account rig, process 4711", outcome="ok"))[
            0
        ]
        source = Source(chain=read_chain_id(own.path), seq=entry.seq, prev=entry.prev, sha256=entry.sha256)
        return Act(**entry.model_dump(include=set(Act.model_fields) - {"source"}), source=source)


def add_audit_routes(app: FastAPI, trail: FakeTrail) -> None:
    """Add the real routes of the audit trail on a fake trail; those of the certificates have made the context."""
    app.state.context.audit = trail
    app.include_router(audit.router, prefix="/api/v1")


def signature_routes(people: FakePeople, trail: FakeTrail, problem: Problem) -> APIRouter:
    """Create the routes of kept reports and signatures; one report is signed already, and has newer results."""
    router = APIRouter(prefix="/{kind}/{subject}/report")
    copies: dict[str, str] = {}
    signed: dict[str, list[SignatureView]] = {"run-1": [_make_view("runs/run-1", "0c" * 32, 3, "author", EARLIER)]}

    @router.post("/copies", status_code=201)
    async def keep(kind: str, subject: str) -> Any:
        title = f"Report {len(copies) + 1} on {subject}"
        html = f"<!doctype html><html lang='en'><title>Report</title><h1>{title}</h1></html>"
        sha256 = hashlib.sha256(html.encode()).hexdigest()
        copies[sha256] = html
        path = f"/api/v1/{kind}/{subject}/report/copies/{sha256}"
        return CopyView(sha256=sha256, format="html", size=len(html), made=datetime.now(UTC), path=path)

    @router.get("/copies/{sha256}")
    async def read(sha256: str) -> Any:
        return HTMLResponse(copies[sha256])

    @router.get("/signatures")
    async def list_signatures(subject: str) -> Any:
        return SignatureList(items=tuple(signed.get(subject, [])))

    @router.post("/signatures", status_code=201)
    async def sign(kind: str, subject: str, wanted: SignatureRequest, request: Request) -> Any:
        own = people.identify(request)
        assert own is not None
        name = own["person"]["name"]
        if people.passwords[name] != wanted.password.get_secret_value():
            return problem(403, "The present password is wrong", "give the present password", "wrong-password")
        content = {"sha256": wanted.sha256, "meaning": wanted.meaning, "full_name": own["person"]["full_name"]}
        entry = trail.chain.append(make_signature(f"user:{name}", "10.0.0.7", "", subject, content))[0]
        made = _make_view(f"{kind}/{subject}", wanted.sha256, entry.seq, wanted.meaning, datetime.now(UTC))
        made = made.model_copy(
            update={"user": name, "full_name": own["person"]["full_name"], "newer_results": False}
        )
        signed.setdefault(subject, []).append(made)
        return made

    return router


def _make_view(place: str, sha256: str, seq: int, meaning: Any, signed: datetime) -> SignatureView:
    return SignatureView(
        id=f"s-{seq}", sha256=sha256, format="html", made=signed, user="enoether", full_name="Emmy Noether",
        meaning=meaning, signed=signed, audit_seq=seq, file="intact", newer_results=True,
        path=f"/api/v1/{place}/report/copies/{sha256}",
    )  # fmt: skip
