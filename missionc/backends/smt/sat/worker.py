"""Solver in a separate process: ``python -I -S worker.py SOLVER MEMORY_BYTES SEED FOLDER``.

Z3 in the same process would swallow Ctrl-C, and its memory limit would end the interpreter. This file imports nothing
from the compiler and little from Python, so that the child is ready soon. ``FOLDER`` is the folder of the solver's
package. The process reads messages from standard input and answers on standard output. A message is a letter, a length
of eight bytes, and its content:

    A  clauses as DIMACS text
    L  clauses as literals, with a 0 after each
    C  conflict limit of the solver, from now until N
    N  reset, without clauses
    S  assumptions: solve; the answer is S with the result, the number of conflicts in four bytes, and the core
       or the reason
    V  variables: the answer is V with a byte for each, 1 if true in the last model

The process sends R when it is ready, and E with the reason after a failure.

As ``proof`` it reads one DIMACS text to its end, and writes a DRAT proof of unsatisfiability; nothing if satisfiable.
"""

from __future__ import annotations

import ctypes
import os
import resource
import sys

TYPE_CHECKING = False  # of ``typing``, whose import would take a tenth of the child's start
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any, BinaryIO, Protocol

    class Solver(Protocol):
        def add_text(self, dimacs: bytes) -> None: ...

        def add(self, literals: list[int]) -> None:
            """Add clauses, each ended by a 0."""

        def solve(self, assumptions: list[int]) -> tuple[bytes, bytes]:
            """Answer, with the assumptions of its core or the reason for none."""

        def conflicts_met(self) -> int:
            """Number of conflicts of all questions since the solver was made or reset."""

        def values(self, variables: list[int]) -> bytes: ...

        def anew(self) -> None:
            """Reset all clauses."""

        def give_up_after(self, conflicts: int) -> None:
            """Set the conflict limit of one question, if the solver can count them."""


SAT, UNSAT, UNKNOWN = b"s", b"u", b"?"

OUT_OF_MEMORY = ("memory", "failed to map segment")
"""Texts in the errors of Z3, and of the system's loader, that mean a lack of memory."""

POINTER, NUMBER, TEXT = ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p
SIGNATURES: dict[str, tuple[Any, ...]] = {
    "ast_vector_get": (POINTER, POINTER, POINTER, NUMBER),
    "ast_vector_inc_ref": (None, POINTER, POINTER),
    "ast_vector_size": (NUMBER, POINTER, POINTER),
    "get_app_decl": (POINTER, POINTER, POINTER),
    "get_bool_value": (NUMBER, POINTER, POINTER),
    "get_error_code": (NUMBER, POINTER),
    "get_error_msg": (TEXT, POINTER, NUMBER),
    "global_param_set": (None, TEXT, TEXT),
    "inc_ref": (None, POINTER, POINTER),
    "mk_bool_sort": (POINTER, POINTER),
    "mk_config": (POINTER,),
    "mk_const": (POINTER, POINTER, POINTER, POINTER),
    "mk_context_rc": (POINTER, POINTER),
    "mk_int_symbol": (POINTER, POINTER, NUMBER),
    "mk_not": (POINTER, POINTER, POINTER),
    "mk_or": (POINTER, POINTER, NUMBER, POINTER),
    "mk_params": (POINTER, POINTER),
    "mk_solver_for_logic": (POINTER, POINTER, POINTER),
    "mk_string_symbol": (POINTER, POINTER, TEXT),
    "model_dec_ref": (None, POINTER, POINTER),
    "model_get_const_interp": (POINTER, POINTER, POINTER, POINTER),
    "model_inc_ref": (None, POINTER, POINTER),
    "set_error_handler": (None, POINTER, POINTER),
    "params_dec_ref": (None, POINTER, POINTER),
    "params_inc_ref": (None, POINTER, POINTER),
    "params_set_uint": (None, POINTER, POINTER, POINTER, ctypes.c_uint),
    "solver_assert": (None, POINTER, POINTER, POINTER),
    "solver_check_assumptions": (NUMBER, POINTER, POINTER, NUMBER, POINTER),
    "solver_dec_ref": (None, POINTER, POINTER),
    "solver_from_string": (None, POINTER, POINTER, TEXT),
    "solver_get_model": (POINTER, POINTER, POINTER),
    "solver_get_reason_unknown": (TEXT, POINTER, POINTER),
    "solver_get_statistics": (POINTER, POINTER, POINTER),
    "solver_get_unsat_core": (POINTER, POINTER, POINTER),
    "solver_inc_ref": (None, POINTER, POINTER),
    "solver_set_params": (None, POINTER, POINTER, POINTER),
    "stats_dec_ref": (None, POINTER, POINTER),
    "stats_get_key": (TEXT, POINTER, POINTER, ctypes.c_uint),
    "stats_get_uint_value": (ctypes.c_uint, POINTER, POINTER, ctypes.c_uint),
    "stats_inc_ref": (None, POINTER, POINTER),
    "stats_size": (ctypes.c_uint, POINTER, POINTER),
}
"""Functions of Z3's C interface that are used: type of the result, then types of the arguments."""

