"""Instruments of a bench and their samples: one thread per wire, one clock, all channels at the same instants."""

from bench.rig.acquisition import Acquisition, Batch
from bench.rig.alignment import AlignedSamples, Aligner
from bench.rig.clock_map import ClockMap
from bench.rig.instruments import RegisteredInstrument, Rig, build_rig
from bench.rig.priority import (
    PRIORITY_STEP,
    check_priority,
    freeze_memory,
    pause_collection,
    raise_priority,
    reset_priority,
    run_with_priority,
)

__all__ = [
    "PRIORITY_STEP",
    "Acquisition",
    "AlignedSamples",
    "Aligner",
    "Batch",
    "ClockMap",
    "RegisteredInstrument",
    "Rig",
    "build_rig",
    "check_priority",
    "freeze_memory",
    "pause_collection",
    "raise_priority",
    "reset_priority",
    "run_with_priority",
]
