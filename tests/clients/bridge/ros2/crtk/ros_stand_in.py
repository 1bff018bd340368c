# SPDX-License-Identifier: Apache-2.0
"""Implements the part of rclpy and of the message packages that is used by crtk_python_client.

It uses the C library of Cyclone DDS. start(types, domain) adds the modules `rclpy`, `std_msgs`, `geometry_msgs`,
`sensor_msgs` and `crtk_msgs` to sys.modules. `types` is a library that contains the descriptors of the types. The
messages are defined here again, so that an error in the definitions of tendon-bridge leads to wrong values and hashes.
"""
import ctypes as c
import functools
import hashlib
import json
import sys
import threading
import time
import types

DEFINITIONS = {
    "builtin_interfaces/Time": "int32 sec, uint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp, string frame_id",
    "std_msgs/Bool": "bool data",
    "std_msgs/Empty": "",
    "std_msgs/Float64MultiArray": "float64[] data",  # the layout is not used here
    "geometry_msgs/Vector3": "float64 x, float64 y, float64 z",
    "geometry_msgs/Point": "float64 x, float64 y, float64 z",
    "geometry_msgs/Quaternion": "float64 x, float64 y, float64 z, float64 w",
    "geometry_msgs/Pose": "geometry_msgs/Point position, geometry_msgs/Quaternion orientation",
    "geometry_msgs/Twist": "geometry_msgs/Vector3 linear, geometry_msgs/Vector3 angular",
    "geometry_msgs/Wrench": "geometry_msgs/Vector3 force, geometry_msgs/Vector3 torque",
    "geometry_msgs/Transform": "geometry_msgs/Vector3 translation, geometry_msgs/Quaternion rotation",
    "geometry_msgs/PoseStamped": "std_msgs/Header header, geometry_msgs/Pose pose",
    "geometry_msgs/TwistStamped": "std_msgs/Header header, geometry_msgs/Twist twist",
    "geometry_msgs/WrenchStamped": "std_msgs/Header header, geometry_msgs/Wrench wrench",
    "sensor_msgs/Joy": "std_msgs/Header header, float32[] axes, int32[] buttons",
    "sensor_msgs/JointState":
        "std_msgs/Header header, string[] name, float64[] position, float64[] velocity, float64[] effort",
    "diagnostic_msgs/KeyValue": "string key, string value",
    "diagnostic_msgs/DiagnosticStatus":
        "byte level, string name, string message, string hardware_id, diagnostic_msgs/KeyValue[] values",
    "diagnostic_msgs/DiagnosticArray": "std_msgs/Header header, diagnostic_msgs/DiagnosticStatus[] status",
    "crtk_msgs/OperatingState": "std_msgs/Header header, string state, bool is_homed, bool is_busy",
    "crtk_msgs/StringStamped": "std_msgs/Header header, string string",
}
# name: type in Python, type in C, number in a type hash
SCALARS = {"bool": (bool, c.c_bool, 15), "byte": (int, c.c_uint8, 16), "int32": (int, c.c_int32, 6),
           "uint32": (int, c.c_uint32, 7), "float32": (float, c.c_float, 10), "float64": (float, c.c_double, 11),
           "string": (str, c.c_char_p, 17)}


@functools.cache
def fields(name):
    pairs = [field.split(" ") for field in DEFINITIONS[name].split(", ") if field]
    return [(member, kind.removesuffix("[]"), kind.endswith("[]")) for kind, member in pairs]


# ---- messages ------------------------------------------------------------------------------------------------

MESSAGES = {}
STRUCTURES = {}


class Message:
    def __init__(self):
        for member, kind, many in fields(self.NAME):
            setattr(self, member, [] if many else MESSAGES[kind]() if kind in MESSAGES else SCALARS[kind][0]())
        if self.NAME == "geometry_msgs/Quaternion":
            self.w = 1.0

    def __setattr__(self, member, value):  # as strict as the messages of ROS 2
        kind, many = {m: (k, many) for m, k, many in fields(self.NAME)}[member]
        wanted = list if many else MESSAGES[kind] if kind in MESSAGES else SCALARS[kind][0]
        assert isinstance(value, wanted), f"{self.NAME}.{member} must be {wanted.__name__}, not {value!r}"
        object.__setattr__(self, member, value)


