"""Markup that readers would see as it is written: broken markup of ours, and that of other tools.

Entry points: `check_unread_markup`, for a block's content; `check_kind`, for a fence of a kind that
looks misspelt or needs a feature that is not installed.

Only texts of the parsed content are searched, neither code nor formulas nor escaped characters, so
a backslash or backticks say that markup is meant to be seen. Everything else is NUL in the searched
text: a mark directly after a NUL stands directly after a link, code and so on. What ordinary prose
holds is no mistake: prices, `C#`, sets in braces, powers, footnote stars, stars of significance.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator, Sequence

from coursebuild.core.registry import CORE_FENCES, fence_names, missing_package
from coursebuild.core.syntax.containers import quote_admonition
from coursebuild.core.syntax.fence import (
    INDENTED_FENCE,
    Fence,
    check_foreign_key,
    kind_of,
    outdent,
    split_words,
)
from coursebuild.core.syntax.markup_kinds import (
    BROKEN,
    FOREIGN,
    IN_HTML,
    LANGUAGES,
    ONCE,
    PLAIN_TEXTS,
    REWRITES,
    MarkupKind,
)
from coursebuild.core.syntax.nodes import shorten
from coursebuild.core.syntax.parsing_state import ParsingState
from coursebuild.core.text.diagnostics import Diagnostic, Fix, diagnose, misspelt, nearest, propose
from coursebuild.core.text.source import Excerpt, Span

_ESCAPED_BRACKETS = re.compile(r"(?:\\[()\[\]]|\s)+")
_MARKS = r"{}\uff5b\[\]\\$`*~|#@^&<%\ufffd\x01-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e"
_SIGN = re.compile(
    rf"[{_MARKS}!?=:._'´‘’(](?:(?<=[{_MARKS}])|(?<=[!?=:._'])[!?=:._']|(?<=:)\w"
    r"|(?<=[´‘’])[´‘’]{2}|(?<=\()(?:out\)|given\)|\.further))|[^\W\d_]> [a-z]|\w <[a-z]{2}"
)
_FIRST_SIGN = re.compile(
    r"\d{1,2}[.,;)][^\d\s]|\d{1,2}[,;] |-[A-Z]|[0=_.)] |h\d\. |[A-Z?!]> |1 |import "
    r"|: +\w|[•‣◦▪●]|-- "
)
_AFTER_CODE = re.compile(r"_[_.,;:)]?(?:\Z| )")
"""What all unread markup has at least once, in a text, where a line begins or directly after code,
so that most texts are passed over quickly; or it mentions a lesson, or is a letter directly after a
formula."""
_MENTION = re.compile(BROKEN["mention"].pattern)
_LETTER = re.compile(r"[a-rt-z](?!\w)")
_DOLLAR = re.compile(r"\$(?!\d[\d.,]*(?![\w\\^{]))")
"""A dollar sign that no amount of money follows."""
_TEX = re.compile(r"\\[A-Za-z]{2,}|[A-Za-z)}\]][_^](?:[0-9]|\{)")
"""A command, an index or an exponent."""
_LONE_DOLLAR = re.compile(
    r"(?<![\w$])\$(?!(?-i:[A-Z_]{3,})\b)(?:[A-Za-z\\(|{]|[-+][A-Za-z])"
    r"|(?:(?<![A-Za-z])(?<!\d )(?:[a-z]{1,2}|(?-i:[A-Z](?!\$ ?\d)))|[)}])\$(?![\w$])"
    r"|(?<![\w$])[-+(]*[A-Za-z][\w\\{}().-]*[*/^_=<>+][\w\\{}().*/^_=<>+-]*[0-9]\$(?![\w$])"
    r"|(?<![\w$])\$\d[^\s$]*\\[A-Za-z]{2,}|(?<![\w$])\$\d[\d.]*[+^*][\w(\\]"
    r"|(?<![\w$])\$(?=[^$\n=]*(?:[*/^+]|[A-Za-z]))(?:[\d.]+|[A-Za-z](?![A-Za-z])|[-+*/^() ])+="
    r"|(?<![\w$])\$\d[\d.,]* ?[-+*/] ?\d[\d.,]* ?=|(?<![\w$])\$[-+=][:;,.](?!\d)"
    r"|(?<!\$)\$ [A-Za-z](?: ?[=<>+*/^_-] ?[\w.]+)* \$(?!\$)"
)
"""Dollar signs that were surely meant for a formula, with a character of it."""


_KINDS = {**BROKEN, **FOREIGN}


@functools.cache
def _pattern(*, html: bool) -> re.Pattern[str]:
    """A pattern for all kinds, with a group for each; few courses need it."""
    kinds = IN_HTML if html else _KINDS
    parts = (f"(?P<{name}>{kind.pattern})" for name, kind in kinds.items())
    return re.compile("|".join(parts), re.MULTILINE | re.IGNORECASE)


_STAR = re.compile(
    r"^\*(?:[^\W\d_]{2,}|[aA] )|[^\W\d_]{2,}\*(?![\w*])|[^\W_][.!?]\*(?= [A-Z])"
    r"|(?<=[a-z] )[+\u2212-]?\d[\d.,]*\*\*(?= [a-z]|[.,;:]?$)",
    re.MULTILINE,
)
"""A star at the start of a line before a word or after a word, or two after a number in a text."""


def check_unread_markup(
    content: Excerpt, texts: Sequence[tuple[int, str]], *, html: bool = False
) -> Iterator[Diagnostic]:
    """Report markup in a block's content that was not read.

    `texts` are its texts that are neither code nor formulas nor escaped, in order, each with its
    offset in the content; in `html` the texts between tags.
    """
    whole = content.text
    has_escaped_bracket = "\\(" in whole or "\\[" in whole
    if not has_escaped_bracket and not any(_may_be_unread(whole, *text) for text in texts):
        return
    masked = _mask_all_but(texts, whole)
    dollars = [*_check_dollars(content, texts, masked)]
    yield from dollars
    reported = set[str]()
    kinds = IN_HTML if html else _KINDS
    for match in _pattern(html=html).finditer(masked):
        name = match.lastgroup or ""
        is_of_formula = name == "letter" or re.match(r"\\[A-Za-z]", match[0])
        if name in reported or (dollars and is_of_formula):
            continue
        diagnostic = _diagnose(content, name, kinds[name], match)
        if diagnostic is not None:
            reported |= ONCE.intersection([name])
            yield diagnostic


def _may_be_unread(whole: str, at: int, text: str) -> bool:
    first, *lines = text.split("\n")
    begins_line = at == 0 or whole[at - 1] == "\n"
    return (
        _SIGN.search(text) is not None
        or any(map(_FIRST_SIGN.match, [first, *lines] if begins_line else lines))
        or _AFTER_CODE.match(first) is not None
        or ("Lesson " in text and _MENTION.search(text) is not None)
        or (at > 0 and whole[at - 1] == "$" and _LETTER.match(text) is not None)
        or (at > 0 and whole[at - 1] == text[:1] == ")")
    )


def _check_dollars(
    content: Excerpt, texts: Sequence[tuple[int, str]], masked: str
) -> Iterator[Diagnostic]:
    """Report dollar signs that were meant for a formula.

    `$5` is money and stays so. But a blank inside `$x = $`, or a list that begins in the middle of
    a formula because a line of it starts with `+ `, leaves dollars in the text.
    """
    if not any("$" in text for _, text in texts):
        return
    lone = _LONE_DOLLAR.search(masked)
    adjacent = next((m.start() for m in re.finditer(r"(?<=\0)\$|\$(?=\0)", masked)), None)
    if adjacent is not None and "$$" in content.text[max(adjacent - 1, 0) : adjacent + 2]:
        at = adjacent
    elif lone is not None:
        at = masked.index("$", lone.start())
    elif any(_DOLLAR.search(text) for _, text in texts) and _TEX.search(masked):
        at = masked.index("$")
    else:
        return
    help = (
        "write `$x$` without blanks inside the dollar signs and without a digit after the last "
        "one; no line of a formula begins as a list item does (`+ `, `- `); write `\\$` for a "
        "dollar sign"
    )
    message = "this dollar sign would be shown as written: no formula begins or ends here"
    yield diagnose("math-unread", content.span(at, at + 1), message, help=help)


def _diagnose(
    content: Excerpt, name: str, kind: MarkupKind, match: re.Match[str]
) -> Diagnostic | None:
    """The diagnostic of a match of a kind in the masked content; `None` if it is no mistake."""
    whole = content.text
    if name in ("braces", "mark") and _is_escaped(whole, match.start()):
        return None
    markup = whole[match.start() : match.end()].strip(" \t\n")
    at = whole.index(markup, match.start())
    end = at + len(markup)
    before, after = whole[max(at - 1, 0) : at], whole[end : end + 3]
    span, help = content.span(at, at + len(markup)), kind.help
    match name:
        case "braces":
            return _diagnose_braces(markup, span, before[-1:])
        case "binding" if before.endswith("`") and markup.startswith("{"):
            return _diagnose_braces(markup, span, "`")
        case "binding" if before == "{" or _is_closing(match):
            return None
        case "binding" if markup == "}":
            help = "delete it, or write `\\}` for a brace that readers should see"
        case "binding":
            number, _, braces = markup.replace("`", "").rpartition("{")
            if re.match("[-+\u2212\\d]", number) and braces.endswith("}"):
                help = help.replace("4.47", number).replace("{out}", "{" + braces)
        case "link" if markup in ("[", "]"):
            is_adjacent_mark = before[-1:] in ("]", ")") if markup == "]" else after[:1] == "["
            if not is_adjacent_mark or whole.count("[") == whole.count("]"):
                return None
        case "link" if markup == ")" and (before != ")" or "(" in match.string[: match.start()]):
            return None
        case "emphasis" if markup == "*" and "**" not in before[-1:] + markup + after[:1]:
            follows = r"[^\W\d_]{2}|[aA] |[,.;:] " if at == 0 else r"[^\W\d_]{2}|[aA] "
            if match[0] == "*" and not re.match(follows, after):
                return None
        case "letter" if before != "$" or whole[: at - 1].endswith(("\\", "$")):
            return None
        case "latex" if markup.startswith("$") and markup[1] != "`":
            return None  # no code stands between the dollars
        case "item" if markup == "=" and after.startswith(" $"):
            return None  # an equation goes on
        case "role" if not after.startswith("`"):
            return None
        case "callout":
            word = re.sub(r"[^\w-]", "", markup).lower()
            help = help.replace("note", word or "note")
            help = Fix(help, edits=quote_admonition(span, word), safe=True)
        case "character" if span.text == "\0":
            return None  # it is reported wherever it stands
        case "character":
            message = f"the text contains the control character U+{ord(markup):04X}"
            if markup == "\ufffd":
                message = "a character was lost here: U+FFFD has taken its place"
            return diagnose(kind.rule, span, message, help=help)
        case "code":
            subject = "this backtick" if len(markup) == 1 else "these backticks"
            message = f"{subject} would be shown as written: {kind.reason}"
            return diagnose(kind.rule, span, message, help=help)
        case _:
            pass
    message = f"`{shorten(markup)}` would be shown as written: {kind.reason}"
    rule = "markup-foreign" if name in FOREIGN else kind.rule
    for pattern, replacement, is_safe in REWRITES.get(name, ()):
        rewritable = re.compile(pattern).match(whole, at)
        if rewritable is not None and rewritable[0] == span.text == markup and "\n" not in markup:
            help = Fix(help, rewritable.expand(replacement), safe=is_safe)
    return diagnose(rule, span, message, help=help)


def _is_closing(match: re.Match[str]) -> bool:
    """Whether what was found is only the brace that closes one before it, as in "{`a`, `b`}"."""
    braces = re.findall(r"(?<!\0)[{}]", match.string[: match.start()])
    return match[0][-1] == "}" and "{" not in match[0] and braces[-1:] == ["{"]


def _is_escaped(text: str, end: int) -> bool:
    """Whether brackets end here of which a backslash says that they are mere brackets."""
    opening = text.rfind("[", 0, end) if text.endswith("]", 0, end) else 0
    return opening > 0 and text[opening - 1] == "\\"


def _diagnose_braces(markup: str, span: Span, before: str) -> Diagnostic | None:
    """The diagnostic of braces directly after something that ends with the character `before`."""
    key = re.sub(r"[^\w].*", "", markup[1:].strip(), flags=re.DOTALL)
    escaping = "; write `\\{` for braces that readers should see"
    if before == "`":
        message = f"`{shorten(markup)}` does not say where the number is from"
        likely = nearest(key.lower(), ("out", "given", "code"))
        help = 'write `{out}`, `{out=examples/x.py}`, `{given}` or `{given="its source"}`'
        if likely in (None, key):
            return diagnose("binding-attribute", span, message, help=help + escaping)
        fix = propose(key, likely)
        return diagnose("binding-attribute", span, message, help=fix)
    if before == "$":
        help = 'write `{symbol="what it stands for" unit="m/s"}`' + escaping
        help = Fix(help, "symbol" if misspelt(key, ["symbol"]) else None, key, safe=True)
        message = f"`{shorten(markup)}` says nothing about the formula before it"
        return diagnose("symbol-attribute", span, message, help=help)
    if before not in ("]", ")"):
        return None
    message = f"`{shorten(markup)}` would be shown as written: "
    if before == "]":
        message += "the only attribute of words in brackets is `{term}`"
        new = "term" if misspelt(key, ["term"]) else None
        fix = Fix("write `[word]{term}`" + escaping, new, key, safe=True)
        return diagnose("term-attribute", span, message, help=fix)
    message += "links and images have no attributes"
    help = "write HTML, `<a …>` or `<img …>`, where one needs a class or a size" + escaping
    return diagnose("markup-foreign", span, message, help=help)


def find_stars(
    content: Excerpt, texts: Sequence[tuple[int, str]]
) -> Iterator[tuple[bool, Diagnostic]]:
    """Single stars at one end of a word, each with whether it stands before it.

    One may be the mark of a footnote, if the document has one of the other sort as well.
    """
    if not any("*" in text for _, text in texts):
        return
    kind = BROKEN["emphasis"]
    masked = _mask_all_but(texts, content.text)
    for match in _STAR.finditer(masked):
        if match[0].endswith("**") and masked.count("*") > 2:
            continue  # stars of significance
        message = f"`{match[0]}` would be shown as written: {kind.reason}"
        diagnostic = diagnose(kind.rule, content.span(*match.span()), message, help=kind.help)
        yield match[0].startswith("*"), diagnostic


def find_repetitions(content: Excerpt) -> Iterator[Diagnostic]:
    """Report lines that begin with the same words twice, as half an edit leaves them.

    What ends with punctuation, or is repeated again and again, is meant. With the mark of a
    quotation or a list between them, a few letters suffice.
    """
    for line in re.finditer(
        r"^(\S.{2,22}\w)(?:[-*+>]|#+|\d+\.) (?=\1)", content.text, re.MULTILINE
    ):
        message = f"`{shorten(line[0])}` stands here twice"
        help = Fix("delete one of the two", "")
        yield diagnose("text-repeated", content.span(*line.span()), message, help=help)
    for line in re.finditer(r"^\S.{23,}", content.text, re.MULTILINE):
        at = line[0].find(line[0][:12], 12)
        half = re.sub(r"(?:[-*+>]|#+|\d+\.) ?\Z", "", line[0][: max(at, 0)])
        is_begun = re.search(r"[^\W\d_]{2,} \S", half) and not re.search(r"[.,:;!?]\W*\Z", half)
        if is_begun and line[0].startswith(half, at) and line[0].count(half.rstrip()) == 2:
            span = content.span(line.start() + at, line.start() + at + len(half))
            message = f"`{shorten(half)}` is repeated here"
            yield diagnose("text-repeated", span, message, help=Fix("delete one of the two", ""))


def _mask_all_but(texts: Sequence[tuple[int, str]], whole: str) -> str:
    """A content in which only these texts, each with its offset, are not masked."""
    parts, end = list[str](), 0
    for at, text in texts:
        parts += [_mask(whole[end:at]), text]
        end = at + len(text)
    return "".join([*parts, _mask(whole[end:])])


def _mask(text: str) -> str:
    """Replace content that is no text by NUL, but for line ends and escaped brackets."""
    if _ESCAPED_BRACKETS.fullmatch(text):
        return text
    return "\n".join("\0" * len(line) for line in text.split("\n"))


# --- fences

_FOREIGN_KINDS = {"math": "a formula on a line of its own stands between two `$$`"}
"""Kinds of blocks that other tools read, with what to write here."""

_OBJECT = re.compile(r'\s*\{\s*"[^"\n]*"\s*:[\s\S]*\}\s*\Z')
"""A JSON object, perhaps with mistakes."""


def is_known_kind(kind: str) -> bool:
    """Whether a block of a kind is more than code to be shown."""
    return kind in CORE_FENCES or kind in fence_names()


def check_indented_fence(code: Excerpt, state: ParsingState) -> None:
    """Report a fence that is shown as text because it is indented."""
    opening = INDENTED_FENCE.match(code.text)
    if opening is None:
        return
    is_closed = re.search(rf"^{opening[1]}\s*\Z", code.text.rstrip(), re.MULTILINE) is not None
    if is_closed and not is_known_kind(opening[2]):
        return
    message = "this fence is indented by a tab or four blanks, so its block is shown as text"
    help = Fix("remove the white space before it", edits=outdent(code), safe=True)
    place = code.span(opening.start(1), opening.end())
    state.report(diagnose("fence-indented", place, message, help=help))
    state.closes_indented = not is_closed


def check_kind(fence: Fence) -> Iterator[Diagnostic]:
    """Report what looks wrong with the kind of a block that is shown as code."""
    package = missing_package(fence.kind)
    if package:
        message = f"nothing that is installed reads a block of kind `{fence.kind}`"
        yield diagnose("feature-missing", fence.head, message, help=f"install {package}")
    kind = kind_of(fence.info)
    name, kinds = kind.text.lower(), (*CORE_FENCES, *fence_names())
    words = split_words(fence.info).value
    yield from (diagnostic for word in words if (diagnostic := check_foreign_key(kind.text, word)))
    if any(word.key == "file" and (word.value or "").endswith(".py") for word in words):
        message = f"a block of kind `{kind.text}` is shown but never run, and this one has a `file`"
        help: str = "a script is a block of kind `python`"
        if re.fullmatch("i?py(?:thon)?3?", name):
            help = Fix(help, "python", safe=True)
        yield diagnose("script-kind", kind.span(), message, help=help)
    elif name in _FOREIGN_KINDS or name.startswith("{"):
        message = f"a block of kind `{kind.text}` is shown as code here"
        yield diagnose("markup-foreign", kind.span(), message, help=_help_with_foreign(name))
    elif "=" in name:
        message = f"the kind of this block is missing before `{kind.text}`"
        help = "the first word says what a block is, as in ```` ```python file=examples/a.py ````"
        is_script = name.startswith("file=") and name.endswith(".py")
        help = Fix(help, f"python {kind.text}" if is_script else None, safe=True)
        yield diagnose("fence-info", kind.span(), message, help=help)
    elif (likely := _find_misspelt(name, kinds, fence.body.text)) is not None:
        message = f"`{kind.text}` is not a known kind of block"
        help = propose(kind.text, likely)
        yield diagnose("fence-kind-near", kind.span(), message, help=help)
    elif (
        not package
        and _OBJECT.match(fence.body.text)
        and not (kind.text and _is_language(kind.text))
    ):
        message, place = "nothing reads a block without a kind, and this one holds JSON", fence.head
        if kind.text:
            message = f"nothing reads a block of kind `{kind.text}`: its JSON is shown as code"
            place = kind.span()
        help = "a lab is of kind `lab`, a quiz of kind `quiz`; JSON to be shown is of kind `json`"
        yield diagnose("fence-unread", place, message, help=help)


def _help_with_foreign(name: str) -> str:
    """What to write in place of a kind that other tools read."""
    language = name.strip("{}=. ")
    if name in _FOREIGN_KINDS:
        return _FOREIGN_KINDS[name]
    if is_known_kind(language):
        example = " file=examples/….py" if language == "python" else ""
        return Fix(f"write ```` ```{language}{example} ````", language)
    if language and _is_language(language):
        return Fix(f"code to be shown is of kind `{language}`; scripts are in Python", language)
    return "a callout is a quotation: `> [!note]`, and `> ` before each line"


_BODIES = {"mjcf": re.compile(r"\s*<"), "lab": _OBJECT, "quiz": _OBJECT}
"""How the texts of some kinds begin."""


def _find_misspelt(name: str, kinds: Sequence[str], body: str) -> str | None:
    """The kind for which a name was surely meant.

    The name of a language, such as `mcf`, is taken for another one only if the text has its form.
    """
    if name == "simlab":
        return "lab simlab"
    if name in kinds:
        return name
    likely = misspelt(name, kinds) or misspelt(name, LANGUAGES)
    if likely is None or not _is_language(name):
        return likely
    form = _BODIES.get(likely)
    return likely if form is not None and form.match(body) else None


def _is_language(name: str) -> bool:
    """Whether a kind is a language that is highlighted, or plain text."""
    from pygments.lexers import find_lexer_class_by_name  # slow to import, and rarely needed
    from pygments.util import ClassNotFound

    try:
        return find_lexer_class_by_name(name) is not None
    except ClassNotFound:
        return name.lower() in PLAIN_TEXTS
