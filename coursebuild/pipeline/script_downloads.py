"""What readers are handed over of each script, and whether it runs alone.

1. A script becomes one file with all that it needs of the course; where that cannot be, or its
   fence says `download=zip`, it becomes an archive, in which everything lies as in the course. Both
   say which packages they need. Run in an empty folder, they have to print what the page shows.
2. The scripts of a lesson, and those of the course, come in archives of the same kind.
"""

from __future__ import annotations

import contextlib
import functools
import platform
import re
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence

from msgspec import Struct
from msgspec.structs import replace

from coursebuild.core.engine.tool import step_key
from coursebuild.core.files.errors import EffectError
from coursebuild.core.files.read import read_bytes
from coursebuild.core.model import Course
from coursebuild.core.model.results import (
    CompileResult,
    ModelFacts,
    Outcome,
    ScriptRun,
    Verdict,
)
from coursebuild.core.model.script_download import DownloadState, ScriptDownload
from coursebuild.core.pages import urls
from coursebuild.core.pages.library import Library, models_named
from coursebuild.core.pages.zips import Archive
from coursebuild.core.run.alone import AloneJob, AloneRun, Runner
from coursebuild.core.run.script_environment import InstalledPackages, module_files
from coursebuild.core.scripts.compare import verify
from coursebuild.core.scripts.extract import Extraction, extract
from coursebuild.core.scripts.module_code import CourseModule, NotOneFileError
from coursebuild.core.scripts.single_file import Belongings, single_file
from coursebuild.core.text.diagnostics import Diagnostic, diagnose
from coursebuild.core.text.python_code import find_imports
from coursebuild.core.text.source import key_of
from coursebuild.pipeline.options import Options
from coursebuild.pipeline.records import imports_of

_KIND, _STYLE = "downloads", "matplotlibrc"
_MODELS, _EXAMPLES, _LIBRARY = "models/", "examples/", "mjcourse/"
_MOST_DATA = 1 << 16
"""Bytes of data that stand in a file for people to read; more come in an archive."""
_DOCSTRING = re.compile(r"""(?:\s|#.*\n)*[rRuU]?(?:(\"{3}|'{3})[\s\S]*?\1|"[^"\n]*"|'[^'\n]*')""")


