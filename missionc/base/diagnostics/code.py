"""Diagnostic codes: permanent identifiers, each with a documentation page ``docs/errors/MCnnn.md``.

The documentation page of a diagnostic code, ``docs/errors/MCnnn.md``.
"""

from __future__ import annotations

from enum import Enum

from missionc.base.late_dataclass import Record
from missionc.base.resources import folder


class Severity(Enum):
    ERROR = "error"
    WARNING = "warning"


class Code(Record):
    """Stable identifier of a kind of finding (``MC101``), with the title of its documentation page.

    ``about_planning`` marks findings about missions that are well defined but have no plan. When a recorded flight is
    monitored, such a finding is a warning.
    """

    name: str
    title: str
    warning: bool = False
    about_planning: bool = False

    @property
    def severity(self) -> Severity:
        return Severity.WARNING if self.warning else Severity.ERROR


# 0xx: the text
SYNTAX = Code("MC001", "unexpected token")
UNREADABLE = Code("MC002", "the file cannot be read as text")
EMPTY = Code("MC003", "the mission is empty")
FILE_TOO_LARGE = Code("MC004", "the file is too large")
NESTED_TOO_DEEP = Code("MC005", "nested too deeply")
NUMBER_OUT_OF_RANGE = Code("MC006", "a number out of range")
NAME_NOT_ALLOWED = Code("MC007", "an invalid name")
UNKNOWN_OPERATOR = Code("MC008", "an unknown operator")
FILE_CHANGED = Code("MC009", "the file changed during reading")
INCLUDE_NOT_ALLOWED = Code("MC010", "an include that cannot be followed")
INCLUDE_CYCLE = Code("MC011", "a file includes itself")
INCLUDE_TOO_DEEP = Code("MC012", "includes too deep")
DECLARED_AGAIN = Code("MC013", "a duplicate declaration")
DECLARATION_MISSING = Code("MC014", "a declaration is missing")
ENDS_EARLY = Code("MC015", "an operator with a shorter scope than it seems", warning=True)
NOT_GRAPHML = Code("MC031", "a roadmap that cannot be read")
LANE_ATTRIBUTE = Code("MC032", "an invalid attribute of a roadmap")
MAP_UNREADABLE = Code("MC033", "a map file that cannot be read")
MAP_FEATURE = Code("MC034", "an unusable feature in a map file")
MAP_OPTION = Code("MC035", "a missing or wrong option of a map file")
FILE_OUTSIDE_WORLD = Code("MC037", "a map file entirely outside the world")
MAP_LEFT_OUT = Code("MC038", "ignored parts of a map file", warning=True)

# 1xx: names
UNKNOWN_NAME = Code("MC101", "an unknown name")
NAME_TWICE = Code("MC102", "a name declared twice")
UNUSED_NAME = Code("MC103", "an unused name", warning=True)
WRONG_KIND = Code("MC104", "a name of the wrong kind")
NO_SUCH_MEMBER = Code("MC105", "an unknown member of a team")
UNKNOWN_PARAMETER = Code("MC106", "an unknown parameter")
DEFINED_BY_ITSELF = Code("MC107", "a circular definition")
FAMILY_AS_ONE = Code("MC108", "a family in place of one of its members")
NO_SUCH_INDEX = Code("MC109", "an unknown member of a family")
INDEX_MISPLACED = Code("MC110", "a misplaced index")

# 2xx: types and units
WRONG_UNIT = Code("MC201", "a wrong unit")
UNKNOWN_UNIT = Code("MC202", "an unknown unit")
QUANTIFIER_MISSING = Code("MC203", "a missing agent or quantifier")
QUANTIFIER_TOO_MANY = Code("MC204", "a team formula in place of an agent formula")
WRONG_DIMENSION = Code("MC205", "the wrong number of coordinates")
UNKNOWN_SETTING = Code("MC206", "an unknown setting")
TOO_LARGE_TO_EXPAND = Code("MC207", "a formula too large")
GRAPH_MISSING = Code("MC208", "an ambiguous graph")
NOT_WHOLE = Code("MC209", "expected a whole number")
VALUE_OUT_OF_RANGE = Code("MC210", "a value out of range")
ASKED_OF_THE_LOST = Code("MC220", "a reference to an agent that may be lost")
NOT_ITS_OWN = Code("MC221", "an agent without this resource")
NO_HEADING = Code("MC222", "an agent without a heading")
RANGE_SAID_TWICE = Code("MC240", "two ranges for one pair")
RANGE_TO_ITSELF = Code("MC241", "a range from an agent to itself")

# 3xx: time and length
BEYOND_HORIZON = Code("MC301", "the mission ends too early")
NOT_WHOLE_STEPS = Code("MC302", "not a whole number of steps")
BOUNDS_REVERSED = Code("MC303", "reversed bounds")
HORIZON_NOT_WHOLE = Code("MC304", "the horizon is not a whole number of steps")
WINDOW_EMPTY = Code("MC305", "a window without a sample time")
TOO_MANY_STEPS = Code("MC306", "too many steps")
HOPS_BEYOND_TEAM = Code("MC307", "more hops than the graph allows")
BEFORE_START = Code("MC308", "a window before the mission's start", warning=True)

