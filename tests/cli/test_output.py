"""Output that cannot be written: the command does what was asked for, without a traceback, and its exit code tells."""

import os
import subprocess
import sys

import pytest

from scla_mj.cli.main import main

FEW = ["--brain", "random", "--epochs", "1", "--decisions", "3"]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = tmp_path_factory.mktemp("output") / "run"
    assert main(["rollout", str(path), *FEW]) == 0
    return str(path)


def exit_code(redirection, *words, cwd=None):
    """Run a command through a shell that redirects its streams; return its exit code and what it said on stderr."""
    line = f'exec "$0" -m scla_mj.cli.main "$@" {redirection}'
    command = ["sh", "-c", line, sys.executable, *words]
    done = subprocess.run(command, cwd=cwd, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False)
    assert "Traceback" not in done.stderr and "Exception ignored" not in done.stderr
    return done.returncode, done.stderr


@pytest.mark.parametrize(
    ("redirection", "code"), [(">/dev/full 2>/dev/full", 74), ("2>/dev/full", 0), (">&- 2>&- <&-", 0)]
)
def test_a_run_is_whole_though_nothing_can_be_printed(redirection, code, tmp_path, capsys):
    assert exit_code(redirection, "rollout", "run", *FEW, cwd=tmp_path)[0] == code
    assert main(["inspect", str(tmp_path / "run")]) == 0
    assert "sound, complete" in capsys.readouterr().out


@pytest.mark.parametrize("words", [["inspect", "RUN"], ["figures", "RUN"], ["reproduce", "--list"], ["--help"]])
def test_results_that_are_lost_on_a_full_disk_are_told_in_one_sentence(words, run):
    code, said = exit_code(">/dev/full", *(run if word == "RUN" else word for word in words))
    assert (code, said) == (74, "scla-mj: the output cannot be written: No space left on device; all else is done\n")


def test_a_refusal_keeps_its_code_though_its_sentence_is_lost(run):
    assert exit_code(">/dev/full 2>/dev/full", "resume", run)[0] == 2
    assert exit_code(">&- 2>&-", "--version")[0] == 0


def test_a_run_whose_progress_nobody_reads_is_finished(tmp_path, capsys):
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w") as pipe:
        command = [sys.executable, "-m", "scla_mj.cli.main", "rollout", str(tmp_path / "run"), *FEW]
        assert subprocess.run(command, stdout=pipe, stderr=pipe, check=False).returncode == 141
    assert main(["inspect", str(tmp_path / "run")]) == 0
    assert "sound, complete" in capsys.readouterr().out
