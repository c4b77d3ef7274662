"""What running a course found: values made by runners, read by comparisons, reports and pages.

Entry points: `ScriptRun`, `Verdict`. They stand beside the model because the stages that make them
and those that read them don't import each other.
"""

from __future__ import annotations

import enum
from collections.abc import Callable, Iterable
from typing import Annotated, Literal, TypeAlias

from msgspec import Meta, Struct

from coursebuild.core.model import Comparison, Limits, Recording
from coursebuild.core.text.source import Span


class Outcome(enum.Enum):
    """How the run of a script ended."""

    OK = "ok"
    FAILED = "failed"
    """It exited with a status other than 0."""
    TIMEOUT = "timeout"
    KILLED = "killed"
    """A signal ended it."""
    OUTPUT_LIMIT = "output-limit"
    ENCODING = "encoding"
    """It printed bytes that are not UTF-8."""
    SKIPPED = "skipped"
    """A module that it requires is missing."""
    NORUN = "norun"
    """The author said not to run it."""


class ScriptJob(Struct, frozen=True):
    """A script to run: everything that the runner needs to know."""

    path: str
    """POSIX path relative to the project root, e.g. `examples/l4_2.py`."""
    args: tuple[str, ...]
    timeout: float
    """Seconds."""
    requires: tuple[str, ...]
    perturbation: int = 0
    """From 1: its initial states are moved a little, in one of several directions; 0: they are
    not; −1: each of its steps is made as two of half the timestep."""
    packages: tuple[str, ...] = ()
    """Folders of the project that it imports from, after its own and before all others."""
    environment: tuple[tuple[str, str], ...] = ()
    """Variables that the course sets."""
    writes: tuple[str, ...] = ()
    """Folders of the project that it may write into."""
    figures: tuple[str, ...] = ()
    """Names of the files that it draws."""
    memory: int = Limits().scripts
    """MiB that it may take, where the system can see to that."""


class Sign(enum.Enum):
    """What shows that a simulation was lost."""

    POSITIONS = "positions"
    """MuJoCo warned of bad ones, as of the next two."""
    VELOCITIES = "velocities"
    ACCELERATIONS = "accelerations"
    STATE = "state"
    """It was not finite when it was looked at."""
    CONTACT = "contact"
    """Bodies lay deep in each other when they were looked at, of which MuJoCo does not warn."""


class Divergence(Struct, frozen=True):
    """A simulation of a script that was lost on the way."""

    sign: Sign
    time: str
    """Simulated time, s, as MuJoCo wrote it."""
    model: str
    """The model's name; empty where it has none or is not known."""
    path: str
    """The script that was being executed, relative to the project; empty where none was."""
    line: int
    """Its line, from 1; 0 where it is not known."""
    depth: str = ""
    """Of a contact: how deep it was, m."""
    geoms: tuple[str, ...] = ()
    """Of a contact: the names of its geoms, or what stands for them, as words."""


_NUMBER = r"(-?0x[01](\.[0-9a-f]{1,13})?p[+-][0-9]{1,4}|-?inf|nan)"
EndState: TypeAlias = Annotated[
    str, Meta(pattern=rf"^[0-9]{{1,9}} [0-9]{{1,9}}( {_NUMBER}){{2,}}$")
]


class EffectKind(enum.Enum):
    """What a script does that reaches beyond it."""

    WRITE = "w"
    """Outside its temporary folder, where it may not."""
    CONNECTION = "c"


class Effect(Struct, frozen=True, rename={"target": "what"}):
    """Something that a line of a script does beyond the script."""

    kind: EffectKind
    target: str
    """The path that it writes, relative to the project for a file of it; or the address."""
    path: str
    """The file of the project with the line; empty where it is not known."""
    line: int


