"""Priors of windows: each sample counted once, equal to the joint posterior, checked, replayed."""

from dataclasses import replace

import numpy as np
import pytest
from online_streams import RATE, SETTINGS, THETA, record, stream
from scipy.stats import kstest

from actuator_glue.errors import InputError
from actuator_glue.inference.carried import Carried
from actuator_glue.inference.choice import choose_model
from actuator_glue.inference.posterior import Problem, sample
from actuator_glue.inference.prior_conflict import Conflict
from actuator_glue.model.parameters import NAMES
from actuator_glue.online import conversion
from actuator_glue.online.estimator import Estimator
from actuator_glue.online.job import WindowResult, run
from actuator_glue.online.knowledge import Knowledge, Known
from actuator_glue.online.playback import replay
from actuator_glue.online.schedule import Schedule
from actuator_glue.online.settings import EstimatorSettings
from actuator_glue.online.stream import Contradicted, Window
from actuator_glue.records import Record
from actuator_glue.sample_block import Block
from actuator_glue.setups import StreamSetup

CALIBRATION = replace(SETTINGS, prior='calibration', drift=0.0)
SEQUENTIAL = replace(SETTINGS, prior='sequential', drift=0.0)


def known(scale=1.0, spread=0.02, seed=0) -> Carried:
    """Draws of a calibration around the true parameters."""
    steps = np.random.default_rng(seed).standard_normal((600, 4))
    return Carried(NAMES, scale * THETA * np.exp(spread * steps))


def told(source, settings, carried=None):
    out = list(replay(stream(source), settings, carried=carried))
    return [r for r in out if isinstance(r, WindowResult)], [
        e for e in out if isinstance(e, Contradicted)
    ]


def test_a_calibration_identifies_what_a_window_cannot():
    alone, _ = told(record(6.0), SETTINGS)
    informed, alarms = told(record(6.0), CALIBRATION, known())
    assert any(alone[-1].prior_dominated) and not any(informed[-1].prior_dominated)
    assert not alarms
    for result in informed:
        low, high = np.quantile(result.frozen.draws, [0.001, 0.999], axis=0)
        assert np.all((low < THETA) & (high > THETA))


def test_each_sample_is_counted_once():
    """The chain of priors that leads to a window holds windows that share no counted sample."""
    estimator = Estimator(SEQUENTIAL, choose_model())
    settle = round(SEQUENTIAL.settle * RATE)
    prior_of, key_of = {}, {}
    for item in stream(record(12.0), 50):
        estimator.setup(item) if isinstance(item, StreamSetup) else estimator.push(item)
        while (job := estimator.next_job()) is not None:
            result = run(job)
            prior_of[job.window.number] = None if job.prior is None else job.prior.key
            key_of[result.learned.key] = job.window
            estimator.finish(result)
    windows = {w.number: w for w in key_of.values()}
    chained = 0
    for number, key in prior_of.items():
        window = windows[number]
        if key is None:
            assert number < 4
            continue
        chained += 1
        before = key_of[key]
        assert before.end <= window.record.first_index + settle
        # The newest of those that may be used.
        later = windows.get(before.number + 1)
        assert later is None or later.end > window.record.first_index + settle
    assert chained > 10


def test_the_sequential_posterior_is_the_joint_one():
    """Prior times likelihood, window by window, is what one fit of these windows gives."""
    settings = replace(SEQUENTIAL, likelihood='gaussian', ess=1000, evaluations=20_000)
    whole = record(14.0, stiffness=250e3)
    found, _ = told(whole, settings, known(spread=0.1))
    chain, at = [], found[-1].window
    settle = round(settings.settle * RATE)
    while True:
        chain.append(at.record)
        earlier = [r.window for r in found if r.window.end <= at.record.first_index + settle]
        if not earlier:
            break
        at = earlier[-1]
    assert len(chain) >= 6
    joint = sample(
        Problem(
            chain,
            choose_model(),
            'gaussian',
            initial='measured',
            settle=settings.settle,
            prior=known(spread=0.1),
        ).target(),
        (5,),
        60_000,
    ).posterior()
    ours = found[-1].frozen.draws
    sd = np.log(joint).std(axis=0)
    # Six normal approximations one after another, from some 1000 effective draws each.
    assert np.all(np.abs(np.log(ours).mean(axis=0) - np.log(joint).mean(axis=0)) < 0.35 * sd)
    assert np.all(np.abs(np.log(np.log(ours).std(axis=0) / sd)) < 0.25)


