"""What is made of the tool's own files, and small findings, kept in the store from run to run.

Entry points: `CompiledTemplates`, `words_for`; `KeptBindings`.
"""

from __future__ import annotations

import hashlib
import json

from coursebuild.effects.prepared import prepared_template
from coursebuild.effects.store import Store
from coursebuild.effects.tool import tool_digest
from coursebuild.render.strings import Strings

_TEMPLATES, _WORDS, _BINDINGS = "templates", "words", "bindings"


class CompiledTemplates:
    """The code that templates were compiled to, in the store."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def load(self, name: str) -> bytes | None:
        """The code of a template, by a name that says all that it depends on but the tool."""
        return None if self._store.fresh else self._store.peek(_TEMPLATES, self._key(name))

    def generated(self, name: str) -> str | None:
        """The Python of a template, where that came with the tool."""
        return prepared_template(name)

    def keep(self, name: str, data: bytes) -> None:
        """Keep the code of a template."""
        self._store.keep(_TEMPLATES, self._key(name), data, packed=True)

    def _key(self, name: str) -> str:
        return hashlib.sha256(f"{tool_digest()}\0{name}".encode()).hexdigest()


def words_for(store: Store, texts: tuple[tuple[str, str], ...], language: str) -> Strings:
    """The interface's words in a language, by the texts of the tool's files."""
    key = hashlib.sha256(f"{tool_digest()}\0{language}".encode()).hexdigest()
    data = None if store.fresh else store.peek(_WORDS, key)
    if data is not None:
        return Strings.of(json.loads(data), language)
    from coursebuild.render.assets import strings_for

    words = strings_for(texts, language)
    store.keep(_WORDS, key, json.dumps(dict(words.entries)).encode(), packed=True)
    return words


class KeptBindings:
    """Bound numbers in which nothing is wrong, by a hash of all that this depends on.

    Those of the last run are kept, and no others.
    """

    def __init__(self, store: Store) -> None:
        self._store = store
        self._key = hashlib.sha256(f"bindings\0{tool_digest()}".encode()).hexdigest()
        data = None if store.fresh else store.peek(_BINDINGS, self._key)
        self._before = frozenset(data.decode("ascii").split()) if data is not None else frozenset()
        self._now: set[str] = set()

    def __contains__(self, key: str, /) -> bool:
        """Whether nothing was wrong in the last run."""
        if key in self._before:
            self._now.add(key)
            return True
        return False

    def add(self, key: str, /) -> None:
        """That nothing is wrong."""
        self._now.add(key)

    def save(self) -> None:
        """Keep what was found."""
        if self._now != self._before:
            data = " ".join(sorted(self._now)).encode("ascii")
            self._store.keep(_BINDINGS, self._key, data, packed=True)
