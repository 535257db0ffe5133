"""Rows of the kernel's table, and the switches of its stages.

The table is flat: row + lane. Only then does the compiler see that rows do not overlap, and writes
vector code for long stages. Every njit that uses these numbers has them compiled in; jit.py goes
by that word to notice when this file changes.
"""

from __future__ import annotations

# Parameter sets worked on at a time: four vectors of eight hide each other's latencies.
LANES = 32

# Where each row begins, one column per parameter set.
# Coefficients (filled by coefficients.py) ...
(
    GAIN, LAG_SAMPLES, SKEW, NULL, DEADBAND,
    VALVE_E, VALVE_Q, VALVE_D,
    SATURATION, ASYMMETRY, INVERSE_STALL, DROOP, DROOP_HALF, GAIN_DRIFT, INVERSE_ALPHA_2,
    FORCE_F, FORCE_Q, FORCE_X,
    STIFFNESS, DAMPING_2, MASS_4V,
    # One over the stiffness against an increment: with and without the specimen, where the valve
    # acts on it and where it idles in its dead band.
    ACTING_TOUCHED, IDLE_TOUCHED, ACTING_FREE, IDLE_FREE,
    COULOMB, STRIBECK_EXTRA, STRIBECK_BEND, STRIBECK_LAG,
    GAP, HARDENING, HARDENING_CAP, YIELD, INVERSE_YIELD, YIELD_RATIO,
    SHARP_1, SHARP_2, SHARP_4, SHARP_8, SHARP_16,
    BACKLASH, SENSOR_LAG, SENSOR_DECAY,
    EXACT_XX, EXACT_XV, EXACT_XU, EXACT_XR, EXACT_VX, EXACT_VV, EXACT_VU, EXACT_VR,
    TRAP_XX, TRAP_XQ, TRAP_XU, TRAP_QX, TRAP_QQ, TRAP_QU,
    # ... states (filled by run.py, carried on by `advance`) ...
    X, Q, QD, F, R, V, DX, DF, Z, ENVELOPE, LEVEL, BELL, PLAY, PLAY_DX, SENSED,
    X_EXACT, V_EXACT, X_TRAP, Q_TRAP,
    # ... and scratch within one step: command samples and what part of each, command, spool flow,
    # gain of the orifice, flow, balance of forces, the increment.
    PER_CLOCK, IN_SHARE, IN_PART, IN_PART_STOP, IN_U, IN_U_STOP, IN_U_NEXT, IN_U_STOP_NEXT,
    IN_MEAN, IN_SLOPE, IN_Q, IN_DQ, IN_GAIN, IN_FLOW, IN_DFLOW,
    IN_PUSH, IN_OIL, IN_STIFF, IN_REACH, IN_FALL, IN_MIDDLE, IN_SOFT, IN_DX,
) = range(0, 99 * LANES, LANES)  # fmt: skip
SIZE = 99 * LANES

# One flag per stage that can be skipped; ON_FLOW for any effect on the flow, ON_CURVED for any
# specimen whose force is neither proportional nor has a gap only; ON_TERMS for any expression in
# the loop, ON_FORCE for one of a force.
(
    ON_LAG, ON_FLOW, ON_PRESSURE, ON_DROOP, ON_CURVED, ON_STRIBECK, ON_GAP, ON_YIELD,
    ON_TRANSDUCER, ON_TERMS, ON_FORCE,
) = range(11)  # fmt: skip
SWITCHES = 11
