"""Benchmark of a warehouse with 120 racks: 6, 20 and 60 vehicles with individual pickups and deliveries.

    python bench/warehouse.py [--vehicles N ...] [--limit SECONDS] [--nodes N] [--print]

The hall is that of ``missions/field/amr_hall.mission``. Prints processor seconds and bytes of `missionc compile`,
including children, until the folder is written; and the elapsed seconds for the files of the flight.
"""

from __future__ import annotations

import argparse
import random

from growth import measured

SIZES = {6: 80, 20: 120, 60: 180}
"""Numbers of vehicles, with their seconds."""

COLUMNS, ROWS = 10, 12


def mission(vehicles: int, seconds: int, nodes: int = 0, seed: int = 0) -> str:
    """Mission with ``vehicles`` vehicles, and ``nodes`` nodes if given."""
    lines = [f"mission warehouse{vehicles}", f"time  step 1 s, horizon {seconds} s", "world (0, 0) to (60, 40)"]
    racks = [(6 + 5 * column, 7 + 2.6 * row) for column in range(COLUMNS) for row in range(ROWS)]
    for number, (x, y) in enumerate(racks):
        lines.append(f"obstacle rack{number} = box ({x}, {y:g}) to ({x + 3}, {y + 0.8:g})")
    lines.append("region pack = box (44, 0.5) to (59.5, 4.5)")
    for number, (x, y) in enumerate(random.Random(seed).sample(racks, vehicles)):
        lines.append(f"region pick{number} = box ({x}, {y - 1.6:g}) to ({x + 3}, {y - 0.2:g})")
    starts = ", ".join(f"({2 + 1.6 * (number // 3):g}, {1 + 1.5 * (number % 3):g})" for number in range(vehicles))
    lines.append(f"team amr[{vehicles}] {{ radius 0.35 m  dynamics unicycle(speed 0..2 m/s)  start at {starts} }}")
    lines.append("separation 0.2 m")
    for number in range(vehicles):
        late = seconds - 20
        lines.append(f"require order{number}: amr[{number}]: (not pack) until[0, {late} s] pick{number}")
        lines.append(
            f"require pick{number}_s: amr[{number}]: eventually[0, {late} s] (pick{number} and next pick{number})"
        )
    lines.append(f"require deliver: every amr: eventually[0, {seconds - 4} s] always[0, 4 s] pack")
    lines.append("minimize distance")
    if nodes:
        lines.append(f"solve with smt {{ nodes = {nodes} }}")
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(
        "--vehicles", type=int, nargs="+", choices=SIZES, default=list(SIZES), help="numbers of vehicles"
    )
    parser.add_argument(
        "--limit", type=float, default=300.0, help="time limit of each mission, in seconds of wall time"
    )
    parser.add_argument("--nodes", type=int, default=0, help="roadmap nodes, instead of the default")
    parser.add_argument("--print", action="store_true", help="print the first mission and stop")
    arguments = parser.parse_args()
    if arguments.print:
        print(mission(arguments.vehicles[0], SIZES[arguments.vehicles[0]], arguments.nodes), end="")
        return
    print(f"{'vehicles':>8} {'outcome':>9} {'CPU s':>8} {'files s':>8} {'MB':>7}", flush=True)
    for vehicles in arguments.vehicles:
        run = measured(mission(vehicles, SIZES[vehicles], arguments.nodes), arguments.limit)
        row = f"{vehicles:>8} {run.outcome:>9} {run.seconds:>8.1f} {run.writing:>8.1f} {run.peak / 2**20:>7.0f}"
        print(row, flush=True)


if __name__ == "__main__":
    main()
