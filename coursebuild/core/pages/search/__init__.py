"""Search over the whole course: what pages are found by, and the index that browsers load.

Entry points: `searched`, what one page is found by; `SearchFiles`, the files of all pages together;
`search_sheet`, the page of the search.

1. `sections` cuts a page into sections of text, code and formulas.
2. `words` makes terms of them, as `site/js/search/words.js` makes terms of what a reader types.
3. `page` packs the text for the reader's browser, and the terms for the index.
4. `index` sorts the terms of all pages into small files, of which a query loads a few.
"""
