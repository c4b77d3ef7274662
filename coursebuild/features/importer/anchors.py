"""The anchors and labels that texts of all dialects set, and by which they refer to places."""

from __future__ import annotations

import re

from coursebuild.features.importer.context import (
    NUMBERED,
    PROOF_LABELS,
    formula_anchor,
    label_anchor,
    to_anchor,
)
from coursebuild.features.importer.displays import normalize_formulas

TARGET = re.compile(
    r"^(?P<lead>[ \t>]*(?:[-*+][ \t]+|\d+[.)][ \t]+)?)\((?P<name>[\w:.-]+)\)=[ \t]*"
    r"(?:\n+(?P<heading>#{1,6}[ \t].*))?$",
    re.MULTILINE,
)
FIGURE = re.compile(
    r"(?:(?<=\n\n)|(?<=\A\n)|\A)!\[(?P<alt>[^\]\n]+)\]\((?P<source>[^()\s]+)\)"
    r"\{#fig-(?P<label>[\w-]+)(?:[^{}\n]*?fig-alt=\"(?P<alternative>[^\"\n]*)\")?[^{}\n]*\}(?=\n|\Z)"
)


_FIGURE_NAME = re.compile(
    r"\{(?P<kind>figure|table|list-table)\}[^\n]*\n"
    r"(?:[ \t]*(?::(?!name|label)[\w-]+:|---|(?!name)\w+:)[^\n]*\n)*"
    r"[ \t]*:?(?:name|label):[ \t]*(?P<name>\S+)"
)


_NUMBERED = re.compile(
    rf"\{{(?P<kind>(?:prf:)?(?:{'|'.join(sorted(NUMBERED))})|code|code-block|sourcecode)\}}[^\n]*\n"
    r"(?:[ \t]*(?::(?!name|label)[\w-]+:|---|(?!name|label)\w+:)[^\n]*\n)*"
    r"[ \t]*:?(?:name|label):[ \t]*(?P<name>\S+)"
)
_LISTING = re.compile(
    r"^[`~ \t]*\{#lst-([\w-]+)|^#\|[ \t]*(?:lst-)?label:[ \t]*lst-([\w-]+)", re.MULTILINE
)
_CHUNK = re.compile(r"^(?:`{3,})?\{r[ \t]+([\w.-]+)[ \t]*(?=[,}])", re.MULTILINE)
_DIVISION = re.compile(r"^[: \t]*\{#((?:fig|tbl)-[\w-]+)", re.MULTILINE)


def find_anchors(text: str) -> set[str]:
    """Return the anchors that a text of any dialect sets, `eq:name` of formulas among them."""
    labelled = [*_FIGURE_NAME.finditer(text)]
    figures = {label_anchor(m["name"]) for m in labelled if m["kind"] == "figure"}
    figures |= {to_anchor(match["label"]) for match in FIGURE.finditer(text)}
    cells = re.findall(r"^(?:#\|[ \t]*label:[ \t]*|!\[[^\n]*\{#)fig-([\w-]+)", text, re.MULTILINE)
    figures |= {to_anchor(label) for label in cells}
    anchors = {to_anchor(match["name"]) for match in TARGET.finditer(text)}
    anchors |= {f"sec-{to_anchor(name)}" for name in re.findall(r"\{#sec-([\w-]+)", text)}
    anchors |= {to_anchor(key) for key in re.findall(r"\{\{[a-z]+\}\}\{([^{}\n]+)\}", text)}
    proofs = re.findall(rf"#({'|'.join(PROOF_LABELS)})-([\w-]+)", text)
    anchors |= {f"{kind}:{to_anchor(name)}" for kind, name in proofs}
    anchors |= {f"lst:{to_anchor(m[1] or m[2])}" for m in _LISTING.finditer(text)}
    anchors |= {to_anchor(name) for name in _DIVISION.findall(text)}
    anchors |= {f"{kind}-{to_anchor(n)}" for n in _CHUNK.findall(text) for kind in ("fig", "tbl")}
    anchors |= set(re.findall(r"\{#(eq:[\w-]+)\}", normalize_formulas(text)))
    labels = re.findall(r"^\s*:(?:label|name):[ \t]*(\S+)", text, re.MULTILINE)
    anchors |= {to_anchor(label) for label in labels}
    anchors |= {f"eq:{formula_anchor(label)}" for label in labels}
    anchors |= {f"tab:{to_anchor(label)}" for label in re.findall(r"\{#tbl-([\w-]+)", text)}
    anchors |= {f"fig:{name}" for name in figures}
    anchors |= {f"tab:{label_anchor(m['name'])}" for m in labelled if m["kind"] != "figure"}
    anchors -= {to_anchor(match["name"]) for match in labelled}
    for match in _NUMBERED.finditer(text):
        kind, name = match["kind"].removeprefix("prf:"), to_anchor(match["name"])
        anchors = anchors - {name} | {f"{kind if kind in NUMBERED else 'lst'}:{name}"}
    return anchors


def write_figure(match: re.Match[str]) -> str:
    """Return a labelled picture in a paragraph of its own, as Quarto has it, with its caption."""
    alt = match["alternative"] or match["alt"]
    return (
        f"Figure: ![{alt}]({match['source']}) {match['alt']} {{#fig:{to_anchor(match['label'])}}}"
    )
