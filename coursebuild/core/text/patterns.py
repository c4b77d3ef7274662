"""Regular expressions that authors write, searched for in a time that grows with the text only.

This is what RE2 does, which knows no lookaround, back-reference or possessive quantifier.
"""

from __future__ import annotations

import re
import warnings
from typing import Any


def replacements(pattern: str, replacement: str, text: str) -> dict[tuple[int, int], str]:
    """The replacement of each match, by its start and end, in order; `^` and `$` match at lines."""
    # RE2's package would misread what is not ASCII, and finds some empty matches twice.
    template = replacement.encode("ascii", "backslashreplace").decode()
    return {match.span(): match.expand(template) for match in _compile(pattern).finditer(text)}


def makes_alike(pattern: str, replacement: str, texts: tuple[str, str]) -> bool:
    """Whether texts that differ are the same after the replacement of all matches."""
    template = replacement.encode("ascii", "backslashreplace").decode()
    return len({_compile(pattern).sub(template, text) for text in texts}) == 1


def _compile(pattern: str) -> Any:
    import re2

    options = re2.Options()
    options.log_errors = False
    return re2.compile(f"(?m){pattern}", options)


def pattern_mistake(pattern: str, replacement: str = "") -> tuple[str, int | None] | None:
    """Why a regular expression or its replacement cannot be used, and at which character."""
    import re2

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            re.compile(pattern)  # its messages say at which character
        regex = _compile(pattern)
        names = {number: f"?P<{name}>" for name, number in regex.groupindex.items()}
        groups = "".join(f"({names.get(n + 1, '')})" for n in range(regex.groups))
        re.sub(groups, replacement, "")
    except RecursionError:
        return "it nests too deep", None
    except re2.error as error:
        return f"RE2 says: {error.args[0].decode()}", None
    except (re.error, ValueError, OverflowError, IndexError) as error:
        text, position = (
            (error.msg, error.pos) if isinstance(error, re.error) else (str(error), None)
        )
        return text[:1].lower() + text[1:], position
    return None
