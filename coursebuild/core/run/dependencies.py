"""What the result of a script depends on, and how to say that it changed.

1. What is known before a script runs (`Inputs`) determines a group of results.
2. What it looked at while it ran (a `Trace`) determines its needs; a need with its state at that
   time is a `Dependency`.
3. A result holds as long as every state is the same.
"""

from __future__ import annotations

import enum
import functools
import hashlib
import json
import re
import shlex
from collections.abc import Callable, Iterable, Iterator

from msgspec import Struct

from coursebuild.core.engine.digests import ABSENT, FILE, FOLDER, SPECIAL
from coursebuild.core.model import Limits
from coursebuild.core.model.results import Outcome, ScriptJob, ScriptRun

VERSION = "8"
"""Change it when scripts are run or watched in another way: older results then no longer count."""

_MISSING_MODULE = re.compile(r"^(?:\w+\.)*(?:ModuleNotFoundError|ImportError)\b", re.MULTILINE)
_PERTURBATION = "moved states"
"""Change it when the results of such runs mean something else: they then run again."""
_VOLATILE_FOLDERS = ("/proc/", "/sys/", "/dev/")


class Kind(enum.Enum):
    """What kind of thing a script looked at."""

    FILE = "file"
    """A file of the project, by its path there."""
    LISTING = "listing"
    """The names in a folder of the project."""
    SOUGHT = "sought"
    """Modules that were looked for in vain in a folder of the project (`folder/{one,two}`); its
    state says which of them are there."""
    EXISTENCE = "existence"
    """What lies at a path of the project: a file, a folder, or nothing."""
    STATUS = "status"
    """The size, times and mode of a file of the project."""
    OUTSIDE = "outside"
    """A file elsewhere on this machine, by its absolute path."""
    MODULE = "module"
    """An installed module, by its name; its state says which packages provide it, with versions."""
    PLACE = "place"
    """The path of something on this machine, for a script that printed it."""

    __hash__ = object.__hash__  # that of enumerations is much slower, and needs are many


FIELDS = {
    "files": Kind.FILE,
    "folders": Kind.LISTING,
    "outside": Kind.OUTSIDE,
    "modules": Kind.MODULE,
    "sought": Kind.SOUGHT,
}
"""The fields of a trace that hold the names of what a script depends on."""
ANSWERS = {"existence": Kind.EXISTENCE, "statuses": Kind.STATUS}
"""The fields that hold names, each with the state that the script saw."""


class Need(Struct, frozen=True):
    """Something whose state matters to a result."""

    kind: Kind
    name: str


class Dependency(Struct, frozen=True):
    """Something that a script looked at, with its state at that time."""

    kind: Kind
    name: str
    state: str

    @property
    def need(self) -> Need:
        """Without its state."""
        return Need(self.kind, self.name)


class Inputs(Struct, frozen=True, rename={"conditions": "around"}):
    """All that a result depends on and that is known before the script runs."""

    path: str
    text: str
    """Hash of the script."""
    args: tuple[str, ...]
    timeout: float
    requires: tuple[str, ...]
    conditions: tuple[tuple[str, str], ...]
    """By name: the interpreter, the platform, variables of the environment, options of the job."""
    version: str = VERSION


def inputs_of(job: ScriptJob, text: bytes, conditions: tuple[tuple[str, str], ...]) -> Inputs:
    """The inputs of a job whose file holds this text."""
    digest = hashlib.sha256(text).hexdigest()
    job_conditions = [(f"environment variable {name}", value) for name, value in job.environment]
    options = {
        "packages of the course": " ".join(job.packages),
        "folders that it may write into": " ".join(job.writes),
        "figures that it draws": " ".join(job.figures),
        "MiB that it may take": "" if job.memory == Limits().scripts else str(job.memory),
        "lines at which its parts begin": " ".join(map(str, job.part_lines)),
        "going on after a part that fails": "yes" if job.keeps_going else "",
        "commands that run it": "\n".join(map(shlex.join, job.commands)),
        _PERTURBATION: str(job.perturbation or ""),
    }
    job_conditions += [(name, value) for name, value in options.items() if value]
    conditions = tuple(sorted((*conditions, *job_conditions)))
    return Inputs(job.path, digest, job.args, float(job.timeout), job.requires, conditions)


