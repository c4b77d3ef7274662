"""Drawing: the scales of plots, and text that has its place in them.

`scales`: ticks and what they say. `marks`: text in markup, its width, and labels kept apart.
`contrast`: whether a colour is told from its ground.
"""
