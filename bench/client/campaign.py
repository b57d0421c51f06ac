"""One campaign of the service."""

import base64
import uuid
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from bench.client.polling import wait_for_state
from bench.client.session import Session, quote_name
from bench.client.signed_reports import SignedReports

_POLL_PERIOD = 1.0
"""Time [s] between two requests while a script waits."""
_ENDED = ("done", "stopped")


class Campaign(SignedReports):
    """One campaign; each call requests its present state.

    Args:
        session: session with the service.
        campaign_id: id of the campaign.
    """

    def __init__(self, session: Session, campaign_id: str) -> None:
        self.id = campaign_id
        super().__init__(session, f"/campaigns/{quote_name(campaign_id)}")

    def __repr__(self) -> str:
        return f"Campaign({self.id!r})"

    def get_state(self) -> dict[str, Any]:
        """Return state, queue, cells, trends and newest events.

        Raises:
            ClientError: there is no such campaign, or the service cannot be reached.
        """
        return dict(self._session.get(self._path))

    def pause(self, who: str = "") -> dict[str, Any]:
        """Pause at the next checkpoint; return the state.

        Raises:
            ClientError: the campaign is not running, or the service cannot be reached.
        """
        return self._post("pause", {"who": who})

    def resume(self, who: str = "") -> dict[str, Any]:
        """Continue a paused campaign; return the state.

        Raises:
            ClientError: the campaign is not paused, or the service cannot be reached.
        """
        return self._post("resume", {"who": who})

    def stop(self, who: str = "", *, now: bool = False) -> dict[str, Any]:
        """Stop after the run in progress, with ``now`` that run as well; return the state.

        Raises:
            ClientError: the campaign has ended, or the service cannot be reached.
        """
        return self._post("stop", {"who": who, "now": now})

    def answer(self, note: str = "", who: str = "", choice: str | None = None, photo: Path | None = None) -> Any:
        """Answer a prompt, or decide on a failed step by retry, skip or stop; return the state.

        Raises:
            ClientError: nothing is asked, the answer is refused, or the service cannot be reached.
        """
        content: dict[str, Any] = {"note": note, "who": who, "choice": choice}
        if photo is not None:
            content["photo"] = base64.b64encode(photo.read_bytes()).decode()
        return self._post("answer", content, key=uuid.uuid4().hex)

    def download_photo(self, item: str, to: Path) -> Path:
        """Download the photo of a step's answer, and return its path.

        Raises:
            ClientError: the step has no photo, or the service cannot be reached.
            LogError: the file cannot be written.
        """
        return self._session.download(f"{self._path}/photos/{quote_name(item)}", to)

    def edit(self, edit: Mapping[str, Any], who: str = "") -> dict[str, Any]:
        """Edit the queue, such as ``{"edit": "delete", "item": "s0004"}``; return the state.

        Raises:
            ClientError: the edit is refused, or the service cannot be reached.
        """
        content = {"edit": edit, "who": who}
        return dict(self._session.patch(self._path, content, key=uuid.uuid4().hex))

    def send_test_message(self) -> str:
        """Send a test message to all recipients; return `sent`, or the reasons of failures.

        Raises:
            ClientError: the campaign has no recipients, or the service cannot be reached.
        """
        return str(self._post("test-message", {}, key=uuid.uuid4().hex)["result"])

    def download_report(self, to: Path, report_format: str = "html") -> Path:
        """Download the report, as html or pdf, and return its path; the campaign need not have ended.

        Raises:
            ClientError: the report is not available, the format is unknown, or the download breaks off.
        """
        return self._session.download(f"{self._path}/report?format={quote_name(report_format)}", to)

    def wait(self, timeout: float = 86_400.0) -> dict[str, Any]:
        """Wait until the campaign ends or asks for a person, and return its state.

        Args:
            timeout: longest time to wait [s].

        Raises:
            ClientError: neither has happened in time, or the service cannot be reached.
        """
        return wait_for_state(
            self.get_state,
            _needs_attention,
            timeout,
            lambda state: f"campaign {self.id} is {state['status']} after {timeout:g} s",
            _POLL_PERIOD,
        )

    def _post(self, verb: str, content: Mapping[str, Any], key: str | None = None) -> dict[str, Any]:
        return dict(self._session.post(f"{self._path}/{verb}", content, key))


def _needs_attention(state: Mapping[str, Any]) -> bool:
    return state["status"] in (*_ENDED, "paused") or state["question"] is not None
