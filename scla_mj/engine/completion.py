"""The end of a run whose decisions are all made: what of it is missing is written from what is there."""

from __future__ import annotations

from pathlib import Path

from scla_mj import paths
from scla_mj.checked import check
from scla_mj.engine.lock import running
from scla_mj.errors import SclaError
from scla_mj.runs.atomic import remove, remove_scratch
from scla_mj.runs.checkpoint import START_AGAIN
from scla_mj.runs.decisions import finish_log, rows_in_stream
from scla_mj.runs.figures import draw, draw_if_possible
from scla_mj.runs.folder import RUN_FILES, Run, open_run
from scla_mj.runs.seal import broken_files, is_sealed, write_seal
from scla_mj.runs.summary import Summary, is_summed_up, read_summary


def check_but_figures(run: Run) -> bool:
    """Refuse a sealed run if one of its files is not as it was left; return whether a figure is not.

    Figures are drawn again, and without its checkpoint a run starts again.

    Raises:
        SclaError: the sentence names the file.
    """
    broken = broken_files(run.path)
    for name, fault in broken.items():
        if name not in (*paths.FIGURES, paths.CHECKPOINT_NPZ):
            raise SclaError(fault)
        if name == paths.CHECKPOINT_NPZ and run.file(name).exists():
            raise SclaError(f"{fault}, or {START_AGAIN}")
    return bool(broken.keys() & set(paths.FIGURES))


def needs_no_decision(run: Run) -> bool:
    """Tell whether `complete` can write all that the run lacks.

    Raises:
        SclaError: its summary is damaged.
    """
    if not is_summed_up(run.path, run.config):
        return False
    return run.file(paths.DECISIONS_PARQUET).exists() or _holds_all(run)


def complete(run: Run, *, pictures: bool) -> Summary:
    """Write what a run that `needs_no_decision` lacks: `decisions.parquet` from its stream, the figures, the seal.

    Raises:
        SclaError: the files of an unsealed run are damaged or do not agree, or the folder cannot be written to.
    """
    stream = run.file(paths.DECISIONS_PARTIAL)
    if stream.exists():
        remove(run.file(paths.SEAL_JSON))
        if _holds_all(run):
            finish_log(run.path)
        remove(stream)
    for name in RUN_FILES:
        remove_scratch(run.file(name))
    if not is_sealed(run.path):
        _check_agreement(run)
    if pictures:
        draw_if_possible(run.path, check(run.config), run.anatomy)
    write_seal(run.path)
    return read_summary(run.path)


def draw_again(path: Path | str) -> list[Path]:
    """Draw the figures of the run in `path` anew, seal them if the run is sealed, and return their files.

    Raises:
        SclaError: there is no run, another process is running it, it was killed before it had a summary and a brain,
            another of its files is damaged, or the figures cannot be drawn.
    """
    run = open_run(path)
    with running(run.path):
        check_but_figures(run)
        for name in (paths.SUMMARY_JSON, paths.BRAIN_NPZ):
            if not run.file(name).exists():
                raise SclaError(f"{run.path} has no {name}, which the figures are drawn from: resume the run first")
        draw(run.path, check(run.config), run.anatomy)
        if is_sealed(run.path):
            write_seal(run.path)
    return [file for name in paths.FIGURES if (file := run.file(name)).exists()]


def _check_agreement(run: Run) -> None:
    """Nothing but their agreement speaks for the files of an unsealed run, and a seal makes them sound."""
    from scla_mj.engine.inspection import inspect_run  # it imports Rerun, which is slow

    found = inspect_run(run.path, held=True)
    if found.verdict != "sound":
        raise SclaError(f"{found.sentence()}; all decisions are made, and nothing else holds what is wrong")


def _holds_all(run: Run) -> bool:
    return rows_in_stream(run.path) == run.config.epochs * run.config.decisions
