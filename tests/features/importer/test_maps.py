"""The map of another tool gives the order of lessons, their titles, parts and pages."""

from __future__ import annotations

import tomllib
from pathlib import Path

from coursebuild.features.importer.convert import convert
from coursebuild.features.importer.source_files import SourceFiles
from support.fixture_cases import fixture_text

Outline = list[tuple[str, list[str]]]
"""The titles of levels, each with those of its lessons; `?` behind one that is only planned."""


def import_map(folder: Path, files: dict[str, str]) -> tuple[Outline, list[str], list[str]]:
    """Return the outline, the titles of pages, and what is left.

    A file without a text has its path as its title.
    """
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text or f"# {name}\n\nText.\n", encoding="utf-8")
    course = convert(SourceFiles(folder))
    table = tomllib.loads(course.files["content/course.toml"].decode())
    outline = [
        (
            level["title"],
            [
                entry["title"] + ("?" if entry["status"] == "planned" else "")
                for entry in level["lesson"]
            ],
        )
        for level in table["level"]
    ]
    left = [leftover.message for leftover in course.account.leftovers]
    return outline, [page["title"] for page in table.get("page", ())], left


def test_titles_are_the_words_of_the_roles_in_them(tmp_path: Path) -> None:
    files = {
        "a.md": "# {index}`NumPy <single: NumPy>`\n\nText.\n",
        "b.md": "# Use of {py:func}`run` and *the* `{x}`\n\nText.\n",
    }
    ((_, titles),), *_ = import_map(tmp_path, files)
    assert titles == ["NumPy", "Use of run and the {x}"]


def test_a_book_of_gitbook_says_where_its_summary_is(tmp_path: Path) -> None:
    files = {
        "book.json": '{"root": "./texts/", "structure": {"summary": "README.md"}}',
        "texts/README.md": "# Contents\n\n- [Second](b/README.md)\n- [First](a/README.md)\n",
        "texts/a/README.md": "",
        "texts/b/README.md": "",
        "notes/outline.md": "",
    }
    outline, _, left = import_map(tmp_path, files)
    assert [titles for _, titles in outline] == [["texts/b/README.md", "texts/a/README.md"]]
    assert [message[:14] for message in left] == ["not taken for "]


SUMMARY = fixture_text("documents/summary.md")


def test_summary_of_mdbook_is_the_map(tmp_path: Path) -> None:
    names = "before zeta deep/below deep/further alone alpha after unlisted".split()
    files = {f"text/{name}.md": "Text.\n" for name in names}
    files |= {"book.toml": '[book]\ntitle = "A book"\nsrc = "text"\n', "text/SUMMARY.md": SUMMARY}
    outline, pages, left = import_map(tmp_path, files)
    assert outline == [
        ("Zeta [1]", ["Zeta [1]", "Below z", "Further below"]),
        ("A book", ["Alone"]),
        ("Second part", ["Alpha", "To be written?", "Lost?"]),
    ]
    assert pages == ["Before", "After"]
    assert [message for message in left if "lost.md" in message or "not taken" in message] == [
        "the map names `lost.md`, which is not in the folder or no text",
        "not taken for a lesson: add it to the map of the course, and import again",
    ]


def test_summary_of_gitbook_has_parts_as_headings_of_level_2(tmp_path: Path) -> None:
    summary = "# Table of contents\n\n* [Start](README.md)\n\n## Part\n\n* [B](b.md)\n* [A](a.md)\n"
    files = {"SUMMARY.md": summary, **dict.fromkeys(("README.md", "a.md", "b.md"), "Text.\n")}
    outline, _, _ = import_map(tmp_path / "book", files)
    assert outline == [("Lessons", ["Start"]), ("Part", ["B", "A"])]


SIDEBARS = fixture_text("scripts/sidebars.js")
CONFIG = "module.exports = {\n  title: 'A site',\n}\n"


def test_literal_sidebars_of_docusaurus_are_the_map(tmp_path: Path) -> None:
    names = "intro basics/start basics/z basics/01-a last".split()
    files = {f"docs/{name}.md": "" for name in names}
    files |= {"docusaurus.config.js": CONFIG, "sidebars.js": SIDEBARS}
    outline, _, left = import_map(tmp_path, files)
    assert outline == [
        ("A site", ["docs/intro.md"]),
        ("The basics", ["docs/basics/start.md", "docs/basics/z.md", "docs/basics/01-a.md"]),
        ("Short", ["docs/last.md"]),
    ]
    assert left == [
        "the map names `gone`, which is not in the folder or no text",
        "`Elsewhere` of the map, which is no text",
    ]


