"""Signed reports of a run or of a campaign."""

from pathlib import Path
from typing import Any

from bench.client.session import Session, quote_name


class SignedReports:
    """Run or campaign, with the signatures of its reports.

    Args:
        session: session with the service.
        path: path of the run or of the campaign.
    """

    def __init__(self, session: Session, path: str) -> None:
        self._session, self._path = session, path

    def list_signatures(self) -> list[dict[str, Any]]:
        """Return the signatures of the reports, the oldest first; persons sign in the page.

        Raises:
            ClientError: there is no such run or campaign, or the service cannot be reached.
        """
        return list(self._session.get(f"{self._path}/report/signatures")["items"])

    def download_signed_report(self, sha256: str, to: Path) -> Path:
        """Download a signed report, byte by byte as it was signed, and return its path.

        Args:
            sha256: hash of the file, from `list_signatures`.
            to: file to write.

        Raises:
            ClientError: there is no such file, or the download breaks off.
            LogError: the file cannot be written.
        """
        return self._session.download(f"{self._path}/report/copies/{quote_name(sha256)}", to)
