"""Agreement of the compiled stack machine with `DefinedFunction` on any expression and curve."""

import numpy as np
import pytest

from sim_rig.plant.defined_effects.functions import make_defined_functions
from sim_rig.plant.defined_effects.stack_machine import FORCE_PLACE, evaluate
from sim_rig.plant.defined_effects.variables import DISPLACEMENT, VELOCITY
from sim_rig.plant.effects import EffectFunctions
from tests.unit.sim_rig.definitions import define

LEAVES = ("displacement", "velocity", "a", "curve", "0", "2", "3", "0.5", "-1.7", "60", "1e-13")
FUNCTIONS = ("abs", "sign", "exp", "log", "tanh", "sin")
OPERATORS = ("+", "-", "*", "/", "**")
CURVE = {"variable": "velocity", "unit": "N", "x": [-1.0, -0.2, 0.0, 0.7], "value": [3.0, -1.0, 2.0, 2.5]}
VALUES = (0.0, 1.0, -1.0, 0.7, 1e-14, -3e-13, -0.31, 2.4, -60.0, 1e9)


def draw_expression(random, depth):
    if depth == 0 or random.random() < 0.1:
        return str(random.choice(LEAVES))
    if random.random() < 0.4:
        return f"{random.choice(FUNCTIONS)}({draw_expression(random, depth - 1)})"
    left, right = draw_expression(random, depth - 1), draw_expression(random, depth - 1)
    return f"({left} {random.choice(OPERATORS)} {right})"


def compile_and_bind(varied, expression, a):
    """Return the expression as compiled code, and as its form evaluates it."""
    entry = define("parallel_force", expression, ["velocity", "displacement"], CURVE, a=a)
    effects = EffectFunctions(varied(effects=[entry]))
    ((form, values),) = effects.select("force_function")
    functions = make_defined_functions(effects)

    def compiled(x, v):
        functions.variables[[DISPLACEMENT, VELOCITY]] = x, v
        return evaluate(functions, FORCE_PLACE)

    return compiled, lambda x, v: form.function({"displacement": x, "velocity": v}, *values)


@pytest.mark.parametrize("seed", range(60))
def test_compiled_code_equals_the_form_on_random_expressions(varied, seed):
    random = np.random.default_rng(seed)
    # All names occur, because a definition may not declare parameters or a curve that it does not use.
    expression = f"{draw_expression(random, 4)} + 0*a*curve"
    compiled, expected = compile_and_bind(varied, expression, float(random.choice([-2.0, 0.0, 0.4])))
    for x in VALUES:
        for v in VALUES:
            np.testing.assert_allclose(compiled(x, v), expected(x, v), rtol=1e-12, atol=1e-300, err_msg=expression)


@pytest.mark.parametrize("velocity", [-2.0, -1.0, -0.6, -0.2, -0.1, 0.0, 0.35, 0.7, 5.0])
def test_a_curve_is_linear_between_its_points_and_constant_beyond_its_ends(varied, velocity):
    compiled, _ = compile_and_bind(varied, "curve + 0*a*curve", 1.0)
    assert compiled(0.0, velocity) == pytest.approx(np.interp(velocity, CURVE["x"], CURVE["value"]), abs=1e-15)