def to_c(kind, value, kept):
    if kind == "string":
        return value.encode()
    if kind in SCALARS:
        return value
    structure = STRUCTURES[kind]()
    for member, inner, many in fields(kind):
        one = getattr(value, member)
        if not many:
            setattr(structure, member, to_c(inner, one, kept))
            continue
        element = STRUCTURES.get(inner) or SCALARS[inner][1]
        array = (element * len(one))(*(to_c(inner, each, kept) for each in one))
        kept.append(array)  # until it is written
        sequence = getattr(structure, member)
        sequence.maximum = sequence.length = len(one)
        sequence.buffer = c.cast(array, c.c_void_p)
    return structure


def from_c(kind, value):
    if kind == "string":
        return (value or b"").decode(errors="replace")
    if kind in SCALARS:
        return value
    message = object.__new__(MESSAGES[kind])
    for member, inner, many in fields(kind):
        one = getattr(value, member)
        if many:
            element = STRUCTURES.get(inner) or SCALARS[inner][1]
            array = c.cast(one.buffer, c.POINTER(element))
            one = [array[i] for i in range(one.length)]
            object.__setattr__(message, member, [from_c(inner, each) for each in one])
        else:
            object.__setattr__(message, member, from_c(inner, one))
    return message


class Sequence(c.Structure):
    _fields_ = [("maximum", c.c_uint32), ("length", c.c_uint32), ("buffer", c.c_void_p), ("release", c.c_bool)]


for _name in DEFINITIONS:
    _members = [(m, Sequence if many else STRUCTURES.get(k) or SCALARS[k][1]) for m, k, many in fields(_name)]
    STRUCTURES[_name] = type(_name, (c.Structure,), {"_fields_": _members})
    MESSAGES[_name] = type(_name.split("/")[1], (Message,), {"NAME": _name})


def type_hash(name):
    """REP 2016, computed from DEFINITIONS and independently of tendon-bridge."""
    ros = lambda kind: kind.replace("/", "/msg/")
    def describe(kind):
        return {"type_name": ros(kind), "fields": [
            {"name": m, "type": {"type_id": (1 if k in DEFINITIONS else SCALARS[k][2]) + (144 if many else 0),
                                 "capacity": 0, "string_capacity": 0,
                                 "nested_type_name": ros(k) if k in DEFINITIONS else ""}} for m, k, many in fields(kind)]}
    def nested(kind):
        inner = {k for _, k, _ in fields(kind) if k in DEFINITIONS}
        return inner.union(*(nested(k) for k in inner))
    text = json.dumps({"type_description": describe(name),
                       "referenced_type_descriptions": [describe(k) for k in sorted(nested(name), key=ros)]})
    return "RIHS01_" + hashlib.sha256(text.encode()).hexdigest()


# ---- DDS -----------------------------------------------------------------------------------------------------

LOOPBACK = """<CycloneDDS><Domain Id="any"><General><Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>
<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>
<MaxAutoParticipantIndex>99</MaxAutoParticipantIndex><Peers><Peer Address="127.0.0.1"/></Peers></Discovery>
</Domain></CycloneDDS>"""
DATA_AVAILABLE = 1 << 8
SECOND = 10**9


class Info(c.Structure):
    _fields_ = [("states", c.c_int * 3), ("valid", c.c_bool), ("stamp", c.c_int64), ("instance", c.c_uint64),
                ("publication", c.c_uint64), ("counts", c.c_uint32 * 5)]


class Matched(c.Structure):
    _fields_ = [("total", c.c_uint32), ("change", c.c_int32), ("current", c.c_uint32), ("current_change", c.c_int32),
                ("handle", c.c_uint64)]


class Endpoint(c.Structure):
    _fields_ = [("key", c.c_uint8 * 16), ("participant", c.c_uint8 * 16), ("instance", c.c_uint64),
                ("topic", c.c_char_p), ("type", c.c_char_p), ("qos", c.c_void_p)]


