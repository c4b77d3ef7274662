"""The closed catalogue of rules: every mistake that the tool can name.

Entry point: `RULES`, from name to `Rule`. `docs/reference/rules.md` is written from it, and
a fixture in `tests/fixtures/rules/` shows for each what an author sees.
"""

from __future__ import annotations

from typing import Literal, TypeAlias

from msgspec import Struct

from coursebuild import MANUAL

Severity: TypeAlias = Literal["error", "warning"]
"""An error keeps the site from being published; a warning can be silenced, with a reason."""


class Rule(Struct, frozen=True):
    """One entry of the catalogue."""

    name: str
    severity: Severity
    summary: str
    """Its meaning in one sentence, for the catalogue's page."""
    no_fix: str = ""
    """Why no diagnostic of it has an edit, in one sentence; empty where one may have."""


def rule_address(name: str) -> str:
    """The address at which the manual explains a rule; empty where that is not known."""
    return MANUAL and f"{MANUAL}rules.html#{name}"


_SUMMARIES = {
    # files
    "file-encoding": "A file of the course is not text in UTF-8.",
    "file-unreadable": "A file of the course cannot be read, or is reached through a link out of "
    "the project.",
    "text-long": "A text is longer than the course allows.",
    # the course map
    "map-missing": "There is no content/course.toml.",
    "map-syntax": "course.toml is not valid TOML.",
    "id-repeated": "A level, lesson or page id occurs twice in the course map.",
    "lesson-unlisted": "A file in content/lessons is not named by the course map.",
    "page-unlisted": "A file in content/pages is not named by the course map.",
    "file-unlisted": "A Markdown file elsewhere in content is not named by the course map, and "
    "nothing shows it or links to it.",
    "lesson-missing": "The course map names a lesson whose file is missing.",
    "lesson-planned-file": "A lesson that the map calls planned has a file.",
    "lesson-empty": "A complete lesson has nothing to read in its file, or headings only.",
    "draft-empty": "The file of a draft is empty.",
    "prerequisite-unknown": "A prerequisite is not a lesson of the map.",
    "prerequisite-cycle": "Lessons require each other in a circle.",
    "page-missing": "The course map names a page whose file is missing.",
    "engine-version": "The course needs another version of MuJoCo than the installed one.",
    "script-python": "The interpreter that the map names for scripts cannot run them.",
    "silence-rule": "An entry of `[[silence]]` names an unknown rule or an error, or gives no "
    "reason.",
    "unproven-name": "An entry of `unproven` in the course map names no script, or one that "
    "always runs.",
    "no-lessons": "The course has no lesson to publish, and no page in a `section`.",
    "no-scripts": "No script can run here, so nothing is verified.",
    # the theme
    "theme-file": "A file that the theme names is not there, or is not what it must be.",
    "theme-contrast": "The accent is too near to the colour of the page for text to be read in it.",
    "template-unknown": "The course has a template that coursebuild has not.",
    "template-broken": "A template of the course cannot be read, or fails.",
    "template-outdated": "The tool has changed the template that one of the course was copied "
    "from.",
    # fields of JSON and TOML
    "json-syntax": "The JSON in a fence is malformed.",
    "field-unknown": "A field that nothing reads.",
    "field-missing": "A required field is not there.",
    "field-repeated": "A field is given twice.",
    "field-type": "A value is of the wrong type.",
    "field-value": "A value has the right type but cannot be right.",
    # Markdown
    "front-matter": "A lesson begins with front matter; it is Markdown from its first line.",
    "heading-top": "A heading of level 1 in a lesson, or one over a page that is not its title in "
    "the map.",
    "nesting-deep": "Quotes, lists or footnotes nest too deep.",
    "heading-skip": "A heading skips a level.",
    "heading-empty": "A heading has no text.",
    "heading-attributes": "The attributes after a heading cannot be read.",
    "anchor-repeated": "Two things on a page have the same id.",
    "fence-unclosed": "A code fence is never closed, or not before another one begins.",
    "fence-indented": "A fence is indented, so its block is shown as text.",
    "fence-info": "The info string of a fence cannot be read.",
    "fence-key-unknown": "A fence has a key that its kind does not know.",
    "fence-key-repeated": "A fence has the same key twice.",
    "fence-key-value": "A key of a fence has an impossible value.",
    "fence-kind-near": "The kind of a code block looks like a misspelt one.",
    "fence-unread": "A code block of a kind that nothing reads holds a JSON object.",
    "feature-broken": "A feature of the course's own cannot be loaded.",
    "feature-missing": "A fence or the list of sources needs something that is not installed.",
    "math-syntax": "A formula does not parse.",
    "math-command": "A command of a formula has lost its backslash.",
    "math-brackets": "A formula has more opening brackets than closing ones, or fewer.",
    "math-unclosed": "Display math is never closed.",
    "math-unread": "A text has a dollar sign that was meant for a formula.",
    "text-repeated": "A line begins with the same words twice, or a heading stands twice.",
    "markup-unread": "Markdown, or an attribute in braces, is not whole, so that readers would see "
    "it as it is written.",
    "markup-foreign": "A text has markup of another tool, which would show it as it is written.",
    "control-character": "A text has a character that no reader can see.",
    "merge-conflict": "A file of the course holds both versions of a merge, with the marks between "
    "them.",
    "label-attribute": "The label of a formula, figure, table, listing or lab cannot be read, or "
    "stands where none may.",
    # terms and symbols
    "term-attribute": "The attribute by which a text defines a term cannot be read.",
    "term-place": "A term is defined outside a paragraph of the text.",
    "term-repeated": "Two places of the course define the same term.",
    "symbol-attribute": "What a symbol stands for cannot be read.",
    "symbol-formula": "What is declared as a symbol is not a single symbol.",
    "unit-unknown": "The unit of a quiz's answer or of a symbol does not exist.",
    "symbol-repeated": "A text says twice what a symbol stands for.",
    "table-cells": "A row of a table has more cells than its header, which would not be shown, or "
    "fewer.",
    "footnote-undefined": "A footnote is referred to but never defined.",
    "footnote-unused": "A footnote is defined but never referred to.",
    "footnote-repeated": "A footnote is defined twice.",
    "figure-unshown": "A script draws a figure that no paragraph below it shows.",
    "figure-window": "A script shows a figure in a window, so its page has none.",
    "figure-missing": "A script does not draw the figure that it names.",
    "figure-unreadable": "What a script drew cannot be shown.",
    "figure-drift": "A recorded figure differs from what its script draws now.",
    "image-remote": "A picture, a video or a frame comes from another host; a page shows only what "
    "the course holds.",
    "image-forbidden": "An SVG in the course has parts that are not allowed; its file would be "
    "published as it is.",
    "image-alt": "An image has no text alternative.",
    "html-unbalanced": "Raw HTML opens an element that it does not close, or closes one that is "
    "not open.",
    "html-forbidden": "Raw HTML has an element, an attribute or an address that the course does "
    "not allow.",
    # callouts and io
    "callout-unknown": "A callout is of an unknown kind.",
    "io-missing": "An io block lacks a line.",
    "io-repeated": "An io block has a line twice.",
    "io-order": "The lines of an io block are not in the order INPUT, PROCESS, OUTPUT.",
    "io-stray": "An io block begins with text that belongs to no line.",
    # links and numbers
    "link-lesson": "A link or mention names a lesson that the map does not have.",
    "link-level": "A mention names a level that the map does not have.",
    "link-page": "A link names a page that the map does not have.",
    "link-text": "The text of a link names another lesson or model than the one it leads to.",
    "link-term": "A link names a term that no lesson defines.",
    "link-model": "A link names a model that is not in models/.",
    "link-example": "A link names a script that no lesson has.",
    "link-file": "A relative link or image names a file that is not there.",
    "link-anchor": "A link names an anchor that its page does not have.",
    "link-scheme": "A link uses a scheme that a page must not have.",
    "link-broken": "An internal link of a built page leads nowhere.",
    "binding-orphan": "A bound number has no recorded output to be checked against.",
    "binding-mismatch": "A bound number is not a value that the script printed, rounded.",
    "binding-volatile": "A number is bound to what differs from run to run.",
    "binding-attribute": "The attribute of a bound number cannot be read.",
    # scripts and recorded outputs
    "script-path": "The path of a script is not one that a script may have.",
    "script-kind": "A block with a `file` is not of kind `python`, so nothing runs it.",
    "source-part": "A block does not show what the file that it names holds.",
    "script-unproven": "A script was not run, so nothing proves what the course shows of it.",
    "script-repeated": "Two blocks are extracted to the same path.",
    "python-syntax": "A Python block does not parse.",
    "recording-caption": "A `text` block looks like a recorded output, and is compared with "
    "nothing.",
    "recording-misspelt": "The caption of a recorded output or a figure looks misspelt.",
    "recording-orphan": "A recorded output has no script above it.",
    "recording-body": "`Output:` is followed by something that is not an output fence or a table "
    "with rows.",
    "recording-keys": "Keys of comparison contradict each other, or stand on a block that records "
    "nothing.",
    "example-edited": "An extracted file was changed by hand.",
    "script-failed": "A script exited with an error.",
    "script-timeout": "A script ran past its time limit.",
    "script-killed": "A script was ended by a signal.",
    "script-output-limit": "A script printed more than 1 MiB.",
    "script-encoding": "A script printed bytes that are not UTF-8.",
    "script-unrepeatable": "A script behaves differently than before, although nothing known to "
    "matter has changed.",
    "script-silent": "An output is recorded, but the script printed nothing.",
    "script-diverged": "A simulation of a script diverged, and the script does not say that it "
    "should.",
    "script-stable": "A script says `diverges`, but none of its simulations did.",
    "script-penetration": "Bodies of a script's simulation lie deep in each other, which MuJoCo "
    "does not warn of.",
    "script-writes": "A script writes outside its temporary folder.",
    "script-connects": "A script uses the network.",
    "script-shallow": "A script says `deep`, but no bodies lay deep in each other.",
    "recorded-run": "The course has no run of a script that is recorded once, or an outdated one.",
    "output-drift": "A recorded output differs from what the script prints.",
    "output-unmarked": "A text or table resembles what a script above it printed, and nothing "
    "compares the two.",
    "output-noise": "A recorded output has digits that change when initial states are moved by "
    "1e-12.",
    "output-unstable": "Two runs of a script print different lines, so that there is nothing to "
    "record.",
    "output-unrepeated": "An output is recorded from the only run of its script.",
    "output-not-updatable": "A recorded output cannot be updated automatically.",
    # models and MJCF
    "model-error": "A model in models/ does not compile.",
    "model-timeout": "The models of a course take longer to compile than they may.",
    "toml-syntax": "A file of scenarios, models/NAME.toml, is not valid TOML.",
    "scenario-model": "A file of scenarios has no model beside it, or a scenario does not fit the "
    "model.",
    "report-stale": "A recorded report in content/reports/ no longer fits the course, so no page "
    "shows it.",
    "bench-model": "A shown report names a model that is not in models/.",
    "bench-scenario": "A shown report names a scenario or a sweep that its model does not have.",
    "bench-text": "A fence that shows a report has text in it.",
    "bench-unrecorded": "A report is shown of a model for which nothing was recorded.",
    "mjcf-error": "An MJCF block does not compile.",
    "mjcf-compiles": "An MJCF block compiles although it must not.",
    "mjcf-message": "An MJCF block fails with another message than the lesson says.",
    # labs
    "lab-kind": "A lab is of an unknown kind.",
    "lab-model": "A lab names a model that is not in models/.",
    "lab-name": "A lab or its code names something that does not exist, such as a keyframe, a "
    "control or `data.qps`.",
    "lab-code": "A piece of a lab's code is not JavaScript, or an expression cannot be read.",
    "lab-throws": "A piece of a lab's code ends with an exception.",
    "lab-value": "An expression of a lab does not give a finite number.",
    "lab-warning": "MuJoCo raised a warning while a lab was tried.",
    "lab-diverged": "The simulation of a lab diverges.",
    "lab-penetration": "Bodies of a lab lie deep in each other, which MuJoCo does not warn of.",
    "lab-shallow": "A lab says `deep`, but no bodies lay deep in each other.",
    "lab-expect": "A claim of a lab does not hold.",
    "lab-goal": "A lab's goal is reached by doing nothing, or not by its log.",
    "lab-parity": "A lab runs differently in the browser and natively, or than SciPy computes.",
    "lab-endless": "The equations of a lab take too many steps, or its events do not end.",
    "lab-points": "Numbers that a script printed do not lie on the curve of a lab.",
    "lab-far": "Motion is small in the picture of a lab.",
    "lab-reset": "A reset does not lead a lab back to where it started.",
    "lab-shared": "A lab changes what all labs of a page share: objects of JavaScript or of the "
    "engine.",
    "lab-timeout": "A lab takes too long, or too much memory, to be tried.",
    "lab-engine": "An engine ended while a lab was tried, or refused its model.",
    # quizzes
    "quiz-id-repeated": "Two quizzes of the course have the same id.",
    "question-id-repeated": "Two questions of a quiz have the same id.",
    "quiz-answer": "The answer of a question is not one of its options.",
    "quiz-output": "An output question names a script or a line that no run has.",
    "quiz-gate": "A prediction has nothing to hide below it, or no lab to run.",
    "package-reduced": "A QTI package cannot hold a question as its page shows it.",
}
"""The meaning of each rule in one sentence."""
_WARNINGS = frozenset(
    """
    draft-empty file-unlisted no-scripts theme-contrast template-outdated heading-skip
    symbol-repeated footnote-unused image-alt
    recording-caption script-unrepeatable script-penetration script-writes script-connects
    output-noise report-stale bench-unrecorded lab-penetration lab-far lab-reset package-reduced
    """.split()
)

