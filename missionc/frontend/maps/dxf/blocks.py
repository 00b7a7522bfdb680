"""Blocks of a drawing: a count of their contents, then each entity that is read with its transformation.

The count multiplies through nested blocks and their rows and columns, so that it takes no longer than reading the file.
A block is expanded only if an entity in it is read.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from missionc.base.late_dataclass import Record
from missionc.frontend.maps.dxf.shapes import Points, UnusableError

Parts: TypeAlias = Counter[tuple[str, str]]
"""Number of entities by kind and reason for omission; the reason is empty for entities that are read."""

OTHER_LAYER, HIDDEN, PAPER, EXTERNAL = "on another layer", "hidden", "in paper space", "an external reference"
INHERITED = "0"
"""Name of the layer whose entities, inside a block, take the layer of the block's insertion."""


class Placed(Record):
    """Entity of a drawing, with its transformation to the drawing's coordinates.

    Args:
        matrix: (4, 3), from the coordinates of its block to those of the drawing: three axes and a shift, in rows.
    """

    entity: Any
    matrix: NDArray[np.float64]
    layer: str

    def seen(self, points: Points, *, vectors: bool = False) -> Points:
        """Points or vectors of the block, (…, 3), transformed to the drawing seen from above, (…, 2)."""
        above: Points = points @ self.matrix[:3, :2] + (0.0 if vectors else self.matrix[3, :2])
        return above


class Blocks:
    """Iterable of all entities of a drawing, with nested blocks expanded.

    Args:
        layers: layers that are read; all visible ones if empty.
        unread: function that returns the reason why entities of a kind are not read, or an empty text.
        deepest: maximum number of levels of nesting.

    Attributes:
        parts: counts for the complete drawing, including copies of blocks.

    Raises:
        UnusableError: a block contains itself, is not defined, or is nested too deep.
    """

    def __init__(self, document: Any, layers: Iterable[str], unread: Callable[[str], str], deepest: int) -> None:
        self._space, self._unread, self._deepest = document.modelspace(), unread, deepest
        self._layers = {folded(each) for each in layers}
        self._frozen = {folded(layer.dxf.name) for layer in document.layers if layer.is_frozen()}
        self._hidden = self._frozen | {folded(layer.dxf.name) for layer in document.layers if layer.is_off()}
        self._counted: dict[tuple[str, str], tuple[Parts, list[Any]]] = {}
        self._open: list[str] = []
        papers = [each for each in document.layouts if not each.is_modelspace]
        kinds = [entity.dxftype() for paper in papers for entity in paper]
        self.parts = self._count(self._space, self._left_out(INHERITED))[0].copy()
        self.parts.update((kind, PAPER) for kind in kinds if kind != "VIEWPORT")

    def __iter__(self) -> Iterator[Placed]:
        """Yield the entities that are read, in the order of the drawing."""
        return self._placed(self._space, np.eye(4)[:, :3], INHERITED)

    def _left_out(self, layer: str) -> str:
        """Reason why entities of a layer are not read; empty if they are."""
        if self._layers:
            return "" if folded(layer) in self._layers else OTHER_LAYER
        return HIDDEN if folded(layer) in self._hidden else ""

    def _count(self, layout: Any, inherited: str) -> tuple[Parts, list[Any]]:
        """Counts of a block's contents, and its entities that contain something to read.

        Args:
            inherited: reason why the layer of the insertion is not read.

        Raises:
            UnusableError: the block contains itself, or is nested too deep.
        """
        key = layout.layout_key, inherited
        if key not in self._counted:
            if layout.layout_key in self._open:
                raise UnusableError(f"the block `{layout.name[:80]}` contains itself")
            if len(self._open) > self._deepest:
                raise UnusableError(f"blocks are nested more than {self._deepest} deep")
            self._open.append(layout.layout_key)
            parts, read = Counter[tuple[str, str]](), []
            for entity in layout:
                own = layer_of(entity)
                found = self._within(entity, inherited if own == INHERITED else self._left_out(own))
                parts.update(found)
                if any(not reason for _, reason in found):
                    read.append(entity)
            self._open.pop()
            self._counted[key] = parts, read
        return self._counted[key]

    def _within(self, entity: Any, left_out: str) -> Parts:
        """Counts of an entity's contents; ``left_out`` is the reason why its layer is omitted, if it is."""
        kind, invisible = entity.dxftype(), bool(_property(entity, "invisible", 0))
        if kind != "INSERT":
            return Counter([(kind, left_out or (HIDDEN if invisible else self._unread(kind)))])
        block, copies = block_of(entity), math.prod(_grid(entity))
        if block.block.is_xref or block.block.is_xref_overlay:
            return Counter({(kind, left_out or EXTERNAL): copies})
        parts = Counter({part: copies * count for part, count in self._count(block, left_out)[0].items()})
        for attribute in entity.attribs:
            parts[attribute.dxftype(), left_out or self._unread(attribute.dxftype())] += copies
        if not invisible and not (left_out == HIDDEN and folded(layer_of(entity)) in self._frozen):
            return parts
        hidden = Counter[tuple[str, str]]()
        for (name, _), count in parts.items():
            hidden[name, HIDDEN] += count
        return hidden

    def _placed(self, layout: Any, matrix: NDArray[np.float64], inherited: str) -> Iterator[Placed]:
        for entity in self._count(layout, self._left_out(inherited))[1]:
            own = layer_of(entity)
            layer = inherited if own == INHERITED else own
            if entity.dxftype() != "INSERT":
                yield Placed(entity, matrix, layer)
                continue
            for placement in _placements(entity):
                axes, shift = placement[:3] @ matrix[:3], placement[3] @ matrix[:3] + matrix[3]
                yield from self._placed(block_of(entity), np.vstack([axes, shift]), layer)


