"""Random edits of missions as by typing: insertions, deletions and pastes."""

from __future__ import annotations

import random
import re
from pathlib import Path

TOKEN = re.compile(r"\s+|#[^\n]*|\w+|[^\w\s]")
MISSIONS = [
    path.read_text(encoding="utf-8")
    for path in sorted((Path(__file__).resolve().parents[2] / "missions").glob("*.mission"))
]
PASTED = tuple(dict.fromkeys(token for text in MISSIONS for token in TOKEN.findall(text)))
ODD = ("\0", "\ufeff", "\u2028", "é", "𝄞", "\r\n", "\r", '"', "#", "((((", "]]", "include", 'include "site.mission"')


def typed(text: str, chance: random.Random) -> str:
    """Text after one edit."""
    place = chance.randrange(len(text) + 1)
    match chance.randrange(6):
        case 0:
            return text[:place] + chance.choice("abxyz019 .,:()[]{}=\n\t#") + text[place:]
        case 1:
            return text[:place] + text[place + 1 :]
        case 2:
            return text[:place] + text[place + chance.randrange(1, 30) :]
        case 3:
            other = chance.choice(MISSIONS)
            begin = chance.randrange(len(other))
            return text[:place] + other[begin : begin + chance.randrange(1, 80)] + text[place:]
        case 4:
            return f"{text[:place]} {chance.choice(PASTED)} {text[place:]}"
        case _:
            return text[:place] + chance.choice(ODD) + text[place:]
