"""Live data and true state, measured in a real browser on a complete bench with the simulated rig."""

from benchmarks.live.browser import start_script

__all__ = ["start_script"]
