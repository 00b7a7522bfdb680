"""Certificate of impossibility: claims of a cover that proves infeasibility, their clauses, and the proof files.

    in   the infeasibility result of covers, Mission, its kernel
    out  ClaimedCover and its clauses; the files ``cover.json``, ``impossible.cnf`` and ``impossible.drat``, or a note
    with the reason

A claimed cover consists of its cells and exclusions. ``verify`` checks each clause without the code that constructed
the cover. The clauses are those of ``verify.impossibility``, which follow from the meaning of each operator; the
clauses of the search for the cover are not used. The files are written only if the certificate passes its own check.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import replace
from itertools import combinations

import numpy as np

from missionc.backends.api import Budget
from missionc.backends.cover.bodies import bodies
from missionc.backends.cover.keep_apart import rooms, together_ever
from missionc.backends.cover.may_labels import MayLabels, near_beacon, nearer, seen
from missionc.backends.cover.may_moves import may_turn
from missionc.backends.cover.may_visit import too_far_apart
from missionc.backends.cover.refute import Question, Refuted
from missionc.backends.run_account import Account
from missionc.backends.smt.sat.proof import CNF, DRAT, Unproved, prove_cnf
from missionc.base.trace import Array, Flags
from missionc.ir import BeaconCover, Box, Graph, Mission, Predicate, Shape, Sight
from missionc.ir.couplings import range_of
from missionc.ir.kernel.nodes import Atom, Kernel
from missionc.ir.kernel.show import KernelWords
from missionc.verification.impossibility.bodies import is_plain, name_in_graph, name_of_obstacle, parts
from missionc.verification.impossibility.check_refutation import check_refutation
from missionc.verification.impossibility.cnf import Cnf, TooManyClauses
from missionc.verification.impossibility.cover_document import COVER, CellsOfKind, ClaimedCover, Label, document
from missionc.verification.impossibility.encode_formulas import Never, refutation


def claimed(
    question: Question, conflict: tuple[str, ...], mission: Mission, kernel: Kernel
) -> tuple[ClaimedCover, Cnf]:
    """Cover of a query with all its exclusions, and the clauses of the conflicting requirements on its cells."""
    capped, cover, asked = question.caps.mission, question.cover, sorted(question.cast)
    number_of = {agent: number for number, each in enumerate(cover.roadmaps) for agent in each.agents}
    cells_of = {agent: cover.cells[number] for agent, number in number_of.items()}
    absent = {agent: _absent(question, agent, number_of[agent]) for agent in asked}
    starts = {agent: ~flags[0] for agent, flags in absent.items()}
    never_together = {}
    for one, other in combinations(sorted(question.together), 2):
        may = together_ever(capped, (cells_of[one], cells_of[other]), (one, other), (starts[one], starts[other]))
        never_together[one, other] = ~may
    bare = ClaimedCover(
        conflict=conflict,
        asked=tuple(asked),
        apart=bool(question.together),
        kinds=tuple(_kind(question, number) for number in range(len(cover.roadmaps))),
        bodies=_boxes(mission),
        absent=absent,
        not_both={
            agent: too_far_apart(capped, cells_of[agent], agent, starts[agent], question.caps.lengths)
            for agent in asked
        },
        at_most=tuple(rooms(capped, cover, question.together)),
        not_together=never_together,
        labels=(),
    )
    labels = _MadeLabels(mission, question.labels, number_of)
    goals = tuple(goal for goal in kernel.requirements if goal.name in conflict)
    clauses = refutation(mission, goals, bare, labels)
    return replace(bare, labels=tuple(labels.made)), clauses


def _absent(question: Question, agent: int, number: int) -> Flags:
    """Flags of cells in which an agent cannot be at each step, by obstacles, start and finish, and distances."""
    roadmap = question.cover.roadmaps[number]
    member = roadmap.agents.index(agent)
    absent: Flags = ~roadmap.standing | question.cover.never[agent]
    for row, ends in ((0, roadmap.starts[member]), (-1, roadmap.finishes[member])):
        others = np.ones(absent.shape[1], dtype=np.bool_)
        others[ends] = False
        absent[row] |= others
    return absent


def _kind(question: Question, number: int) -> CellsOfKind:
    cover, mission = question.cover, question.caps.mission
    roadmap, cells = cover.roadmaps[number], cover.cells[number]
    moves = np.zeros((len(cells), len(cells)), dtype=np.bool_)
    moves[tuple(roadmap.moves.T)] = True
    never = {1: moves, **dict(cover.strides[number])}
    turns = dict(may_turn(mission, cells, mission.agents[roadmap.agents[0]].dynamics))
    return CellsOfKind(
        agents=roadmap.agents,
        boxes=(cells.low, cells.high),
        points=cells.points,
        left_out=cells.left_out,
        no_move={steps: ~may for steps, may in never.items() if steps <= mission.steps},
        no_turn={steps: ~may for steps, may in turns.items()},
    )


def _boxes(mission: Mission) -> dict[str, tuple[Array, Array]]:
    """Boxes inside combined shapes, of obstacles and of shapes that block sight: corners (boxes, dim), metres."""
    shapes: dict[str, Shape] = {name_of_obstacle(number): each.shape for number, each in enumerate(mission.obstacles)}
    for graph in mission.graphs:
        if isinstance(graph, Sight):
            shapes.update((name_in_graph(graph, number), shape) for number, shape in enumerate(graph.shapes))
    found: dict[str, tuple[Array, Array]] = {}
    for name, shape in shapes.items():
        if not all(map(is_plain, parts(shape))):
            boxes = [body for body in bodies(shape) if isinstance(body, Box)]
            corners = np.array([(box.low, box.high) for box in boxes], dtype=np.float64)
            if boxes:
                found[name] = corners[:, 0], corners[:, 1]
    return found


class _MadeLabels:
    """Labels of formula leaves computed from the cover, and recorded as they are requested."""

    def __init__(self, mission: Mission, labels: MayLabels, number_of: dict[int, int]) -> None:
        self.labels, self.number_of, self.words = labels, number_of, KernelWords(mission)
        self.made: list[Label] = []
        self._known: dict[Hashable, Never] = {}

    def own(self, predicate: Predicate, agent: int) -> Never:
        number = self.number_of[agent]
        return self._made(
            (predicate, number),
            self._text(predicate),
            "cells",
            (agent,),
            lambda truth: ~self._own(predicate, number, truth),
        )

    def moves(self, predicate: Predicate, agent: int) -> Never:
        number = self.number_of[agent]
        roadmap = self.labels.roadmaps[number]

        def never(truth: bool) -> Flags:
            found: Flags = np.zeros((len(roadmap.position),) * 2, dtype=np.bool_)
            found[tuple(roadmap.moves.T)] = ~self.labels.moves(predicate, number, truth, at_end=False)
            return found

        return self._made((predicate, number, "moves"), self._text(predicate), "moves", (agent,), never)

    def pair(self, predicate: Predicate, first: int, second: int) -> Never:
        return self._made(
            (predicate, first, second),
            self._text(predicate),
            "pairs",
            (first, second),
            lambda truth: ~self._pair(predicate, first, second, truth),
        )

    def link(self, graph: Graph, sender: int, receiver: int) -> Never:
        numbers = self.number_of[sender], self.number_of[receiver]
        reach = float(graph.radius) if isinstance(graph, BeaconCover) else float(range_of(graph, sender, receiver))

        def never(truth: bool) -> Flags:
            match graph:
                case BeaconCover(beacons=beacons):
                    parts = [self._near(graph, position, numbers, truth) for position in beacons]
                    may: Flags = np.logical_or.reduce(parts) if truth else np.logical_and.reduce(parts)
                    return ~may
                case Sight():
                    link = seen(graph, sender, receiver).predicate
                    may = self._pair(link, sender, receiver, truth)
                    return ~may if truth else np.zeros_like(may)
                case _:
                    node = nearer(sender, receiver, reach)
                    assert isinstance(node, Atom)
                    return ~self._pair(node.predicate, sender, receiver, truth)

        return self._made((graph, numbers, reach), f"a link of {graph.name}", "pairs", (sender, receiver), never)

    def _near(self, graph: BeaconCover, position: tuple[float, ...], numbers: tuple[int, int], truth: bool) -> Flags:
        """Flags of pairs of cells that are both near a beacon, or with ``truth`` False not both near: (cells,
        cells).
        """
        node = near_beacon(graph, position, True)
        assert isinstance(node, Atom)
        here, there = (self._own(node.predicate, number, truth) for number in numbers)
        return here[:, None] & there[None, :] if truth else here[:, None] | there[None, :]

    def _own(self, predicate: Predicate, number: int, truth: bool) -> Flags:
        return self.labels.states_where(predicate, number, truth)

    def _pair(self, predicate: Predicate, first: int, second: int, truth: bool) -> Flags:
        numbers = self.number_of[first], self.number_of[second]
        return self.labels.pairs_where(predicate, (first, second), *numbers, truth)

    def _text(self, predicate: Predicate) -> str:
        return predicate.show(self.words)

    def _made(
        self, key: Hashable, leaf: str, of: str, agents: tuple[int, ...], never: Callable[[bool], Flags]
    ) -> Never:
        if key not in self._known:
            self._known[key] = never(True), never(False)
            self.made.append(Label(leaf, of, agents, *self._known[key]))
        return self._known[key]


NO_CERTIFICATE = "no certificate was written:"


def certify_refusal(refused: Refuted, mission: Mission, kernel: Kernel, budget: Budget, account: Account) -> None:
    """Add the files of an impossibility certificate to a run's account, or a note with the reason why there is none.

    Args:
        kernel: kernel of the original mission, with past operators.
    """
    with account.stage("proof"):
        try:
            cover, clauses = claimed(refused.question, refused.conflict, mission, kernel)
        except TooManyClauses as error:
            account.notes.append(f"{NO_CERTIFICATE} {error}")
            return
        match prove_cnf(clauses.dimacs(), budget):
            case None:
                account.notes.append(f"{NO_CERTIFICATE} the checked clauses are weaker than the refuted ones")
            case Unproved(statement):
                account.notes.append(statement)
            case proof:
                files = {COVER: document(cover, mission), CNF: proof.cnf, DRAT: proof.drat}
                failed = [
                    each
                    for each in check_refutation(mission, kernel, files, budget.limits, budget.deadline)
                    if not each.passed
                ]
                if failed:
                    first = failed[0]
                    account.notes.append(f"{NO_CERTIFICATE} {first.name} of {first.subject}: {first.detail}")
                else:
                    account.files |= files