# 4xx: choice of backend
CANNOT_EXPRESS = Code("MC401", "the backend cannot express this")
NO_BACKEND = Code("MC402", "no backend can express this mission")
EXTRA_MISSING = Code("MC404", "an optional package is missing")
NOT_ITS_FLAG = Code("MC405", "this flag is for another backend")
NO_DEVICE = Code("MC406", "a device that is not available")
EXTENSION_UNLOADABLE = Code("MC410", "an extension that cannot be loaded")
EXTENSION_CLASH = Code("MC411", "an extension whose name is taken")
EXTENSION_INTERFACE = Code("MC412", "an extension for another interface")
EXTENSION_FAILED = Code("MC413", "an extension failed")
UNKNOWN_BACKEND_SETTING = Code("MC415", "an unknown backend setting")
SETTING_OUT_OF_RANGE = Code("MC416", "the value of a setting is out of range")
OTHER_BACKEND_SETTING = Code("MC417", "a setting of another backend", warning=True)

# 5xx: the world
OUTSIDE_WORLD = Code("MC501", "a start or finish outside the world", about_planning=True)
IN_OBSTACLE = Code("MC502", "a start or finish in an obstacle", about_planning=True)
AGENTS_OVERLAP = Code("MC503", "two agents too close at start or finish", about_planning=True)
REGION_OUTSIDE_WORLD = Code("MC504", "a region outside the world", about_planning=True)
REGION_IN_OBSTACLE = Code("MC505", "a region inside an obstacle", about_planning=True)
GRAPH_TOO_SMALL = Code("MC506", "a graph over too few agents")
FORMATION_TOO_SMALL = Code("MC507", "a formation over too few agents")
FORMATION_TOO_TIGHT = Code("MC508", "a formation closer than the separation", about_planning=True)
TOO_FAR = Code("MC509", "a goal that cannot be reached in time", about_planning=True)
CONTRADICTION = Code("MC510", "contradictory requirements", about_planning=True)
VACUOUS = Code("MC511", "a requirement that cannot be violated", warning=True)
NO_AREA = Code("MC512", "a shape without area")
TOO_MANY_AGENTS = Code("MC513", "too many agents")
ESCAPES_AT_ONCE = Code("MC514", "an escape without a distance", warning=True)
REACHES_ITSELF = Code("MC515", "a route that ends where it starts", warning=True)
NO_ROOM = Code("MC516", "a region too small for its agents", about_planning=True)
NEVER_HOLDS = Code("MC517", "a comparison that is never true", warning=True)
FASTER_THAN_VEHICLE = Code("MC518", "faster than the vehicle flies", warning=True)
NO_FLYING_ROOM = Code("MC519", "no flight volume for the vehicle", about_planning=True)
OUTSIDE_FLYING_ROOM = Code("MC520", "a start or finish outside the flight volume", about_planning=True)
ASKS_NOTHING = Code("MC521", "a requirement that is satisfied at the start", warning=True)
OUTLASTS_VEHICLE = Code("MC522", "a mission longer than the battery endurance", about_planning=True)
LANE_NODE_MISPLACED = Code("MC541", "a roadmap node outside the free space", about_planning=True)
LANE_BLOCKED = Code("MC542", "a lane through an obstacle", about_planning=True)
NOT_ON_LANES = Code("MC543", "a start or finish without a lane", about_planning=True)
PADS_TOO_NEAR = Code("MC544", "pads too close for a joint takeoff", about_planning=True)
UNUSABLE_PAD = Code("MC545", "a pad without a safe takeoff or landing", about_planning=True)
UNUSABLE_POSES = Code("MC546", "measured poses that cannot be used")
PAD_ELSEWHERE = Code("MC547", "an agent away from its pad", warning=True)
SIGHT_PAST_MOTION = Code("MC530", "a line of sight past a changing obstacle")
RUNS_OUT = Code("MC531", "a resource that runs out", about_planning=True)
ONE_WAY_LAMBDA2 = Code("MC536", "`lambda2` of a graph with directed links", about_planning=True)
BARRED = Code("MC551", "a goal without a passable path", about_planning=True)
JUMP = Code("MC552", "an `until` that requires a jump", about_planning=True)
RESTLESS = Code("MC553", "a stay that the lowest speed forbids", about_planning=True)
CROWDED = Code("MC554", "more agents than a region has room for", about_planning=True)
NO_FIT = Code("MC555", "a formation that does not fit into the world", about_planning=True)
STUCK = Code("MC556", "a formation that does not fit through a passage", about_planning=True)
NOT_PUBLISHED = Code("MC563", "not part of the preset's method")
METHOD_ENDED = Code("MC564", "the method of the preset found no plan")
PLACE_OUTSIDE_WORLD = Code("MC558", "a region, obstacle or beacon outside the world", warning=True)
REJECTED_PLAN = Code("MC570", "the plan of an extension's backend is rejected")
DEAD_BRANCH = Code("MC557", "a disjunct or preference that cannot be satisfied", warning=True)

