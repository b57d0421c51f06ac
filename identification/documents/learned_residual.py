"""Learned residual of a twin, as part of its document."""

from typing import Annotated, Self

from pydantic import Field, FiniteFloat, model_validator

from identification.documents.document import Document

Row = Annotated[list[FiniteFloat], Field(min_length=1)]


class ResidualUnits(Document):
    """Units of the recordings in which the variables of a residual are expressed."""

    force_n: float = Field(gt=0, description="standard deviation of the force, in N")
    length_m: float = Field(gt=0, description="half of the largest stroke, in m")
    centre_m: float = Field(description="middle of the largest stroke, in m")
    velocity_mps: float = Field(gt=0, description="peak speed, in m/s")
    lowest_drive: float = Field(description="lowest drive, in the unit of the twin's drive")
    highest_drive: float = Field(description="highest drive, in the unit of the twin's drive")


class TwinResidual(Document):
    """Force that law and effects leave, as a Gaussian process over the state of the damper.

    It serves predictions and names no cause. Far from the recorded states it is zero.
    """

    units: ResidualUnits
    rates: dict[str, float] = Field(
        min_length=1, description="reciprocal length scale of each variable on which it depends, without unit"
    )
    points: list[Row] = Field(min_length=1, description="support points over these variables, without unit")
    weights: list[FiniteFloat] = Field(description="weights of the basis functions, in N")
    factor: list[Row] = Field(description="lower Cholesky factor of their precision times `ridge`, row by row")
    ridge: float = Field(gt=0, description="variance of a sample's noise over that of the prior")
    prior_n: float = Field(ge=0, description="standard deviation far from all recorded states, in N")
    rest_n: float = Field(ge=0, description="standard deviation of the unpredicted part, noise included, in N")
    before_n: float = Field(description="RMSE of law and effects on the conditions left out, in N")
    after_n: float = Field(description="RMSE with the residual, each condition predicted from the others, in N")
    conditions: int = Field(ge=2, description="number of conditions that were left out in turn")

    @model_validator(mode="after")
    def _check_sizes(self) -> Self:
        count, width = len(self.points), len(self.rates)
        if any(len(point) != width for point in self.points):
            raise ValueError(f"points: each needs {width} values, one per variable of `rates`")
        if len(self.weights) != count or [len(row) for row in self.factor] != list(range(1, count + 1)):
            raise ValueError(f"weights and factor: each needs {count} rows, one per support point")
        return self
