"""Methods: documents of planned strokes, compiled to exact samples before a run."""

from bench.methods.candidate_strokes import make_candidate_strokes
from bench.methods.checkpoints import list_checkpoints, make_remaining_method
from bench.methods.compile import NO_SEGMENT, Programme, ProgrammeSegment, compile_method
from bench.methods.document import DriveKind, Method, list_shipped_methods, load_method, parse_method
from bench.methods.envelope import Envelope, compute_envelope, compute_heat, format_envelope
from bench.methods.kinematics import Array, compute_move, compute_move_duration

__all__ = [
    "NO_SEGMENT",
    "Array",
    "DriveKind",
    "Envelope",
    "Method",
    "Programme",
    "ProgrammeSegment",
    "compile_method",
    "compute_envelope",
    "compute_heat",
    "compute_move",
    "compute_move_duration",
    "format_envelope",
    "list_checkpoints",
    "list_shipped_methods",
    "load_method",
    "make_candidate_strokes",
    "make_remaining_method",
    "parse_method",
]
