"""Forged folders: verified data is changed and the manifest adapted."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from math import comb
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from missionc.geometry.curves.piecewise_polynomials import COLUMNS
from missionc.geometry.curves.smooth_splines import control_points_of

Files: TypeAlias = dict[str, bytes]
Table: TypeAlias = NDArray[np.float64]
"""Polynomials of a file, (pieces, 33)."""


def table_of(content: bytes) -> Table:
    return np.array([[float(word) for word in line.split(",")] for line in content.decode().splitlines()[1:]])


def text_of(table: Table) -> str:
    rows = [",".join(f"{float(np.float32(number)):.9g}" for number in row) for row in table]
    return "\n".join([",".join(COLUMNS), *rows]) + "\n"


def flights(files: Mapping[str, bytes]) -> list[str]:
    """Names of the polynomials' files, in the agents' order."""
    return [name for name in files if name.startswith("crazyflie/")]


def changed(files: Mapping[str, bytes], name: str, change: Callable[[Table], Table]) -> Files:
    return {**files, name: text_of(change(table_of(files[name]).copy())).encode()}


def stated(files: Mapping[str, bytes], change: Callable[[dict[str, object]], None]) -> Files:
    """Files with a changed certificate."""
    certificate = json.loads(files["certificate.json"])
    change(certificate)
    return {**files, "certificate.json": json.dumps(certificate).encode()}


def hashed(files: Mapping[str, bytes], keep: bool = False) -> Files:
    """Files with a manifest that has their hashes.

    Args:
        keep: if true, the manifest's names and hashes stay unchanged.
    """
    if keep:
        return dict(files)
    manifest = json.loads(files["manifest.json"])
    for name in manifest["files"]:
        manifest["files"][name] = hashlib.sha256(files[name]).hexdigest()
    for name in manifest["inputs"]:
        manifest["inputs"][name] = hashlib.sha256(files[f"mission/{name}"]).hexdigest()
    return {**files, "manifest.json": json.dumps(manifest).encode()}


def laid(folder: Path, files: Mapping[str, bytes]) -> Path:
    """Folder with these files written to it."""
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    return folder


def forged(folder: Path, files: Mapping[str, bytes]) -> Path:
    """Folder with a manifest that has the hashes of its files."""
    return laid(folder, hashed(files))


def bumped(table: Table) -> Table:
    """Polynomials with the main coefficient of the middle piece increased by 1 %."""
    middle = len(table) // 2
    weight = np.abs(table[middle, 1:25]) * np.tile(table[middle, 0] ** np.arange(8), 3)
    table[middle, 1 + int(weight[:16].argmax())] *= 1.01
    return table


def delayed(table: Table) -> Table:
    """Polynomials that wait for 0.1 s, and end at the same time, that much before their end."""
    wait = np.zeros((1, 33))
    wait[0, 0], wait[0, 1::8] = 0.1, table[0, 1::8]
    table[-1, 0] -= 0.1 if table[-1, 0] > 0.1 else 0.05
    return np.concatenate([wait, table])


def turned(table: Table) -> Table:
    """Polynomials with the yaw increased by 0.5 rad throughout."""
    table[:, 25] += 0.5
    return table


def dropped(table: Table) -> Table:
    """Polynomials without the third piece."""
    return np.delete(table, 2, axis=0)


def lengthened(table: Table) -> Table:
    table[len(table) // 2, 0] += 1e-3
    return table


def bulged(table: Table) -> Table:
    """Polynomials with a smooth bulge across some pieces, which leaves the tube without jumps."""
    durations = table[:, 0]
    curve = control_points_of(np.concatenate([[0.0], np.cumsum(durations)]))
    bulge = np.zeros(curve.shape[1])
    bulge[curve.shape[1] // 2] = 0.5
    difference = (curve @ bulge).reshape(len(table), 8)
    for power in range(8):
        table[:, 1 + power] += difference[:, 0] * comb(7, power) / durations**power
        difference = np.diff(difference, axis=-1)
    return table
