"""Size of each form on the laboratory damper.

At both ends of a range the six-drive sine method was simulated without noise, with the other parameters in the
middle of theirs. To first order, the error of a refitted law is 2 times the noise of the force at the lower end,
and 3.5 times at the upper end. A full refit moves further and leaves less, most of all for a lag of the coil. With
other values of the other parameters the error differs as well.
"""

from sim_rig.trial.cases import ValueRange

SIZE_RANGES: dict[str, ValueRange] = {
    "arctangent": ValueRange(0.62, 0.94),
    "closing_loop": ValueRange(0.145, 0.28),
    "eddy_ladder": ValueRange(0.023, 0.032),
    "gas_with_wall": ValueRange(59.0, 114.0),
    "lugre": ValueRange(25.0, 49.0),
    "reynolds_transition": ValueRange(1.11e4, 2.14e4),
    "two_valves": ValueRange(0.057, 0.111),
    "arrhenius_two_nodes": ValueRange(1110.0, 2500.0),
    "relaxing_rubber": ValueRange(3100.0, 6000.0),
    "squeeze_film": ValueRange(1.2e-5, 2.3e-5),
    "closing_joint": ValueRange(1.13e-7, 2.93e-7),
    "mass_with_bracket": ValueRange(12.6, 24.4),
    "bessel_chain": ValueRange(3.1e-3, 5.6e-3),
    "warm_up_and_walk": ValueRange(18.8, 36.5),
    "swelling_harmonics": ValueRange(4.8, 9.2),
    "uneven_winding": ValueRange(7.1e-4, 1.38e-3),
}
"""Range of the first parameter [SI] by form: one form for each common effect of the library."""
