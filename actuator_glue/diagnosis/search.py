"""Refit Eq. (2) with effects added: screening of starting sizes, then the joint refit."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from actuator_glue.diagnosis import global_search
from actuator_glue.diagnosis.data import Data, Model
from actuator_glue.diagnosis.fit import Fit, base_starts, fit, sum_of_squares
from actuator_glue.diagnosis.score import Scorer
from actuator_glue.model.effects import CATALOGUE, Effect, Scale, scale
from actuator_glue.model.parameters import BASE
from actuator_glue.model.structure import Structure
from actuator_glue.records import Array

_P = len(BASE)
_COARSE = 8  # iterations of every refit; those in the running go on
_TOLERANCE = 1e-4
_PROMISING = 0.95  # of the error at most is left by friction that is looked at twice
_POLISHED = 4
_STARTS = 4  # starting sizes that survive the screening (the kernel works on 32 at a time)


@dataclass(frozen=True)
class Trial:
    """One refitted structure.

    Attributes:
        structure: its effects stand in the catalogue's order, learned terms last.
        added: the effect that was added last.
        fit: base and effects refitted together.
        scores: out-of-sample log density of every block (B,) [nats].
        own: the model where it is not `structure` (see diagnosis/per_record_settings.py).
    """

    structure: Structure
    added: str
    fit: Fit
    scores: Array
    own: Model | None = None

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of its effects."""
        return self.structure.effects

    @property
    def model(self) -> Model:
        """What simulates it."""
        return self.own or self.structure

    @property
    def mean_square(self) -> float:
        """Mean squared free-run error [m^2]."""
        return float(np.mean(self.fit.error**2))


def _by_score(trial: Trial) -> float:
    return -float(trial.scores.sum())


