"""Right that each operation needs."""

import re
from collections.abc import Callable, Iterator, Mapping

from starlette.routing import compile_path

from bench.people import Right

_BENCH_RIGHTS: Mapping[str, Right] = {
    "POST /stop": "stop",
    "POST /abort": "stop",
    "POST /prepare": "operate",
    "POST /reset": "operate",  # after a trip: reset_trip, see `AFTER_TRIP`
}
"""Right by method and path below that of a bench."""
_BENCH_PATHS = ("/bench", "/benches/{name}")
"""Paths of the only bench, and of a named one."""


def _add_benches(rights: Mapping[str, Right]) -> dict[str, Right]:
    """Return rights below the paths of benches by the whole path."""
    return {
        f"{verb} {start}{path}": right
        for start in _BENCH_PATHS
        for operation, right in rights.items()
        for verb, path in (operation.split(" "),)
    }


OPERATION_RIGHTS: Mapping[str, Right] = {
    **_add_benches(_BENCH_RIGHTS),
    "GET /users": "administer",
    "POST /users": "administer",
    "PATCH /users/{name}": "view",  # one's own password; the route checks the rest
    "DELETE /users/{name}": "administer",
    "GET /audit": "administer",
    "GET /audit/head": "administer",
    "GET /audit/export": "administer",
    "POST /audit/verify": "administer",
    "GET /tokens": "view",  # one's own; the route adds those of others
    "POST /tokens": "view",  # with one's own role at most
    "DELETE /tokens/{token_id}": "view",
    "DELETE /session": "view",
    "POST /session/codes": "view",
    "POST /runs": "operate",
    "PATCH /runs/{run_id}": "operate",
    "DELETE /runs/{run_id}": "manage_runs",
    "POST /runs/{run_id}/stop": "stop",
    "POST /runs/{run_id}/abort": "stop",
    "POST /runs/{run_id}/pause": "operate",
    "POST /runs/{run_id}/resume": "operate",
    "POST /runs/{run_id}/replay": "view",
    "POST /runs/{run_id}/predict": "analyse",
    "POST /runs/{run_id}/identify": "analyse",
    "POST /runs/{run_id}/diagnose": "analyse",
    "POST /runs/{run_id}/integrity": "analyse",
    "POST /runs/{run_id}/notes": "operate",
    "POST /runs/{run_id}/restore": "manage_runs",
    "POST /runs/{run_id}/salvage": "manage_runs",
    "POST /runs/{run_id}/report/copies": "sign_reports",
    "POST /runs/{run_id}/report/signatures": "sign_reports",
    "POST /batches": "analyse",
    "POST /jobs/{job_id}/cancel": "analyse",
    "POST /jobs/{job_id}/retry": "analyse",
    "POST /comparisons": "view",
    "POST /logs": "operate",
    "POST /methods": "manage_methods",
    "POST /methods/dry-run": "view",
    "POST /methods/{name}/{version:int}/approval": "approve_methods",
    "DELETE /methods/{name}/{version:int}/approval": "approve_methods",
    "POST /certificates": "change_limits",
    "PATCH /certificates/{certificate_id}": "change_limits",
    "DELETE /certificates/{certificate_id}": "change_limits",
    "POST /checks/{channel}/baseline": "change_limits",
    "POST /specimens": "operate",
    "PATCH /specimens/{serial:path}": "operate",
    "POST /specimens/{serial:path}/trend": "analyse",
    "POST /campaigns": "operate",
    "POST /campaigns/plan": "view",
    "POST /campaigns/test-message": "operate",
    "PATCH /campaigns/{campaign_id}": "operate",
    "POST /campaigns/{campaign_id}/answer": "operate",
    "POST /campaigns/{campaign_id}/pause": "operate",
    "POST /campaigns/{campaign_id}/resume": "operate",
    "POST /campaigns/{campaign_id}/stop": "stop",
    "POST /campaigns/{campaign_id}/test-message": "operate",
    "POST /campaigns/{campaign_id}/report/copies": "sign_reports",
    "POST /campaigns/{campaign_id}/report/signatures": "sign_reports",
    "PATCH /queue": "operate",
}
"""Right by method and path; other operations that read need `view`, other ones that change need `administer`."""
AFTER_TRIP: Mapping[str, Right] = _add_benches({"POST /reset": "reset_trip"})
"""Right in place of that in `OPERATION_RIGHTS` while a trip is latched."""
_READING = ("GET", "HEAD", "OPTIONS")


class OperationRights:
    """Finds the right that a request needs."""

    def __init__(self, prefix: str) -> None:
        """Look at paths below a prefix, such as ``/api/v1``."""
        self._patterns = [
            (verb, compile_path(prefix + path)[0], operation)
            for operation in OPERATION_RIGHTS
            for verb, path in (operation.split(" "),)
        ]

    def find(self, method: str, path: str, is_tripped: Callable[[str | None], bool] = lambda name: False) -> Right:
        """Return the right for a method and a path.

        Args:
            method: HTTP method.
            path: path of the request.
            is_tripped: returns whether the trip of a bench is latched, by the name in the path; None for none.
        """
        verb = "GET" if method == "HEAD" else method
        found, match = next(self._find_operations(verb, path), (None, None))
        if found is None or match is None:
            return "view" if method in _READING else "administer"
        if found in AFTER_TRIP and is_tripped(match.groupdict().get("name")):
            return AFTER_TRIP[found]
        return OPERATION_RIGHTS[found]

    def _find_operations(self, verb: str, path: str) -> Iterator[tuple[str, re.Match[str]]]:
        """Yield the operations of a request, with the match of their path."""
        matches = ((key, regex.match(path)) for one, regex, key in self._patterns if one == verb)
        yield from ((key, match) for key, match in matches if match is not None)
