"""Regular expressions that are compiled when they are first used.

Entry point: `pattern(text, flags)`, with the meaning of `re.compile` for a constant of a module.

To compile one takes as long as importing a small module, and a run uses few of those that the
modules that it imports define. What `pattern` gives has the methods and attributes of a compiled
one. It is no `re.Pattern`, so it is used by these, and not handed to the functions of `re`.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:

    def pattern(text: str, flags: int = 0) -> re.Pattern[str]:
        """A regular expression, compiled when it is first used."""
else:
    _KNOWN = tuple(name for name in dir(re.Pattern) if not name.startswith("_"))

    class _Compiled:
        """One that was used: it has the methods of what it was compiled to as its own."""

        def __repr__(self):
            return f"pattern({self.pattern!r})"

    class _Waiting(_Compiled):
        """One that was not used yet."""

        def __init__(self, text, flags):
            self._given = text, flags

        def __getattr__(self, name):
            if name not in _KNOWN:
                raise AttributeError(name)
            compiled = re.compile(*self._given)
            for known in _KNOWN:
                setattr(self, known, getattr(compiled, known))
            # Without `__getattr__`, looking up what is there is as fast as can be.
            self.__class__ = _Compiled
            return getattr(compiled, name)

    def pattern(text, flags=0):
        """A regular expression, compiled when it is first used."""
        return _Waiting(text, flags)
