"""Calibration certificate `mrbench.certificate/1` of one channel, as a laboratory has issued it."""

import datetime
import json
import re
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal, Self, TypeAlias

import numpy as np
from pydantic import BeforeValidator, Field, StringConstraints, ValidationError, model_validator

from bench.config import CHANNEL_UNITS, ChannelName
from bench.errors import BenchError
from bench.validation import FrozenModel, describe_validation_error

_DAY = re.compile(r"\d{4}-\d{2}-\d{2}")


def _check_day(value: object) -> object:
    """Refuse what would be taken for a time since 1970, or for a day with a time."""
    if isinstance(value, str) and _DAY.fullmatch(value) is None:
        raise ValueError(f"{value[:40]!r} is not a day; give YYYY-MM-DD, such as 2026-03-02")
    if not isinstance(value, str | datetime.date) or isinstance(value, datetime.datetime):
        raise ValueError("give a day as text YYYY-MM-DD, such as 2026-03-02")
    return value


ShortText: TypeAlias = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=200)]
Day: TypeAlias = Annotated[datetime.date, BeforeValidator(_check_day)]
Number: TypeAlias = Annotated[float, Field(strict=True)]
"""Finite number; a text or a truth value is refused."""
_LEAST_POINTS = 2
"""Smallest number of points that determine a gain."""


class CertificateError(BenchError):
    """A calibration certificate cannot be used."""


class CalibrationPoint(FrozenModel):
    """Value of the standard, and what the channel indicated."""

    reference: Number = Field(description="value of the standard, in the unit of the certificate")
    indicated: Number = Field(description="indication of the channel, in the same unit")


class Uncertainty(FrozenModel):
    """Uncertainty of the indication; the standard uncertainty is the value divided by the coverage factor."""

    value: Number = Field(
        ge=0, description="expanded uncertainty; with a coverage factor of 1 the standard uncertainty"
    )
    kind: Literal["absolute", "relative"] = Field(
        description="absolute: in the unit of the certificate; relative: to the indication, as a number, "
        "such as 0.002 for 0.2 %"
    )
    coverage_factor: Number = Field(ge=1, le=10, description="[1] coverage factor k, usually 2")


class Certificate(FrozenModel):
    """Certificate of one channel."""

    schema_: Literal["mrbench.certificate/1"] = Field(
        default="mrbench.certificate/1", alias="schema", description="name and version of this document type"
    )
    channel: ChannelName = Field(description="channel that was calibrated")
    laboratory: ShortText = Field(description="laboratory that issued the certificate")
    number: ShortText = Field(description="number of the certificate")
    date: Day = Field(description="day of the calibration")
    due: Day = Field(description="last day on which the calibration is valid")
    unit: str = Field(description="unit of points and uncertainty: the SI unit of the channel in the log")
    points: tuple[CalibrationPoint, ...] = Field(
        min_length=_LEAST_POINTS, max_length=1000, description="one series, ordered by rising reference"
    )
    uncertainty: Uncertainty = Field(description="uncertainty of the indication")
    standard: ShortText = Field(description="standard that was used, with its own certificate")
    note: str = Field(default="", max_length=2000, description="text for people")

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.unit != (wanted := CHANNEL_UNITS[self.channel]):
            raise ValueError(
                f"unit {self.unit!r} is not that of channel {self.channel}; "
                f"convert points and uncertainty to {wanted}"
            )
        if self.due < self.date:
            raise ValueError(f"due date {self.due} is before the date of calibration, {self.date}; correct one")
        for name in ("reference", "indicated"):
            self._check_rising(name)
        return self

    def _check_rising(self, name: str) -> None:
        values = [getattr(point, name) for point in self.points]
        for number, (earlier, later) in enumerate(pairwise(values), start=2):
            if not later > earlier:
                raise ValueError(
                    f"points: {name} {later:g} {self.unit} of point {number} is not above {earlier:g} "
                    f"{self.unit} of point {number - 1}; give one series by rising reference, with "
                    "indications of the same sign"
                )

    @property
    def gain_error(self) -> float:
        """Relative error of the gain [1]: slope of the indication over the reference, less one."""
        reference, indicated = np.array([(point.reference, point.indicated) for point in self.points]).T
        return float(np.polyfit(reference, indicated, 1)[0]) - 1

    @property
    def gain_uncertainty(self) -> float:
        """Relative standard uncertainty of the gain [1].

        An absolute uncertainty is related to the largest reference value: it is the error of the gain that causes
        it there.
        """
        standard = self.uncertainty.value / self.uncertainty.coverage_factor
        if self.uncertainty.kind == "relative":
            return standard
        return standard / max(abs(point.reference) for point in self.points)


def parse_certificate(document: object, source: str) -> Certificate:
    """Return a certificate from its document.

    Args:
        document: content of the file.
        source: origin of the document, for messages.

    Raises:
        CertificateError: the document is not a valid certificate; the message names the position.
    """
    try:
        return Certificate.model_validate_json(json.dumps(document))
    except ValidationError as error:
        raise CertificateError(f"{source}: {describe_validation_error(error)}") from None


def read_certificate(path: Path) -> Certificate:
    """Read a certificate from a JSON file.

    Raises:
        CertificateError: the file cannot be read or is not a valid certificate.
    """
    try:
        document = json.loads(path.read_text("utf-8"))
    except OSError as error:
        raise CertificateError(
            f"{path} cannot be read ({error.strerror}); give the file of a certificate"
        ) from None
    except ValueError as error:
        raise CertificateError(
            f"{path} is not a JSON file: {error}; see docs/how-to/keep-calibrations.md"
        ) from None
    return parse_certificate(document, str(path))
