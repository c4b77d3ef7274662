"""What lies beside a key: on keyboards of several countries, and on telephones.

Entry points: `neighbours`, and `LAYOUTS`.
"""

from __future__ import annotations

LAYOUTS: dict[str, tuple[tuple[str, str], ...]] = {
    "US": (
        ("`1234567890-=", "~!@#$%^&*()_+"),
        ("qwertyuiop[]\\", "QWERTYUIOP{}|"),
        ("asdfghjkl;'", 'ASDFGHJKL:"'),
        ("zxcvbnm,./", "ZXCVBNM<>?"),
    ),
    "French": (
        ("²&é\"'(-è_çà)=", "²1234567890°+"),
        ("azertyuiop^$", "AZERTYUIOP¨£"),
        ("qsdfghjklmù*", "QSDFGHJKLM%µ"),
        ("<wxcvbn,;:!", ">WXCVBN?./§"),
    ),
    "German": (
        ("^1234567890ß´", '°!"§$%&/()=?`'),
        ("qwertzuiopü+", "QWERTZUIOPÜ*"),
        ("asdfghjklöä#", "ASDFGHJKLÖÄ'"),
        ("<yxcvbnm,.-", ">YXCVBNM;:_"),
    ),
    "Dvorak": (
        ("`1234567890[]", "~!@#$%^&*(){}"),
        ("',.pyfgcrl/=\\", '"<>PYFGCRL?+|'),
        ("aoeuidhtns-", "AOEUIDHTNS_"),
        (";qjkxbmwvz", ":QJKXBMWVZ"),
    ),
    "telephone": (
        ("qwertyuiop", "QWERTYUIOP"),
        ("asdfghjkl", "ASDFGHJKL"),
        ("zxcvbnm", "ZXCVBNM"),
        ("1234567890", "[]{}#%^*+="),
        ('-/:;()$&@"', "_\\|~<>€£¥•"),
        (".,?!'", ".,?!'"),
    ),
}
"""The rows of each layout, from above, without and with Shift: as telephones show them, a sheet of
letters and two of signs."""


def neighbours(layout: str, letter: str) -> list[str]:
    """The signs of the keys left, right, above and below, sorted; none if the layout lacks it."""
    rows = LAYOUTS[layout]
    signs: set[str] = set()
    for number, (plain, shifted) in enumerate(rows):
        for row, twin in ((plain, shifted), (shifted, plain)):
            at = row.find(letter)
            if at < 0:
                continue
            signs |= {*row[max(at - 1, 0) : at + 2]}
            sheet = 0 if row is plain else 1
            for row_nearby in rows[max(number - 1, 0) : number + 2]:
                signs |= {*row_nearby[sheet][at : at + 1]}
            signs |= {*twin[at : at + 1]} if layout != "telephone" else set()
    return sorted(signs - {letter})
