"""The closed catalogue of rules: every mistake that the tool can name.

Entry point: `RULES`, from name to `Rule`. `docs/reference/rules.md` is written from it, and
a fixture in `tests/fixtures/rules/` shows for each what an author sees.
"""

from __future__ import annotations

from typing import Literal

from msgspec import Struct

HELP = "https://github.com/OWNER/coursebuild/blob/main/docs/reference/rules.md#{}"
"""Where a rule is explained."""


class Rule(Struct, frozen=True):
    """One entry of the catalogue."""

    name: str
    severity: Literal["error", "warning"]
    summary: str
    """What it means, one sentence, for the catalogue's page."""


_CATALOGUE: tuple[tuple[str, Literal["error", "warning"], str], ...] = (
    # files
    ("file-encoding", "error", "A file of the course is not text in UTF-8."),
    (
        "file-unreadable",
        "error",
        "A file of the course cannot be read, or is reached through a link out of the project.",
    ),
    ("text-long", "error", "A text is longer than the course allows."),
    # the course map
    ("map-missing", "error", "There is no content/course.toml."),
    ("map-syntax", "error", "course.toml is not valid TOML."),
    ("id-repeated", "error", "A level, lesson or page id occurs twice in the course map."),
    ("lesson-unlisted", "error", "A file in content/lessons is not named by the course map."),
    ("page-unlisted", "error", "A file in content/pages is not named by the course map."),
    ("lesson-missing", "error", "The course map names a lesson whose file is missing."),
    ("lesson-planned-file", "error", "A lesson that the map calls planned has a file."),
    ("lesson-empty", "error", "A complete lesson has nothing to read in its file."),
    ("prerequisite-unknown", "error", "A prerequisite is not a lesson of the map."),
    ("prerequisite-cycle", "error", "Lessons require each other in a circle."),
    ("page-missing", "error", "The course map names a page whose file is missing."),
    (
        "engine-version",
        "error",
        "The course needs another version of MuJoCo than the installed one.",
    ),
    ("script-python", "error", "The interpreter that the map names for scripts cannot run them."),
    (
        "silence-rule",
        "error",
        "An entry of `[[silence]]` names an unknown rule or an error, or gives no reason.",
    ),
    ("no-lessons", "error", "The course has no lesson to publish."),
    ("no-scripts", "warning", "No script can run here, so that nothing is verified."),
    # the theme
    ("theme-file", "error", "A file that the theme names is not there, or is not what it must be."),
    (
        "theme-contrast",
        "warning",
        "The accent is too near to the colour of the page for text to be read in it.",
    ),
    ("template-unknown", "error", "A file stands in the place of a template that there is not."),
    ("template-broken", "error", "A template of the course cannot be read, or fails."),
    (
        "template-outdated",
        "warning",
        "The tool has changed the template that one of the course was copied from.",
    ),
    # fields of JSON and TOML
    ("json-syntax", "error", "The JSON in a fence is malformed."),
    ("field-unknown", "error", "A field that nothing reads."),
    ("field-missing", "error", "A required field is not there."),
    ("field-repeated", "error", "A field is given twice."),
    ("field-type", "error", "A value is of the wrong type."),
    ("field-value", "error", "A value has the right type but cannot be right."),
    # Markdown
    (
        "front-matter",
        "error",
        "A lesson begins with front matter; it is Markdown from its first line.",
    ),
    (
        "heading-top",
        "error",
        "A heading of level 1 in a lesson, or one over a page that is not its title in the map.",
    ),
    ("nesting-deep", "error", "Quotes, lists or footnotes nest too deep."),
    ("heading-skip", "warning", "A heading skips a level."),
    ("heading-empty", "error", "A heading has no text."),
    ("heading-attributes", "error", "The attributes after a heading cannot be read."),
    ("anchor-repeated", "error", "Two things on a page have the same id."),
    (
        "fence-unclosed",
        "error",
        "A code fence is never closed, or not before another one begins.",
    ),
    ("fence-indented", "error", "A fence is indented, so that its block is shown as text."),
    ("fence-info", "error", "The info string of a fence cannot be read."),
    ("fence-key-unknown", "error", "A fence has a key that its kind does not know."),
    ("fence-key-repeated", "error", "A fence has the same key twice."),
    ("fence-key-value", "error", "A key of a fence has an impossible value."),
    ("fence-kind-near", "warning", "The kind of a code block looks like a misspelt one."),
    (
        "fence-unread",
        "warning",
        "A code block of a kind that nothing reads holds a JSON object.",
    ),
    ("feature-broken", "error", "A feature of the course's own cannot be loaded."),
    ("feature-missing", "error", "A fence needs a feature that is not installed."),
    ("math-syntax", "error", "A formula does not parse."),
    ("math-unclosed", "error", "Display math is never closed."),
    ("math-unread", "warning", "A dollar sign and TeX stand in a text, and no formula was read."),
    (
        "markup-foreign",
        "warning",
        "Markup of another tool stands in a text, which shows it as it is written.",
    ),
    ("equation-label", "error", "The label of a formula cannot be read, or stands where none may."),
    # terms and symbols
    ("term-attribute", "error", "The attribute by which a text defines a term cannot be read."),
    ("term-place", "error", "A term is defined outside a paragraph of the text."),
    ("term-repeated", "error", "Two places of the course define the same term."),
    ("symbol-attribute", "error", "What a symbol stands for cannot be read."),
    ("symbol-formula", "error", "What is declared as a symbol is not a single symbol."),
    ("unit-unknown", "error", "The unit of a quiz's answer or of a symbol does not exist."),
    ("symbol-repeated", "warning", "A text says twice what a symbol stands for."),
    (
        "table-cells",
        "error",
        "A row of a table has more cells than its header; what is in them would not be shown.",
    ),
    ("footnote-undefined", "error", "A footnote is referred to and never written."),
    ("footnote-unused", "warning", "A footnote is written and never referred to."),
    ("footnote-repeated", "error", "A footnote is written twice."),
    ("figure-unshown", "error", "A script draws a figure that no paragraph below it shows."),
    ("figure-missing", "error", "A script does not draw the figure that it names."),
    ("figure-unreadable", "error", "What a script drew cannot be shown."),
    ("figure-drift", "error", "A recorded figure differs from what its script draws now."),
    (
        "image-remote",
        "error",
        "A picture, a video or a frame comes from another host; a page shows only what the course "
        "holds.",
    ),
    ("image-alt", "warning", "An image has no text alternative."),
    (
        "html-unbalanced",
        "error",
        "Raw HTML opens an element that it does not close, or closes one that is not open.",
    ),
    (
        "html-forbidden",
        "error",
        "Raw HTML has an element, an attribute or an address that the course does not allow.",
    ),
    # callouts and io
    ("callout-unknown", "error", "A callout is of an unknown kind."),
    ("io-missing", "error", "An io block lacks a line."),
    ("io-repeated", "error", "An io block has a line twice."),
    ("io-order", "error", "The lines of an io block are not in the order INPUT, PROCESS, OUTPUT."),
    ("io-stray", "error", "An io block begins with text that belongs to no line."),
    # links and numbers
    ("link-lesson", "error", "A link or mention names a lesson that the map does not have."),
    ("link-level", "error", "A mention names a level that the map does not have."),
    ("link-page", "error", "A link names a page that the map does not have."),
    ("link-term", "error", "A link names a term that no lesson defines."),
    ("link-model", "error", "A link names a model that is not in models/."),
    ("link-example", "error", "A link names a script that no lesson has."),
    ("link-file", "error", "A relative link or image names a file that is not there."),
    ("link-anchor", "error", "A link names an anchor that its page does not have."),
    ("link-scheme", "error", "A link uses a scheme that a page must not have."),
    ("link-broken", "error", "An internal link of a built page leads nowhere."),
    ("binding-orphan", "error", "A bound number has no recorded output to be checked against."),
    (
        "binding-mismatch",
        "error",
        "A bound number is not a value that the script printed, rounded.",
    ),
    ("binding-volatile", "error", "A number is bound to what differs from run to run."),
    ("binding-attribute", "error", "The attribute of a bound number cannot be read."),
    # scripts and recorded outputs
    ("script-path", "error", "The path of a script is not one that a script may have."),
    (
        "script-kind",
        "error",
        "A block with a `file` is not of kind `python`, so that nothing runs it.",
    ),
    ("source-part", "error", "A block does not show what the file that it names holds."),
    ("script-repeated", "error", "Two blocks are extracted to the same path."),
    ("python-syntax", "error", "A Python block does not parse."),
    (
        "recording-caption",
        "warning",
        "A `text` block looks like a recorded output, and is compared with nothing.",
    ),
    ("recording-orphan", "error", "A recorded output has no script above it."),
    (
        "recording-body",
        "error",
        "`Output:` is followed by something that is not a `text` fence or a table with rows.",
    ),
    (
        "recording-keys",
        "error",
        "Keys of comparison contradict each other, or stand on a block that records nothing.",
    ),
    ("example-edited", "error", "An extracted file was changed by hand."),
    ("script-failed", "error", "A script exited with an error."),
    ("script-timeout", "error", "A script ran past its time limit."),
    ("script-killed", "error", "A script was ended by a signal."),
    ("script-output-limit", "error", "A script printed more than 1 MiB."),
    ("script-encoding", "error", "A script printed bytes that are not UTF-8."),
    (
        "script-unrepeatable",
        "warning",
        "A script behaves differently than before, although nothing known to matter has changed.",
    ),
    ("script-silent", "error", "An output is recorded and the script printed nothing."),
    (
        "script-diverged",
        "error",
        "A simulation of a script diverged, and the script does not say that it should.",
    ),
    ("script-stable", "error", "A script says `diverges`, and none of its simulations did."),
    (
        "script-penetration",
        "warning",
        "Bodies of a script's simulation lie deep in each other, which MuJoCo does not warn of.",
    ),
    ("script-writes", "warning", "A script writes outside its temporary folder."),
    ("script-connects", "warning", "A script uses the network."),
    ("script-shallow", "error", "A script says `deep`, and no bodies lay deep in each other."),
    (
        "recorded-run",
        "error",
        "The course has no run of a script that is recorded once, or an outdated one.",
    ),
    ("output-drift", "error", "A recorded output differs from what the script prints."),
    (
        "output-noise",
        "warning",
        "A recorded output has digits that change when initial states are moved by 1e-12.",
    ),
    (
        "output-unstable",
        "error",
        "Two runs of a script print different lines, so that there is nothing to record.",
    ),
    ("output-not-updatable", "error", "A recorded output cannot be updated automatically."),
    # models and MJCF
    ("model-error", "error", "A model in models/ does not compile."),
    ("toml-syntax", "error", "A file of scenarios, models/NAME.toml, is not valid TOML."),
    (
        "scenario-model",
        "error",
        "A file of scenarios has no model beside it, or a scenario does not fit the model.",
    ),
    (
        "report-stale",
        "warning",
        "A recorded report in content/reports/ no longer fits the course, so no page shows it.",
    ),
    ("bench-model", "error", "A shown report names a model that is not in models/."),
    (
        "bench-scenario",
        "error",
        "A shown report names a scenario or a sweep that its model does not have.",
    ),
    ("bench-text", "error", "Text stands in a fence that shows a report."),
    (
        "bench-unrecorded",
        "warning",
        "A report is shown of a model for which nothing was recorded.",
    ),
    ("mjcf-error", "error", "An MJCF block does not compile."),
    ("mjcf-compiles", "error", "An MJCF block compiles although it must not."),
    ("mjcf-message", "error", "An MJCF block fails with another message than the lesson says."),
    # labs
    ("lab-kind", "error", "A lab is of an unknown kind."),
    ("lab-model", "error", "A lab names a model that is not in models/."),
    (
        "lab-name",
        "error",
        "A lab or its code names something that does not exist, such as a keyframe, a control or "
        "`data.qps`.",
    ),
    (
        "lab-code",
        "error",
        "A piece of a lab's code is not JavaScript.",
    ),
    ("lab-throws", "error", "A piece of a lab's code ends with an exception."),
    ("lab-value", "error", "An expression of a lab does not give a finite number."),
    ("lab-warning", "error", "MuJoCo raised a warning while a lab was tried."),
    ("lab-diverged", "error", "The simulation of a lab diverges."),
    (
        "lab-penetration",
        "warning",
        "Bodies of a lab lie deep in each other, which MuJoCo does not warn of.",
    ),
    ("lab-shallow", "error", "A lab says `deep`, and no bodies lay deep in each other."),
    ("lab-expect", "error", "A claim of a lab does not hold."),
    ("lab-goal", "error", "A lab's goal is reached by doing nothing, or not by its log."),
    ("lab-parity", "error", "A lab runs differently in the browser's engine and natively."),
    ("lab-far", "warning", "What moves is small in the picture of a lab."),
    ("lab-reset", "warning", "A reset does not lead a lab back to where it started."),
    (
        "lab-shared",
        "error",
        "A lab changes what all labs of a page share: objects of JavaScript or of the engine.",
    ),
    ("lab-timeout", "error", "A lab takes too long, or too much memory, to be tried."),
    (
        "lab-engine",
        "error",
        "An engine ended while a lab was tried, or the two are of different versions.",
    ),
    # quizzes
    ("quiz-id-repeated", "error", "Two quizzes of the course have the same id."),
    ("question-id-repeated", "error", "Two questions of a quiz have the same id."),
    ("quiz-answer", "error", "The answer of a question is not one of its options."),
    ("quiz-output", "error", "An output question names a script or a line that no run has."),
    ("quiz-gate", "error", "A prediction has nothing to hide below it, or no lab to run."),
    (
        "package-reduced",
        "warning",
        "A QTI package cannot hold a question as its page shows it.",
    ),
)

RULES: dict[str, Rule] = {
    name: Rule(name, severity, summary) for name, severity, summary in _CATALOGUE
}