def test_drift_lets_a_window_follow():
    """After a parameter has moved, a prior without drift holds on to it longer."""
    first, second = record(10.0), record(10.0, seed=4, theta=THETA * [0.93, 1, 1, 1])
    moved = Record(
        np.concatenate([first.command, second.command]),
        np.concatenate([first.measured, second.measured]),
        1 / RATE,
        250e3,
        start_ns=10**18,
    )
    quiet = replace(SEQUENTIAL, contradiction='alarm')
    stiff = told(moved, quiet, known())[0][-1]
    loose = told(moved, replace(quiet, drift_of=('beta_1=2.0',)), known())[0][-1]
    true = 0.93 * THETA[0]
    assert abs(loose.moments.mean[0] - true) < abs(stiff.moments.mean[0] - true)


@pytest.mark.parametrize('answer', ['widen', 'restart', 'alarm'])
def test_a_prior_that_is_wrong_is_told_dated_and_answered(answer):
    settings = replace(CALIBRATION, contradiction=answer, shaping_factor=2000.0)
    found, alarms = told(record(12.0), settings, known(scale=np.array([1.25, 1, 1, 1])))
    assert alarms and alarms[0].since == 0 and 'contradicts' in alarms[0].message
    last = found[-1].conflict
    if answer == 'alarm':
        assert len(alarms) > 1
    elif answer == 'restart':
        assert last is None and any(found[-1].prior_dominated)
    else:
        assert last.p_value > 0.05 > found[0].conflict.p_value


def test_a_prior_that_is_right_is_not_contradicted():
    """Six runs, 0.003 hours each: an alarm in any of them is expected once in 5400 times."""
    for seed in range(6):
        assert not told(record(12.0, seed=seed), CALIBRATION, known(seed=seed))[1]


def test_a_replay_is_identical_bit_for_bit():
    """What was live and what a bag's set-up says agree, drops included."""
    settings = replace(SEQUENTIAL, drift=0.5)
    once, _ = told(record(9.0), settings, known())
    message = type('M', (), conversion.estimator_setup(settings, choose_model(), 0, 0, known()))
    again = list(
        replay(
            stream(record(9.0), 37),
            conversion.estimator_settings(message),
            carried=conversion.carried(message),
        )
    )
    twice = [r for r in again if isinstance(r, WindowResult)]
    assert len(once) == len(twice) > 5
    for one, other in zip(once, twice, strict=True):
        assert one.moments.mean.tobytes() == other.moments.mean.tobytes()
        assert one.conflict == other.conflict


def test_a_first_window_without_a_posterior_changes_no_later_prior():
    """The calibration's age counts from the stream's start, in a replay that lacks it, too."""
    settings = replace(SEQUENTIAL, drift=0.5)
    live, done, once = Estimator(settings, choose_model(), carried=known()), {}, []
    for item in stream(record(6.0)):
        live.setup(item) if isinstance(item, StreamSetup) else live.push(item)
        while (job := live.next_job()) is not None:
            if job.window.number == 0:
                live.abandon('no posterior was reached')
                continue
            once.append(run(job))
            live.finish(once[-1])
            first = job.window.record
            done[first.first_index, first.start_ns] = job.window.number, once[-1].spent
    again = replay(stream(record(6.0)), settings, schedule=Schedule(done), carried=known())
    twice = [r for r in again if isinstance(r, WindowResult)]
    assert len(once) == len(twice) > 5
    for one, other in zip(once, twice, strict=True):
        assert one.moments.mean.tobytes() == other.moments.mean.tobytes()


