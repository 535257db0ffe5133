"""Cost of one likelihood: fast path, exact kernel and scipy.signal.lfilter, side by side.

Run with `python -m benchmarks.likelihood`; every number is a median over repeats, and the three
take turns within one run, so that a busy machine slows all of them. Each is warm when its time
counts, as in a sampler: one call of lfilter after other work takes up to three times as long.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy import signal

from actuator_glue.model import linear, reference_problem
from actuator_glue.model.exact import ExactErrors
from actuator_glue.model.fast import FastErrors
from actuator_glue.records import Array, Record
from benchmarks.turns import in_turns

G = 256.0
# Moments of the reference posterior of problem R, alpha_3 exponential.
MEAN = np.array([133.65, 1.1005e9, 2.4927e5, 0.00592])
SPREAD = np.array([1.044, 1.128e7, 2.048e3])
CORRELATION = np.array([[1.0, 0.741, 0.05], [0.741, 1.0, 0.68], [0.05, 0.68, 1.0]])


def draws(m: int, seed: int = 0) -> Array:
    """Return thetas spread like the posterior of problem R, shape (m, 4)."""
    rng = np.random.default_rng(seed)
    first = MEAN[:3] + SPREAD * rng.multivariate_normal(np.zeros(3), CORRELATION, m)
    return np.column_stack([first, rng.exponential(MEAN[3], m)])


def log_likelihood(errors: ExactErrors | FastErrors, theta: Array) -> Array:
    """Return Eq. (4) with G = 256, shape (m,)."""
    n = errors.sizes.sum()
    total = errors(theta).sum(axis=1)
    return np.asarray(-G * np.log(total[:, 1] / n - (total[:, 0] / n) ** 2))


def lfilter_sums(records: tuple[Record, ...], theta: Array) -> Array:
    """Return (sum e, sum e^2) of one theta per record by scipy.signal.lfilter, shape (R, 2)."""
    out = np.empty((len(records), 2))
    for row, record in zip(out, records, strict=True):
        num, den = linear.discretise(theta, record.known_stiffness(), record.period)
        e = record.measured - signal.lfilter(num, den, record.command)
        row[:] = e.sum(), (e * e).sum()  # not e @ e: BLAS may start threads for it
    return out


def run(repeats: int = 25) -> dict[str, Any]:
    """Return the costs of one likelihood of problem R and of ten times its length.

    Keys: `fast_us`, `fast_us_10x_window`, `fast_us_batch_8`, `exact_us`, `lfilter_us` per theta of
    the whole problem; `linear_ns` per theta and sample of the exact kernel, `linear_foh_ns` with
    the command linear between samples; `prepare_window_ms` for a window of 10 s at 1 kHz in
    motion, searched and with a hint; `max_abs_error` of the fast log-likelihood over posterior
    draws, `fallback_posterior` and `fallback_prior` the shares of evaluations left to the exact
    kernel; `samples`.
    """
    short, long = reference_problem.records(), reference_problem.records(duration=600.0)
    fast, fast_long, exact = FastErrors(short), FastErrors(long), ExactErrors(short)
    linear_hold = ExactErrors([_with_hold(record) for record in short])
    many, some, one = draws(1024), draws(512), draws(1)[0]
    samples = int(exact.sizes.sum())
    window = _window()
    taken = in_turns(
        {
            'fast': lambda: fast(many),
            'fast_long': lambda: fast_long(many),
            'fast_8': lambda: fast(many[:8]),
            'exact': lambda: exact(some),
            'exact_foh': lambda: linear_hold(some),
            'lfilter': lambda: lfilter_sums(short, one),
            'prepare': lambda: FastErrors([window], 1000, 'measured'),
            'prepare_hint': lambda: FastErrors([window], 1000, 'measured', near=MEAN),
        },
        repeats,
    )
    check = draws(2000, 1)
    errors = [
        np.abs(log_likelihood(f, check) - log_likelihood(f.exact, check))
        for f in (fast, fast_long)
    ]
    shares = {}
    upper = np.array([4e2, 2e10, 1e7, 1e2])
    for name, thetas in (('posterior', check), ('prior', upper * _uniform(2000))):
        fast.fallbacks = 0
        fast(thetas)
        shares[name] = fast.fallbacks / (len(short) * len(thetas))
    return {
        'fast_us': taken['fast'].median / len(many) * 1e6,
        'fast_us_10x_window': taken['fast_long'].median / len(many) * 1e6,
        'fast_us_batch_8': taken['fast_8'].median / 8 * 1e6,
        'exact_us': taken['exact'].median / len(some) * 1e6,
        'lfilter_us': taken['lfilter'].median * 1e6,
        'linear_ns': taken['exact'].median / len(some) / samples * 1e9,
        'linear_foh_ns': taken['exact_foh'].median / len(some) / samples * 1e9,
        'prepare_window_ms': taken['prepare'].median * 1e3,
        'prepare_window_hint_ms': taken['prepare_hint'].median * 1e3,
        'max_abs_error': float(max(error.max() for error in errors)),
        'fallback_posterior': shares['posterior'],
        'fallback_prior': shares['prior'],
        'samples': samples,
    }


def cost_against_length(seconds: tuple[float, ...], repeats: int = 9) -> list[dict[str, float]]:
    """Return samples and microseconds per theta of all three for problems of several lengths."""
    many, some, one = draws(1024), draws(64), draws(1)[0]
    sizes = {'fast_us': len(many), 'exact_us': len(some), 'lfilter_us': 1}
    tasks: dict[str, Callable[[], object]] = {}
    samples = []
    for i, duration in enumerate(seconds):
        records = reference_problem.records(duration=duration)
        fast, exact = FastErrors(records), ExactErrors(records)
        samples.append(float(exact.sizes.sum()))
        tasks[f'fast_us {i}'] = partial(fast, many)
        tasks[f'exact_us {i}'] = partial(exact, some)
        tasks[f'lfilter_us {i}'] = partial(lfilter_sums, records, one)
    taken = in_turns(tasks, repeats)
    return [
        {'samples': count}
        | {name: taken[f'{name} {i}'].median / size * 1e6 for name, size in sizes.items()}
        for i, count in enumerate(samples)
    ]


def _uniform(m: int) -> Array:
    return np.random.default_rng(2).random((m, 4))


def _with_hold(record: Record) -> Record:
    return Record(record.command, record.measured, record.period, record.stiffness, hold='linear')


def _window() -> Record:
    """Return 10 s at 1 kHz from the middle of problem R's second test."""
    return reference_problem.records(rate=1000.0)[1].slice(30_000, 40_000)


def main() -> int:
    """Print the numbers, as a table or as JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument('--json', action='store_true', help='print JSON')
    parser.add_argument('--repeats', type=int, default=25)
    args = parser.parse_args()
    found = run(args.repeats)
    if args.json:
        print(json.dumps(found, indent=2))
        return 0
    for name, value in found.items():
        print(f'{name:24} {value:.4g}')
    print(f'{"lfilter / fast":24} {found["lfilter_us"] / found["fast_us"]:.4g}')
    print(f'{"lfilter / exact":24} {found["lfilter_us"] / found["exact_us"]:.4g}')
    return 0


if __name__ == '__main__':
    sys.exit(main())
