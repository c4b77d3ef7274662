"""What stands in a line and names something, as Markdown of coursebuild.

It is a role of MyST and Sphinx, a reference of Quarto, a link of Obsidian, a name that its tool
replaces, or code that its tool runs.
"""

from __future__ import annotations

import contextlib
import re
import unicodedata
from urllib.parse import unquote, urlsplit

from coursebuild.api import regex
from coursebuild.features.importer.account import shorten_value
from coursebuild.features.importer.context import (
    PROOF_LABELS,
    LessonContext,
    label_anchor,
    to_anchor,
)
from coursebuild.features.importer.jsx import write_component
from coursebuild.features.importer.source_files import find_group, stem_of, title_of_file

BLOCK_START = r"[ \t]*(?:\n|[>|]|(?:[-*+]|\#+|\d+[.)])[ \t\n]|:::|```|~~~)"
_FENCE = (
    r"^[ \t>]*(?:(?:[-+*]|\d+[.)])[ \t]+)*(?P<mark>`{3,}|~{3,})[^`\n]*\n"
    r"(?:(?![ \t>]*(?P=mark))[^\n]*\n)*[^\n]*"
)
_OVER_LINES = regex(
    rf"(?P<block>{_FENCE})"  # what looks like one in code is none
    rf"|(?<!`)(?P<ticks>`+)(?!`)(?:[^\n]|\n(?!{BLOCK_START}))+?"
    r"(?<!`)(?P=ticks)(?!`)"
    r"|(?<![\w$\\`])\{[a-z][\w:+.-]*\}`(?=[^`\n]*\n)(?:[^`\n]|\n(?![ \t]*\n))+`"
    r"|\^\[(?=[^\[\]\n]*\n)(?:[^\[\]\n]|\n(?![ \t]*\n))+\]"
    r"|\[-?@(?=[^\[\]\n]*\n)(?:[^\[\]\n]|\n(?![ \t]*\n))+\]"
    r"|\{\{<(?=[^{}\n]*\n)(?:[^{}\n]|\n(?![ \t]*\n))+>\}\}"
    r"|(?<=\]\()[^()\s]+[ \t]*\n[ \t]*\)"
    rf"|^[ ]{{0,3}}\[(?!\^)[^\[\]\n]+\]:[ \t]*\n(?!{BLOCK_START})[ \t]*[^\s<\[]\S*"
    r"(?=[ \t]*(?:$|[\"'(]))"
    r"|(?<![\\$])\$(?=[^\s$])[^$\n]*(?<=\S)\$(?!\d)"  # else its end could begin another
    r"|(?<![\\$])\$(?=\S)[^$\n]+\n[ ]{0,3}(?:>|[-+*][ ])[^$\n]*(?<=\S)\$(?![\d$])"
    r"|(?<!\\)\\{1,2}\((?=[^\n]*\n)(?>(?:(?!\\{1,2}[()]|\n[ \t]*\n)[\s\S])+)\\{1,2}\)"
    r"|(?<!\\)\\{2}\[(?=[^\n]*\n)(?>(?:(?!\\{2}[\[\]]|\n[ \t]*\n)[\s\S])+)\\{2}\]",
    re.MULTILINE,
)
"""Code, a role, a note, a citation, a shortcode, an address or a formula over several lines."""


def join_broken_lines(text: str) -> str:
    """Return prose in which such a part is in one line, with its line ends behind it."""

    def join(part: re.Match[str]) -> str:
        lines = [line.strip() for line in part[0].split("\n")]
        return part[0] if part["block"] else " ".join(lines) + "\n" * (len(lines) - 1)

    return _OVER_LINES.sub(join, text)


def write_link(text: str, address: str, title: str = "") -> str:
    """Return a link; its text alone where there is no address."""
    return f"[{text}]({address}{title})" if address else text


def name_of_picture(address: str) -> str:
    """Return what a picture from another host is called where nothing says a word of it."""
    name = unquote(address.partition("?")[0].rpartition("/")[2])
    return re.sub(r"[][<>`*|$\\\s]+", " ", name) or address


def write_key(name: str) -> str:
    """Write what stands on a key."""
    return f"<kbd>{re.sub('[^a-zA-Z0-9 ]', lambda sign: f'&#{ord(sign[0])};', name)}</kbd>"


