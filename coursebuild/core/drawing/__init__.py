"""Drawing: scales of plots, layouts of graphs, and text in both.

`scales`: ticks and their texts; text in markup, its width, and labels kept apart.
`layered`: graphs in layers. `contrast`: whether a colour is legible on its background.
"""
