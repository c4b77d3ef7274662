"""Resolves the names in inline code: what each one means, or why there is nothing of that name.

Entry point: `resolver_of` a course. Its answer `None` means that nobody can say: the name belongs
to something that is read nowhere, such as another program.
"""

from __future__ import annotations

import builtins
import functools
import re
from collections.abc import Iterable

from coursebuild import MANUAL
from coursebuild.core.model import Course, document_scripts
from coursebuild.core.model.addresses import line_anchor
from coursebuild.core.syntax.html import ELEMENTS
from coursebuild.core.text.diagnostics import (
    did_you_mean,
    misspelt,
    nearest,
    propose,
)
from coursebuild.features.names import claims, known_names
from coursebuild.features.names.claims import ENGINE_WORD, Claim, CodeNames, course_names
from coursebuild.features.names.guesses import Guesses
from coursebuild.features.names.known_names import (
    ITEM_CLASSES,
    Answer,
    EngineName,
    EngineNames,
    EngineTable,
    KnownName,
    Unknown,
    class_href,
    element_href,
    find_engine_name,
    known_keys,
)

_MANUAL_ID = "coursebuild-manual"
"""The id of the manual, in docs/content/course.toml."""
_ROOTS = {"model": "MjModel", "data": "MjData", "opt": "MjOption", "spec": "MjSpec"}
"""The classes of variables by their usual names."""
_HTML = ELEMENTS | frozenset(
    "body button canvas form head html iframe input label legend link main meta object optgroup "
    "option output script select style template textarea".split()
)
_resolvers: list[Resolver] = []
"""The one that was asked last."""


def resolver_of(course: Course) -> Resolver:
    """Return the resolver of a course, which pages and checks share."""
    if not _resolvers or _resolvers[0].course is not course:
        _resolvers[:] = [Resolver(course)]
    return _resolvers[0]


def _propose(name: str, names: Iterable[str]) -> str:
    """Propose the nearest name, if one is near; only those of about its length are compared."""
    similar = {candidate for candidate in names if abs(len(candidate) - len(name)) <= 2}
    likely = nearest(name, similar, cutoff=0.8)
    return propose(name, likely) if likely else ""


