"""Small changes of a text, as hands make them.

Entry point: `make_change`, which makes one of a kind; `KINDS`. A kind is a place where a letter is
dropped, doubled, swapped or mistyped (`parts` finds the places), or a change of another sort.
"""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise

from msgspec import Struct

from benchmarks.slips.keyboards import LAYOUTS, neighbours

_FENCE = re.compile(r"^(?P<indent>[ >]*)(?P<mark>`{3,}|~{3,})(?P<info>.*)$")
_BLOCKS = {
    "python": "script",
    "text": "output",
    "output": "output",
    "quiz": "quiz",
    "lab": "lab",
    "sh": "shown",
    "console": "shown",
}
"""Kinds of places by the first word of a fence; in all others it is `other block`."""
_INLINE = re.compile(
    r"(?P<number>`[^`\n]+`)(?P<out>\{[^{}\n]*\})"
    r"|(?P<formula>\$\$[^$]+\$\$|\$[^$]+\$)(?P<braces>[ ]?\{[^{}]*\})?"
    r"|(?P<code>`[^`\n]+`)"
    r"|(?P<link>\]\([^()\n]*\)|(?<!\w)https?://\S+)"
    r"|(?P<attribute>(?<=[\w\]])\{[^{}\n]*\}|(?<=\S )\{[.#][^{}\n]*\})"
    r"|(?P<html><[^<>\n]+>)"
    r"|(?P<heading>^\#{1,6}[ ])"
    r"|(?P<callout>^>[ ]\[![\w-]+\])"
    r"|(?P<caption>^(?:Output|Figure|Table)(?=:|\s\())"
    r"|(?P<list>^[ ]*(?:[-*]|\d+\.)[ ]|^\|[ :|-]+\|$|[ ]\|[ ]|^>[ ]?)"
    r"|(?P<emphasis>\*+)"
    r"|(?P<digits>[-−]?\d[\d.,:]*(?<!\D))"
    r"|(?P<words>[^\W\d_]{2,})",
    re.MULTILINE,
)
_RELATION = re.compile(
    r"[=<>]|\\(?:approx|neq?|leq?|geq?|ll|gg|sim(?:eq)?|propto|equiv|in|to)(?![A-Za-z])"
)
_SOURCE = re.compile(r'(?<=given=")(?!lab\b|lesson:|#|[\w.-]+/)[^"]+')
"""A source in words, as `ISO 80000-3`, with which nothing is compared."""
_VALUE = re.compile(
    r"\$(?P<letter>[^$=]+)(?:=[^$]*\$[ ]?\{(?:symbol|given)|\$[ ]?\{(?:symbol=[^{}]*)?value=)"
)
"""A letter that gets a value."""
_UNIT = re.compile(r"\\(?:begin|end|mathrm|operatorname|text)\s*(?:\{[^{}]*\}|\w)")
_SIGN = re.compile(r"\\([A-Za-z]+)|[A-Za-z]")
_LETTERS = frozenset(
    """
    Delta Gamma Lambda Omega Phi Psi Sigma Theta alpha beta chi delta ell epsilon eta gamma hbar
    kappa lambda mu nu omega phi psi rho sigma tau theta varepsilon varphi xi zeta
    """.split()
)
"""Commands that are letters."""
_PLACES = {
    "words": "words of prose",
    "digits": "numbers in prose",
    "number": "bound and given numbers",
    "out": "attributes",
    "braces": "attributes",
    "attribute": "attributes",
    "link": "links",
    "code": "inline code",
    "formula": "formulas",
    "relation": "relations without values",
    "symbols": "symbols",
    "heading": "heading marks",
    "emphasis": "emphasis marks",
    "list": "marks of lists, tables and quotes",
    "callout": "callouts",
    "caption": "captions",
    "html": "HTML",
    "fence": "fences",
    "script": "scripts",
    "output": "recorded outputs",
    "quiz": "quizzes",
    "lab": "labs",
    "other block": "other blocks",
    "shown": "commands",
    "map": "course map",
    "declarations": "declarations of models",
}
FOREIGN = (
    '!!! note "Remember"\n    The step is explicit.',
    ":::{note}\nThe step is explicit.\n:::",
    "::: {.callout-tip}\nThe step is explicit.\n:::",
    "> [!important\n> The step is explicit.",
    "{{< figure src=x.svg >}}",
    "{% include note.html %}",
    "<<include part.md>>",
    "[[Free fall]]",
    ".. note::\n   The step is explicit.",
    ".. math:: a = b",
    "[source,python]",
    "image::x.png[A picture]",
    "include::part.adoc[]",
    "#+BEGIN_SRC python\nprint(1)\n#+END_SRC",
    "\\begin{align}\na &= b\n\\end{align}",
    "See \\ref{eq:one} and \\cite{knuth}.",
    "See [@knuth84].",
    "See @fig-one.",
    "%matplotlib inline",
    "In [1]: print(1)",
    "```{python}\nprint(1)\n```",
    "```python {cmd=true}\nprint(1)\n```",
    "``` mermaid\ngraph LR\n```",
    "A ==marked== word.",
    "H~2~O and x^2^.",
    "A :math:`x` and :ref:`y`.",
    "{: .note }",
    "[TOC]",
    "h2. Title",
    "@@ -1,3 +1,4 @@",
    "<Tabs>\n<TabItem>\n</Tabs>",
    "import Tabs from '@theme/Tabs';",
    "---\ntitle: A lesson\n---",
    "{code:python}\nprint(1)\n{code}",
    "<!-- TODO: write -->",
    "?> A tip",
    "\\(x\\) is small.",
    "$$\na = b",
    "- [ ]A task",
    "| a | b |\n|---|",
)
"""Pieces of the syntax of other tools, and of ours that other tools take."""