def words_of_link(address: str, old: str) -> str:
    """Return what a link without words is called; nothing where the page knows the title."""
    if re.match("#|lesson:|page:", address):
        return ""
    if name := re.fullmatch(r"`(?:~(?:\w+\.)*)?([^`]+)`", old):
        return f"`{name[1]}`"  # Quarto's `interlinks`, which shows the last part behind a tilde
    return urlsplit(address).hostname or title_of_file(re.split("[:#]", old)[-1])


def address_of_label(label: str, context: LessonContext) -> str:
    """Return the address of what has a label of MyST; empty where no text sets it."""
    name = label_anchor(label)
    kinds = ("tab", "fig") if label.startswith("t") else ("fig", "tab")
    anchors = (to_anchor(label), *(f"{kind}:{name}" for kind in kinds))
    return next(filter(None, map(context.resolve_anchor, anchors)), "")


def convert_role(name: str, body: str, context: LessonContext) -> str:
    """Return a role with this text in Markdown."""
    parts = re.fullmatch(r"(?P<words>.*\S)\s*<(?P<target>[^<>]+)>", body)
    words, target = (parts["words"], parts["target"]) if parts else ("", body)
    match name:
        case "math":
            if body != body.strip():  # blanks at its ends, which some tools allow
                body = re.sub(r"(?:\\[ ,;])*\s*\Z", "", body).strip()
            label = find_group(r"\A\\(?:eq)?ref\{([^{}]+)\}\Z", body)
            return convert_role("eq", label, context) if label else body and f"${body}$"
        case "eq":
            return write_link(words, context.resolve_formula(target))
        case "doc":
            # A name before a colon is that of another project
            address = context.resolve_link(f"inv:{target}" if ":" in target else f"{target}.md")
            return write_link(words or words_of_link(address, target), address)
        case "ref" | "numref" | "prf:ref" | "any" | "embed":
            address = address_of_label(target, context)
            if not address:
                path = context.resolve_path(f"{target}.md")
                if name == "any" and stem_of(path) in context.targets:
                    return convert_role("doc", body, context)
                message = f"a link to `{target}`, which no text sets"
                context.leave(f"role `{{{name}}}`", message)
                if name == "any":  # what is left is the name of an object
                    return convert_role("obj", body, context)
            if ":" in address.rpartition("#")[2]:  # what has a number is called by it
                words, mark, rest = words.partition("%s")
                return write_link("" if mark else words, address) + rest
            words = words.replace("%s", find_group(r"^lesson:([\w.]+)", address)).strip()
            return write_link(words if address else words or title_of_file(target), address)
        case _ if name.partition(":")[0] in ("cite", "citep", "citet"):
            keys = [key.strip() for key in body.split(",")]
            if context.are_sources(keys):
                if name.partition(":")[2] == "t" or name == "citet":
                    return " and ".join(map(context.cite_in_words, keys))
                return f"[{'; '.join(f'@{key}' for key in keys)}]"
            message = f"`{body}`, a source that no BibTeX file of the folder has; it is code now"
            context.leave(f"role `{{{name}}}`", message)
            return f"`{body}`"
        case "glue" | "glue:" | "glue:any" | "glue:text" | "eval":
            whole = f"`{body}`"
            value = context.print_value("python", body) if name == "eval" else body
            return _ask_value(f"role `{{{name}}}`", value, body, whole, context)
        case "pep" | "rfc":
            return words or f"{name.upper()} {body}"
        case "index":
            return words or ("" if ":" in body or "!" in body else body)
        case "download" | "button":
            return write_link(words or target, context.resolve_link(target))
        case "kbd" | "sub" | "sup" | "u" | "underline" | "del" | "strike":
            tag = {"underline": "u", "strike": "del"}.get(name, name)
            return f"<{tag}>{body}</{tag}>"
        case _ if name.rpartition(":")[2] in CODE_ROLES:
            name_of_part = re.sub(r"^(?:!|~(?:.*\.)?|\.+)", "", target)  # as Sphinx shows it
            return f"`{words or name_of_part}`"
        case _ if name.startswith("bdg-link"):  # a badge
            return write_link(words or target, context.resolve_link(target))
        case _ if name.startswith("bdg-ref"):
            return convert_role("any", body, context)
        case _ if name in _WORD_ROLES or name.startswith("bdg"):
            return words or body
        case _ if _ICON_ROLE.fullmatch(name):
            return ""
        case _:
            message = f"the role `{{{name}}}`, whose text is shown: write what it stands for"
            context.leave(f"role `{{{name}}}`", message)
            return words or f"`{body}`"


