"""What is made while documents are read and pages are drawn."""

from __future__ import annotations

from pathlib import Path

import pytest

from coursebuild.core.engine import workers
from coursebuild.effects.store import Store
from coursebuild.pipeline import kept
from coursebuild.pipeline.kept import fonts_beside
from coursebuild.render import fonts as cutting
from coursebuild.render.fonts import Face, FontJob
from support.scratch_course import Folder


def job(characters: str) -> FontJob:
    face = Face("A", "latin", "a.woff2", "normal", (400, 700), None)
    return FontJob(face, b"font", characters)


@pytest.mark.parametrize("forks", [False, True])
def test_the_largest_font_is_cut_beside(
    forks: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = Folder(tmp_path)
    store = folder.options().store
    here: list[str] = []

    def cut(job: FontJob) -> bytes:
        here.append(job.characters)
        return job.characters.upper().encode()

    monkeypatch.setattr(cutting, "subset_font", cut)
    monkeypatch.setattr(workers, "can_fork", lambda: forks)
    jobs = [job("ab"), job("abcd"), job("c")]
    with fonts_beside(store, jobs) as subset:
        assert [subset(job) for job in jobs] == [b"AB", b"ABCD", b"C"]
    assert here == (["ab", "c"] if forks else ["ab", "c", "abcd"])
    here.clear()
    with fonts_beside(store, jobs) as subset:  # all is kept
        assert [subset(job) for job in jobs] == [b"AB", b"ABCD", b"C"]
    assert here == []


def test_each_font_is_cut_once_where_all_is_made_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = Store(tmp_path, fresh=True)
    cuts = tmp_path / "cuts"

    def cut(job: FontJob) -> bytes:
        with cuts.open("a") as file:
            file.write(f"{job.characters}\n")
        return job.characters.upper().encode()

    monkeypatch.setattr(cutting, "subset_font", cut)
    jobs = [job("ab"), job("abcd"), job("c")]
    with fonts_beside(store, jobs) as subset:
        assert [subset(job) for job in jobs] == [b"AB", b"ABCD", b"C"]
    assert sorted(cuts.read_text().split()) == ["ab", "abcd", "c"]


def test_a_font_that_cannot_be_cut_is_told_of_where_it_is_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(job: FontJob) -> bytes:
        raise ValueError(job.characters)

    monkeypatch.setattr(kept, "cut_font", refuse)
    with (
        fonts_beside(Folder(tmp_path).options().store, [job("ab")]) as subset,
        pytest.raises(ValueError, match="ab"),
    ):
        subset(job("ab"))