class Trace(Struct, frozen=True):
    """What a script looked at while it ran: all that its result depends on, beside its text.

    Project paths are POSIX and relative to the root. Each tuple is sorted, without repeats.
    """

    files: tuple[str, ...]
    """Files of the project that it read, or tried to read and that were not there. Its own file and
    files that it wrote itself before are not among them; a compiled module stands as its source."""
    folders: tuple[str, ...]
    """Folders of the project that it listed."""
    outside: tuple[str, ...]
    """Absolute paths of files read that belong neither to the project nor to an installed package
    nor to Python."""
    modules: tuple[str, ...]
    """Top-level names of installed packages' modules that it imported; none of Python's own."""
    opaque: str
    """Why there may be more, as words that end a sentence ("it starts other programs"); empty where
    this is everything."""
    divergences: tuple[Divergence, ...] = ()
    """The simulations that were lost, in the order in which it was noticed, without repeats."""
    moved: bool = False
    """Whether there was an initial state to be moved, or a step to be halved, of a run that was to
    do so."""
    states: tuple[EndState, ...] = ()
    """Of such a run, for each `MjData` in words: its number in the order of their first use, the
    length of `qpos`, the sizes that |qpos| and |qvel| are compared by (at least the largest since
    its simulation began), and the `qpos` and `qvel` that it ended with, as hexadecimal numbers."""
    effects: tuple[Effect, ...] = ()
    """What it wrote outside its temporary folder, and whom it asked, once for each line."""
    sought: tuple[str, ...] = ()
    """Modules that it looked for in vain in a folder of the project, such as those that would have
    been imported instead of Python's own: `folder/{one,two}`."""


class ScriptRun(Struct, frozen=True):
    """What a script did."""

    path: str
    outcome: Outcome
    status: int
    """Exit status; the signal's number where one ended it."""
    stdout: str
    """LF line ends."""
    stderr: str
    """The end of it (64 KiB), with extracted paths still as the interpreter wrote them."""
    seconds: float
    missing: tuple[str, ...] = ()
    """Modules that it requires and that are not there."""
    cached: bool = False
    trace: Trace | None = None
    """What it looked at; `None` where nobody watched."""
    recorded: str = ""
    """When and where it was made, of a run that the course keeps."""
    figures: tuple[tuple[str, bytes], ...] = ()
    """The files that it was to draw and did, by name."""


class DriftKind(enum.Enum):
    """The class of a difference between recorded and printed output."""

    ROUNDING = "rounding"
    """Only the last recorded place of numbers differs."""
    NUMERIC = "numeric"
    TEXT = "text"
    MISSING = "missing lines"
    EXTRA = "extra lines"


class Change(Struct, frozen=True):
    """One difference.

    For a number `relative_error` and `digits` say how far apart the two values are.
    """

    kind: DriftKind
    span: Span
    """In the lesson: the number, the text, the missing line, or the place where extra lines would
    stand."""
    recorded: str
    printed: str
    relative_error: float | None = None
    digits: int | None = None
    """Leading significant digits that agree."""


class Verdict(Struct, frozen=True):
    """The comparison of one recorded output with a run."""

    recording: Recording
    comparison: Comparison
    """What was used: the fence's own or the course's default."""
    status: Literal["verified", "drift", "volatile", "unchecked"]
    """`unchecked`: the script did not run to its end."""
    changes: tuple[Change, ...] = ()


class Formula(Struct, frozen=True):
    """A formula to typeset."""

    tex: str
    display: bool


class MathError(Struct, frozen=True):
    """Why a formula does not parse.

    `position` is an offset in code points into the TeX, `None` where unknown.
    """

    message: str
    position: int | None


class CompileResult(Struct, frozen=True):
    """What compiling a piece of MJCF gave; `error` is empty when it compiled."""

    error: str
    line: int | None = None
    """Line of the error in the text that was compiled, from 1."""
    facts: ModelFacts | None = None


class ModelFacts(Struct, frozen=True):
    """What a compiled model holds, for its page and for checking the names that labs use."""

    bodies: int
    """Without the world."""
    geoms: int
    joints: int
    nq: int
    nv: int
    nu: int
    timestep: float
    """s."""
    integrator: str
    total_mass: float
    """kg."""
    keyframes: tuple[str, ...]
    """Names; an unnamed one is empty."""
    sites: tuple[str, ...]
    body_names: tuple[str, ...]
    includes: tuple[str, ...] = ()
    """Files that the model pulls in, relative to the project root; absolute if they lie outside."""
    sensors: tuple[str, ...] = ()


