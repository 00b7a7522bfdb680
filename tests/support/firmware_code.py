"""The firmware's own C code, built from its sources, with recorded answers.

    python -m tests.support.firmware_code FOLDER

records anew, from a checkout of crazyflie-firmware, what ``firmware_answers.json`` holds. None of its code is here. Its
evaluator and its controller are compiled as they are; what they include to declare parameters and logs is left empty.
"""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from missionc.base.trace import Array
from missionc.flight.simulation import disturbance, quadrotor
from missionc.flight.simulation.quadrotor import Vehicle, at_rest, moved
from missionc.geometry.curves.piecewise_polynomials import Pieces

SOURCES = "MISSIONC_FIRMWARE"
"""Environment variable with the folder."""
ANSWERS = Path(__file__).with_name("firmware_answers.json")
STRONGEST = replace(Vehicle(), strongest=65_535 / 132_000 / 4)
"""Vehicle whose motors reach the thrust of the maximum PWM value."""
SEARCHED = (
    "src/modules/interface",
    "src/modules/interface/controller",
    "src/utils/interface",
    "src/hal/interface",
    "src/utils/interface/lighthouse",
    "src/config",
    "src/platform/interface",
)
EMPTY = ("log.h", "position_controller.h", "position_controller_pid.h")
PARAMETERS = """
#define PARAM_GROUP_START(name)
#define PARAM_GROUP_STOP(name)
#define PARAM_ADD(type, name, address)
#define PARAM_ADD_CORE(type, name, address)
#define LOG_GROUP_START(name)
#define LOG_GROUP_STOP(name)
#define LOG_ADD(type, name, address)
"""
DRIVER = """
#include <stdlib.h>
#include "pptraj.c"
#include "controller_mellinger.c"

/* Durations, then for each piece four rows of eight coefficients; each answer has 13 numbers. */
void evaluate(int pieces, const float *durations, const float *rows, int times, const float *at, float *answer)
{
    struct piecewise_traj path = {.t_begin = 0, .timescale = 1, .n_pieces = pieces};
    path.pieces = malloc(pieces * sizeof(struct poly4d));
    for (int piece = 0; piece < pieces; piece++) {
        path.pieces[piece].duration = durations[piece];
        for (int number = 0; number < 4 * PP_SIZE; number++)
            path.pieces[piece].p[number / PP_SIZE][number % PP_SIZE] = rows[piece * 4 * PP_SIZE + number];
    }
    for (int time = 0; time < times; time++, answer += 13) {
        struct traj_eval all = piecewise_eval(&path, at[time]);
        float row[13] = {all.pos.x, all.pos.y, all.pos.z, all.vel.x, all.vel.y, all.vel.z, all.acc.x, all.acc.y,
                         all.acc.z, all.omega.x, all.omega.y, all.omega.z, all.yaw};
        for (int number = 0; number < 13; number++) answer[number] = row[number];
    }
    free(path.pieces);
}

static controllerMellinger_t one;

void begin(void) { controllerMellingerInit(&one); }

float height_integral(void) { return one.ki_z; }

/* A state (position, velocity, quaternion w x y z, rates) and a setpoint; thrust, roll, pitch and yaw in PWM units. */
void command(const float *is, const float *told, float *answer)
{
    state_t state = {0};
    setpoint_t setpoint = {0};
    sensorData_t sensors = {0};
    control_t control = {0};
    state.position.x = is[0]; state.position.y = is[1]; state.position.z = is[2];
    state.velocity.x = is[3]; state.velocity.y = is[4]; state.velocity.z = is[5];
    state.attitudeQuaternion.w = is[6]; state.attitudeQuaternion.x = is[7];
    state.attitudeQuaternion.y = is[8]; state.attitudeQuaternion.z = is[9];
    sensors.gyro.x = degrees(is[10]); sensors.gyro.y = degrees(is[11]); sensors.gyro.z = degrees(is[12]);
    setpoint.position.x = told[0]; setpoint.position.y = told[1]; setpoint.position.z = told[2];
    setpoint.velocity.x = told[3]; setpoint.velocity.y = told[4]; setpoint.velocity.z = told[5];
    setpoint.acceleration.x = told[6]; setpoint.acceleration.y = told[7]; setpoint.acceleration.z = told[8];
    setpoint.attitudeRate.roll = degrees(told[9]); setpoint.attitudeRate.pitch = degrees(told[10]);
    setpoint.attitudeRate.yaw = degrees(told[11]); setpoint.attitude.yaw = degrees(told[12]);
    setpoint.mode.x = setpoint.mode.y = setpoint.mode.z = setpoint.mode.yaw = modeAbs;
    controllerMellinger(&one, &control, &setpoint, &sensors, &state, 0);
    answer[0] = control.thrust; answer[1] = control.roll; answer[2] = control.pitch; answer[3] = control.yaw;
}
"""