class Dds:
    def __init__(self, library, domain):
        self.types = c.CDLL(library, mode=c.RTLD_GLOBAL)
        self.lib = c.CDLL(None)  # the library of the types is linked to that of DDS
        self.lib.dds_create_qos.restype = c.c_void_p
        self.lib.dds_strretcode.restype = c.c_char_p
        self.made(self.lib.dds_create_domain(c.c_uint32(domain), LOOPBACK.encode()))
        self.participant = self.made(self.lib.dds_create_participant(c.c_uint32(domain), None, None))
        self.waitset = self.made(self.lib.dds_create_waitset(self.participant))

    def made(self, entity):
        if entity < 0:
            raise RuntimeError(self.lib.dds_strretcode(entity).decode())
        return entity

    def endpoint(self, create, kind, topic, profile):
        package, name = kind.split("/")
        descriptor = c.c_char.in_dll(self.types, f"{package}_msg_dds__{name}__desc")
        path = ("rt/" + topic.lstrip("/")).encode()
        of_topic = self.made(self.lib.dds_create_topic(self.participant, c.byref(descriptor), path, None, None))
        qos = c.c_void_p(self.lib.dds_create_qos())
        self.lib.dds_qset_reliability(qos, 1, c.c_int64(SECOND))
        self.lib.dds_qset_history(qos, 0, profile.depth)
        self.lib.dds_qset_durability(qos, 1 if profile.durability == DurabilityPolicy.TRANSIENT_LOCAL else 0)
        self.lib.dds_qset_data_representation(qos, 1, c.byref(c.c_int16(0)))
        return self.made(create(self.participant, of_topic, qos, None))

    def take(self, reader, structure):
        """Yields the samples. Each of them is valid until the next one is taken."""
        sample, info = c.c_void_p(), Info()
        while self.lib.dds_take(reader, c.byref(sample), c.byref(info), c.c_size_t(1), c.c_uint32(1)) == 1:
            if info.valid:
                yield c.cast(sample, c.POINTER(structure)).contents
            self.lib.dds_return_loan(reader, c.byref(sample), 1)
            sample = c.c_void_p()

    def endpoints(self, kind):
        """Endpoints of other participants: (topic, type, USER_DATA). `kind`: 3 writers, 4 readers."""
        pseudo_topic = 0x7fff0000 + kind
        reader = self.made(self.lib.dds_create_reader(self.participant, pseudo_topic, None, None))
        found = []
        for one in self.take(reader, Endpoint):
            data, size = c.c_void_p(), c.c_size_t()
            self.lib.dds_qget_userdata(c.c_void_p(one.qos), c.byref(data), c.byref(size))
            user_data = c.string_at(data, size.value).decode() if size.value else ""
            found.append((one.topic.decode(), one.type.decode(), user_data))
        self.lib.dds_delete(reader)
        return found


DDS = None

# ---- rclpy ---------------------------------------------------------------------------------------------------


class HistoryPolicy:
    KEEP_LAST = 1


class DurabilityPolicy:
    VOLATILE, TRANSIENT_LOCAL = "volatile", "transient local"


class QoSProfile:
    def __init__(self, depth=10, history=HistoryPolicy.KEEP_LAST):
        self.depth, self.history, self.durability = depth, history, DurabilityPolicy.VOLATILE


class Instant:
    """Time and Duration, which cannot be compared with each other or with numbers."""

    def __init__(self, seconds=0.0, nanoseconds=0, clock_type=None):
        self.nanoseconds = int(seconds * SECOND) + nanoseconds

    def _of(self, other):
        if type(self) is not type(other):
            raise TypeError(f"cannot compare {type(self).__name__} with {type(other).__name__}")
        return other.nanoseconds

    def __lt__(self, other): return self.nanoseconds < self._of(other)
    def __le__(self, other): return self.nanoseconds <= self._of(other)
    def __gt__(self, other): return self.nanoseconds > self._of(other)
    def __ge__(self, other): return self.nanoseconds >= self._of(other)


class Duration(Instant):
    pass


class Time(Instant):
    def __sub__(self, other):
        return (Duration if isinstance(other, Time) else Time)(nanoseconds=self.nanoseconds - other.nanoseconds)

    def __add__(self, other):
        return Time(nanoseconds=self.nanoseconds + other.nanoseconds)

    @staticmethod
    def from_msg(message):
        return Time(nanoseconds=message.sec * SECOND + message.nanosec)

    def to_msg(self):
        message = MESSAGES["builtin_interfaces/Time"]()
        message.sec, message.nanosec = divmod(self.nanoseconds, SECOND)
        return message


class Clock:
    clock_type = "ros time"

    def now(self):
        return Time(nanoseconds=time.time_ns())


class Rate:
    def __init__(self, frequency):
        self.period, self.next = 1 / frequency, time.monotonic()

    def sleep(self):
        self.next = max(self.next + self.period, time.monotonic())
        time.sleep(max(0.0, self.next - time.monotonic()))


