"""What of a course is converted in ways that need more than one place to be seen."""

from __future__ import annotations

import json
import subprocess
import tomllib
from pathlib import Path

import mujoco
import pytest

from support.converted_folder import account_of, convert_files, first_lesson
from support.fixture_cases import FIXTURES, Case, check_cases
from support.rule_cases import parts

MESH = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
BASE = '<mujoco><asset><mesh name="m" file="m.obj"/></asset></mujoco>'
ROBOT = """<mujoco>
  <compiler meshdir="../meshes"/>
  <include file="parts/base.xml"/>
  <worldbody><body><freejoint/><geom type="mesh" mesh="m"/></body></worldbody>
</mujoco>"""


PICTURE = {"p.png": "\x89PNG"}
FOLDERS = {
    "plain": PICTURE,
    "sphinx": {"conf.py": ""},
    "mkdocs": {
        **PICTURE,
        "mkdocs.yml": "site_name: A",
        "hidden/.b.md": "C\nD\n",
        "hidden/c.py": "d = 1\n",
        ".obsidian/app.json": "{}",
    },
}
"""What the folders of `tests/fixtures/imports` hold beside the files of a case."""


@pytest.mark.parametrize("kind", FOLDERS)
def test_the_first_text_of_a_folder_keeps_all_that_readers_see(
    tmp_path: Path, kind: str, rewriting: bool
) -> None:
    def render(case: Case) -> str:
        files = {path: text for _, path, text in parts(case.input)}
        course = convert_files(tmp_path / str(case.line), FOLDERS[kind] | files)
        return first_lesson(course)

    check_cases(FIXTURES / f"imports/{kind}.md", render, rewriting=rewriting)


def test_a_tab_loses_the_icon_in_its_title(tmp_path: Path) -> None:
    text = '# One\n\n=== ":simple-linux: Linux"\n\n    Text.\n'
    assert first_lesson(convert_files(tmp_path, {"one.md": text})) == "**Linux**\n\nText.\n"


@pytest.mark.parametrize("folder", ["robots/arm", "content/models"])
def test_a_model_brings_the_files_that_it_is_made_of(tmp_path: Path, folder: str) -> None:
    above = folder.rpartition("/")[0]
    course = convert_files(
        tmp_path,
        {
            "one.md": "# One\n\nText.\n",
            f"{folder}/arm.xml": ROBOT,
            f"{folder}/parts/base.xml": BASE,
            f"{above}/meshes/m.obj": MESH,
            "other/arm.xml": "<mujoco model='other'/>",
            "loose/part.xml": "<mujocoinclude><asset/></mujocoinclude>",
            "made/task.xml": "<mujoco><include file='made.xml'/><include file='a.xml'/></mujoco>",
            "made/a.xml": "<mujoco><worldbody><geom material='m' size='1'/></worldbody></mujoco>",
            "made/mesh.xml": "<mujoco><asset><mesh file='no.obj'/></asset><worldbody/></mujoco>",
            "test/models/people.json": "{}",
            "loose/keys.xml": "<mujoco><keyframe><key qpos='1 2'/></keyframe></mujoco>",
        },
    )
    for path, data in course.files.items():
        (tmp_path / "new" / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "new" / path).write_bytes(data)
    arms = [path for path in course.files if path.endswith("arm.xml")]
    models = [mujoco.MjModel.from_xml_path(str(tmp_path / "new" / path)) for path in arms]
    assert sorted(model.nmesh for model in models) == [0, 1]
    account = account_of(course)
    assert "- fragment of a model: beside the models that include it (1 time)" in account
    fragments = "a fragment of a model, which no whole one includes: it is compiled with none\n"
    assert f"{fragments}  - loose/keys.xml\n  - loose/part.xml\n  - made/a.xml\n" in account
    assert "a model that needs `made.xml`, which the folder does not hold" in account
    assert "a model that needs `no.obj`, which the folder does not hold" in account
    assert not any(word in path for path in course.files for word in ("loose", "keys", "made"))
    assert "used by no text\n  - test/models/people.json" in account


