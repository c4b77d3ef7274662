"""The direction in which a language is written.

Entry point: `direction(language)`.

1. If the tag names a script (`az-Arab`, `ur-Latn`), that decides.
2. Otherwise language and region decide if the region writes the language in another script than
   others do (`pa-PK`), and else the language alone.

Sources: the right-to-left scripts of the Unicode Standard (chapters 9, 10, 14 and 19), and the
likely scripts of languages in CLDR.
"""

from __future__ import annotations

import functools
import re
from typing import Literal

_FROM_THE_RIGHT = frozenset(
    "adlm arab aran armi avst chrs cprt elym gara hatr hebr hung khar lydi mand mani mend merc mero"
    " narb nbat nkoo orkh ougr palm phli phlp phnx prti rohg samr sarb sogd sogo syrc syre syrj"
    " syrn thaa todr yezi".split()
)
"""Scripts, as tags name them."""

_LANGUAGES = frozenset(
    # of Arabic script
    "aeb afb ajp apc apd ar ara arb arq ars ary arz ayl bal bcc bej bft bgn bqi brh ckb fa fas fia"
    " gbz gju gjk glk haz hnd hno khw kvx kxp ks lah lki lrc luz mvy mzn pbt pbu per pes phl phr"
    " pnb prs ps pst pus rmt sd sdh shu skr snd swb trw tda ug uig ur urd wni xpr zdj azb"
    " acm acq ajt aao"
    # of Hebrew
    " he heb iw yi yid ji jpr jrb sam"
    # of others
    " arc aii syr syc tru dv div nqo rhg".split()
)
"""Languages that are written from the right unless their tag names a script."""

_REGIONS = {
    "az": "ir iq",
    "ha": "sd",
    "kk": "af cn ir mn",
    "ku": "iq ir lb",
    "ky": "cn",
    "ms": "cc",
    "pa": "pk",
    "tk": "af ir",
    "tt": "cn",
    "uz": "af cn",
}
"""Regions that write a language from the right, though others do not."""


@functools.lru_cache(maxsize=16)
def direction(language: str) -> Literal["ltr", "rtl"]:
    """The direction of the text of a language, by its tag (`ar`, `uz-Arab-AF`)."""
    name, *rest = re.split(r"[-_]", language.lower())
    script, region = "", ""
    for part in rest:
        if len(part) == 1:  # an extension begins: nothing after it names a script
            break
        if len(part) == 4 and part.isalpha() and not script:
            script = part
        elif len(part) == 2:
            region = part
    if script:
        return "rtl" if script in _FROM_THE_RIGHT else "ltr"
    from_the_right = name in _LANGUAGES or region in _REGIONS.get(name, "").split()
    return "rtl" if from_the_right else "ltr"
