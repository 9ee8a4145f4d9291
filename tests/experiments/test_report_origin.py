"""A report says which code made it: the commit, whether that was changed, and the digest of the model's bits."""

import json
import subprocess

from small_out import BY_NAME

from scla_mj.experiments.report import write_report
from scla_mj.experiments.report.origin import ROOT, bits_digest, origin


def git(folder, *words):
    own = ["-c", "user.name=a", "-c", "user.email=a@b", "-c", "commit.gpgsign=false"]
    done = subprocess.run(["git", "-C", str(folder), *own, *words], check=True, capture_output=True, text=True)
    return done.stdout.strip()


def test_a_checkouts_commit_is_named_and_what_was_changed_since_is_seen(tmp_path):
    (tmp_path / "scla_mj").mkdir()
    (tmp_path / "scla_mj" / "a.py").write_text("a = 1")
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-qm", "first")
    assert origin(tmp_path)[:2] == (git(tmp_path, "rev-parse", "HEAD"), False)
    (tmp_path / "notes.txt").write_text("no code")
    assert not origin(tmp_path).changed
    (tmp_path / "scla_mj" / "b.py").write_text("b = 2")
    assert origin(tmp_path).changed


def test_an_installed_package_is_unknown_even_inside_someones_repository(tmp_path):
    git(tmp_path, "init", "-q")
    (tmp_path / "site-packages").mkdir()
    assert origin(tmp_path / "site-packages")[::3] == ("unknown", "unknown")


def test_another_digest_of_any_short_run_is_another_digest_of_the_bits(tmp_path):
    (tmp_path / "tests").mkdir()
    entries = json.loads((ROOT / "tests" / "bits.json").read_text(encoding="utf-8"))
    where, digests = next(iter(entries)), set()
    for change in ("", "0"):
        entries[where]["runs"]["random"]["decided"] += change
        (tmp_path / "tests" / "bits.json").write_text(json.dumps(entries))
        digests.add(bits_digest(tmp_path, where))
    assert len(digests) == 2 and bits_digest(ROOT, where) in digests
    assert bits_digest(tmp_path, "elsewhere") == "unknown"


def test_the_report_and_its_folder_name_commit_and_bits(tmp_path):
    write_report(tmp_path, [BY_NAME["random-any"]])
    text, made_by = (tmp_path / "report.md").read_text(), json.loads((tmp_path / "made-by.json").read_text())
    assert made_by == origin()._asdict()
    assert ("not committed" in text) is made_by["changed"]
    for name in ("commit", "bits"):
        assert f"`{made_by[name]}`" in text or made_by[name] == "unknown"