class Change(Struct, frozen=True):
    """A change of a file: what stands between two offsets is replaced."""

    path: str
    kind: str
    slip: str
    place: str
    """Where the change begins, as `parts` names it."""
    start: int
    end: int
    text: str

    def apply(self, old: str) -> str:
        """The changed text."""
        return old[: self.start] + self.text + old[self.end :]


class Part(Struct, frozen=True):
    """A piece of a text with what it is."""

    place: str
    start: int
    end: int
    indent: str = ""


def parts(path: str, text: str) -> list[Part]:
    """The pieces of a lesson, the map or declarations, without what stands between them."""
    if path.endswith(".toml"):
        place = "map" if path.endswith("course.toml") else "declarations"
        return [Part(place, m.start(), m.end()) for m in re.finditer(r"^[^#\s].*$", text, re.M)]
    pieces: list[Part] = []
    prose, at, fence, body = 0, 0, "", ""
    for line in text.splitlines(keepends=True):
        match = _FENCE.match(line.rstrip("\r\n"))
        end = at + len(line.rstrip("\r\n"))
        if match and (not fence or (match["mark"].startswith(fence) and not match["info"].strip())):
            pieces += _prose_parts(text, prose, at) if not fence else ()
            word = (match["info"].split() or [""])[0]
            fence, body = ("", "") if fence else (match["mark"], _BLOCKS.get(word, "other block"))
            pieces.append(Part("fence", at, end))
            prose = at + len(line)
        elif fence and line.strip():
            pieces.append(Part(body, at, end))
        at += len(line)
    return pieces + ([] if fence else [*_prose_parts(text, prose, at)])


def _prose_parts(text: str, start: int, end: int) -> Iterator[Part]:
    letters = {value["letter"].strip() for value in _VALUE.finditer(text)}
    for match in _INLINE.finditer(text, start, end):
        for name, value in match.groupdict().items():
            at, stop = match.span(name)
            if name == "formula" and value:
                name = _kind_of_formula(value, letters)
            elif name == "link" and value and "://" in value:
                name = "words"
            elif words := _SOURCE.search(text, at, stop):
                yield Part(name, at, words.start())
                yield Part("words", *words.span())
                at = words.end()
            if value:
                yield Part(name, at, stop)


