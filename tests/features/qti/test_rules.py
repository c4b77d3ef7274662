"""The rules that items and manifests are held to find what is wrong."""

from __future__ import annotations

from support.qti_rules import QTI, mistakes

GOOD = f"""\
<assessmentItem xmlns="{QTI}" xmlns:m="http://www.w3.org/1998/Math/MathML" identifier="q" title="t"
 adaptive="false" timeDependent="false">
<responseDeclaration identifier="RESPONSE" cardinality="single" baseType="identifier">
<correctResponse><value>A</value></correctResponse></responseDeclaration>
<outcomeDeclaration identifier="SCORE" cardinality="single" baseType="float"/>
<itemBody><p>Which <b>one</b>?</p>
<choiceInteraction responseIdentifier="RESPONSE" shuffle="false" maxChoices="1">
<simpleChoice identifier="A">a</simpleChoice><simpleChoice identifier="B">b</simpleChoice>
</choiceInteraction></itemBody>
<responseProcessing><responseCondition><responseIf>
<match><variable identifier="RESPONSE"/><correct identifier="RESPONSE"/></match>
<setOutcomeValue identifier="SCORE"><baseValue baseType="float">1</baseValue></setOutcomeValue>
</responseIf></responseCondition></responseProcessing>
</assessmentItem>"""
BAD = (
    ('adaptive="false"', ""),
    ('identifier="q"', 'identifier="4q"'),
    ('cardinality="single" baseType="i', 'cardinality="one" baseType="i'),
    ('shuffle="false"', ""),
    ('identifier="B">', 'identifier="A">'),
    ("<value>A</value>", "<value>C</value>"),
    ("<value>A</value>", "<value>A</value><value>B</value>"),
    ("<itemBody>", "<itemBody>text"),
    ("<itemBody>", "<itemBody><b>inline</b>"),
    ("<itemBody>", "<itemBody><video/>"),
    ("<itemBody>", "<itemBody><table><tr><td>no body</td></tr></table>"),
    ("<itemBody>", '<itemBody><p onclick="x()">p</p>'),
    ("<p>Which", "<p><p>in</p>Which"),
    ('<variable identifier="RESPONSE"/>', ""),
    ('<variable identifier="RESPONSE"/>', '<variable identifier="OTHER"/>'),
    ('setOutcomeValue identifier="SCORE"', 'setOutcomeValue identifier="POINTS"'),
    ("</itemBody>", "</itemBody><outcomeDeclaration/>"),
    ("<p>Which", '<p><textEntryInteraction responseIdentifier="RESPONSE"/>Which'),
    ("<p>Which", '<p><img src="a.png"/>Which'),
)


def test_rules_find_every_mistake_in_an_item() -> None:
    assert mistakes(GOOD.encode()) == []
    missed = [new for old, new in BAD if not mistakes(GOOD.replace(old, new).encode())]
    assert missed == []
