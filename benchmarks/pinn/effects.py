"""Effects as terms of the network's residual: a damper with one or two effects, learned with and without them.

    python -m benchmarks.pinn.effects                                  the usual ones that it takes, and some pairs
    python -m benchmarks.pinn.effects gas_spring coil_lag+gas_spring   some of them

Four pairs of amplitude and frequency through six voltages, noise of one per cent, effects of the size that the
rig's scenarios have, no guess of it. The network alone: nothing is simulated before it has ended.
"""

import sys
from dataclasses import replace

import numpy as np

from benchmarks.common import make_scenario
from benchmarks.pinn.cases import LABORATORY
from benchmarks.speed import RISING_LEVELS, SHUFFLED_LEVELS, TRAINING_STROKES, VALIDATION_STROKES, make_excitation
from identification.damper.effects import COMMON_EFFECTS, EFFECTS
from identification.fitting import EffectModel, Piece, Problem, SearchSpace, compute_rmse, predict_piece
from identification.pinn import train
from identification.pinn.common import PinnResult, is_supported, read_settings
from identification.simulate import ActiveEffect, SimulationModel

PAIRS = ("coil_lag+magnetic_remanence", "gas_spring+seal_friction", "force_delay+moving_mass")
_SETTLING_SAMPLES = 20
_CLOCK_DEVIATION = 5e-5
"""[s] to which channels are known, as in a diagnosis."""
_HEAD = "  {:<28} {:>8} {:>8} {:>9} {:>7} {:>9}  {}".format(
    "effects", "without", "inside", "accepted", "worst", "time", "found (true)"
)
_ROW = "  {:<28} {:>8.3f} {:>8.3f} {:>9} {:>7.1f} {:>7.1f} s  {}"

Effects = tuple[ActiveEffect, ...]


def read_shipped_effect(name: str) -> ActiveEffect:
    """The effect of the scenario that ships with the rig."""
    (entry,) = make_scenario(name, 1.0)["effects"]
    form = EFFECTS[name].find_form(entry.get("form"))
    values = tuple(float(entry["parameters"][q.symbol]) for q in form.parameters)
    return ActiveEffect(EFFECTS[name], values, form.name)


def make_pieces(
    effects: Effects, pairs: tuple[tuple[float, float], ...], levels: tuple[float, ...], seed: int
) -> tuple[Piece, ...]:
    """Strokes of the laboratory damper with effects, through levels of the drive [V]."""
    random = np.random.default_rng(seed)
    return tuple(_make_piece(effects, a, f, levels, random) for a, f in pairs)


def _make_piece(
    effects: Effects, amplitude: float, frequency: float, levels: tuple[float, ...], random: np.random.Generator
) -> Piece:
    given = make_excitation(amplitude, frequency, levels)
    fitted = np.ones(len(given.displacement))
    fitted[:_SETTLING_SAMPLES] = 0.0
    plain = Piece(f"{amplitude} {frequency}", given, np.zeros(len(fitted)), fitted)
    law, _ = plain.simulate(SimulationModel(LABORATORY))
    # The damper warms by what it dissipates, which is near enough that without the effects.
    warm = replace(plain, excitation=replace(given, power=np.abs(law * given.velocity)))
    force, _ = warm.simulate(SimulationModel(LABORATORY, effects=effects))
    return replace(warm, force=force + 0.01 * float(force.std()) * random.standard_normal(len(force)))


def compute_validation_ratio(found: PinnResult, effects: Effects) -> float:
    """[1] error of the identified law with its effects on other strokes, over that of the truth."""
    strokes = make_pieces(effects, VALIDATION_STROKES, RISING_LEVELS, 500)
    answers = ((found.coordinates, found.delays, found.effects), (LABORATORY, (0.0, 0.0), effects))
    errors = [
        compute_rmse(np.concatenate([predict_piece(p, c, late, effects=own).force - p.force for p in strokes]))
        for c, late, own in answers
    ]
    return errors[0] / errors[1]


def compare_training(names: str) -> str:
    """One line: a training without and one with the effects."""
    effects = tuple(read_shipped_effect(name) for name in names.split("+"))
    pieces = make_pieces(effects, TRAINING_STROKES, SHUFFLED_LEVELS, 0)
    noise = 0.01 * float(np.mean([p.force.std() for p in pieces]))
    problem = Problem(pieces, SearchSpace(0.0, 0.5), noise, _CLOCK_DEVIATION, delay_limit=3.0)
    settings = read_settings("elements")
    choices = tuple(EffectModel.from_name(e.effect.name, e.form.name) for e in effects)
    without, inside = (train(given, settings) for given in (problem, problem.replace_effects(choices)))
    symbols = [q.symbol for c in choices for q in c.quantities]
    there, true = (np.concatenate([e.values for e in some]) for some in (inside.effects, effects))
    worst = float(np.max(np.abs(there - true) / inside.effect_deviations))
    words = ", ".join(f"{s} {a:.3g} ({b:.3g})" for s, a, b in zip(symbols, there, true, strict=True))
    accepted = "yes" if inside.accepted else "no"
    return _ROW.format(
        names,
        compute_validation_ratio(without, effects),
        compute_validation_ratio(inside, effects),
        accepted,
        worst,
        inside.seconds,
        words,
    )


def main(names: list[str]) -> None:
    """One line for each set of effects."""
    print("unseen error over the truth's; worst of the effects' parameters in deviations; time of the one inside")
    print(_HEAD)
    for each in names:
        print(compare_training(each), flush=True)


if __name__ == "__main__":
    main(
        sys.argv[1:]
        or [*(name for name in COMMON_EFFECTS if is_supported(read_shipped_effect(name).form)), *PAIRS]
    )
