"""What takes an author from nothing to a course, and through its changes: commands.

- `init`: a small complete course, from the files in `course/`
- `new`: a lesson or a feature, with its entry in the map (`course_map`), a model, a template
- `rename`: a lesson gets another id, wherever the course names it (`references`)
- `fmt`: lessons formatted (`format`, with `json_layout` and `text_layout`)
- `doctor`: what of all that courses need works here
"""

from coursebuild.core.features import Command, Feature

_SUMMARIES = {
    "init": "make a small complete course to begin with",
    "new": "add a lesson, a model, a template or a feature",
    "rename": "give a lesson another id, wherever the course names it",
    "fmt": "format lessons and pages",
    "doctor": "say what works on this machine, and how to mend what does not",
}
FEATURE = Feature(
    name="authoring",
    needs=("lab",),
    commands=tuple(
        Command(name=name, summary=summary, module=f"{__name__}.commands.{name}")
        for name, summary in _SUMMARIES.items()
    ),
)
