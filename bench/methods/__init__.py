"""Methods: planned strokes as documents, compiled to exact samples before anything moves."""

from bench.methods.compile import Programme, ProgrammeSegment, compile_method
from bench.methods.document import Method, load_method, shipped_methods

__all__ = [
    "Method",
    "Programme",
    "ProgrammeSegment",
    "compile_method",
    "load_method",
    "shipped_methods",
]
