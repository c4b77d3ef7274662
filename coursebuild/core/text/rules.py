"""The closed catalogue of rules: every mistake that the tool can name.

A fixture in `tests/fixtures/rules/` shows for each rule what an author sees.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

from msgspec import Struct

from coursebuild import MANUAL

Severity: TypeAlias = Literal["error", "warning", "hint"]
"""An error is certain, and keeps the site from being published. A warning is certain too, but
readers lose little; it can be silenced, with a reason. A hint is likely only, and changes
nothing."""


class Rule(Struct, frozen=True):
    """One entry of the catalogue."""

    name: str
    severity: Severity
    summary: str


def rule_address(name: str) -> str:
    """The address at which the manual explains a rule; empty where that is not known."""
    return MANUAL and f"{MANUAL}rules.html#{name}"


GROUPS: dict[str, dict[str, str]] = {
    "Files": {
        "file-encoding": "A file is not UTF-8 text.",
        "file-unreadable": "A file cannot be read, or a link to it leads out of the project.",
        "text-long": "A text is longer than `[limits]` in the map allows.",
        "control-character": "A text contains an invisible character.",
        "merge-conflict": "A file still holds the marks of a merge conflict.",
    },
    "The course map": {
        "map-missing": "There is no `content/course.toml`.",
        "map-syntax": "`course.toml` is not valid TOML.",
        "id-repeated": "Two levels, lessons or pages have the same id.",
        "lesson-unlisted": "The map does not name a file in `content/lessons/`.",
        "page-unlisted": "The map does not name a file in `content/pages/`.",
        "file-unlisted": "The map does not name a Markdown file elsewhere in `content/`, and no "
        "page shows it or links to it.",
        "lesson-missing": "A lesson of the map has no file.",
        "lesson-planned-file": "A planned lesson has a file.",
        "lesson-empty": "A complete lesson has no text, or only headings.",
        "draft-empty": "The file of a draft is empty.",
        "prerequisite-unknown": "A prerequisite is not a lesson of the map.",
        "path-unknown": "A path leads to what is no lesson of the map.",
        "prerequisite-cycle": "Lessons require each other in a circle.",
        "page-missing": "A page of the map has no file.",
        "engine-version": "The installed MuJoCo is not the version that the course needs.",
        "script-python": "The interpreter named by the map cannot run scripts.",
        "silence-rule": "A `[[silence]]` entry names an unknown rule or an error, or gives no "
        "reason.",
        "unproven-name": "An entry of `unproven` names no script, or one that always runs.",
        "no-lessons": "The course has neither a written lesson nor a page with a `section`.",
        "no-scripts": "No script can run on this machine, so nothing was verified.",
        "feature-broken": "A feature of the course cannot be loaded.",
        "feature-missing": "A fence or the list of sources needs a package that is not installed.",
    },
    "The theme": {
        "theme-file": "A file of the theme is missing or not allowed.",
        "theme-contrast": "Text in the accent colour is hard to read on the page.",
        "template-unknown": "No template of coursebuild has this name.",
        "template-broken": "A template of the course cannot be read, or fails.",
        "template-outdated": "A template was copied from an older version of coursebuild.",
    },
    "Fields of JSON and TOML": {
        "json-syntax": "The JSON in a fence is malformed.",
        "field-unknown": "There is no such field.",
        "field-missing": "A required field is missing.",
        "field-repeated": "A field is given twice.",
        "field-type": "A value has the wrong type.",
        "field-value": "A value has the right type but is not allowed.",
    },
    "Markdown": {
        "front-matter": "A lesson begins with front matter; coursebuild reads none.",
        "heading-top": "A lesson has a heading of level 1, or a page has one other than its title.",
        "nesting-deep": "Quotations, lists or footnotes are nested too deeply.",
        "heading-skip": "A heading skips a level.",
        "shown-as-written": "A character of Markdown would be shown.",
        "heading-empty": "A heading has no text.",
        "heading-attributes": "The attributes after a heading cannot be read.",
        "anchor-repeated": "Two things on a page have the same anchor.",
        "markup-foreign": "A block of another tool would be shown as it is written.",
        "number-form": "A number that is given cannot be read.",
        "label-attribute": "A label cannot be read, or stands where no label may.",
        "table-cells": "A row of a table has more cells than its header.",
        "footnote-undefined": "A footnote is used but not defined.",
        "footnote-unused": "A footnote is defined but not used.",
        "footnote-repeated": "A footnote is defined twice.",
        "html-unbalanced": "An HTML element is not closed in its block, or not opened.",
        "html-forbidden": "An HTML element, attribute or address is not allowed.",
        "callout-unknown": "A callout is of an unknown kind.",
        "io-missing": "An io card lacks a line.",
        "io-repeated": "An io card has a line twice.",
        "io-order": "The lines of an io card are not in the order INPUT, PROCESS, OUTPUT.",
        "io-stray": "An io card begins with text that belongs to no line.",
    },
    "Code blocks": {
        "fence-unclosed": "A code block is not closed, or not before the next one.",
        "fence-info": "The first line of a fence cannot be read.",
        "fence-key-unknown": "This kind of block has no such key.",
        "fence-key-repeated": "A fence has the same key twice.",
        "fence-key-value": "A key of a fence has a value that it does not take.",
    },
    "Formulas, terms and symbols": {
        "math-syntax": "A formula cannot be read.",
        "math-command": "A command in a formula has lost its backslash.",
        "math-brackets": "The brackets of a formula do not match.",
        "math-unclosed": "A displayed formula is not closed.",
        "term-attribute": "The attribute that defines a term cannot be read.",
        "term-place": "A term is defined outside a paragraph.",
        "progress-id-repeated": "Two quizzes or exercises of the course have the same id.",
        "term-repeated": "The course defines a term twice.",
        "symbol-attribute": "The braces that declare a symbol cannot be read.",
        "symbol-formula": "The formula declared as a symbol is not a single symbol.",
        "unit-unknown": "The unit of an answer or a symbol does not exist.",
        "symbol-repeated": "A text gives a symbol its meaning twice.",
    },
    "Figures and images": {
        "figure-unshown": "No paragraph below a script shows its figure.",
        "figure-window": "A script opens a window for a figure, which a page cannot show.",
        "figure-missing": "A script does not draw the figure that it names.",
        "figure-unreadable": "A drawn figure cannot be shown.",
        "figure-drift": "A recorded figure differs from what its script draws now.",
        "image-remote": "An image, a video or a frame is on another host.",
        "image-forbidden": "A picture is not what its name says, or holds what is not allowed.",
        "image-alt": "An image has no alternative text.",
    },
    "Links and bound numbers": {
        "link-lesson": "A link or mention names a lesson that is not in the map.",
        "link-page": "A link names a page that is not in the map.",
        "link-text": "A link has no text or no address, or its text names another lesson.",
        "link-term": "A link names a term that no lesson defines.",
        "link-model": "A link names a model that is not in `models/`.",
        "link-example": "A link names a script that is in no lesson.",
        "link-file": "A link or image names a file that does not exist.",
        "link-anchor": "A link names an anchor that its page does not have.",
        "link-scheme": "A link has a scheme that is not allowed.",
        "link-broken": "An internal link of a built page leads nowhere.",
        "binding-orphan": "There is no recorded output to check a bound number against.",
        "binding-mismatch": "A bound number is not a printed one, rounded.",
        "unit-unproven": "No script prints the unit of a bound number, or of a recorded column.",
        "binding-volatile": "A number is bound to an output that varies.",
        "binding-attribute": "The attribute of a bound number cannot be read.",
    },
    "Scripts": {
        "script-path": "A script cannot have this path.",
        "script-kind": "A block with `file=` is not `python`, so it is not run.",
        "source-part": "A block differs from the file that it shows.",
        "script-unproven": "A script was not run, so nothing proves its output.",
        "script-repeated": "Two blocks have the same path.",
        "script-part": "A part of a script has no beginning above it.",
        "python-syntax": "A script cannot be parsed.",
        "example-edited": "An extracted file was changed by hand.",
        "script-failed": "A script exited with an error.",
        "script-timeout": "A script ran past its time limit.",
        "script-killed": "A script was ended by a signal.",
        "script-output-limit": "A script printed more than 1 MiB.",
        "script-encoding": "A script printed bytes that are not UTF-8.",
        "script-unrepeatable": "A script behaves differently than before, though nothing that it "
        "is known to depend on has changed.",
        "script-silent": "An output is recorded, but the script printed nothing.",
        "script-diverged": "A simulation in a script diverged, and its fence does not say "
        "`diverges`.",
        "script-stable": "A fence says `diverges`, but no simulation diverged.",
        "script-penetration": "Bodies in a simulation overlap deeply.",
        "script-shallow": "A fence says `deep`, but no bodies overlap deeply.",
        "script-writes": "A script writes outside its temporary folder.",
        "script-connects": "A script uses the network.",
        "download-failed": "What readers download of a script does not run alone, or prints "
        "something else; its page has no button then.",
    },
    "Recorded outputs": {
        "recording-orphan": "A recorded output has no script above it, or code that nothing runs.",
        "recording-body": "Below `Output:` is neither an output block nor a table with rows, "
        "or nothing of it is compared.",
        "recording-keys": "Keys of comparison contradict each other, or their block is not "
        "compared.",
        "recording-loose": "With this `atol`, 0 would do for each number of an output.",
        "recorded-run": "The run of a script with `record=once` is missing or out of date.",
        "output-drift": "A recorded output differs from what the script prints.",
        "output-ambiguous": "A shown value may be any of several printed ones.",
        "output-unmarked": "A text is what a script printed, but is not compared.",
        "output-noise": "Digits of an output change if initial states are moved by 1e-12.",
        "output-unstable": "Two runs of a script print different lines.",
        "output-not-updatable": "`update` cannot rewrite a recorded output.",
    },
    "Models and reports": {
        "model-error": "A model in `models/` does not compile.",
        "model-timeout": "The models of the course take too long to compile.",
        "toml-syntax": "A file of scenarios (`models/NAME.toml`) is not valid TOML.",
        "scenario-model": "A file of scenarios has no model, or a scenario does not fit it.",
        "report-stale": "A recorded report no longer fits the course, so no page shows it.",
        "bench-model": "The model of a report is not in `models/`.",
        "bench-scenario": "The model has no such scenario or sweep.",
        "bench-text": "A `bench` fence is not empty.",
        "bench-unrecorded": "No report of this model was recorded.",
        "mjcf-error": "An MJCF block does not compile.",
        "mjcf-compiles": "An MJCF block compiles, but its fence says `error=`.",
        "mjcf-message": "An MJCF block fails with another message than its fence says.",
    },
    "Labs": {
        "lab-kind": "A lab is of an unknown kind.",
        "lab-model": "A lab names a model that is not in `models/`.",
        "lab-name": "A lab or its code uses a name that does not exist, as of a keyframe, a "
        "control or `data.qps`.",
        "lab-code": "A lab's code is not JavaScript, or an expression cannot be read or assigns.",
        "lab-throws": "The code of a lab throws an exception.",
        "lab-value": "The value of an expression is not a finite number.",
        "lab-warning": "MuJoCo raised a warning while a lab was tried.",
        "lab-diverged": "The simulation of a lab diverges.",
        "lab-penetration": "Bodies in a lab overlap deeply.",
        "lab-shallow": "A lab says `deep`, but no bodies overlap deeply.",
        "lab-expect": "A claim of a lab does not hold.",
        "lab-goal": "The goal of a lab is reached by doing nothing, or not by its log.",
        "lab-parity": "A lab runs differently in the browser than in native MuJoCo or SciPy.",
        "lab-endless": "Equations take too many steps, or an event has no end or never happens.",
        "lab-points": "Printed numbers do not lie on the curve of a lab.",
        "lab-reset": "A reset does not restore the initial state of a lab.",
        "lab-shared": "A lab changes objects that all labs of the page share.",
        "lab-timeout": "Trying a lab takes too much time or memory.",
        "lab-engine": "An engine ended while a lab was tried, or refused its model.",
    },
    "Exercises": {
        "exercise-solution": "The solution of an exercise fails a trial, or cannot be tried.",
        "exercise-start": "The start of an exercise passes all its trials.",
        "exercise-name": "The start of an exercise names what the engine does not have.",
        "exercise-wrong": "A wrong attempt passes the trial that it names, or cannot be tried.",
    },
    "Quizzes": {
        "question-id-repeated": "Two questions of a quiz have the same id.",
        "quiz-answer": "The answer of a question is not one of its options.",
        "quiz-output": "An `output` question names a script or line that was not printed or is "
        "not compared.",
        "quiz-gate": "A prediction has nothing below it to hide, or no lab to run.",
        "package-reduced": "A QTI package cannot hold a question as the page shows it.",
    },
}
_MILD: dict[str, Severity] = {"shown-as-written": "hint"}
_MILD |= dict.fromkeys(
    """
    draft-empty unit-unproven file-unlisted no-scripts theme-contrast template-outdated heading-skip
    markup-foreign math-brackets math-command symbol-repeated footnote-unused image-alt
    recording-loose script-unrepeatable script-penetration script-writes script-connects
    output-noise report-stale bench-unrecorded lab-penetration lab-reset exercise-name
    package-reduced
    """.split(),
    "warning",
)

RULES: dict[str, Rule] = {
    name: Rule(name, _MILD.get(name, "error"), summary)
    for group in GROUPS.values()
    for name, summary in group.items()
}