def is_perturbed(inputs: Inputs) -> bool:
    """Whether these are of a run whose initial states are moved."""
    return any(name == _PERTURBATION for name, _ in inputs.conditions)


def group_key(inputs: Inputs) -> str:
    """The name of the group of results that these inputs can have."""
    parts = [getattr(inputs, name) for name in Inputs.__struct_fields__]
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def result_key(dependencies: Iterable[Dependency]) -> str:
    """The name of a result in its group."""
    parts = sorted((d.kind.value, d.name, d.state) for d in dependencies)
    return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def dependencies_of(
    run: ScriptRun,
    requires: Iterable[str],
    places: Iterable[tuple[str, str]],
    state: Callable[[Need], str],
) -> tuple[Dependency, ...]:
    """All that the result of a run depends on, sorted; nothing for a run that was not traced.

    `places` are folders of this machine by name: `library` is the one that holds `mjcourse`.
    """
    trace = run.trace
    if trace is None:
        return ()
    needs = {Need(kind, name) for field, kind in FIELDS.items() for name in getattr(trace, field)}
    needs |= {Need(Kind.MODULE, name.partition(".")[0]) for name in requires}
    folders = dict(places)
    # `mjcourse` may lie elsewhere on another machine, and is still the same.
    library_prefix = f"{folders['library'].rstrip('/')}/mjcourse/"
    ours = {n for n in needs if n.kind is Kind.OUTSIDE and n.name.startswith(library_prefix)}
    needs = needs - ours | ({Need(Kind.MODULE, "mjcourse")} if ours else set())
    for name, folder in folders.items():
        if len(folder) > 1 and folder in run.stdout:
            needs.add(Need(Kind.PLACE, name))
    # A module that was sought in vain was absent then, whatever is there by now.
    dependencies = [
        Dependency(need.kind, need.name, "" if need.kind is Kind.SOUGHT else state(need))
        for need in needs
    ]
    # What was read or listed is known better than whether it exists.
    contents = {*trace.files, *trace.folders}
    for field, kind in ANSWERS.items():
        dependencies += [
            Dependency(kind, name, answer)
            for name, answer in getattr(trace, field)
            if kind is Kind.STATUS or name not in contents
        ]
    return tuple(sorted(dependencies, key=lambda d: (d.kind.value, d.name, d.state)))


def parse_sought(name: str) -> tuple[str, tuple[str, ...]]:
    """The folder and the modules in the name of a need of kind `SOUGHT`."""
    folder, _, modules = name.rpartition("/{")
    return folder, tuple(modules.removesuffix("}").split(","))


@functools.lru_cache(maxsize=64)
def sought_files(name: str) -> tuple[str, ...]:
    """The files that were looked for, given the name of a need of kind `SOUGHT`."""
    folder, modules = parse_sought(name)
    prefix = f"{folder}/" if folder else ""  # the project's own folder has no name
    return tuple(f"{prefix}{m}{end}" for m in modules for end in (".py", "/__init__.py"))


def reason_forgotten(run: ScriptRun) -> str:
    """Why a run is not remembered, as the end of a sentence; empty where it is."""
    match run.outcome:
        case Outcome.TIMEOUT:
            return "it was stopped after its time limit"
        case Outcome.KILLED:
            return "a signal ended it"
        case Outcome.SKIPPED:
            return f"it needs {', '.join(run.missing)}"
        case Outcome.NORUN:
            return "its lesson says `norun`"
        case Outcome.UNRECORDED:
            return "nothing is recorded of it"
        case Outcome.FAILED if _MISSING_MODULE.search(run.stderr):
            return "it did not find a module"
        case Outcome.OK | Outcome.FAILED | Outcome.OUTPUT_LIMIT | Outcome.ENCODING:
            pass
    if run.trace is None:
        return "what it reads could not be observed"
    changing = next((p for p in run.trace.outside if p.startswith(_VOLATILE_FOLDERS)), None)
    if changing is not None and changing != "/dev/null":
        return f"it reads {changing}"
    return run.trace.opaque


