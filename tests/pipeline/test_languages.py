"""Lessons in other languages than the rest of their course."""

from __future__ import annotations

from support.scratch_course import GOOD, Make

FRENCH = """\
## Chute

Voir la leçon 1.1, ou les leçons 1.1 à 1.3.

Tableau : Les valeurs. {#tab:values}

| a |
| - |
| 1 |

Par [](#thm:euler) et [](lesson:1.1#thm:first), dans [](#tab:values), la note du labo :

> [!theorem] Euler {#thm:euler}
> Vrai.

```lab ode
title = "Chute"
t = {max = 2}
states = {v = {start = 0, rate = "-9.81"}}
note = "Comme dans la leçon 1.1."
```
"""


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

    result = folder.main("rename", "1.1", "1.5")
    assert result.status == 1, "a range may mean it"
    assert "ou les leçons 1.1 à 1.3" in result.err
    assert folder.main("rename", "1.1", "1.5", "--leave").status == 0
    renamed = folder.text("content/lessons/1.2-two.md")
    assert "Voir la leçon 1.5, ou" in renamed
    assert "Comme dans la leçon 1.5." in renamed
