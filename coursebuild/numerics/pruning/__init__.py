"""The scene diet: what a model holds that its scenarios do not need.

Entry points: `survey.survey(order)`, of a `model_text.ModelText`; `cases.cases` are its scenarios.

`markup`, `edits`: MJCF as text with places, and changes of it. `unused`, `motion`, `collisions`,
`scenery`, `settings`, `meshes`: what could be left out. `mapping`, `compare`, `timing`: how the
model does without it.
"""
