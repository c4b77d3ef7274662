"""What code may notice of a model: what cannot be ruled out counts as a use.

1. Code is not interpreted, only searched for words. A thing counts as used where code has its name
   as a text, a field where its name stands anywhere, and every thing of a kind where code has the
   word that asks for one, unless a complete name follows: `model.sensor("tip")`.
2. Code that could reach a field without naming it may use everything: by reflection, by a module
   that is not known to leave models alone, by a function of MuJoCo's that does not simulate, by
   reading or including the model's file.
3. The fields that tell a smaller model from the whole one are found by comparing both: a reader
   notices it where it has one of their names. They are those that MuJoCo's structures have,
   whatever their names.
"""

from __future__ import annotations

import functools
import re
import tokenize
import unicodedata
from collections.abc import Collection, Iterator
from typing import Any

import mujoco
import numpy as np
from msgspec import Struct

_VIEW = re.compile(r"Mj(?:Model|Data)(\w+)Views")
VIEWS: dict[str, str] = {
    word: match[1]
    for structure in (mujoco.MjModel, mujoco.MjData)
    for word in dir(structure)
    if (match := _VIEW.search(getattr(structure, word).__doc__ or "")) is not None
}
"""Words by which one thing is asked for, such as `mat` and `material`, each with its kind."""
_POINTERS = frozenset(("model", "pbase", "parena", "pstack", "signature", "threadpool", "timer"))
"""Fields in which two equal states may differ."""
_LISTS = re.compile(r"n?names(_map)?|n?paths|nbuffer|narena|name_\w+adr|\w+_pathadr|n?bvh.*")
"""Fields that list the names, paths and boxes of all things, or give sizes of memory."""
_COMPUTED_IF = {
    "flg_rnepost": ("cacc", "cfrc_ext", "cfrc_int"),
    "flg_subtreevel": ("subtree_angmom", "subtree_linvel"),
}
"""Fields that are only computed where something needs them, by what says whether they are: they
may be zero in all states that are compared, as forces without a contact."""


def unrelated_fields(fields: frozenset[str], kinds: frozenset[str]) -> frozenset[str]:
    """The fields that neither belong to these kinds nor are lists nor references by number."""
    prefixes = tuple(
        start
        for prefix, size, kind in _prefixes()
        if kind in kinds
        for start in (f"{prefix}_", size)
    )
    return frozenset(
        field
        for field in fields
        if not (field.startswith(prefixes) or field.endswith("id") or _LISTS.fullmatch(field))
    )


@functools.cache
def _prefixes() -> tuple[tuple[str, str, str], ...]:
    """For each kind the prefix of its fields, the field with their number, and its name."""
    prefixes = ((word, f"n{word}", kind) for word, kind in VIEWS.items())
    return tuple(entry for entry in prefixes if hasattr(mujoco.MjModel, entry[1]))


def difference(whole: Any, variant: Any) -> frozenset[str]:
    """The fields that differ between two models, or two states."""
    rest, fields = dict(_leaves(variant)), set[str]()
    for name, value in _leaves(whole):
        twin = rest.get(name)
        if isinstance(value, np.ndarray) and isinstance(twin, np.ndarray):
            is_same = value.shape == twin.shape and value.tobytes() == twin.tobytes()
        else:
            is_same = type(value) is type(twin) and bool(value == twin)
        if not is_same:
            fields.add(name.rpartition(".")[2])
    return frozenset(fields.union(*(_COMPUTED_IF.get(field, ()) for field in fields)))


def _leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """The numbers and arrays of a structure, with those of structures in it."""
    for name in _names(type(value)):  # type: ignore[arg-type]
        try:
            inner = getattr(value, name)
        except (AttributeError, ValueError, TypeError):
            continue
        if isinstance(inner, np.ndarray | int | float | bytes):
            yield path + name, inner
        elif type(inner).__module__.startswith("mujoco"):
            yield from _leaves(inner, f"{path}{name}.")


