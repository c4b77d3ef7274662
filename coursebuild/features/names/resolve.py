"""What a name in inline code means, and where it certainly means nothing.

A name is a claim where all names are known that could stand in its place: after a variable that the
scripts of its page make a structure of MuJoCo, as a function of MuJoCo with brackets, in MJCF that
begins with its root, behind `coursebuild`, in a link to a script. Any other name may be of a file
or a library that nobody here knows.
"""

from __future__ import annotations

import functools
import re

from coursebuild import MANUAL
from coursebuild.api import Course, did_you_mean, document_scripts, regex
from coursebuild.core.model import Script
from coursebuild.core.model.addresses import line_anchor
from coursebuild.features.names import known_names
from coursebuild.features.names.claims import ENGINE_WORD, Claim, DocumentNames, course_names
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
    unknown,
)

_MANUAL_ID = "coursebuild-manual"
"""The id of the manual, in docs/content/course.toml."""
_ROOTS = {"model": "MjModel", "data": "MjData", "opt": "MjOption", "spec": "MjSpec"}
"""The classes of variables by their usual names, for links."""
_FUNCTION = regex(r"mj[ud]?_[A-Za-z][A-Za-z0-9]*")
"""How the names of functions begin that only MuJoCo has."""
_BRACKETS = regex(r"[()\[\]]+")
_resolvers: list[Resolver] = []
"""The one that was asked last."""


def resolver_of(course: Course) -> Resolver:
    """Return the resolver of a course, which pages and checks share."""
    if not _resolvers or _resolvers[0].course is not course:
        _resolvers[:] = [Resolver(course)]
    return _resolvers[0]