def test_computed_sidebars_give_way_to_positions(tmp_path: Path) -> None:
    files = {
        "docusaurus.config.ts": CONFIG,
        "sidebars.ts": "export default {docs: require('./list').map((id) => id)};\n",
        "docs/b.md": "---\nsidebar_position: 1\n---\n# B\n\nText.\n",
        "docs/a.md": "---\nsidebar_position: 2\n---\n# A\n\nText.\n",
        "docs/03-part/_category_.json": '{"label": "Part", "position": 0}',
        "docs/03-part/2-y.md": "",
        "docs/03-part/10-x.md": "",
    }
    outline, _, left = import_map(tmp_path, files)
    assert outline == [
        ("Part", ["docs/03-part/2-y.md", "docs/03-part/10-x.md"]),
        ("A site", ["B", "A"]),
    ]
    assert "a program: the order of lessons is that of `sidebar_position` and of names" in left


def test_nav_of_mkdocs_and_chapters_of_quarto_keep_their_order(tmp_path: Path) -> None:
    nav = (
        "site_name: S\nnav:\n  - Z: z.md\n  - Part:\n    - B: b.md\n    - a.md\n  - Gone: gone.md\n"
    )
    files = {"mkdocs.yml": nav, "docs/z.md": "# Zeta\n\nText.\n", "docs/b.md": "Text.\n"}
    outline, _, left = import_map(tmp_path / "m", {**files, "docs/a.md": ""})
    assert outline == [("S", ["Zeta"]), ("Part", ["B", "docs/a.md"])]
    assert left == ["the map names `Gone: gone.md`, which is not in the folder or no text"]
    chapters = "[z.qmd, {part: P, chapters: [b.qmd, gone.qmd]}]"
    book = f"book:\n  title: Q\n  chapters: {chapters}\n  appendices: [a.qmd]\n"
    files = {"_quarto.yml": book, "a.qmd": "", "b.qmd": "", "z.qmd": ""}
    outline, _, left = import_map(tmp_path / "q", files)
    assert outline == [("Q", ["z.qmd"]), ("P", ["b.qmd"]), ("Q", ["a.qmd"])]
    assert left == ["the map names `gone.qmd`, which is not in the folder or no text"]


def test_folders_of_mkdocs_are_parts_in_the_order_of_their_pages_file(tmp_path: Path) -> None:
    files = {
        "mkdocs.yaml": "site_name: S\nnav:\n  - Start: start.md\n  - Guide: guide/\n",
        "docs/start.md": "",
        "docs/guide/b.md": "",
        "docs/guide/a.md": "",
        "docs/guide/index.md": "",
        "includes/abbreviations.md": "*[ABC]: Alphabet\n",
    }
    outline, _, _ = import_map(tmp_path / "named", files)
    guide = ["docs/guide/index.md", "docs/guide/a.md", "docs/guide/b.md"]
    assert outline == [("S", ["docs/start.md"]), ("Guide", guide)]
    files["mkdocs.yaml"] = 'nav:\n  - "":\n      - start.md\n'
    assert import_map(tmp_path / "untitled", files)[0] == [("docs/start.md", ["docs/start.md"])]
    files["mkdocs.yaml"] = "site_name: S\n"
    files["docs/.pages"] = "nav:\n  - guide\n  - ...\n"
    files["docs/guide/.pages"] = "title: How\nnav:\n  - b.md\n  - Title: a.md\n"
    outline, _, _ = import_map(tmp_path / "found", files)
    assert outline == [("How", ["docs/guide/b.md", "docs/guide/a.md"]), ("S", ["docs/start.md"])]


def test_a_notebook_and_its_text_are_one_lesson(tmp_path: Path) -> None:
    files = {
        "a.ipynb": '{"nbformat": 4, "cells": [{"cell_type": "markdown", "source": "# A\\n\\nB."}]}',
        "a.md": "---\njupytext:\n  formats: md,ipynb\n---\n# A\n\nB.\n",
        "a.py": "# %%\nx = 1\n",
    }
    outline, _, left = import_map(tmp_path, files)
    assert [titles for _, titles in outline] == [["A"]]
    assert left == ["the text of a notebook, which is taken"] * 2