PARAMETERS = {"branching.heuristic": "chb"}
"""Z3 parameters with which all of the larger test problems were solved; the defaults failed on some of them."""


CONFLICTS = b"sat conflicts"
"""Name of the conflict counter in Z3's statistics."""


class Z3:
    """Z3's solver for finite domains, through its C interface.

    Loading Z3's whole Python package takes longer than many problems. Variable ``n`` of a DIMACS text is constant
    number ``n``. Text is much faster to add than terms, but has a cost per variable so far. Small additions therefore
    use terms.
    """

    def __init__(self, seed: int, folder: str) -> None:
        self.library = library = z3_library(folder)
        for name, value in {"random_seed": str(seed % 2**31), **PARAMETERS}.items():
            library.Z3_global_param_set(f"sat.{name}".encode(), value.encode())
        self.context = context = library.Z3_mk_context_rc(library.Z3_mk_config())
        library.Z3_set_error_handler(context, None)
        self.sort = library.Z3_mk_bool_sort(context)
        self.terms: dict[int, int] = {}
        self.model: int | None = None
        self.solver: int | None = None
        self.anew()

    def anew(self) -> None:
        library, context = self.library, self.context
        if self.solver is not None:
            library.Z3_solver_dec_ref(context, self.solver)
        self.solver = library.Z3_mk_solver_for_logic(context, library.Z3_mk_string_symbol(context, b"QF_FD"))
        library.Z3_solver_inc_ref(context, self.solver)

    def give_up_after(self, conflicts: int) -> None:
        library, context = self.library, self.context
        parameters = library.Z3_mk_params(context)
        library.Z3_params_inc_ref(context, parameters)
        name = library.Z3_mk_string_symbol(context, b"max_conflicts")
        library.Z3_params_set_uint(context, parameters, name, conflicts)
        library.Z3_solver_set_params(context, self.solver, parameters)
        library.Z3_params_dec_ref(context, parameters)
        self.check()

    def add_text(self, dimacs: bytes) -> None:
        self.library.Z3_solver_from_string(self.context, self.solver, dimacs)
        self.check()

    def add(self, literals: list[int]) -> None:
        library, context, solver, term = self.library, self.context, self.solver, self.term
        clause: list[int] = []
        for literal in literals:
            if literal:
                clause.append(term(literal))
                continue
            library.Z3_solver_assert(context, solver, library.Z3_mk_or(context, len(clause), terms(clause)))
            clause.clear()
        self.check()

    def solve(self, assumptions: list[int]) -> tuple[bytes, bytes]:
        library, context, solver = self.library, self.context, self.solver
        assumed = {self.term(literal): literal for literal in assumptions}
        answer = library.Z3_solver_check_assumptions(context, solver, len(assumed), terms(list(assumed)))
        self.check()
        if answer == 1:
            if self.model is not None:
                library.Z3_model_dec_ref(context, self.model)
            self.model = library.Z3_solver_get_model(context, solver)
            library.Z3_model_inc_ref(context, self.model)
            return SAT, b""
        if answer == 0:
            return UNKNOWN, bytes(library.Z3_solver_get_reason_unknown(context, solver))
        core = library.Z3_solver_get_unsat_core(context, solver)
        library.Z3_ast_vector_inc_ref(context, core)
        size = library.Z3_ast_vector_size(context, core)
        return UNSAT, packed([assumed[library.Z3_ast_vector_get(context, core, place)] for place in range(size)])

    def conflicts_met(self) -> int:
        library, context = self.library, self.context
        statistics = library.Z3_solver_get_statistics(context, self.solver)
        library.Z3_stats_inc_ref(context, statistics)
        places = range(library.Z3_stats_size(context, statistics))
        named = [place for place in places if library.Z3_stats_get_key(context, statistics, place) == CONFLICTS]
        met = sum(library.Z3_stats_get_uint_value(context, statistics, place) for place in named)
        library.Z3_stats_dec_ref(context, statistics)
        return int(met)

    def values(self, variables: list[int]) -> bytes:
        library, context, model, term = self.library, self.context, self.model, self.term
        values = bytearray(len(variables))
        for place, variable in enumerate(variables):
            declaration = library.Z3_get_app_decl(context, term(variable))
            meaning = library.Z3_model_get_const_interp(context, model, declaration)
            values[place] = meaning is not None and library.Z3_get_bool_value(context, meaning) == 1
        return bytes(values)

    def term(self, literal: int) -> int:
        """Term of a literal; it is retained forever because Z3 counts references."""
        if literal not in self.terms:
            library, context = self.library, self.context
            if literal > 0:
                made = library.Z3_mk_const(context, library.Z3_mk_int_symbol(context, literal), self.sort)
            else:
                made = library.Z3_mk_not(context, self.term(-literal))
            library.Z3_inc_ref(context, made)
            self.terms[literal] = made
        return self.terms[literal]

    def check(self) -> None:
        """Raise an error that Z3 has reported since the last call.

        Raises:
            RuntimeError: Z3 has reported an error.
        """
        if code := self.library.Z3_get_error_code(self.context):
            raise RuntimeError(self.library.Z3_get_error_msg(self.context, code).decode())


