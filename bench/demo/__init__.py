"""The demonstration: every process of a bench, one recording over the wires, fit and report."""
