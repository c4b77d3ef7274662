"""What `coursebuild serve` keeps in memory: the course, its pages, and what running it found.

Entry points: `live.LiveCourse`, and `behind.Behind`, which does what may take time.

1. `live` takes a save: it parses the document, checks it and draws its page, within milliseconds.
2. `pages` holds the drawn pages and gives every other file of the site when it is asked for.
3. `behind` follows: the course as a whole, its models, labs and fonts; `scripts` runs its scripts.
4. `told` is what an open page is told beside its text: mistakes, and how its scripts did; `offers`
   what its author may accept.
"""
