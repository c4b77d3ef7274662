"""Model pruning: what a model holds that its scenarios do not need (`coursebuild diet`).

Entry points: `ablation.survey(order)`, of a `model_text.ModelText`; `compare.cases` are its
scenarios.

`markup`, `edits`: MJCF as text with places, and changes of it. `unused`, `dynamics`, `scenery`,
`meshes`: what could be left out, with `readers`, who looks at it, and `reachability`, where geoms
can get. `mapping`, `compare`, `trials`: how the model does without it.
"""
