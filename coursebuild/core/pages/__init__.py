"""Documents and results as HTML and the other files of a site, pure."""
