"""Constructs that tools have in ways of their own, as they are in the new course."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from support.converted_folder import account_of, convert_files


def lesson(folder: Path, name: str, text: str, **files: str) -> str:
    """Return what becomes of a text in a folder with further files."""
    course = convert_files(folder, {name: text, **files})
    return next(
        data.decode() for path, data in course.files.items() if path.startswith("content/lessons/")
    )


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        (
            "a.md",
            "# One\n\n```{prf:theorem} Sum\n:label: th-sum\nIt adds.\n```\n\n"
            "{prf:ref}`th-sum`, [](#th-sum)\n",
            "> [!theorem] Sum {#theorem:th-sum}\n> It adds.\n\n"
            "[](#theorem:th-sum), [](#theorem:th-sum)\n",
        ),
        (
            "a.md",
            "# One\n\n```{code-block} python\n:name: step\nx = 1\n```\n\n{numref}`step`\n",
            "```python {#lst:step}\nx = 1\n```\n\n[](#lst:step)\n",
        ),
        (
            "a.qmd",
            "# One\n\n::: {#thm-a}\n## Name\nText.\n:::\n\nSee @thm-a.\n",
            "> [!theorem] Name {#thm:a}\n> Text.\n\nSee [](#thm:a).\n",
        ),
        (
            "a.qmd",
            '# One\n\n```{#lst-a .python lst-cap="Its step"}\nx = 1\n```\n\nSee @lst-a.\n',
            "**Its step**\n\n```python {#lst:a}\nx = 1\n```\n\nSee [](#lst:a).\n",
        ),
        (
            "a.qmd",
            "# One\n\n```{python}\n#| lst-label: lst-b\n#| lst-cap: Its step\nx = 1\n```\n\n"
            "@lst-b\n",
            "**Its step**\n\n```python file=examples/l1_1_a.py {#lst:b}\nx = 1\n```\n\n"
            "[](#lst:b)\n",
        ),
        (
            "a.qmd",
            "# One\n\n::: {#fig-two}\n![A](p.png)\n\nBoth.\n:::\n\nSee @fig-two.\n",
            '<a id="fig-two"></a>\n\n![A](../files/p.png)\n\nBoth.\n\n'
            "See [the figure](#fig-two).\n",
        ),
        (
            "a.md",
            "# One\n\n- In `/users/{id}`, it is `1`.\n- Then `/{id}` and\n- `x`.\n",
            "- In `/users/{id}`, it is `1`.\n- Then `/{id}` and\n- `x`.\n",
        ),
        (
            "a.qmd",
            "# One\n\nSee [](`~pkg.part.f`) and [](`pkg.g`), a^[1](#b)^.\n",
            "See `f` and `pkg.g`, a<sup>1</sup>.\n",
        ),
        (
            "a.md",
            '# One\n\n```js title="app/[[...x]]/{{y}}.js"\n1\n```\n',
            "**app/\\[\\[...x\\]\\]/\\{\\{y\\}\\}.js**\n\n```js\n1\n```\n",
        ),
    ],
)
def test_what_has_a_number_keeps_it(tmp_path: Path, name: str, text: str, expected: str) -> None:
    assert lesson(tmp_path, name, text, **{"p.png": "\x89PNG"}) == expected


@pytest.mark.parametrize(
    ("head", "reference"),
    [("(here)=\n# Head", "{ref}`here`"), ("# Head {#sec-here}", "[](a.md#sec-here)")],
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


def test_the_names_of_lists_of_examples_are_their_numbers(tmp_path: Path) -> None:
    text = "# One\n\n(@)  First\n(@good)  Second\n\n(@)  Third\n\nAs (@good) shows, not (@x).\n"
    new = lesson(tmp_path, "a.qmd", text)
    assert new == "1.  First\n2.  Second\n\n3.  Third\n\nAs (2) shows, not (@x).\n"


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


def test_tabs_of_quarto_are_no_headings(tmp_path: Path) -> None:
    tabs = "## Left\nA.\n\n```\n## code\n```\nC.\n## Right {.x}\nB."
    text = f"# One\n\n::: {{.panel-tabset}}\n{tabs}\n:::\n"
    new = lesson(tmp_path, "a.qmd", text)
    assert new == "**Left**\n\nA.\n\n```\n## code\n```\n\nC.\n\n**Right**\n\nB.\n"


def test_macros_of_a_book_are_defined_where_formulas_use_them(tmp_path: Path) -> None:
    settings = {"tex": {"macros": {"vv": r"\mathbf{v}", "dd": [r"\frac{d #1}{d #2}", 2]}}}
    config = {"title": "C", "sphinx": {"config": {"mathjax3_config": settings}}}
    new = lesson(
        tmp_path,
        "a.md",
        "# One\n\n$\\vv = \\dd{x}{t}$, $x$\n",
        **{"_config.yml": json.dumps(config)},
    )
    definitions = r"\def\vv{\mathbf{v}}\def\dd#1#2{\frac{d #1}{d #2}}"
    assert new == rf"${definitions}\vv = \dd{{x}}{{t}}$, $x$" + "\n"


def test_a_picture_between_tags_of_a_figure_has_its_caption(tmp_path: Path) -> None:
    text = (
        '# One\n\n<figure markdown="span">\n  ![A](p.png){ width="3" }\n'
        "  <figcaption>At rest</figcaption>\n</figure>\n"
    )
    assert lesson(tmp_path, "a.md", text, **{"p.png": "\x89PNG"}) == (
        "Figure: ![A](../files/p.png) At rest\n"
    )


def test_directives_of_tables_pictures_and_terms(tmp_path: Path) -> None:
    text = (
        '# One\n\n```{csv-table}\n"a", "b, c"\n```\n\n'
        "```{figure-md} fig-m\n![M](p.png)\n\nModes.\n```\n\n"
        "```{glossary}\nstiffness\n: Force per length.\n```\n\n{pep}`8`\n"
    )
    assert lesson(tmp_path, "a.md", text, **{"p.png": "\x89PNG"}) == (
        "| a | b, c |\n| --- | --- |\n\nFigure: ![M](../files/p.png) Modes. {#fig:m}\n\n"
        "[stiffness]{term}: Force per length.\n\nPEP 8\n"
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


def test_cells_of_a_language_are_lines_of_one_script(tmp_path: Path) -> None:
    cells = [
        {"cell_type": "code", "source": "x <- c(1, 2)", "outputs": []},
        {
            "cell_type": "code",
            "source": "mean(x)",
            "outputs": [{"output_type": "execute_result", "data": {"text/plain": "[1] 1.5"}}],
        },
    ]
    metadata = {"kernelspec": {"language": "R"}}
    notebook = json.dumps({"cells": cells, "metadata": metadata, "nbformat": 4})
    script = "examples/l1_1_a.R"
    assert lesson(tmp_path, "a.ipynb", notebook) == (
        f"```r show={script}#L1-L1\nx <- c(1, 2)\n```\n\n"
        f"```r show={script}#L2-L2\nmean(x)\n```\n\n```text\n[1] 1.5\n```\n\n"
        f"```r file={script} folded\nx <- c(1, 2)\nmean(x)\n```\n\n```output\n[1] 1.5\n```\n"
    )


def test_code_that_docusaurus_imports_and_colours(tmp_path: Path) -> None:
    text = (
        "# One\n\nimport Src from '!!raw-loader!./gas.py';\n\n"
        '<CodeBlock language="python" title="gas.py">{Src}</CodeBlock>\n\n'
        "```python\n# highlight-next-line\nx = 1\n```\n"
    )
    files = {
        "docs/gas.py": "print('gas')\n",
        "docusaurus.config.js": "module.exports = {title: 'Heat', a: {\n title: 'More'}};\n",
    }
    course = convert_files(tmp_path, {"docs/a.mdx": text, **files})
    assert 'title = "Heat"' in course.files["content/course.toml"].decode()
    assert course.files["content/lessons/1.1-a.md"].decode() == (
        "**gas.py**\n\n```python\nprint('gas')\n```\n\n```python\nx = 1\n```\n"
    )


DOXYGEN = "See [Shape](@ref Shape::Get). As \\f$v_0\\f$, not `\\f$x`:\n\n\\f[\nv = 0\n\\f]\n"
CALLOUT = "::: {.callout-note}\n### Norms {#iso}\nText.\n:::\n"
TABLE = "| a | b |\n|---|---|\n| `{n}` | c |\n| `{n,}` | d |\n"


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("a.md", DOXYGEN, "See Shape. As $v_0$, not `\\f$x`:\n\n$$\nv = 0\n$$\n"),
        (
            "a.md",
            "```{math}\n:label: e\na &= b \\\\\n&= c\n```\n",
            "$$\n\\begin{aligned}\na &= b \\\\\n&= c\n\\end{aligned}\n$$ {#eq:e}\n",
        ),
        ("a.qmd", CALLOUT, '> [!note] Norms\n> <a id="iso"></a>\n> Text.\n'),
        ("a.qmd", "A.\n\n---\neval: false\n---\n\nB.\n", "A.\n\n\n\nB.\n"),
        ("a.md", "A.\n\n---\neval: false\n---\n\nB.\n", "A.\n\n---\neval: false\n---\n\nB.\n"),
        ("a.qmd", "A `r n = 1` b\\index{a|see{b}}.\n", "A  b.\n"),
        ("a.md", ":orphan:\n\nA.\n\n:b: How\n  deep.\n:c:\n", "A.\n\n- **b**: How deep.\n"),
        ("a.qmd", "A -- b---c.[d]{.aside}\n", "A – b—c.[^note-1]\n\n[^note-1]: d\n"),
        ("a.md", "<!-- a.b -->\n\n:   C.\n\n<!-- d -->\n", "**`a.b`**: C.\n\n<!-- d -->\n"),
        ("a.md", TABLE, TABLE),
        ("a.md", '## B { #b data-label="C \\"d\\"" }\n\nText.\n', "## B {#b}\n\nText.\n"),
        ("a.md", "A.\n\n # B\n\nText.\n", "A.\n\n## B\n\nText.\n"),
        ("a.md", "- A:\n\n  ```sh\n  # B\n  ```\n", "- A:\n\n  ```sh\n  # B\n  ```\n"),
        ("a.md", "% Later.\n\n```{bibliography} b.bib\n```\n", "<!-- Later. -->\n"),
    ],
)
def test_what_is_right_in_its_tool_is_right_here(
    tmp_path: Path, name: str, text: str, expected: str
) -> None:
    assert lesson(tmp_path, name, f"\nOne\n===\n\n{text}", **{"conf.py": ""}) == expected


def test_a_later_cell_imports_nothing_from_the_future(tmp_path: Path) -> None:
    sources = ("x = 1\n", "from __future__ import division\nprint(x / 2)\n")
    cells = [{"cell_type": "code", "source": source, "outputs": []} for source in sources]
    notebook = json.dumps({"cells": cells, "metadata": {}, "nbformat": 4})
    assert "__future__" not in lesson(tmp_path, "a.ipynb", notebook)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("`{a:b}` in code,\n`c`", "`{a:b}` in code,\n`c`"),
        ("[a][b]{ .button } [c]{.x}\n\n[b]: https://a.org", "[a][b] c\n\n[b]: https://a.org"),
        ('++"Go: To"+ctrl++', "Go: To+Ctrl"),
        ("[![](https://a.org/b.svg?c)](https://a.org)", "[b.svg](https://a.org)"),
        ("Fig.~3 :smile: `#!a-b c`", "Fig.~3 :smile: `c`"),
        ("- (at)=\n  A.\n\n[b](#at)", '- <a id="at"></a>\n  A.\n\n[b](#at)'),
        ("A. ^b-1\n\n[[#^b-1|c]]", 'A. <a id="b-1"></a>\n\n[c](#b-1)'),
        (
            "1. A\n\n   <figure markdown>\n     ![B](p.png)\n   </figure>",
            "1. A\n\n   ![B](../files/p.png)",
        ),
        (
            "```{image} p.png\n:alt: A\n:target: https://a.org\n```",
            "[![A](../files/p.png)](https://a.org)",
        ),
        (
            "```{code-cell}\n# | code-fold: true\ntry:\n    import os\nexcept ImportError:\n"
            "    !pip install os\n```",
            "```python file=examples/l1_1_a.py folded\ntry:\n    import os\nexcept ImportError:\n"
            "    pass\n```",
        ),
        ("[@b] ([@b])\n\n[@b]: https://a.org", r"[\@b] ([\@b])" + "\n\n" + r"[\@b]: https://a.org"),
        ("[B][^1].\n\n[B]: https://b.org\n[^1]: C.", "[B][][^1].\n\n[B]: https://b.org\n[^1]: C."),
        ("- :material-x:{ .lg } &nbsp; __A__\n\n  ---", "- __A__\n\n  ---"),
        ("{octicon}`law;1em` B [:material-x:](https://a.org/b)", " B [a.org](https://a.org/b)"),
        ("(a/b)=\n## B\n\n[c](#a/b)", "## B {#a-b}\n\n[c](#a-b)"),
        ("::::{note}\n```\n:::\n```\n::::\n\nB.", "> [!note]\n> ```\n> :::\n> ```\n\nB."),
        (
            ":::{grid-item-card} {ref}`at`\n:link: at\n:link-type: ref\n:::\n\n(at)=\n## B",
            "**[B](#at)**\n\n## B {#at}",
        ),
        ("`{{ #include }}`", "`{{ #include }}`"),
        ("```rust\n{{#include gone.rs}}\n```", "```rust\n{{#include gone.rs}}\n```"),
        ('--8<-- "gone.md"\n\n`{!gone.md!}`', "`gone.md`\n\n`{!gone.md!}`"),
        ("{* hidden/c.py hl[2] *}", "```py\nd = 1\n```"),
        (
            "```{code-cell}\nplt.rc('a', b=1)\n```",
            "```python file=examples/l1_1_a.py\nplt.rc('a', b=1)\n```",
        ),
        ("{% raw %}\n`{% include 'p.md' %}`\n{% endraw %}\n", "`{% include 'p.md' %}`"),
        ("- B\n\n  {% include-markdown 'hidden/.b.md'\n  %}", "- B\n\n  C\n  D"),
        ("{% block b %}\nB, {% c %}.\n{% endblock %}", "B, `{% c %}`."),
        ("{{ api('/a/b', 2) }} {{ c() }}", "`/a/b` `{{ c() }}`"),
        ("[[1]](#b) [B](#b){ data-c }\n\n## B", "[[1]](#b) [B](#b)\n\n## B"),
        ('A `<p class="row">` <i class="row b">B</i>', 'A `<p class="row">` <i>B</i>'),
        ("As [Lesson 1.1](a.md), Level 1 is.", "As [Lesson 1.1](lesson:1.1), Level <!-- -->1 is."),
        ("On to [Lesson 1.4](a.md).", "On to [Lesson <!-- -->1.4](lesson:1.1)."),
        ("## B {#b}\n\n## C {#b}", "## B {#b}\n\n## C"),
        ("[B](javascript:c())", "B"),
        (
            '```{code-cell}\nprint("%d"\n      % 3)\n```',
            '```python file=examples/l1_1_a.py\nprint("%d"\n      % 3)\n```',
        ),
    ],
)
def test_what_stands_in_a_line_or_a_block(tmp_path: Path, text: str, expected: str) -> None:
    (tmp_path / "old/.obsidian").mkdir(parents=True)
    files = {
        "p.png": "\x89PNG",
        "mkdocs.yml": "site_name: A",
        "hidden/.b.md": "C\nD\n",
        "hidden/c.py": "d = 1\n",
    }
    new = lesson(tmp_path, "a.md", f"\nOne\n===\n\n{text}\n", **files)
    assert new == f"{expected}\n"


def test_links_and_signs_that_cannot_stay_are_told(tmp_path: Path) -> None:
    figure = "```{figure} p.png\n:name: fig-a\n:target: https://a.org\nB\n```"
    course = convert_files(
        tmp_path, {"a.md": f"# One\n\n:smile:\n\n{figure}\n", "p.png": "", "mkdocs.yml": "{}"}
    )
    left = account_of(course).partition("## Left")[2]
    assert "- `:smile:`, shown as written: write the sign, if its tool draws one\n" in left
    assert "- the link of a figure to `https://a.org`, which has a number here\n" in left


def test_the_argument_of_a_note_is_its_title_where_myst_reads_it(tmp_path: Path) -> None:
    note = "# One\n\n```{note} B\nC.\n```\n"
    assert lesson(tmp_path / "sphinx", "a.md", note) == "> [!note]\n> B\n> C.\n"
    files = {"myst.yml": "project: {}\n"}
    assert lesson(tmp_path / "myst", "a.md", note, **files) == "> [!note] B\n> C.\n"


def test_a_drawing_loses_only_what_none_may_hold(tmp_path: Path) -> None:
    start = '<svg xmlns="http://www.w3.org/2000/svg"'
    text = '<switch><foreignObject><p xmlns="">B</p></foreignObject><text>B</text></switch></svg>'
    files = {"a.md": "# One\n\n![B](b.svg)\n", "b.svg": f'{start} host="C">{text}'}
    course = convert_files(tmp_path, files)
    drawing = course.files["content/files/b.svg"].decode()
    assert drawing == f"{start}><switch><text>B</text></switch></svg>"
    assert "  - b.svg: `host` of `<svg>`, `<foreignObject>`\n" in account_of(course)


def test_a_picture_is_described_by_its_attributes(tmp_path: Path) -> None:
    text = "# One\n\n![](p.png){alt='A [bent] graph'}\n\n![B](p.png){alt=\"C\" width=3}\n"
    assert lesson(tmp_path, "a.md", text, **{"p.png": "\x89PNG"}) == (
        "![A [bent] graph](../files/p.png)\n\n![B](../files/p.png)\n"
    )


def test_formulas_are_whole_whatever_their_lines_begin_with(tmp_path: Path) -> None:
    text = (
        "# One\n\n\\f$\n\\newcommand{\\w}{\\omega}\n\n\\newcommand{\\v}{u}\n\\f$\n\n"
        "So \\f$\\v\\f$.\n\n"
        "\\f$\\begin{align*}a&=b\\end{align*}\\f$\n\n"
        "1. It is\n\n    $$ a =\nb\n$$\n\n2. It costs $\\$10 \\pm \\$1$.\n"
    )
    assert lesson(tmp_path, "a.md", text).strip() == (
        "So $\\newcommand{\\v}{u}\\v$.\n\n"
        "$\\begin{aligned}a&=b\\end{aligned}$\n\n"
        "1. It is\n\n    $$ a =\n    b\n    $$\n\n2. It costs $\\$10 \\pm \\$1$."
    )


def test_a_block_in_a_list_that_nothing_reads_is_text(tmp_path: Path) -> None:
    text = "# One\n\n- It goes\n\n  ```ipywidget\n  A\n  ```\n\n  ```mermaid\n  A --> B\n  ```\n"
    assert "  ```text\n  A --> B\n  ```" in lesson(tmp_path, "a.md", text)
