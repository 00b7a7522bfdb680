"""All predicates of the language; one is added by its file and its name here."""

from missionc.language.predicate import Predicate
from missionc.language.predicates.compare import PREDICATE as COMPARE
from missionc.language.predicates.connected import PREDICATE as CONNECTED
from missionc.language.predicates.flag import PREDICATE as FLAG
from missionc.language.predicates.formation import PREDICATE as FORMATION
from missionc.language.predicates.heading import PREDICATE as HEADING
from missionc.language.predicates.inside import PREDICATE as INSIDE
from missionc.language.predicates.member import PREDICATE as MEMBER
from missionc.language.predicates.region import PREDICATE as REGION
from missionc.language.predicates.touches import PREDICATE as TOUCHES

PREDICATES: tuple[Predicate, ...] = (REGION, INSIDE, TOUCHES, MEMBER, COMPARE, CONNECTED, FORMATION, FLAG, HEADING)

CALLED = {predicate.name: predicate for predicate in PREDICATES if predicate.called}
"""Those that are written with their name and brackets, each under it."""
