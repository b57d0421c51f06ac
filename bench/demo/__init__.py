"""Demonstration: all processes of a bench, recordings over the wires, fit, diagnosis and report."""

from bench.demo.demo import Demo
from bench.demo.folder import DemoFolder
from bench.demo.processes import start_processes

__all__ = [
    "Demo",
    "DemoFolder",
    "start_processes",
]
