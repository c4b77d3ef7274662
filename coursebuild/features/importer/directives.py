"""Directives of MyST and Sphinx, as Markdown of coursebuild."""

from __future__ import annotations

import csv
import functools
import re
import textwrap
from collections.abc import Callable, Mapping

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.api import marks, model, regex
from coursebuild.core.registry import missing_package
from coursebuild.features.importer.context import NUMBERED, LessonContext, label_anchor, to_anchor
from coursebuild.features.importer.displays import normalize_formulas
from coursebuild.features.importer.includes import lines_of
from coursebuild.features.importer.outlines import read_tree
from coursebuild.features.importer.prose import rewrite_prose
from coursebuild.features.importer.roles import (
    BLOCK_START,
    CODE_ROLES,
    convert_role,
    words_of_link,
    write_link,
)
from coursebuild.features.importer.rst import read_rst
from coursebuild.features.importer.source_files import TOO_MUCH, find_group, stem_of

CALLOUTS = {
    **{name: name for name in model.CALLOUTS},
    **dict.fromkeys(("hint", "success"), "tip"),
    **dict.fromkeys(("attention", "failure", "bug"), "caution"),
    **dict.fromkeys(("danger", "error"), "warning"),
    **dict.fromkeys(("seealso", "info", "abstract", "summary", "quote", "topic"), "note"),
    **dict.fromkeys(("admonition", "margin", "sidebar", "dropdown", "example"), "note"),
    **dict.fromkeys(("aside", "details", "toggle", "todo"), "note"),
    **dict.fromkeys(("exercise", "question"), "try"),
    "answer": "solution",
}
"""Kinds of callouts here, by those that other tools have."""


class Directive(Struct, frozen=True):
    """A directive as it was written."""

    name: str
    argument: str
    options: Mapping[str, str]
    text: str
    nested: Callable[[str], str]
    """Converts a text in it."""
    callout: Callable[[str, str, str, bool], str]
    """Writes a callout of a kind, with a title, label and all, and a text; it may be folded."""

    @property
    def label(self) -> str:
        """The name by which texts refer to it; may be empty."""
        return self.options.get("name") or self.options.get("label") or ""

    @property
    def number(self) -> str:
        """What gives it a number, behind a blank; empty without a label."""
        kind = self.name.removeprefix("prf:")
        kind = kind if kind in NUMBERED else "lst"
        return f" {{#{kind}:{to_anchor(self.label)}}}" if self.label else ""


_TITLED = frozenset(
    "admonition dropdown sidebar topic exercise example margin aside details card".split()
)
"""Directives whose argument is a title; that of others is their first line."""
_PROOFS = NUMBERED - {"exercise", "solution", "lst"}  # `prf:`, which MyST need not say
_WITH_LABELS = frozenset(
    "math figure figure-md table list-table csv-table code code-block sourcecode".split()
)
"""What bears its label itself."""
_FRAMES = frozenset(
    "div compound acks container grid grid-item tabs tab-set tab-set-code "
    "card-carousel centered hlist rst-class table-of".split()
)
"""What only places what it holds."""
_MAPS = frozenset("tableofcontents toctree contents bibliography genindex show-index".split())
"""Lists that the site makes itself."""
_CHANGES = {
    "versionadded": "New in",
    "versionchanged": "Changed in",
    "deprecated": "Deprecated since",
    "versionremoved": "Removed in",
}


def convert_directive(directive: Directive, context: LessonContext) -> str:
    """Return a directive in Markdown."""
    anchor = ""
    kind = directive.name.removeprefix("prf:")
    if directive.label and not (kind in _WITH_LABELS or kind in NUMBERED):
        anchor = f'<a id="{to_anchor(directive.label)}"></a>\n\n'
    return anchor + _write(directive, context)


