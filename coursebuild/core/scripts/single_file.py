"""A script as one file that runs by itself: what it imports of the course stands in it.

1. The script's own lines stay as they are, but for the imports of modules of the course. In their
   place come the definitions that are used of each module, and what these need in turn.
2. A name that two modules define differently gets the module's name in front. A module that is
   imported whole becomes a namespace of what is used of it.
3. Models, data and the style of figures become texts. `model_path` gives files of these models.
4. What does more on import than define names cannot be carried over: there is no such file.
"""

from __future__ import annotations

import ast
import builtins
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TypeAlias

from msgspec import Struct

from coursebuild.core.scripts.module_code import (
    CourseModule,
    ModuleCode,
    NotOneFileError,
    bound_name,
    bound_names,
    futures,
    global_names,
    is_future,
    is_text,
)
from coursebuild.core.text.python_code import python_nodes

_OF_THE_FILE = frozenset(("__file__", "__name__", "globals", "locals", "vars"))
"""What gives something else in another file."""
_LIBRARY = "mjcourse.paths"
_MODEL_PATH = '''\
_folder = tempfile.TemporaryDirectory()


def model_path(name):
    """The path of one of the MODELS, which it writes into a temporary folder."""
    for file, text in MODELS.items():
        path = Path(_folder.name, file)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    return Path(_folder.name, name.removesuffix(".xml") + ".xml")'''
_DATA = """\
for file, text in DATA.items():
    if not Path(file).exists():
        Path(file).parent.mkdir(parents=True, exist_ok=True)
        Path(file).write_text(text, encoding="utf-8")"""


FindModule: TypeAlias = Callable[[str], CourseModule | None]
"""Returns the course's module of a dotted name."""


class Belongings(Struct, frozen=True):
    """What a script needs besides modules, as texts."""

    models: Mapping[str, str] = {}
    """By path in the folder of models."""
    data: Mapping[str, str] = {}
    """By path in the course's folder, in which scripts work."""
    style: Mapping[str, str] = {}
    """Settings of Matplotlib."""


def single_file(name: str, text: str, find_module: FindModule, belongings: Belongings) -> str:
    """The script with this dotted name and text as one file.

    Raises:
        NotOneFileError: it cannot be one.
    """
    return _File(name, text, find_module).write(belongings)


