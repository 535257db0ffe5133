"""Likelihoods against their definitions written out sample by sample."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import integrate, signal, stats

from actuator_glue.errors import InputError
from actuator_glue.inference.likelihood import (
    PHI,
    Ar1Likelihood,
    GaussianLikelihood,
    GlueLikelihood,
)
from actuator_glue.model import linear, reference_problem
from actuator_glue.model.exact import ExactErrors
from actuator_glue.model.parameters import TABLE_2
from actuator_glue.records import Array


class Line:
    """Errors of y = theta_0 + theta_1 t in two records: small enough to write everything out."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.records = [(np.arange(n) * 0.1, rng.standard_normal(n)) for n in (7, 12)]

    @property
    def sizes(self) -> Array:
        return np.array([7, 12])

    def residuals(self, theta: Array) -> list[Array]:
        return [y - theta[:, :1] - theta[:, 1:2] * t for t, y in self.records]

    def __call__(self, theta: Array) -> Array:
        return np.stack(
            [np.stack([e.sum(axis=1), (e**2).sum(axis=1)], axis=1) for e in self.residuals(theta)],
            axis=1,
        )


def _thetas(seed: int) -> Array:
    return np.random.default_rng(seed).standard_normal((5, 2))


def test_glue_is_equation_4_over_all_records_together(rng_seed: int) -> None:
    line, theta = Line(rng_seed), _thetas(rng_seed)
    together = np.concatenate(line.residuals(theta), axis=1)
    expected = -64.0 * np.log(together.var(axis=1))
    assert np.allclose(GlueLikelihood(line, 64.0)(theta), expected, rtol=1e-12)


def test_glue_on_the_paper_s_tests() -> None:
    records = reference_problem.records()
    density = GlueLikelihood(ExactErrors(records))
    simulated = [
        linear.simulate(TABLE_2, r.command, stiffness=r.stiffness, period=r.period)
        for r in records
    ]
    together = np.concatenate([r.measured - s for r, s in zip(records, simulated, strict=True)])
    assert np.isclose(density(TABLE_2[None])[0], -256.0 * np.log(together.var()), rtol=1e-10)


def test_gaussian_with_sigma_is_the_density_up_to_its_constant(rng_seed: int) -> None:
    line, theta = Line(rng_seed), _thetas(rng_seed)
    together = np.concatenate(line.residuals(theta), axis=1)
    expected = stats.norm.logpdf(together, scale=0.3).sum(axis=1)
    found = GaussianLikelihood(line, 0.3)(theta)
    assert np.allclose(np.diff(found), np.diff(expected), rtol=1e-10)


def test_gaussian_without_sigma_is_its_integral_over_sigma(rng_seed: int) -> None:
    line, theta = Line(rng_seed), _thetas(rng_seed)
    together = np.concatenate(line.residuals(theta), axis=1)

    def evidence(e: Array) -> float:
        def integrand(log_sigma: float) -> float:
            return float(np.exp(stats.norm.logpdf(e, scale=np.exp(log_sigma)).sum() + 40.0))

        return float(np.log(integrate.quad(integrand, -4.0, 6.0, limit=400)[0]))

    expected = np.array([evidence(e) for e in together])
    assert np.allclose(np.diff(GaussianLikelihood(line)(theta)), np.diff(expected), rtol=1e-6)


@pytest.mark.parametrize('phi', [0.0, 0.7, -0.4, None])
def test_ar1_is_the_multivariate_normal_with_its_variance_integrated_out(
    rng_seed: int, phi: float | None
) -> None:
    line, theta = Line(rng_seed), _thetas(rng_seed)
    phis = np.full(5, phi) if phi is not None else np.array([0.1, 0.5, 0.9, 0.99, 0.3])
    expected = []
    for k, row in enumerate(line.residuals(theta)[0]):
        other = line.residuals(theta)[1][k]
        square, determinant = 0.0, 0.0
        for e in (row, other):
            lag = np.abs(np.subtract.outer(np.arange(len(e)), np.arange(len(e))))
            covariance = phis[k] ** lag / (1.0 - phis[k] ** 2)
            square += e @ np.linalg.solve(covariance, e)
            determinant += np.linalg.slogdet(covariance)[1]
        expected.append(-0.5 * 19 * np.log(square) - 0.5 * determinant)
    full = theta if phi is not None else np.column_stack([theta, phis])
    assert np.allclose(Ar1Likelihood(line, phi)(full), expected, rtol=1e-9)


@pytest.mark.parametrize('phi', [0.0, 0.8])
def test_ar1_on_the_exact_model_finds_the_autocorrelation_of_the_noise(
    rng_seed: int, phi: float
) -> None:
    """False failure below 1e-6: the standard error of phi is 0.03 at the most."""
    rng = np.random.default_rng(rng_seed)
    record = reference_problem.records(duration=10.0)[1]
    clean = linear.simulate(
        TABLE_2, record.command, stiffness=record.stiffness, period=record.period
    )
    noise = signal.lfilter([1.0], [1.0, -phi], 1e-5 * rng.standard_normal(len(record) + 200))
    coloured = replace(record, measured=clean + noise[200:])
    density = Ar1Likelihood(ExactErrors([coloured]))
    grid = np.linspace(0.0, 0.99, 100)
    values = density(np.column_stack([np.tile(TABLE_2, (100, 1)), grid]))
    assert abs(grid[values.argmax()] - phi) < 0.15
    assert PHI.lower == 0.0 and PHI.upper == 1.0


def test_not_a_number_errors_give_no_likelihood() -> None:
    class Diverged:
        sizes = np.array([10])

        def __call__(self, theta: Array) -> Array:
            return np.full((len(theta), 1, 2), np.nan)

    for density in (GlueLikelihood(Diverged()), GaussianLikelihood(Diverged())):
        assert np.isnan(density(np.zeros((2, 1)))).all()


@pytest.mark.parametrize('wrong', [0.0, -1.0, np.nan, np.inf])
def test_what_cannot_be_is_said(wrong: float) -> None:
    line = Line(0)
    with pytest.raises(InputError, match='shaping factor'):
        GlueLikelihood(line, wrong)
    with pytest.raises(InputError, match='standard deviation'):
        GaussianLikelihood(line, wrong)
    with pytest.raises(InputError, match='phi'):
        Ar1Likelihood(line, 1.0 if wrong == 0.0 else wrong)
