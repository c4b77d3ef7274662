"""Anchors, labels and captions that texts of all dialects set, by which they refer to places."""

from __future__ import annotations

import re

from coursebuild.api import regex
from coursebuild.features.importer.context import (
    NUMBERED,
    PROOF_LABELS,
    label_anchor,
    to_anchor,
)
from coursebuild.features.importer.displays import LABEL, normalize_formulas
from coursebuild.features.importer.source_files import Segment

TARGET = regex(
    r"^(?P<lead>[ \t>]*(?:[-*+][ \t]+|\d+[.)][ \t]+)?)"
    r"(?:(?P<myst>\()|(?P<mkdocs>\[\]\(\)\{[ ]*#)|r\[)(?P<name>[\w:./|@<>*+-]+)"
    r"(?(myst)\)=|(?(mkdocs)[ ]*\}|\]))[ \t]*"
    r"(?:\n{1,2}(?P<heading>#{1,6}[ \t].*))?$",  # a title that was taken out leaves more
    re.MULTILINE,
)
"""An anchor of MyST, of `mkdocstrings`, or of a rule in the reference of Rust."""
FIGURE = regex(
    r"(?:(?<=\n\n)|(?<=\A\n)|\A)!\[(?P<alt>[^\]\n]+)\]\((?P<source>[^()\s]+)\)"
    r"(?:\{#fig-(?P<label>[\w-]+)(?:[^{}\n]*?fig-alt=\"(?P<alternative>[^\"\n]*)\")?[^{}\n]*\}(?=\n|\Z)"
    r"|(?=\n\n|\n?\Z))"
)
"""A picture in a paragraph of its own; Pandoc shows its words below it."""


_LABELLED = regex(
    rf"\{{(?:prf:)?(?P<kind>{'|'.join(sorted(NUMBERED))}|figure|table|list-table|code|code-block"
    r"|sourcecode)\}[^\n]*\n"
    r"(?:[ \t]*(?::(?!name|label)[\w-]+:|---|(?!name|label)\w+:)[^\n]*\n)*"
    r"[ \t]*:?(?:name|label):[ \t]*(?P<name>\S+)"
)
_KINDS = {"figure": "fig", "table": "tab", "list-table": "tab"}
_CHUNK = r"^(?:`{3,})?\{r[ \t]+(?P<name>[\w.-]+)[ \t]*(?=[,}])"
_PLACES = (
    ("", TARGET.pattern),
    ("sec-", r"\{#sec-(?P<name>[\w-]+)"),
    ("", r"^#{1,6}[ \t].*\{#(?P<name>[\w-]+)[^{}\n]*\}[ \t]*$"),
    ("lst:", r"^(?:[`~ \t]*\{#|#\|[ \t]*(?:lst-)?label:[ \t]*)lst-(?P<name>[\w-]+)"),
    ("", r"^[: \t]*\{#(?P<name>(?:fig|tbl)-[\w-]+)"),
    ("fig-", _CHUNK),
    ("fig:", _CHUNK + r"[^\n]*\bfig\.cap\b[^\n]*\n\s*(?:knitr::)?include_graphics\("),
    ("tbl-", _CHUNK),
    ("tab:", r"\{#tbl-(?P<name>[\w-]+)"),
    ("", r"^\s*:(?:label|name):[ \t]*(?P<name>\S+)"),
    ("eq:", r"^\s*:(?:label|name):[ \t]*(?:eq[-:._])?(?P<name>\S+)"),
    ("fig:", r"^(?:#\|[ \t]*label:[ \t]*|!\[[^\n]*\{#)fig-(?P<name>[\w-]+)"),
)
"""What sets an anchor, by what stands before its name here."""


def find_anchors(segment: Segment) -> set[str]:
    """Return the anchors that a part of a text sets, `eq:name` of formulas among them."""
    is_code = segment.kind == "block" and segment.mark[0] in "`~" and segment.head[:1] != "{"
    text = segment.head + f"\n{segment.text}" * (not is_code)
    anchors = {
        f"{prefix}{to_anchor(place['name'])}"
        for prefix, pattern in _PLACES
        for place in re.finditer(pattern, text, re.MULTILINE)
    }
    proofs = re.findall(rf"#({'|'.join(PROOF_LABELS)})-([\w-]+)", text)
    anchors |= {f"{kind}:{to_anchor(name)}" for kind, name in proofs}
    anchors |= set(re.findall(r"\{#(eq:[\w-]+)\}", normalize_formulas(text)))
    anchors |= {f"eq:{label_anchor(label)}" for label in LABEL.findall(text)}
    for match in _LABELLED.finditer(text):
        kind = match["kind"] if match["kind"] in NUMBERED else _KINDS.get(match["kind"], "lst")
        anchor = to_anchor(match["name"])
        name = label_anchor(match["name"]) if match["kind"] in _KINDS else anchor
        anchors = anchors - {anchor} | {f"{kind}:{name}"}
    return anchors


def write_figure(match: re.Match[str]) -> str:
    """Return a picture in a paragraph of its own with its caption."""
    alt = match["alternative"] or match["alt"]
    return figure_of(match["source"], match["alt"], match["label"], alt)


def figure_of(source: str, caption: str, label: str, alt: str) -> str:
    """Return the paragraph of a figure; without a label it has no number."""
    mark = f" {{#fig:{label_anchor(label)}}}" if label else ""
    return f"Figure: ![{alt}]({source}) {caption}{mark}"


CAPTION = regex(r"(?:Table)?:[ ]+(?P<caption>.*?)[ ]*(?:\{(?:#tbl-(?P<label>[\w-]+))?[^{}\n]*\})?")
"""The caption of a table of Pandoc, with attributes."""
TABLE_CAPTION = regex(rf"^(?P<table>(?:\|.*\n)+)\n?{CAPTION.pattern}$", re.MULTILINE)
"""A table of Quarto above its caption."""


def move_caption(match: re.Match[str]) -> str:
    """Return a table below its caption."""
    return f"{write_caption(match)}\n\n{match['table']}".lstrip("\n")


def write_caption(match: re.Match[str]) -> str:
    """Return the caption of a table; nothing where it holds attributes alone."""
    label = f" {{#tab:{to_anchor(match['label'])}}}" if match["label"] else ""
    return f"Table: {match['caption']}{label}" if match["caption"] or label else ""


def write_target(match: re.Match[str]) -> str:
    """Return an anchor, which a heading below it takes."""
    anchor = to_anchor(match["name"])
    if match["heading"] is None:
        return f'{match["lead"]}<a id="{anchor}"></a>'
    return f"{match['heading'].rstrip()} {{#{anchor}}}"


MARKDOWN_FIGURE = regex(
    r"^(?P<lead>[ \t]*)<figure[^<>]*>\s*(?P<picture>!\[[^\]\n]*\]\([^()\n]*\))(?:\{[^{}\n]*\})?\s*"
    r"(?:<figcaption\b[^<>]*>\s*(?P<caption>[^<>]*?)\s*</figcaption>\s*)?</figure>[ \t]*$",
    re.MULTILINE,
)
"""A picture of Markdown between tags of HTML, as MkDocs has it."""


def write_captioned(match: re.Match[str]) -> str:
    """Return a picture with its caption, in as many lines."""
    caption = " ".join((match["caption"] or "").split())
    new = f"Figure: {match['picture']} {caption}" if caption else match["picture"]
    return match["lead"] + new + "\n" * match[0].count("\n")