CODE_ROLES = frozenset(
    "code file command program option envvar samp func function class mod module meth method attr "
    "attribute data const exc exception obj object type".split()
)
_WORD_ROLES = frozenset("abbr chem dfn guilabel menuselection raw sc smallcaps span term".split())
_ICON_ROLE = regex(r"octicon|fa[bsr]?|material-\w+")
_INLINE_RUN = regex(r"`(?:\{(python|r|julia)\}|r)[ ]+([^`]+)`")
_LANGUAGE = regex(r"^(`+)[ ]?(?:#!|:::)[\w-]+[ ]+")
"""The language of code in a line, as MkDocs marks it."""


_SHORTCODE = regex(r"(\{?)\{\{<\s*(?:(?:var|meta)\s+([\w.-]+)|[^{}]*?)\s*>\}\}(\}?)")


def fill_shortcodes(code: str, context: LessonContext) -> str:
    """Return code of Quarto with the values that it names, without the braces that keep a name."""

    def fill(name: re.Match[str]) -> str:
        is_kept = name[1] and name[3]
        return name[0][1:-1] if is_kept else context.substitutions.get(name[2] or "", name[0])

    return _SHORTCODE.sub(fill, code) if context.path.endswith(".qmd") else code


def convert_code(whole: str, context: LessonContext) -> str:
    """Return code in a line, without the mark of a tool that replaces it by its value."""
    if raw := re.fullmatch(r"(`+)(.+?)\1\{=(\w+)\}", whole):
        if raw[3] == "html":
            return raw[2]
        context.leave("code in a line", f"{whole}, which is for other forms than a site")
        return ""
    if formula := re.fullmatch(r"`#!math (.+)`", whole):
        return convert_role("math", formula[1], context)
    run = _INLINE_RUN.fullmatch(whole)
    if context.is_pandoc:  # the name of an object, as filters mark it
        whole = re.sub(r"\A(`+)~~\.?(?=[A-Za-z][\w.]*(?:\(\))?\1\Z)", r"\1", whole)
    if run is None or not (run[1] or context.is_pandoc):
        return _LANGUAGE.sub(r"\1", fill_shortcodes(whole, context))
    if run[1] is None and re.match(r"[\w.]+[ ]*(?:<-|=(?!=))", run[2]):
        context.leave("code in a line", f"{whole}, which shows nothing: set the name in a cell")
        return ""
    name = context.print_value(run[1] or "r", run[2])
    return _ask_value("code in a line", name, run[2], whole, context)


def _ask_value(kind: str, name: str, code: str, whole: str, context: LessonContext) -> str:
    """Return the place of a value that its tool shows, which a script prints with this name."""
    cure = "`--prove` writes what its script prints" if name else "print it in a script, bind it"
    context.leave(kind, f"{whole}, whose value its tool shows: {cure}")
    return f"`{name} = ?`" if name else f"`{code}`"


def convert_cross_reference(whole: str, kind: str, label: str, context: LessonContext) -> str:
    """Return a reference of Quarto, as `@fig-label`, as a link."""
    if kind == "eq":
        return write_link("", context.resolve_formula(label))
    words = {"sec": "section", "fig": "figure", "tbl": "table", "lst": "listing", **PROOF_LABELS}
    name = to_anchor(label)
    number_address = context.resolve_anchor(f"{kind.replace('tbl', 'tab')}:{name}")
    if address := number_address or context.resolve_anchor(f"{kind}-{name}"):
        return write_link("" if number_address or kind == "sec" else f"the {words[kind]}", address)
    message = f"the reference `{whole}` to what no text labels: write what is meant"
    context.leave("cross-reference", message)
    return f"the {words[kind]}"


_FRAMES = "pagebreak fa toc raw tabs tab code embed content-ref highlight".split()
"""Names between braces that only place or mark what stands between them."""


_CALL = regex(r"\{\{-?[ ]*[\w.]+\((?P<arguments>.*)\)[ ]*-?\}\}")
_QUOTED = regex(r"(?<![=\w])(?:\"([^\"]+)\"|'([^']+)')")
"""A text among arguments, but no setting."""


