"""A roadmap as a graph: its bottlenecks, how far its regions are, and in how many parts the radio falls.

python examples/roadmap_as_graph.py missions/gallery/factory_lanes.mission build/factory_lanes.graphml
"""

from __future__ import annotations

import sys

import networkx as nx

import missionc


def main(mission: str, file: str) -> int:
    compiled = missionc.compile(mission)
    if not isinstance(compiled.outcome, missionc.Verified):
        print(*compiled.findings, sep="\n")
        return 1
    trace = compiled.outcome.plan.trace
    for graph in missionc.roadmap_graphs(compiled):
        print(f"{graph.graph['agents']}: {len(graph)} nodes, {graph.number_of_edges()} edges")
        cuts = sorted(nx.articulation_points(graph.to_undirected()))
        print(f"  without any one of these it falls apart: {', '.join(cuts) or 'none'}")
        regions = {label for _, labels in graph.nodes(data="labels") for label in labels.split()}
        for region in sorted(regions):
            inside = [node for node, labels in graph.nodes(data="labels") if region in labels.split()]
            seconds, _ = nx.multi_source_dijkstra(graph.reverse(), inside, weight="duration")
            print(f"  to {region}: {max(seconds.values()):g} s at most, from the farthest node")
        nx.write_graphml(graph, file)
    for name in (graph.name for graph in compiled.checked.mission.graphs):
        parts = [
            nx.number_connected_components(missionc.link_graph(compiled.checked, trace, name, step))
            for step in range(trace.position.shape[1])
        ]
        print(f"{name}: in {min(parts)} to {max(parts)} parts")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(*sys.argv[1:3]))
