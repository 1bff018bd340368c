# SPDX-License-Identifier: Apache-2.0
"""Records the motion of a robot that follows a hand, for robot learning (clients/dataset).

    with Demonstration("press.jsonl") as demonstration:
        def step(hand):
            pose = robot.pose()
            target = follow.target(hand, pose, time.monotonic_ns())
            contact = robot.contact()
            demonstration.add(hand, pose, target, follow.phase, contact)
            ...

The recording of the server contains the hand but not the robot. This file contains the pose of the tool when a
state of the hand arrived, and its target.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from os import PathLike
from types import TracebackType

from .messages import DeviceState
from .teleop import Following, Pose, ToolContact

KIND = "tendon demonstration"
VERSION = 1


class Demonstration:
    """A file of JSON lines. The first line contains its kind and version, and each further line one state of the
    hand:

        tick          of the state; matches the step in the server's recording
        sampled_ns    sampling time of the hand, server clock
        phase         "engaged", "clutched" …, as Follower.phase
        position_m    of the tool, robot frame
        target_m      of the tool; null: the robot holds its pose
        contact_n     force on the tool; absent: not measured
        contact_nm    torque on the tool; absent: not measured
        orientation, target_orientation, grip, target_grip    as in Pose; absent: None
        sender        who requested the target; absent: the operator

    A state is omitted if its pose, target or contact is not finite. Existing files are not overwritten
    (FileExistsError). Lines are buffered, so that `add` rarely waits for the disk.
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        self._file = open(path, "x", encoding="utf-8")
        self._write({"kind": KIND, "version": VERSION})

    def __enter__(self) -> Demonstration:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, where: TracebackType | None
    ) -> None:
        self.close()

    def add(
        self,
        hand: DeviceState,
        pose: Pose,
        target: Pose | None,
        phase: Following,
        contact: ToolContact | None = None,
        sender: str | None = None,
    ) -> None:
        """`pose` is the argument of Follower.target for `hand`, and `target` its result. If a program has chosen the
        target instead of the operator, `sender` is its name, for example "policy".
        """
        line: dict[str, object] = {"tick": hand.tick, "sampled_ns": hand.sampled_ns, "phase": phase.name.lower()}
        line["position_m"] = _three(pose.position)
        line["target_m"] = None if target is None else _three(target.position)
        if contact is not None:
            line["contact_n"] = _three(contact.force)
            if contact.torque is not None:
                line["contact_nm"] = _three(contact.torque)
        for prefix, of in (("", pose), ("target_", target)):
            if of is not None and of.orientation is not None:
                w, x, y, z = of.orientation
                line[f"{prefix}orientation"] = [float(w), float(x), float(y), float(z)]
            if of is not None and of.grip is not None:
                line[f"{prefix}grip"] = float(of.grip)
        if sender is not None:
            line["sender"] = sender
        values = [x for value in line.values() for x in (value if isinstance(value, list) else [value])]
        if all(math.isfinite(x) for x in values if isinstance(x, float)):
            self._write(line)

    def close(self) -> None:
        self._file.close()

    def _write(self, line: dict[str, object]) -> None:
        self._file.write(json.dumps(line, separators=(",", ":")) + "\n")


def _three(v: Sequence[float]) -> list[float]:
    x, y, z = v
    return [float(x), float(y), float(z)]
