"""What becomes of each construct of each format: it is taken, changed or left, and never lost.

Each construct has words of its own, such as `wa1`. They stand in the new course, or in what the
account says is left; and the account counts the construct, in the column that is given here.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from coursebuild.features.importer.convert import ConvertedCourse
from support.converted_folder import account_of, convert_files

Construct = tuple[str, str, str]
"""What the account calls it; the column it is counted in; and how it is written."""
TAKEN, CHANGED, LEFT = "taken", "changed", "left"
PICTURE = "\x89PNG"

MYST: list[Construct] = [
    ("heading", TAKEN, "## Heading wa1"),
    ("table", TAKEN, "| wa2 | b |\n| --- | --- |\n| wa3 | d |"),
    ("footnote", TAKEN, "Text.[^n]\n\n[^n]: Note wa4."),
    ("item of a list", TAKEN, "- item wa5\n- item wa6"),
    ("comment", TAKEN, "Text.\n\n<!-- wa7 -->"),
    ("comment of MyST", CHANGED, '% a remark wa83\n\n+++ {"note": "wa84"}'),
    ("directive `{proof}`", CHANGED, "```{proof}\nwa85\n```"),
    (
        "directive `{card}`",
        CHANGED,
        "```{card} wa86\n:header: wa87\n:footer: wa88\nwa89\n```",
    ),
    ("directive `{sidebar}`", CHANGED, "```{sidebar} wa90\n:subtitle: wa91\nwa92\n```"),
    ("label", CHANGED, "(here)=\n## Labelled wa8"),
    ("link", TAKEN, "[wa9](https://example.org)"),
    ("link by reference", CHANGED, "See [wa10][two].\n\n[two]: two.md"),
    ("picture", CHANGED, "![wa11](p.png)"),
    ("picture", LEFT, "![wa12](https://example.org/wa13.png)"),
    ("formula", CHANGED, r"$x_1 $ and \(z\) wa14"),
    ("formula", TAKEN, "$$\na_{wa15}\n$$"),
    ("role `{math}`", CHANGED, "{math}`y_{wa16}`"),
    ("role `{cite:t}`", CHANGED, "{cite:t}`wa17`"),
    ("role `{cite}`", LEFT, "{cite}`wa18`"),
    ("role `{index}`", CHANGED, "{index}`wa19`"),
    ("role `{doc}`", CHANGED, "{doc}`words wa20\n<two>`"),
    ("role `{ref}`", CHANGED, "{ref}`words wa21 <here>`"),
    ("role `{any}`", CHANGED, "{any}`words wa99 <here>`"),
    ("role `{numref}`", CHANGED, "{numref}`fig-one`"),
    ("role `{eq}`", CHANGED, "{eq}`energy`"),
    ("role `{term}`", CHANGED, "{term}`wa22`"),
    ("role `{abbr}`", CHANGED, "{abbr}`wa23 (long wa24)`"),
    ("role `{sup}`", CHANGED, "{sup}`wa25`"),
    ("role `{download}`", CHANGED, "{download}`wa26 <data.csv>`"),
    ("role `{py:func}`", CHANGED, "{py:func}`wa27.run`"),
    ("role `{glue:text}`", LEFT, "{glue:text}`wa28`"),
    ("directive `{raw}`", LEFT, "```{raw} latex\n\\wa29\n```"),
    ("directive `{raw}`", CHANGED, "```{raw} html\n<p>wa30</p>\n```"),
    ("directive `{index}`", LEFT, "```{index} single: wa31\n```"),
    ("directive `{exercise}`", CHANGED, "```{exercise} Title wa32\n:label: ex\nDo wa33.\n```"),
    ("directive `{solution}`", CHANGED, "```{solution} ex\nDone wa34.\n```"),
    (
        "directive `{exercise}`",
        CHANGED,
        "```{exercise-start}\n:label: ex2\n```\nLong wa35.\n```{exercise-end}\n```",
    ),
    ("directive `{note}`", CHANGED, "```{note}\nNote wa36.\n```"),
    ("directive `{admonition}`", CHANGED, "```{admonition} Title wa37\n:class: tip\nwa38\n```"),
    (
        "directive `{tab-item}`",
        CHANGED,
        "````{tab-set}\n```{tab-item} wa39\nwa40\n```\n```{tab-item} wa41\nwa42\n```\n````",
    ),
    (
        "directive `{grid-item-card}`",
        CHANGED,
        "````{grid} 2\n```{grid-item-card} wa43\n:link: two\nhead wa44\n^^^\nbody wa45\n"
        "+++\nfoot wa46\n```\n````",
    ),
    (
        "directive `{figure}`",
        CHANGED,
        "```{figure} p.png\n:width: 50%\n:name: fig-one\n\nCaption wa47, *long*.\n\nwa48\n```",
    ),
    ("directive `{math}`", CHANGED, "```{math}\n:label: energy\nE_{wa49}\n```"),
    ("directive `{list-table}`", CHANGED, "```{list-table} T wa50\n* - wa51\n  - wa52\n* - c\n```"),
    ("directive `{csv-table}`", CHANGED, '```{csv-table}\n:header: wa53, b\nwa54,"c, wa55"\n```'),
    ("directive `{glossary}`", CHANGED, "```{glossary}\nEnergy wa56\n  Is kept wa57.\n```"),
    ("directive `{literalinclude}`", CHANGED, "```{literalinclude} code.py\n:lines: 2\n```"),
    ("directive `{include}`", CHANGED, "```{include} part.txt\n```"),
    ("directive `{versionadded}`", CHANGED, "```{versionadded} 1.2\nNew wa60.\n```"),
    ("directive `{prf:theorem}`", CHANGED, "```{prf:theorem} Name wa61\n:label: t\nwa62\n```"),
    ("directive `{eval-rst}`", LEFT, "```{eval-rst}\n.. note:: wa63\n```"),
    ("directive `{bibliography}`", CHANGED, "```{bibliography}\n```"),
    ("directive `{dropdown}`", CHANGED, "```{dropdown} Title wa64\nwa65\n```"),
    ("directive `{code-block}`", CHANGED, "```{code-block} cpp\n:caption: C wa66\nint wa67;\n```"),
    ("directive `{iframe}`", CHANGED, "```{iframe} https://example.org/wa68\n```"),
    ("block of `python`", CHANGED, "```Python\nwa69\n```"),
    ("block of `pycon`", CHANGED, "```python\n>>> wa70\n```"),
    ("cell", CHANGED, "```{code-cell} python\nwa71 = 1\nprint(wa71)\n```"),
    ("cell", LEFT, "```{code-cell} python\n:tags: [raises-exception]\nwa72\n```"),
    ("cell", LEFT, "```{code-cell} python\n---\nother: 1\n---\nnot python wa73\n```"),
    (
        "figure of a cell",
        CHANGED,
        "```{code-cell} python\nimport matplotlib.pyplot as plt\nplt.plot([1])\n"
        'plt.title("Title wa74")\nplt.show()\n```',
    ),
    ("magic", LEFT, "```{code-cell} python\n%wa75 inline\nx = 1\n```"),
    ("tag of HTML", CHANGED, '<img src="p.png" alt="wa76">'),
    ("tag of HTML", LEFT, "<style>\n.x { color: red }\n</style>"),
    ("directive `{csv-table}`", CHANGED, "```{csv-table} wa77\n:file: data.csv\n```"),
    (
        "directive `{exercise}`",
        CHANGED,
        "```{exercise-start}\n:label: ex3\n```\n\n```python\nwa78\n```\n\n```{exercise-end}\n```",
    ),
    ("cell of `julia`", LEFT, "```{code-cell} julia\nwa79\n```"),
    (
        "value that is glued",
        CHANGED,
        "```{code-cell} python\nfrom myst_nb import glue\n"
        "glue('wa93', 2 * 3,\n  display=False)\n```",
    ),
    (
        "figure of a cell",
        CHANGED,
        "```{code-cell} python\nimport matplotlib.pyplot as plt\nplt.plot([1])\n"
        "plt.title('Title wa94')\nplt.savefig('out/wa95.png', dpi=80)\n```",
    ),
    ("role `{del}`", CHANGED, "{del}`wa80`"),
    ("substitution", CHANGED, "The {{ mass }} wa81"),
    ("link", LEFT, "[wa82](inv:python#print)"),
]
QUARTO: list[Construct] = [
    ("callout", CHANGED, '::: {.callout-tip collapse="true" title="wb1"}\nText wb2\n:::'),
    ("division", CHANGED, "::: {.column-margin}\nwb3\n:::"),
    ("division", LEFT, '::: {.content-visible when-format="pdf"}\nwb4\n:::'),
    ("callout", CHANGED, "::: {#thm-a}\n## Name wb5\nText wb6\n:::"),
    ("footnote", CHANGED, "Text^[A note wb7\nof two lines wb8.] on."),
    ("code in a line", LEFT, "It is `{python} wb9`."),
    ("cross-reference", CHANGED, "## Head wb10 {#sec-s}\n\nSee @sec-s."),
    (
        "cross-reference",
        CHANGED,
        '![Caption wb11](p.png){#fig-p fig-alt="Alt wb12"}\n\nSee @fig-p.',
    ),
    ("cross-reference", LEFT, "See @fig-none."),
    ("citation", TAKEN, "Says [see @wb24, p. 3]."),
    ("citation", LEFT, "Says [see @wb25]."),
    ("substitution", CHANGED, "{{< video wb13.mp4 >}}"),
    ("substitution", CHANGED, "{{< pagebreak >}}"),
    ("file that is included", CHANGED, "{{< include _part.qmd >}}"),
    ("file that is included", LEFT, "{{< include wb15.qmd >}}"),
    ("cell", CHANGED, "```{python}\n#| echo: false\nprint('wb16')\n```"),
    ("cell", LEFT, "```{python}\n#| eval: false\nprint('wb17')\n```"),
    (
        "figure of a cell",
        CHANGED,
        "```{python}\n#| label: fig-cell\n#| fig-cap: Caption wb18\n"
        "import matplotlib.pyplot as plt\nplt.plot([1])\n```\n\nSee @fig-cell.",
    ),
    ("cell of `r`", LEFT, '```{r, echo=FALSE, fig.cap="Two wb18"}\nwb19\n```'),
    ("cell of `bash`", LEFT, "```{bash}\n#| label: wb60\necho wb61\n```"),
    ("cell of `r`", CHANGED, "```{r}\nwb62\n```\n\n```{r}\nwb63\n```"),
    ("cell of `julia`", LEFT, "```{julia}\n#| eval: false\nwb64\n```"),
    ("caption of a table", CHANGED, "| a |\n| - |\n| wb20 |\n\n: Caption wb21 {#tbl-t}"),
    ("attributes", CHANGED, "[words wb22]{.smallcaps}"),
    ("block that is raw", LEFT, "```{=latex}\n\\wb23\n```"),
    ("definition", CHANGED, "Term wb30\n\n:   One wb31\n:   Two wb32\n\n    More wb33"),
    ("marked words", CHANGED, "H~wb34~O and x^wb35^"),
    ("cross-reference", CHANGED, "::: {#nte-a .callout-note}\nwb36\n:::\n\nSee @nte-a."),
    ("division", CHANGED, '::: {.content-visible unless-format="pdf"}\nwb37\n:::'),
    ("command of LaTeX", CHANGED, "Text wb38 \\newpage"),
    ("code in a line", CHANGED, "| a |\n| - |\n| `wb39|b` |"),
    (
        "figure of a cell",
        CHANGED,
        "```{python}\n#| fig-alt: >\n#|   Two wb40\n#|   lines wb41\n"
        "import matplotlib.pyplot as plt\nplt.plot([1])\n```",
    ),
    ("heading", TAKEN, "# Second title wb42"),
    (
        "table or verse of Pandoc",
        CHANGED,
        "+------+------+\n| wb43 | wb44 |\n+======+======+\n| wb45 | wb46 |\n+------+------+\n\n"
        ": Caption wb47 {#tbl-grid}",
    ),
    (
        "table or verse of Pandoc",
        LEFT,
        "+---+---+\n| wb48 | wb49 |\n+---+---+",
    ),
    (
        "table or verse of Pandoc",
        CHANGED,
        "  wb50   wb51\n------ ------\n  wb52   wb53\n\nTable: Caption wb54",
    ),
    ("table or verse of Pandoc", CHANGED, "| The wb55\n|   day wb56"),
]
MKDOCS: list[Construct] = [
    ("callout", CHANGED, '!!! note inline end "Title wc1"\n    Text wc2'),
    ("callout", CHANGED, '??? tip "Title wc3"\n    Text wc4'),
    ("tab", CHANGED, '=== "wc5"\n\n    Text wc6\n\n=== "wc7"\n\n    Text wc8'),
    ("callout", CHANGED, "/// warning | Title wc9\nText wc10\n///"),
    ("tab", CHANGED, "//// tab | wc11\n```Python\nwc12\n```\n////"),
    ("block of `py`", CHANGED, '``` py title="wc13.py" hl_lines="1"\nwc14\n```'),
    ("file that is included", CHANGED, '--8<-- "code.py:part"'),
    ("attributes", CHANGED, "Text wc15 {: .class }"),
    ("link", CHANGED, "[wc16](two.md)"),
    ("tag of HTML", CHANGED, '<div markdown="1">wc17</div>'),
    ("icon", CHANGED, ":material-check: wc19"),
    ("keys", CHANGED, "Press ++ctrl+alt+w++ wc20."),
    ("definition", CHANGED, "Term wc21\n:   Meaning wc22."),
    ("tag of HTML", LEFT, "<font color=blue>wc23</font>"),
    ("abbreviation", LEFT, "*[KE]: wc30"),
    ("suggested change", CHANGED, "{++wc31++}"),
    ("division", LEFT, "::: package.wc32\n    options:\n\nAfter wc33"),
    ("picture", CHANGED, "![wc34](p.png#only-light)"),
    ("tag of HTML", LEFT, '<img alt="wc24"\n  src="https://example.org/a.png">'),
]
MDBOOK: list[Construct] = [
    ("file that is included", CHANGED, "```rust\n{{#include code.rs:2:3}}\n```"),
    ("file that is included", CHANGED, "```rust\n{{#rustdoc_include code.rs:wd}}\n```"),
    ("file that is included", CHANGED, "{{#playground code.rs}}"),
    ("file that is included", LEFT, "{{#include wd6.rs}}"),
    ("hidden lines of code", CHANGED, "```rust\n# fn main() {\nwd7();\n# }\n#[wd8]\n```"),
    ("block of `rust`", CHANGED, "```rust,ignore,editable\nwd9\n```"),
    ("callout", CHANGED, '```admonish warning title="wd10"\nText wd11\n```'),
    ("link", CHANGED, "[wd12](two.html#part)"),
    ("title of the page", CHANGED, "{{#title Words}}"),
    ("callout", CHANGED, '{% hint style="info" %}\nwd14\n{% endhint %}'),
    (
        "substitution",
        CHANGED,
        '{% tabs %}\n{% tab title="wd15" %}\nwd16\n{% endtab %}\n{% endtabs %}',
    ),
    ("picture", CHANGED, "![wd17](<p.png>)"),
    ("link", CHANGED, "[[two|wd18]]"),
    ("link", CHANGED, "![[p.png|wd19]]"),
    ("comment of MyST", CHANGED, "Text.\n\n%%\nwd20\n%%"),
]
DOCUSAURUS: list[Construct] = [
    ("callout", CHANGED, ":::tip[Title we1]\nText we2\n:::"),
    ("callout", CHANGED, ":::caution Title we3\nText we4\n:::"),
    ("statement of JavaScript", LEFT, "import We5 from '@theme/We5';"),
    ("component", LEFT, '<TabItem label="we6">\n\nText we7\n\n</TabItem>'),
    ("link", CHANGED, "[we8](./two.md)"),
    ("expression of JavaScript", LEFT, "It is {props.we11}."),
    ("tag of HTML", CHANGED, "<img src={require('./p.png').default} alt='we12' />"),
    ("file that is included", CHANGED, "import P from './two.md';\n\n<P />"),
    ("block of `jsx`", CHANGED, '```jsx title="we9.js"\nwe10\n```'),
    ("component", LEFT, "<Figure src='/p.png' caption=\"It's we13\" />"),
    ("link", CHANGED, "{/* we14 */}\n\n[a](./two.md)"),
]
TARGETS = """(here)=
## Here

