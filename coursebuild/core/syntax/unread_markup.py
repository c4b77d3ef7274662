"""Markup that readers would see as it is written: broken markup of ours, and that of other tools.

Entry points: `check_unread_markup`, for a block's content; `check_inline_code`, for code in a line
that another tool would compute; `check_kind`, for a fence of a kind that looks misspelt or needs a
feature that is not installed.

Only texts of the parsed content are searched, neither code nor formulas nor escaped characters, so
a backslash or backticks say that markup is meant to be seen. Everything else is NUL in the searched
text: a mark directly after a NUL stands directly after a link, code and so on. What ordinary prose
holds is no mistake: prices, `C#`, sets in braces, powers, footnote stars, stars of significance.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from coursebuild.core.registry import CORE_FENCES, fence_names, missing_package
from coursebuild.core.syntax.fence import Fence, check_foreign_key, kind_of, split_words
from coursebuild.core.syntax.markup_kinds import BROKEN, FOREIGN, IN_HTML, ONCE, MarkupKind
from coursebuild.core.syntax.nodes import shorten
from coursebuild.core.text.diagnostics import Diagnostic, diagnose, misspelt, nearest
from coursebuild.core.text.source import Excerpt, Span

_ESCAPED_BRACKETS = re.compile(r"(?:\\[()\[\]]|\s)+")
_SIGNS = re.compile(
    r"[{}\[\]\\$`*~|#@^&<%\ufffd\x01-\x08\x0b-\x1f\x7f-\x9f]|[!?=:._']{2}|:\w|[´‘’]{3}"
    r"|\((?:out|given)\)|\A_\Z|\A[a-rt-z](?!\w)|^\d{1,2}[.,;)][^\d\s]|^\d{1,2}[,;] |^-[A-Z]"
    r"|^[0=_.)] |^h\d\. |^[A-Z?!]> |^1 |^import |Lesson \d",
    re.MULTILINE,
)
"""What all unread markup has at least once, so that most texts are passed over quickly."""
_DOLLAR = re.compile(r"\$(?!\d[\d.,]*(?![\w\\^{]))")
"""A dollar sign that no amount of money follows."""
_TEX = re.compile(r"\\[A-Za-z]{2,}|[A-Za-z)}\]][_^](?:[0-9]|\{)")
"""A command, an index or an exponent."""
_LONE_DOLLAR = re.compile(
    r"(?<![\w$])\$(?!(?-i:[A-Z_]{3,})\b)(?:[A-Za-z\\(|{]|[-+][A-Za-z])"
    r"|(?:(?<![A-Za-z])(?<!\d )(?:[a-z]{1,2}|(?-i:[A-Z](?!\$ ?\d)))|[)}])\$(?![\w$])"
    r"|(?<![\w$])[-+(]*[A-Za-z][\w\\{}().-]*[*/^_=<>+][\w\\{}().*/^_=<>+-]*[0-9]\$(?![\w$])"
    r"|(?<!\$)\$ [A-Za-z](?: ?[=<>+*/^_-] ?[\w.]+)* \$(?!\$)"
)
"""Dollar signs that were surely meant for a formula, with a character of it."""


def _one_pattern(kinds: dict[str, MarkupKind]) -> re.Pattern[str]:
    """A pattern for all kinds, with a group for each."""
    parts = (f"(?P<{name}>{kind.pattern})" for name, kind in kinds.items())
    return re.compile("|".join(parts), re.MULTILINE | re.IGNORECASE)


_KINDS = {**BROKEN, **FOREIGN}
_ANY_KIND, _ANY_IN_HTML = _one_pattern(_KINDS), _one_pattern(IN_HTML)
_CELL = re.compile(r"\{[=.]?(?:bash|julia|js|ojs|python|py|r|sql)\}\s|r [A-Za-z_.][\w.]*[($\[]")
"""How an expression begins that Quarto or R Markdown would compute."""

_STAR = re.compile(
    r"^\*(?:[^\W\d_]{2,}|[aA] )|[^\W\d_]{2,}\*(?![\w*])|[^\W_][.!?]\*(?= [A-Z])"
    r"|(?<=[a-z] )[+\u2212-]?\d[\d.,]*\*\*(?= [a-z]|[.,;:]?$)",
    re.MULTILINE,
)
"""A star at the start of a line before a word or after a word, or two after a number in a text."""
_OPEN_VALUE = re.compile(r'\b([A-Za-z]\w*)=(?:"|[\w.-]+")')
_ATTRIBUTE = re.compile(r'[A-Za-z][\w:-]*="[^"]*"')
_NO_EQUALS = re.compile(r'([A-Za-z]\w*)\W?"[\w. -]*"')
_LONE_DASH = re.compile(r'([A-Za-z]\w*)[-+;]"[^"]*"')
_LATE_QUOTE = re.compile(r'\b([A-Za-z]\w*)=\.?\d[\d.]*"')
_PAIR = re.compile(r"\([^()\[\]{}]*\)|\[[^()\[\]{}]*\]|\{[^()\[\]{}]*\}")
"""A pair of brackets with none inside."""
_PROSE = re.compile(r"(?<!`)`[,.;:)]\s+\w|(?<!`)`[^`]*\w`{2,}[\s,.;:)]")
"""Code that begins with a mark of punctuation and a blank, or that holds two backticks."""
_LETTER_BEFORE, _LETTER_AFTER = re.compile(r"(?:^|(?<=\s))\w\Z"), re.compile(r"\w")


def check_unread_markup(
    content: Excerpt, texts: Sequence[tuple[int, str]], *, html: bool = False
) -> Iterator[Diagnostic]:
    """Report markup in a block's content that was not read.

    `texts` are its texts that are neither code nor formulas nor escaped, in order, each with its
    offset in the content; in `html` the texts between tags.
    """
    whole = content.text
    has_escaped_bracket = "\\(" in whole or "\\[" in whole
    if not has_escaped_bracket and not any(_SIGNS.search(text) for _, text in texts):
        return
    masked = _mask_all_but(texts, whole)
    dollars = [*_check_dollars(content, texts, masked)]
    yield from dollars
    reported = set[str]()
    kinds, pattern = (IN_HTML, _ANY_IN_HTML) if html else (_KINDS, _ANY_KIND)
    for match in pattern.finditer(masked):
        name = match.lastgroup or ""
        is_of_formula = name == "letter" or re.match(r"\\[A-Za-z]", match[0])
        if name in reported or (dollars and is_of_formula):
            continue
        diagnostic = _diagnose(content, name, kinds[name], match)
        if diagnostic is not None:
            reported |= ONCE.intersection([name])
            yield diagnostic


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
        case "emphasis" if markup == "*" and "**" not in before[-1:] + markup + after[:1]:
            if match[0] == "*" and not re.match(r"[^\W\d_]{2}|[aA] ", after):
                return None
        case "letter" if before != "$" or whole[: at - 1].endswith(("\\", "$")):
            return None
        case "latex" if markup.startswith("$") and markup[1] != "`":
            return None  # no code stands between the dollars
        case "role" if not after.startswith("`"):
            return None
        case "callout":
            word = re.sub(r"[^\w-]", "", markup).lower()
            help = help.replace("note", word or "note")
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
        help = help + escaping if likely in (None, key) else f"did you mean `{likely}`?"
        return diagnose("binding-attribute", span, message, help=help)
    if before == "$":
        help = 'write `{symbol="what it stands for" unit="m/s"}`' + escaping
        message = f"`{shorten(markup)}` says nothing about the formula before it"
        return diagnose("symbol-attribute", span, message, help=help)
    if before not in ("]", ")"):
        return None
    message = f"`{shorten(markup)}` would be shown as written: "
    if before == "]":
        message += "the only attribute of words in brackets is `{term}`"
        return diagnose("term-attribute", span, message, help="write `[word]{term}`" + escaping)
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

    What ends with punctuation, or is repeated again and again, is meant.
    """
    for line in re.finditer(r"^\S.{23,}", content.text, re.MULTILINE):
        at = line[0].find(line[0][:12], 12)
        half = re.sub(r"(?:[-*+>]|#+|\d+\.) ?\Z", "", line[0][: max(at, 0)])
        is_begun = re.search(r"[^\W\d_]{2,} \S", half) and not re.search(r"[.,:;!?]\W*\Z", half)
        if is_begun and line[0].startswith(half, at) and line[0].count(half.rstrip()) == 2:
            span = content.span(line.start() + at, line.start() + at + len(half))
            message = f"`{shorten(half)}` stands here twice"
            yield diagnose("text-repeated", span, message, help="delete it once")