@functools.cache
def _names(structure: type) -> tuple[str, ...]:
    names = (name for name in dir(structure) if not name.startswith("_"))
    return tuple(
        name for name in names if name not in _POINTERS and not callable(getattr(structure, name))
    )


_LEAVE_MODELS_ALONE = frozenset(
    "__future__ bisect collections colorsys copy csv dataclasses datetime decimal enum fractions"
    " functools heapq itertools json math matplotlib mjcourse mpmath mujoco numbers numpy pathlib"
    " random scipy statistics sys textwrap time typing warnings".split(" ")
)
"""Modules that read nothing from a model that they are given."""
_SIMULATION = frozenset(
    "mj_Euler mj_comPos mj_crb mj_differentiatePos mj_energyPos mj_energyVel mj_forward mj_fullM"
    " mj_fwdPosition mj_fwdVelocity mj_getState mj_integratePos mj_inverse mj_kinematics mj_mulM"
    " mj_normalizeQuat mj_resetData mj_resetDataKeyframe mj_rne mj_setConst mj_setState mj_solveM"
    " mj_stateSize mj_step mj_step1 mj_step2 mj_subtreeVel".split(" ")
)
"""Functions of MuJoCo that reveal nothing of the model as a whole. A keyframe is the only thing
that they take by its number."""
_STATE_WORDS = frozenset(
    "act ctrl eq_active history mocap_pos mocap_quat na neq nhistory nmocap npluginstate nq nu"
    " nuserdata nv plugin_state qacc_warmstart qfrc_applied qpos qvel userdata xfrc_applied".split(
        " "
    )
)
"""Fields that `mj_stateSize`, `mj_getState` and `mj_setState` read, write or count."""
_OPAQUE = frozenset(
    # reflection
    "__import__ breakpoint compile delattr dir eval exec format format_map getattr globals hasattr"
    " locals setattr vars Function Object Reflect"
    # the file of the model, or names of things
    " from_zip fromfile genfromtxt glob iterdir listdir load loadtxt memmap modules open read_bytes"
    " read_text rglob scandir st_size walk MjSpec MjvScene Renderer rollout"
    # what takes a whole model, among MuJoCo's own modules
    " experimental mjx sysid usd viewer".split(" ")
)
_THING = re.compile(r"""\w+\s*\.\s*(\w+)\(\s*(?:"[^"\\]*"|'[^'\\]*')\s*\)(?:\s*\.\s*(\w+))?""")
"""An access to one thing by its complete name, and the attribute that is read from it."""
_WHOLE = re.compile(
    r"""(?:\b(\w+)\s*=\s*)?\b\w+\s*\.\s*(?:(opt|stat)\b(?!\s*\.)"""
    r"""|(\w+)\(\s*(?:"[^"\\]*"|'[^'\\]*')\s*\)(?!\s*\.))"""
)
"""A structure, or one thing, with nothing read from it there, and the name that it is given."""
_DRIVEN = frozenset(("Body", "Joint", "Site", "Tendon"))
"""What an actuator names by its number, so that another number is noticed where it is whole."""
_STRUCTURES = {"opt": mujoco.MjOption, "stat": mujoco.MjStatistic}
_RESET = re.compile(r"""mj_resetDataKeyframe\(\w+, \w+, \w+\.key\(("[^"\\]*"|'[^'\\]*')\)\.id\)""")
"""A reset to a keyframe that is given by its complete name."""
_TEXT = re.compile(r""""((?:[^"\\\n]|\\.)*)"|'((?:[^'\\\n]|\\.)*)'|`([^`]*)`""")
_PROSE = re.compile(
    r"\"(?:[^\"\\\n]|\\.)*\"|'(?:[^'\\\n]|\\.)*'|//[^\n]*|/\*[\s\S]*?\*/|(`(?:[^`\\]|\\.)*`)"
)
"""Texts and comments of JavaScript, in which no code stands; in templates (group 1) some does."""
_FORMAT_CALL = re.compile(r"([\"'])\s*\.format\(")
"""A text that may read attributes of its arguments."""
_FUNCTION = re.compile(r"mj[dsprv]?_")
_WORD = re.compile(r"[^\W\d]\w*")
_MEMBER = re.compile(r"\.\s*([^\W\d]\w*)")
_IMPORT = re.compile(r"(?:^|[;:])\s*(?:from\s+([\w.]+)\s+import\b|import\s+([\w., ]+))", re.M)
_INCLUDE = re.compile(r"<[^>]*\bfile\s*=")
_POSITIONAL = re.compile(r"\bcase\s+\w+\(\s*\w+\s*[,)]")
_SCRIPT = re.compile(r"\bfor\s*\(\s*\w+\s+\w+\s+in\b|\.\.\.|\bimport\b|(?<![\w.])\w+\[\s*[^\W\d]")
"""JavaScript that iterates over members, or computes their names while it runs."""
_OF_BODIES = ("bodyid", "parentid", "rootid", "weldid", "treeid", "mocapid", "jntid", "dofid")
_REFERENCES = frozenset(
    name
    for name in dir(mujoco.MjModel)
    if "_" in name and name.endswith("id") and not name.endswith(_OF_BODIES)
)
"""Fields that hold numbers of things other than bodies and joints."""
_NUMBERS = frozenset(("adr", "id", "num"))
"""Attributes that may change when another thing is taken away: addresses, numbers, counts."""