@dataclass
class Search:
    """All structures tried on one data set, each refitted once.

    Attributes:
        data: the counted samples.
        scorer: noise and blocks; set once the base is fitted.
        entries: all effects there are, in the order in which they stand in a structure; those
            of the catalogue, and learned terms that nothing else knows.
        names: effects that act on the mean response.
        jobs: threads (the kernels release the interpreter lock).
    """

    data: Data
    names: tuple[str, ...]
    jobs: int = 1
    scorer: Scorer | None = None
    entries: dict[str, Effect] = field(default_factory=lambda: dict(CATALOGUE))
    _tried: dict[frozenset[str], Fit] = field(default_factory=dict)
    _signatures: dict[str, tuple[Array, Array]] = field(default_factory=dict)
    _polished: set[frozenset[str]] = field(default_factory=set)
    _descended: set[tuple[frozenset[str], tuple[str, ...]]] = field(default_factory=set)

    def base(self) -> Fit:
        """Fit Eq. (2) from a grid of starts."""
        model = Structure(())
        starts = base_starts(self.data)
        sums = sum_of_squares(self.data.target - self.data.simulate(model, starts))
        best = fit(self.data, model, starts[np.argsort(sums)[:4]], iterations=60)
        self._tried[frozenset()] = best
        return best

    def scale(self) -> Scale:
        """Sizes of this test at the fitted base."""
        return scale(self.data.records, self._tried[frozenset()].theta)

    def structure(self, *effects: str) -> Structure:
        """Return the structure of these effects, in their order."""
        return Structure(e for name, e in self.entries.items() if name in effects)

    def trial(self, effects: tuple[str, ...], added: str = '') -> Trial:
        """Score an already refitted structure with the current noise."""
        assert self.scorer is not None
        found = self._tried[frozenset(effects)]
        return Trial(self.structure(*effects), added, found, self.scorer.block_scores(found))

    def add(self, current: Trial, name: str) -> Trial:
        """Refit `current` with one more effect."""
        model = self.structure(*current.effects, name)
        key = frozenset(model.effects)
        if key not in self._tried:
            starts = self.screen(current, name)[1]
            coarse = fit(self.data, model, starts, iterations=_COARSE, tolerance=_TOLERANCE)
            friction = not current.effects and self.entries[name].group == 'friction'
            if friction and coarse.rms < _PROMISING * current.fit.rms:
                coarse = global_search.refit(self.data, model, coarse, _COARSE, _TOLERANCE)
            self._tried[key] = coarse
        return self.trial(model.effects, name)

    def polish(self, trial: Trial) -> Trial:
        """Finish the refit of a trial that is in the running."""
        key = frozenset(trial.effects)
        if key not in self._polished:
            again = fit(self.data, trial.structure, self._tried[key].theta)
            self._tried[key] = again
            self._polished.add(key)
        return self.trial(trial.effects, trial.added)

    def _signature(self, name: str) -> tuple[Array, Array]:
        """Starting sizes of an effect (s, k) and what each adds to Eq. (2) as fitted (s, N)."""
        if name not in self._signatures:
            base = self._tried[frozenset()]
            model = self.structure(name)
            thetas = model.starts(base.theta, self.scale())
            output = self.data.simulate(model, thetas)
            signature = output - (self.data.target - base.error)
            self._signatures[name] = thetas[:, model.columns(name)], signature
        return self._signatures[name]

    def signatures(self) -> Array:
        """What every effect adds to Eq. (2) as fitted, at all its starting sizes (s, N) [m]."""
        rows = np.concatenate([self._signature(name)[1] for name in self.names])
        return np.asarray(rows[np.isfinite(rows).all(axis=1)])

    def screen(self, current: Trial, name: str) -> tuple[float, Array]:
        """Project the residual on an effect's signatures, current parameters refitted linearly.

        Returns:
            The largest share of the squared error that one of the effect's starting sizes can
            remove, and the starting parameters that promise most (s, p).
        """
        effect = self.entries[name]
        neutral = np.array(
            [p.neutral if p.neutral is not None else 0.0 for p in effect.parameters]
        )
        rows, signature = self._signature(name)
        lower = np.array([p.lower for p in effect.parameters])
        upper = np.array([p.upper for p in effect.parameters])
        names = [p.name for p in effect.parameters]
        model = self.structure(*current.effects, name)
        is_new = np.array([p.name in names for p in model.parameters])

        def join(values: Array) -> Array:
            thetas = np.empty((len(values), len(is_new)))
            thetas[:, is_new] = values
            thetas[:, ~is_new] = current.fit.theta
            return thetas

        alive = np.asarray(np.isfinite(signature).all(axis=1))
        signature = np.where(alive[:, None], signature, 0.0)
        jac = current.fit.jacobian
        scales = np.sqrt(np.einsum('pn,pn->p', jac, jac))
        jac = jac[scales > 0] / scales[scales > 0, None]
        inverse = np.linalg.pinv(jac @ jac.T, rcond=1e-9)
        error = current.fit.error - jac.T @ (inverse @ (jac @ current.fit.error))
        free = signature - (signature @ jac.T @ inverse) @ jac
        free[np.abs(free).max(axis=1) > 1.0] = 0.0  # a metre of residual: it diverged
        power = np.einsum('sn,sn->s', free, free)
        cross = free @ error
        amount = np.where(power > 0, cross / np.maximum(power, 1e-300), 0.0)
        amount = np.clip(amount, 0.05, 4.0)
        as_is = power - 2.0 * cross
        scaled = amount**2 * power - 2.0 * amount * cross
        # Every size as it stands, and scaled to what the residual asks for.
        sizes = np.concatenate([rows, rows])
        sizes[len(rows) :, 0] = neutral[0] + amount * (rows[:, 0] - neutral[0])
        sizes = np.clip(sizes, lower, upper)
        merit = np.concatenate([as_is, scaled])
        merit[np.tile(~alive, 2)] = np.inf
        chosen = np.argsort(merit, kind='stable')[:_STARTS]
        share = np.where(power > 0, cross**2 / np.maximum(power, 1e-300), 0.0)
        return float(share[alive].max(initial=0.0) / (error @ error)), join(sizes[chosen])

    def additions(
        self,
        current: Trial,
        names: Iterable[str] | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> list[Trial]:
        """Refit `current` with every further effect, best out-of-sample score first."""
        wanted = [n for n in (names or self.names) if n not in current.effects]

        def one(name: str) -> Trial:
            return self.add(current, name)

        out: list[Trial] = []
        with ThreadPoolExecutor(max(1, self.jobs)) as pool:
            for i, trial in enumerate(pool.map(one, wanted)):
                out.append(trial)
                if progress is not None:
                    progress((i + 1) / len(wanted))
            out.sort(key=_by_score)
            # Only what is near the best is worth the last digits.
            near = 1.5 * out[0].mean_square if out else 0.0
            polished = pool.map(
                lambda t: self.polish(t[1]) if t[0] < 2 or t[1].mean_square < near else t[1],
                list(enumerate(out))[:_POLISHED],
            )
            out = [*polished, *out[_POLISHED:]]
        return sorted(out, key=_by_score)

    def screened(self, current: Trial, names: Iterable[str]) -> list[str]:
        """Sort effects by what their signatures could remove from the present residual."""
        with ThreadPoolExecutor(max(1, self.jobs)) as pool:
            wanted = list(names)
            shares = list(pool.map(lambda n: self.screen(current, n)[0], wanted))
        return [wanted[i] for i in np.argsort(-np.array(shares), kind='stable')]

    def without(self, current: Trial, name: str) -> Trial:
        """Refit a structure with one effect taken away, from where the larger one stands.

        A smaller structure that was fitted before may have stopped in a worse minimum than the
        larger one leads to: the effect would then be credited with what only the start gained.
        """
        effects = tuple(n for n in current.effects if n != name)
        key = frozenset(effects)
        if (key, current.effects) not in self._descended:
            self._descended.add((key, current.effects))
            names = {p.name for p in self.entries[name].parameters}
            keep = np.array([p.name not in names for p in current.structure.parameters])
            start = np.stack([current.fit.theta[keep], current.fit.theta[keep]])
            start[1, :_P] = self._tried[frozenset()].theta
            again = fit(self.data, self.structure(*effects), start)
            known = self._tried.get(key)
            if known is None or again.rms < known.rms:
                self._tried[key] = again
            self._polished.add(key)
        return self.trial(effects)