def test_links_to_places_of_a_planned_lesson_lead_to_the_lesson(tmp_path: Path) -> None:
    lessons = [{"id": "1.1", "title": "One", "file": "one.md"}, {"id": "1.2", "title": "Two"}]
    course_map = {"title": "C", "levels": [{"id": 1, "title": "L", "lessons": lessons}]}
    text = "# One\n\nLater: [the end](#/lesson/1.2#end) and [all](#/lesson/1.2).\n"
    course = convert_files(tmp_path, {"course.json": json.dumps(course_map), "one.md": text})
    lesson = course.files["content/lessons/1.1-one.md"].decode()
    assert lesson == "Later: [the end](lesson:1.2) and [all](lesson:1.2).\n"


def test_what_stands_below_a_second_title_stays_below_it(tmp_path: Path) -> None:
    text = "# One\n\n[TOC]\n\n## A\n\nText.\n\n# Two\n\n## B\n\nText.\n\n### C\n\nText.\n"
    course = convert_files(tmp_path, {"one.md": text})
    lines = course.files["content/lessons/1.1-one.md"].decode().splitlines()
    headings = [line for line in lines if line and line != "Text."]
    assert headings == ["## A", "## Two", "### B", "#### C"]
    assert "table of contents: dropped" in account_of(course)


@pytest.mark.parametrize(
    ("statement", "name"),
    [
        ("import matplotlib.pyplot as plt  # plots", "plt"),
        ("import matplotlib as mpl", "mpl.pyplot"),
        ("import matplotlib.pyplot", "matplotlib.pyplot"),
        ("from matplotlib import pyplot", "pyplot"),
    ],
)
def test_a_figure_is_saved_whatever_its_library_is_called(
    tmp_path: Path, statement: str, name: str
) -> None:
    code = f"{statement}\n{name}.plot([1, 2])\n{name}.show(block=True)"
    course = convert_files(tmp_path, {"one.qmd": f"# One\n\n```{{python}}\n{code}\n```\n"})
    lesson = course.files["content/lessons/1.1-one.md"].decode()
    saving = f'{name}.savefig("l1-1-one-1.svg")\n{name}.close("all")'
    assert saving in lesson and ".show(" not in lesson


def test_a_cell_draws_where_it_makes_a_figure(tmp_path: Path) -> None:
    """Not where it asks for colours, or goes on in a figure that is shown above."""
    cells = (
        "import matplotlib.pyplot as plt\nplt.style.use('ggplot')",
        "f, left = plt.subplots()\nleft.plot([1, 2])",
        "left.plot([3])\nplt.get_cmap('viridis')\nplt.close()",
        "def draw():\n    plt.plot([1])",
        "draw()",
    )
    text = "".join(f"```{{python}}\n{cell}\n```\n\n" for cell in cells)
    course = convert_files(tmp_path, {"one.qmd": f"# One\n\n{text}"})
    lesson = course.files["content/lessons/1.1-one.md"].decode()
    assert "figure=l1-1-one-1.svg,l1-1-one-2.svg\n" in lesson
    assert 'left.plot([1, 2])\nplt.savefig("l1-1-one-1.svg")' in lesson
    assert 'draw()\nplt.savefig("l1-1-one-2.svg")' in lesson


def test_a_long_text_is_within_the_limit_of_its_new_course(tmp_path: Path) -> None:
    texts = {
        "long.md": "# Long\n\n" + "A force is a push.\n" * 16_000,
        "short.md": "# Short\n\nText.\n",
    }
    course = convert_files(tmp_path, texts)
    limits = tomllib.loads(course.files["content/course.toml"].decode())["limits"]
    assert max(map(len, course.files.values())) < limits["text"] <= 500_000


