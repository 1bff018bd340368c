# SPDX-License-Identifier: Apache-2.0
"""Programs of CRTK for the tests of `tendon-bridge ros2 --crtk`.

crtk_peer.py --types LIBRARY --domain N [--client FOLDER] VERB [ARGUMENT …]

FOLDER is a checkout of crtk_python_client, which is used without changes. It is required by the verbs `script`,
`example` and `device`. The output of all verbs except for `script` is JSON, and the first line is {"event":"ready"}.
"""
import argparse
import importlib.util
import json
import os
import pathlib
import sys
import threading
import time

import ros_stand_in as ros

SECONDS = 100  # a peer that nobody stops ends then
NAMESPACE = "device"  # the name of a device without a name


def say(event, **values):
    print(json.dumps({"event": event, **values}, separators=(",", ":")), flush=True)


def profile(transient_local=False):
    qos = sys.modules["rclpy.qos"]
    wanted = qos.QoSProfile(depth=10)
    if transient_local:
        wanted.durability = qos.DurabilityPolicy.TRANSIENT_LOCAL
    return wanted


def spinning_node():
    rclpy = sys.modules["rclpy"]
    rclpy.init()
    node = rclpy.create_node("peer")
    executor = rclpy.executors.SingleThreadedExecutor()
    executor.add_node(node)
    threading.Thread(target=executor.spin, daemon=True).start()
    return node


def publisher(node, kind, topic, transient_local=False):
    name = topic if "/" in topic else NAMESPACE + "/" + topic
    return node.create_publisher(ros.MESSAGES[kind], name, profile(transient_local))


def wait_until(holds):
    end = time.monotonic() + SECONDS
    while not holds():
        if time.monotonic() > end:
            raise TimeoutError
        time.sleep(0.005)


def hashes(options):
    """Prints the endpoints of tendon-bridge with their type hashes and those computed here."""
    spinning_node()
    say("ready")
    found = {}
    def all_of(kind):
        for topic, type_name, user_data in ros.DDS.endpoints(kind):
            if not topic.startswith("rt/"):
                continue
            package, name = type_name.split("::msg::dds_::")
            kind_name = f"{package}/{name.removesuffix('_')}"
            found[topic, kind] = [kind_name, user_data == f"typehash={ros.type_hash(kind_name)};"]
    def enough():
        all_of(3), all_of(4)
        return len(found) >= int(options.arguments[0])
    wait_until(enough)
    say("endpoints", count=len(found), types=len({kind for kind, _ in found.values()}),
        wrong=[list(key) for key, (_, right) in found.items() if not right])


def text(options):
    """Publishes one state_command, transient local, and then prints each change of the operating state."""
    node = spinning_node()
    states = []
    def heard(message):
        if not states or states[-1] != message.state:
            states.append(message.state)
            say("state", state=message.state, homed=message.is_homed, busy=message.is_busy)
    commands = publisher(node, "crtk_msgs/StringStamped", "state_command", transient_local=True)
    node.create_subscription(ros.MESSAGES["crtk_msgs/OperatingState"], NAMESPACE + "/operating_state", heard, profile())
    if "late" in options.arguments:
        wait_until(lambda: commands.get_subscription_count() > 0)
    message = ros.MESSAGES["crtk_msgs/StringStamped"]()
    message.string = options.arguments[0]
    commands.publish(message)
    say("ready")
    wait_until(lambda: commands.get_subscription_count() > 0)
    say("matched")
    time.sleep(SECONDS)


def push(options):
    """Sends the given force along y, in N, 200 times per second to servo_cf or to another topic (the second argument), for
    a time in s (the third)."""
    force, topic, seconds = options.arguments + ["servo_cf", SECONDS][len(options.arguments) - 1 :]
    node = spinning_node()
    out = publisher(node, "geometry_msgs/WrenchStamped", topic)
    message = ros.MESSAGES["geometry_msgs/WrenchStamped"]()
    message.wrench.force.y = float(force)
    say("ready")
    rate = node.create_rate(200)
    end = time.monotonic() + float(seconds)
    while time.monotonic() < end:
        out.publish(message)
        rate.sleep()
    node.destroy_publisher(out)
    say("left")


