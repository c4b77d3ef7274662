"""The interface of coursebuild: the only module of it that features and plugins import from.

A name here keeps its meaning; one that goes is announced in CHANGELOG.md, and `API` counts the
versions. All other modules of coursebuild may change any day. docs/reference/api.md, which is made
from this file, has a line on each name; docs/how-to/features.md shows their use.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from coursebuild.core import model
from coursebuild.core.engine.lifetime import end_with_parent
from coursebuild.core.engine.store import Store
from coursebuild.core.engine.tool import step_key
from coursebuild.core.features import (
    API,
    Command,
    Executor,
    ExecutorKind,
    Exporter,
    Feature,
    FenceKind,
    IndexReader,
    MarkdownWriter,
    ModelPart,
    PageCopy,
    PageKind,
    PagePart,
    Picture,
    Trial,
    TrialContext,
    TrialOutcome,
    TrialRun,
    Trials,
)
from coursebuild.core.files.course_root import DECISIVE, is_dropping
from coursebuild.core.files.errors import EffectError, UsageError
from coursebuild.core.files.locks import temporary_folder
from coursebuild.core.files.write import resolve_inside
from coursebuild.core.model import (
    Block,
    Course,
    Document,
    FeatureBlock,
    Inline,
    Lesson,
    MjcfModel,
    Recording,
    document_blocks,
    document_scripts,
    find_blocks,
)
from coursebuild.core.model.results import (
    CachedFile,
    FileList,
    Mathml,
    ModelFacts,
    Outcome,
    OutputFile,
    PublishedTrials,
    Results,
    ScriptJob,
    ScriptRun,
    SiteFile,
    TrialResult,
)
from coursebuild.core.pages import marks, urls
from coursebuild.core.pages.assets import Assets
from coursebuild.core.pages.context import (
    Citations,
    ExportContext,
    PageContext,
    PageInputs,
    SiteContext,
)
from coursebuild.core.pages.library import Library
from coursebuild.core.pages.renderer import Renderer
from coursebuild.core.pages.urls import Place
from coursebuild.core.run import gate
from coursebuild.core.run.dependencies import Dependency, Inputs, dependencies_of
from coursebuild.core.run.environments import deciding_versions
from coursebuild.core.run.run_store import States
from coursebuild.core.run.sandbox import find_sandbox
from coursebuild.core.run.script_environment import Interpreter
from coursebuild.core.run.script_server import RunAll, RunStoppedError, ScriptServer
from coursebuild.core.syntax.decode import decode
from coursebuild.core.syntax.fence import Fence, Prose, TextParser
from coursebuild.core.syntax.json_text import parse_json
from coursebuild.core.syntax.toml_text import parse_toml
from coursebuild.core.text.diagnostics import (
    Diagnostic,
    Edit,
    Fix,
    Note,
    Parsed,
    diagnose,
    did_you_mean,
)
from coursebuild.core.text.rules import Rule
from coursebuild.core.text.source import Excerpt, Source, Span
from coursebuild.output import CLEAN, FAILURE, write

if TYPE_CHECKING:
    from coursebuild.pipeline.arguments import add_running, options_of, print_report
    from coursebuild.pipeline.check import check
    from coursebuild.pipeline.load import load_course
    from coursebuild.pipeline.options import Options
    from coursebuild.report import Report

# --- What a feature has
__all__ = [
    "API",
    "Command",
    "Executor",
    "ExecutorKind",
    "Exporter",
    "Feature",
    "FenceKind",
    "ModelPart",
    "PageCopy",
    "PageKind",
    "PagePart",
    "Picture",
    "Rule",
    "Trials",
]
# --- Text and its places
__all__ += ["Excerpt", "Source", "Span"]
# --- Mistakes of an author
__all__ += ["Diagnostic", "Edit", "Fix", "Note", "Parsed", "diagnose", "did_you_mean"]
# --- From a fence to its block
__all__ += [
    "FeatureBlock",
    "Fence",
    "Prose",
    "TextParser",
    "decode",
    "parse_json",
    "parse_toml",
]
# --- The course
__all__ += [
    "Block",
    "Course",
    "Document",
    "Inline",
    "Lesson",
    "MjcfModel",
    "Recording",
    "document_blocks",
    "document_scripts",
    "find_blocks",
    "model",
]
# --- What was run
__all__ += ["Mathml", "ModelFacts", "Outcome", "Results", "ScriptRun"]
# --- Pages and copies
__all__ += [
    "Citations",
    "IndexReader",
    "Library",
    "MarkdownWriter",
    "PageContext",
    "PageInputs",
    "Place",
    "Renderer",
    "marks",
    "urls",
]
# --- Files of a site, and exports
__all__ += [
    "CachedFile",
    "ExportContext",
    "FileList",
    "OutputFile",
    "SiteContext",
    "SiteFile",
    "step_key",
]
# --- Commands
__all__ += [
    "CLEAN",
    "FAILURE",
    "EffectError",
    "Options",
    "Report",
    "UsageError",
    "add_running",
    "check",
    "load_course",
    "options_of",
    "print_report",
    "write",
]
# --- Trials
__all__ += [
    "Assets",
    "Inputs",
    "PublishedTrials",
    "Trial",
    "TrialContext",
    "TrialOutcome",
    "TrialResult",
    "TrialRun",
]
# --- Work in other processes
__all__ += [
    "DECISIVE",
    "Dependency",
    "Interpreter",
    "RunAll",
    "RunStoppedError",
    "ScriptJob",
    "ScriptServer",
    "States",
    "Store",
    "deciding_versions",
    "dependencies_of",
    "end_with_parent",
    "find_sandbox",
    "gate",
    "is_dropping",
    "resolve_inside",
    "temporary_folder",
]

_COMMANDS = {
    "Options": "coursebuild.pipeline.options",
    "Report": "coursebuild.report",
    "add_running": "coursebuild.pipeline.arguments",
    "check": "coursebuild.pipeline.check",
    "load_course": "coursebuild.pipeline.load",
    "options_of": "coursebuild.pipeline.arguments",
    "print_report": "coursebuild.pipeline.arguments",
}
"""What only commands need, by module: it is loaded when one asks for it."""


def __getattr__(name: str) -> Any:
    if name not in _COMMANDS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}", name=name)
    return getattr(importlib.import_module(_COMMANDS[name]), name)
