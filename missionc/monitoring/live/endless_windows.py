"""Windows to the mission's end that are asked at every step, put as what came before its last step.

in   a goal's formula, the mission's last step
out  a formula of the same robustness at step 0 in every run, whose values need not all be kept

``always[0, end] (a or eventually[0, end] b)`` says at the last step H that at every step back to 0 there is ``a`` or
``b``, or has been ``b`` since: that is a past ``Release``, which goes on from step to step. Its dual is ``since``.

``always[0, end] (a or h until[0, end] b)`` asks for the same at H, and that before H there is ``h`` at every step that
has had no ``b`` since a step with neither ``a`` nor ``b``: there ``h``, or the past ``Release``.
Both are monotone formulas that hold in the same runs, so that they are of the same robustness in every run.
"""

from __future__ import annotations

from missionc.kernel.nodes import All, Always, Any, At, AtLeast, Eventually, Node, Release, Until, UntilNode, WindowNode
from missionc.kernel.walk import bottom_up, children, looks_back, rebuilt, same_objects


def looking_back(root: Node, last: int) -> Node:
    """The formula with what it asks at step 0 of such windows put otherwise; itself where there are none."""
    wholes: dict[tuple[bool, Node], Node] = {}

    def over(node: Node, parts: tuple[Node, ...]) -> Node:
        if isinstance(node, WindowNode):
            return _put_otherwise(node, last, wholes)
        return node if same_objects(parts, _asked_now(node)) else rebuilt(node, parts)

    return bottom_up((root,), over, _asked_now)[root]


def _asked_now(node: Node) -> tuple[Node, ...]:
    """The parts that are asked at the step at which the formula is asked."""
    return children(node) if isinstance(node, All | Any | AtLeast | At) else ()


def _put_otherwise(node: WindowNode, last: int, wholes: dict[tuple[bool, Node], Node]) -> Node:
    """A window over the whole mission, asked at step 0, without one to the end below it."""
    if node.low != 0 or node.high not in (None, last) or not last:
        return node
    body = node.body
    if isinstance(body, At):
        return At(body.agent, _whole(node, body.body, last, wholes), body.span)
    same, other = (All, Any) if node.every else (Any, All)
    if isinstance(body, same) and any(isinstance(part, At) for part in body.parts):
        return same(tuple(_whole(node, part, last, wholes) for part in body.parts), body.span)
    parts = body.parts if isinstance(body, other) else (body,)
    endless = [part for part in parts if _is_endless(part, every=not node.every)]
    if len(endless) != 1:
        return node
    (inner,) = endless
    assert isinstance(inner, WindowNode | UntilNode)
    end = inner.body if isinstance(inner, WindowNode) else inner.end
    others = tuple(part for part in parts if part is not inner)
    kind = Release if node.every else Until
    back = kind(end, other((*others, end), node.span), -last, 0, node.span)
    at_last = Always(back, last, last, node.span)
    if isinstance(inner, WindowNode):
        return at_last
    before = (Always if node.every else Eventually)(other((inner.hold, back), node.span), 0, last - 1, node.span)
    return same((before, at_last), node.span)


def _whole(node: WindowNode, part: Node, last: int, wholes: dict[tuple[bool, Node], Node]) -> Node:
    """The window over one part; that over a formula which several agents are asked is one node."""
    if isinstance(part, At):
        return At(part.agent, _whole(node, part.body, last, wholes), part.span)
    key = (node.every, part)
    if key not in wholes:
        kind = Always if node.every else Eventually
        wholes[key] = _put_otherwise(kind(part, 0, node.high, node.span), last, wholes)
    return wholes[key]


def _is_endless(node: Node, every: bool) -> bool:
    """Whether it is an operator from the present step to the mission's end, of the one kind or the other."""
    return (
        isinstance(node, WindowNode | UntilNode)
        and not looks_back(node)
        and (node.low, node.high) == (0, None)
        and node.every is every
    )