def missing() -> str:
    """Reason why the firmware's code cannot be built here; empty if it can."""
    folder = os.environ.get(SOURCES, "")
    if not folder:
        return f"{SOURCES} names no folder with the sources of crazyflie-firmware"
    if not (Path(folder) / "src/modules/src/pptraj.c").is_file():
        return f"{folder}, which {SOURCES} names, has no src/modules/src/pptraj.c"
    return "" if shutil.which("cc") else "there is no C compiler, `cc`"


class Firmware:
    """Evaluator and controller of the firmware, as functions of arrays."""

    def __init__(self, library: ctypes.CDLL) -> None:
        self._library = library
        library.height_integral.restype = ctypes.c_float

    @property
    def height_integral(self) -> float:
        self._library.begin()
        return float(self._library.height_integral())

    def setpoints(self, pieces: Pieces, times: Array) -> Array:
        """As in ``firmware_setpoints.setpoints``: (times,), s -> (13, times)."""
        answer = np.zeros((times.size, 13), dtype=np.float32)
        rows = pieces.coefficients.astype(np.float32)
        self._library.evaluate(
            len(rows), _numbers(pieces.duration), _numbers(rows), times.size, _numbers(times), _numbers(answer)
        )
        return answer.T.astype(np.float64)

    def begin(self) -> None:
        """Reset the state, as at the start of the controller."""
        self._library.begin()

    def thrust(self, state: Array, told: Array) -> Array:
        """Motor thrusts before saturation, N: (13,), (13,) -> (4,)."""
        answer = np.zeros(4, dtype=np.float32)
        self._library.command(_numbers(state), _numbers(told), _numbers(answer))
        push, roll, pitch, yaw = answer.astype(np.float64)
        each = [push - roll / 2 + pitch / 2 + yaw, push - roll / 2 - pitch / 2 - yaw]
        each += [push + roll / 2 - pitch / 2 + yaw, push + roll / 2 + pitch / 2 - yaw]
        return np.array(each) / 132_000 / 4


def _numbers(values: Any) -> Any:
    array = values if getattr(values, "dtype", None) == np.float32 else np.ascontiguousarray(values, dtype=np.float32)
    return np.ascontiguousarray(array).ctypes.data_as(ctypes.POINTER(ctypes.c_float))


@cache
def built(folder: str) -> Firmware:
    """Compile the code in a folder of sources."""
    root = Path(folder)
    with tempfile.TemporaryDirectory() as name:
        place = Path(name)
        for header in EMPTY:
            (place / header).write_text("")
        (place / "param.h").write_text(PARAMETERS)
        (place / "platform_defaults.h").write_text("#define CF_MASS 0.029f\n")
        (place / "driver.c").write_text(DRIVER)
        where = [str(place), *(str(root / each) for each in SEARCHED)]
        where += [str(root / "src/modules/src"), str(root / "src/modules/src/controller")]
        asked = [
            "cc",
            "-shared",
            "-fPIC",
            "-O1",
            "-w",
            "-o",
            str(place / "firmware.so"),
            str(place / "driver.c"),
            "-lm",
        ]
        asked += [f"-I{each}" for each in where]
        subprocess.run(asked, check=True)
        return Firmware(ctypes.CDLL(str(place / "firmware.so")))