def _write(directive: Directive, context: LessonContext) -> str:
    name, argument, options, text = (
        directive.name,
        directive.argument,
        directive.options,
        directive.text,
    )
    kind = f"directive `{{{name}}}`"
    match name:
        case "math":
            label = f" {{#{label_anchor(directive.label)}}}" if directive.label else ""
            tex = "\n".join((argument, text)).strip()
            return normalize_formulas(f"$$\n{tex}\n$${label}")
        case "figure" | "image" if "only-dark" in options.get("class", ""):
            return ""  # a page makes its pictures dark itself
        case "figure" | "image":
            return _write_figure(directive, context)
        case "figure-md":  # its argument is its label, its first paragraph the picture
            picture, _, caption = text.strip("\n").partition("\n\n")
            patterns = (r"\]\(([^()\s]+)|src=[\"']([^\"']+)", r"!\[([^\]]*)\]|alt=[\"']([^\"']*)")
            source, alt = (find_group(pattern, picture) for pattern in patterns)
            new = {**options, "alt": alt, "name": argument}
            figure = replace(directive, name="figure", argument=source, options=new, text=caption)
            return _write_figure(figure, context)
        case "glue:figure":
            context.leave(kind, f"the figure `{argument}`: save it in its cell, as `figure=` says")
            return directive.nested(text)
        case "todo" if "conf.py" in context.files:
            context.leave(kind, "a note of the authors, which readers did not see: a comment now")
            return f"<!-- {argument} {text.replace('-->', '--›')} -->"
        case "doctest" | "plot":
            return marks.fence("pycon" if name == "doctest" else "python", text.strip("\n"))
        case "line-block":
            return directive.nested("\\\n".join(text.strip("\n").split("\n")))
        case "code" | "code-block" | "sourcecode" | "highlight" | "parsed-literal":
            language = argument if name != "parsed-literal" else ""
            caption = options.get("caption") or options.get("filename") or ""
            head = f"**{rewrite_prose(caption, context)}**\n\n" if caption else ""
            code = text.strip("\n")
            return head + marks.fence((language or "text") + directive.number, code) if code else ""
        case "code-cell":
            context.leave(kind, f"a cell of `{argument}` is shown and not run")
            return marks.fence(argument or "text", text.strip("\n"))
        case "literalinclude" | "include":
            return _write_file(directive, context, kind)
        case "list-table" | "csv-table" | "table":
            return _write_table(directive, context)
        case "glossary":
            return _write_glossary(directive)
        case "raw" if argument.strip() == "html":
            return rewrite_prose(text, context)
        case (
            "raw"
            | "index"
            | "sectionauthor"
            | "codeauthor"
            | "meta"
            | "tags"
            | "only"
            | "ifconfig"
            | "role"
            | "currentmodule"
            | "py:currentmodule"
        ):
            if name == "only" and "html" in argument:
                return directive.nested(text)
            words = " ".join(f"{argument} {text}".split())
            context.leave(kind, f"{kind} (`{words.replace('`', '')}`), which no page here shows")
            return ""
        case "embed" | "eval" | "glue" | "glue:" | "glue:any":
            return convert_role(name, argument.strip().removeprefix("#"), context)
        case "rubric" | "centered":
            return f"**{rewrite_prose(argument, context)}**\n\n{directive.nested(text)}"
        case "tab" | "tab-item" | "tabbed" | "grid-item-card" | "card":
            return _write_card(directive, context)
        case "iframe" | "youtube" | "video" | "button-link" | "button-ref":
            address = argument.strip()
            if name == "youtube":
                address = f"https://www.youtube.com/watch?v={address}"
            words = " ".join(text.split()) or address
            return rewrite_prose(f"[{words}]({address})", context)
        case "epigraph" | "pull-quote" | "blockquote" | "highlights":
            return marks.block_quote(directive.nested(text))
        case _ if name.rpartition(":")[2] in CODE_ROLES:  # the signature of what has this kind
            return "\n\n".join(
                (*(f"`{line}`" for line in argument.splitlines()), directive.nested(text))
            )
        case "toctree" if "hidden" not in options:
            return _write_list(directive, context)
        case _ if name in _MAPS:
            return ""
        case "eval-rst":
            return directive.nested(read_rst(text))
        case _ if name.startswith("auto"):
            names = re.findall(r"^[ \t]*~?([\w.]+)", f"{argument}\n{text}", re.MULTILINE)
            message = f"documentation that its tool makes from the code of `{', '.join(names)}`"
            context.leave(kind, message)
            return "\n\n".join(f"`{name}`" for name in names)
        case _ if name in _FRAMES:
            return directive.nested(text)
        case _ if name in _CHANGES:
            version, _, rest = argument.partition(" ")
            body = f"{rest}\n{text}".strip()
            return directive.callout("version", f"{_CHANGES[name]} {version}", body, False)
        case _ if (proof := name.removeprefix("prf:")) in _PROOFS and name not in CALLOUTS:
            return directive.callout(proof, argument + directive.number, text, False)
        case "solution":  # its argument is the label of an exercise
            return directive.callout(name, directive.number, text, True)
        case _ if name in CALLOUTS:
            if name == "admonition" and (kind := options.get("class", "")) in CALLOUTS:
                name = kind
            is_folded = name in ("details", "toggle") or "dropdown" in options.get("class", name)
            has_title = directive.name in _TITLED or (text.strip() and "myst.yml" in context.files)
            title = argument if has_title else ""
            title += directive.number if name in NUMBERED else ""
            if subtitle := options.get("subtitle"):
                text = f"**{subtitle}**\n\n{text}"
            body = text if title else f"{argument}\n{text}"
            return directive.callout(name, title, body, is_folded)
        case _ if package := missing_package(name):
            message = f"a block of `{name}` is shown as text: install {package}, and name it so"
            context.leave(kind, message)
            return marks.fence("text", text)
        case _ if name in highlighted_languages():
            context.leave(kind, f"a block of `{name}` is shown and not run")
            return marks.fence(name, text)
        case _:
            message = f"the directive `{{{name}}}`, whose text is shown as it was written"
            context.leave(kind, message)
            words = f"{argument}\n{text}".strip("\n")
            return marks.fence("text", words) if words else ""