class ModelReader(Struct, frozen=True):
    """A file of code, with what it may ask a model for."""

    path: str
    names: frozenset[str] = frozenset()
    """Its string literals: any may be the name of a thing."""
    words: frozenset[str] = frozenset()
    """Its words: any may be the name of a field."""
    members: frozenset[str] = frozenset()
    """Words after a dot."""
    parts: frozenset[tuple[str, str]] = frozenset()
    """Attributes read from a thing that is given by its name, each with the kind of the thing."""
    kinds: frozenset[str] = frozenset()
    """Kinds of which it may read any thing."""
    opaque: str = ""
    """Why it may use everything; empty where it does not."""

    @property
    def doubt(self) -> str:
        """That it may notice, and why where it may use everything."""
        return f"{self.path} may notice" + (f" ({self.opaque})" if self.opaque else "")

    def notices(
        self, names: Collection[str], kinds: Collection[str], change: Collection[str]
    ) -> bool:
        """Whether it may notice that things of these names and kinds are gone."""
        return bool(
            not self.names.isdisjoint(names)
            or not self.kinds.isdisjoint(kinds)
            or not self.words.isdisjoint(change)
            or not {part for _, part in self.parts}.isdisjoint(change)
            or (change and not _NUMBERS.isdisjoint(self.members | {p for _, p in self.parts}))
            or self.touches(_REFERENCES)
        )

    def touches(self, fields: Collection[str]) -> bool:
        """Whether it may change one of these fields of a model, for one thing or for all."""
        split = [field.partition("_") for field in fields]
        return bool(
            self.opaque
            or not self.words.isdisjoint(fields)
            or not self.members.isdisjoint(end for _, _, end in split)
            or not self.parts.isdisjoint((VIEWS.get(prefix, ""), end) for prefix, _, end in split)
        )


