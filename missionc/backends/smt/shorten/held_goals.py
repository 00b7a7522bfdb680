"""Goals that hold of a joint motion, and the properties of their formulas that no motion changes."""

from __future__ import annotations

from dataclasses import dataclass, field

from missionc.backends.smt.encode.lower_motion import Motion
from missionc.backends.smt.roadmap.agent_local import own_states, states_of
from missionc.backends.smt.roadmap.labels import Labels
from missionc.base.trace import Flags
from missionc.ir import Graph, Mission, Predicate
from missionc.ir.kernel.analysis import about_whom, linked_by, reads_lengths, steps_ahead
from missionc.ir.kernel.nodes import Atom, Node
from missionc.ir.kernel.walk import postorder


@dataclass(slots=True)
class Goals:
    """Asked of step 0.

    ``instant``: nodes that the states at the step they are asked at decide.
    ``own``: of those, the ones that an agent's own state decides where it is asked.
    ``ahead``: by how many steps the others look ahead, the motion from the last included.
    ``concerns``: (agents, agents), the motion of the first may matter where the second is asked.
    """

    formulas: tuple[Node, ...]
    mission: Mission
    motion: Motion
    labels: Labels
    order: list[Node] = field(init=False)
    instant: set[Node] = field(init=False)
    own: set[Node] = field(init=False)
    ahead: dict[Node, int] = field(init=False)
    concerns: dict[Node, Flags] = field(init=False)
    work: int = 0
    """Pairs of agents looked at so far, which is what most of the time goes into."""
    _states: dict[tuple[Node, int], Flags] = field(default_factory=dict)
    _read: dict[Node, tuple[tuple[Predicate, ...], tuple[Graph, ...]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.order = postorder(self.formulas)
        self.own = own_states(self.order, self.labels)
        self.ahead = steps_ahead(self.formulas, self.motion.steps + 1, self._of_moves)
        self.instant = {node for node in self.order if not self.ahead[node] and not reads_lengths(node)}
        self.concerns = about_whom(self.formulas, len(self.mission.agents))

    def read_by(self, node: Node) -> tuple[tuple[Predicate, ...], tuple[Graph, ...]]:
        """The predicates and the graphs that a formula reads."""
        if node not in self._read:
            below = postorder((node,))
            atoms = dict.fromkeys(each.predicate for each in below if isinstance(each, Atom))
            self._read[node] = tuple(atoms), linked_by((node,))
        return self._read[node]

    def states(self, node: Node, agent: int) -> Flags:
        """In which states of its roadmap, (states,), the agent's own state makes such a node true."""
        if (node, agent) not in self._states:
            self._states[node, agent] = states_of(node, agent, self.labels)
        return self._states[node, agent]

    def _of_moves(self, predicate: Predicate) -> int:
        """The steps ahead that a predicate of moves looks."""
        return int(any(self.labels.of_moves(predicate, number) for number in range(len(self.motion.roadmaps))))