def _write_figure(directive: Directive, context: LessonContext) -> str:
    caption = directive.nested(directive.text).strip() if directive.text.strip() else ""
    anchor, label = _write_label("fig", directive, context)
    if not directive.argument.strip():  # what it shows is in it
        return anchor + caption
    first, _, rest = caption.partition("\n\n")
    first = " ".join(first.split())
    alt = directive.options.get("alt") or first
    alt = re.sub(r"\]\([^()]*\)|[\[\]`*_$]", "", alt)
    picture = rewrite_prose(f"![{alt}]({directive.argument.strip()})", context)
    if not picture.startswith("!["):  # it is on another host, or nowhere
        return anchor + (caption if picture == first else f"{picture}\n\n{caption}")
    target = directive.options.get("target", "")
    if target and label:
        context.leave("figure", f"the link of a figure to `{target}`, which has a number here")
    elif target:
        picture = write_link(picture, context.resolve_link(target))
    anchor = "" if label else anchor
    if not first.strip() and not label:
        return anchor + picture
    return f"{anchor}Figure: {picture} {first}{label}\n\n{rest}".strip()


def _write_label(kind: str, directive: Directive, context: LessonContext) -> tuple[str, str]:
    """Return the anchor that a label sets where there is no number, and what gives a number.

    That of a single picture is set already. Sphinx alone gives numbers only where it is told so.
    """
    if not directive.label or directive.name == "image":
        return "", ""
    name, files = label_anchor(directive.label), context.files
    is_sphinx = "conf.py" in files and "_config.yml" not in files
    has_number = not is_sphinx or _NUMBERS.search(files.read_text("conf.py"))
    anchor, number = f'<a id="{kind}-{name}"></a>\n\n', f" {{#{kind}:{name}}}"
    return anchor, number if has_number else ""


_NUMBERS = regex(r"^numfig[ \t]*=[ \t]*True\b", re.MULTILINE)


def _write_file(directive: Directive, context: LessonContext, kind: str) -> str:
    name, options = directive.argument.strip(), directive.options
    path = context.resolve_path(name)
    if path not in context.files:
        context.leave(kind, f"the file `{name}`, which is not in the folder")
        return ""
    text = lines_of(context.files.read_text(path), options)
    if not context.files.may_include(text, context.path):
        context.leave(kind, f"the file `{name}`: {TOO_MUCH}")
        return ""
    if directive.name == "include":
        return directive.nested(read_rst(text) if path.endswith((".rst", ".txt")) else text)
    language = options.get("language") or path.rpartition(".")[2]
    language = {"py": "python", "yml": "yaml"}.get(language, language)
    caption = rewrite_prose(options.get("caption", ""), context)
    return (f"**{caption}**\n\n" if caption else "") + marks.fence(
        language if language in highlighted_languages() else "text", text.strip("\n")
    )


def _write_card(directive: Directive, context: LessonContext) -> str:
    parts = re.split(r"^(?:\^{3,}|\+{3,})[ \t]*$", directive.text, flags=re.MULTILINE)
    header, footer = (directive.options.get(key, "") for key in ("header", "footer"))
    parts = [header, *parts, footer]
    title = rewrite_prose(directive.argument.strip(), context)
    link = directive.options.get("link", "")
    if link:
        is_label = directive.options.get("link-type") == "ref"
        is_text = directive.options.get("link-type") == "doc" or not re.search(r"[:.#/]", link)
        address = context.resolve_anchor(to_anchor(link)) if is_label else ""
        address = address or context.resolve_link(f"{link}.md" if is_text else link)
        if "](" not in title:
            title = write_link(title or words_of_link(address, link), address)
    inside = (directive.nested(part).strip("\n") for part in parts)
    return "\n\n".join(part for part in (f"**{title}**" if title else "", *inside) if part)