def window(number, start_ns, segment=1):
    """A window of five seconds, one a second."""
    still = np.zeros(500)
    of = Record(still, still, 0.01, 250e3, start_ns=start_ns, first_index=100 * number)
    return Window(number, of, 1, segment, of)


@pytest.mark.parametrize('first_ns', [0, 1, 10**18])
def test_a_prior_drifts_from_the_first_stamp_on(first_ns):
    """Also where the clock of the laboratory began with the test."""
    knowledge = Knowledge(replace(CALIBRATION, drift=0.02, settle=0.0), known())
    spread = []
    for hours in (0, 1, 4):
        at = window(3600 * hours, first_ns + hours * 3600 * 10**9)
        knowledge.formed(at)
        spread.append(knowledge.prior(at).spread[0])
    assert spread == pytest.approx([0.0, 0.02, 0.04], abs=1e-3)


@pytest.mark.parametrize('back', [0, -20, 3, 20, 200])
def test_a_prior_is_checked_whatever_the_clock_does(back):
    """A machine that changes as the clock is set back: alarms at the same windows."""

    def alarms(step):
        settings = EstimatorSettings(prior='calibration', contradiction='alarm')
        knowledge, told = Knowledge(settings, known()), []
        for i in range(70):
            late = 10**12 + (i - (step if i >= 40 else 0)) * 10**9
            at = window(i, late, int(i >= 40))
            knowledge.prior(at)
            told += knowledge.learn(at, None, Conflict(50.0, 2, 1e-6 if i >= 40 else 0.5))
        return [alarm.number for alarm in told]

    assert alarms(back) == alarms(0) and 40 < alarms(0)[0] < 50


def test_windows_are_learned_from_whatever_the_clock_does():
    """A posterior that came with a model holds samples of before the clock was set back."""
    handed = Known(known(), 10**12 - 10**10, 10**12)
    knowledge = Knowledge(EstimatorSettings(prior='sequential'), None, handed)
    own = [known(seed=i) for i in range(20)]
    for i in range(20):
        late = 10**12 + (i - (200 if i >= 8 else 0)) * 10**9
        at = window(i, late, int(i >= 8))
        before = knowledge.prior(at)
        knowledge.learn(at, own[i], None)
        # A window counts from half a second on: it may follow those that ended before that.
        if i in (3, 15):
            assert before is not None and before.key == (
                handed.carried.key if i == 3 else own[10].key
            )
        if i == 8:
            assert before is None


def test_memory_is_bounded():
    estimator = Estimator(SEQUENTIAL, choose_model())
    most = 0
    for item in stream(record(20.0), 50):
        estimator.setup(item) if isinstance(item, StreamSetup) else estimator.push(item)
        while (job := estimator.next_job()) is not None:
            estimator.finish(run(job))
            most = max(most, len(estimator._members.leading.knowledge._learned))
    assert most <= 2 + SEQUENTIAL.window / SEQUENTIAL.hop


def test_another_actuator_has_no_prior_of_the_first():
    items = [*stream(replace(record(6.0), actuator='one'))]
    index = 1200
    for item in stream(replace(record(6.0, seed=3), actuator='two')):
        if isinstance(item, StreamSetup):
            items.append(replace(item, index=index))
        elif isinstance(item, Block):
            items.append(
                replace(item, index=item.index + index, stamp_ns=item.stamp_ns + 6 * 10**9)
            )
    found = [r for r in replay(items, SEQUENTIAL) if isinstance(r, WindowResult)]
    second = [r for r in found if r.window.record.actuator == 'two']
    assert second[0].conflict is None and found[6].conflict is not None


@pytest.mark.parametrize(
    ('changes', 'words'),
    [
        ({'prior': 'none'}, 'prior'),
        ({'contradiction': 'ignore'}, 'contradiction'),
        ({'drift': -1.0}, 'drift'),
        ({'drift_of': ('beta_1:2',)}, 'NAME=RATE'),
        ({'false_alarms': 0.0}, 'false_alarms'),
    ],
)
def test_settings_that_cannot_be_are_refused(changes, words):
    with pytest.raises(InputError, match=words):
        EstimatorSettings(**changes)


