"""What the draws of a posterior predict: displacements, frequency responses, models for others."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from actuator_glue.api import frequency_response as response
from actuator_glue.api.drawn import Drawn, evenly
from actuator_glue.api.ensemble import GivenCommand, commanded, simulated
from actuator_glue.api.frequency_response import FrequencyResponse
from actuator_glue.api.given import OneRecord, one_record_given
from actuator_glue.api.hybrid_meaning import hybrid_meaning
from actuator_glue.api.matlab import under, write_mat
from actuator_glue.api.prediction import Prediction, prediction
from actuator_glue.api.result import Result
from actuator_glue.errors import InputError
from actuator_glue.hybrid.partition import Partition
from actuator_glue.motion import speaking
from actuator_glue.records import Hold, check_stiffness, source_names

if TYPE_CHECKING:
    import control
    from matplotlib.figure import Figure

    from actuator_glue.report import html
    from actuator_glue.report.first_page import FirstPage

_SIDE_BY_SIDE = 3  # responses in a figure


class PosteriorModel(Result):
    """A result whose draws are models of the actuator."""

    __slots__ = ()

    @abstractmethod
    def drawn(self) -> Drawn:
        """Return the draws that are simulated, and under which model.

        Raises:
            InputError: a model that is not the same in all records.
        """

    def predict(
        self,
        command: GivenCommand,
        stiffness: float | None = None,
        *,
        rate: float | None = None,
        hold: Hold | None = None,
    ) -> Prediction:
        """Return where the actuator will be under a command, with 95 % bands.

        The actuator starts at rest at zero, and a new measurement is taken to scatter about the
        model as those did that it was fitted to.

        Args:
            command: a shape (`Command`), a record or a file of one, or samples [m], shape (n,).
            stiffness: specimen stiffness [N/m], 0 for a free actuator; None for what a record
                says, whose displacement counts as measured under its own alone.
            rate: of samples [Hz]; shapes and records have their own.
            hold: how samples run from one to the next, 'zoh' or 'linear'; None for what a record
                says, else 'zoh'.

        Raises:
            InputError: no stiffness, samples without a rate, a record that moves in another unit,
                or draws that diverge.

        Example:
            >>> posterior.predict(Command('earthquake'), 250e3).plot()  # doctest: +SKIP
        """
        of = self.drawn()
        record, measured = commanded(command, stiffness, rate, hold, self.motion)
        moved = simulated(evenly(of.draws), of.names, of.structure, record)
        found = prediction(record, moved, of.residual, measured=measured, problems=of.problems)
        return replace(found, motion=self.motion)

    def frequency_response(
        self, stiffness: float, frequencies: ArrayLike | None = None
    ) -> FrequencyResponse:
        """Return gain, phase and delay of displacement over command with 95 % bands.

        Eq. (2a) with the linear effects of the model; `left_out` names the others.

        Args:
            stiffness: of the specimen [N/m], 0 for a free actuator.
            frequencies: shape (f,) [Hz]; None for 0.1 to 30 Hz.

        Raises:
            InputError: an impossible stiffness or impossible frequencies.
        """
        k = check_stiffness(stiffness)
        return response.frequency_response(self.drawn().some(1000), k, frequencies)

    def plot_bode(
        self, record: OneRecord | None = None, *, stiffness: float | None = None
    ) -> Figure:
        """Return a Bode plot: gain, phase and delay with 95 % bands.

        Args:
            record: a test, whose own response is drawn on top; None for those that were fitted,
                where they are still known.
            stiffness: of the specimen [N/m], in place of a record: nothing measured is drawn.

        Raises:
            InputError: a record of which nothing can be told, or no stiffness.
        """
        of = self.drawn().some(1000)
        shown: list[tuple[str, FrequencyResponse]] = []
        if stiffness is None:
            given = of.records if record is None else (one_record_given(record),)
            called = source_names(test.source for test in (*of.records, *given))
            for test in given[:_SIDE_BY_SIDE]:
                found = response.recorded_response(of, test)
                shown.append((response.title(found, called[test.source]), found))
        if not shown:
            known = of.stiffness if stiffness is None else (check_stiffness(stiffness),)
            for k in known[:_SIDE_BY_SIDE]:
                found = response.frequency_response(of, k)
                shown.append((response.title(found), found))
        if not shown:
            raise InputError('give a record, or a specimen stiffness [N/m] as stiffness=0.0')
        from actuator_glue.api.bode_figure import bode_figure

        return bode_figure(shown)

    def hybrid(self, partition: Partition | Path | str | None) -> str:
        """Return what the actuator means for a hybrid test, in a sentence; empty without one.

        Args:
            partition: the test; a YAML file, or the name of one that comes with the package.

        Raises:
            InputError: a partition that cannot be used.
        """
        if partition is None:
            return ''
        return hybrid_meaning(partition, lambda k, f: self.frequency_response(k, [f]).delay)

    @abstractmethod
    def first_page(self, partition: Partition | Path | str | None = None) -> FirstPage:
        """Return what a person is told first, without a picture.

        Args:
            partition: a hybrid test, of which it is told what the actuator means for it.

        Raises:
            InputError: a partition that cannot be used.
        """

    @abstractmethod
    def page(
        self, partition: Partition | Path | str | None = None, next_command: str = ''
    ) -> html.Page:
        """Return its report; the arguments are those of `report`."""

    def report(
        self,
        path: Path | str,
        partition: Partition | Path | str | None = None,
        next_command: str = '',
    ) -> Path:
        """Write a report, one HTML file, and return its path.

        Args:
            path: where to.
            partition: a hybrid test, of which the first page tells what the actuator means for it.
            next_command: what the first page says to type next; empty for a command over the
                same files.

        Raises:
            InputError: the file cannot be written, or a partition that cannot be used.
        """
        from actuator_glue.report import html
        from actuator_glue.report.page_name import page_path

        with speaking(self.motion):
            return html.write(page_path(path), self.page(partition, next_command))

    def state_space(self, stiffness: float, draw: str | int = 'mean') -> control.StateSpace:
        """Return x/u as a `control.StateSpace`; see `transfer_function`."""
        from actuator_glue.api.transfer import state_space

        return state_space(self.drawn(), stiffness, draw)

    def transfer_function(
        self, stiffness: float, draw: str | int = 'mean'
    ) -> control.TransferFunction:
        """Return the closed-loop actuator x/u, Eq. (2a), as a `control.TransferFunction`.

        Args:
            stiffness: specimen stiffness k [N/m].
            draw: 'mean' of the parameters, 'best' draw, or the number of one.

        Raises:
            InputError: no such draw, or effects that are no rational transfer function.
        """
        from actuator_glue.api.transfer import transfer_function

        return transfer_function(self.drawn(), stiffness, draw)

    def save_mat(self, path: Path | str, stiffness: Sequence[float] | float | None = None) -> Path:
        """Write draws and model to a .mat file for MATLAB; return its path.

        `draws` (m x p), `names`, `units`, `mean`, `covariance`, and `model`: for each stiffness
        Eq. (2a) with the mean of the draws, as `tf(model(1).num, model(1).den)` takes it, and with
        each draw (`num_draws`, `den_draws`). Effects beyond Eq. (2) but a delay are in the draws
        alone.

        Args:
            path: where to.
            stiffness: of specimens [N/m]; None for those of the records.

        Raises:
            InputError: the file cannot be written, or an impossible stiffness.
        """
        of = self.drawn()
        several: Any = of.stiffness if stiffness is None else stiffness
        several = np.ravel(np.asarray(several, dtype=object))
        models = [under(of.draws, of.names, check_stiffness(k)) for k in several]
        units = dict(zip(of.names, of.units, strict=True))
        effects, problems = of.structure.effects, of.problems
        return write_mat(path, of.draws, units, models, effects=effects, problems=problems)