def test_titles_in_either_quotes_and_brackets_in_names_are_read(tmp_path: Path) -> None:
    lines = """# One

![A spring](springs(2).svg ':size=550'), ![two](two.svg "both"), [below](two.md 'The next'),
[over
lines](two.md 'The next') and ![](far.svg 'gone').
"""
    drawing = '<svg xmlns="http://www.w3.org/2000/svg"/>'
    texts = {"one.md": lines, "two.md": "# Two\n\nText.\n"}
    course = convert_files(tmp_path, {**texts, "springs(2).svg": drawing, "two.svg": drawing})
    text = course.files["content/lessons/1.1-one.md"].decode()
    pictures = '![A spring](../files/springs(2).svg), ![two](../files/two.svg "both")'
    link = "(lesson:1.2 'The next')"
    assert text == f"{pictures}, [below]{link},\n[over\nlines]{link} and .\n"
    assert "the picture `far.svg`, which is not in the folder" in account_of(course)


def test_sources_of_quarto_are_cited_whatever_separates_them(tmp_path: Path) -> None:
    text = """# One

As in [@Hertz+:1894;
@Lanczos:1949] and in [@Hertz+:1894, -@Lanczos:1949].
So says @Hertz+:1894 [p. 3], and @Lanczos:1949[, p. 4], and @nobody.

| sign    | meaning |
| ------- | ------- |
| `a\\|\\|b` | or |
"""
    works = "@book{Hertz+:1894, title = {A}} @book{Lanczos:1949,\n  title = {B}\n}\n"
    texts = {"one.qmd": text.replace("\\|", "|"), "works.bib": works}
    course = convert_files(tmp_path, texts)
    cited = text.replace("[@Hertz+:1894;\n@Lanczos:1949]", "[@Hertz+:1894; @Lanczos:1949]\n")
    cited = cited.replace(", -@Lanczos", "; @Lanczos").removeprefix("# One\n\n")
    cited = cited.replace("@Hertz+:1894 [p. 3]", "[@Hertz+:1894, p. 3]")
    cited = cited.replace("@Lanczos:1949[, p. 4]", "[@Lanczos:1949, p. 4]")
    assert course.files["content/lessons/1.1-one.md"].decode() == cited
    bibliography = course.files["content/references.bib"].decode()
    assert "{Hertz+:1894," in bibliography and "{Lanczos:1949," in bibliography


def test_a_computed_title_is_no_caption_and_a_shown_window_no_code(tmp_path: Path) -> None:
    code = """import matplotlib.pyplot as plt
plt.plot([1, 2])
plt.title(f"min {max(2, 3)}")
plt.suptitle(f"$y$ over $\\\\mu$")
display(plt.show())
"""
    course = convert_files(tmp_path, {"one.qmd": f"# One\n\n```{{python}}\n{code}```\n"})
    lesson = course.files["content/lessons/1.1-one.md"].decode()
    assert "Figure: ![y over mu](l1-1-one-1.svg) $y$ over $\\mu$\n" in lesson
    assert "show()" not in lesson


def test_a_lab_of_another_tool_is_a_card_and_a_module_to_be_written(tmp_path: Path) -> None:
    first = '{"title": "A walker", "note": "It falls.", "poster": "w.png", "speed": [1, 2]}'
    second = '{"title": "Again", "camera": {"azimuth": 10}, "odd \\n key": 3}'
    course = convert_files(
        tmp_path,
        {
            "course.json": json.dumps({"levels": [{"lessons": [{"id": "1.1", "file": "a.md"}]}]}),
            "texts/a.md": f"# A\n\n```lab walker\n{first}\n```\n\n```lab walker\n{second}\n```\n\n"
            "```lab Bad/Name\n{}\n```\n",
            "w.png": "",
        },
    )
    text = next(data for path, data in course.files.items() if path.startswith("content/lessons"))
    assert b"> [!note] This lab is not here yet: walker\n>\n> A walker\n>\n> It falls.\n" in text
    assert b"> ![A walker](../files/w.png)" in text
    assert b'"azimuth": -170' in text
    modules = {path: data for path, data in course.files.items() if path.endswith(".js")}
    assert [*modules] == ["content/labs/walker.js"]
    module = tmp_path / "walker.mjs"
    module.write_bytes(modules["content/labs/walker.js"])
    fields = [line for line in module.read_text().splitlines() if line.startswith("//   ")]
    assert len(fields) == 6
    assert "//   speed: [1, 2]" in fields
    script = f"import({json.dumps(module.as_uri())}).then(m => console.log(typeof m.mount))"
    run = subprocess.run(["node", "-e", script], capture_output=True, text=True, check=True)
    assert run.stdout == "function\n"