def test_toctrees_of_sphinx_are_the_map(tmp_path: Path) -> None:
    index = """# Manual

```{toctree}
:caption: First

zeta
Short <more/a>
```

```{toctree}
:caption: Second
:glob:

b*
gone
```
"""
    zeta = "# Zeta\n\nText.\n\n```{toctree}\n:maxdepth: 1\n\nbelow\n```\n"
    files = {"conf.py": 'project = "The manual"\n', "index.md": index, "zeta.md": zeta}
    names = ("below.md", "b1.md", "b2.md", "more/a.md")
    outline, pages, left = import_map(tmp_path, {**files, **dict.fromkeys(names, "")})
    assert outline == [("First", ["Zeta", "below.md", "more/a.md"]), ("Second", ["b1.md", "b2.md"])]
    assert pages == ["Manual"]
    assert "the map names `gone`, which is not in the folder or no text" in left


def test_a_book_of_its_first_page_alone_has_a_lesson(tmp_path: Path) -> None:
    book = "book:\n  title: Q\n  chapters: [index.qmd]\n"
    outline, pages, _ = import_map(tmp_path, {"_quarto.yml": book, "index.qmd": ""})
    assert (outline, pages) == ([("Q", ["index.qmd"])], [])


def test_a_part_within_a_part_is_left_by_its_name_and_a_description_is_a_summary(
    tmp_path: Path,
) -> None:
    files = {
        "docusaurus.config.js": "module.exports = {title: 'D'}",
        "docs/a/_category_.json": '{"label": "Outer", "link": {"description": "All of it"}}',
        "docs/a/one.md": "",
        "docs/a/b/_category_.yml": "label: Inner\n",
        "docs/a/b/two.md": "",
    }
    outline, _, left = import_map(tmp_path, files)
    assert outline == [("Outer", ["docs/a/b/two.md", "docs/a/one.md"])]
    assert [message for message in left if "“Inner”" in message]
    course = convert(SourceFiles(tmp_path))
    assert b'summary = "All of it"' in course.files["content/course.toml"]


def test_a_text_of_r_markdown_is_a_lesson_and_so_is_one_with_a_long_extension(
    tmp_path: Path,
) -> None:
    cell = '```{r first, echo=FALSE, eval=FALSE, fig.cap="A plot"}\nplot(x)\n```'
    files = {
        "a.Rmd": f"---\ntitle: In R\n---\n\n{cell}\n",
        "b.markdown": "# Long\n\n[back](a.Rmd)\n",
    }
    ((_, titles),), _, left = import_map(tmp_path, files)
    assert titles == ["In R", "Long"]
    assert left == ["a cell of `r`, which its tool does not run, is shown"]
    course = convert(SourceFiles(tmp_path))
    assert b"**A plot**\n\n```r\nplot(x)\n```" in course.files["content/lessons/1.1-a.md"]
    assert b"[back](lesson:1.1)" in course.files["content/lessons/1.2-b.md"]


def test_the_site_of_docusaurus_may_stand_beside_its_texts(tmp_path: Path) -> None:
    files = {
        "website/docusaurus.config.js": "module.exports = {title: 'A'}",
        "website/sidebars.json": '{"docs": {"**B**{.x}": ["two/README", "one"]}}',
        "docs/one.md": "\n---\ntitle: One\n---\n\nIt costs $1 or $2: [](two/).\n",
        "docs/two/README.md": "# Two\n\nWords.\n",
    }
    outline, _, _ = import_map(tmp_path, files)
    assert outline == [("B", ["Two", "One"])]
    text = convert(SourceFiles(tmp_path)).files["content/lessons/1.2-one.md"].decode()
    assert text == "It costs \\$1 or \\$2: [Two](lesson:1.1).\n"


def test_a_title_of_the_map_that_begins_a_text_as_a_lower_heading_is_its_title(
    tmp_path: Path,
) -> None:
    files = {
        "SUMMARY.md": "# Summary\n\n- [Two cones](cones.md)\n- [Walls](walls.md)\n",
        "cones.md": "\n## Two cones\n\nText.\n\n### In a plane\n\n```sh\n## not raised\n```\n",
        "walls.md": "## Of stone\n\nText.\n",
    }
    import_map(tmp_path, files)
    course = convert(SourceFiles(tmp_path))
    cones, walls = (
        course.files[path].decode() for path in sorted(course.files) if path.startswith("content/l")
    )
    assert cones.startswith("Text.\n\n## In a plane\n") and "\n## not raised\n" in cones
    assert walls.startswith("## Of stone\n")
