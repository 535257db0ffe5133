"""Rows of the kernel's table and switches of its stages: the scheme's own, and those of effects.

The table is flat: row + lane. Only then does the compiler see that rows do not overlap, and writes
vector code for long stages. Every njit that uses these numbers has them compiled in; jit.py goes
by that word to notice when this file changes. An effect takes its rows and its switch in its own
file while the catalogue is imported, in an order that is always the same.
"""

from __future__ import annotations

# Parameter sets worked on at a time: four vectors of eight hide each other's latencies.
LANES = 32


class Numbers:
    """Numbers that are given out once each.

    Args:
        distance: from one to the next.
    """

    def __init__(self, distance: int) -> None:
        self._distance = distance
        self._next = 0
        self._closed = False

    def take(self, count: int) -> range:
        """Return the next `count` numbers.

        Raises:
            RuntimeError: somebody has relied on there being no more.
        """
        if self._closed:
            raise RuntimeError('the compiled step has its rows: put the effect in the catalogue')
        first, self._next = self._next, self._next + count * self._distance
        return range(first, self._next, self._distance)

    def close(self) -> int:
        """Return the end of all numbers; no more are given out."""
        self._closed = True
        return self._next


ROWS, SWITCHES = Numbers(LANES), Numbers(1)

# Where each row begins, one column per parameter set. Coefficients of the scheme (coefficients.py)
(
    GAIN, LAG_SAMPLES, SKEW, NULL, COULOMB,
    VALVE_E, VALVE_Q, VALVE_D, FORCE_F, FORCE_Q, FORCE_X, STIFFNESS, DAMPING_2, MASS_4V,
    # One over the stiffness against an increment: with and without the specimen, where the valve
    # acts on it and where it idles in its dead band.
    ACTING_TOUCHED, IDLE_TOUCHED, ACTING_FREE, IDLE_FREE,
    EXACT_XX, EXACT_XV, EXACT_XU, EXACT_XR, EXACT_VX, EXACT_VV, EXACT_VU, EXACT_VR,
    TRAP_XX, TRAP_XQ, TRAP_XU, TRAP_QX, TRAP_QQ, TRAP_QU,
    # Share of the recorded transducer in the loop, and the error's offset without what transducers
    # show beyond the position.
    FEEDBACK, NULL_ALONE,
    # ... its states (carried on by `advance`) ...
    X, Q, QD, F, R, V, DX, DX_BEFORE, DF, X_EXACT, V_EXACT, X_TRAP, Q_TRAP,
    # What the recorded transducer shows beyond the position, now and a step before, and what a
    # record's noise adds from sample to sample.
    BEYOND, BEYOND_BEFORE, HELD,
    # ... and scratch within one step: command samples and what part of each, command, spool flow,
    # gain of the orifice, flow, balance of forces, the increment.
    PER_CLOCK, IN_SHARE, IN_PART, IN_PART_STOP, IN_U, IN_U_STOP, IN_U_NEXT, IN_U_STOP_NEXT,
    IN_MEAN, IN_SLOPE, IN_JUMP, IN_Q, IN_DQ, IN_GAIN, IN_FLOW, IN_DFLOW,
    IN_PUSH, IN_OIL, IN_STIFF, IN_DX,
    # Where the last Newton step began, and what the increment lies between.
    IN_TRIED, IN_LOW, IN_HIGH,
) = ROWS.take(73)  # fmt: skip

# Of stages that can be skipped: lanes with commands of their own, any effect on the flow, a
# specimen whose force is neither proportional nor has a gap only, the transducer, any expression
# in the loop, one of a force.
ON_LAG, ON_FLOW, ON_CURVED, ON_TRANSDUCER, ON_TERMS, ON_FORCE = SWITCHES.take(6)
# A controller that is shown something else than the position, and one that is shown the record.
ON_BEYOND, ON_FEEDBACK = SWITCHES.take(2)