def convert_substitution(whole: str, context: LessonContext, is_statement: bool) -> str:
    """Return what stands for a name between braces; or the whole as code, which is left.

    A statement shows nothing itself, and of a call of a macro its texts are shown.
    """
    title = find_group(r"(?:title|caption)=\"([^\"]*)\"", whole)
    name, *arguments = whole.strip("{}<> %").split() or [""]
    address = "".join(arguments[:1])
    if name in ("tab", "code") and title:
        return f"**{title}**"
    if name in ("video", "embed"):
        address = re.sub(r"(?<=\.ipynb)#.*", "", address.removeprefix("url=").strip('"'))
        return write_link(title or address, context.resolve_link(address))
    if name.removeprefix("end") in _FRAMES and name != "embed":
        return ""
    if name == "kbd" and arguments:
        return arguments[-1].rpartition("=")[2]
    key = address if name in ("var", "meta") else name
    if (value := context.substitutions.get(key)) is not None:
        return value
    call = _CALL.fullmatch(whole)
    holder = call["arguments"] if call else whole * whole.startswith("{{<")
    texts = ["".join(text) for text in _QUOTED.findall(holder)]
    message = f"`{whole}`, which its tool replaces: write what it stands for"
    context.leave("substitution", message)
    texts = texts or [whole[3:-3].strip() if whole.startswith("{{<") else whole]
    return "" if is_statement else ", ".join(f"`{text}`" for text in texts)


def draw_emoji(name: str, context: LessonContext) -> str:
    """Return the sign that a name between colons stands for, if its tool draws signs."""
    # MkDocs draws them by an extension; Zensical, whose settings are a project's, has it.
    has_signs = re.search(r"emoji|INHERIT|^\[project\]", context.files.mkdocs, re.MULTILINE)
    if not (has_signs or context.files.docusaurus):
        return name
    import emoji  # needed by texts with such names only

    if (sign := emoji.emojize(name, language="alias")) != name:
        return sign
    context.leave("emoji", f"`{name}`, shown as written: write the sign, if its tool draws one")
    return name


def write_icon(icon: re.Match[str]) -> str:
    """Return the sign that an icon is, or its name where it is alone in a cell or link."""
    for end in (" sign", " mark"):  # as Unicode calls it
        with contextlib.suppress(KeyError):
            sign = unicodedata.lookup(icon["sign"] + end)
            return rf"\{sign} " if sign.isascii() else f"{sign} "
    before, after = icon.string[: icon.start()], icon.string[icon.end() :]
    is_alone = re.search(r"[|\[][ \t]*$", before) and re.match(r"[ \t]*[|\]]", after)
    return f"{title_of_file(icon['sign']).lower()} " if is_alone else ""


def convert_wiki_link(whole: str, page: str, part: str, words: str, context: LessonContext) -> str:
    """Return a link or picture of Obsidian; as it is where the folder has no such file."""
    if whole[0] == "!" and (address := page and context.resolve_picture(page)):
        size = re.fullmatch(r"\s*\d+(?:x\d+)?\s*", words)
        return f"![{title_of_file(page) if size or not words else words}]({address})"
    # In a wiki of GitHub, the blanks of a title are hyphens of its file
    paths = (f"{name}.md" for name in (page, page.replace(" ", "-")))
    path = next((path for path in paths if context.resolve_path(path) in context.files), "")
    if page and not path:
        return whole
    address = context.resolve_link(f"{path}{part}" if page else part)
    return write_link(words or page or part.lstrip("#"), address)


_ATTRIBUTE = regex(
    r"(?<=\s)(href|poster|src|srcset)(=[\"'][\s,]*)([^\"'\s,][^\"'\n]*)", re.IGNORECASE
)


_WITH_FILE = regex(r"<(?:a|audio|(?P<frame>iframe)|img|source|track|video)\b", re.IGNORECASE)
LOOK = regex(
    r"(?<=<table)(?:(?!\sid=)[^<>])*?\salign=[\"'\w]+"  # by which words would stand beside it
    r"|(?<=<t[dh])[ \t]+width=[\"']?\d+%?[\"']?(?=[\s>])"
    r"|[ \t]+(?:class=(?:\"[^\"]*\"|'[^']*'|[^\s\"'<>]+)|markdown(?:=[\"'\w]+)?(?=[ \t>]))"
)


