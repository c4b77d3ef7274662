"""Texts of strangers: how they are unpacked, read and judged. No registry is asked."""

from __future__ import annotations

import io
import tarfile
from pathlib import Path

import pytest

from benchmarks.corpus import JUDGED, evaluate, hash_of, read_bodies, read_judgements, sample
from benchmarks.foreign.courses import examine, import_course, write_plain_course
from benchmarks.foreign.packages import PackageError, texts_of
from support.fixture_cases import fixture_text

TEXT = fixture_text("documents/foreign.md")
PACKAGE = "pypi:ball==1.0"


def archive(cache: Path, files: dict[str, str]) -> None:
    """Put a package where one lies that was fetched before."""
    folder = cache / "pypi%3Aball==1.0"
    folder.mkdir(parents=True)
    with tarfile.open(folder / "ball-1.0.tar.gz", "w:gz") as file:
        for name, text in files.items():
            member = tarfile.TarInfo(name)
            member.size = len(text.encode())
            file.addfile(member, io.BytesIO(text.encode()))


def test_only_files_that_match_are_unpacked(tmp_path: Path) -> None:
    archive(tmp_path / "cache", {"ball-1.0/docs/a/b.md": TEXT, "ball-1.0/setup.py": "exit(1)"})
    texts_of([PACKAGE], ["docs/*.md"], tmp_path / "cache", tmp_path / "texts")
    files = [p.relative_to(tmp_path / "texts") for p in (tmp_path / "texts").rglob("*.*")]
    assert files == [Path("docs/a/b.md")]
    with pytest.raises(PackageError, match="no file that matches"):
        texts_of([PACKAGE], ["*.rst"], tmp_path / "cache", tmp_path / "others")


def test_a_package_cannot_write_elsewhere(tmp_path: Path) -> None:
    archive(tmp_path / "cache", {"ball-1.0/../../docs/a.md": TEXT})
    with pytest.raises(tarfile.FilterError):
        texts_of([PACKAGE], ["*.md"], tmp_path / "cache", tmp_path / "deep/texts")
    assert not list(tmp_path.rglob("a.md"))


def test_a_text_is_judged_in_both_ways(tmp_path: Path) -> None:
    (tmp_path / "texts").mkdir()
    (tmp_path / "texts/ball.md").write_text(TEXT, encoding="utf-8")
    assert write_plain_course(tmp_path / "texts", tmp_path / "plain")
    import_course(tmp_path / "texts", tmp_path / "imported")
    plain, imported = examine(tmp_path / "plain"), examine(tmp_path / "imported")
    assert (plain.files, plain.words) == (1, 15)
    # The importer leaves no broken link, and no tag that a page cannot hold.
    assert (imported.files, imported.words) == (1, 10)
    assert {diagnostic.rule for diagnostic in imported.diagnostics} == {"shown-as-written"}
    mistakes = {"link-file", "html-unbalanced"}  # beside which nothing is only hinted
    assert {diagnostic.rule for diagnostic in plain.diagnostics} == mistakes


def test_what_is_judged_is_asked_no_more(tmp_path: Path) -> None:
    (tmp_path / "texts").mkdir()
    (tmp_path / "texts/ball.md").write_text(TEXT, encoding="utf-8")
    write_plain_course(tmp_path / "texts", tmp_path / "plain")
    examination = examine(tmp_path / "plain")
    questions = [*sample("balls", examination.diagnostics, {})]
    assert evaluate("balls", "as it is", examination, {}).unjudged == len(examination.diagnostics)
    answers = "\n".join(line.replace("? ", "w ", 1) for line in questions)
    (tmp_path / "sample.txt").write_text(answers, encoding="utf-8")
    judgements = read_judgements(tmp_path / "sample.txt")
    assert {hash_of(d) for d in examination.diagnostics} == judgements.keys()
    assert not [*sample("balls", examination.diagnostics, judgements)]
    row = evaluate("balls", "as it is", examination, judgements)
    assert row.refused == row.counts
    assert row.rate("error") == pytest.approx(10_000 * row.counts["error"] / row.words)
    fair = evaluate("balls", "as it is", examination, dict.fromkeys(judgements, "o"))
    assert (fair.unjudged, sum(fair.refused.values())) == (0, 0)


def test_the_bodies_are_many_and_no_text_is_kept() -> None:
    bodies = read_bodies([])
    assert len({body.name for body in bodies}) == len(bodies) >= 10
    lines = JUDGED.read_text(encoding="utf-8").splitlines()
    assert lines
    assert len(read_judgements(JUDGED)) == len(lines)
    assert all(len(line) == 18 for line in lines)
