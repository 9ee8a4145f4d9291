"""Keep docs/results and README in step with the model's bits.

Without OUT it writes the table of the ladder into README and, where the bits have moved on since the results were made,
the notice into README and report. With OUT, the folder of a `reproduce`, it first takes that report into docs/results,
after the present code has made the first decisions of one run of every experiment again. `--check` writes nothing: it
is the release check.
"""

from __future__ import annotations

import json
import re
import shutil
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import tyro

from scla_mj.engine.build import simulate
from scla_mj.errors import SclaError
from scla_mj.experiments.report.origin import bits_digest
from scla_mj.runs.decisions import read_decisions, row
from scla_mj.runs.folder import open_run

ROOT: Final = Path(__file__).resolve().parents[1]
NOTICE: Final = (
    "**These results were made before the model's bits last changed** (CHANGELOG.md says why): the present code may "
    "give other numbers."
)
_RESULTS: Final = "docs/results"
_REPORT: Final = f"{_RESULTS}/report.md"
_MADE_BY: Final = {
    _RESULTS: "`scla-mj reproduce OUT`, then `python scripts/results.py OUT`",
    "docs/learners": "`python scripts/learners.py OUT --take`",
}
"""How results that pages show are made again."""
_TAKEN: Final = ("report.md", "ladder.md", "made-by.json", "csv", "figures")
_BLOCK: Final = re.compile(r"(<!-- results -->\n)(.*?)(<!-- /results -->\n)", re.DOTALL)
_REPLAYED: Final = 25


@dataclass(frozen=True)
class Results:
    """Keep docs/results and README in step with the model's bits."""

    out: Annotated[Path | None, tyro.conf.Positional, tyro.conf.arg(metavar="[OUT]")] = None
    """The folder of a `reproduce` whose report becomes docs/results."""
    check: bool = False
    """Write nothing: exit with 1 unless results, README and the model's bits agree, and a commit made the results."""


def is_current(root: Path, folder: str = _RESULTS) -> bool:
    """Return whether the results in a folder were made by code with the model's present bits."""
    made_by = _made_by(root, folder)
    return bool(made_by["bits"] == bits_digest(root, made_by["platform"]) != "unknown")


def texts(root: Path) -> dict[Path, str]:
    """Return what README and report should be."""
    notice = "" if is_current(root) else f"{NOTICE}\n\n"
    report, readme = root / _REPORT, root / "README.md"
    title, rest = report.read_text(encoding="utf-8").replace(f"{NOTICE}\n\n", "").split("\n\n", 1)
    block = notice + (root / "docs/results/ladder.md").read_text(encoding="utf-8")
    held = readme.read_text(encoding="utf-8")
    if len(_BLOCK.findall(held)) != 1:
        raise SclaError("README.md needs the lines <!-- results --> and <!-- /results -->, once each")
    return {report: f"{title}\n\n{notice}{rest}", readme: _BLOCK.sub(lambda found: found[1] + block + found[3], held)}


def faults(root: Path) -> list[str]:
    """Return what stands against a release."""
    found = [f"{path.relative_to(root)} is out of step: python scripts/results.py"
             for path, text in texts(root).items() if path.read_text(encoding="utf-8") != text]  # fmt: skip
    for folder, remedy in _MADE_BY.items():
        if not is_current(root, folder):
            found.append(f"{folder} was made with other bits than tests/bits.json: run {remedy}")
        made_by = _made_by(root, folder)
        if made_by["commit"] == "unknown" or made_by["changed"]:
            found.append(f"{folder} was not made by a commit")
    return found


def take(out: Path, root: Path) -> None:
    """Replace docs/results by the report in OUT.

    Raises:
        SclaError: OUT holds no report, or a run that the present code does not make again.
    """
    absent = [name for name in _TAKEN if not (out / name).exists()]
    if absent:
        raise SclaError(f"{out} has no {absent[0]}: `scla-mj reproduce {out}` writes it")
    count = sum(replay(min(folder.iterdir())) for folder in sorted((out / "runs").iterdir()))
    results = root / "docs/results"
    shutil.rmtree(results, ignore_errors=True)
    results.mkdir(parents=True)
    for name in _TAKEN:
        (shutil.copytree if (out / name).is_dir() else shutil.copyfile)(out / name, results / name)
    made_by = _made_by(root) | {"decisions made again": count}
    (results / "made-by.json").write_text(json.dumps(made_by, indent=2) + "\n", encoding="utf-8")


def replay(folder: Path) -> int:
    """Make the first decisions of a run again and return how many.

    Raises:
        SclaError: they differ.
    """
    config, table = open_run(folder).config, read_decisions(folder).slice(0, _REPLAYED)
    simulation = simulate(config)
    again = [row(simulation.step()) for _ in range(table.num_rows)]
    if _present(again) != _present(tuple(held.values()) for held in table.to_pylist()):
        raise SclaError(f"{folder} was made by code with other bits: run `scla-mj reproduce` in a new OUT")
    return len(again)


def _present(rows: Iterable[tuple[Any, ...]]) -> list[tuple[Any, ...]]:
    """Return the rows without what is null: a brain without motor neurons need not have a column for their spikes."""
    return [tuple(value for value in row if value is not None) for row in rows]


def main(options: Results) -> int:
    """Carry it out; return the exit code."""
    if options.check:
        found = faults(ROOT)
        print("\n".join(found) or "results, README and the model's bits agree")
        return int(bool(found))
    if options.out is not None:
        take(options.out, ROOT)
    for path, text in texts(ROOT).items():
        path.write_text(text, encoding="utf-8")
    return 0


def _made_by(root: Path, folder: str = _RESULTS) -> dict[str, Any]:
    made_by: dict[str, Any] = json.loads((root / folder / "made-by.json").read_text(encoding="utf-8"))
    return made_by


if __name__ == "__main__":
    try:
        sys.exit(main(tyro.cli(Results, description=__doc__)))
    except SclaError as error:
        print(error, file=sys.stderr)
        sys.exit(2)