class Resolver:
    """Resolves the names of a course."""

    def __init__(self, course: Course, engine: EngineNames | None = None) -> None:
        self.course = course
        table = course.references.get("names")
        self.engine = table.names if not engine and isinstance(table, EngineTable) else engine

    @functools.cached_property
    def has_engine(self) -> bool:
        """Whether the course is about MuJoCo, so that `model` and `data` may be its structures."""
        if self.course.models or self.course.engine:
            return True
        return any(
            any(module.split(".")[0] == "mujoco" for module in names.imports.values())
            or any(c.kind == "word" and ENGINE_WORD.fullmatch(c.name) for c, _, _ in names.claims)
            for names in course_names(self.course)
        )

    @functools.cached_property
    def scripts(self) -> dict[str, Script]:
        """The scripts of the course, by their paths."""
        documents = self.course.documents
        return {s.path: s for document in documents for s in document_scripts(document)}

    def resolve(self, claim: Claim, names: DocumentNames) -> Answer:
        """What a name in a document means."""
        match claim.kind:
            case "word":
                return self._word(claim.name, names)
            case "call":
                return self._word(claim.name, names) or self._function(claim.name)
            case "path":
                return self._path(claim.name.split("."), names)
            case "defined":
                return self._linked_name(*claim.name.split(" "))
            case "element" | "attribute":
                answer = self._mjcf(*claim.name.split(" "))
                return answer if isinstance(answer, KnownName) and self.has_engine else None
            case "mjcf":
                return self._mjcf(*claim.name.split(" "))
            case "command":
                return known_names.resolve_command(self._manual("commands"), claim.name)
            case "option":
                return known_names.resolve_option(self._manual("commands"), *claim.name.split(" "))
            case "table":
                return known_names.resolve_table(self._manual("course-map"), *claim.name.split(" "))
            case "file":
                return KnownName(f"#{claim.name}") if claim.name in self.scripts else None

    # --- Python

    def _word(self, name: str, names: DocumentNames) -> Answer:
        if name in names.definitions:
            return KnownName(f"#{line_anchor(*names.definitions[name])}", name)
        return None if self.engine is None else find_engine_name(self.engine, name)

    def _function(self, name: str) -> Answer:
        """That there is no function of MuJoCo with this name, if it has the form of one."""
        engine = self.engine
        if engine is None or not _FUNCTION.fullmatch(name):
            return None
        if name in engine.declared or name in engine.functions:
            return None
        lead = f"MuJoCo {engine.version} has no function"
        return unknown(lead, name, (*engine.functions, *engine.declared))

    def _path(self, parts: list[str], names: DocumentNames) -> Answer:
        engine, root = self.engine, _BRACKETS.sub("", parts[0])
        if engine is None:
            return None
        if class_name := names.variables.get(root, ""):
            return self._member(class_name, parts[1:])
        if root == "mujoco" or names.imports.get(root) == "mujoco":
            return self._module_member(parts[1:], names)
        if root in engine.enums and parts[1] in engine.enums[root]:
            return find_engine_name(engine, parts[1])
        class_name = f"M{root[1:]}" if root.startswith("mj") else root
        if self.has_engine and root not in names.variables and root not in names.imports:
            class_name = _ROOTS.get(root, class_name)
        answer = self._member(class_name, parts[1:])
        return answer if isinstance(answer, KnownName) else None

    def _module_member(self, parts: list[str], names: DocumentNames) -> Answer:
        """What a path means that begins at the module of MuJoCo."""
        assert self.engine is not None
        name = _BRACKETS.sub("", parts[0])
        if parts[1:] and name in self.engine.enums:
            return self._path(parts, names)
        answer = self._member(name, parts[1:]) or find_engine_name(self.engine, name)
        if answer is None and parts[0].startswith(f"{name}()"):
            return self._function(name)
        return answer if isinstance(answer, KnownName) else None

    def _member(self, class_name: str, parts: list[str]) -> Answer:
        """What a path means that begins at an object of a class of MuJoCo."""
        assert self.engine is not None
        member: EngineName | None = None
        first_class = class_name
        for part in parts:
            members = self.engine.classes.get(class_name)
            name = _BRACKETS.sub("", part)
            if not members:
                break
            member = members.get(name)
            if member is None:
                lead = f"`{class_name}` of MuJoCo {self.engine.version} has no"
                return unknown(lead, name, members)
            class_name = member.type
            if class_name.endswith("List"):
                class_name = ITEM_CLASSES.get(class_name, "") if "[]" in part else ""
        if member is None:
            return None
        href = class_href(self.engine, first_class)
        return KnownName(href, member.text, member.doc, member.extent, engine=True)

    def _linked_name(self, path: str, name: str) -> Answer:
        """Whether the script to which the name is linked has it."""
        script = self.scripts.get(path)
        if script is None:
            return None
        words = frozenset(re.findall(r"\w+", script.code.text))
        return KnownName() if name in words else unknown(f"`{path}` has no", name, words)

    # --- MJCF

    def _mjcf(self, element: str, attribute: str = "") -> Answer:
        """What an element or an attribute means; an attribute alone has an empty element."""
        engine = self.engine
        if engine is None:
            return None
        if not element:
            is_known = attribute in engine.attributes
            return KnownName(engine=True, text=attribute) if is_known else None
        if element not in engine.elements and attribute:
            return None
        if element not in engine.elements:
            message = f"MJCF of MuJoCo {engine.version} has no element `<{element}>`"
            return Unknown(message, did_you_mean(element, engine.elements), element)
        names = {name for places in engine.elements[element].values() for name in places}
        if not attribute or attribute in names:
            text = attribute or f"<{element}>"
            return KnownName(element_href(engine, element, attribute), text, engine=True)
        lead = f"`<{element}>` of MuJoCo {engine.version} has no attribute"
        return unknown(lead, attribute, names)

    # --- the manual

    def _manual(self, page: str) -> str:
        """A page of the manual: in the manual's own course its file, else its address if known."""
        path = f"reference/{page}.md"
        if self.course.id == _MANUAL_ID and any(p.path == path for p in self.course.pages):
            return path
        return MANUAL and f"{MANUAL}{page}.html"
