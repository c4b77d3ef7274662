"""What words of inline code without the shape of a name were meant for, where they are slips.

Most of these words are no names at all: so only what differs from one as a hand slips is told.
"""

from __future__ import annotations

import builtins
import functools
import keyword
import re
from collections import Counter
from collections.abc import Callable, Collection

from coursebuild.core.model import Course
from coursebuild.core.text.diagnostics import is_one_edit, propose, slips_of
from coursebuild.features.names import claims
from coursebuild.features.names.claims import CodeNames, course_names
from coursebuild.features.names.known_names import (
    Answer,
    EngineNames,
    Unknown,
    known_keys,
    options_by_command,
)


class Guesses:
    """What words of a course may mean."""

    def __init__(
        self,
        course: Course,
        engine: EngineNames | None,
        words: frozenset[str],
        imports: dict[str, str],
        files: frozenset[str],
        is_known_path: Callable[[str, CodeNames], bool],
        *,
        has_engine: bool,
    ) -> None:
        """`words` are those of all code, `imports` and `files` those of the course."""
        self.course, self.engine, self.has_engine = course, engine, has_engine
        self.words, self.imports, self.files = words, imports, files
        self.file_names = frozenset(path.rpartition("/")[2] for path in files)
        self.modules = {module.split(".")[0] for module in imports.values()}
        self.is_known_path = is_known_path
        self.language = course.language.partition("-")[0]
        self._names_by_page: dict[int, frozenset[str]] = {}

    @functools.cached_property
    def uses(self) -> Counter[str]:
        """How often inline code has each word and each token that may be no name."""
        uses = (claim for names in course_names(self.course) for claim in names.claims)
        return Counter(claim.name for claim in uses if claim.kind in ("plain", "token"))

    @functools.cached_property
    def plain_words(self) -> dict[str, int]:
        """Words without the shape of a name, each with the least length that is telling."""
        uses, engine = self.uses, self.engine
        common_words = {*known_keys(), *self.imports, *options_by_command(), *keyword.kwlist}
        common_words |= {"jupyter", "pytest", "python", "python3"}
        common_words.update(part for module in self.imports.values() for part in module.split("."))
        common_words.update(vars(builtins), *(() if engine is None else engine.modules.values()))
        own_words = {*self.words, *self.file_names}
        own_words.update(word for word, count in uses.items() if count > 1)
        frequent_words = {word for word, count in uses.items() if count > 4 and len(word) > 3}
        engine_words = engine.words if engine is not None and self.has_engine else ()
        sets = ((common_words, 6), (own_words, 4), (engine_words, 4), (frequent_words, 3))
        return {word: length for words, length in sets for word in words}

    @functools.cached_property
    def long_words(self) -> frozenset[str]:
        """Names of MuJoCo, and words that the course often has as code; shorter with a digit."""
        words = {word for word, count in self.uses.items() if count > 2}
        if self.engine is not None and self.has_engine:
            words |= self.engine.words
        return frozenset(w for w in words if len(w) > 6 or (re.search("[0-9]", w) and len(w) > 3))

    def torn(self, torn: str, names: CodeNames) -> Answer:
        """A name of which a backtick stands before the last letters, as in "`Eule`r"."""
        name, tail = torn.split(" ")
        whole, words = name + tail, self.plain_words.keys() | names.words
        language = self.language
        is_ending = tail in claims.ENDINGS.get(language, claims.ENDINGS["en"])
        if whole in words and not (is_ending and name in words):
            message = f"`{name}` and the letters after its backtick are the name `{whole}`"
            return Unknown(message, f"did you mean `{whole}`?", name)
        is_vague = len(name) < 2 or (len(tail) > 1 and language != "en")
        if is_ending or is_vague or language not in claims.ENDINGS:
            return None
        message = f"`{tail}` stands directly behind a backtick, and is no ending of a word"
        return Unknown(message, "move the backtick, or write a blank between them", name)

    def plain(self, name: str, names: CodeNames) -> Answer:
        """A word that is no name, or one but for a slip."""
        lengths, is_constant = self.plain_words, name.isupper()
        is_initials = is_constant and len(name) < 7 and name.isalpha()
        if name in lengths or name in names.words or is_initials:
            return None
        page_names = self._page_names(names) if self.engine is not None or len(name) > 4 else ()
        near = {word for word in page_names if is_one_edit(name, word)}
        if name.startswith("_"):  # it may be private, or have changed places with a letter
            near = {word for word in near if sorted(word) == sorted(name)}
            return self._propose(name, near)
        # Of 20,000 usual words some 500 differ by a letter from a name, as `weight` does;
        # none by the key beside from one that is used often. Other languages have longer ones.
        slips = {slip.upper() for slip in slips_of(name.lower())} if is_constant else slips_of(name)
        engine_words = self.engine.words if self.engine is not None and self.has_engine else ()
        is_english = self.language == "en"
        near |= {
            word
            for word in slips
            if len(word) >= lengths.get(word, len(word) + 1)
            # `fields` is no slip of `hfields`
            and (
                sorted(word) == sorted(name)
                or word[0] == name[0]
                or len(word) > 7
                or self.uses[word] > 1
            )
            and (
                sorted(word) == sorted(name)
                or (is_english and (len(word) > 6 or re.sub(r"(.)\1", r"\1", name) == word))
                or (
                    (is_english and len(word) == len(name) > 4)
                    and (self.uses[word] > 2 or (word in engine_words and word in self.words))
                )
            )
        }
        if is_english and name.isascii() and (len(name) > 5 or re.search("[0-9]", name)):
            letters = ("", *"abcdefghijklmnopqrstuvwxyz_")
            words = {name[:n] + x + name[n + 1 :] for n in range(1, len(name) - 1) for x in letters}
            near |= words & self.long_words
        return self._propose(name, near)

    def _propose(self, name: str, near: Collection[str]) -> Answer:
        if (likely := min(near, default=None)) is None:
            return None
        message = f"nothing that the course knows is called `{name}`"
        return Unknown(message, propose(name, likely), name)

    def _page_names(self, names: CodeNames) -> frozenset[str]:
        """The names of a document, of three letters or more, for which others may be slips."""
        key = id(names)
        if key not in self._names_by_page:
            words = {*names.words, *names.definitions, *names.imports}
            words.update(part for module in names.imports.values() for part in module.split("."))
            for claim in names.claims:
                if claim.kind not in claims.GUESSES:
                    words.update(re.findall(r"\w+", claim.name))
                elif claim.kind == "plain" and claim.name in self.plain_words:
                    words.add(claim.name)
            self._names_by_page[key] = frozenset(word for word in words if len(word) > 2)
        return self._names_by_page[key]

    def token(self, name: str, names: CodeNames) -> Answer:
        """A token that is another one of the course but for a slip in or beside a word."""
        if self.uses[name] > 1:
            return None
        message = f"nothing that the course knows is called `{name}`"
        sign = re.fullmatch(r"([\w./-]*)(?:([\\<;,]|(?<=.)['\[\]])([\w./-]*\w)|[\\'´])", name)
        if sign is not None:  # it took the place of a letter, or came beside one
            head, tail = sign[1], sign[3] or ""
            lengths = {len(name), len(name) - 1} if head and tail else {len(name) - (not tail)}
            candidates = self._page_names(names) | self.files | self.file_names | self.long_words
            likely = (c for c in candidates if c.startswith(head) and c.endswith(tail))
            if fitting := sorted(c for c in likely if len(c) in lengths):
                return Unknown(message, f"did you mean `{fitting[0]}`?", name)
        path = re.sub(r"^(\w+)\.\.(?=\w)", r"\1.", name)
        if path != name and self.is_known_path(path, names):
            return Unknown(message, f"did you mean `{path}`?", name)
        words = [word.span() for word in re.finditer("[A-Za-z_]{4,}", name)]
        for candidate in slips_of(name):
            is_word = len(candidate) > 5 and candidate in self.plain_words
            is_file = candidate in self.files or candidate in self.file_names
            root, dot, _ = candidate.partition(".")
            is_path = bool(dot) and root in self.modules and self.is_known_path(candidate, names)
            if is_word or is_file or is_path or self.uses[candidate] > 1:
                pairs = enumerate(zip(name, candidate, strict=False))
                at = next((n for n, (a, b) in pairs if a != b), len(name))
                if any(start - 1 <= at <= end + 1 for start, end in words):
                    return Unknown(message, f"did you mean `{candidate}`?", name)
        return None

    def half(self, text: str) -> Answer:
        """An element of which a bracket is lost or another key, or has a sign for a letter."""
        name, sign = re.sub(r"\W", "", text.split()[0]), re.fullmatch(r"<(\w*)[^\w/](\w*)>", text)
        pattern = f"{sign[1]}.?{sign[2]}" if sign else f"{name}|{name[1:]}"
        elements = set() if self.engine is None or not self.has_engine else self.engine.elements
        element = next((word for word in sorted(elements) if re.fullmatch(pattern, word)), None)
        if element is None:
            return None
        return Unknown(f"`{text}` is not a whole tag", f"did you mean `<{element}>`?", text)

    def value(self, value: str) -> Answer:
        """The value of an attribute of MJCF, as in `angle="raadian"`."""
        keywords = set() if self.engine is None or not self.has_engine else self.engine.keywords
        if value in keywords or value in self.words:
            return None
        likely = min((word for word in keywords if is_one_edit(value, word)), default=None)
        if likely is None:
            return None
        message = f"`{value}` is no keyword of MuJoCo, and nothing of the course is called so"
        return Unknown(message, f"did you mean `{likely}`?", value)
