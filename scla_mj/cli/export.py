"""`scla-mj export RUN`: a finished run's data for other programs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro.conf

from scla_mj.errors import SclaError


@dataclass(frozen=True)
class Export:
    """Write what a finished run recorded for other programs (docs/export.md); nothing is overwritten."""

    path: Annotated[Path, tyro.conf.Positional, tyro.conf.arg(metavar="RUN")]
    """A run folder that `scla-mj rollout` wrote, with a recording."""
    nwb: Annotated[Path | None, tyro.conf.arg(metavar="FILE")] = None
    """Neurodata Without Borders: spikes as units, decisions as trials, poses as behaviour. FILE ends in .nwb."""
    parquet: Annotated[Path | None, tyro.conf.arg(metavar="FOLDER")] = None
    """Plain tables: decisions, poses, spikes, mean weights over the run, final weights."""

    def run(self) -> int:
        """Export; return the exit code.

        Raises:
            SclaError: no format is chosen; the run is unfinished, damaged or not recorded; what would be written is
                there already.
        """
        if self.nwb is None and self.parquet is None:
            raise SclaError("nothing is asked for: choose --nwb FILE or --parquet FOLDER, or both")
        from scla_mj.export.nwb import require_new_file, write_nwb
        from scla_mj.export.parquet import make_empty_folder, write_parquet
        from scla_mj.export.source import exportable

        run = exportable(self.path)
        if self.nwb is not None:
            require_new_file(self.nwb)
        if self.parquet is not None:
            make_empty_folder(self.parquet)  # both before either is written
        if self.nwb is not None:
            write_nwb(run, self.nwb)
            print(f"Written:  {self.nwb}")
        for table in [] if self.parquet is None else write_parquet(run, self.parquet):
            print(f"Written:  {table}")
        return 0