class _Course:
    """What scripts of a course may take from it."""

    def __init__(
        self,
        course: Course,
        scripts: Iterable[Extraction],
        options: Options,
        runs: Iterable[ScriptRun],
        facts: Iterable[tuple[str, ModelFacts | None]],
        imports: Mapping[str, frozenset[str]],
    ) -> None:
        """`facts` are those of models, by name; `imports`: see `verify`."""
        self.root, self.options = options.root, options
        interpreter = options.interpreter
        folders = None if interpreter is None else interpreter.packages
        self._installed = InstalledPackages(options.store, folders)
        self.runs = {run.path: run for run in runs}
        self.imports = functools.partial(imports_of, imports=imports)
        self._includes = {f"{_MODELS}{name}.xml": f.includes for name, f in facts if f is not None}
        self._folders = [options.root / package.path for package in course.packages]
        self._prefixes = tuple(f"{package.path.rstrip('/')}/" for package in course.packages)
        self._models = {model.source.path: model.source.text for model in course.models}
        self.modules = {
            _dotted(e.path.removeprefix(_EXAMPLES)): CourseModule(e.path, e.text)
            for e in scripts
            if e.script.is_python
        }
        self.own_names = {name for module in self.modules for name in module.split(".")}
        self._find_top = functools.cache(self._read_top)
        self.files_of_module = functools.cache(
            functools.partial(module_files, folders=self._folders)
        )
        self.imports_of_module = functools.cache(self._read_imports)
        self.read = functools.cache(functools.partial(read_bytes, options.root))
        self._paths: dict[str, list[str]] = {}

    def find_module(self, script: str, name: str) -> CourseModule | None:
        """The module that the script at a path in `examples/` gets by this name."""
        folder = _dotted(script.removeprefix(_EXAMPLES)).rpartition(".")[0]
        top = name.partition(".")[0]
        for prefix in dict.fromkeys((folder, "")):
            module = self.modules.get(f"{prefix}.{name}" if prefix else name)
            if module is not None:
                return module
        return self._find_top(top).get(name)

    def answer(self, script: str, name: str) -> str:
        """A name for the module that a script gets; empty where the course has none."""
        module = self.find_module(script, name)
        return "" if module is None else key_of(module.path, module.text)

    def _read_top(self, top: str) -> dict[str, CourseModule]:
        return {
            _dotted(file.path): CourseModule(file.path, file.data.decode("utf-8", "replace"))
            for file in self.files_of_module(top)
            if file.path.endswith(".py")
        }

    def _read_imports(self, module: str) -> frozenset[str]:
        """The top-level modules that the files of a module import, which many scripts may use."""
        files = (file for file in self.files_of_module(module) if file.path.endswith(".py"))
        return frozenset[str]().union(*(find_imports(file.data.decode()) for file in files))

    def files_of(self, extraction: Extraction) -> dict[str, bytes]:
        """The models and data that a script reads, by path; if it did not run, what it names."""
        if extraction.path not in self._paths:
            self._paths[extraction.path] = self._find_paths(extraction)
        return {path: self.read(path) for path in self._paths[extraction.path]}

    def _find_paths(self, extraction: Extraction) -> list[str]:
        paths: set[str] = set()
        run = self.runs.get(extraction.path)
        if run is not None and run.trace is not None:
            paths = {p for p in run.trace.files if (self.root / p).is_file()}
            paths = {p for p in paths if not p.startswith((_EXAMPLES, _LIBRARY, *self._prefixes))}
        else:
            for name in models_named(extraction.script):
                path = f"{_MODELS}{name}.xml"
                if path in self._models:
                    paths |= {path, *self._includes.get(path, ())}
        return sorted(paths - {_STYLE, "content/course.toml"})

    @functools.cached_property
    def style(self) -> dict[str, str]:
        """The settings of Matplotlib that the course has."""
        try:
            text = self.read(_STYLE).decode()
        except (EffectError, OSError, UnicodeDecodeError):
            return {}
        rows = re.findall(r"^[ \t]*([\w.]+)[ \t]*:[ \t]*((?:\"[^\"\n]*\"|[^#\n])*)", text, re.M)
        return {name: value.strip() for name, value in rows}

    def packages(self, modules: Iterable[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """What brings these modules, for installers, and those that nothing installed here brings.

        A package need not be called as its module is, so that of these it is not known.
        """
        names = sorted(set(modules))
        rows = self._installed.distributions(names)
        lines = {module: f"{name}=={version}" for module, name, version in rows}
        packages = tuple(sorted(set(lines.values()), key=str.lower))
        return packages, tuple(name for name in names if name not in lines)


def find_downloads(
    course: Course,
    scripts: Sequence[Extraction],
    runs: Iterable[ScriptRun],
    models: Iterable[tuple[str, CompileResult]],
    options: Options,
    imports: Mapping[str, frozenset[str]],
) -> tuple[ScriptDownload, ...]:
    """What is handed over of these scripts in Python; nothing of those that fail as they are."""
    facts = ((name, result.facts) for name, result in models)
    course_files = _Course(course, scripts, options, runs, facts, imports)
    downloads = []
    for extraction in (e for e in scripts if e.script.is_python):
        run = course_files.runs.get(extraction.path)
        if run is None or run.outcome in (Outcome.OK, Outcome.SKIPPED, Outcome.NORUN):
            downloads.append(_make_download(course_files, extraction))
    return tuple(downloads)


def make_archives(
    library: Library, options: Options, imports: Mapping[str, frozenset[str]]
) -> Iterator[Archive]:
    """The archives of the course and of each lesson with scripts; `imports`: see `verify`."""
    scripts = extract(library.course).value
    runs, facts = library.results.runs, library.facts.items()
    course_files = _Course(library.course, scripts, options, runs, facts, imports)

    def archive(path: str, folder: str, of: Sequence[Extraction]) -> Archive:
        files = _find_members(course_files, of)[0]
        readme = library.words("zip.readme", title=library.course.title, script=of[0].path)
        files["README.md"] = f"{readme.strip()}\n".encode()
        return Archive(path, {f"{folder}/{name}": data for name, data in files.items()})

    if scripts:
        folder = re.sub(r"[^a-z0-9]+", "-", library.course.title.lower()).strip("-") or "course"
        yield archive(urls.EXAMPLES_ZIP, folder, scripts)
    by_document: dict[str, list[Extraction]] = {}
    for extraction in scripts:
        by_document.setdefault(extraction.document, []).append(extraction)
    for lesson in library.order:
        if of_lesson := by_document.get(lesson.path):
            folder = f"{lesson.id}-{lesson.slug}"
            yield archive(urls.lesson_zip_path(lesson), folder, of_lesson)


def _make_download(course_files: _Course, extraction: Extraction) -> ScriptDownload:
    path, name = extraction.path, extraction.path.rpartition("/")[2]
    whole = None if extraction.script.archive else _one_file(course_files, extraction)
    if whole is not None and whole.text:
        packages, unknown = course_files.packages(whole.modules)
        # The block by which installers know what a script needs (PEP 723)
        interpreter = course_files.options.interpreter
        version = platform.python_version() if interpreter is None else interpreter.version
        oldest = ".".join(version.split(".")[:2])
        rows = "".join(f'#     "{package}",\n' for package in packages)
        rows += "".join(f"#     {_unknown_package(module)}\n" for module in unknown)
        dependencies = f"# dependencies = [\n{rows}# ]\n" if rows else "# dependencies = []\n"
        text = f'# /// script\n# requires-python = ">={oldest}"\n{dependencies}# ///\n' + whole.text
        return ScriptDownload(
            path, ((name, text.encode()),), name, packages, whole.modules, unknown
        )
    members, modules = _find_members(course_files, [extraction])
    packages, unknown = course_files.packages(modules)
    files = tuple(sorted(members.items()))
    return ScriptDownload(path, files, path, packages, modules, unknown, archive=True)


class _OneFile(Struct, frozen=True):
    """A script as one file, as it is kept; what it depends on beside its own text and files."""

    text: str
    """Without the packages that it needs; empty where it cannot be one file."""
    modules: tuple[str, ...]
    """Those of others that it imports."""
    answers: dict[str, str]
    """What each module was, of those of the course that were asked for."""


def _one_file(course_files: _Course, extraction: Extraction) -> _OneFile:
    path, name = extraction.path, extraction.path.rpartition("/")[2]
    files, style = course_files.files_of(extraction), course_files.style
    imports = course_files.imports(extraction)
    has_style = style and "matplotlib" in imports
    is_own = (n in course_files.own_names or course_files.files_of_module(n) for n in imports)
    if not (files or has_style or any(is_own)):  # as most
        modules = tuple(sorted(imports - sys.stdlib_module_names))
        return _OneFile(_in_place(extraction.text, path, name), modules, {})
    key = step_key("one file", path, extraction.text, files, style)
    earlier = course_files.options.store.get_value(_KIND, key, _OneFile)
    if earlier is not None and all(
        course_files.answer(path, module) == answer for module, answer in earlier.answers.items()
    ):
        return earlier
    answers: dict[str, str] = {}

    def find_module(module: str) -> CourseModule | None:
        answers[module] = course_files.answer(path, module)
        return course_files.find_module(path, module)

    text, modules = "", tuple[str, ...]()
    with contextlib.suppress(NotOneFileError, RecursionError, SyntaxError):
        belongings = _belongings(files)
        code = single_file(_dotted(name), extraction.text, find_module, belongings)
        if "matplotlib" in find_imports(code) and style:
            belongings = replace(belongings, style=style)
            code = single_file(_dotted(name), extraction.text, find_module, belongings)
        modules = tuple(sorted(find_imports(code) - sys.stdlib_module_names))
        text = _in_place(code, path, name)
    whole = _OneFile(text, modules, answers)
    course_files.options.store.put_value(_KIND, key, whole)
    return whole


def _in_place(code: str, path: str, name: str) -> str:
    """The text of a file that stood at a path, with its new name in its docstring."""
    docstring = _DOCSTRING.match(code)
    end = 0 if docstring is None else docstring.end()
    return code[:end].replace(path, name) + code[end:]


def _find_members(
    course_files: _Course, scripts: Iterable[Extraction]
) -> tuple[dict[str, bytes], tuple[str, ...]]:
    """The files of an archive of scripts, by path, and the modules of others that these import."""
    members: dict[str, bytes] = {}
    foreign = set[str]()
    for extraction in scripts:
        members |= {extraction.path: extraction.data, **course_files.files_of(extraction)}
        folder = extraction.path.rpartition("/")[0]
        imports, visited = [course_files.imports(extraction)], set[str]()
        for names in imports:
            for name in names - visited - sys.stdlib_module_names:
                visited.add(name)
                module = course_files.find_module(extraction.path, name)
                if module is not None and module.path.startswith(_EXAMPLES):
                    members[module.path] = module.text.encode()
                    imports.append(find_imports(module.text))
                    continue
                files = course_files.files_of_module(name)
                members |= {f"{folder}/{file.path}": file.data for file in files}
                imports.append(course_files.imports_of_module(name))
                foreign |= set() if files else {name}
    if "matplotlib" in foreign and course_files.style:
        members[_STYLE] = course_files.read(_STYLE)
    packages, unknown = course_files.packages(foreign)
    lines = (*packages, *map(_unknown_package, unknown))
    members["requirements.txt"] = "".join(f"{line}\n" for line in lines).encode()
    return members, tuple(sorted(foreign))


def _belongings(files: Mapping[str, bytes]) -> Belongings:
    """What a script reads, as texts; NotOneFileError where a text is not what one would read."""
    texts: dict[str, str] = {}
    for path, data in files.items():
        try:
            texts[path] = data.decode()
        except UnicodeDecodeError:
            raise NotOneFileError(f"{path} is no text") from None
        if "\r" in texts[path] or "\0" in texts[path]:
            raise NotOneFileError(f"{path} is no text with plain line ends")
    models = {p.removeprefix(_MODELS): t for p, t in texts.items() if p.startswith(_MODELS)}
    data_texts = {p: t for p, t in texts.items() if not p.startswith(_MODELS)}
    if sum(map(len, data_texts.values())) > _MOST_DATA:
        raise NotOneFileError("its data are long")
    return Belongings(models, data_texts)


def _unknown_package(module: str) -> str:
    return f"# the package of the module {module} was not known"


# --- their trial


def try_downloads(
    course: Course,
    scripts: Iterable[Extraction],
    runs: Iterable[ScriptRun],
    verdicts: Iterable[Verdict],
    downloads: Sequence[ScriptDownload],
    options: Options,
    *,
    only_known: bool = False,
) -> tuple[tuple[ScriptDownload, ...], tuple[Diagnostic, ...]]:
    """Run what is handed over of scripts that were run; say what fails, or prints another thing.

    `only_known`: nothing runs, and what an earlier command found is repeated.
    """
    extractions = {e.path: e for e in scripts}
    runs_by_path = {run.path: run for run in runs if run.outcome is Outcome.OK and not run.recorded}
    jobs = {d.script: _job(d, extractions[d.script]) for d in downloads if d.script in runs_by_path}
    runner = Runner(options.root, options.store, options.interpreter, options.sandbox, options.jobs)
    known_runs = {path: runner.known_run(job) for path, job in jobs.items()}
    new_jobs = {path: job for path, job in jobs.items() if known_runs[path] is None}
    if new_jobs and not only_known:
        with options.progress.stage("running downloads", len(new_jobs)):
            new = runner.run(new_jobs.values(), options.progress.skip)
            known_runs |= dict(zip(new_jobs, new, strict=True))
    alone_runs = {path: run for path, run in known_runs.items() if run is not None}
    problems = dict(_problems(course, runs_by_path, verdicts, alone_runs))
    states: dict[str, DownloadState] = dict.fromkeys(jobs, "ran")
    states |= dict.fromkeys(problems, "failed")
    judged_downloads = tuple(replace(d, state=states.get(d.script, "unrun")) for d in downloads)
    diagnostics = tuple(
        diagnose(
            "download-failed",
            extractions[path].script.path_span,
            f"what readers download of `{path}` {problem}",
            help="it gets an empty folder with what it imports and reads, and no network",
        )
        for path, problem in problems.items()
    )
    return judged_downloads, diagnostics


def _job(download: ScriptDownload, extraction: Extraction) -> AloneJob:
    script = extraction.script
    return AloneJob(
        download.files,
        download.entry,
        script.args,
        tuple(figure.name for figure in script.figures),
        download.modules,
        download.packages,
        extraction.environment,
        script.timeout,
        extraction.memory,
    )


def _problems(
    course: Course,
    runs: Mapping[str, ScriptRun],
    verdicts: Iterable[Verdict],
    alone_runs: Mapping[str, AloneRun],
) -> Iterator[tuple[str, str]]:
    """The paths of scripts whose downloads fail, each with what is wrong."""
    drifted = {v.recording.span for v in verdicts if v.status == "drift"}
    other_runs = []
    for path, alone_run in alone_runs.items():
        if alone_run.failure:
            yield path, f"fails in an empty folder: {alone_run.failure}"
        elif not _prints_same(alone_run, runs[path]):
            # A script's run with another output, whose parts have as many lines as before
            run = runs[path]
            lines = alone_run.stdout.splitlines(keepends=True)
            counts = (run.stdout[:start].count("\n") for start in run.part_starts)
            starts = tuple(sum(map(len, lines[:count])) for count in counts)
            other_runs.append(replace(run, stdout=alone_run.stdout, part_starts=starts))
    reported_paths = set[str]()
    for verdict in verify(course, other_runs) if other_runs else ():
        path = verdict.recording.script or ""
        is_new = verdict.recording.span not in drifted and path not in reported_paths
        if verdict.status == "drift" and is_new:
            change = verdict.changes[0]
            reported_paths.add(path)
            yield path, f"prints `{change.printed}` alone, where the page has `{change.recorded}`"


def _prints_same(alone_run: AloneRun, run: ScriptRun) -> bool:
    """Whether both printed the same.

    The C library gives what it has kept back at the end of each part of a script of the course, and
    of a script that runs alone at its end.
    """
    if alone_run.stdout == run.stdout:
        return True
    lines, kept_back = run.stdout.splitlines(), alone_run.kept_back.splitlines()
    for line in kept_back:
        if line not in lines:
            return False
        lines.remove(line)
    return bool(kept_back) and [*lines, *kept_back] == alone_run.stdout.splitlines()


def _dotted(path: str) -> str:
    return path.removesuffix(".py").replace("/", ".").removesuffix(".__init__")
