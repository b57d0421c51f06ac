"""The simulated rig as a process that serves every instrument on its own wire."""

from sim_rig.server.process import ServerSettings, run_until_stopped
from sim_rig.server.server import TransportOptions

__all__ = [
    "ServerSettings",
    "TransportOptions",
    "run_until_stopped",
]
