"""Export for cflib, without ROS: trajectories as they lie in a Crazyflie's memory, and a script that flies them.

Raw where they fit; else compressed, judged again as they are then, and only
where nothing that flies comes closer to anything than the mission allows.

Source:
    crazyflie-firmware, docs/functional-areas/trajectory_formats.md.
"""

from __future__ import annotations

from dataclasses import dataclass

from missionc.diagnostics.model import Diagnostic
from missionc.output.export.compressed import Compressed, as_polynomials, compress
from missionc.output.export.export_form import Exported, Format, refused
from missionc.output.export.fill_templates import render
from missionc.output.export.fly_script import for_templates
from missionc.output.export.takeoff_and_landing import cannot_rise_or_land
from missionc.output.export.trajectory_memory import raw
from missionc.output.export.verified_flight import Flight, Part
from missionc.verify.tolerances import TUBE

NAME = "cflib"

KINDS = ("raw", "compressed")
"""In the order of the firmware's numbers."""


@dataclass(frozen=True, slots=True)
class _Packed:
    """Every vehicle's bytes, one kind for all; ``within``: millimetres, of its raw polynomials at any time."""

    blobs: tuple[bytes, ...]
    kind: str
    within: tuple[str, ...]
    notes: tuple[str, ...]


def write(flight: Flight) -> Exported | Diagnostic:
    """The folder: refused if no form fits a Crazyflie's memory, or the vehicles could not rise at once."""
    grounded = cannot_rise_or_land(NAME, flight)
    if grounded is not None:
        return grounded
    packed = _packed(flight)
    if isinstance(packed, Diagnostic):
        return packed
    given = for_templates(flight) | {
        "kind": packed.kind,
        "kind_number": KINDS.index(packed.kind),
        "pieces": int(flight.parts[0].pieces.duration.size),
        "bytes": max(map(len, packed.blobs)),
        "memory": min(each.agent.vehicle.memory for each in flight.parts),
        "within": dict(zip((each.file for each in flight.parts), packed.within, strict=True)),
    }
    files = {f"{each.file}.bin": blob for each, blob in zip(flight.parts, packed.blobs, strict=True)}
    for name in ("fly.py", "README.md"):
        files[name] = render(f"cflib/{name}.j2", **given)
    return Exported(files, packed.notes)


def _packed(flight: Flight) -> _Packed | Diagnostic:
    plain = tuple(raw(each.pieces) for each in flight.parts)
    most, memory = max(map(len, plain)), min(each.agent.vehicle.memory for each in flight.parts)
    if most <= memory:
        note = f"cflib: raw, {most} of {memory} bytes of a Crazyflie's memory"
        return _Packed(plain, "raw", ("0",) * len(plain), (note,))
    compressed: list[Compressed] = []
    for each in flight.parts:
        packed = compress(each.pieces)
        if isinstance(packed, str):
            return _no_room(each, most, memory, f"`{each.agent.name}` cannot be compressed: {packed}")
        compressed.append(packed)
    blobs = tuple(packed.blob for packed in compressed)
    least = max(map(len, blobs))
    if least > memory:
        worst = flight.parts[[len(blob) for blob in blobs].index(least)]
        return _no_room(worst, most, memory, f"compressed it takes {least} bytes")
    notes = _judged(flight, compressed)
    if isinstance(notes, Diagnostic):
        return notes
    used = f"cflib: compressed, {least} of {memory} bytes of a Crazyflie's memory; raw it would be {most}"
    return _Packed(blobs, "compressed", tuple(_millimetres(packed.deviation) for packed in compressed), (used, *notes))


def _judged(flight: Flight, compressed: list[Compressed]) -> tuple[str, ...] | Diagnostic:
    """What rounding costs: refused where a body comes too close to another, to an obstacle or to the world's border."""
    exact = flight.judged({each.agent.name: each.pieces for each in flight.parts})
    rounded = flight.judged(
        {each.agent.name: as_polynomials(packed) for each, packed in zip(flight.parts, compressed, strict=True)}
    )
    judged = [check for check in rounded.checks if "flown " in check.name]
    assert len(judged) == sum("flown " in check.name for check in exact.checks), "some of it was not judged"
    failed = [check for check in judged if not check.passed]
    if failed:
        worst = min(failed, key=lambda check: check.margin)
        when = f" at {worst.at:.2f} s" if worst.at is not None else ""
        return refused(
            NAME,
            f"raw it does not fit a Crazyflie's memory, and compressed `{worst.name}` fails{when}",
            f"{worst.detail}; short by {-worst.margin:.3g} {worst.unit}",
            help="plan with a larger `step`, so that the raw pieces fit, or with more `separation` and `clearance`",
        )
    tubes = {check.subject: check.margin for check in exact.checks if check.name == "tube"}
    lines = []
    for each, packed in zip(flight.parts, compressed, strict=True):
        name = each.agent.name
        line = f"cflib: `{name}` is never further than {_millimetres(packed.deviation)} mm from its raw polynomials"
        over = packed.deviation - tubes.get(name, 0.0)
        if over > 0:
            line += f", and may leave the tube of {TUBE:g} m around the plan by {_millimetres(over)} mm"
        lines.append(line)
    lines += [f"cflib: compressed, {warning}" for warning in rounded.warnings if warning not in exact.warnings]
    return tuple(lines)


def _millimetres(metres: float) -> str:
    """Rounded up to a hundredth: a bound stays one."""
    return f"{-(-metres * 1e5 // 1) / 100:.2f}"


def _no_room(each: Part, most: int, memory: int, why: str) -> Diagnostic:
    return refused(
        NAME,
        f"the polynomials of `{each.agent.name}` take {most} bytes of the {memory} there are",
        why,
        help="plan with a larger `step`, or for a shorter time",
    )


FORMAT = Format(NAME, "trajectories as they lie in a Crazyflie's memory, and a start script for cflib", write)