def _kind_of_formula(tex: str, letters: Iterable[str]) -> str:
    """Whether a formula relates anything, and whether two numbers or `letters` with values."""
    sides = _RELATION.split(tex)
    if len(sides) == 1:
        return "symbols"
    are_numbers = [re.search(r"\d", side) and not _has_letters(side) for side in sides]
    has_value = any(all(pair) for pair in pairwise(are_numbers)) or any(x in tex for x in letters)
    return "formula" if has_value else "relation"


def _has_letters(tex: str) -> bool:
    """Whether letters stand in a formula, other than those of units, functions and numbers."""
    signs = _SIGN.finditer(_UNIT.sub("", tex))
    return any(not sign[1] or sign[1] in _LETTERS for sign in signs)


# --- changes


def _slip(text: str, start: int, end: int, chance: random.Random) -> tuple[str, str] | None:
    """One letter of a piece dropped, doubled, swapped or mistyped; with the name of what it is."""
    piece = text[start:end]
    at = chance.choice([n for n, letter in enumerate(piece) if not letter.isspace()] or [0])
    letter, rest = piece[at : at + 1], piece[at + 1 :]
    slip = chance.choice(("dropped", "doubled", "swapped", "mistyped"))
    if slip != "doubled" and letter.isdigit() and chance.random() < 0.6:
        digits = [digit for digit in "0123456789" if digit != letter]
        return "digit", piece[:at] + chance.choice(digits) + rest
    if slip == "dropped":
        return slip, piece[:at] + rest
    if slip == "doubled":
        return slip, piece[:at] + letter * 2 + rest
    if slip == "swapped":
        changed = piece[:at] + rest[:1] + letter + rest[1:]
        return (slip, changed) if changed != piece and rest[:1].strip() else None
    layout = chance.choice(list(LAYOUTS))
    signs = neighbours(layout, letter)
    if not signs:
        return None
    return f"{slip} ({layout})", piece[:at] + chance.choice(signs) + rest


def _lines(text: str, chance: random.Random) -> tuple[int, int]:
    """The place of a line that is not empty, with its end."""
    lines = [m.span() for m in re.finditer(r"^.*\S.*(?:\n|\Z)", text, re.M)]
    return chance.choice(lines)


def _lose_line(text: str, chance: random.Random) -> tuple[int, int, str]:
    start, end = _lines(text, chance)
    return start, end, ""


def _repeat_line(text: str, chance: random.Random) -> tuple[int, int, str]:
    start, end = _lines(text, chance)
    return end, end, text[start:end].rstrip("\n") + "\n"


def _unclose(text: str, chance: random.Random) -> tuple[int, int, str] | None:
    """A fence without its last line, its first line, or a mark of one."""
    fences = [*re.finditer(r"^[ >]*(?:`{3,}|~{3,}).*\n?", text, re.M)]
    if not fences:
        return None
    match = chance.choice(fences)
    if chance.random() < 0.7:
        return match.start(), match.end(), ""
    at = match.start() + re.search(r"[`~]", match[0]).start()  # type: ignore[union-attr]
    return at, at + 1, ""


def _rename_key(text: str, chance: random.Random) -> tuple[int, int, str] | None:
    pattern = r'"(\w+)"(?=\s*:)|^([\w-]+)(?=\s*=)|(?<=[{\s])(\w+)(?==["\w./])'
    keys = list(re.finditer(pattern, text, re.M))
    if not keys:
        return None
    match = chance.choice(keys)
    start, end = match.span(match.lastindex or 0)
    word = text[start:end]
    new = chance.choice(
        (f"{word}s", word[:-1], word.upper(), word.title(), f"{word}_", f"my_{word}")
    )
    return start, end, new or "key"


def _move(text: str, chance: random.Random) -> tuple[int, int, str] | None:
    """A paragraph, a list or a fence moved behind one of the next three."""
    blocks, start, fence = [], 0, ""
    for match in re.finditer(r".*\n?", text):
        line = match[0]
        mark = _FENCE.match(line.rstrip("\n"))
        fence = ("" if fence else mark["mark"]) if mark else fence
        if not fence and not line.strip():
            if text[start : match.start()].strip():
                blocks.append((start, match.start()))
            start = match.end()
    if len(blocks) < 3:
        return None
    first = chance.randrange(len(blocks) - 1)
    last = min(first + chance.randint(1, 3), len(blocks) - 1)
    (start, end), (next_start, _), (_, last_end) = blocks[first], blocks[first + 1], blocks[last]
    new_order = (
        text[next_start:last_end].rstrip("\n") + "\n\n" + text[start:end].rstrip("\n") + "\n"
    )
    return start, last_end, new_order


