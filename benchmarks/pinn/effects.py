"""Effects as terms of the network's residual: dampers with one or two effects, trained with and without them.

    python -m benchmarks.pinn.effects                                  common supported effects, and some pairs
    python -m benchmarks.pinn.effects gas_spring coil_lag+gas_spring   some of them

The recordings have four pairs of amplitude and frequency at six voltages and noise of 1 %. The effects have the
sizes of the shipped scenarios and no initial guess. Only the network is used; nothing is simulated before its end.
"""

import sys
from dataclasses import replace

import numpy as np

from benchmarks.common import make_scenario
from benchmarks.pinn.cases import LABORATORY
from benchmarks.speed import RISING_LEVELS, SHUFFLED_LEVELS, TRAINING_STROKES, VALIDATION_STROKES, make_excitation
from identification.damper.effects import COMMON_EFFECTS, EFFECTS
from identification.fitting import (
    EffectModel,
    Piece,
    Problem,
    SearchSpace,
    compute_rmse,
    measure_scales,
    predict_piece,
)
from identification.pinn import train
from identification.pinn.common import PinnResult, is_supported, read_settings
from identification.simulate import ActiveEffect, SimulationModel

PAIRS = ("coil_lag+magnetic_remanence", "gas_spring+seal_friction", "force_delay+moving_mass")
_SETTLING_SAMPLES = 20
_CLOCK_DEVIATION = 5e-5
"""Clock deviation of the channels [s], as in a diagnosis."""
_HEAD = "  {:<28} {:>8} {:>8} {:>9} {:>7} {:>9}  {}".format(
    "effects", "without", "with", "accepted", "largest", "time", "estimated (true)"
)
_ROW = "  {:<28} {:>8.3f} {:>8.3f} {:>9} {:>7.1f} {:>7.1f} s  {}"

Effects = tuple[ActiveEffect, ...]


def read_shipped_effect(name: str) -> ActiveEffect:
    """Return the effect of the shipped scenario of this name."""
    (entry,) = make_scenario(name, 1.0)["effects"]
    form = EFFECTS[name].find_form(entry.get("form"))
    values = tuple(float(entry["parameters"][q.symbol]) for q in form.parameters)
    return ActiveEffect(EFFECTS[name], values, form.name)


def make_pieces(
    effects: Effects, pairs: tuple[tuple[float, float], ...], levels: tuple[float, ...], seed: int
) -> tuple[Piece, ...]:
    """Simulate strokes of the laboratory damper with effects, at several drive levels [V]."""
    random = np.random.default_rng(seed)
    return tuple(_make_piece(effects, a, f, levels, random) for a, f in pairs)


def _make_piece(
    effects: Effects, amplitude: float, frequency: float, levels: tuple[float, ...], random: np.random.Generator
) -> Piece:
    excitation = make_excitation(amplitude, frequency, levels)
    fitted = np.ones(len(excitation.displacement))
    fitted[:_SETTLING_SAMPLES] = 0.0
    plain = Piece(f"{amplitude} {frequency}", excitation, np.zeros(len(fitted)), fitted)
    law, _ = plain.simulate(SimulationModel(LABORATORY))
    # The dissipated power heats the damper; it is taken from the law, because effects hardly change it.
    heated = replace(plain, excitation=replace(excitation, power=np.abs(law * excitation.velocity)))
    force, _ = heated.simulate(SimulationModel(LABORATORY, effects=effects))
    return replace(heated, force=force + 0.01 * float(force.std()) * random.standard_normal(len(force)))


def compute_validation_ratio(found: PinnResult, effects: Effects) -> float:
    """Return the validation force error of the identified law with its effects over that of the truth [1]."""
    strokes = make_pieces(effects, VALIDATION_STROKES, RISING_LEVELS, 500)
    models = ((found.coordinates, found.delays, found.effects), (LABORATORY, (0.0, 0.0), effects))
    errors = [
        compute_rmse(
            np.concatenate([predict_piece(p, c, delays, effects=active).force - p.force for p in strokes])
        )
        for c, delays, active in models
    ]
    return errors[0] / errors[1]


def compare_training(names: str) -> str:
    """Train without and with the effects; return one line of the table."""
    effects = tuple(read_shipped_effect(name) for name in names.split("+"))
    pieces = make_pieces(effects, TRAINING_STROKES, SHUFFLED_LEVELS, 0)
    noise = 0.01 * float(np.mean([p.force.std() for p in pieces]))
    problem = Problem(
        pieces, SearchSpace(0.0, 0.5, measure_scales(pieces)), noise, _CLOCK_DEVIATION, delay_limit=3.0
    )
    settings = read_settings("elements")
    models = tuple(EffectModel.from_name(e.effect.name, e.form.name) for e in effects)
    without, inside = (train(p, settings) for p in (problem, problem.replace_effects(models)))
    symbols = [q.symbol for c in models for q in c.quantities]
    estimated, true = (np.concatenate([e.values for e in some]) for some in (inside.effects, effects))
    largest = float(np.max(np.abs(estimated - true) / inside.effect_deviations))
    values = ", ".join(f"{s} {a:.3g} ({b:.3g})" for s, a, b in zip(symbols, estimated, true, strict=True))
    accepted = "yes" if inside.accepted else "no"
    return _ROW.format(
        names,
        compute_validation_ratio(without, effects),
        compute_validation_ratio(inside, effects),
        accepted,
        largest,
        inside.seconds,
        values,
    )


def main(names: list[str]) -> None:
    """Print one line for each set of effects."""
    print("validation error over the truth's, without and with the effects; largest error of effect parameters in")
    print("deviations; processor time of the training with the effects")
    print(_HEAD)
    for each in names:
        print(compare_training(each), flush=True)


if __name__ == "__main__":
    main(
        sys.argv[1:]
        or [*(name for name in COMMON_EFFECTS if is_supported(read_shipped_effect(name).form)), *PAIRS]
    )
