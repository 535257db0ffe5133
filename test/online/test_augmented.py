"""After a diagnosis: windows of Eq. (2) with an effect converge within a live window's budget."""

import numpy as np
import pytest
from online_streams import THETA, stream

from actuator_glue.inference.choice import choose_model
from actuator_glue.model import commands
from actuator_glue.model.structure import Structure
from actuator_glue.online.estimator import Estimator
from actuator_glue.online.fitting import batch
from actuator_glue.online.job import run
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.records import Record
from actuator_glue.sample_block import Block
from actuator_glue.setups import StreamSetup

# Sizes that leave about 20 um where Eq. (2) alone is fitted, the demonstration's noise being 10.
SIZES = {
    'backlash': (4e-5,),
    'coulomb-friction': (20.0,),
    'valve-deadband': (4e-5,),
    'gain': (1.05,),
    'specimen-hardening': (-2.5e4,),
    'flow-asymmetry': (0.05,),
    'specimen-gap': (2e-4,),
}
# Evaluations that one core does in 0.4 s at 1 kHz and 5 s, a hop of 1 s.
EVALUATIONS = 12_000
SWAP, END, RATE = 18.0, 21.0, 1000.0


def streamed(effect, seed):
    """The demonstration's sweep, with noise, from sample 10 000 on."""
    command = commands.sweep(RATE, 60.0, 0.0, 10.0, 2e-3)[: round(END * RATE)]
    structure = Structure((effect,))
    theta = np.array([*THETA, *SIZES[effect]])
    clean = Record(command, command, 1.0 / RATE, 250e3, start_ns=10**18)
    noise = 1e-5 * np.random.default_rng(seed).standard_normal(len(command))
    measured = structure.simulate(theta, clean) + noise
    whole = Record(command, measured, 1.0 / RATE, 250e3, start_ns=10**18)
    return whole.slice(12_000, len(whole)), theta


QUICK = ('backlash', 'gain', 'specimen-gap')


@pytest.mark.parametrize(
    'effect', [e if e in QUICK else pytest.param(e, marks=pytest.mark.slow) for e in SIZES]
)
def test_windows_converge_soon_after_a_swap(effect):
    """Two windows may learn the ridge; the third is judged.

    On 5 seeds of each effect R-hat was at most 1.024 and ESS at least 1080.
    """
    record, truth = streamed(effect, seed=list(SIZES).index(effect))
    chains = EstimatorSettings().chains
    settings = EstimatorSettings(
        evaluations=EVALUATIONS * chains // batch(chains), start_evaluations=EVALUATIONS
    )
    estimator = Estimator(settings, choose_model())
    results = []
    for item in stream(record):
        if isinstance(item, StreamSetup):
            estimator.setup(item)
        elif isinstance(item, Block):
            estimator.push(item)
        while (job := estimator.next_job()) is not None:
            result = run(job)
            estimator.finish(result)
            if job.window.end >= SWAP * RATE:
                estimator.set_model(choose_model((effect,)))
            if job.model.effects:
                results.append(result)
    last = results[-1]
    assert len(results) == 3
    assert all(result.evaluations <= EVALUATIONS for result in results)
    assert last.converged and last.rhat.max() <= 1.05
    assert last.ess.min() >= 500.0
    mean, sd = last.moments.mean, last.moments.stddev
    # One record leaves alpha_2 to its prior, which fills the box from the far end.
    assert np.all(np.abs(mean - truth) < 6.0 * sd)
