"""`mrbench certificate`: calibration certificates of a data folder."""

from bench.commands.certificate.dispatch import certificate

__all__ = ["certificate"]
