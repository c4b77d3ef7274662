r"""Bookdown's own syntax in R Markdown, as that of Quarto, which the rest of the importer reads.

It is references (`\@ref(fig:a)`), labels of formulas (`(\#eq:a)`), theorems and other blocks as
fences, captions that stand elsewhere (`(ref:a)`), and parts of the book.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from coursebuild.api import regex
from coursebuild.features.importer.context import PROOF_LABELS
from coursebuild.features.importer.outlines import group, leave_entry
from coursebuild.features.importer.source_files import (
    ImportedLevel,
    ImportedText,
    SourceFiles,
    find_group,
    value_at,
)

PART = regex(
    r"^#[ \t]+\((?:PART|APPENDIX)(?:\\?\*)?\)[ \t]*(.*?)[ \t]*(?:\{[^{}]*\})?[ \t]*$", re.M
)
_LABELS = {kind: label for label, kind in PROOF_LABELS.items()}
_REFERENCE = regex(
    r"(?:\b(?:Figures?|Figs?\.|Tables?|Equations?|Eqs?\.|Theorem|Lemma|Definition|Corollary|Example"
    r"|Exercise)[ ~]|(?P<paren>\())?"
    r"\\@ref\((?:(?P<kind>[a-z]+):)?(?P<label>[\w-]+)\)(?(paren)\))"
)
_TEXT = regex(r"^\(ref:(?P<name>[\w-]+)\)[ ](?P<text>[^\n]*(?:\n(?!\n|$)[^\n]+)*)\n?", re.M)
_FENCE = regex(
    r"^(?P<mark>`{3,})\{(?P<kind>block2?|[a-z]+)(?P<options>[^{}\n]*)\}[ \t]*\n"
    r"(?P<body>.*?)^(?P=mark)[ \t]*$",
    re.MULTILINE | re.DOTALL,
)
_DIVISION = regex(
    r"^(:{3,}[ \t]*)\{\.(?P<kind>[a-z]+)[ ]+#(?P<label>[\w-]+)(?P<rest>[^{}\n]*)\}", re.M
)
_LABEL = regex(r"\A[ ,]*(?:label\s*=\s*)?[\"']?([A-Za-z][\w-]*)[\"']?\s*(?:,|\Z)")


def read_bookdown(text: str) -> str:
    """Return a text of R Markdown without what is Bookdown's own, in as many lines."""
    texts = {match["name"]: " ".join(match["text"].split()) for match in _TEXT.finditer(text)}
    text = PART.sub("", _TEXT.sub(lambda match: "\n" * match[0].count("\n"), text))
    for name, words in texts.items():
        text = text.replace(f"(ref:{name})", words)
    text = re.sub(r"\(\\#eq:([\w-]+)\)", r"\\label{eq:\1}", text)
    text = _REFERENCE.sub(_write_reference, text)
    text = _DIVISION.sub(_label_division, text)
    return _FENCE.sub(_write_fence, text)


def _write_reference(match: re.Match[str]) -> str:
    kind, label = match["kind"], match["label"]
    if kind is None:
        return f"{match['paren'] or ''}[](#{label}){')' if match['paren'] else ''}"
    return f"@{ {'tab': 'tbl'}.get(kind, kind) }-{label}"


def _label_division(match: re.Match[str]) -> str:
    label = _LABELS.get(match["kind"])
    name = f"#{label}-{match['label']}" if label else f".{match['kind']} #{match['label']}"
    return f"{match[1]}{{{name}{match['rest']}}}"


def _write_fence(match: re.Match[str]) -> str:
    kind, options, body = match["kind"], match["options"], match["body"]
    label = find_group(_LABEL, options)
    if kind in _LABELS or kind in ("proof", "remark", "solution", "block", "block2"):
        title = find_group(r"\bname\s*=\s*(?:\"([^\"]*)\"|'([^']*)')", options)
        head = "." + (find_group(r"\btype\s*=\s*[\"']([\w-]+)", options) or kind)
        if kind in _LABELS and label:
            head = f"#{_LABELS[kind]}-{label}"
        words = f"## {title}\n\n" if title else ""
        new = f"::: {{{head}}}\n{words}{body}:::"
    else:
        return match[0]
    return new + "\n" * (match[0].count("\n") - new.count("\n"))


def read_book(files: SourceFiles) -> Iterator[ImportedText | ImportedLevel]:
    """Yield the chapters of a book in their order, those below a part as a level."""
    name = "_bookdown.yml"
    if name not in files:
        return
    settings = files.settings(name)
    files.change("map", "content/course.toml")
    choice = value_at(settings, "rmd_files")
    if isinstance(choice, Mapping):  # by the form of the book
        choice = choice.get("html") or choice.get("latex")
    names = [p for p in files if p.endswith(".Rmd") and "/" not in p and not p.startswith("_")]
    names.sort(key=lambda path: (path != "index.Rmd", path))
    paths = []
    for path in map(str, choice if isinstance(choice, list) else names):
        if path in files:
            paths.append(path)
        else:
            leave_entry(name, path, files)
    title, lessons = "", list[ImportedText]()
    for path in paths:
        if part := PART.search(files.read_text(path)):
            yield from group(title, lessons)
            title, lessons = part[1], []
        lessons.append(ImportedText(file=path))
    yield from group(title, lessons)
