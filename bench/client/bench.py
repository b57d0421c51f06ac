"""A bench, as its service shows it."""

import math
import uuid
from collections.abc import Iterable, Iterator, Mapping
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from typing import Any

from bench.client.calibration import Calibration, CheckName
from bench.client.campaign import Campaign
from bench.client.errors import ClientError
from bench.client.job import Job
from bench.client.live import LiveSamples, iterate_live
from bench.client.multipart import Field
from bench.client.run import Run
from bench.client.session import STOP_TIMEOUT, Session, quote_name
from bench.client.states import RunState, parse_run_state

_PAGE_SIZE = 50
"""Number of runs requested at a time."""
_MOST_METHODS = 500
"""Largest number of listed methods."""
_ASSESSMENT_TIMEOUT = 600.0
"""Longest time [s] for the dry run of a campaign, which assesses each method."""


class Bench(Calibration):
    """Bench behind a service.

    Args:
        url: address of the service, such as ``http://127.0.0.1:8600``; it may contain ``#token=...``.
        token: token of the service; by default that of the address.
        certificate: file with the certificate that an ``https`` service must have; by default those of the system.
        name: name of the bench; needed if the service has several, see `list_benches`.

    Raises:
        ClientError: there is no token, or the file with the certificate cannot be read.
    """

    def __init__(
        self, url: str, token: str | None = None, certificate: Path | None = None, name: str | None = None
    ) -> None:
        super().__init__(Session(url, token, certificate), name)
        self._path = "/bench" if name is None else f"/benches/{quote_name(name)}"
        self._choice = {} if name is None else {"bench": name}  # a service of an older version knows no name

    def list_benches(self) -> list[dict[str, Any]]:
        """Return the benches of the service: name, state, description, run in progress and kind of drive.

        Raises:
            ClientError: the service cannot be reached.
        """
        return list(self._session.get("/benches")["items"])

    def get_state(self) -> str:
        """Return the state of the rig agent: idle, preparing, running, stopping or tripped.

        Raises:
            ClientError: the service or its agent cannot be reached.
        """
        return str(self._session.get(self._path)["state"])

    def list_methods(self) -> list[dict[str, Any]]:
        """Return the newest version of each method: name, version, title, duration and kind of drive.

        Raises:
            ClientError: the service cannot be reached.
        """
        return list(self._session.get("/methods", limit=_MOST_METHODS, bench=self._name)["items"])

    def run(self, run_id: str) -> Run:
        """Return a run by its id; nothing is requested yet."""
        return Run(self._session, run_id)

    def job(self, job_id: str) -> Job:
        """Return a job by its id; nothing is requested yet."""
        return Job(self._session, job_id)

    def list_runs(self, limit: int = _PAGE_SIZE, **search: str | float | datetime) -> list[RunState]:
        """Return the runs that meet all conditions, the newest first.

        Args:
            limit: largest number of runs.
            search: conditions, as `GET /runs` has them: specimen, bench, method, outcome, ending, started_from,
                started_to, effect, parameter with parameter_min and parameter_max (unit of the fit), text.

        Raises:
            ClientError: a condition is refused, or the service cannot be reached.
        """
        # `from` is a keyword of Python, so that it cannot name an argument.
        names = {"started_from": "from", "started_to": "to"}
        conditions = {
            names.get(name, name): value.astimezone(UTC).isoformat() if isinstance(value, datetime) else value
            for name, value in search.items()
        }
        return list(islice(self._iterate_runs(min(limit, _PAGE_SIZE), conditions), limit))

    def start(
        self, method: str | Mapping[str, Any], specimen: str, operator: str = "", resume_after: str = ""
    ) -> Run:
        """Start a run and return it; the bench continues and records it if the script ends.

        Args:
            method: name of a method, or a document `mrbench.method/1`.
            specimen: serial number of the damper.
            operator: name of the person.
            resume_after: checkpoint of the method after which the run starts; empty for its beginning.

        Raises:
            ClientError: the method or the start is refused, or the service or its agent cannot be reached.
        """
        request = {
            "method": method,
            "specimen": specimen,
            "operator": operator,
            "resume_after": resume_after,
            **self._choice,
        }
        return self.run(str(self._session.post("/runs", request, key=uuid.uuid4().hex)["id"]))

    def import_files(
        self,
        *files: Path | str,
        specimen: str = "",
        drive_kind: str | None = None,
        columns: Mapping[str, str] | None = None,
        units: Mapping[str, str] | None = None,
        reversed_columns: Iterable[str] = (),
    ) -> Run:
        """Import recordings of another machine as one run; it is identified and diagnosed as a recorded one.

        Args:
            files: CSV files, each a stretch of the run, or one log.
            specimen: serial number of the damper; a log names its own.
            drive_kind: driver_command_v, coil_v or coil_a; by default by the unit of the drive.
            columns: header in the files by column name, where they differ.
            units: unit in the files by column name, such as ``{"displacement_m": "mm"}``.
            reversed_columns: names of columns that are recorded in the opposite sense.

        Raises:
            ClientError: a file cannot be read or is refused, or the service cannot be reached.
        """
        fields: list[Field] = [("file", Path(file)) for file in files]
        fields += [("specimen", specimen)] if specimen else []
        fields += [("drive_kind", drive_kind)] if drive_kind else []
        fields += [("column", f"{name}={header}") for name, header in (columns or {}).items()]
        fields += [("unit", f"{name}={unit}") for name, unit in (units or {}).items()]
        fields += [("reverse", name) for name in reversed_columns]
        return self.run(str(self._session.upload("/logs", fields, uuid.uuid4().hex)["id"]))

    def start_campaign(self, campaign: Mapping[str, Any], operator: str = "") -> Campaign:
        """Start a campaign and return it; it continues if the script ends.

        Args:
            campaign: document `mrbench.campaign/1`.
            operator: name of the person.

        Raises:
            ClientError: the campaign is refused, or the service cannot be reached.
        """
        request = {"campaign": campaign, "operator": operator, **self._choice}
        return self.campaign(str(self._session.post("/campaigns", request, key=uuid.uuid4().hex)["id"]))

    def plan_campaign(self, campaign: Mapping[str, Any], *, identifiability: bool = True) -> dict[str, Any]:
        """Return the dry run of a campaign: time, heat, disk, limits and identifiability; nothing is started.

        Args:
            campaign: document `mrbench.campaign/1`.
            identifiability: assess what each method can identify, which takes some seconds for each.

        Raises:
            ClientError: the campaign is invalid, or the service cannot be reached.
        """
        quick = {} if identifiability else {"identifiability": False}
        request = {"campaign": campaign, **quick, **self._choice}
        return dict(self._session.post("/campaigns/plan", request, timeout=_ASSESSMENT_TIMEOUT))

    def send_test_message(self, campaign: Mapping[str, Any]) -> str:
        """Send a test message to the recipients of a campaign that is not started.

        Args:
            campaign: document `mrbench.campaign/1`.

        Returns:
            `sent`, or the reasons of failures.

        Raises:
            ClientError: the campaign is invalid or has no recipients, or the service cannot be reached.
        """
        request = {"campaign": campaign}
        return str(self._session.post("/campaigns/test-message", request, key=uuid.uuid4().hex)["result"])

    def find_campaign(self) -> Campaign | None:
        """Return the campaign that holds the bench, or None.

        Raises:
            ClientError: the service cannot be reached.
        """
        held = self._session.get("/queue", bench=self._name)["campaign"]
        return None if held is None else self.campaign(str(held["id"]))

    def campaign(self, campaign_id: str) -> Campaign:
        """Return a campaign by its id; nothing is requested yet."""
        return Campaign(self._session, campaign_id)

    def list_campaigns(self, limit: int = _PAGE_SIZE) -> list[dict[str, Any]]:
        """Return the newest campaigns in short.

        Raises:
            ClientError: the service cannot be reached.
        """
        return list(self._session.get("/campaigns", limit=limit)["items"])

    def start_zero_check(self, specimen: str, operator: str = "") -> Run:
        """Start the zero check of this bench: the rod rests at the middle without drive for 25 s.

        Args:
            specimen: mounted damper, or a word such as `none`; only checks with the same one are compared.
            operator: name of the person.

        Raises:
            ClientError: the start is refused, or the service or its agent cannot be reached.
        """
        return self._start_check("zero", specimen, operator)

    def start_shunt_check(self, specimen: str, operator: str = "") -> Run:
        """Start the shunt check of this bench: 35 s at rest without drive, for 10 s of them with the shunt.

        Args:
            specimen: mounted damper, or a word such as `none`; only checks with the same one are compared.
            operator: name of the person.

        Raises:
            ClientError: the start is refused, such as for a load cell without a shunt, or the service or its agent
                cannot be reached.
        """
        return self._start_check("shunt", specimen, operator)

    def _start_check(self, check: CheckName, specimen: str, operator: str) -> Run:
        method = self._session.get("/checks/charts", bench=self._name, check=check)["method"]
        if method is None:
            raise ClientError("the rig agent does not answer; start it, then repeat the check")
        return self.start(str(method), specimen, operator)

    def live(self, rate_hz: float = math.inf) -> Iterator[LiveSamples]:
        """Yield live samples of all channels as arrays with units, until the caller stops.

        Args:
            rate_hz: largest rate of the samples [Hz]; a faster bench is decimated, which keeps every extreme.

        Raises:
            ClientError: the service refuses, cannot be reached or falls silent.
        """
        return iterate_live(self._session, rate_hz, self._name)

    def stop(self) -> None:
        """Stop a run or a setup step in a controlled way; harmless when nothing moves.

        Raises:
            ClientError: the service or its agent cannot be reached.
        """
        self._session.post(f"{self._path}/stop", timeout=STOP_TIMEOUT)

    def abort(self) -> None:
        """Stop coil and actuator at once by the path of a trip; it latches until `reset`, also if nothing moves.

        Raises:
            ClientError: the service or its agent cannot be reached.
        """
        self._session.post(f"{self._path}/abort", timeout=STOP_TIMEOUT)

    def reset(self) -> None:
        """Reset a trip whose cause is removed; nothing moves.

        Raises:
            ClientError: the cause is not removed, or the service or its agent cannot be reached.
        """
        self._session.post(f"{self._path}/reset")

    def _iterate_runs(self, page_size: int, conditions: Mapping[str, str | float]) -> Iterator[RunState]:
        before = None
        while True:
            page = self._session.get("/runs", limit=page_size, before=before, **conditions)
            yield from map(parse_run_state, page["items"])
            before = page["next"]
            if before is None:
                return
