"""The interface of coursebuild: the only module of it that features and plugins import from.

A name here keeps its meaning; one that goes is announced in CHANGELOG.md, and `API` counts the
versions. All other modules of coursebuild may change any day. docs/reference/api.md, which is made
from this file, has a line on each name; docs/how-to/features.md shows their use.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from coursebuild.core import model as model
from coursebuild.core.engine.store import Store as Store
from coursebuild.core.engine.tool import step_key as step_key
from coursebuild.core.features import API as API
from coursebuild.core.features import Command as Command
from coursebuild.core.features import Executor as Executor
from coursebuild.core.features import ExecutorKind as ExecutorKind
from coursebuild.core.features import Exporter as Exporter
from coursebuild.core.features import Feature as Feature
from coursebuild.core.features import FenceKind as FenceKind
from coursebuild.core.features import IndexReader as IndexReader
from coursebuild.core.features import MarkdownWriter as MarkdownWriter
from coursebuild.core.features import ModelPart as ModelPart
from coursebuild.core.features import PageCopy as PageCopy
from coursebuild.core.features import PageKind as PageKind
from coursebuild.core.features import PagePart as PagePart
from coursebuild.core.features import Picture as Picture
from coursebuild.core.features import Trial as Trial
from coursebuild.core.features import TrialContext as TrialContext
from coursebuild.core.features import TrialOutcome as TrialOutcome
from coursebuild.core.features import TrialRun as TrialRun
from coursebuild.core.features import Trials as Trials
from coursebuild.core.features import on_demand as on_demand
from coursebuild.core.files.course_root import DECISIVE as DECISIVE
from coursebuild.core.files.course_root import is_dropping as is_dropping
from coursebuild.core.files.errors import EffectError as EffectError
from coursebuild.core.files.errors import UsageError as UsageError
from coursebuild.core.files.locks import temporary_folder as temporary_folder
from coursebuild.core.files.write import resolve_inside as resolve_inside
from coursebuild.core.model import Block as Block
from coursebuild.core.model import Course as Course
from coursebuild.core.model import Document as Document
from coursebuild.core.model import FeatureBlock as FeatureBlock
from coursebuild.core.model import Inline as Inline
from coursebuild.core.model import Lesson as Lesson
from coursebuild.core.model import MjcfModel as MjcfModel
from coursebuild.core.model import Recording as Recording
from coursebuild.core.model import document_blocks as document_blocks
from coursebuild.core.model import document_scripts as document_scripts
from coursebuild.core.model import find_blocks as find_blocks
from coursebuild.core.model.results import CachedFile as CachedFile
from coursebuild.core.model.results import FileList as FileList
from coursebuild.core.model.results import Mathml as Mathml
from coursebuild.core.model.results import ModelFacts as ModelFacts
from coursebuild.core.model.results import Outcome as Outcome
from coursebuild.core.model.results import OutputFile as OutputFile
from coursebuild.core.model.results import PublishedTrials as PublishedTrials
from coursebuild.core.model.results import Results as Results
from coursebuild.core.model.results import ScriptJob as ScriptJob
from coursebuild.core.model.results import ScriptRun as ScriptRun
from coursebuild.core.model.results import SiteFile as SiteFile
from coursebuild.core.model.results import TrialResult as TrialResult
from coursebuild.core.pages import marks as marks
from coursebuild.core.pages import urls as urls
from coursebuild.core.pages.assets import Assets as Assets
from coursebuild.core.pages.context import Citations as Citations
from coursebuild.core.pages.context import ExportContext as ExportContext
from coursebuild.core.pages.context import PageContext as PageContext
from coursebuild.core.pages.context import PageInputs as PageInputs
from coursebuild.core.pages.context import SiteContext as SiteContext
from coursebuild.core.pages.library import Library as Library
from coursebuild.core.pages.renderer import Renderer as Renderer
from coursebuild.core.pages.urls import Place as Place
from coursebuild.core.run import gate as gate
from coursebuild.core.run.dependencies import Dependency as Dependency
from coursebuild.core.run.dependencies import Inputs as Inputs
from coursebuild.core.run.dependencies import dependencies_of as dependencies_of
from coursebuild.core.run.environments import deciding_versions as deciding_versions
from coursebuild.core.run.run_store import States as States
from coursebuild.core.run.sandbox import find_sandbox as find_sandbox
from coursebuild.core.run.script_environment import Interpreter as Interpreter
from coursebuild.core.run.script_server import RunAll as RunAll
from coursebuild.core.run.script_server import RunStoppedError as RunStoppedError
from coursebuild.core.run.script_server import ScriptServer as ScriptServer
from coursebuild.core.scripts.extract import is_run as is_run
from coursebuild.core.syntax.decode import decode as decode
from coursebuild.core.syntax.fence import Fence as Fence
from coursebuild.core.syntax.fence import Prose as Prose
from coursebuild.core.syntax.fence import TextParser as TextParser
from coursebuild.core.syntax.json_text import parse_json as parse_json
from coursebuild.core.syntax.toml_text import parse_toml as parse_toml
from coursebuild.core.text.diagnostics import Diagnostic as Diagnostic
from coursebuild.core.text.diagnostics import Edit as Edit
from coursebuild.core.text.diagnostics import Fix as Fix
from coursebuild.core.text.diagnostics import Note as Note
from coursebuild.core.text.diagnostics import Parsed as Parsed
from coursebuild.core.text.diagnostics import diagnose as diagnose
from coursebuild.core.text.diagnostics import did_you_mean as did_you_mean
from coursebuild.core.text.regex import regex as regex
from coursebuild.core.text.rules import Rule as Rule
from coursebuild.core.text.source import Excerpt as Excerpt
from coursebuild.core.text.source import Source as Source
from coursebuild.core.text.source import Span as Span
from coursebuild.output import CLEAN as CLEAN
from coursebuild.output import FAILURE as FAILURE
from coursebuild.output import write as write

if TYPE_CHECKING:
    from coursebuild.pipeline.arguments import add_running as add_running
    from coursebuild.pipeline.arguments import options_of as options_of
    from coursebuild.pipeline.arguments import print_report as print_report
    from coursebuild.pipeline.check import check as check
    from coursebuild.pipeline.load import load_course as load_course
    from coursebuild.pipeline.options import Options as Options
    from coursebuild.report import Report as Report

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
