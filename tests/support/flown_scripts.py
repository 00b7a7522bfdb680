"""Exported scripts, run in virtual time on stand-ins for cflib and Crazyswarm2, with all commands.

The stand-ins have the classes that the scripts use, with the behaviour that matters when something goes wrong. cflib
drops packets of a closed link without an error, and stops motors when it closes a link. rclpy's handler of SIGINT shuts
its context down: a sleep after that raises, while services can still be called.
"""

from __future__ import annotations

import runpy
import signal
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest

from missionc.output.export.formats import FORMATS, Exported, Flight
from missionc.output.export.verified_flight import Part
from missionc.verification.flight.verify_whole_flight import LANDED
from tests.support.hand_made_flights import place

SCRIPTS = ("crazyswarm2", "cflib")
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@dataclass(frozen=True, slots=True)
class Command:
    """Command that reached a vehicle: its time in seconds, agent number, vehicle height, and values."""

    time: float
    agent: int
    name: str
    height: float
    values: Mapping[str, Any]


Event = tuple[float, Callable[["World"], None]]


@dataclass(eq=False, slots=True)
class Vehicle:
    """Vehicle whose height follows the last command linearly, or its trajectory."""

    agent: int
    part: Part
    seen: tuple[float, float] | None
    volts: float = 4.1
    linked: bool = True
    heard: float = 0.0
    power: int = 0
    supervisor: int = 0
    spinning: bool = False
    risen: bool = False
    motion: Callable[[float], float] = lambda time: 0.0

    def toward(self, now: float, height: float, lasting: float) -> None:
        begin = self.motion(now)
        self.motion = lambda time: float(np.interp(time, (now, now + lasting), (begin, height)))


@dataclass(eq=False)
class World:
    """Clock, vehicles, received commands, and events.

    Args:
        events: events by second.
        failing: commands that raise, each with the agent's number and how many times.
        hanging: commands that wait for an event of the world, in the same form.
        silent: True if no vehicle reports its status and its position.
    """

    vehicles: list[Vehicle]
    events: list[Event] = field(default_factory=list)
    failing: dict[tuple[str, int], int] = field(default_factory=dict)
    silent: bool = False
    hanging: dict[tuple[str, int], threading.Event] = field(default_factory=dict)
    now: float = 0.0
    commands: list[Command] = field(default_factory=list)
    callbacks: list[Callable[[], None]] = field(default_factory=list)
    unreadable: bool = False
    interrupts: int = 0
    cut_off: set[int] = field(default_factory=set)
    ended: str = ""

    def sleep(self, seconds: float) -> None:
        end = self.now + seconds
        while self.events and self.events[0][0] <= end:
            self.now, happens = self.events.pop(0)
            happens(self)
        self.now = end
        for vehicle in self.vehicles:
            if vehicle.linked:
                vehicle.heard = end
        for callback in self.callbacks:
            callback()

    def command(self, agent: int, name: str, **values: Any) -> None:
        """Send a command to a vehicle, which may fail or be lost."""
        left = self.failing.get((name, agent), 0)
        if left:
            self.failing[name, agent] = left - 1
            raise RuntimeError(f"{name} failed")
        if (name, agent) in self.hanging:
            self.hanging[name, agent].wait()
        vehicle = self.vehicles[agent]
        if not vehicle.linked:
            return
        height = vehicle.motion(self.now)
        self.commands.append(Command(self.now, agent, name, height, values))
        begin = self.now
        match name:
            case "takeoff" | "land":
                vehicle.spinning = True
                vehicle.risen |= name == "takeoff"
                vehicle.toward(begin, values["height"], values["lasting"])
            case "start":
                vehicle.motion = lambda time: float(place(vehicle.part, time - begin)[2])
            case "arm":
                vehicle.spinning = True
            case "disarm" | "emergency" | "close":
                vehicle.spinning = False
                vehicle.toward(begin, 0.0, 0.0)


def interrupt(world: World) -> None:
    """Press Ctrl-C, with the real signal."""
    world.interrupts += 1
    signal.raise_signal(signal.SIGINT)


def lose_link(world: World) -> None:
    """Break the link to the second vehicle."""
    world.vehicles[1].linked = False
    world.cut_off.add(1)