def _paste(text: str, chance: random.Random) -> tuple[int, int, str] | None:
    ends = [m.end() for m in re.finditer(r"(?<=\S)\n\n(?=[A-Z#])", text)]
    outside = [at for at in ends if text[:at].count("\n```") % 2 == 0]
    if not outside:
        return None
    at = chance.choice(outside)
    return at, at, chance.choice(FOREIGN) + "\n\n"


_MARKED = re.compile(
    r"\[[^\]\n]+\]\([^)\n]+\)|`[^`\n]+`(?:\{[^}\n]*\})?|\*\*[^*\n]+\*\*"
    r"|\$[^$\n]+\$|\"[^\"\n]{2,}\""
)


def _half_edit(text: str, chance: random.Random) -> tuple[int, int, str]:
    """The rest of a line or of what stands in marks deleted, or a line begun anew."""
    pieces = list(_MARKED.finditer(text))
    if pieces and chance.random() < 0.6:
        start, end = chance.choice(pieces).span()
        return chance.randint(start + 1, end - 1), end, ""
    start, end = _lines(text, chance)
    at = chance.randint(start, max(start, end - 2))
    return (at, max(at, end - 1), "") if chance.random() < 0.6 else (start, start, text[start:at])


def _conflict(text: str, chance: random.Random) -> tuple[int, int, str]:
    start, end = _lines(text, chance)
    ours = text[start:end].rstrip("\n")
    theirs = ours.replace(chance.choice(ours.split() or ["x"]), "other", 1)
    conflict_text = f"<<<<<<< HEAD\n{ours}\n=======\n{theirs}\n>>>>>>> branch\n"
    half = [conflict_text.replace(f"{mark}\n", "", 1) for mark in ("=======", ">>>>>>> branch")]
    return start, end, chance.choice((conflict_text, conflict_text, *half))


_OTHERS: dict[str, Callable[[str, random.Random], tuple[int, int, str] | None]] = {
    "line lost": _lose_line,
    "line repeated": _repeat_line,
    "fence not closed": _unclose,
    "key renamed": _rename_key,
    "paragraph moved": _move,
    "syntax of another tool": _paste,
    "half an edit": _half_edit,
    "merge conflict": _conflict,
}
KINDS = (*dict.fromkeys(_PLACES.values()), *_OTHERS)
_IN_LESSONS = ("paragraph moved", "syntax of another tool", "fence not closed")


def make_change(kind: str, texts: dict[str, str], chance: random.Random) -> Change | None:
    """A change of this kind in one of the texts; `None` where it cannot be made."""
    for _ in range(200):
        path = chance.choice(sorted(texts))
        if kind == "course map":
            path = "content/course.toml"
        elif kind == "declarations of models":
            path = chance.choice([p for p in sorted(texts) if p.startswith("models/")] or [path])
        text = texts[path]
        pieces = parts(path, text)
        if kind in _OTHERS:
            if kind in _IN_LESSONS and not path.endswith(".md"):
                continue
            edit = _OTHERS[kind](text, chance)
            slip = kind
        else:
            places = [part for part in pieces if _PLACES[part.place] == kind]
            if not places:
                continue
            part = chance.choice(places)
            slip, piece = _slip(text, part.start, part.end, chance) or ("", None)
            edit = None if piece is None else (part.start, part.end, piece)
        if edit is None or text[edit[0] : edit[1]] == edit[2]:
            continue
        start, end, new = edit
        inside = start if start < end else start - 1  # the end of the line before
        near = [p.place for p in pieces if p.start <= inside <= p.end]
        near += [p.place for p in pieces if start <= p.start < max(end, start + 1)]
        return Change(path, kind, slip, near[0] if near else "text", start, end, new)
    return None
