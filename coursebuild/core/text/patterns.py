"""Regular expressions of authors, which no text keeps busy for ever.

Entry points: `replacements`; `pattern_mistake`, `matches_nothing`.

RE2 searches for them: it never goes back, so its time grows with the text and no faster. It knows
nearly all of what Python's `re` knows, but no lookaround, back-reference or possessive quantifier.
"""

from __future__ import annotations

import re
import warnings
from typing import Any


def replacements(pattern: str, replacement: str, text: str) -> dict[tuple[int, int], str]:
    """What replaces each match, by its start and end, in order; `^` and `$` match at lines."""
    # RE2's package would misread what is not ASCII, and finds some empty matches twice.
    template = replacement.encode("ascii", "backslashreplace").decode()
    return {found.span(): found.expand(template) for found in _compiled(pattern).finditer(text)}


def matches_nothing(pattern: str) -> bool:
    """Whether a pattern matches where there is nothing."""
    return _compiled(pattern).search("") is not None


def _compiled(pattern: str) -> Any:
    import re2

    options = re2.Options()
    options.log_errors = False
    return re2.compile(f"(?m){pattern}", options)


def pattern_mistake(pattern: str, replacement: str = "") -> tuple[str, int | None] | None:
    """Why a regular expression, or a replacement for it, cannot be used, and at which character."""
    import re2

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            re.compile(pattern)  # which says at which character
        compiled = _compiled(pattern)
        names = {number: f"?P<{name}>" for name, number in compiled.groupindex.items()}
        groups = "".join(f"({names.get(n + 1, '')})" for n in range(compiled.groups))
        re.sub(groups, replacement, "")
    except RecursionError:
        return "it nests too deep", None
    except re2.error as error:
        return f"RE2 says: {error.args[0].decode()}", None
    except (re.error, ValueError, OverflowError, IndexError) as error:
        text, at = (error.msg, error.pos) if isinstance(error, re.error) else (str(error), None)
        return text[:1].lower() + text[1:], at
    return None
