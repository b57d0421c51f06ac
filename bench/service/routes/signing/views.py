"""Requests and answers about signatures of reports."""

from datetime import datetime

from pydantic import Field, SecretStr

from bench.campaign_report import CampaignReportFormat
from bench.catalogue import LogIntegrity, SignatureMeaning
from bench.report.formats import ReportFormat
from bench.service.views import View

_HASH = r"^[0-9a-f]{64}$"


class CopyRequest(View):
    """Request of a report that is kept, so that it can be read and signed."""

    format: ReportFormat = Field(default="html", description="page, PDF, or workbook")


class CampaignCopyRequest(View):
    """Request of a report on a campaign that is kept, so that it can be read and signed."""

    format: CampaignReportFormat = Field(default="html", description="page or PDF")


class CopyView(View):
    """Report that is kept; without a signature, for a day."""

    sha256: str = Field(description="hash of the file, which a signature names")
    format: str
    size: int = Field(description="[bytes]")
    made: datetime = Field(description="UTC")
    path: str = Field(description="address below the service that returns the file")


class SignatureRequest(View):
    """Signature of a kept report by the signed-in person."""

    sha256: str = Field(pattern=_HASH, description="hash of the report that the person has read")
    meaning: SignatureMeaning = Field(description="author, reviewed or approved")
    password: SecretStr = Field(max_length=1000, description="present password of the signed-in person")


class SignatureView(View):
    """One signature."""

    id: str
    sha256: str = Field(description="hash of the signed file")
    format: str = Field(description="of the signed file")
    made: datetime = Field(description="UTC at which the signed file was made")
    user: str = Field(description="name of the user")
    full_name: str = Field(description="full name when the report was signed")
    meaning: SignatureMeaning
    signed: datetime = Field(description="UTC")
    audit_seq: int = Field(description="number of the entry in the audit trail")
    file: LogIntegrity = Field(description="the kept file now: intact, changed or missing")
    newer_results: bool = Field(description="true if results have changed since the signed file was made")
    path: str = Field(description="address below the service that returns the signed file")


class SignatureList(View):
    """Signatures, the oldest first."""

    items: tuple[SignatureView, ...]
