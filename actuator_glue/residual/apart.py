"""Records that share no explanation may have one each: a channel set differently between tests."""

from __future__ import annotations

from actuator_glue.residual.attribute import removed
from actuator_glue.residual.data import Data
from actuator_glue.residual.score import Scorer, evidence, pooled, splits_of
from actuator_glue.residual.search import Search

# What is set by hand between tests; all other effects belong to the machine.
_SETTINGS = ('gain', 'bias')


def settings_of_records(data: Data, material: float, nats: float) -> tuple[str, ...]:
    """Say which channel setting explains one record alone; empty with a single record.

    Args:
        data: the fitting part, whose records no one structure explains.
        material: rms that counts [m].
        nats: evidence that counts.
    """
    if len(data.records) < 2:
        return ()
    out = []
    for i, record in enumerate(data.records):
        own = Data(
            (record,), (data.masks[i],), (data.initials[i],), (data.strides[i],)
        )  # fmt: skip
        search = Search(own, _SETTINGS)
        base_fit = search.base()
        structure, _ = pooled(own, splits_of(own, base_fit.error))
        search.scorer = Scorer.of(own, splits_of(own, base_fit.error))
        base = search.trial(())
        for trial in search.additions(base):
            left, _ = pooled(own, splits_of(own, trial.fit.error))
            explains = left < max(material, 0.3 * structure)
            if (
                explains
                and removed(base, trial) > material
                and evidence(trial.scores, base.scores) > nats
            ):
                value = float(trial.fit.theta[-1])
                where = record.source or f'record {i + 1}'
                out.append(
                    f'{where} alone is explained by {trial.added} = {value:.4g}: a channel may '
                    'have been set differently between these tests; diagnose them apart'
                )
                break
    return tuple(out)
