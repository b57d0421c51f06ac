"""Demonstration: all processes of a bench, recordings over the wires, fit, diagnosis and report."""

from bench.demo.demo import Demo
from bench.demo.folder import DemoFolder

__all__ = [
    "Demo",
    "DemoFolder",
]
