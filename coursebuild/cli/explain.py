"""`coursebuild explain`: say what a rule means, or why something would run again."""

from __future__ import annotations

import argparse
import sys

from coursebuild.cli.arguments import add_format, options_of, style_of
from coursebuild.cli.output import CLEAN, write
from coursebuild.core.files.resources import rules_page
from coursebuild.core.registry import installed_features
from coursebuild.core.text.rules import RULES
from coursebuild.pipeline.explain import explain
from coursebuild.report.explained import explanation_text, rule_text
from coursebuild.report.values import json_text, plain

EXAMPLES = """\
examples:
  coursebuild explain output-drift             a rule, as in error[output-drift]
  coursebuild explain 4.2                      would the scripts of a lesson run, and why?
  coursebuild explain models/pendulum.xml      what depends on this file?
"""


def declare(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "name",
        metavar="RULE|PATH",
        help="a rule, or a script, lab, lesson, page, model, or any file of the project",
    )
    add_format(parser, "text", "json")


def run(arguments: argparse.Namespace) -> int:
    """Print what is known of a rule or a path."""
    installed_features()  # they have rules of their own
    rule = RULES.get(arguments.name)
    if rule is not None:
        text = rule_text(rule, rules_page())
        return write(json_text(rule) if arguments.format == "json" else text, CLEAN)
    explanation = explain(options_of(arguments), arguments.name)
    if arguments.format == "json":
        return write(json_text(plain(explanation, runs="own", shown_in="shown")), CLEAN)
    return write(explanation_text(explanation, style_of(sys.stdout)), CLEAN)
