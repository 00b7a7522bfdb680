"""All predicates of the language; one is added by its file and its name here."""

from missionc.ir.language.predicate import Predicate
from missionc.ir.language.predicates.compare import PREDICATE as COMPARE
from missionc.ir.language.predicates.connected import PREDICATE as CONNECTED
from missionc.ir.language.predicates.flag import PREDICATE as FLAG
from missionc.ir.language.predicates.formation import PREDICATE as FORMATION
from missionc.ir.language.predicates.heading import PREDICATE as HEADING
from missionc.ir.language.predicates.inside import PREDICATE as INSIDE
from missionc.ir.language.predicates.member import PREDICATE as MEMBER
from missionc.ir.language.predicates.region import PREDICATE as REGION
from missionc.ir.language.predicates.touches import PREDICATE as TOUCHES

PREDICATES: tuple[Predicate, ...] = (REGION, INSIDE, TOUCHES, MEMBER, COMPARE, CONNECTED, FORMATION, FLAG, HEADING)
