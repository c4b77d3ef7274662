"""Random texts made of what lessons are made of: `markdown()`, a strategy; `KINDS` of callouts."""

from __future__ import annotations

from hypothesis import strategies as st

from coursebuild.core.model.vocabulary import CALLOUTS

KINDS = frozenset(CALLOUTS)

PIECES = [
    *("$", "$$", "`", "``", "*", "**", "_", "~~", "\\", "|", "[", "](", ")", "]", "![", "<", ">"),
    *("\n", "\n\n", "\r\n", "\r", "\t", "    ", " ", "  \n", "\\\n", "\0", "\ufeff", "\ud800"),
    *("> ", "- ", "1. ", "- [x] ", "# ", "## ", "### A {#b .c}\n", "---\n", "===\n", "***\n"),
    *("a", "é", "𝔘", "word word", "&amp;", "&nbsp;", "&#65;", "\\*", "<b>", "</b>", "<!--", "-->"),
    *(
        "| a | b |\n| - | :-: |\n",
        "a|b\n-|-\n1|2\\|3\n",
        "$x^2$",
        "$$y$$",
        "$$\nz\n$$\n",
        "$5 and $6",
    ),
    *("```python file=examples/x.py\nprint(1)\n```\n", "```python\n", "```text digits\n1\n```\n"),
    *("```\n", "~~~\n", "Output:\n\n", "```io\nINPUT: a\nPROCESS: b\n", "```mjcf error=x\n"),
    "```bench box show=plot\n",
    *(
        '```quiz\n{"id": "q", "questions": [{"kind": "open", "q": "<p>$x$ \\\\$ a</p>",',
        "```lab\n{}",
    ),
    *(
        "> [!note] T\n",
        "> [!nope]- T\n",
        "`1`{out}",
        "`1`{out=x}",
        "[^a]",
        "[^a]: x\n",
        "[a]: /u\n",
    ),
    *(
        "[a](lesson:1.1#b)",
        "[a](javascript:x)",
        "![](x)",
        "<http://a.b>",
        "Lesson 2.2",
        "Levels 1, 2",
    ),
    *(
        "Lesson\n2.2",
        "<p>a $x$ b</p>\n",
        "<div>\n",
        "</div>\n\n",
        "---\na: b\n---\n",
        "{.x}",
        "[a]",
    ),
]
PREFIXES = ["", "> ", "  ", "   ", "- ", "> - ", "\t", "    "]
LINE_ENDS = ["\n", "\r\n", "\r"]


@st.composite
def markdown(draw: st.DrawFn) -> str:
    """A text that likes to look like a lesson, in a quote or a list or not."""
    pieces = draw(st.lists(st.sampled_from(PIECES) | st.text(max_size=8), max_size=24))
    text = "".join(pieces)
    prefix = draw(st.sampled_from(PREFIXES))
    rest = prefix.replace("-", " ")
    text = prefix + text.replace("\n", "\n" + rest)
    line_end = draw(st.sampled_from(LINE_ENDS))
    return text.replace("\n", line_end) if line_end != "\n" else text
