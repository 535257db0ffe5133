"""Estimators as nodes run them, and what their results have in common."""

import pickle
from dataclasses import replace

from online_streams import SETTINGS

from actuator_glue.inference.choice import choose_model
from actuator_glue.online import conversion
from actuator_glue.online.estimator import Estimator
from actuator_glue.online.job import WindowResult, run
from actuator_glue.online.playback import replay
from actuator_glue.online.replay_comparison import differences
from actuator_glue.online.schedule import Schedule
from actuator_glue.online.stream import Preview
from actuator_glue.setups import StreamSetup


def results(items, **more):
    """Results of a replay, events left out."""
    return [r for r in replay(items, more.pop('settings', SETTINGS), **more) if is_result(r)]


def is_result(item):
    return isinstance(item, WindowResult)


def fields(result):
    """Everything a result publishes."""
    bands = [conversion.prediction(p, 'a')[1] for p in (*result.scored, *result.forecast)]
    return [conversion.posterior(result, 0.0)[1], *bands, conversion.response(result)[1]]


def same(one, other):
    """Whether two results publish the same bits."""
    pairs = list(zip(fields(one), fields(other), strict=True))
    return all(not differences(a, Message(b)) for a, b in pairs)


class Message:
    """Fields with attributes, as a message has them."""

    def __init__(self, given):
        self.__dict__.update(given)


class Live:
    """An estimator as the node drives it, some windows slow, dropped, failed or stopped early.

    Other structures are carried from the windows in `requests` on.
    """

    def __init__(self, items, drop=(), stop=None, models=None, fail=(), requests=None, **changes):
        self.results, self.events, self.done, self.models = [], [], {}, []
        estimator = Estimator(replace(SETTINGS, **changes), choose_model(), live=True)
        self.models.append((0, estimator.model))
        busy = 0
        for item in items:
            if isinstance(item, StreamSetup):
                self.events += estimator.setup(item)
            elif isinstance(item, Preview):
                self.events += estimator.preview(item)
            else:
                self.events += estimator.push(item)
            busy -= 1
            if busy > 0:
                continue
            self.events += estimator.drop(lambda _: True)
            if estimator._waiting and (
                wanted := (requests or {}).get(estimator._waiting[0].number)
            ):
                estimator.set_model(wanted)
            job = estimator.next_job()
            if job is None:
                continue
            number = job.window.number
            if job.proposal is not None:
                self.models.append((number, job.proposal))
            if models and number >= models[0] and not job.model.effects:
                estimator.running = None
                estimator._waiting.insert(0, job.window)
                estimator.set_model(models[1])
                job = estimator.next_job()
                self.models.append((number, models[1]))
            asked = iter(range(10**9))
            expired = None if stop is None else (lambda asked=asked: next(asked) >= stop)
            result = run(pickle.loads(pickle.dumps(job)), expired)
            if number in fail:
                result = replace(result, failure='of this test', moments=None)
            self.events += estimator.finish(pickle.loads(pickle.dumps(result)))
            if number in drop:
                busy = 25  # blocks pass by while a window is computed
            if not result.failure:
                self.results.append(result)
                key = (result.window.record.first_index, result.window.record.start_ns)
                self.done[key] = (number, result.spent)

    def schedule(self):
        return Schedule(self.done, tuple(self.models))
