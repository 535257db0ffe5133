"""The posterior around a fit: where its chains start, and that they do not collapse."""

import numpy as np
import pytest
from test_diagnose import QUICK, make

from actuator_glue.diagnosis.diagnose import diagnose
from actuator_glue.diagnosis.posterior import posterior
from actuator_glue.diagnosis.posterior.identifiable import Working
from actuator_glue.diagnosis.telling import advice
from actuator_glue.errors import InputError
from actuator_glue.inference.convergence import rhat_and_ess
from actuator_glue.inference.least_squares.space import Space
from actuator_glue.model.structure import Structure


@pytest.mark.parametrize(
    ('effect', 'size', 'which'),
    [
        pytest.param('valve-deadband', 2e-4, (1,), marks=pytest.mark.slow),
        pytest.param('backlash', 6e-5, (0, 1), marks=pytest.mark.slow),
        pytest.param('backlash', 6e-5, (1,), marks=pytest.mark.slow),
        pytest.param('valve-deadband', 2e-4, (0, 1), marks=pytest.mark.slow),
    ],
)
def test_chains_keep_the_spread_of_the_posterior(
    effect: str, size: float, which: tuple[int, ...]
) -> None:
    """One stiffness leaves a bent ridge in the parameters' logarithms: chains collapsed on it.

    Where the data fix a parameter its posterior is that of the Laplace approximation; the spread
    reported before was a thousandth of it. Under one stiffness alone beta_1 touches a bound.
    """
    records = [make([effect], [size], 31)[i] for i in which]
    quick, found = diagnose(records, settings=QUICK, seed=2), diagnose(records, seed=2)
    assert [e.name for e in found.effects] == [effect]
    assert quick.sampler['method'] == 'laplace' and np.isnan(quick.rhat)
    told = found.sampler
    if told['method'] == 'dream':
        rhat, ess = rhat_and_ess(found.posterior.reshape(-1, 32, found.posterior.shape[1]))
        assert found.rhat == pytest.approx(rhat.max(), rel=0.05)
        assert rhat.max() < 1.15 and ess.min() > 200
    else:
        assert told['effective_draws'] >= 400 and told['pareto_k'] < 0.7 and np.isnan(found.rhat)
    # Over these cases and three seeds of DREAM(ZS): R-hat up to 1.06, ESS from 397, ratios from
    # 0.88 to 1.04 for the effect, 0.84 to 1.01 for beta_1 and 0.93 to 2.14 for what a ridge leaves
    # open.
    for j, factor in ((0, 1.4), (1, 3.0), (2, 3.0), (3, 3.0), (4, 1.3)):
        ratio = found.posterior[:, j].std() / quick.posterior[:, j].std()
        assert 1 / factor < ratio < factor, found.names[j]
    estimate = next(iter(found.effects[0].parameters.values()))
    assert estimate.mean == pytest.approx(size, abs=5 * estimate.stddev)


@pytest.mark.slow
@pytest.mark.usefixtures('few_forms', 'few_names')
def test_chains_that_cannot_begin_lose_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Many parameters pressed against their bounds, around which no point is possible."""

    def refused(*_: object, **__: object) -> None:
        raise InputError('the log density is not finite at any of 35 points to start from')

    monkeypatch.setattr(posterior.importance, 'sample', lambda *args: (None, args[2]))
    monkeypatch.setattr(posterior.posterior, 'sample', refused)
    found = diagnose(make(['delay'], [0.004], 31, 12.0), seed=2)
    assert found.sampler['method'] == 'laplace'
    assert found.structure == ('delay',)


@pytest.mark.slow
def test_effects_that_take_turns_end_in_a_diagnosis() -> None:
    """Delay without a specimen: members were swapped until the last round, whose rivals lacked."""
    found = diagnose(make(['delay'], [0.004], 31)[:1], settings=QUICK, seed=2)
    assert {e.name for e in found.effects} == set(found.structure)


def test_a_posterior_that_has_not_converged_is_told() -> None:
    """Not-a-number is the Laplace approximation, which has no chains."""
    assert advice.unconverged(1.05) == advice.unconverged(np.nan) == ()
    (told,) = advice.unconverged(1.5)
    assert 'R-hat 1.50' in told


def test_chains_start_inside_of_the_bounds_whatever_is_linear_there(rng_seed: int) -> None:
    """A fit on two bounds, beyond which all draws are: they had nowhere to start from."""
    space = Space(Structure(('backlash', 'delay')), 60.0)
    around, rng = Working(space), np.random.default_rng(rng_seed)
    z = 0.5 * (space.lower + space.upper)
    z[[0, 4]], z[5] = space.lower[[0, 4]], space.upper[5]
    fit = around.forward(space.theta(z)[None])[0]
    assert np.isfinite(around.inverse(fit[None])[1]).all()
    beyond = fit + np.abs(rng.standard_normal((200, 6))) * [-9.0, 1.0, 1.0, 1.0, -1e-4, 1.0]
    assert not np.isfinite(around.inverse(beyond)[1]).any()
    points = posterior._inside(around, beyond, fit)
    assert len(points) == 200
    assert np.isfinite(around.inverse(points)[1]).all()
    assert (points.std(axis=0)[1:4] > 0.0).all()


@pytest.mark.parametrize(
    ('rhat', 'evaluations', 'given_up'),
    [(3.4, 4_100, True), (1.5, 4_100, False), (1.33, 8_800, True), (14.0, 2_100, False)],
)
def test_chains_that_cannot_meet_any_more_are_given_up(
    rhat: float, evaluations: int, given_up: bool
) -> None:
    """Far apart at a third of the evaluations, or near their end; not where they just began."""
    assert posterior.hopeless(rhat, evaluations, 10_400) == given_up
    assert not posterior.hopeless(float('nan'), evaluations, 10_400)
