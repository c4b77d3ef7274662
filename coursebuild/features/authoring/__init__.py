"""Commands that begin a course and change it."""

from coursebuild.api import Command, Feature

_SUMMARIES = {
    "init": "create a small, complete course",
    "new": "add a lesson, a level, a page, a model, a template or a feature",
    "rename": "change a lesson's id wherever the course names it",
    "fmt": "format lessons and pages",
    "doctor": "check this machine, and say how to fix what does not work",
}
FEATURE = Feature(
    name="authoring",
    needs=("lab",),
    commands=tuple(
        Command(name=name, summary=summary, module=f"{__name__}.commands.{name}")
        for name, summary in _SUMMARIES.items()
    ),
)
