"""Predictions of a fit or twin on other logs and on planned strokes, with their bands."""

from identification.predict.forecast import forecast_force
from identification.predict.predict import predict_log

__all__ = ["forecast_force", "predict_log"]
