"""Sequencer: plays a compiled method on actuator and coil amplifier."""

from bench.sequencer.command_history import CommandHistory
from bench.sequencer.playback import find_checkpoint_samples, split_into_sections
from bench.sequencer.rod_motion import move_rod
from bench.sequencer.run_observer import RunObserver
from bench.sequencer.sequencer import Sequencer
from bench.sequencer.shunt import check_shunt
from bench.sequencer.trajectory import Times

__all__ = [
    "CommandHistory",
    "RunObserver",
    "Sequencer",
    "Times",
    "check_shunt",
    "find_checkpoint_samples",
    "move_rod",
    "split_into_sections",
]
