"""Method documents with a few sine segments, and their programmes."""

from bench.methods import Method, compile_method

LIMITS = {"stroke_m": 0.02, "velocity_mps": 0.3, "acceleration_mps2": 8.0, "force_n": 900.0, "drive": 1.0}


def constant(value):
    return {"kind": "constant", "value": value}


def sine(name, amplitude, frequency, drive, **more):
    """Return a segment of three cycles that is a checkpoint."""
    motion = {"kind": "sine", "amplitude_m": amplitude, "frequency_hz": frequency}
    return {"name": name, "motion": motion, "cycles": 3, "drive": drive, "checkpoint": True, **more}


def hold(name, duration, **more):
    """Return a segment at rest without drive for a duration [s]."""
    return {"name": name, "motion": {"kind": "hold"}, "duration_s": duration, "drive": constant(0.0), **more}


def method_document(*segments, **limits):
    return {
        "schema": "mrbench.method/1",
        "name": "test_method",
        "title": "t",
        "description": "d",
        "rate_hz": 1000.0,
        "drive_kind": "coil_v",
        "limits": {**LIMITS, **limits},
        "segments": list(segments),
    }


def programme(*segments, **limits):
    return compile_method(Method.model_validate(method_document(*segments, **limits)))