def drain(world: World) -> None:
    """Drain the battery of the second vehicle."""
    world.vehicles[1].power = 3


def tumble(world: World) -> None:
    """Tip over the second vehicle."""
    world.vehicles[1].supervisor |= 32


def raise_in_client(world: World) -> None:
    """Make Crazyswarm2's client fail once during a sleep, as for an unreadable message."""
    world.unreadable = True


def safe(world: World) -> None:
    """Check the safety properties of every flight, for any events.

    Motors stop on the floor, and in the air only at the second Ctrl-C. Nothing rises or goes on after a landing began,
    and nothing lands that never rose. Every vehicle that can be told is on the floor at the end, and its motors do not
    turn.
    """
    began = False
    for each in sorted(world.commands, key=lambda each: each.time):
        risen = world.vehicles[each.agent].risen or ("takeoff", each.agent) in world.failing
        assert each.name != "land" or risen, each
        assert not (began and each.name in ("arm", "takeoff", "go", "start")), each
        began |= each.name == "land"
        assert each.name != "emergency" or world.interrupts > 1, each
        assert each.name not in ("disarm", "close") or each.height <= LANDED + 1e-6 or world.interrupts > 1, each
    for vehicle in world.vehicles:
        if vehicle.agent not in world.cut_off:
            assert not vehicle.spinning, vehicle.agent
            assert vehicle.motion(world.now) == 0.0, vehicle.agent


def export(form: str, flown: Flight, folder: Path) -> Path:
    """Script of an export, written with its files."""
    made = FORMATS[form].export(flown)
    assert isinstance(made, Exported), made
    for name, content in made.files.items():
        (folder / form / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / form / name).write_bytes(content)
    return folder / form / "fly.py"


def standing(flown: Flight, aside: float = 0.0, volts: float = 4.1) -> list[Vehicle]:
    """Vehicles below or at their first points, the first one ``aside`` metres away."""
    made = []
    for agent, part in enumerate(flown.parts):
        x, y, z = part.first
        vehicle = Vehicle(agent, part, (x + aside * (not agent), y), volts)
        if flown.in_flight:
            vehicle.spinning = vehicle.risen = True
            vehicle.motion = lambda time, z=z: z  # type: ignore[misc]
        made.append(vehicle)
    return made


def fly(script: Path, world: World, monkeypatch: pytest.MonkeyPatch, *words: str) -> World:
    """Run a script to its end, and store its message in the world."""
    form, kept = script.parent.name, [signal.getsignal(number) for number in SIGNALS]
    modules = {"crazyswarm2": _crazyswarm, "cflib": _cflib}[form](world)
    world.events.sort(key=lambda event: event[0])
    with monkeypatch.context() as patched:
        patched.setattr(sys, "argv", [str(script), *words])
        for name, contents in modules.items():
            made = ModuleType(name)
            made.__dict__.update(contents)
            patched.setitem(sys.modules, name, made)
            parent, _, own = name.rpartition(".")
            if parent:
                setattr(sys.modules[parent], own, made)
        patched.setattr("time.sleep", world.sleep)
        try:
            runpy.run_path(str(script), run_name="__main__")
        except SystemExit as end:
            world.ended = str(end)
        finally:
            for number, handler in zip(SIGNALS, kept, strict=True):
                signal.signal(number, handler)
    return world


# ------------------------------------------------------------------ Crazyswarm2


class RCLError(RuntimeError):
    """Error of rclpy after its context is shut down."""


class _Rclpy:
    """Context of rclpy with its SIGINT handler: it calls the previous handler and shuts the context down."""

    def __init__(self) -> None:
        self.shut, self.before = False, signal.getsignal(signal.SIGINT)
        signal.signal(signal.SIGINT, self.handler)

    def handler(self, number: int, frame: Any) -> None:
        self.shut = True
        assert callable(self.before)
        self.before(number, frame)

    def uninstall(self) -> None:
        if signal.getsignal(signal.SIGINT) == self.handler:
            signal.signal(signal.SIGINT, self.before)

    def valid(self) -> None:
        if self.shut:
            raise RCLError("the context is shut down")


