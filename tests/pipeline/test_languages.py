"""Lessons in other languages than the rest of their course."""

from __future__ import annotations

import pytest

from support.archives import entries
from support.fixture_cases import fixture_text
from support.scratch_course import GOOD, Make

pytestmark = pytest.mark.site

FRENCH = fixture_text("documents/french.md")


def test_a_lesson_has_a_language_of_its_own(make: Make) -> None:
    theorem = "\n> [!theorem]- First {#thm:first}\n> True.\n"
    folder = make(GOOD + theorem, FRENCH, GOOD.replace("hello.py", "third.py"))
    text = folder.text("content/course.toml")
    before, mark, after = text.partition('slug = "two"\n')
    folder.write("content/course.toml", f'{before}{mark}language = "fr"\n{after}')
    assert folder.main("build").status == 0
    english, french = (
        folder.text(f"public/lessons/{name}.html") for name in ("1.1-one", "1.2-two")
    )
    assert english.startswith('<!DOCTYPE html>\n<html lang="en"')
    assert french.startswith('<!DOCTYPE html>\n<html lang="fr"')
    assert "Tableau" in french and "Aller au contenu" in french
    assert "Table 1" not in french
    assert '<a href="#thm:euler">Théorème 1.2.1</a>' in french
    assert '<a href="1.1-one.html#thm%3Afirst">Théorème 1.1.1</a>' in french
    assert '<details class="callout callout-theorem" id="thm:first">' in english
    assert "Theorem 1.1.1</span>" in english
    assert french.count('<a href="1.1-one.html">la leçon 1.1</a>') == 0
    assert french.count('<a href="1.1-one.html">leçon 1.1</a>') == 2

    assert folder.main("export", "epub", "--out", "book.epub").status == 0
    book = {name: data.decode() for name, data in entries(folder.root / "book.epub").items()}
    for name, language in (("1.1-one", "en"), ("1.2-two", "fr")):
        chapter = next(text for path, text in book.items() if path.endswith(f"{name}.xhtml"))
        assert f'lang="{language}" xml:lang="{language}" dir="ltr">' in chapter
    languages = "<dc:language>en</dc:language>\n<dc:language>fr</dc:language>\n"
    assert languages in book["EPUB/package.opf"]
    assert 'lang="fr" xml:lang="fr">1.2 ' in book["EPUB/nav.xhtml"]
    assert folder.main("export", "page", "--out", "page.html").status == 0
    assert 'id="_1.2--_top" lang="fr" dir="ltr">' in folder.text("page.html")

    result = folder.main("rename", "1.1", "1.5")
    assert result.status == 1, "a range may mean it"
    assert "ou les leçons 1.1 à 1.3" in result.err
    assert folder.main("rename", "1.1", "1.5", "--leave").status == 0
    renamed = folder.text("content/lessons/1.2-two.md")
    assert "Voir la leçon 1.5, ou" in renamed
    assert "Comme dans la leçon 1.5." in renamed


QUIZ = fixture_text("documents/answers.md")


def test_numbers_of_a_quiz_are_those_of_its_language(make: Make) -> None:
    folder = make(GOOD + QUIZ)
    refused = folder.main("check")
    assert refused.status == 1
    assert "`answer` must be a number, not ``83,4`{out}`" in refused.out, "83 and 4 in English"

    text = folder.text("content/course.toml")
    folder.write("content/course.toml", text.replace("[course]", '[course]\nlanguage = "de"', 1))
    assert folder.main("build").status == 0
    html = folder.text("public/lessons/1.1-one.html")
    assert '<strong>83,4 min</strong> <span class="tolerance">auf 0,1 min genau</span>' in html
    assert "<strong>2,5 kg m<sup>2</sup></strong>" in html
    assert "auf 0,05 kg m<sup>2</sup> genau" in html
    for answer in ("83.4", "6.6e-05", "2.5"):
        assert f'data-answer="{answer}"' in html, "what the page's script compares with"
    assert "83,4 min (auf 0,1 min genau)." in folder.text("public/lessons/1.1-one.md")

    lesson = folder.text("content/lessons/1.1-one.md").replace("83,4`", "83,5`")
    folder.write("content/lessons/1.1-one.md", lesson)
    assert "error[binding-mismatch]" in folder.main("check").out


def test_what_the_map_says_of_a_lesson_is_in_its_language(make: Make) -> None:
    folder = make(GOOD + QUIZ.partition("The mass")[0])
    text = folder.text("content/course.toml")
    before, mark, after = text.partition('slug = "one"\n')
    summary = 'summary = "Etwa `83,4 min`{out=examples/answers.py}."\n'
    folder.write("content/course.toml", f"{before}{mark}{summary}{after}")
    assert "error[binding-mismatch]: `83,4 min`" in folder.main("check").out
    folder.write("content/course.toml", f'{before}{mark}language = "de"\n{summary}{after}')
    assert folder.main("check").status == 0


def test_spaces_between_digits_stay(make: Make) -> None:
    script = 'scale = 1\nprint("steps", 12000 * scale)\nprint(f"mass {1234567.5 * scale:,} kg")'
    script += '\nprint("ratio", 0.1250001 * scale)'
    text = "`0.125 000 1`{out}, `12\u202f000`{out}, `12 000`{out}, `1\u00a0234\u00a0568 kg`{out}"
    german = f"{text}, `1\u202f234\u202f567,5 kg`{{out}}, `1 234 567,5`{{out}}"
    script = f"```python file=examples/a.py\n{script}\n```\n\n```output\n```\n\n"
    folder = make(f"{script}{text}\n", script.replace("a.py", "b.py") + f"{german}\n")
    course = folder.text("content/course.toml")
    before, mark, after = course.partition('slug = "two"\n')
    folder.write("content/course.toml", f'{before}{mark}language = "de"\n{after}')
    assert folder.main("update").status == 0
    for path in ("1.1-one", "1.2-two"):
        folder.replace(f"content/lessons/{path}.md", "scale = 1", "scale = 2")
    assert folder.main("update").status == 0
    doubled = "`0.250 000 2`{out}, `24\u202f000`{out}, `24 000`{out}, `2\u00a0469\u00a0135 kg`{out}"
    assert doubled in folder.text("content/lessons/1.1-one.md")
    german = f"{doubled}, `2\u202f469\u202f135,0 kg`{{out}}, `2 469 135,0`{{out}}"
    assert german in folder.text("content/lessons/1.2-two.md")