def check_inline_code(content: Excerpt, start: int, end: int, code: str) -> Iterator[Diagnostic]:
    """Report code in a line that another tool would compute, or whose backticks are misplaced."""
    text, span = content.text, content.span(start, end)
    fence = re.match(r"``(\w+)[^`\n]*\n", text[start:end])
    if fence is not None and is_known_kind(fence[1]):
        message = f"a block of kind `{fence[1]}` does not begin here: there are two backticks"
        opening = content.span(start, start + len(fence[0].rstrip()))
        yield diagnose("markup-unread", opening, message, help=BROKEN["fence"].help)
    if _CELL.match(code):
        message = f"`{shorten(code)}` is shown, and not computed"
        help = "show the value, bound to what a script printed: `` `4.47`{out} ``"
        yield diagnose("markup-foreign", span, message, help=help)
    is_cut = code.startswith("<") and not code.endswith(">")
    value = _OPEN_VALUE.search(code) if code.count('"') % 2 and not is_cut else None
    if _ATTRIBUTE.search(code) and not is_cut:
        value = value or _NO_EQUALS.search(_ATTRIBUTE.sub("", code))
    if value := value or _LATE_QUOTE.search(code) or _LONE_DASH.fullmatch(code):
        message = f'the value of `{value[1]}` does not stand between `="` and `"`'
        help = f'write `{value[1]}="…"`'
        yield diagnose("markup-unread", span, message, help=help)
    rest = code if re.fullmatch(r"[A-Za-z][\w.()\[\]{}:-]+", code) else ""
    while (shorter := _PAIR.sub(lambda pair: "_" * len(pair[0]), rest)) != rest:
        rest = shorter
    if bracket := re.search(r"(?<=\w)[()\[\]{}](?=\w)", rest):
        message = f"`{bracket[0]}` has no bracket that belongs to it"
        yield diagnose("markup-unread", span, message, help="write the other one, or a blank")
    # A letter and a backtick change places easily, as in "i`mpratio`" and "`body_mass `while".
    letter, first = _LETTER_BEFORE.search(text, max(start - 2, 0), start), start - 1
    if letter is None and text[start:end].endswith(" `"):
        letter, first = _LETTER_AFTER.match(text, end), start
    if letter is not None:
        message = f"`{letter[0]}` stands directly beside a backtick that begins or ends code"
        help = "move the backtick, or write a blank between them"
        place = content.span(min(first, letter.start()), letter.end())
        yield diagnose("markup-unread", place, message, help=help)
    elif _PROSE.match(text, start, end):
        message = f"`{shorten(code)}` would be shown as code, and begins or ends as prose does"
        help = "a backtick is missing or is one too many, here or before it in the paragraph"
        yield diagnose("markup-unread", span, message, help=help)


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