def convert_tag(tag: str, context: LessonContext) -> str:
    """Return a tag of HTML with the new address of the file of the folder that it names.

    A class names a look that its tool gives; here it could be that of another thing.
    """
    if re.match(r"<img\b[^<>]*\sclass=[\"'][^\"'<>]*\b(?:only-dark|dark-only)\b", tag):
        return ""  # a page makes its pictures dark itself
    tag = LOOK.sub("", tag)
    name = tag[1:].split()[0]
    if name[0].isupper() and not name.isupper():  # no element of HTML
        return write_component(name, tag, context)
    kind = _WITH_FILE.match(tag)
    attributes = [*_ATTRIBUTE.finditer(tag)] if kind else []
    attribute = attributes[0] if attributes else None
    if attribute and kind and kind["frame"]:
        address = context.resolve_link(attribute[3])
        title = find_group(r"\stitle=[\"']([^\"']+)", tag)
        words = title or words_of_link(address, attribute[3])
        context.leave("tag of HTML", f"a frame that shows `{attribute[3]}`; it is a link now")
        return f'<a href="{address}">{words}</a>' if address else words
    if attribute and re.match("<a[ ]", tag, re.IGNORECASE) and attribute[3].startswith("data:"):
        context.leave("link", f"a link to `{shorten_value(attribute[3])}`, data in the text")
        return tag[: attribute.start()].rstrip() + tag[attribute.end() + 1 :]
    for attribute in reversed(attributes):
        address = attribute[3]
        if re.match(r"(?!attachment:|data:)[a-z][a-z+.-]*:|//|#", address):
            continue
        if attribute[1].lower() == "srcset":  # the first of several: pages take one size
            address = address.split()[0].rstrip(",")
        before, after = tag[: attribute.start(3)], tag[attribute.end(3) :]
        if new_address := context.resolve_picture(address):
            tag = before + new_address + after
            continue
        problem = "which is not in the folder"
        if stem_of(context.resolve_path(urlsplit(address).path)) in context.targets:
            problem = "which HTML cannot link: write the link in Markdown"
        context.leave("tag of HTML", f"the file `{shorten_value(address)}`, {problem}")
        if attribute[1].lower() == "src" and re.match("<img", tag, re.IGNORECASE):
            return find_group(r"\s(?i:alt)=[\"']([^\"']*)", tag)
        tag = tag[: attribute.start()].rstrip() + after[1:]
    return tag


_HTML_LINK = regex(
    rf"{_FENCE}|<!--(?:(?!-->).)*-->|(?<!`)(?P<ticks>`+)(?!`).*?(?<!`)(?P=ticks)(?!`)"
    r"|<a(?![^<>]*\s(?:id|name)=)[ \t](?:[^<>]*[ \t])?href=(?P<quote>[\"'])(?P<page>[^\"'\s:]+)"
    r"(?P=quote)[^<>]*>(?P<words>(?:(?!</?a\b)[^\n`\[\]])*)</a>",
    re.IGNORECASE | re.MULTILINE | re.DOTALL,
)
"""A link of HTML that has no anchor; or code or a comment, in which there is none."""
_HTML_BLOCK = regex(r"\s*<(?!/?(?:a|b|code|em|i|img|span|strong)\b)")
"""How a paragraph begins in which Markdown is not read."""


def rewrite_html_links(text: str, context: LessonContext) -> str:
    """Return prose whose links to texts are in Markdown: in HTML they have no address."""

    def rewrite(link: re.Match[str]) -> str:
        page = link["page"]
        path = page and urlsplit(page).path
        is_text = page and (not path or stem_of(context.resolve_path(path)) in context.targets)
        if not is_text or _HTML_BLOCK.match(re.split(r"\n[ \t]*\n", text[: link.start()])[-1]):
            return link[0]
        return f"[{link['words']}]({page})"

    return _HTML_LINK.sub(rewrite, text)


def convert_attributes(match: re.Match[str]) -> str:
    """Return attributes behind a heading or another part of a line: an anchor, or nothing."""
    whole = match[0]
    line, before = match.string, match.string[: match.start()]
    is_heading, is_whole = line.startswith("#"), whole == line.rstrip()
    is_marked = whole.lstrip().startswith("{:")
    is_behind = whole[0] == "{" and re.search(r"[`\]*>:\"]$|\]\([^()]*\)$", before)
    if not (is_heading or is_whole or is_marked or is_behind):
        return whole  # an index in a formula, a set, an argument
    id = re.search(r"#([^\s{}\"'#]+)", whole)
    if id is None or not (":" in id[1] or is_heading):
        return ""
    return whole if ":" in id[1] else f" {{#{to_anchor(id[1])}}}"
