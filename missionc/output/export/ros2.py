"""Export for ROS 2: one ``trajectory_msgs/MultiDOFJointTrajectory`` in YAML with the states of all agents.

Source:
    ros2/common_interfaces, trajectory_msgs/msg/MultiDOFJointTrajectory.msg.
"""

from __future__ import annotations

import math

from missionc.base.trace import Array
from missionc.output.export.export_form import Exported, Format
from missionc.output.export.fill_templates import yaml
from missionc.output.export.samples import RATE, Samples, clock, fixed, sampled
from missionc.output.export.verified_flight import Flight

NAME = "ros2"
FRAME = "world"
STILL = "{x: 0.0, y: 0.0, z: 0.0}"


def write(flight: Flight) -> Exported:
    """File ``trajectory.yaml`` with the fields in the order of the message."""
    samples = sampled(flight)
    lines = [
        f"header: {{stamp: {{sec: 0, nanosec: 0}}, frame_id: {yaml(FRAME)}}}",
        f"joint_names: {yaml(tuple(each.agent.name for each in flight.parts))}",
        "points:",
    ]
    for row, time in enumerate(samples.times.tolist()):
        agents = range(len(flight.parts))
        sec, nanosec = clock(time)
        lines += ["- transforms:", *(f"  - {_transform(samples, agent, row)}" for agent in agents)]
        spin = [f"{{x: 0.0, y: 0.0, z: {fixed(samples.yaw_rate[agent, row])}}}" for agent in agents]
        lines += ["  velocities:", *(f"  - {_twist(samples.velocity[agent, row], spin[agent])}" for agent in agents)]
        lines += ["  accelerations:", *(f"  - {_twist(samples.acceleration[agent, row], STILL)}" for agent in agents)]
        lines += [f"  time_from_start: {{sec: {sec}, nanosec: {nanosec}}}"]
    return Exported({"trajectory.yaml": ("\n".join(lines) + "\n").encode()})


def _transform(samples: Samples, agent: int, row: int) -> str:
    half = float(samples.yaw[agent, row]) / 2
    rotation = f"{{x: 0.0, y: 0.0, z: {fixed(math.sin(half))}, w: {fixed(math.cos(half))}}}"
    return f"{{translation: {_vector(samples.position[agent, row])}, rotation: {rotation}}}"


def _twist(linear: Array, angular: str) -> str:
    return f"{{linear: {_vector(linear)}, angular: {angular}}}"


def _vector(values: Array) -> str:
    x, y, z = map(fixed, values.tolist())
    return f"{{x: {x}, y: {y}, z: {z}}}"


FORMAT = Format(NAME, f"one MultiDOFJointTrajectory message in YAML, points at {RATE} Hz", write)