class Resolver:
    """Resolves the names of a course."""

    def __init__(self, course: Course, engine: EngineNames | None = None) -> None:
        self.course = course
        table = course.references.get("names")
        self.engine = table.names if not engine and isinstance(table, EngineTable) else engine

    @functools.cached_property
    def guesses(self) -> Guesses:
        """What words mean that have not the shape of a name."""
        return Guesses(
            self.course,
            self.engine,
            self.words,
            self.imports,
            self.files,
            self._is_known_path,
            has_engine=self.has_engine,
        )

    def _is_known_path(self, path: str, names: CodeNames) -> bool:
        is_path = all(part.isidentifier() for part in path.split("."))
        return is_path and isinstance(self._path(path, names), KnownName)

    @functools.cached_property
    def words(self) -> frozenset[str]:
        """The words of all code of the course."""
        course = self.course
        words = {model.name for model in course.models} | {p.path for p in course.packages}
        return frozenset(words).union(
            *(claims.words_of(model.source.text) for model in course.models),
            *(names.words | names.definitions.keys() for names in course_names(course)),
        )

    @functools.cached_property
    def imports(self) -> dict[str, str]:
        """What scripts import, by the names that they agree on; a text may use these anywhere."""
        imports: dict[str, str] = {"mujoco": "mujoco", "np": "numpy"}
        for names in course_names(self.course):
            for name, module in names.imports.items():
                imports[name] = module if imports.get(name, module) == module else ""
        return imports

    @functools.cached_property
    def has_engine(self) -> bool:
        """Whether the course is about MuJoCo, so that `model` and `data` are its structures."""
        if self.course.models or self.course.engine:
            return True
        documents = course_names(self.course)
        modules = {module for names in documents for module in names.imports.values()}
        uses = (claim for names in documents for claim in names.claims if claim.kind == "word")
        return any(module.split(".")[0] == "mujoco" for module in modules) or any(
            ENGINE_WORD.fullmatch(claim.name) for claim in uses
        )

    def resolve(self, claim: Claim, names: CodeNames) -> Answer:
        """What a name in a document means."""
        match claim.kind:
            case "word" | "call":
                return self._word(claim, names)
            case "path":
                return self._path(claim.name, names)
            case "element":
                return self._element(claim.name)
            case "attribute":
                return self._attribute(*claim.name.split(" "))
            case "command":
                return known_names.resolve_command(self._manual("commands"), claim.name)
            case "option":
                return known_names.resolve_option(self._manual("commands"), *claim.name.split(" "))
            case "table":
                return known_names.resolve_table(self._manual("course-map"), *claim.name.split(" "))
            case "file":
                return self._file(claim.name)
            case "value":
                return self.guesses.value(claim.name)
            case "plain":
                return self.guesses.plain(claim.name, names)
            case "token":
                return self.guesses.token(claim.name, names)
            case "half":
                return self.guesses.half(claim.name)
            case "torn":
                return self.guesses.torn(claim.name, names)

    # --- Python

    def _word(self, claim: Claim, names: CodeNames) -> Answer:
        name, engine = claim.name, self.engine
        if name in names.definitions:
            return KnownName(f"#{line_anchor(*names.definitions[name])}", name)
        if name in names.imports or hasattr(builtins, name):
            return KnownName()
        meaning = None if engine is None else find_engine_name(engine, name)
        if meaning is not None:
            return meaning
        if engine is not None and name in engine.words:
            return KnownName()
        if engine is not None and ENGINE_WORD.fullmatch(name):
            engine_words = {*engine.functions, *engine.constants, *engine.enums, *engine.enum_of}
            engine_words |= {*engine.classes}
            message = f"MuJoCo {engine.version} has no `{name}`"
            return Unknown(message, did_you_mean(name, engine_words), name)
        if name in self.words or name in known_keys():
            return KnownName()
        is_vague = claim.kind == "call" or name.isupper()  # prose, or an environment variable
        if is_vague and (len(name) < 4 or misspelt(name, names.definitions) is None):
            return None
        candidates = {*self.words, *known_keys(), *(() if engine is None else engine.words)}
        message = f"nothing that the course knows is called `{name}`"
        return Unknown(message, _propose(name, candidates), name)

    def _path(self, path: str, names: CodeNames) -> Answer:
        parts = [re.sub(r"[()\[\]]+", "", part) for part in path.split(".")]
        root, engine = parts[0], self.engine
        if engine is None:
            return None
        class_name = self._class_of(root, names)
        if class_name:
            return self._member(class_name, path.split(".")[1:])
        module = names.imports.get(root) or self.imports.get(root, "")
        if module:
            return self._module_member(module, path.split(".")[1:], names)
        class_name = f"M{root[1:]}" if root.startswith("mj") else root
        if class_name in engine.classes:
            return self._member(class_name, path.split(".")[1:])
        if root in engine.enums:
            if parts[1] in engine.enums[root]:
                return find_engine_name(engine, parts[1])
            help = did_you_mean(parts[1], engine.enums[root])
            return Unknown(f"`{root}` has no member `{parts[1]}`", help, parts[1])
        if root in names.definitions or root in names.words:
            return None
        likely = misspelt(root, (*_ROOTS, "mujoco")) if self.has_engine else None
        if likely is not None and isinstance(
            self._path(path.replace(root, likely, 1), names), KnownName
        ):
            message = f"nothing that the course knows is called `{root}`"
            return Unknown(message, propose(root, likely), root)
        if ENGINE_WORD.fullmatch(root):
            message = f"MuJoCo {engine.version} has no `{root}`"
            return Unknown(message, did_you_mean(root, engine.classes), root)
        head, _, tail = path.partition(".")
        for candidate in (f"{head[:-1]}.{head[-1]}{tail}", f"{head}{tail[0]}.{tail[1:]}"):
            is_likely = candidate.partition(".")[0] in _ROOTS
            if is_likely and isinstance(self._path(candidate, names), KnownName):
                message = f"nothing that the course knows is called `{root}`"
                return Unknown(message, f"did you mean `{candidate}`?", root)
        return None

    def _class_of(self, root: str, names: CodeNames) -> str:
        """The class of MuJoCo of which a variable is; empty if it is of none."""
        if root in names.variables:
            return names.variables[root]
        class_name = _ROOTS.get(root, "") if self.has_engine else ""
        if not class_name or self.engine is None or root in names.imports:
            return ""
        attributes = names.members.get(root, frozenset())
        return class_name if attributes <= self.engine.classes.get(class_name, {}).keys() else ""

    def _member(self, class_name: str, parts: list[str]) -> Answer:
        """What a path means that begins at an object of a class of MuJoCo."""
        assert self.engine is not None
        member: EngineName | None = None
        first_class = class_name
        for part in parts:
            members = self.engine.classes.get(class_name)
            name = re.sub(r"[()\[\]]+", "", part)
            if not members:
                break
            member = members.get(name)
            if member is None:
                message = f"`{class_name}` of MuJoCo {self.engine.version} has no `{name}`"
                return Unknown(message, did_you_mean(name, members), name)
            class_name = member.type
            if class_name.endswith("List"):
                class_name = ITEM_CLASSES.get(class_name, "") if "[]" in part else ""
        if member is None:
            return None
        href = class_href(self.engine, first_class)
        return KnownName(href, member.text, member.doc, member.extent, engine=True)

    def _module_member(self, module: str, parts: list[str], names: CodeNames) -> Answer:
        engine = self.engine
        assert engine is not None
        for number, part in enumerate(parts):
            name = re.sub(r"[()\[\]]+", "", part)
            if module == "mujoco":
                if name in engine.classes:
                    rest = parts[number + 1 :]
                    href = class_href(engine, name)
                    return self._member(name, rest) if rest else KnownName(href, name, engine=True)
                if name in engine.enums and parts[number + 1 :]:
                    return self._path(".".join(parts[number:]), names)
                meaning = find_engine_name(engine, name)
                if meaning is not None:
                    return meaning
            module_names = engine.modules.get(module)
            if module_names is None or (name not in module_names and "*" in module_names):
                return None
            if name not in module_names:
                is_engine = module == "mujoco"
                label = f"MuJoCo {engine.version}" if is_engine else f"the module `{module}`"
                return Unknown(f"{label} has no `{name}`", did_you_mean(name, module_names), name)
            module = f"{module}.{name}"
        return KnownName()

    # --- MJCF

    def _element(self, name: str) -> Answer:
        engine = self.engine
        if engine is None or not self.has_engine:
            return None
        if name in engine.elements:
            return KnownName(element_href(engine, name), f"<{name}>", engine=True)
        if name in _HTML or name in self.words:
            return None
        message = f"MJCF of MuJoCo {engine.version} has no element `<{name}>`"
        return Unknown(message, did_you_mean(name, engine.elements), name)

    def _attribute(self, element: str, name: str) -> Answer:
        engine = self.engine
        if engine is None or not self.has_engine or (element and element not in engine.elements):
            return None
        if element:
            attributes = {name for places in engine.elements[element].values() for name in places}
            if name in attributes:
                return KnownName(element_href(engine, element, name), name, engine=True)
            if element in _HTML:
                return None
            message = f"`<{element}>` of MuJoCo {engine.version} has no attribute `{name}`"
            return Unknown(message, did_you_mean(name, attributes), name)
        if name in engine.attributes:
            return KnownName(engine=True, text=name)
        likely = nearest(name, engine.attributes, cutoff=0.75)
        if name in self.words or likely is None or name in known_keys():
            return None
        message = f"no element of MuJoCo {engine.version} has an attribute `{name}`"
        return Unknown(message, propose(name, likely), name)

    # --- coursebuild and the course

    def _manual(self, page: str) -> str:
        """A page of the manual: in the manual's own course its file, else its address if known."""
        path = f"reference/{page}.md"
        if self.course.id == _MANUAL_ID and any(p.path == path for p in self.course.pages):
            return path
        return MANUAL and f"{MANUAL}{page}.html"

    def _file(self, path: str) -> Answer:
        if path in self.files:
            return KnownName(f"#{path}" if path.startswith("examples/") else "")
        is_of_course = re.match("(?:content|examples|models)/", path)
        if is_of_course is None and misspelt(path, self.files) is None:
            return None
        help = _propose(path, self.files) or "write it, or say `{code}` after the name"
        return Unknown(f"the course has no file `{path}`", help, path)

    @functools.cached_property
    def files(self) -> frozenset[str]:
        """The files that the course has."""
        course = self.course
        scripts = (s.path for document in course.documents for s in document_scripts(document))
        sources = (source.path for source in course.sources)
        return frozenset((*course.files, *scripts, *sources, *(p.path for p in course.lessons)))