_LANGUAGES = tuple(
    "bash console cpp css diff html ini javascript json julia markdown matlab python rust sh text "
    "toml xml yaml".split()
)
"""Languages that texts often show."""
_PLAIN_TEXTS = ("ascii", "ino", "jsonc", "hjson", "none", "plain", "plaintext", "raw", "txt")
"""Names of ordinary code and text that no highlighter knows."""

_FOREIGN_KINDS = {"math": "a formula on a line of its own stands between two `$$`"}
"""Kinds of blocks that other tools read, with what to write here."""

_OBJECT = re.compile(r'\s*\{\s*"[^"\n]*"\s*:[\s\S]*\}\s*\Z')
"""A JSON object, perhaps with mistakes."""


def is_known_kind(kind: str) -> bool:
    """Whether a block of a kind is more than code to be shown."""
    return kind in CORE_FENCES or kind in fence_names()


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
        help = "a script is a block of kind `python`"
        yield diagnose("script-kind", kind.span(), message, help=help)
    elif name in _FOREIGN_KINDS or name.startswith("{"):
        message = f"a block of kind `{kind.text}` is shown as code here"
        yield diagnose("markup-foreign", kind.span(), message, help=_help_with_foreign(name))
    elif "=" in name:
        message = f"the kind of this block is missing before `{kind.text}`"
        help = "the first word says what a block is, as in ```` ```python file=examples/a.py ````"
        yield diagnose("fence-info", kind.span(), message, help=help)
    elif (likely := _find_misspelt(name, kinds)) is not None:
        message = f"`{kind.text}` is not a known kind of block"
        help = f"did you mean `{likely}`?"
        yield diagnose("fence-kind-near", kind.span(), message, help=help)
    elif not package and (diagnostic := _check_unread_json(fence)) is not None:
        yield diagnostic


def _help_with_foreign(name: str) -> str:
    """What to write in place of a kind that other tools read."""
    language = name.strip("{}=. ")
    if name in _FOREIGN_KINDS:
        return _FOREIGN_KINDS[name]
    if is_known_kind(language):
        example = " file=examples/….py" if language == "python" else ""
        return f"write ```` ```{language}{example} ````"
    if language and _is_language(language):
        return f"code to be shown is of kind `{language}`; scripts are in Python"
    return "a callout is a quotation: `> [!note]`, and `> ` before each line"


def _find_misspelt(name: str, kinds: Sequence[str]) -> str | None:
    """The kind for which a name was surely meant; no name of a language is taken for another."""
    if name == "simlab":
        return "lab simlab"
    if name in kinds:
        return name
    likely = misspelt(name, kinds) or misspelt(name, _LANGUAGES)
    return None if likely is None or _is_language(name) else likely


def _check_unread_json(fence: Fence) -> Diagnostic | None:
    """Report a JSON object in a block without a kind, or of one that no highlighter knows."""
    if not _OBJECT.match(fence.body.text) or (fence.kind and _is_language(fence.kind)):
        return None
    help = "a lab is of kind `lab`, a quiz of kind `quiz`; JSON to be shown is of kind `json`"
    if not fence.kind:
        message = "nothing reads a block without a kind, and this one holds JSON"
        return diagnose("fence-unread", fence.head, message, help=help)
    message = f"nothing reads a block of kind `{fence.kind}`: its JSON is shown as code"
    return diagnose("fence-unread", kind_of(fence.info).span(), message, help=help)


def _is_language(name: str) -> bool:
    """Whether a kind is a language that is highlighted, or plain text."""
    from pygments.lexers import find_lexer_class_by_name  # slow to import, and rarely needed
    from pygments.util import ClassNotFound

    try:
        return find_lexer_class_by_name(name) is not None
    except ClassNotFound:
        return name.lower() in _PLAIN_TEXTS
