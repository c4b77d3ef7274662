"""The course for learning platforms, as the archives that they take.

1. `xml` writes elements, and names that XML allows.
2. `flow` brings drawn HTML into the part of XHTML and MathML (`formulas`) that QTI
   2.1 allows.
3. `items` is a question as a QTI item, `processing` its points; `qti` are quizzes and their items
   as a content package.
4. `scorm` is the site as a SCORM 1.2 package: its manifest, and a page that starts each lesson.
"""