@pytest.mark.slow
@pytest.mark.timeout(3600)
@pytest.mark.parametrize('drift', [0.0, 0.3])
def test_ranks_of_the_truth_are_uniform(drift, rng_seed):
    """Simulation-based calibration of carried and sequential priors (Talts et al. 2018).

    Truth from the prior, then a random walk of its logarithm from window to window; the rank of
    the last truth among the last window's draws. Each actuator's sampler has a seed of its own:
    with one for all, the same random numbers, ranks of all cases lean the same way. Eight tests:
    fails by chance once in 1000 runs.
    """
    rng = np.random.default_rng(rng_seed)
    settings = replace(
        SEQUENTIAL, hop=2.0, drift=drift, likelihood='gaussian', contradiction='alarm'
    )
    ranks = []
    for _ in range(200):
        theta = THETA * np.exp(0.05 * rng.standard_normal(4))
        pieces = []
        for step in range(5):
            if step:
                theta = theta * np.exp(drift * np.sqrt(2.0 / 3600.0) * rng.standard_normal(4))
            pieces.append(record(2.0, seed=int(rng.integers(2**31)), theta=theta))
        posterior = None
        drawn = replace(settings, seed=int(rng.integers(2**31)))
        carried = known(spread=0.05, seed=int(rng.integers(2**31)))
        estimator = Estimator(drawn, choose_model(), carried=carried)
        for n, piece in enumerate(pieces):
            moved = replace(piece, first_index=400 * n, start_ns=10**18 + 2 * n * 10**9)
            for item in stream(moved, 400):
                if isinstance(item, StreamSetup):
                    estimator.setup(item)
                else:
                    estimator.push(item)
            while (job := estimator.next_job()) is not None:
                result = run(job)
                estimator.finish(result)
                posterior = result.frozen.draws
        chosen = posterior[:: max(1, len(posterior) // 50)][:50]
        ranks.append((chosen < theta).sum(axis=0))
    smooth = (np.array(ranks) + rng.random((len(ranks), 4))) / 51.0
    for i, name in enumerate(NAMES):
        p = kstest(smooth[:, i], 'uniform').pvalue
        print(f'{name}: p {p:.3f}', np.histogram(smooth[:, i], 10, (0, 1))[0])
        assert p > 1e-3 / 8, name


def test_a_window_that_was_cut_short_gives_a_posterior_and_no_prior():
    """Of an overloaded computer: 30 draws are told as they are, and nothing is learned of them."""
    estimator = Estimator(SEQUENTIAL, choose_model(), carried=known())
    for item in stream(record(3.0)):
        estimator.setup(item) if isinstance(item, StreamSetup) else estimator.push(item)
    estimator.finish(run(estimator.next_job()))
    short = run(estimator.next_job(), lambda: True)
    assert not short.failure and short.moments is not None
    assert len(short.draws) < 50 and short.learned is None
    assert estimator.finish(short) == []
    message = type('M', (), conversion.draws(short)[1])
    assert conversion.known(message, SEQUENTIAL) is None
    assert run(estimator.next_job()).learned is not None


def test_what_no_window_tells_goes_through_the_chain_as_it_was():
    """Five windows one after another, sampled with other random numbers each time."""
    settings = replace(SEQUENTIAL, window=2.0, hop=1.75, settle=0.25)
    ends = []
    for seed in range(4):
        results, _ = told(record(10.0), replace(settings, seed=seed), known())
        ends.append(np.log(results[-1].learned.draws))
    means = np.array([draws.mean(axis=0) for draws in ends])
    sds = np.array([draws.std(axis=0) for draws in ends])
    # Means of 400 draws, five times, would scatter by a ninth of a standard deviation.
    assert (means.std(axis=0, ddof=1) < 0.05 * sds.mean(axis=0)).all()
    assert (sds.std(axis=0, ddof=1) < 0.05 * sds.mean(axis=0)).all()