class _File:
    """The file while it is put together."""

    def __init__(self, name: str, text: str, find_module: FindModule) -> None:
        self._find_module = find_module
        self._modules: dict[str, ModuleCode] = {}
        self._script = ModuleCode(name, CourseModule("", text))
        self._meanings: dict[str, object] = {}
        """What each name means in the file: the text of an import, or where it is defined."""
        self._imports: set[str] = set()
        self._namespaces: dict[str, dict[str, str]] = {}
        """What each name of a whole module has; a module of no code in `_modules` stands for it."""
        self._has_models = False
        statements = self._script.statements
        self._head = 0
        while self._head < len(statements) and (
            isinstance(statements[self._head], ast.Import | ast.ImportFrom)
            or is_text(statements[self._head])
        ):
            self._head += 1

    def write(self, belongings: Belongings) -> str:
        course_lines = self._take_imports()
        if self._has_models and not belongings.models:
            raise NotOneFileError("it is not known which models it loads")
        sections = self._sections(belongings)
        lines, statements = self._script.lines, self._script.statements
        start = 0
        while start < self._head and (is_text(statements[start]) or is_future(statements[start])):
            start += 1
        top = (statements[start - 1].end_lineno or 0) if start else 0
        end = (statements[self._head - 1].end_lineno or 0) if self._head else 0
        opening = lines[:top]
        if not any(is_future(statement) for statement in statements[:start]):
            opening += ["", *(line for line in sorted(self._imports) if "__future__" in line)]
        own_imports = "\n".join(
            lines[n - 1] for n in range(top + 1, end + 1) if n not in course_lines
        )
        new_imports = {line for line in self._imports if "__future__" not in line}
        new_imports -= {*own_imports.split("\n")}
        new_lines = sorted(new_imports, key=lambda line: (line.startswith("from "), line.lower()))
        imports = (own_imports, "\n".join(new_lines))
        parts = ["\n".join(opening), *imports, *sections, "\n".join(lines[end:])]
        text, last = "", ""
        for part in filter(None, (part.strip("\n") for part in parts)):
            defines = part.startswith(("def ", "class ", "@", "# --- ")) or "\ndef " in last
            text += ("\n\n\n" if defines and text else "\n\n" if text else "") + part
            last = part
        return f"{text}\n"

    def _take_imports(self) -> set[int]:
        """Take what the script imports of the course; return the lines of these imports."""
        script, course_lines = self._script, set[int]()
        ours: list[tuple[str, str, str]] = []
        for number, statement in enumerate(script.statements):
            if not isinstance(statement, ast.Import | ast.ImportFrom):
                # A module may assign the same.
                text = ast.unparse(statement) if isinstance(statement, ast.Assign) else "assigned"
                self._meanings |= dict.fromkeys(bound_names(statement), text)
            elif not (course_imports := self._course_imports(statement)):
                for bound in bound_names(statement):
                    self._meanings[bound] = self._external(script, bound)
            elif number >= self._head or len(course_imports) != len(statement.names):
                message = f"what line {statement.lineno} imports cannot stand there"
                raise NotOneFileError(message)
            else:
                ours += course_imports
                course_lines |= {*range(statement.lineno, (statement.end_lineno or 0) + 1)}
        tops = {(s.lineno, s.col_offset) for s in script.statements}
        for node in python_nodes(script.source.text):
            if isinstance(node, ast.Global):
                self._meanings |= dict.fromkeys(node.names, "assigned")
            elif (
                isinstance(node, ast.Import | ast.ImportFrom)
                and (node.lineno, node.col_offset) not in tops
                and self._course_imports(node)
            ):
                raise NotOneFileError(f"what line {node.lineno} imports cannot stand there")
        for bound, module_name, name in ours:  # the script's own names come first
            if bound in self._meanings:
                raise NotOneFileError(f"`{bound}` means two things in it")
            self._meanings[bound] = self._origin(module_name, name)
        wholes = [row for row in ours if self._find_module(".".join(filter(None, row[1:])))]
        for bound, module_name, name in (*(row for row in ours if row not in wholes), *wholes):
            self._take(bound, module_name, name)
        return course_lines

    def _course_imports(self, statement: ast.Import | ast.ImportFrom) -> list[tuple[str, str, str]]:
        """What the script imports by a statement of the course."""
        rows = self._script.imported(statement)
        return [row for row in rows if self._find_module(row[1]) is not None]

    def _origin(self, module_name: str, name: str) -> object:
        """Where a name of a module is defined; a module's own name where it is one."""
        whole = f"{module_name}.{name}" if name else module_name
        source = self._find_module(module_name)
        if source is None or not name or self._find_module(whole) is not None:
            return whole
        module = self._module(module_name, source)
        statement = module.statement_of(name)
        if not isinstance(statement, ast.Import | ast.ImportFrom):
            return module_name, name
        row = next(row for row in module.imported(statement) if row[0] == name)
        is_ours = self._find_module(row[1]) is not None
        return self._origin(row[1], row[2]) if is_ours else self._external(module, name)

    def _module(self, name: str, source: CourseModule) -> ModuleCode:
        if name not in self._modules:
            self._modules[name] = ModuleCode(name, source)
            self._modules[name].check()
        return self._modules[name]

    def _take(self, bound: str, module: str, name: str) -> None:
        """Take a name of a module, or a whole module, for a name of the script."""
        if name == "*":
            raise NotOneFileError(f"it imports everything of {module}")
        if not name and "." in module:
            raise NotOneFileError(f"it imports {module} whole")
        whole = f"{module}.{name}" if name else module
        if name and self._find_module(whole) is None:
            self._need(self._script, module, name, bound)
        else:
            self._use_whole(self._script, bound, whole, self._script.statements[self._head :])

    def _use_whole(
        self, user: ModuleCode, bound: str, whole: str, statements: Sequence[ast.stmt]
    ) -> None:
        """Take what these statements use of a module that they know by the name `bound`."""
        attributes: set[str] = set()
        count = 0
        for node in ast.walk(ast.Module([*statements], [])):
            match node:
                case ast.Attribute(ast.Name(id), attribute, ast.Load()) if id == bound:
                    attributes.add(attribute)
                    count -= 1
                case ast.Name(id) if id == bound:
                    count += 1
                case _:
                    pass
        if count or self._meanings.setdefault(bound, whole) != whole:
            raise NotOneFileError(f"`{bound}` is used as more than a module")
        if (source := self._find_module(whole)) is not None:
            self._module(whole, source)
        place = self._module(f"{bound} =", CourseModule("", ""))
        user.uses[place.name] = None
        namespace = self._namespaces.setdefault(bound, {})
        for attribute in sorted(attributes):
            self._imports.add("from types import SimpleNamespace")
            namespace[attribute] = self._need(place, whole, attribute)

    def _need(self, user: ModuleCode, module_name: str, name: str, new_name: str = "") -> str:
        """Take a name of a module and what it needs; return what it is called in the file."""
        source = self._find_module(module_name)
        if source is None:
            raise NotOneFileError(f"there is no module {module_name}")
        if module_name == _LIBRARY and name == "model_path" and new_name in ("", name):
            self._imports |= {"import tempfile", "from pathlib import Path"}
            self._has_models = True
            return name
        module = self._module(module_name, source)
        if module is not user:
            user.uses[module_name] = None
        statement = module.statement_of(name)
        if isinstance(statement, ast.Import | ast.ImportFrom):
            row = next(row for row in module.imported(statement) if row[0] == name)
            if self._find_module(row[1]) is None:
                return self._keep(module, name, new_name)
            if self._find_module(f"{row[1]}.{row[2]}") is not None or not row[2]:
                raise NotOneFileError(f"{source.path} uses the module {row[1]} as a value")
            return self._need(user, row[1], row[2], new_name)
        return self._define(module, name, statement, new_name)

    def _define(self, module: ModuleCode, name: str, statement: ast.stmt, new_name: str) -> str:
        meaning = (module.name, name)
        number = module.numbers[name][0]
        if number in module.needed and not new_name:
            return module.new_names.get(name, name)
        text = isinstance(statement, ast.Assign) and ast.unparse(statement)
        file_name = new_name or name
        meaning_there = self._meanings.get(file_name)
        if meaning_there not in (None, meaning, text) or (file_name in dir(builtins)):
            file_name = f"{module.name.rpartition('.')[2]}_{name.strip('_')}"
            if new_name or self._meanings.get(file_name, meaning) != meaning:
                raise NotOneFileError(f"`{name}` means two things in it")
        if module.new_names.get(name, file_name) != file_name:
            raise NotOneFileError(f"it imports `{name}` under two names")
        self._meanings[file_name] = text if meaning_there == text else meaning
        if file_name != name:
            module.new_names[name] = file_name
        if number not in module.needed:
            module.needed.add(number)
            self._need_used(module, statement)
        return file_name

    def _need_used(self, module: ModuleCode, statement: ast.stmt) -> None:
        """Take what a statement of a module uses of that module."""
        self._imports |= {f"from __future__ import {n}" for n in futures(module.statements)}
        for node in ast.walk(statement):
            rows = module.imported(node) if isinstance(node, ast.Import | ast.ImportFrom) else ()
            if any(self._find_module(row[1]) for row in rows):
                raise NotOneFileError(f"{module.source.path} imports inside of a definition")
        own_names = bound_names(statement)
        for node in global_names(statement):
            if node.id in _OF_THE_FILE and node.id not in module.numbers:
                raise NotOneFileError(f"{module.source.path} uses `{node.id}`")
            if node.id not in module.numbers or node.id in own_names:
                continue
            origin = module.statement_of(node.id)
            if isinstance(origin, ast.Import | ast.ImportFrom):
                row = next(row for row in module.imported(origin) if row[0] == node.id)
                whole = ".".join(filter(None, row[1:]))
                if self._find_module(whole) is not None:
                    self._use_whole(module, node.id, whole, [statement])
                    continue
            file_name = self._need(module, module.name, node.id)
            if file_name != node.id:
                module.new_names[node.id] = file_name

    def _external(self, module: ModuleCode, name: str, new_name: str = "") -> str:
        """The import of a name from another package, as a line."""
        statement = module.statements[module.numbers[name][-1]]
        assert isinstance(statement, ast.Import | ast.ImportFrom)
        aliases = [alias for alias in statement.names if bound_name(alias) == name]
        if new_name not in ("", name):
            if any("." in alias.name and not alias.asname for alias in aliases):
                raise NotOneFileError(f"{module.source.path} imports more than `{name}`")
            aliases = [ast.alias(alias.name, new_name) for alias in aliases]
        if isinstance(statement, ast.Import):
            return ast.unparse(ast.Import(aliases))
        return ast.unparse(ast.ImportFrom(statement.module, aliases, statement.level))

    def _keep(self, module: ModuleCode, name: str, new_name: str) -> str:
        """Let the file import a name of another package, which is what a module imports."""
        meaning, file_name = self._external(module, name), new_name or name
        if self._meanings.get(file_name, meaning) != meaning:
            raise NotOneFileError(f"`{file_name}` means two things in it")
        if new_name or file_name not in self._meanings:
            self._meanings[file_name] = meaning
            self._imports.add(self._external(module, name, file_name))
        return file_name

    def _sections(self, belongings: Belongings) -> list[str]:
        sections: list[str] = []
        if belongings.style:
            self._imports.add("import matplotlib")
            table = _dictionary({k: repr(v) for k, v in belongings.style.items()})
            sections.append(f"# The course's style of figures\nmatplotlib.rcParams.update({table})")
        if self._has_models:
            texts = {path: _literal(text) for path, text in belongings.models.items()}
            sections.append(f"MODELS = {_dictionary(texts)}\n{_MODEL_PATH}")
        if belongings.data:
            self._imports.add("from pathlib import Path")
            texts = {path: _literal(text) for path, text in belongings.data.items()}
            comment = "# What the script reads; a file that is there already stays as it is"
            sections.append(f"{comment}\nDATA = {_dictionary(texts)}\n{_DATA}")
        for module in self._in_order(self._script, set()):
            bound, sign, _ = module.name.partition(" =")
            if sign:
                pairs = sorted(self._namespaces[bound].items())
                rows = "".join(f"    {attribute}={ours},\n" for attribute, ours in pairs)
                sections.append(f"{module.name} SimpleNamespace(\n{rows})")
            elif module.needed:
                sections.append(f"# --- from {module.source.path}\n\n\n{module.code()}")
        if any(section.startswith("# --- from") for section in sections):
            sections.append("# --- the script itself")
        return sections

    def _in_order(self, module: ModuleCode, visited: set[str]) -> Iterator[ModuleCode]:
        """The modules that one uses, each after those that it uses itself."""
        for name in module.uses:
            if name not in visited:
                visited.add(name)
                yield from self._in_order(self._modules[name], visited)
                yield self._modules[name]


def _dictionary(values: Mapping[str, str]) -> str:
    rows = "".join(f'    "{key}": {value},\n' for key, value in sorted(values.items()))
    return f"{{\n{rows}}}"


def _literal(text: str) -> str:
    """A text as Python writes it, on lines of its own."""
    if text.endswith('"') or any(part in text for part in ('"""', "\r", "\0", "\\")):
        return repr(text)
    return f'"""\\\n{text}"""'