class _Trajectory:
    """Stand-in for crazyflie_py's ``Trajectory``: skips a line and takes columns 0 to 32 of at least two rows."""

    def loadcsv(self, file: str) -> None:
        table = np.loadtxt(file, delimiter=",", skiprows=1, usecols=range(33))
        self.rows = [table[row, :33] for row in range(len(table))]


class _Crazyflies:
    """Stand-in for crazyflie_py's ``Crazyflie``, or its ``CrazyflieServer`` for all, with the same commands."""

    def __init__(self, world: World, agents: Sequence[int]) -> None:
        self.world, self.agents = world, agents

    def _send(self, name: str, **values: Any) -> None:
        # One call for all of them, which fails before it is sent.
        for agent in sorted(self.agents, key=lambda agent: not self.world.failing.get((name, agent))):
            self.world.command(agent, name, **values)

    def uploadTrajectory(self, trajectoryId: int, pieceOffset: int, trajectory: _Trajectory) -> None:  # noqa: N802, N803
        self._send("upload", number=trajectoryId, offset=pieceOffset, rows=trajectory.rows)

    def arm(self, arm: bool = True) -> None:
        self._send("arm" if arm else "disarm")

    def takeoff(self, targetHeight: float, duration: float, groupMask: int = 0) -> None:  # noqa: N803
        self._send("takeoff", height=targetHeight, lasting=duration)

    def goTo(self, goal: Any, yaw: float, duration: float, relative: bool = False, groupMask: int = 0) -> None:  # noqa: N802, N803
        self._send("go", goal=tuple(goal), yaw=yaw, lasting=duration, relative=relative)

    def startTrajectory(  # noqa: N802
        self,
        trajectoryId: int,  # noqa: N803
        timescale: float = 1.0,
        reverse: bool = False,
        relative: bool = True,
        groupMask: int = 0,  # noqa: N803
    ) -> None:
        self._send("start", number=trajectoryId, scale=timescale, reverse=reverse, relative=relative)

    def land(self, targetHeight: float, duration: float, groupMask: int = 0) -> None:  # noqa: N803
        self._send("land", height=targetHeight, lasting=duration)

    def emergency(self) -> None:
        self._send("emergency")

    def _own(self) -> Vehicle:
        return self.world.vehicles[self.agents[0]]

    def get_pose(self) -> dict[str, object]:
        return {} if self._own().seen is None or self.world.silent else {"position": None}

    def get_position(self) -> list[float]:
        x, y = self._own().seen or (0.0, 0.0)
        return [x, y, 0.0]

    def get_status(self) -> dict[str, Any]:
        own = self._own()
        if self.world.silent:
            return {}
        # One report per second.
        stamp = {"timestamp_sec": int(own.heard), "timestamp_nsec": 0}
        return {**stamp, "battery": own.volts, "pm_state": own.power, "supervisor": own.supervisor}


def _crazyswarm(world: World) -> dict[str, dict[str, object]]:
    started: list[_Rclpy] = []

    def swarm() -> SimpleNamespace:
        ros = _Rclpy()
        started.append(ros)
        everyone = _Crazyflies(world, range(len(world.vehicles)))
        named = {vehicle.part.robot: _Crazyflies(world, [vehicle.agent]) for vehicle in world.vehicles}
        everyone.__dict__["crazyfliesByName"] = named

        def sleep(duration: float) -> None:
            ros.valid()
            world.sleep(duration)
            ros.valid()
            if world.unreadable:
                world.unreadable = False
                raise RuntimeError("a message cannot be read")

        return SimpleNamespace(allcfs=everyone, timeHelper=SimpleNamespace(sleep=sleep))

    return {
        "crazyflie_py": {"Crazyswarm": swarm},
        "crazyflie_py.uav_trajectory": {"Trajectory": _Trajectory},
        "rclpy": {},
        "rclpy.signals": {"uninstall_signal_handlers": lambda: started[0].uninstall()},
    }


# ------------------------------------------------------------------ cflib