def read_code(path: str, text: str, course_modules: Collection[str] = ()) -> ModelReader:
    """What a file of Python or JavaScript asks models for.

    `course_modules`: modules that are readers themselves, so that importing one is harmless.
    """
    # A text in which fields are filled in holds others: what is asked for there counts as well.
    accesses = (match[0] for p in (_RESET, _THING, _WHOLE) for match in p.finditer(text))
    names = frozenset(
        next(filter(None, match), "") for part in (text, *accesses) for match in _TEXT.findall(part)
    )
    rest, filled = _FORMAT_CALL.subn(r"\1(", _RESET.sub("", text))
    parts = {(VIEWS[view], part) for view, part in _THING.findall(rest) if view in VIEWS}
    rest = _THING.sub(lambda match: "named" if match[1] in VIEWS else match[0], rest)
    is_python = path.endswith(".py")
    code = _python_code(rest) if is_python else _PROSE.sub(lambda m: m[1] or '""', rest)
    if is_python:  # to which letters of another width are the same
        code = unicodedata.normalize("NFKC", code)
    words = frozenset(_WORD.findall(rest if filled else code))
    if not words.isdisjoint(("mj_stateSize", "mj_getState", "mj_setState")):
        words |= _STATE_WORDS
    members = frozenset(_MEMBER.findall(code))
    opaque = sorted(filter(_may_do_anything, _WORD.findall(code)))
    reasons = [f"it uses `{opaque[0]}`"] if opaque else []
    if _INCLUDE.search(text):
        reasons.append("it assembles models from files")
    if is_python:
        harmless = _LEAVE_MODELS_ALONE.union(course_modules)
        modules = imported_modules(text)
        reasons += [f"it imports {name}" for name in modules if name not in harmless]
        reasons += ["it matches patterns by position"] if _POSITIONAL.search(text) else []
        reasons += ["it uses `bind`"] if "bind" in members else []  # to any element of a spec
    elif _SCRIPT.search(code):
        reasons.append("it lists what exists")
    kinds = {VIEWS[word] for word in members if word in VIEWS}
    # Things and structures that code may print whole, or hand on. One that only has a name is
    # looked at by its attributes, which are words themselves.
    for name, structure, view in _WHOLE.findall(text):
        is_handed_on = not name or re.search(rf"\b{name}\b(?!\s*(?:\.|=\s*[^=}}!:]))", code)
        if is_handed_on and (structure or view in VIEWS):
            words |= _fields_of(structure or view) - {"actuator_trnid"}
            kinds |= {VIEWS[view]} if view in VIEWS else set()
            kinds |= _DRIVEN if VIEWS.get(view) == "Actuator" else set()
    kinds |= {"Keyframe"} if "mj_resetDataKeyframe" in words else set()
    reason = next(iter(reasons), "")
    return ModelReader(path, names, words, members, frozenset(parts), frozenset(kinds), reason)


@functools.cache
def _fields_of(word: str) -> frozenset[str]:
    """The fields of a model and its state that a structure, or one thing, has."""
    if word in _STRUCTURES:
        return frozenset(_names(_STRUCTURES[word]))
    prefixes = [prefix for prefix, _, kind in _prefixes() if kind == VIEWS[word]]
    model_view, state_view = (
        getattr(mujoco._structs, f"_{structure}{VIEWS[word]}Views", object)
        for structure in ("MjModel", "MjData")
    )
    fields = {f"{prefix}_{name}" for prefix in prefixes for name in _names(model_view)}
    return frozenset(fields.union(_names(state_view))) - {"id", "name"}


def _python_code(text: str) -> str:
    """Python without comments and texts; where fields are filled in, a text holds code."""
    lines = text.splitlines(keepends=True)
    try:
        tokens = list(tokenize.generate_tokens(iter(lines).__next__))
    except (tokenize.TokenError, SyntaxError):
        return text  # all of it may be code
    for token in reversed(tokens):
        is_prose = token.type == tokenize.COMMENT or (
            token.type == tokenize.STRING
            and "f" not in (prefix := token.string.lower().partition(token.string[-1])[0])
            and "t" not in prefix
        )
        if is_prose:
            (first, start), (last, end) = token.start, token.end
            lines[first - 1] = f'{lines[first - 1][:start]}""{lines[last - 1][end:]}'
            lines[first:last] = [""] * (last - first)
    return "".join(lines)


def _may_do_anything(word: str) -> bool:
    """Whether it is reflection, or a function of MuJoCo's that does not only simulate."""
    hidden = word.startswith("__") and word not in ("__main__", "__name__", "__file__", "__doc__")
    return word in _OPAQUE or hidden or (bool(_FUNCTION.match(word)) and word not in _SIMULATION)


def imported_modules(text: str) -> list[str]:
    """The modules that Python imports, each by the first part of its name."""
    names = (name for match in _IMPORT.findall(text) for name in (match[0] or match[1]).split(","))
    return [name.split()[0].partition(".")[0] for name in names if name.split()]