def _write_list(directive: Directive, context: LessonContext) -> str:
    """Return the texts of a part of the course as a list of links."""
    caption = directive.options.get("caption", "").strip("\"'")
    lines = [f"**{caption}**\n"] if caption else []
    known_paths = {context.path}
    for _, title, target, paths in read_tree(directive.text, context.path, context.files):
        new = [context.targets.get(stem_of(path), "") for path in paths if path not in known_paths]
        lines += (f"- {write_link(title, address)}" for address in new)
        known_paths.update(paths)
        lines += [f"- [{title or target}]({target})"] if "://" in target else []
    return "\n".join(lines)


def _write_table(directive: Directive, context: LessonContext) -> str:
    title = rewrite_prose(directive.argument, context)
    anchor, label = _write_label("tab", directive, context)
    caption = f"Table: {title}{label}\n\n" if title else ""
    caption = caption if title and label else anchor + caption
    if directive.name == "table":
        return caption + directive.nested(directive.text)
    if directive.name == "csv-table":
        text, name = directive.text, directive.options.get("file", "")
        if name and (path := context.resolve_path(name)) in context.files:
            text = context.files.read_text(path)
        rows = [row for row in csv.reader(text.strip().splitlines(), skipinitialspace=True) if row]
        if header := directive.options.get("header"):
            rows = [next(csv.reader([header], skipinitialspace=True)), *rows]
    else:
        rows = [
            [cell.strip() for cell in re.split(r"(?:\A|\n[ ]{,2})-(?:[ \t]|(?=\n|\Z))", row)[1:]]
            for row in re.split(r"(?:\A|\n)\*[ \t]", directive.text)[1:]
        ]
    width = max(map(len, rows), default=0)
    if not width:
        return caption
    cells = [[_cell(cell, context) for cell in (*row, *[""] * (width - len(row)))] for row in rows]
    return caption + marks.table(cells[0], cells[1:])


def _cell(text: str, context: LessonContext) -> str:
    return rewrite_prose(" ".join(text.split()), context).replace("|", "\\|")


def _write_glossary(directive: Directive) -> str:
    """Return the entries of a glossary as paragraphs that mark their terms.

    A meaning stands further right than its terms, or, as MyST has it, behind a colon.
    """
    text = re.sub(r"\n(?:[ \t]*\n)*:[ \t]+((?:.+\n?)+)", _indent_meaning, directive.text)
    out, terms, marked_terms = [], list[str](), set[str]()
    for entry in re.split(r"\n(?=\S)", text.strip("\n")):
        term, _, meaning = entry.partition("\n")
        if entry.startswith("[^"):  # a footnote
            out.append(directive.nested(entry).strip())
            continue
        terms.append(_mark_term(directive.nested(term).strip(), marked_terms))
        if meaning.strip():
            words = directive.nested(textwrap.dedent(meaning)).strip()
            gap = "\n\n" if re.match(BLOCK_START, words) else " "
            out.append(f"{', '.join(terms)}:{gap}{words}")
            terms = []
    return "\n\n".join(out)


def _indent_meaning(meaning: re.Match[str]) -> str:
    lines = re.sub(r"\n:[ \t]+", "\n", meaning[1].rstrip("\n"))
    return "\n" + textwrap.indent(lines, "  ") + "\n"


def _mark_term(term: str, marked_terms: set[str]) -> str:
    """Return a term with its mark, the first time; a link of it stands behind the mark."""
    link = re.fullmatch(r"\[([^\[\]]+)\]\(([^()\s]+)\)", term)
    words, address = (link[1], f" (<{link[2]}>)") if link is not None else (term, "")
    mark = "" if words in marked_terms else "{term}"
    marked_terms.add(words)
    return (f"[{words}]{mark}" if mark else words) + address


@functools.cache
def highlighted_languages() -> frozenset[str]:
    """The names of languages that pages highlight."""
    from pygments.lexers import get_all_lexers

    return frozenset(alias for _, aliases, _, _ in get_all_lexers() for alias in aliases)