# --- what changed


def input_changes(old: Inputs, new: Inputs) -> list[str]:
    """The differences between two inputs, each as a clause."""
    clauses = ["its text changed"] if old.text != new.text else []
    before, now = dict(old.conditions), dict(new.conditions)
    names = sorted({*before, *now})
    for clause, old_value, new_value in (
        ("its arguments changed", " ".join(old.args), " ".join(new.args)),
        ("its option `timeout` changed", f"{old.timeout:g}", f"{new.timeout:g}"),
        ("its option `requires` changed", " ".join(old.requires), " ".join(new.requires)),
        *((name, before.get(name, "unset"), now.get(name, "unset")) for name in names),
    ):
        if old_value != new_value:
            clauses.append(f"{clause}: {old_value or 'none'} → {new_value or 'none'}")
    if old.version != new.version:
        clauses.append("this version of coursebuild runs scripts in another way")
    return clauses


def state_changes(
    dependencies: Iterable[Dependency], state: Callable[[Need], str]
) -> Iterator[str]:
    """The dependencies whose state has changed, each as a clause; none where a result holds."""
    for dependency in dependencies:
        name, before, now = dependency.name, dependency.state, state(dependency.need)
        if now == before and now != SPECIAL:  # a device may give something else each time
            continue
        match dependency.kind:
            case Kind.STATUS if ABSENT not in (before, now):
                yield f"the size, time or mode of {name} changed"
            case Kind.FILE | Kind.OUTSIDE | Kind.EXISTENCE | Kind.STATUS:
                yield f"{name} {_became(before, now)}"
            case Kind.LISTING if ABSENT in (before, now):
                yield f"the folder {name} {_became(before, now)}"
            case Kind.LISTING:
                yield f"the list of files in {name} changed"
            case Kind.SOUGHT:
                yield f"{parse_sought(name)[0]} has now a file with the name of a module: {now}"
            case Kind.MODULE if not now:
                yield f"{name} is no longer installed (it was {before})"
            case Kind.MODULE if not before:
                yield f"{name} is installed now: {now}"
            case Kind.MODULE if now.startswith("files "):
                yield f"the files of the module {name} changed"
            case Kind.MODULE:
                yield f"{before} → {now}"
            case Kind.PLACE:
                yield f"it printed a path of this machine: {before} → {now}"


def _became(old: str, now: str) -> str:
    if now == ABSENT:
        return "is gone"
    if old == ABSENT:
        return "appeared"
    if now in (FOLDER, FILE):
        return f"is a {now} now"
    if now.startswith("unreadable"):
        return f"is {now}"
    return "may have changed" if now == SPECIAL else "changed"


def is_there(dependency: Dependency) -> bool:
    """Whether a script found what it looked for; what was not there matters only when it comes."""
    return dependency.kind is not Kind.SOUGHT and dependency.state not in (ABSENT, "")


def describe(dependency: Dependency) -> str:
    """A dependency that is there, as a line of a list."""
    match dependency.kind:
        case Kind.FILE | Kind.OUTSIDE | Kind.SOUGHT:
            return dependency.name
        case Kind.EXISTENCE:
            return f"that {dependency.name} exists"
        case Kind.STATUS:
            return f"the size and times of {dependency.name}"
        case Kind.LISTING:
            return f"the list of files in {dependency.name or '.'}"
        case Kind.MODULE:
            if dependency.state.startswith("files "):
                return f"the files of the module {dependency.name}"
            return dependency.state
        case Kind.PLACE:
            return f"that {dependency.state} is where it is: it printed that"