class _LogConfig:
    def __init__(self, name: str, period_in_ms: int) -> None:
        self.names: list[str] = []
        self.data_received_cb = SimpleNamespace(add_callback=self._called)
        self.world: World | None = None
        self.vehicle: Vehicle | None = None

    def add_variable(self, name: str, fetch_as: str) -> None:
        self.names.append(name)

    def _called(self, callback: Callable[[int, dict[str, float], object], None]) -> None:
        self.callback = callback

    def start(self) -> None:
        assert self.world is not None
        self.world.callbacks.append(self._report)

    def _report(self) -> None:
        assert self.vehicle is not None
        assert self.world is not None
        own = self.vehicle
        if own.linked and own.seen is not None and not self.world.silent:
            seen = {"pm.vbat": own.volts, "pm.state": own.power, "supervisor.info": own.supervisor}
            seen |= {"stateEstimate.x": own.seen[0], "stateEstimate.y": own.seen[1]}
            self.callback(round(own.heard * 1000), {name: seen[name] for name in self.names}, self)


class _Sync:
    """Stand-in for cflib's ``SyncCrazyflie`` with the parts of its ``cf`` that the scripts use."""

    def __init__(self, link_uri: str, world: World) -> None:
        agent = int(link_uri[-4:], 16) - 1
        self.world, self.agent, self.open, self.memory = world, agent, False, SimpleNamespace(trajectory=[])
        self.memory.write_data_sync = self._written
        self.cf = SimpleNamespace(
            link_uri=link_uri,
            param=SimpleNamespace(set_value=lambda name, value: self._send("param", parameter=name, value=value)),
            mem=SimpleNamespace(get_mems=lambda kind: [self.memory]),
            log=SimpleNamespace(add_config=self._logged),
            high_level_commander=self,
            platform=SimpleNamespace(send_arming_request=lambda do_arm: self._send("arm" if do_arm else "disarm")),
            loc=SimpleNamespace(send_emergency_stop=lambda: self._send("emergency")),
        )

    def open_link(self) -> None:
        self._send("connect")
        self.open = True

    def close_link(self) -> None:
        # It sends a setpoint without thrust, which stops the motors.
        if self.open:
            self._send("close")
            self.open = False

    def _send(self, name: str, **values: Any) -> None:
        self.world.command(self.agent, name, **values)

    def _written(self, start_addr: int) -> bool:
        content = b"".join(bytes(each.pack()) for each in self.memory.trajectory)
        self._send("upload", offset=start_addr, content=content)
        return True

    def _logged(self, config: _LogConfig) -> None:
        config.world, config.vehicle = self.world, self.world.vehicles[self.agent]

    def define_trajectory(self, trajectory_id: int, offset: int, n_pieces: int, type: int) -> None:
        self._send("define", number=trajectory_id, offset=offset, pieces=n_pieces, kind=type)

    def takeoff(self, absolute_height_m: float, duration_s: float) -> None:
        self._send("takeoff", height=absolute_height_m, lasting=duration_s)

    def go_to(self, x: float, y: float, z: float, yaw: float, duration_s: float, relative: bool = False) -> None:
        self._send("go", goal=(x, y, z), yaw=yaw, lasting=duration_s, relative=relative)

    def start_trajectory(
        self, trajectory_id: int, time_scale: float, relative_position: bool, relative_yaw: bool, reversed: bool
    ) -> None:
        relative = relative_position or relative_yaw
        self._send("start", number=trajectory_id, scale=time_scale, reverse=reversed, relative=relative)

    def land(self, absolute_height_m: float, duration_s: float, yaw: float | None = 0.0) -> None:
        assert yaw is None, "a landing turns no nose"
        self._send("land", height=absolute_height_m, lasting=duration_s)

    def stop(self) -> None:
        self._send("disarm")


def _cflib(world: World) -> dict[str, dict[str, object]]:
    return {
        "cflib": {},
        "cflib.crtp": {"init_drivers": lambda: None},
        "cflib.crazyflie": {"Crazyflie": lambda rw_cache: None},
        "cflib.crazyflie.log": {"LogConfig": _LogConfig},
        "cflib.crazyflie.mem": {"MemoryElement": SimpleNamespace(TYPE_TRAJ=18)},
        "cflib.crazyflie.syncCrazyflie": {"SyncCrazyflie": lambda uri, cf: _Sync(uri, world)},
        "cflib.utils": {},
        "cflib.utils.reset_estimator": {"reset_estimator": lambda vehicle: vehicle._send("reset")},
    }
