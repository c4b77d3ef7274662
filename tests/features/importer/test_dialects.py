"""Constructs that tools have in ways of their own, as they are in the new course."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from support.converted_folder import account_of, convert_files, first_lesson


def lesson(folder: Path, name: str, text: str, **files: str) -> str:
    """Return what becomes of a text in a folder with further files."""
    return first_lesson(convert_files(folder, {name: text, **files}))


@pytest.mark.parametrize(
    ("head", "reference"),
    [
        ("(here)=\n# Head\n\n## Part", "{ref}`here`"),
        ("# Head {#sec-here}\n\n## Part", "[](a.md#sec-here)"),
    ],
)
def test_a_reference_to_the_title_of_a_text_has_its_words(
    tmp_path: Path, head: str, reference: str
) -> None:
    course = convert_files(
        tmp_path, {"a.md": f"{head}\n\nText.\n", "b.md": f"# Two\n\nSee {reference}.\n"}
    )
    text = course.files["content/lessons/1.2-b.md"].decode()
    assert text.startswith("See [Head](lesson:1.1#")
    assert "which no text sets" not in account_of(course)


def test_a_source_in_a_sentence_is_called_by_its_authors(tmp_path: Path) -> None:
    works = (
        "@book{a, author = {Huygens, Christiaan}, title={H}}\n"
        "@book{b, author={Ada Lovelace and {The Team}}, title={L}}\n@misc{c, title={T}}\n"
    )
    text = "# One\n\nAs @a found, @b [p. 3] and @c; not @d, me@a.org or [@a].\n"
    course = convert_files(
        tmp_path, {"a.qmd": text, "b.md": "# B\n\n{cite:t}`a,b`\n", "r.bib": works}
    )
    assert course.files["content/lessons/1.1-a.md"].decode() == (
        "As Huygens [@a] found, Lovelace and The Team [@b, p. 3] and [@c]; not @d, me@a.org "
        "or [@a].\n"
    )
    assert course.files["content/lessons/1.2-b.md"].decode() == (
        "Huygens [@a] and Lovelace and The Team [@b]\n"
    )


def test_a_book_of_bookdown(tmp_path: Path) -> None:
    """Its order, parts, references, theorems and pictures."""
    course = convert_files(
        tmp_path,
        {
            "_bookdown.yml": "rmd_files: [index.Rmd, z.Rmd, a.Rmd]\n",
            "index.Rmd": "---\ntitle: Fits\n---\n\n# Preface {-}\n\nText.\n",
            "z.Rmd": "# (PART) Lines {-}\n\n# A line {#line}\n\n"
            "See Figure \\@ref(fig:logo), Chapter \\@ref(end) and (\\@ref(eq:y)).\n\n"
            "\\begin{equation}\ny = x (\\#eq:y)\n\\end{equation}\n\n"
            '```{theorem, ls, name="Least"}\nBest.\n```\n\nTheorem \\@ref(thm:ls).\n\n'
            "```{r logo, fig.cap='A logo'}\nknitr::include_graphics(\"p.png\")\n```\n",
            "a.Rmd": "# The end {#end}\n\nText.\n",
            "p.png": "\x89PNG",
        },
    )
    course_map = course.files["content/course.toml"].decode()
    assert 'title = "Fits"' in course_map
    assert course_map.index('title = "Lines"') < course_map.index('title = "A line"')
    assert course.files["content/lessons/1.1-z.md"].decode() == (
        '<a id="line"></a>\n\n\n'
        "See [](#fig:logo), Chapter [The end](lesson:1.2#end) and [](#eq:y).\n\n"
        "$$\\begin{equation}\ny = x \n\\end{equation}$$ {#eq:y}\n\n"
        "> [!theorem] Least {#thm:ls}\n> Best.\n\n[](#thm:ls).\n\n"
        "Figure: ![A logo](../files/p.png) A logo {#fig:logo}\n"
    )


def test_code_that_docusaurus_imports_and_colours(tmp_path: Path) -> None:
    text = (
        "# One\n\nimport Src from '!!raw-loader!./gas.py';\n\n"
        '<CodeBlock language="python" title="gas.py">{Src}</CodeBlock>\n\n'
        "```python\n# highlight-next-line\nx = 1\n```\n\n"
        "- A\n\n  ```sh\n  # error-start\n  a\n  ```\n"
    )
    files = {
        "docs/gas.py": "print('gas')\n",
        "docusaurus.config.js": "module.exports = {title: 'Heat', a: {\n title: 'More'}};\n",
    }
    course = convert_files(tmp_path, {"docs/a.mdx": text, **files})
    assert 'title = "Heat"' in course.files["content/course.toml"].decode()
    assert course.files["content/lessons/1.1-a.md"].decode() == (
        "**gas.py**\n\n```python\nprint('gas')\n```\n\n```python\nx = 1\n```\n\n"
        "- A\n\n  ```sh\n  a\n  ```\n"
    )


def test_a_later_cell_imports_nothing_from_the_future(tmp_path: Path) -> None:
    sources = ("x = 1\n", "from __future__ import division\nprint(x / 2)\n")
    cells = [{"cell_type": "code", "source": source, "outputs": []} for source in sources]
    notebook = json.dumps({"cells": cells, "metadata": {}, "nbformat": 4})
    assert "__future__" not in lesson(tmp_path, "a.ipynb", notebook)


def test_links_and_signs_that_cannot_stay_are_told(tmp_path: Path) -> None:
    figure = "```{figure} p.png\n:name: fig-a\n:target: https://a.org\nB\n```"
    course = convert_files(
        tmp_path, {"a.md": f"# One\n\n:smile:\n\n{figure}\n", "p.png": "", "mkdocs.yml": "{}"}
    )
    left = account_of(course).partition("## Left")[2]
    assert "- `:smile:`, shown as written: write the sign, if its tool draws one\n" in left
    assert "- the link of a figure to `https://a.org`, which has a number here\n" in left


def test_a_drawing_loses_only_what_none_may_hold(tmp_path: Path) -> None:
    start = '<svg xmlns="http://www.w3.org/2000/svg"'
    text = '<switch><foreignObject><p xmlns="">B</p></foreignObject><text>B</text></switch></svg>'
    files = {"a.md": "# One\n\n![B](b.svg)\n", "b.svg": f'{start} host="C">{text}'}
    course = convert_files(tmp_path, files)
    drawing = course.files["content/files/b.svg"].decode()
    assert drawing == f"{start}><switch><text>B</text></switch></svg>"
    assert "  - b.svg: `host` of `<svg>`, `<foreignObject>`\n" in account_of(course)


def test_a_block_in_a_list_that_nothing_reads_is_text(tmp_path: Path) -> None:
    text = "# One\n\n- It goes\n\n  ```ipywidget\n  A\n  ```\n\n  ```mermaid\n  A --> B\n  ```\n"
    assert "  ```text\n  A --> B\n  ```" in lesson(tmp_path, "a.md", text)


@pytest.mark.parametrize(
    ("name", "text", "expected", "files"),
    [
        (
            "src/a.md",
            "# One\n\n```python\n~a()\nb()\n```\n\n```sh,hidelines=!!\nc\n  !!d\n```\n",
            "```python\nb()\n```\n\n```sh\nc\n```\n",
            {
                "src/SUMMARY.md": "- [A](a.md)\n",
                "book.toml": '[output.html.code.hidelines]\npython = "~"\n',
            },
        ),
        (
            "docs/a.md",
            "# One\n\nThe [[ name ]].\n\n[% if name %]\nText.\n[% endif %]\n",
            "The Ball.\n\n\nText.\n",
            {
                "mkdocs.yml": "plugins:\n  - macros:\n      j2_variable_start_string: '[['\n"
                "      j2_variable_end_string: ']]'\n      j2_block_start_string: '[%'\n"
                "      j2_block_end_string: '%]'\nextra: {name: Ball}\n"
            },
        ),
        (
            "a.md",
            "# One\n\n```{list-table} T\n:name: tab-a\n* - b\n```\n\n```{embed} #tab-a\n```\n\n"
            "![](#tab-a)\n",
            "Table: T {#tab:a}\n\n| b |\n| --- |\n\n[](#tab:a)\n\n[](#tab:a)\n",
            {},
        ),
        (
            "a.md",
            "# One\n\n[@a/b]: https://a.org\n\nSee [@a/b]. $x$ $\\ \\ $(y)\n",
            "[\\@a/b]: https://a.org\n\nSee [\\@a/b]. $x$ (y)\n",
            {},
        ),
        (
            "a.md",
            "# One\n\n> $$\n> a\n> =\n> b\n> =\n> c\n> $$\n>\n> ```{note}\n> d\n> ```\n",
            "> $$\n> a\n> =\n> b\n> =\n> c\n> $$\n>\n> > [!note]\n> > d\n",
            {},
        ),
        (
            "a.qmd",
            "# One\n\nA bar.\\indexf{geom_bar}\n\n```{r}\n#| label: fig-a\n#| fig.cap: A ball.\n"
            'knitr::include_graphics("p.png", dpi = 300)\n```\n\n'
            '<iframe title="Film"\nsrc="https://a.org/b"></iframe>\n',
            "A bar.\n\nFigure: ![A ball.](../files/p.png) A ball. {#fig:a}\n\n"
            '<a href="https://a.org/b">Film</a>\n',
            {"p.png": "\x89PNG"},
        ),
        (
            "a.ipynb",
            '{"cells": [{"cell_type": "markdown", "source": "|a|\\n|-|\\n|$|b|$ \\\\\\\\$1|"}]}',
            "|a|\n|-|\n|$\\vert b\\vert$ \\$1|\n",
            {},
        ),
        (
            "a.md",
            "# One\n\n10. A\n\n    > [!EXAMPLE]\n    > B\n",
            "10. A\n\n    > [!note]\n    > B\n",
            {},
        ),
    ],
)
def test_marks_and_labels_that_settings_or_a_text_give(
    tmp_path: Path, name: str, text: str, expected: str, files: dict[str, str]
) -> None:
    assert lesson(tmp_path, name, text, **files) == expected
