"""The words of the language, for the page to colour: the compiler's own, so that there is no second table of them."""

from __future__ import annotations

from missionc.base.units import UNITS
from missionc.lsp.scene.scene import Json
from missionc.syntax.tokens import DECLARATIONS, STATES, WORDS

COLOURS = {
    "a declaration": "definitionKeyword",
    "a shape": "typeName",
    "an operator": "operatorKeyword",
    "a quantifier": "operatorKeyword",
    "a formula": "bool",
    "the mission's last step": "bool",
    "a measure": "propertyName",
    "a preposition": "modifier",
    "a motion": "modifier",
    "a way to turn": "modifier",
    "a kind of graph": "typeName",
    "a part of `time`": "propertyName",
    "a part of a team": "propertyName",
    "a part of a formation": "propertyName",
    "a part of `flight`": "propertyName",
    "a part of `from`": "propertyName",
    "a part of `prefer`": "propertyName",
    "a part of `tolerate`": "propertyName",
}
"""CodeMirror's tag for each kind of word, by what the table of words says it is."""


def words() -> Json:
    """What colours words: ``kinds`` by word and short form, ``free`` those that may be names, and what declares one."""
    spelt = [(spelling, word) for word in WORDS for spelling in (word.text, word.letter) if spelling.isalpha()]
    return {
        "kinds": {spelling: COLOURS[word.says] for spelling, word in spelt},
        "free": [word.text for word in WORDS if not word.reserved],
        "declaring": sorted(DECLARATIONS),
        "units": list(UNITS),
        "states": list(STATES),
    }