def z3_library(folder: str) -> Any:
    """Z3's library in the package z3-solver, or the system's if the package contains none."""
    inside = os.path.join(folder, "z3", "lib")
    names = sorted(os.listdir(inside)) if os.path.isdir(inside) else []
    paths = [os.path.join(inside, name) for name in names if name.startswith("libz3.")]
    library = ctypes.CDLL(paths[0] if paths else "libz3.so")
    for name, (result, *arguments) in SIGNATURES.items():
        function = getattr(library, f"Z3_{name}")
        function.restype, function.argtypes = result, arguments
    return library


def terms(made: list[int]) -> Any:
    return (ctypes.c_void_p * len(made))(*made)


class CaDiCaL:
    """CaDiCaL solver through the package python-sat."""

    def __init__(self, proof: bool = False) -> None:
        from pysat.solvers import Cadical195

        self.make: Callable[[], Any] = lambda: Cadical195(with_proof=proof)
        self.solver = self.make()
        self.conflicts = 0
        self.true: frozenset[int] = frozenset()

    def anew(self) -> None:
        self.solver.delete()
        self.solver = self.make()
        self.conflicts = 0

    def give_up_after(self, conflicts: int) -> None:
        self.conflicts = conflicts

    def add_text(self, dimacs: bytes) -> None:
        self.add([int(word) for word in dimacs.split(b"\n", 1)[1].split()])

    def add(self, literals: list[int]) -> None:
        start = 0
        while start < len(literals):
            end = literals.index(0, start)
            self.solver.add_clause(literals[start:end])
            start = end + 1

    def solve(self, assumptions: list[int]) -> tuple[bytes, bytes]:
        if self.conflicts:
            self.solver.conf_budget(self.conflicts)
            answer = self.solver.solve_limited(assumptions=assumptions)
        else:
            answer = self.solver.solve(assumptions=assumptions)
        if answer is None:
            return UNKNOWN, b"too many conflicts"
        if answer:
            self.true = frozenset(literal for literal in self.solver.get_model() if literal > 0)
            return SAT, b""
        return UNSAT, packed(self.solver.get_core() or [])

    def conflicts_met(self) -> int:
        return int(self.solver.accum_stats()["conflicts"])

    def values(self, variables: list[int]) -> bytes:
        return bytes(variable in self.true for variable in variables)

    def proof(self) -> bytes:
        """DRAT proof as text: derived and deleted clauses up to the empty clause."""
        lines = self.solver.get_proof()
        return "".join(f"{line}\n" for line in lines[: lines.index("0") + 1]).encode()


def packed(literals: list[int]) -> bytes:
    return bytes((ctypes.c_int32 * len(literals))(*literals))


def unpacked(payload: bytes) -> list[int]:
    return memoryview(payload).cast("i").tolist()


def main() -> None:
    name, memory, seed, folder = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), sys.argv[4]
    die_with_parent()
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    sys.path.append(folder)
    source, sink = sys.stdin.buffer, sys.stdout.buffer
    if name == "proof":
        return refute_in_child(source, sink)
    try:
        serve(CaDiCaL() if name == "cadical" else Z3(seed, folder), source, sink)
    except MemoryError:
        send(sink, b"E", b"memory")
    except Exception as error:
        message = str(error)
        send(sink, b"E", b"memory" if any(words in message for words in OUT_OF_MEMORY) else message.encode())


def refute_in_child(source: BinaryIO, sink: BinaryIO) -> None:
    solver = CaDiCaL(proof=True)
    solver.add_text(source.read())
    if solver.solve([])[0] == UNSAT:
        sink.write(solver.proof())
        sink.flush()


def serve(solver: Solver, source: BinaryIO, sink: BinaryIO) -> None:
    send(sink, b"R", b"")
    while len(head := source.read(9)) == 9:
        payload = source.read(int.from_bytes(head[1:], "little"))
        match head[:1]:
            case b"A":
                solver.add_text(payload)
            case b"L":
                solver.add(unpacked(payload))
            case b"C":
                solver.give_up_after(unpacked(payload)[0])
            case b"N":
                solver.anew()
            case b"S":
                before = solver.conflicts_met()
                answer, detail = solver.solve(unpacked(payload))
                met = max(0, solver.conflicts_met() - before)
                send(sink, b"S", answer + packed([met]) + detail)
            case b"V":
                send(sink, b"V", solver.values(unpacked(payload)))


def send(sink: BinaryIO, kind: bytes, payload: bytes) -> None:
    sink.write(kind + len(payload).to_bytes(8, "little") + payload)
    sink.flush()


def die_with_parent() -> None:
    """Make this process end with its parent: by the kernel on Linux, by a thread on other systems."""
    parent = os.getppid()
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(1, 9)  # PR_SET_PDEATHSIG, SIGKILL
        if os.getppid() != parent:
            os._exit(1)
        return
    import threading
    import time

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


if __name__ == "__main__":
    main()
