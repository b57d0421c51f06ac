"""Certificates and checks of the channels of a bench."""

import uuid
from collections.abc import Mapping
from typing import Any, Literal, TypeAlias

from bench.client.session import Session, quote_name

_MOST_RECORDS = 50
"""Number of records of checks that are returned by default."""
CheckName: TypeAlias = Literal["zero", "shunt"]
"""Kind of a check."""


class Calibration:
    """Bench, with the certificates and checks of its channels.

    Args:
        session: session with the service.
        name: name of the bench; None for the only one.
    """

    def __init__(self, session: Session, name: str | None) -> None:
        self._session, self._name = session, name

    def list_certificates(self, channel: str | None = None) -> list[dict[str, Any]]:
        """Return the newest version of every calibration certificate, with its state.

        Args:
            channel: only those of this channel; None for all.

        Raises:
            ClientError: there is no such channel, or the service cannot be reached.
        """
        return list(self._session.get("/certificates", channel=channel)["items"])

    def add_certificate(self, certificate: Mapping[str, Any]) -> dict[str, Any]:
        """Store a calibration certificate and return it with its id.

        Args:
            certificate: document `mrbench.certificate/1`.

        Raises:
            ClientError: the certificate is refused or stored already, or the service cannot be reached.
        """
        return dict(self._session.post(self._add_choice("/certificates"), certificate, key=uuid.uuid4().hex))

    def correct_certificate(self, certificate_id: str, reason: str, **changes: object) -> dict[str, Any]:
        """Store a correction of a certificate as its next version, and return that.

        Args:
            certificate_id: id of the certificate.
            reason: reason of the correction.
            changes: new values of date, due, points, uncertainty, standard or note.

        Raises:
            ClientError: the correction is refused, or the service cannot be reached.
        """
        return dict(
            self._session.patch(f"/certificates/{quote_name(certificate_id)}", {"reason": reason, **changes})
        )

    def withdraw_certificate(self, certificate_id: str, reason: str) -> dict[str, Any]:
        """Withdraw a certificate, which stays visible, and return it.

        Raises:
            ClientError: it is withdrawn already, or the service cannot be reached.
        """
        return dict(self._session.delete(f"/certificates/{quote_name(certificate_id)}", reason=reason))

    def list_checks(
        self, channel: str | None = None, limit: int = _MOST_RECORDS, check: CheckName = "zero"
    ) -> list[dict[str, Any]]:
        """Return the newest records of checks, one for each run and channel.

        Args:
            channel: only those of this channel; None for all.
            limit: largest number of records.
            check: `zero` for the mean at rest, `shunt` for the change of the force by the shunt.

        Raises:
            ClientError: there is no such channel or check, or the service cannot be reached.
        """
        page = self._session.get("/checks", channel=channel, limit=limit, bench=self._name, check=check)
        return list(page["items"])

    def get_check_chart(
        self, channel: str, specimen: str | None = None, check: CheckName = "zero"
    ) -> dict[str, Any]:
        """Return the control chart of a channel: centre, limits, points, state in words.

        Args:
            channel: such as `force`.
            specimen: mounted damper during the checks; None for that of the latest check.
            check: kind of the checks, `zero` or `shunt`.

        Raises:
            ClientError: there is no such channel or check, or the service cannot be reached.
        """
        path = f"/checks/{quote_name(channel)}/chart"
        return dict(self._session.get(path, specimen=specimen, bench=self._name, check=check))

    def begin_check_baseline(
        self, channel: str, reason: str, specimen: str | None = None, check: CheckName = "zero"
    ) -> dict[str, Any]:
        """Let only checks from now on count in the chart of a channel, and return that chart.

        Args:
            channel: such as `force`.
            reason: reason, such as a repair, for people.
            specimen: mounted damper during the checks; None for that of the latest check.
            check: kind of the checks, `zero` or `shunt`.

        Raises:
            ClientError: it is refused, or the service cannot be reached.
        """
        path = self._add_choice(f"/checks/{quote_name(channel)}/baseline")
        request = {"reason": reason, "specimen": specimen, "check": check}
        return dict(self._session.post(path, request, key=uuid.uuid4().hex))

    def _add_choice(self, path: str) -> str:
        """Return a path with the name of the bench in its query, if there is one."""
        return path if self._name is None else f"{path}?bench={quote_name(self._name)}"
