"""Kernel: the core language to which all operators expand."""

from missionc.ir.kernel import nodes as nodes