# 6xx: outcome of planning
IMPOSSIBLE = Code("MC601", "no plan exists on the roadmap")
OUT_OF_TIME = Code("MC602", "the time limit was reached")
OUT_OF_MEMORY = Code("MC603", "the memory limit was reached")
NOT_VERIFIED = Code("MC604", "the plan failed verification")
NO_ROADMAP = Code("MC605", "no roadmap could be built")
PROBLEM_TOO_LARGE = Code("MC606", "the problem is too large")
SOLVER_GAVE_UP = Code("MC607", "the solver gave up")
NOT_TOLERATED = Code("MC608", "no plan found tolerates the delay")
NO_MOTION = Code("MC609", "no motion of these agents satisfies the mission")
IMPROVEMENT_FAILED = Code("MC613", "a stage after planning failed", warning=True)

# 7xx: output
OUTPUT_EXISTS = Code("MC701", "the output exists")
CANNOT_WRITE = Code("MC702", "the output cannot be written")
NOT_FLYABLE = Code("MC703", "no polynomial fits the plan")
TRACE_UNREADABLE = Code("MC704", "the trace cannot be read")
TRACE_MISMATCH = Code("MC705", "the trace does not fit the mission")
CHECKPOINT_UNREADABLE = Code("MC706", "the checkpoint cannot be used")
CHECKPOINT_MISMATCH = Code("MC707", "the checkpoint is of another run")
FOLDER_UNREADABLE = Code("MC708", "the folder cannot be read")
FOLDER_REFUSED = Code("MC709", "the folder fails verification")
NOT_BETWEEN = Code("MC710", "a requirement is violated between samples")
NEEDS_MORE_TIME = Code("MC711", "the vehicle needs more time")
NOT_EXPORTED = Code("MC712", "a flight that an export cannot represent")
NOT_JUDGED = Code("MC713", "the simulation cannot be repeated here")
PROVES_NOTHING = Code("MC714", "an invalid proof in the folder")
NO_SUCH_MOMENT = Code("MC715", "a time after the horizon")
NOT_ONE_MISSION = Code("MC716", "the folders are of different missions")
UNUSABLE_SAMPLE = Code("MC717", "a line of samples cannot be used", warning=True)
NOT_LISTENING = Code("MC718", "samples cannot be received there")
PAST_DOES_NOT_FIT = Code("MC719", "a recorded past of another mission")
NO_LONGER_KEPT = Code("MC720", "a requirement can no longer be satisfied")
NOT_TO_BE_CHANGED = Code("MC721", "an invalid change in flight")
NO_SAFE_STOP = Code("MC722", "no safe stop was found")
NOT_SAID = Code("MC723", "no formula for the rest of a requirement")
NOT_BY_THEN = Code("MC724", "no new plan was ready in time")
IMPLAUSIBLE_TIME = Code("MC725", "a sample is far ahead in time", warning=True)
RECORDING_BROKEN = Code("MC726", "the recording cannot be read")
NOT_TO_BE_LOST = Code("MC730", "an agent or a time that cannot be lost")
TRACKING_NOT_MEASURED = Code("MC731", "a tracking margin measured at lower limits", warning=True)
NO_WAY = Code("MC740", "no proved takeoff or landing path")
SCENARIO_UNUSABLE = Code("MC751", "a scenario cannot be used")
SWEPT_VALUES = Code("MC760", "the values of a sweep cannot be used")
OTHER_SWEEP = Code("MC761", "the folder is of another sweep")
SWEEP_UNREADABLE = Code("MC762", "the sweep cannot be read")
SWEEP_AT_WORK = Code("MC763", "the folder is locked by another command")
CLUSTER_UNREACHABLE = Code("MC764", "the cluster cannot be used")
OTHER_VERSIONS = Code("MC765", "a worker has other versions")
NOT_COMPARABLE = Code("MC766", "the sweeps have no run in common")

# 9xx: internal
INTERNAL = Code("MC901", "internal error")

CODES: dict[str, Code] = {value.name: value for value in list(globals().values()) if isinstance(value, Code)}

FAMILIES: dict[str, str] = {
    "0": "the text",
    "1": "names",
    "2": "types and units",
    "3": "time and length",
    "4": "choice of backend",
    "5": "the world",
    "6": "outcome of planning",
    "7": "output and traces",
    "9": "internal errors",
}
"""Topic of the diagnostic codes, by the first digit of the code."""

RETIRED = frozenset({"MC403"})
"""Diagnostic codes that are no longer reported; their numbers are never reused."""


def explain(code: Code) -> str:
    """Documentation page of a diagnostic code, as Markdown.

    Raises:
        FileNotFoundError: the installation lacks the page.
    """
    return (folder("docs/errors") / f"{code.name}.md").read_text(encoding="utf-8")
