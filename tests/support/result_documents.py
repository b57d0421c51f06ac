"""Fit and diagnosis as documents. Only the standard library is imported, so that quick commands start fast."""

import json


def estimate(value, unit, ci95=None, identifiable=True, note="known to 1 %"):
    return {"value": value, "unit": unit, "ci95": ci95, "identifiable": identifiable, "note": note}


def fit_document(sha256="", **changes):
    delay = {"value": 4.2e-6, "unit": "s", "ci95": [-1e-5, 1.84e-5], "prior_sd": 2e-5, "outside_prior": False}
    document = {
        "schema": "mrbench.fit/1",
        "specimen": "damper 7",
        "drive_kind": "coil_v",
        "drive_unit": "V",
        "drive_range": [0.1, 0.3],
        "parameters": {
            "alpha_a": estimate(5097.3, "N/m", [5062.2, 5132.7]),
            "A": estimate(301.0, "1", None, identifiable=False, note="a gauge"),
            "c0_b": estimate(2196.5, "N s/(m V)", [-900.0, 5300.0], identifiable=False, note="hardly seen"),
        },
        "coordinates": {
            "F_a": estimate(44.862, "N", [44.766, 44.959]),
            "D_y": estimate(2.924e-5, "m", [2.904e-5, 2.944e-5]),
        },
        "nuisances": {"y0": {"strokes": -3.8e-6}, "force_delay": delay, "drive_delay": delay},
        "noise_floor_n": 1.9,
        "floor": {"cycle_to_cycle": 1.91, "high_frequency": 1.89, "basis": "cycle to cycle over 6 cycles"},
        "rmse_n": {"train": 1.98, "validation": None, "held_out": 2.04},
        "nrmse": {"train": 0.016, "validation": None, "held_out": 0.017},
        "per_drive": [],
        "stages": [{"name": "refine", "seconds": 0.6, "rmse_n": 1.98, "iterations": 7, "note": ""}],
        "agreement": None,
        "result": "converged",
        "correlations": {"k0,k1": -0.9392},
        "provenance": {
            "logs": {"strokes.mcap": sha256},
            "version": "0.1.0",
            "seed": 1,
            "settings": {"stages": "refine", "hold_out": None},
        },
    }
    return {**document, **changes}


def write_fit(path, sha256="", **changes):
    path.write_text(json.dumps(fit_document(sha256, **changes)))
    return path


STAGES = ("coil", "damper", "mounting", "force_channel", "displacement_channel")


def diagnosis_document(**changes):
    """A diagnosis that names a late force, as `mrbench diagnose` writes it."""
    late = {
        "name": "force_delay", "stage": "force_channel", "form": "pure_delay",
        "parameters": {"delay": {"value": 0.0041, "unit": "s", "ci95": [0.004, 0.0042]}},
        "share": 1.0, "probability": 0.91, "note": "",
    }  # fmt: skip
    place = {"drive": 0.5, "amplitude_m": 0.01, "frequency_hz": 2.0, "phase": 0.3125, "gap_n": 12.0}
    found = {
        "schema": "mrbench.diagnosis/1", "verdict": "explained", "effects": [late],
        "alternatives": [{"effects": ["coil_lag", "gas_spring"], "probability": 0.05}],
        "probability": 0.9, "unknown_probability": 0.04,
        "gap": {
            "before_n": 13.2, "after_n": 2.6, "noise_floor_n": 2.5, "shrinkage": 0.97,
            "shrinkage_ci95": [0.95, 0.99], "nominal_n": 31.0, "train_before_n": 13.0, "train_after_n": 2.5,
        },
        "where": {
            "stage": "force_channel", "stages": dict.fromkeys(STAGES, 0.01) | {"force_channel": 0.96},
            "map": [place, place | {"drive": 0.0, "phase": 0.0625, "gap_n": 3.0}], "harmonics": [],
            "drift": {}, "explainable": 0.9,
        },
        "next_stroke": {
            "segment": {
                "name": "next", "motion": {"kind": "sine", "amplitude_m": 0.0036, "frequency_hz": 7.86},
                "drive": {"kind": "constant", "value": 1.5},
            },
            "separates": [["force_delay"], ["coil_lag", "gas_spring"]], "expected_n": 2.0, "detectability": 40.0,
        },
        "explanation": "The force lags by 4.1 ms; check the load cell's filter.",
        "notes": ["a gain is visible to calibration only"],
    }  # fmt: skip
    return found | changes


def discovery_document(**changes):
    """Return a cause outside the library: a friction that grows with the square of the displacement."""
    curve = {
        "variable": "displacement", "unit": "N", "x": [-0.01, 0.0, 0.01], "value": [4.0, 0.0, 4.0],
        "lo": [3.0, -1.0, 3.0], "hi": [5.0, 1.0, 5.0],
    }  # fmt: skip
    found = {
        "stage": "damper", "place": "parallel_force", "variables": ["displacement", "velocity"], "curve": curve,
        "rmse_n": 3.1, "log_odds": 40.0, "replaces": ["force_delay"],
        "formula": {
            "expression": "sign(velocity)*(a*displacement**2)",
            "symbols": {"a": {"value": 40000.0, "unit": "N/m^2", "ci95": [39000.0, 41000.0]}},
        },
        "definition": {}, "shrinkage": 0.92, "shrinkage_ci95": [0.88, 0.95],
        "further": [{
            "stage": "mounting", "place": "mounting", "variables": ["acceleration"],
            "curve": curve | {"variable": "acceleration", "lo": None, "hi": None}, "rmse_n": 2.8, "log_odds": 9.0,
        }],
    }  # fmt: skip
    return found | changes