def ages(options):
    """Receives measured_cp and prints the delays from the time at which the state was sampled to the callback."""
    node = spinning_node()
    delays = []
    def heard(message):
        stamp = message.header.stamp
        delays.append(time.time_ns() - stamp.sec * 10**9 - stamp.nanosec)
    node.create_subscription(ros.MESSAGES["geometry_msgs/PoseStamped"], NAMESPACE + "/measured_cp", heard, profile())
    say("ready")
    wait_until(lambda: len(delays) >= int(options.arguments[0]))
    delays.sort()
    say("ages", n=len(delays), p50_us=delays[len(delays) // 2] / 1000, p99_us=delays[len(delays) * 99 // 100] / 1000)


# ---- client ------------------------------------------------------------------------------------------------------


def haptic_example(options):
    path = pathlib.Path(options.client) / "scripts" / "crtk_haptic_example.py"
    spec = importlib.util.spec_from_file_location("crtk_haptic_example", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class User:
    """Types one letter per second."""

    def __init__(self, letters):
        self.letters = list(letters)

    def readline(self):
        time.sleep(1)
        return self.letters.pop(0) + "\n"


def script(options):
    """Runs main() of crtk_haptic_example.py. Each letter of the argument is an answer of the user."""
    sys.argv = ["crtk_haptic_example.py", NAMESPACE]
    sys.stdin = User(options.arguments[0])
    haptic_example(options).main()


def example(options):
    """Calls run_box() or run_viscosity() of the example with the given number of steps."""
    import crtk
    ral = crtk.ral("example", NAMESPACE)
    program = haptic_example(options).crtk_haptic_example(ral, False)
    ral.spin()
    ral.check_connections()
    program.samples = int(options.arguments[1])
    say("ready")
    time.sleep(0.2)  # the first states
    getattr(program, "run_" + options.arguments[0])()
    say("end")
    ral.shutdown()


def device(options):
    """Calls enable(SECONDS) or disable(SECONDS), and prints the answer."""
    import crtk
    ral = crtk.ral("device", NAMESPACE)

    class Device:
        def __init__(self):
            self.utils = crtk.utils(self, ral, 1.0)
            self.utils.add_operating_state()
            self.utils.add_measured_cp()
            self.utils.add_measured_cv()
            self.utils.add_measured_cf()
            self.utils.add_servo_cf()
            self.utils.add_servo_cp()

    of_ral = Device()
    ral.spin()
    ral.check_connections()
    wait_until(of_ral.is_enabled if options.arguments[0] == "disable" else of_ral.operating_state)
    say("ready", state=of_ral.operating_state(), homed=of_ral.is_homed())
    done = getattr(of_ral, options.arguments[0])(float(options.arguments[1]))
    frame, _ = of_ral.measured_cp()
    force, _ = of_ral.measured_cf()
    say("done", done=done, state=of_ral.operating_state(), homed=of_ral.is_homed(), x=frame.p[0], force=list(force))
    ral.shutdown()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--types", required=True)
    parser.add_argument("--domain", type=int, required=True)
    parser.add_argument("--client")
    verbs = (hashes, text, push, ages, script, example, device)
    parser.add_argument("verb", choices=[verb.__name__ for verb in verbs])
    parser.add_argument("arguments", nargs="*")
    options = parser.parse_args()
    ros.start(options.types, options.domain)
    if options.client:
        os.environ["ROS_VERSION"] = "2"
        sys.path.insert(0, str(pathlib.Path(options.client) / "src"))
    globals()[options.verb](options)


if __name__ == "__main__":
    main()