class TrialLine(Struct, frozen=True):
    """How a trial did, as a report lists it."""

    name: str
    """Unique in the course: `4.2-lab-1`."""
    title: str
    lesson: str
    """Id of its lesson or page."""
    status: str
    """`ok` or `failed`."""
    seconds: float = 0.0
    """Wall time."""
    steps_per_second: int | None = None
    """Of a simulation; `None` where it did not come to its end."""
    tried: int = 0
    """How many things were tried."""
    parity: str = ""
    """How it compares with native MuJoCo, in words; empty where it was not compared."""
    cached: bool = False
    unexported: str = ""
    """Why its page offers no Python script, in words."""
    fill: float | None = None
    """The part of its picture that what moves fills, in the mean; `None` where nothing does."""


class TrialResult(Struct, frozen=True):
    """What became of a trial, and what its page needs."""

    span: Span
    """What was tried, as it stands in its lesson, by which it is found again."""
    line: TrialLine
    output: Struct
    """Of a type of the feature's."""


class OutputFile(Struct, frozen=True):
    """A file of the site: its path there (POSIX, relative) and its bytes."""

    path: str
    data: bytes

    def make(self) -> bytes:
        """Its bytes, as `CachedFile` gives them."""
        return self.data


class CachedFile(Struct, frozen=True):
    """A file of the site that need not be made where it was published under the same key before."""

    path: str
    """Its path in the site (POSIX, relative)."""
    key: str
    """A hash of all that its bytes depend on."""
    make: Callable[[], bytes]
    """Gives its bytes; called at most once, and not at all where the published file is whole."""


SiteFile: TypeAlias = OutputFile | CachedFile


class FileFacts(Struct, frozen=True):
    """What a list of a site's files says of one."""

    path: str
    """Its path in the site."""
    digest: str
    """SHA-256 of its bytes, in hexadecimal digits."""
    size: int
    """Bytes."""


class FileList(Struct, frozen=True):
    """A file of the site that is made of what all others are."""

    path: str
    """Its path in the site (POSIX, relative)."""
    key: str
    """A hash of all that its bytes depend on besides the other files."""
    make: Callable[[Iterable[FileFacts]], bytes]
    """Gives its bytes; the other files come sorted by path."""


class Results(Struct, frozen=True):
    """All that running a course found."""

    runs: tuple[ScriptRun, ...]
    verdicts: tuple[Verdict, ...]
    formulas: tuple[tuple[Formula, str | MathError], ...]
    """Each different formula of the course, and its MathML."""
    models: tuple[tuple[str, CompileResult], ...]
    """Each model of `models/` by name."""
    python: str
    """Version of the interpreter that ran the scripts."""
    engine: str
    """Version of MuJoCo that ran the scripts."""
    trials: tuple[TrialResult, ...] = ()


class Machine(Struct, frozen=True, forbid_unknown_fields=True):
    """Where something was measured; times mean nothing without it."""

    engine: str
    """Version of MuJoCo."""
    python: str
    numpy: str
    system: str
    """Operating system and kind of processor, such as `Linux x86_64`."""
    cpu: str
    """What the processor calls itself; empty where it does not say."""
    governor: str = ""
    """By which rule the system sets the processor's clock; empty where it does not say."""
    processors: int = 0
    """How many of them could be used; 0 where that was not recorded."""
    pinned: bool = False
    """Whether times were taken on one of them alone."""

    @property
    def hardware(self) -> str:
        """System and processor, in words."""
        parts = [self.system, self.cpu]
        if self.processors:
            many = f"{self.processors} processor{'s' if self.processors > 1 else ''}"
            parts.append(f"pinned to one of {many}" if self.pinned else many)
            parts.append(f"clock governor {self.governor or 'unknown'}")
        return ", ".join(filter(None, parts))