_MEANING = "Only its author knows what was meant."
_NO_FIX = {
    _MEANING: """
    binding-volatile bench-text draft-empty fence-unread field-missing field-repeated figure-unshown
    footnote-repeated footnote-unused heading-empty html-unbalanced image-alt io-order io-repeated
    io-stray lesson-planned-file link-text math-brackets math-unclosed math-unread merge-conflict
    nesting-deep prerequisite-cycle quiz-answer quiz-gate recording-body recording-orphan
    symbol-formula symbol-repeated table-cells term-place
    """,
    "Links may lead to either of the two, so its author chooses the new name.": """
    anchor-repeated id-repeated question-id-repeated quiz-id-repeated script-repeated term-repeated
    """,
    "Numbers of lessons are no words, of which one could be misspelt.": "prerequisite-unknown",
    "A file has to be written, moved, renamed or saved anew; an edit changes texts only.": """
    feature-broken file-encoding file-unlisted file-unreadable image-forbidden image-remote
    figure-unreadable lesson-missing lesson-unlisted link-broken map-missing no-lessons page-missing
    page-unlisted template-broken template-outdated template-unknown text-long theme-file
    """,
    "What a script prints becomes part of a text by `coursebuild update`, once somebody has seen "
    "it.": "example-edited figure-drift output-drift output-not-updatable recorded-run",
    "What the code of the course does has to change.": """
    figure-missing figure-window lab-diverged lab-endless lab-expect lab-far lab-goal lab-parity
    lab-penetration lab-reset lab-shared lab-timeout lab-value lab-warning mjcf-compiles
    mjcf-message model-timeout output-noise script-connects script-diverged
    script-encoding script-killed script-output-limit script-penetration script-silent
    script-timeout script-unrepeatable script-writes
    """,
    "Something has to be installed or run.": """
    bench-unrecorded engine-version feature-missing lab-engine no-scripts output-unrepeated
    report-stale script-python script-unproven
    """,
    "What a page must not have is left out by its author, or allowed in the map.": """
    html-forbidden package-reduced
    """,
}
"""Why rules have no edits: a reason, and the names of the rules."""
_REASONS = {name: reason for reason, names in _NO_FIX.items() for name in names.split()}

RULES: dict[str, Rule] = {
    name: Rule(name, "warning" if name in _WARNINGS else "error", summary, _REASONS.get(name, ""))
    for name, summary in _SUMMARIES.items()
}