class Publisher:
    def __init__(self, kind, topic, profile):
        self.kind, self.topic_name = kind, topic
        self.entity = DDS.endpoint(DDS.lib.dds_create_writer, kind.NAME, topic, profile)

    def publish(self, message):
        assert isinstance(message, self.kind)
        kept = []
        DDS.made(DDS.lib.dds_write(self.entity, c.byref(to_c(self.kind.NAME, message, kept))))

    def get_subscription_count(self):
        return matched(DDS.lib.dds_get_publication_matched_status, self.entity)


class Subscription:
    def __init__(self, kind, topic, callback, profile):
        self.kind, self.topic_name, self.callback = kind, topic, callback
        self.entity = DDS.endpoint(DDS.lib.dds_create_reader, kind.NAME, topic, profile)
        DDS.made(DDS.lib.dds_set_status_mask(self.entity, c.c_uint32(DATA_AVAILABLE)))
        DDS.made(DDS.lib.dds_waitset_attach(DDS.waitset, self.entity, c.c_ssize_t(self.entity)))

    def take(self):
        for structure in DDS.take(self.entity, STRUCTURES[self.kind.NAME]):
            self.callback(from_c(self.kind.NAME, structure))

    def get_publisher_count(self):
        return matched(DDS.lib.dds_get_subscription_matched_status, self.entity)


def matched(read, entity):
    status = Matched()
    DDS.made(read(entity, c.byref(status)))
    return status.current


class Node:
    def __init__(self, name):
        self.subscriptions = []

    def get_clock(self):
        return Clock()

    def create_publisher(self, kind, topic, profile):
        return Publisher(kind, topic, profile)

    def create_subscription(self, kind, topic, callback, profile):
        self.subscriptions.append(Subscription(kind, topic, callback, profile))
        return self.subscriptions[-1]

    def create_rate(self, frequency, clock=None):
        return Rate(frequency)

    def destroy_publisher(self, publisher):
        DDS.lib.dds_delete(publisher.entity)

    def destroy_subscription(self, subscription):
        self.subscriptions.remove(subscription)
        DDS.lib.dds_delete(subscription.entity)


class Context:
    def __init__(self):
        self.runs, self.callbacks = threading.Event(), []

    def on_shutdown(self, callback):
        self.callbacks.append(callback)

    def shutdown(self):
        self.runs.clear()
        for callback in self.callbacks:
            callback()


CONTEXT = Context()


class ExternalShutdownException(Exception):
    pass


class SingleThreadedExecutor:
    def add_node(self, node):
        self.node = node

    def spin(self):
        while CONTEXT.runs.is_set():
            DDS.lib.dds_waitset_wait(DDS.waitset, None, c.c_size_t(0), c.c_int64(SECOND // 10))
            for subscription in list(self.node.subscriptions):
                subscription.take()
        raise ExternalShutdownException


def start(library, domain):
    global DDS
    DDS = Dds(library, domain)

    def module(name, **members):
        made = sys.modules[name] = types.ModuleType(name)
        made.__dict__.update(members)
        if "." in name:
            setattr(sys.modules[name.split(".")[0]], name.split(".")[1], made)

    module("rclpy", init=lambda args=None: CONTEXT.runs.set(), create_node=Node, ok=CONTEXT.runs.is_set,
           shutdown=CONTEXT.shutdown, get_default_context=lambda: CONTEXT)
    module("rclpy.publisher", Publisher=Publisher)
    module("rclpy.subscription", Subscription=Subscription)
    module("rclpy.qos", QoSProfile=QoSProfile, HistoryPolicy=HistoryPolicy, DurabilityPolicy=DurabilityPolicy)
    module("rclpy.time", Time=Time, Duration=Duration)
    module("rclpy.utilities", remove_ros_args=lambda args: args)
    module("rclpy.executors", SingleThreadedExecutor=SingleThreadedExecutor,
           ExternalShutdownException=ExternalShutdownException)
    for package in ("std_msgs", "geometry_msgs", "sensor_msgs", "diagnostic_msgs", "crtk_msgs"):
        module(package)
        module(package + ".msg", **{m.__name__: m for n, m in MESSAGES.items() if n.startswith(package + "/")})
    module("crtk_msgs.srv")
