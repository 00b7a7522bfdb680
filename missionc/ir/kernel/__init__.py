"""The kernel: the core language that every operator comes down to."""

from missionc.ir.kernel import nodes as nodes
