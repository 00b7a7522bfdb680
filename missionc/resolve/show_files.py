"""Summary of the files that a mission reads: the places and lanes of each, what was left out, the extents."""

from __future__ import annotations

from collections.abc import Iterator

from missionc import ir
from missionc.base.figures import counted
from missionc.ir.wording import point


def file_lines(mission: ir.Mission) -> list[str]:
    """A line for each file and kind of place; none for a mission without files."""
    return [_line(file, lanes) for file, lanes in _files(mission)]


def file_records(mission: ir.Mission) -> list[dict[str, object]]:
    """The same for JSON: ``lanes`` is null but for roadmaps; ``low`` and ``high`` in metres, null without extents."""
    return [_record(file, lanes) for file, lanes in _files(mission)]


def _record(file: ir.PlacesFile, lanes: int | None) -> dict[str, object]:
    low, high = file.summary.extents or (None, None)
    return {
        "file": file.path,
        "kind": file.kind,
        "count": file.summary.count,
        "lanes": lanes,
        "left_out": [{"kind": each.kind, "reason": each.reason, "count": each.count} for each in file.summary.left_out],
        "low": low and [round(value, 9) for value in low],
        "high": high and [round(value, 9) for value in high],
    }


def _files(mission: ir.Mission) -> Iterator[tuple[ir.PlacesFile, int | None]]:
    """Each file, and of a roadmap the number of its lanes."""
    yield from ((file, None) for file in mission.files)
    if mission.solve.roadmap is not None:
        from missionc.maps.read_summary import ReadSummary, box  # few missions have one

        roadmap = mission.solve.roadmap
        extents = box(node.position for node in roadmap.nodes)
        yield ir.PlacesFile(roadmap.path, "node", ReadSummary(len(roadmap.nodes), (), extents)), len(roadmap.lanes)


def _line(file: ir.PlacesFile, lanes: int | None) -> str:
    """``hall.yaml: 3 obstacles, (0, 0) to (10, 5) m; left out: 2 TEXT (not an area)``."""
    from missionc.maps.read_summary import without  # few missions read files

    between = f", {' to '.join(map(point, file.summary.extents))} m" if file.summary.extents else ""
    of_lanes = "" if lanes is None else f", {counted(lanes, 'lane')}"
    return f"{file.path}: {counted(file.summary.count, file.kind)}{of_lanes}{between}{without(file.summary.left_out)}"
