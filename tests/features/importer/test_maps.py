"""The map of another tool gives the order of lessons, their titles, parts and pages."""

from __future__ import annotations

import tomllib
from pathlib import Path

from coursebuild.features.importer.convert import ConvertedCourse
from support.converted_folder import convert_files
from support.fixture_cases import FIXTURES, Case, check_cases
from support.rule_cases import parts


def outline(course: ConvertedCourse) -> str:
    """The titles of levels and their lessons, planned ones with `?`, of pages, and what is left."""
    table = tomllib.loads(course.files["content/course.toml"].decode())
    lines = []
    for level in table["level"]:
        lines.append(level["title"])
        for lesson in level["lesson"]:
            lines.append(f"  {lesson['title']}{'?' * (lesson['status'] == 'planned')}")
    lines += (f"page: {page['title']}" for page in table.get("page", ()))
    lines += (f"left: {leftover.message}" for leftover in course.account.leftovers)
    return "".join(f"{line}\n" for line in lines)


def import_map(folder: Path, files: dict[str, str]) -> ConvertedCourse:
    """Convert files; one without a text has its path as its title."""
    texts = {name: text or f"# {name}\n\nText.\n" for name, text in files.items()}
    return convert_files(folder, texts)


def test_the_map_of_another_tool_is_the_map_of_the_course(tmp_path: Path, rewriting: bool) -> None:
    def render(case: Case) -> str:
        files = {path: text for _, path, text in parts(case.input)}
        return outline(import_map(tmp_path / str(case.line), files))

    check_cases(FIXTURES / "imports/maps.md", render, rewriting=rewriting)


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
    course = import_map(tmp_path, files)
    text = outline(course)
    assert text.startswith("Outer\n  docs/a/b/two.md\n  docs/a/one.md\nleft: ")
    assert "“Inner”" in text
    assert b'summary = "All of it"' in course.files["content/course.toml"]


def test_a_text_of_r_markdown_is_a_lesson_and_so_is_one_with_a_long_extension(
    tmp_path: Path,
) -> None:
    cell = '```{r first, echo=FALSE, eval=FALSE, fig.cap="A plot"}\nplot(x)\n```'
    files = {
        "a.Rmd": f"---\ntitle: In R\n---\n\n{cell}\n",
        "b.markdown": "# Long\n\n[back](a.Rmd)\n",
    }
    course = import_map(tmp_path, files)
    left = "a cell of `r`, which its tool does not run, is shown"
    assert outline(course).endswith(f"\n  In R\n  Long\nleft: {left}\n")
    assert b"**A plot**\n\n```r\nplot(x)\n```" in course.files["content/lessons/1.1-a.md"]
    assert b"[back](lesson:1.1)" in course.files["content/lessons/1.2-b.md"]


def test_the_site_of_docusaurus_may_stand_beside_its_texts(tmp_path: Path) -> None:
    files = {
        "website/docusaurus.config.js": "module.exports = {title: 'A'}",
        "website/sidebars.json": '{"docs": {"**B**{.x}": ["two/README", "one"]}}',
        "docs/one.md": "\n---\ntitle: One\n---\n\nIt costs $1 or $2: [](two/).\n",
        "docs/two/README.md": "# Two\n\nWords.\n",
    }
    course = import_map(tmp_path, files)
    assert outline(course).startswith("B\n  Two\n  One\n")
    text = course.files["content/lessons/1.2-one.md"].decode()
    assert text == "It costs \\$1 or \\$2: [Two](lesson:1.1).\n"


def test_a_title_of_the_map_that_begins_a_text_as_a_lower_heading_is_its_title(
    tmp_path: Path,
) -> None:
    files = {
        "SUMMARY.md": "# Summary\n\n- [Two cones](cones.md)\n- [Walls](walls.md)\n",
        "cones.md": "\n## Two cones\n\nText.\n\n### In a plane\n\n```sh\n## not raised\n```\n",
        "walls.md": "## Of stone\n\nText.\n",
    }
    course = import_map(tmp_path, files)
    cones, walls = (
        course.files[path].decode() for path in sorted(course.files) if path.startswith("content/l")
    )
    assert cones.startswith("Text.\n\n## In a plane\n") and "\n## not raised\n" in cones
    assert walls.startswith("## Of stone\n")
