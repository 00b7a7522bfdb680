"""Send poses of ROS 2 to `missionc monitor FILE --live --udp 5005`: a datagram for each message.

python examples/live/ros2_poses.py 5005 /cf0/pose=drone[0] /cf1/pose=drone[1]

Takes rclpy and geometry_msgs of a ROS 2 installation. Each word is a topic with `PoseStamped` and the agent it is
of. Time counts from the first message, by the stamps of the messages, so that clocks that differ are to be put right
with `--skew`.
"""

from __future__ import annotations

import json
import math
import socket
import sys
from typing import Any


def line(name: str, seconds: float, pose: Any, dimension: int = 3) -> bytes:
    """The datagram of one pose; the heading is that of its orientation in the plane."""
    place, turn = pose.position, pose.orientation
    heading = math.atan2(2 * (turn.w * turn.z + turn.x * turn.y), 1 - 2 * (turn.y**2 + turn.z**2))
    position = [place.x, place.y, place.z][:dimension]
    return json.dumps({"t": seconds, "agent": name, "position": position, "heading": heading}).encode()


def main(port: int, topics: dict[str, str]) -> None:
    import rclpy
    from geometry_msgs.msg import PoseStamped

    rclpy.init()
    node = rclpy.create_node("missionc_samples")
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    begin: list[float] = []

    def send(name: str, message: PoseStamped) -> None:
        seconds = message.header.stamp.sec + message.header.stamp.nanosec / 1e9
        if not begin:
            begin.append(seconds)
        sender.sendto(line(name, seconds - begin[0], message.pose), ("127.0.0.1", port))

    for topic, name in topics.items():
        node.create_subscription(PoseStamped, topic, lambda message, name=name: send(name, message), 50)
    rclpy.spin(node)


if __name__ == "__main__":
    main(int(sys.argv[1]), dict(word.split("=", 1) for word in sys.argv[2:]))
