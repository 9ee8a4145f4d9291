"""The progress bars: of a rollout, of many runs, and of a film."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from types import TracebackType
from typing import TYPE_CHECKING, Final

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from scla_mj.config import RunConfig

if TYPE_CHECKING:
    from scla_mj.engine.account import Account
    from scla_mj.experiments.campaign import Job, Watch
    from scla_mj.signals import DecisionRecord

_REFRESH_DECISIONS: Final = 10


class RolloutProgress:
    """Decisions done, this epoch's hits, percent of ceiling. Drawn on stderr: stdout is for results."""

    def __init__(self, config: RunConfig) -> None:
        self._decisions = config.decisions
        self._total = config.epochs * config.decisions
        self._bar = Progress(
            TextColumn("epoch {task.fields[epoch]}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[hits]} hits"),
            TextColumn("{task.fields[percent]:.1f} % of ceiling"),
            TimeRemainingColumn(),
            console=Console(stderr=True),
        )
        self._task = self._bar.add_task("rollout", total=self._total, epoch=1, hits=0, percent=0.0)
        self._done = 0

    def update(self, record: DecisionRecord, account: Account) -> None:
        """Show a decision; the bar appears with the first one, so that a refusal stands alone."""
        before, self._done = self._done, (record.epoch - 1) * self._decisions + record.decision
        if before == 0:
            self._bar.reset(self._task, completed=self._done - 1)  # remaining time is estimated from here
            self._bar.start()
        if self._done % _REFRESH_DECISIONS == 0 or self._done == self._total:
            epoch = account.epoch(record.epoch)
            self._bar.update(
                self._task,
                completed=self._done,
                epoch=record.epoch,
                hits=epoch.hits,
                percent=epoch.percent_of_ceiling,
            )

    @property
    def has_begun(self) -> bool:
        """Whether a decision was made."""
        return self._done > 0

    def __enter__(self) -> RolloutProgress:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._done:  # rich ends even a bar that never began with an empty line
            self._bar.stop()


@contextlib.contextmanager
def frames_bar() -> Iterator[Callable[[int, int], None]]:
    """Show a bar from the first frame on; yields the function to call with the frames drawn and their total."""
    columns = (TextColumn("frames"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    progress = Progress(*columns, console=Console(stderr=True))
    bar = progress.add_task("frames")
    with contextlib.ExitStack() as shown:

        def show(count: int, total: int) -> None:
            if not progress.live.is_started:
                shown.enter_context(progress)
            progress.update(bar, completed=count, total=total)

        yield show


@contextlib.contextmanager
def runs_bar() -> Iterator[Watch]:
    """Show how many runs are done; yields the function that counts one."""
    columns = (BarColumn(), MofNCompleteColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    progress = Progress(*columns, TimeRemainingColumn(), console=Console(stderr=True))
    bar = progress.add_task("runs")
    with contextlib.ExitStack() as shown:

        def watch(done: int, total: int, job: Job | None) -> None:
            if job is None:
                shown.enter_context(progress)
            name = f"{job.experiment.name} {job.folder.name}" if job else "runs" if total else "all complete already"
            progress.update(bar, completed=done, total=total, description=name)

        yield watch