# ------------------------------------------------------------------- what it is asked


def a_path() -> Pieces:
    """Three pieces that turn and climb, fast enough for a tilt of 20 degrees; float32, as uploaded."""
    random = np.random.default_rng(11)
    coefficients = random.normal(size=(3, 4, 8)) * 0.5 ** np.arange(8) * np.array([1.5, 1.5, 0.5, 1.0])[:, None]
    return Pieces(np.array([1.5, 0.75, 2.25]), coefficients.astype(np.float32).astype(np.float64))


def moments() -> Array:
    """Every tenth of a second, ends of pieces, and a time past the end: (times,), s."""
    return np.concatenate([np.arange(46) / 10, [1.5, 2.25, 4.49, 4.6, 9.0]])


def situations() -> tuple[Array, Array]:
    """Three controllers through 12 commands: states and setpoints, (3, 12, 13) each.

    The first is near where it should be, the second far off and turning, the third upside down now and then.
    """
    random = np.random.default_rng(12)
    wild = np.array([0.05, 0.5, 1.0])[:, None, None]
    state, told = random.normal(size=(2, 3, 12, 13)) * wild
    lean = random.normal(size=(3, 12, 4)) * wild * np.array([0.0, 1.0, 1.0, 1.0])
    lean[..., 0] = 1.0
    lean[2, ::4, :2] = (0.1, 2.0)
    state[..., 6:10] = lean / np.linalg.norm(lean, axis=-1, keepdims=True)
    return state.astype(np.float32).astype(np.float64), told.astype(np.float32).astype(np.float64)


def thrusts(firmware: Firmware) -> Array:
    """Motor thrusts, (3, 12, 4), N."""
    each = []
    for states, orders in zip(*situations(), strict=True):
        firmware.begin()
        each.append([firmware.thrust(state, told) for state, told in zip(states, orders, strict=True)])
    return np.array(each)


def heavier(firmware: Firmware, share: float, seconds: float) -> Array:
    """Height error of a vehicle that is heavier than its controller assumes: (commands,), m.

    The firmware's controller flies our quadrotor from hovering; (commands,) at 500 Hz.
    """
    vehicle = Vehicle()
    state = at_rest(vehicle, np.array([[0.0], [0.0], [1.0]]), np.zeros(1))
    told = np.zeros(13)
    told[disturbance.POSITION] = (0, 0, 1)
    firmware.begin()
    heights = []
    for _ in range(round(seconds * 500)):
        asked = firmware.thrust(state[:13, 0], told)
        thrust = np.clip(asked - max(0.0, float(asked.max()) - vehicle.strongest), 0.0, None)[:, None]
        state = moved(vehicle, np.array([vehicle.mass * (1 + share)]), state, thrust, np.zeros((3, 1)), 1 / 500)
        heights.append(float(state[quadrotor.POSITION][2, 0]) - 1)
    return np.array(heights)


def answers(firmware: Firmware) -> dict[str, object]:
    """All recorded answers."""
    sunk = heavier(firmware, 0.17, 10.0)
    return {
        "height_integral": firmware.height_integral,
        "setpoints": firmware.setpoints(a_path(), moments()).T.tolist(),
        "thrusts": thrusts(firmware).tolist(),
        "heavier": sunk[::250].tolist(),
    }


def main() -> None:
    lines = [f'  "{key}": {json.dumps(value)}' for key, value in answers(built(sys.argv[1])).items()]
    ANSWERS.write_text("{\n" + ",\n".join(lines) + "\n}\n")


if __name__ == "__main__":
    main()
