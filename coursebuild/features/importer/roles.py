"""Roles of MyST and Sphinx, and inline code that its tool runs, as Markdown of coursebuild."""

from __future__ import annotations

import re

from coursebuild.features.importer.context import (
    LessonContext,
    formula_anchor,
    label_anchor,
    to_anchor,
)
from coursebuild.features.importer.source_files import title_of_file


def write_link(text: str, address: str, title: str = "") -> str:
    """Return a link; its text alone where there is no address."""
    return f"[{text}]({address}{title})" if address else text


def convert_role(name: str, body: str, context: LessonContext) -> str:
    """Return a role with this text in Markdown."""
    parts = re.fullmatch(r"(?P<words>.*\S)\s*<(?P<target>[^<>]+)>", body)
    words, target = (parts["words"], parts["target"]) if parts else ("", body)
    match name:
        case "math":
            return f"${body}$"
        case "eq":
            return write_link(words, context.resolve_anchor(f"eq:{formula_anchor(target)}"))
        case "doc":
            return write_link(words or title_of_file(target), context.resolve_link(f"{target}.md"))
        case "ref" | "numref" | "prf:ref" | "any":
            label = label_anchor(target)
            anchors = (to_anchor(target), f"fig:{label}", f"tab:{label}")
            address = next(filter(None, map(context.resolve_anchor, anchors)), "")
            if not address:
                message = f"a link to `{target}`, which no text sets"
                context.leave(f"role `{{{name}}}`", message)
            if ":" in address.rpartition("#")[2]:  # what has a number is called by it
                rest = words.partition("%s")[2] if "%s" in words else ""
                return write_link("" if "%s" in words else words, address) + rest
            return write_link(words.replace("%s", "").strip() or title_of_file(target), address)
        case _ if name.partition(":")[0] in ("cite", "citep", "citet"):
            keys = [key.strip() for key in body.split(",")]
            if context.are_sources(keys):
                if name.partition(":")[2] == "t" or name == "citet":
                    return " and ".join(f"@{key}" for key in keys)
                return f"[{'; '.join(f'@{key}' for key in keys)}]"
            message = f"`{body}`, a source that no BibTeX file of the folder has; it is code now"
            context.leave(f"role `{{{name}}}`", message)
            return f"`{body}`"
        case "index":
            return words or ("" if ":" in body or "!" in body else body)
        case "download":
            return write_link(words or target, context.resolve_link(target))
        case "term":
            return words or target
        case "kbd" | "sub" | "sup" | "u" | "underline" | "del" | "strike":
            tag = {"underline": "u", "strike": "del"}.get(name, name)
            return f"<{tag}>{body}</{tag}>"
        case "abbr" | "sc" | "smallcaps" | "chem":
            return body
        case "button":
            return write_link(words or target, context.resolve_link(target))
        case _ if name.rpartition(":")[2] in _CODE_ROLES:
            return f"`{words or target}`"
        case "guilabel" | "menuselection" | "dfn" | "rfc" | "pep" | "span" | "raw":
            return words or body
        case _:
            message = f"the role `{{{name}}}`, whose text is code now: write what it stands for"
            context.leave(f"role `{{{name}}}`", message)
            return f"`{body}`"


_CODE_ROLES = frozenset(
    "code file command program option envvar samp func function class mod module meth method attr "
    "attribute data const exc exception obj object type".split()
)
_INLINE_RUN = re.compile(r"`(?:\{(?:python|r|julia)\}|r)[ ]+([^`]+)`")
_LANGUAGE = re.compile(r"^(`+)[ ]?(?:#!|:::)\w+[ ]+")
"""The language of code in a line, as MkDocs marks it."""


def convert_code(whole: str, context: LessonContext) -> str:
    """Return code in a line, without the mark of a tool that replaces it by its value."""
    run = _INLINE_RUN.fullmatch(whole)
    if run is None:
        return _LANGUAGE.sub(r"\1", whole)
    cure = "print it in a script, and bind the number by `{out}`"
    message = f"{whole}, whose value its tool shows: {cure}"
    context.leave("code in a line", message)
    return f"`{run[1]}`"
