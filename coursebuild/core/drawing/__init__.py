"""Drawing: scales of plots, layouts of graphs, contrast of colours, text, safe SVG."""