def folded(layer: str) -> str:
    """Name of a layer without regard to case, for comparisons."""
    return layer.casefold()


def layer_of(entity: Any) -> str:
    return str(_property(entity, "layer", INHERITED))


def _property(entity: Any, name: str, default: object) -> Any:
    """Property that entities of every kind have; ``ezdxf`` stores those of unknown kinds elsewhere."""
    known = entity.dxf.is_supported(name)
    return entity.dxf.get(name, default) if known else entity.graphic_properties().get(name, default)


def block_of(entity: Any) -> Any:
    block = entity.block()
    if block is None:
        raise UnusableError(f"the block `{str(entity.dxf.get('name', ''))[:80]}` is not defined")
    return block


def _grid(entity: Any) -> tuple[int, int]:
    """Number of rows and columns of an insertion; copies without a distance count once."""
    dxf = entity.dxf
    return (
        max(dxf.get("row_count", 1), 1) if dxf.get("row_spacing", 0.0) else 1,
        max(dxf.get("column_count", 1), 1) if dxf.get("column_spacing", 0.0) else 1,
    )


def _placements(entity: Any) -> Iterator[NDArray[np.float64]]:
    """Yield the transformation matrices of the copies of a block insertion, (4, 3) each."""
    matrix = np.array(list(entity.matrix44().rows()))[:, :3]
    axes, angle = entity.ocs(), math.radians(entity.dxf.get("rotation", 0.0))
    right, ahead = np.array(axes.ux.xyz), np.array(axes.uy.xyz)
    along = math.cos(angle) * right + math.sin(angle) * ahead
    aside = math.cos(angle) * ahead - math.sin(angle) * right
    rows, columns = _grid(entity)
    for row in range(rows):
        for column in range(columns):
            copy = matrix.copy()
            copy[3] += column * entity.dxf.get("column_spacing", 0.0) * along
            copy[3] += row * entity.dxf.get("row_spacing", 0.0) * aside
            yield copy
