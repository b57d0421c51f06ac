"""Noise of the recorded force: its floor, with an interval, from the recording alone."""

from identification.noise.noise_floor import NoiseFloorEstimate, estimate_floor

__all__ = ["NoiseFloorEstimate", "estimate_floor"]