def test_code_of_a_list_beside_components_keeps_its_indentation(tmp_path: Path) -> None:
    code = """- A class:

  ```python
  class A:
      x = 1

      def f(self): ...

      # A comment
  ```
"""
    course = convert_files(
        tmp_path, {"one.mdx": f"# One\n\n<Tip>\n\n    Words.\n\n</Tip>\n\n{code}"}
    )
    lesson = course.files["content/lessons/1.1-one.md"].decode()
    assert code in lesson
    assert lesson.startswith("Words.\n")


def test_dollars_and_escaped_brackets_are_no_formulas_in_gitbook(tmp_path: Path) -> None:
    text = "See $[`a`](two.md)$, $60 \\* 24$ or $x$5; \\(as [b](two.md)\\) with $$y$$.\n"
    files = {"one.md": f"# One\n\n{text}", "two.md": "# Two\n\nWords.\n"}
    plain = convert_files(tmp_path / "plain", files)
    assert "$x5$" in plain.files["content/lessons/1.1-one.md"].decode()
    course = convert_files(tmp_path / "gitbook", {**files, ".gitbook.yaml": "root: ./\n"})
    lesson = course.files["content/lessons/1.1-one.md"].decode()
    assert lesson == (
        "See \\$[`a`](lesson:1.2)\\$, \\$60 \\* 24\\$ or \\$x\\$5; "
        "\\(as [b](lesson:1.2)\\) with $$y$$.\n"
    )


def test_a_picture_whose_tag_goes_over_lines_is_taken_along(tmp_path: Path) -> None:
    text = '# One\n\n<figure>\n  <img src="../p.png"\n    alt="A box">\n</figure>\n'
    course = convert_files(tmp_path, {"a/one.md": text, "p.png": "", "b/two.md": "# Two\n"})
    assert course.files["content/files/p.png"] == b""
    lesson = course.files["content/lessons/1.1-one.md"].decode()
    assert '<img src="../files/p.png"\n    alt="A box">' in lesson


def test_macros_of_settings_hold_in_the_formulas_that_use_them(tmp_path: Path) -> None:
    book = {
        "index.Rmd": "---\nheader-includes:\n- \\usepackage{a}\n- \\def\\bx{\\mathbf x}\n---\n\n"
        "# One\n\n$\\bx$.\n",
        "two.Rmd": "# Two\n\nSo $y = \\bx$ and $z$.\n",
    }
    course = convert_files(tmp_path / "book", book)
    assert course.files["content/lessons/1.1-two.md"].decode() == (
        "So $\\def\\bx{\\mathbf x}y = \\bx$ and $z$.\n"
    )
    myst = {
        "myst.yml": "project:\n  math:\n    '\\of': '#1(#2)'\n    '\\R': '\\mathbb{R}'\n",
        "one.md": "---\nmath:\n  '\\R': {macro: 'R'}\n---\n\n# One\n\n$\\of{f}{x} \\in \\R$\n",
        "two.md": "# Two\n\nThe set $\\R$.\n",
    }
    course = convert_files(tmp_path / "myst", myst)
    first, second = (course.files[f"content/lessons/1.{n}.md"].decode() for n in ("1-one", "2-two"))
    assert first == "$\\def\\of#1#2{#1(#2)}\\def\\R{R}\\of{f}{x} \\in \\R$\n"
    assert second == "The set $\\def\\R{\\mathbb{R}}\\R$.\n"


def test_a_text_of_headings_alone_is_a_draft(tmp_path: Path) -> None:
    course = convert_files(tmp_path, {"one.md": "# One\n\nText.\n", "two.md": "# Two\n\n## Aims\n"})
    lessons = tomllib.loads(course.files["content/course.toml"].decode())["level"][0]["lesson"]
    assert [lesson["status"] for lesson in lessons] == ["complete", "draft"]
