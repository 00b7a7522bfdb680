"""Send the log of a Crazyflie to `missionc monitor FILE --live --udp 5005`: a datagram for each sample.

python examples/live/crazyflie_log.py radio://0/80/2M/E7E7E7E7E7 drone[0] 5005

Takes cflib (`pip install cflib`) and a radio. Time counts from the first sample; start it as the mission begins, or
say by how much its clock is ahead with `--skew`.
"""

from __future__ import annotations

import json
import socket
import sys
import time
from typing import Any


def line(name: str, seconds: float, data: dict[str, float]) -> bytes:
    """The datagram of one sample of the state estimate."""
    position = [round(data[f"stateEstimate.{axis}"], 4) for axis in "xyz"]
    velocity = [round(data[f"stateEstimate.v{axis}"], 4) for axis in "xyz"]
    return json.dumps({"t": seconds, "agent": name, "position": position, "velocity": velocity}).encode()


def main(uri: str, name: str, port: int) -> None:
    import cflib.crtp
    from cflib.crazyflie import Crazyflie
    from cflib.crazyflie.log import LogConfig
    from cflib.crazyflie.syncCrazyflie import SyncCrazyflie
    from cflib.crazyflie.syncLogger import SyncLogger

    cflib.crtp.init_drivers()
    places = LogConfig("state", period_in_ms=20)
    for variable in ("x", "y", "z", "vx", "vy", "vz"):
        places.add_variable(f"stateEstimate.{variable}", "FP16")
    sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    begin: int | None = None
    with SyncCrazyflie(uri, cf=Crazyflie(rw_cache="./cache")) as crazyflie, SyncLogger(crazyflie, places) as logger:
        entry: Any
        for entry in logger:
            stamp, data, _ = entry
            begin = stamp if begin is None else begin
            sender.sendto(line(name, (stamp - begin) / 1000, data), ("127.0.0.1", port))


if __name__ == "__main__":
    print(f"sending since {time.strftime('%H:%M:%S')}", file=sys.stderr)
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