```{figure} p.png
:name: fig-one
A figure.
```

```{math}
:label: energy
E
```
"""
"""What roles refer to."""
MORE: dict[str, dict[str, str]] = {
    "myst": {
        "_toc.yml": "format: jb-book\nroot: one\nchapters: [{file: two}]\n",
        "_config.yml": "parse: {myst_substitutions: {mass: 3 kg}}\n",
        "refs.bib": "@book{wa17, title = {T}, year = 1900}\n",
        "code.py": "none = 1\nwa58 = 2\n",
        "part.txt": "Included wa59.\n",
        "data.csv": "1\n",
    },
    "quarto": {
        "_quarto.yml": "project: {type: book}\nbook: {title: Q, chapters: [one.qmd, two.md]}\n",
        "_part.qmd": "Included wb14.\n",
        "refs.bib": "@book{wb24, title = {T}}\n",
    },
    "mkdocs": {
        "mkdocs.yml": "site_name: M\nnav: [{One: one.md}, {Two: two.md}]\ndocs_dir: .\n",
        "code.py": "no = 1\n# --8<-- [start:part]\nwc18 = 1\n# --8<-- [end:part]\n",
    },
    "mdbook": {
        "book.toml": '[book]\ntitle = "B"\nsrc = "."\n',
        "SUMMARY.md": "# Summary\n\n- [One](one.md)\n- [Two](two.md)\n- [Later wd13]()\n",
        "code.rs": "// no\nwd1();\nwd2();\n// ANCHOR: wd\nwd3();\n// ANCHOR_END: wd\n",
    },
    "docusaurus": {"docusaurus.config.js": "module.exports = {\n  title: 'D',\n}\n"},
}
FORMATS = {
    "myst": (MYST, "one.md"),
    "quarto": (QUARTO, "one.qmd"),
    "mkdocs": (MKDOCS, "one.md"),
    "mdbook": (MDBOOK, "one.md"),
    "docusaurus": (DOCUSAURUS, "docs/one.mdx"),
}


def counts(course: ConvertedCourse) -> dict[str, dict[str, int]]:
    """The table of IMPORT.md."""
    rows = re.findall(r"^\| (.+?) \| (\d*) \| (\d*) \| (\d*) \|$", account_of(course), re.M)
    columns = (TAKEN, CHANGED, LEFT)
    return {
        kind: {c: int(n or 0) for c, n in zip(columns, numbers, strict=True)}
        for kind, *numbers in rows
    }


def texts_of(course: ConvertedCourse) -> str:
    return "\n".join(
        data.decode("utf-8", "replace")
        for path, data in course.files.items()
        if path.endswith((".md", ".toml", ".bib")) and path != "IMPORT.md"
    )


@pytest.mark.parametrize("format", FORMATS)
def test_every_construct_is_taken_changed_or_left(tmp_path: Path, format: str) -> None:
    constructs, name = FORMATS[format]
    failures = []
    for number, (kind, column, text) in enumerate(constructs):
        folder = name.rpartition("/")[0]
        files = {
            name: f"# One\n\n{TARGETS if kind.startswith('role') else ''}\n\n{text}\n\nEnd.\n",
            f"{folder}/two.md".lstrip("/"): "# Two\n\n## Part\n\nText.\n",
            f"{folder}/p.png".lstrip("/"): PICTURE,
            **MORE[format],
        }
        course = convert_files(tmp_path / str(number), files)
        table = counts(course)
        if not table.get(kind, {}).get(column):
            failures.append(f"{text!r} is not {column} as {kind}, but {table}")
        account = account_of(course).partition("## Left")[2]
        words = set(re.findall(r"\bw[a-e]\d+", text))
        words_there = set(re.findall(r"w[a-e]\d+", texts_of(course) + account))
        failures += [f"{text!r}: {word} is lost" for word in sorted(words - words_there)]
    assert not failures, "\n".join(failures)


def test_every_part_of_a_notebook_is_taken_changed_or_left(tmp_path: Path) -> None:
    picture = {"output_type": "display_data", "data": {"image/png": "aGk="}}
    printed = {"output_type": "stream", "name": "stdout", "text": "wn1\n"}
    value = {"output_type": "execute_result", "data": {"text/plain": "'wn2'"}}
    plot = "import matplotlib.pyplot as plt\nplt.plot([1])"
    cells = [
        ("markdown", "# One\n\nText wn3 ![a](attachment:p.png)", []),
        ("code", "print('wn1')", [printed]),
        ("code", "'wn2'", [value]),
        ("code", plot, [picture]),
        ("code", "open('data/wn4.csv')", []),
        ("code", "from google.colab import drive\ndrive.mount('/wn5')\nx = 'wn6'", []),
        ("code", "!pip install wn7", []),
        ("code", "%%html\n<style>p {}</style>", []),
        ("code", "%%bash\necho wn8", []),
        ("raw", "wn9", []),
    ]
    notebook = {
        "cells": [
            {
                "cell_type": kind,
                "source": source,
                "outputs": outputs,
                "attachments": {"p.png": {"image/png": "aGk="}},
            }
            for kind, source, outputs in cells
        ],
        "metadata": {"wn10": 1},
        "nbformat": 4,
    }
    files = {"one.ipynb": json.dumps(notebook), "data/wn4.csv": "1\n", "wn11.csv": "1\n"}
    course = convert_files(tmp_path, files)
    table = counts(course)
    expected = {
        "cell": (0, 5, 1),
        "cell of `bash`": (0, 0, 1),
        "figure of a cell": (0, 1, 0),
        "file": (2, 0, 1),
        "magic": (0, 0, 1),
        "metadata of a text": (0, 0, 1),
        "output that is recorded": (2, 0, 0),
        "path in a cell": (0, 1, 0),
        "picture": (0, 1, 0),
        "statement of a cell": (0, 0, 2),
        "text": (0, 1, 0),
    }
    assert {kind: tuple(table.get(kind, {}).values()) for kind in expected} == expected
    lesson = course.files["content/lessons/1.1-one.md"].decode()
    assert 'open("content/files/data/wn4.csv")' in lesson
    left = account_of(course).partition("## Left")[2]
    words = {f"wn{number}" for number in range(1, 12)}
    assert words == set(re.findall(r"wn\d+", lesson + left))
    assert {"wn5", "wn7", "wn10", "wn11"} <= set(re.findall(r"wn\d+", left))


def test_every_field_of_a_course_json_is_taken_changed_or_left(tmp_path: Path) -> None:
    lesson = {
        "id": "1.1",
        "title": "wj1",
        "slug": "free-fall",
        "track": "wj2",
        "difficulty": 3,
        "checkpoint": {"question": "wj3", "accept": ["wj4"]},
        "summary": "wj5",
        "objectives": ["wj6"],
        "file": "one.md",
    }
    course_map = {
        "title": "wj7",
        "levels": [{"id": 1, "title": "wj8", "checkpoint": "wj9", "lessons": [lesson]}],
        "pages": [{"title": "wj10"}, {"title": "wj11", "file": "about.md"}],
        "glossary": {"wj12": "wj13"},
    }
    lab = '```lab simlab\n{"camera": {"azimuth": 10, "elevation": 20}, "note": "wj14"}\n```\n'
    quiz = '```quiz\n{"simulation": {"camera": {"azimuth": 10, "elevation": 20}}}\n```\n'
    files = {
        "course.json": json.dumps(course_map),
        "one.md": f"# One\n\n[wj15](#/lesson/free-fall) [wj16](/lesson/9.9)\n\n{lab}\n{quiz}",
        "about.md": "# About\n\nwj17\n",
    }
    course = convert_files(tmp_path, files)
    left = account_of(course).partition("## Left")[2]
    words = set(re.findall(r"wj\d+", texts_of(course) + left))
    assert words == {f"wj{number}" for number in range(1, 18)}
    assert {"wj2", "wj3", "wj4", "wj10", "wj12", "wj13"} <= set(re.findall(r"wj\d+", left))
    lesson_text = course.files["content/lessons/1.1-free-fall.md"].decode()
    assert lesson_text.count('"azimuth": -170') == lesson_text.count('"elevation": -20') == 2
    assert "[wj15](lesson:1.1)" in lesson_text
