# SPDX-License-Identifier: Apache-2.0
from google.protobuf.internal import containers as _containers
from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Iterable as _Iterable, Mapping as _Mapping, Optional as _Optional, Union as _Union

CHANNEL_RULE_PRIORITY: ChannelRule
CHANNEL_RULE_SUM: ChannelRule
CHANNEL_RULE_UNSPECIFIED: ChannelRule
CODE_BUSY: Code
CODE_DENIED: Code
CODE_EXPIRED: Code
CODE_INVALID: Code
CODE_OK: Code
CODE_REPLACED: Code
CODE_SHUTDOWN: Code
CODE_TIMED_OUT: Code
CODE_UNSPECIFIED: Code
CODE_UNSUPPORTED: Code
COUPLING_METHOD_PASSIVITY: CouplingMethod
COUPLING_METHOD_POSITION_FORCE: CouplingMethod
COUPLING_METHOD_POSITION_POSITION: CouplingMethod
COUPLING_METHOD_RATE: CouplingMethod
COUPLING_METHOD_SET_POSITION: CouplingMethod
COUPLING_METHOD_SURFACE: CouplingMethod
COUPLING_METHOD_UNSPECIFIED: CouplingMethod
COUPLING_METHOD_WAVES: CouplingMethod
DESCRIPTOR: _descriptor.FileDescriptor
FIELD_FIXTURE_KIND_LINE: FieldFixtureKind
FIELD_FIXTURE_KIND_PLANE: FieldFixtureKind
FIELD_FIXTURE_KIND_POINT: FieldFixtureKind
FIELD_FIXTURE_KIND_UNSPECIFIED: FieldFixtureKind
HAND_ANY: Hand
HAND_LEFT: Hand
HAND_RIGHT: Hand
MODE_ACTIVE: Mode
MODE_DECAYING: Mode
MODE_FAULT: Mode
MODE_HOLDING: Mode
MODE_IDLE: Mode
MODE_SAFE_STOP: Mode
MODE_UNSPECIFIED: Mode
OUTPUT_LAMP: OutputKind
OUTPUT_UNSPECIFIED: OutputKind
OUTPUT_VIBRATION: OutputKind
PORT_PHASE_ALIGNING: PortPhase
PORT_PHASE_ALONE: PortPhase
PORT_PHASE_CLUTCHED: PortPhase
PORT_PHASE_COUPLED: PortPhase
PORT_PHASE_ENGAGED: PortPhase
PORT_PHASE_FAULT: PortPhase
PORT_PHASE_LOST: PortPhase
PORT_PHASE_UNSPECIFIED: PortPhase
PORT_ROLE_FOLLOWER: PortRole
PORT_ROLE_LEADER: PortRole
PORT_ROLE_UNSPECIFIED: PortRole
ROLE_CONTROLLER: Role
ROLE_OBSERVER: Role
ROLE_UNSPECIFIED: Role
SAFETY_ABSENT: Safety
SAFETY_ARMED: Safety
SAFETY_FAULT: Safety
SAFETY_FIRMWARE: Safety
SAFETY_HOMED: Safety
SAFETY_OPENING: Safety
SAFETY_UNGUARDED: Safety
SAFETY_UNHOMED: Safety
SAFETY_UNSPECIFIED: Safety

class Answer(_message.Message):
    __slots__ = ["refused", "welcome"]
    REFUSED_FIELD_NUMBER: _ClassVar[int]
    WELCOME_FIELD_NUMBER: _ClassVar[int]
    refused: Refused
    welcome: Welcome
    def __init__(self, welcome: _Optional[_Union[Welcome, _Mapping]] = ..., refused: _Optional[_Union[Refused, _Mapping]] = ...) -> None: ...

class Bye(_message.Message):
    __slots__ = ["code", "reason"]
    CODE_FIELD_NUMBER: _ClassVar[int]
    REASON_FIELD_NUMBER: _ClassVar[int]
    code: Code
    reason: str
    def __init__(self, code: _Optional[_Union[Code, str]] = ..., reason: _Optional[str] = ...) -> None: ...

class ChannelDescription(_message.Message):
    __slots__ = ["holder", "lease_ms", "name", "rule"]
    HOLDER_FIELD_NUMBER: _ClassVar[int]
    LEASE_MS_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    RULE_FIELD_NUMBER: _ClassVar[int]
    holder: str
    lease_ms: int
    name: str
    rule: ChannelRule
    def __init__(self, name: _Optional[str] = ..., rule: _Optional[_Union[ChannelRule, str]] = ..., lease_ms: _Optional[int] = ..., holder: _Optional[str] = ...) -> None: ...

class Claim(_message.Message):
    __slots__ = ["channel", "device", "role"]
    CHANNEL_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    ROLE_FIELD_NUMBER: _ClassVar[int]
    channel: str
    device: str
    role: Role
    def __init__(self, device: _Optional[str] = ..., channel: _Optional[str] = ..., role: _Optional[_Union[Role, str]] = ...) -> None: ...

class Contact(_message.Message):
    __slots__ = ["gap_m", "normal", "table"]
    GAP_M_FIELD_NUMBER: _ClassVar[int]
    NORMAL_FIELD_NUMBER: _ClassVar[int]
    TABLE_FIELD_NUMBER: _ClassVar[int]
    gap_m: float
    normal: Vec3
    table: ForceTable
    def __init__(self, normal: _Optional[_Union[Vec3, _Mapping]] = ..., gap_m: _Optional[float] = ..., table: _Optional[_Union[ForceTable, _Mapping]] = ...) -> None: ...

class Control(_message.Message):
    __slots__ = ["couple", "describe", "disarm", "disengage", "drop_field", "engage", "give_lease", "id", "lease_lost", "offer_field", "rearm", "set_output", "set_scale", "set_share", "set_state_deadband", "set_state_rate", "take_lease", "use_field"]
    COUPLE_FIELD_NUMBER: _ClassVar[int]
    DESCRIBE_FIELD_NUMBER: _ClassVar[int]
    DISARM_FIELD_NUMBER: _ClassVar[int]
    DISENGAGE_FIELD_NUMBER: _ClassVar[int]
    DROP_FIELD_FIELD_NUMBER: _ClassVar[int]
    ENGAGE_FIELD_NUMBER: _ClassVar[int]
    GIVE_LEASE_FIELD_NUMBER: _ClassVar[int]
    ID_FIELD_NUMBER: _ClassVar[int]
    LEASE_LOST_FIELD_NUMBER: _ClassVar[int]
    OFFER_FIELD_FIELD_NUMBER: _ClassVar[int]
    REARM_FIELD_NUMBER: _ClassVar[int]
    SET_OUTPUT_FIELD_NUMBER: _ClassVar[int]
    SET_SCALE_FIELD_NUMBER: _ClassVar[int]
    SET_SHARE_FIELD_NUMBER: _ClassVar[int]
    SET_STATE_DEADBAND_FIELD_NUMBER: _ClassVar[int]
    SET_STATE_RATE_FIELD_NUMBER: _ClassVar[int]
    TAKE_LEASE_FIELD_NUMBER: _ClassVar[int]
    USE_FIELD_FIELD_NUMBER: _ClassVar[int]
    couple: Couple
    describe: Describe
    disarm: Disarm
    disengage: Disengage
    drop_field: DropField
    engage: Engage
    give_lease: GiveLease
    id: int
    lease_lost: LeaseLost
    offer_field: OfferField
    rearm: Rearm
    set_output: SetOutput
    set_scale: SetScale
    set_share: SetShare
    set_state_deadband: SetStateDeadband
    set_state_rate: SetStateRate
    take_lease: TakeLease
    use_field: UseField
    def __init__(self, id: _Optional[int] = ..., set_state_rate: _Optional[_Union[SetStateRate, _Mapping]] = ..., rearm: _Optional[_Union[Rearm, _Mapping]] = ..., describe: _Optional[_Union[Describe, _Mapping]] = ..., take_lease: _Optional[_Union[TakeLease, _Mapping]] = ..., give_lease: _Optional[_Union[GiveLease, _Mapping]] = ..., set_state_deadband: _Optional[_Union[SetStateDeadband, _Mapping]] = ..., disarm: _Optional[_Union[Disarm, _Mapping]] = ..., set_output: _Optional[_Union[SetOutput, _Mapping]] = ..., couple: _Optional[_Union[Couple, _Mapping]] = ..., engage: _Optional[_Union[Engage, _Mapping]] = ..., disengage: _Optional[_Union[Disengage, _Mapping]] = ..., set_scale: _Optional[_Union[SetScale, _Mapping]] = ..., set_share: _Optional[_Union[SetShare, _Mapping]] = ..., lease_lost: _Optional[_Union[LeaseLost, _Mapping]] = ..., offer_field: _Optional[_Union[OfferField, _Mapping]] = ..., use_field: _Optional[_Union[UseField, _Mapping]] = ..., drop_field: _Optional[_Union[DropField, _Mapping]] = ...) -> None: ...

class ControlAck(_message.Message):
    __slots__ = ["code", "detail", "device", "handle", "id", "wait_ms"]
    CODE_FIELD_NUMBER: _ClassVar[int]
    DETAIL_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    HANDLE_FIELD_NUMBER: _ClassVar[int]
    ID_FIELD_NUMBER: _ClassVar[int]
    WAIT_MS_FIELD_NUMBER: _ClassVar[int]
    code: Code
    detail: str
    device: DeviceDescription
    handle: HandleDescription
    id: int
    wait_ms: int
    def __init__(self, id: _Optional[int] = ..., code: _Optional[_Union[Code, str]] = ..., detail: _Optional[str] = ..., wait_ms: _Optional[int] = ..., device: _Optional[_Union[DeviceDescription, _Mapping]] = ..., handle: _Optional[_Union[HandleDescription, _Mapping]] = ...) -> None: ...

class Couple(_message.Message):
    __slots__ = ["absolute", "adapt_to_delay", "axes", "channel", "damping_nspm", "device", "drift_rate_per_s", "force_scale", "grip_damping_nspm", "grip_stiffness_npm", "method", "mutual_damping_nspm", "period_us", "position_scale", "purse", "rate", "role", "rotation", "stiffness_npm", "turn_damping_nmsprad", "turn_stiffness_nmprad"]
    ABSOLUTE_FIELD_NUMBER: _ClassVar[int]
    ADAPT_TO_DELAY_FIELD_NUMBER: _ClassVar[int]
    AXES_FIELD_NUMBER: _ClassVar[int]
    CHANNEL_FIELD_NUMBER: _ClassVar[int]
    DAMPING_NSPM_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    DRIFT_RATE_PER_S_FIELD_NUMBER: _ClassVar[int]
    FORCE_SCALE_FIELD_NUMBER: _ClassVar[int]
    GRIP_DAMPING_NSPM_FIELD_NUMBER: _ClassVar[int]
    GRIP_STIFFNESS_NPM_FIELD_NUMBER: _ClassVar[int]
    METHOD_FIELD_NUMBER: _ClassVar[int]
    MUTUAL_DAMPING_NSPM_FIELD_NUMBER: _ClassVar[int]
    PERIOD_US_FIELD_NUMBER: _ClassVar[int]
    POSITION_SCALE_FIELD_NUMBER: _ClassVar[int]
    PURSE_FIELD_NUMBER: _ClassVar[int]
    RATE_FIELD_NUMBER: _ClassVar[int]
    ROLE_FIELD_NUMBER: _ClassVar[int]
    ROTATION_FIELD_NUMBER: _ClassVar[int]
    STIFFNESS_NPM_FIELD_NUMBER: _ClassVar[int]
    TURN_DAMPING_NMSPRAD_FIELD_NUMBER: _ClassVar[int]
    TURN_STIFFNESS_NMPRAD_FIELD_NUMBER: _ClassVar[int]
    absolute: bool
    adapt_to_delay: bool
    axes: int
    channel: int
    damping_nspm: float
    device: int
    drift_rate_per_s: float
    force_scale: float
    grip_damping_nspm: float
    grip_stiffness_npm: float
    method: CouplingMethod
    mutual_damping_nspm: float
    period_us: int
    position_scale: float
    purse: bool
    rate: RateControl
    role: PortRole
    rotation: Quat
    stiffness_npm: float
    turn_damping_nmsprad: float
    turn_stiffness_nmprad: float
    def __init__(self, device: _Optional[int] = ..., channel: _Optional[int] = ..., role: _Optional[_Union[PortRole, str]] = ..., method: _Optional[_Union[CouplingMethod, str]] = ..., position_scale: _Optional[float] = ..., force_scale: _Optional[float] = ..., rotation: _Optional[_Union[Quat, _Mapping]] = ..., axes: _Optional[int] = ..., stiffness_npm: _Optional[float] = ..., mutual_damping_nspm: _Optional[float] = ..., damping_nspm: _Optional[float] = ..., adapt_to_delay: bool = ..., purse: bool = ..., period_us: _Optional[int] = ..., absolute: bool = ..., turn_stiffness_nmprad: _Optional[float] = ..., turn_damping_nmsprad: _Optional[float] = ..., grip_stiffness_npm: _Optional[float] = ..., grip_damping_nspm: _Optional[float] = ..., drift_rate_per_s: _Optional[float] = ..., rate: _Optional[_Union[RateControl, _Mapping]] = ...) -> None: ...

class Datagram(_message.Message):
    __slots__ = ["echo", "frames", "tx_time_ns"]
    ECHO_FIELD_NUMBER: _ClassVar[int]
    FRAMES_FIELD_NUMBER: _ClassVar[int]
    TX_TIME_NS_FIELD_NUMBER: _ClassVar[int]
    echo: Echo
    frames: _containers.RepeatedCompositeFieldContainer[Frame]
    tx_time_ns: int
    def __init__(self, tx_time_ns: _Optional[int] = ..., echo: _Optional[_Union[Echo, _Mapping]] = ..., frames: _Optional[_Iterable[_Union[Frame, _Mapping]]] = ...) -> None: ...

class Delays(_message.Message):
    __slots__ = ["median_ns", "p99_ns"]
    MEDIAN_NS_FIELD_NUMBER: _ClassVar[int]
    P99_NS_FIELD_NUMBER: _ClassVar[int]
    median_ns: int
    p99_ns: int
    def __init__(self, median_ns: _Optional[int] = ..., p99_ns: _Optional[int] = ...) -> None: ...

class Describe(_message.Message):
    __slots__ = ["device", "handle"]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    HANDLE_FIELD_NUMBER: _ClassVar[int]
    device: int
    handle: bool
    def __init__(self, device: _Optional[int] = ..., handle: bool = ...) -> None: ...

class DeviceDescription(_message.Message):
    __slots__ = ["channels", "continuous_force_n", "device", "force_dof", "loop_hz", "max_force_n", "max_stiffness_npm", "model", "name", "position_dof", "position_resolution_m", "workspace_max_m", "workspace_min_m"]
    CHANNELS_FIELD_NUMBER: _ClassVar[int]
    CONTINUOUS_FORCE_N_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    FORCE_DOF_FIELD_NUMBER: _ClassVar[int]
    LOOP_HZ_FIELD_NUMBER: _ClassVar[int]
    MAX_FORCE_N_FIELD_NUMBER: _ClassVar[int]
    MAX_STIFFNESS_NPM_FIELD_NUMBER: _ClassVar[int]
    MODEL_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    POSITION_DOF_FIELD_NUMBER: _ClassVar[int]
    POSITION_RESOLUTION_M_FIELD_NUMBER: _ClassVar[int]
    WORKSPACE_MAX_M_FIELD_NUMBER: _ClassVar[int]
    WORKSPACE_MIN_M_FIELD_NUMBER: _ClassVar[int]
    channels: _containers.RepeatedCompositeFieldContainer[ChannelDescription]
    continuous_force_n: float
    device: int
    force_dof: int
    loop_hz: int
    max_force_n: float
    max_stiffness_npm: float
    model: str
    name: str
    position_dof: int
    position_resolution_m: float
    workspace_max_m: Vec3
    workspace_min_m: Vec3
    def __init__(self, device: _Optional[int] = ..., name: _Optional[str] = ..., model: _Optional[str] = ..., position_dof: _Optional[int] = ..., force_dof: _Optional[int] = ..., workspace_min_m: _Optional[_Union[Vec3, _Mapping]] = ..., workspace_max_m: _Optional[_Union[Vec3, _Mapping]] = ..., max_force_n: _Optional[float] = ..., continuous_force_n: _Optional[float] = ..., max_stiffness_npm: _Optional[float] = ..., position_resolution_m: _Optional[float] = ..., loop_hz: _Optional[int] = ..., channels: _Optional[_Iterable[_Union[ChannelDescription, _Mapping]]] = ...) -> None: ...

class DeviceReport(_message.Message):
    __slots__ = ["degraded", "device", "fault", "lateness_us_log2", "missed", "number", "overruns", "safety", "span_ns", "steps", "unseen", "until_ns"]
    DEGRADED_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    FAULT_FIELD_NUMBER: _ClassVar[int]
    LATENESS_US_LOG2_FIELD_NUMBER: _ClassVar[int]
    MISSED_FIELD_NUMBER: _ClassVar[int]
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    OVERRUNS_FIELD_NUMBER: _ClassVar[int]
    SAFETY_FIELD_NUMBER: _ClassVar[int]
    SPAN_NS_FIELD_NUMBER: _ClassVar[int]
    STEPS_FIELD_NUMBER: _ClassVar[int]
    UNSEEN_FIELD_NUMBER: _ClassVar[int]
    UNTIL_NS_FIELD_NUMBER: _ClassVar[int]
    degraded: str
    device: int
    fault: str
    lateness_us_log2: _containers.RepeatedScalarFieldContainer[int]
    missed: int
    number: int
    overruns: int
    safety: Safety
    span_ns: int
    steps: int
    unseen: int
    until_ns: int
    def __init__(self, number: _Optional[int] = ..., until_ns: _Optional[int] = ..., span_ns: _Optional[int] = ..., device: _Optional[int] = ..., steps: _Optional[int] = ..., missed: _Optional[int] = ..., overruns: _Optional[int] = ..., unseen: _Optional[int] = ..., lateness_us_log2: _Optional[_Iterable[int]] = ..., safety: _Optional[_Union[Safety, str]] = ..., fault: _Optional[str] = ..., degraded: _Optional[str] = ...) -> None: ...

class DeviceState(_message.Message):
    __slots__ = ["angular_velocity_radps", "buttons", "channel", "device", "energy_j", "field", "field_depth_m", "field_proxy_m", "force_age_ns", "force_applied_n", "force_sequence", "force_wanted_n", "gripper_force_applied_n", "gripper_rad", "gripper_velocity_radps", "hand_force_n", "joint_rad", "joint_velocity_radps", "mode", "orientation", "permitted_force_n", "position_m", "reasons", "sampled_ns", "stiffness_wanted_npm", "tick", "torque_applied_nm", "velocity_mps"]
    ANGULAR_VELOCITY_RADPS_FIELD_NUMBER: _ClassVar[int]
    BUTTONS_FIELD_NUMBER: _ClassVar[int]
    CHANNEL_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    ENERGY_J_FIELD_NUMBER: _ClassVar[int]
    FIELD_DEPTH_M_FIELD_NUMBER: _ClassVar[int]
    FIELD_FIELD_NUMBER: _ClassVar[int]
    FIELD_PROXY_M_FIELD_NUMBER: _ClassVar[int]
    FORCE_AGE_NS_FIELD_NUMBER: _ClassVar[int]
    FORCE_APPLIED_N_FIELD_NUMBER: _ClassVar[int]
    FORCE_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    FORCE_WANTED_N_FIELD_NUMBER: _ClassVar[int]
    GRIPPER_FORCE_APPLIED_N_FIELD_NUMBER: _ClassVar[int]
    GRIPPER_RAD_FIELD_NUMBER: _ClassVar[int]
    GRIPPER_VELOCITY_RADPS_FIELD_NUMBER: _ClassVar[int]
    HAND_FORCE_N_FIELD_NUMBER: _ClassVar[int]
    JOINT_RAD_FIELD_NUMBER: _ClassVar[int]
    JOINT_VELOCITY_RADPS_FIELD_NUMBER: _ClassVar[int]
    MODE_FIELD_NUMBER: _ClassVar[int]
    ORIENTATION_FIELD_NUMBER: _ClassVar[int]
    PERMITTED_FORCE_N_FIELD_NUMBER: _ClassVar[int]
    POSITION_M_FIELD_NUMBER: _ClassVar[int]
    REASONS_FIELD_NUMBER: _ClassVar[int]
    SAMPLED_NS_FIELD_NUMBER: _ClassVar[int]
    STIFFNESS_WANTED_NPM_FIELD_NUMBER: _ClassVar[int]
    TICK_FIELD_NUMBER: _ClassVar[int]
    TORQUE_APPLIED_NM_FIELD_NUMBER: _ClassVar[int]
    VELOCITY_MPS_FIELD_NUMBER: _ClassVar[int]
    angular_velocity_radps: Vec3
    buttons: int
    channel: int
    device: int
    energy_j: float
    field: int
    field_depth_m: float
    field_proxy_m: Vec3
    force_age_ns: int
    force_applied_n: Vec3
    force_sequence: int
    force_wanted_n: Vec3
    gripper_force_applied_n: float
    gripper_rad: float
    gripper_velocity_radps: float
    hand_force_n: Vec3
    joint_rad: _containers.RepeatedScalarFieldContainer[float]
    joint_velocity_radps: _containers.RepeatedScalarFieldContainer[float]
    mode: Mode
    orientation: Quat
    permitted_force_n: float
    position_m: Vec3
    reasons: int
    sampled_ns: int
    stiffness_wanted_npm: _containers.RepeatedScalarFieldContainer[float]
    tick: int
    torque_applied_nm: Vec3
    velocity_mps: Vec3
    def __init__(self, tick: _Optional[int] = ..., sampled_ns: _Optional[int] = ..., position_m: _Optional[_Union[Vec3, _Mapping]] = ..., velocity_mps: _Optional[_Union[Vec3, _Mapping]] = ..., force_applied_n: _Optional[_Union[Vec3, _Mapping]] = ..., energy_j: _Optional[float] = ..., permitted_force_n: _Optional[float] = ..., reasons: _Optional[int] = ..., force_sequence: _Optional[int] = ..., force_age_ns: _Optional[int] = ..., mode: _Optional[_Union[Mode, str]] = ..., device: _Optional[int] = ..., channel: _Optional[int] = ..., force_wanted_n: _Optional[_Union[Vec3, _Mapping]] = ..., orientation: _Optional[_Union[Quat, _Mapping]] = ..., angular_velocity_radps: _Optional[_Union[Vec3, _Mapping]] = ..., buttons: _Optional[int] = ..., torque_applied_nm: _Optional[_Union[Vec3, _Mapping]] = ..., gripper_rad: _Optional[float] = ..., gripper_velocity_radps: _Optional[float] = ..., gripper_force_applied_n: _Optional[float] = ..., hand_force_n: _Optional[_Union[Vec3, _Mapping]] = ..., joint_rad: _Optional[_Iterable[float]] = ..., joint_velocity_radps: _Optional[_Iterable[float]] = ..., stiffness_wanted_npm: _Optional[_Iterable[float]] = ..., field: _Optional[int] = ..., field_depth_m: _Optional[float] = ..., field_proxy_m: _Optional[_Union[Vec3, _Mapping]] = ...) -> None: ...

class DeviceStates(_message.Message):
    __slots__ = ["buttons", "channel", "devices", "energy_j", "force_age_ns", "force_applied_n", "force_sequence", "mode", "permitted_force_n", "position_m", "reasons", "sampled_ns", "tick", "velocity_mps"]
    BUTTONS_FIELD_NUMBER: _ClassVar[int]
    CHANNEL_FIELD_NUMBER: _ClassVar[int]
    DEVICES_FIELD_NUMBER: _ClassVar[int]
    ENERGY_J_FIELD_NUMBER: _ClassVar[int]
    FORCE_AGE_NS_FIELD_NUMBER: _ClassVar[int]
    FORCE_APPLIED_N_FIELD_NUMBER: _ClassVar[int]
    FORCE_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    MODE_FIELD_NUMBER: _ClassVar[int]
    PERMITTED_FORCE_N_FIELD_NUMBER: _ClassVar[int]
    POSITION_M_FIELD_NUMBER: _ClassVar[int]
    REASONS_FIELD_NUMBER: _ClassVar[int]
    SAMPLED_NS_FIELD_NUMBER: _ClassVar[int]
    TICK_FIELD_NUMBER: _ClassVar[int]
    VELOCITY_MPS_FIELD_NUMBER: _ClassVar[int]
    buttons: _containers.RepeatedScalarFieldContainer[int]
    channel: _containers.RepeatedScalarFieldContainer[int]
    devices: int
    energy_j: _containers.RepeatedScalarFieldContainer[float]
    force_age_ns: _containers.RepeatedScalarFieldContainer[int]
    force_applied_n: _containers.RepeatedScalarFieldContainer[float]
    force_sequence: _containers.RepeatedScalarFieldContainer[int]
    mode: _containers.RepeatedScalarFieldContainer[Mode]
    permitted_force_n: _containers.RepeatedScalarFieldContainer[float]
    position_m: _containers.RepeatedScalarFieldContainer[float]
    reasons: _containers.RepeatedScalarFieldContainer[int]
    sampled_ns: int
    tick: int
    velocity_mps: _containers.RepeatedScalarFieldContainer[float]
    def __init__(self, tick: _Optional[int] = ..., sampled_ns: _Optional[int] = ..., devices: _Optional[int] = ..., position_m: _Optional[_Iterable[float]] = ..., velocity_mps: _Optional[_Iterable[float]] = ..., force_applied_n: _Optional[_Iterable[float]] = ..., energy_j: _Optional[_Iterable[float]] = ..., permitted_force_n: _Optional[_Iterable[float]] = ..., mode: _Optional[_Iterable[_Union[Mode, str]]] = ..., reasons: _Optional[_Iterable[int]] = ..., force_sequence: _Optional[_Iterable[int]] = ..., force_age_ns: _Optional[_Iterable[int]] = ..., channel: _Optional[_Iterable[int]] = ..., buttons: _Optional[_Iterable[int]] = ...) -> None: ...

class Disarm(_message.Message):
    __slots__ = ["device"]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    device: int
    def __init__(self, device: _Optional[int] = ...) -> None: ...

class Disengage(_message.Message):
    __slots__ = ["device"]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    device: int
    def __init__(self, device: _Optional[int] = ...) -> None: ...

class DropField(_message.Message):
    __slots__ = ["field"]
    FIELD_FIELD_NUMBER: _ClassVar[int]
    field: bytes
    def __init__(self, field: _Optional[bytes] = ...) -> None: ...

class Echo(_message.Message):
    __slots__ = ["peer_packet_number", "peer_tx_time_ns", "received_mask", "rx_time_ns"]
    PEER_PACKET_NUMBER_FIELD_NUMBER: _ClassVar[int]
    PEER_TX_TIME_NS_FIELD_NUMBER: _ClassVar[int]
    RECEIVED_MASK_FIELD_NUMBER: _ClassVar[int]
    RX_TIME_NS_FIELD_NUMBER: _ClassVar[int]
    peer_packet_number: int
    peer_tx_time_ns: int
    received_mask: int
    rx_time_ns: int
    def __init__(self, peer_tx_time_ns: _Optional[int] = ..., rx_time_ns: _Optional[int] = ..., peer_packet_number: _Optional[int] = ..., received_mask: _Optional[int] = ...) -> None: ...

class Engage(_message.Message):
    __slots__ = ["device"]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    device: int
    def __init__(self, device: _Optional[int] = ...) -> None: ...

class FieldBrick(_message.Message):
    __slots__ = ["hash", "weights"]
    HASH_FIELD_NUMBER: _ClassVar[int]
    WEIGHTS_FIELD_NUMBER: _ClassVar[int]
    hash: bytes
    weights: bytes
    def __init__(self, hash: _Optional[bytes] = ..., weights: _Optional[bytes] = ...) -> None: ...

class FieldDepthTable(_message.Message):
    __slots__ = ["force_n", "material", "step_m"]
    FORCE_N_FIELD_NUMBER: _ClassVar[int]
    MATERIAL_FIELD_NUMBER: _ClassVar[int]
    STEP_M_FIELD_NUMBER: _ClassVar[int]
    force_n: _containers.RepeatedScalarFieldContainer[float]
    material: int
    step_m: float
    def __init__(self, material: _Optional[int] = ..., step_m: _Optional[float] = ..., force_n: _Optional[_Iterable[float]] = ...) -> None: ...

class FieldFixture(_message.Message):
    __slots__ = ["at_m", "kind", "most_force_n", "normal", "stiffness_npm"]
    AT_M_FIELD_NUMBER: _ClassVar[int]
    KIND_FIELD_NUMBER: _ClassVar[int]
    MOST_FORCE_N_FIELD_NUMBER: _ClassVar[int]
    NORMAL_FIELD_NUMBER: _ClassVar[int]
    STIFFNESS_NPM_FIELD_NUMBER: _ClassVar[int]
    at_m: Vec3
    kind: FieldFixtureKind
    most_force_n: float
    normal: Vec3
    stiffness_npm: float
    def __init__(self, kind: _Optional[_Union[FieldFixtureKind, str]] = ..., at_m: _Optional[_Union[Vec3, _Mapping]] = ..., normal: _Optional[_Union[Vec3, _Mapping]] = ..., stiffness_npm: _Optional[float] = ..., most_force_n: _Optional[float] = ...) -> None: ...

class FieldMaterial(_message.Message):
    __slots__ = ["branch_stiffness_npm", "friction", "relaxation_s", "stiffness_npm"]
    BRANCH_STIFFNESS_NPM_FIELD_NUMBER: _ClassVar[int]
    FRICTION_FIELD_NUMBER: _ClassVar[int]
    RELAXATION_S_FIELD_NUMBER: _ClassVar[int]
    STIFFNESS_NPM_FIELD_NUMBER: _ClassVar[int]
    branch_stiffness_npm: float
    friction: float
    relaxation_s: float
    stiffness_npm: float
    def __init__(self, stiffness_npm: _Optional[float] = ..., branch_stiffness_npm: _Optional[float] = ..., relaxation_s: _Optional[float] = ..., friction: _Optional[float] = ...) -> None: ...

class FieldPose(_message.Message):
    __slots__ = ["angular_velocity_radps", "channel", "device", "orientation", "position_m", "sequence", "time_ns", "velocity_mps"]
    ANGULAR_VELOCITY_RADPS_FIELD_NUMBER: _ClassVar[int]
    CHANNEL_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    ORIENTATION_FIELD_NUMBER: _ClassVar[int]
    POSITION_M_FIELD_NUMBER: _ClassVar[int]
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    TIME_NS_FIELD_NUMBER: _ClassVar[int]
    VELOCITY_MPS_FIELD_NUMBER: _ClassVar[int]
    angular_velocity_radps: Vec3
    channel: int
    device: int
    orientation: Quat
    position_m: Vec3
    sequence: int
    time_ns: int
    velocity_mps: Vec3
    def __init__(self, device: _Optional[int] = ..., channel: _Optional[int] = ..., sequence: _Optional[int] = ..., time_ns: _Optional[int] = ..., position_m: _Optional[_Union[Vec3, _Mapping]] = ..., orientation: _Optional[_Union[Quat, _Mapping]] = ..., velocity_mps: _Optional[_Union[Vec3, _Mapping]] = ..., angular_velocity_radps: _Optional[_Union[Vec3, _Mapping]] = ...) -> None: ...

class FieldStatus(_message.Message):
    __slots__ = ["field", "missing"]
    FIELD_FIELD_NUMBER: _ClassVar[int]
    MISSING_FIELD_NUMBER: _ClassVar[int]
    field: bytes
    missing: bytes
    def __init__(self, field: _Optional[bytes] = ..., missing: _Optional[bytes] = ...) -> None: ...

class ForceCommand(_message.Message):
    __slots__ = ["based_on_tick", "channel", "device", "error_n", "field", "force_n", "gripper_force_n", "model", "rotation_model", "sequence", "topology_changed", "torque_nm", "valid_for_us", "way"]
    BASED_ON_TICK_FIELD_NUMBER: _ClassVar[int]
    CHANNEL_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    ERROR_N_FIELD_NUMBER: _ClassVar[int]
    FIELD_FIELD_NUMBER: _ClassVar[int]
    FORCE_N_FIELD_NUMBER: _ClassVar[int]
    GRIPPER_FORCE_N_FIELD_NUMBER: _ClassVar[int]
    MODEL_FIELD_NUMBER: _ClassVar[int]
    ROTATION_MODEL_FIELD_NUMBER: _ClassVar[int]
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    TOPOLOGY_CHANGED_FIELD_NUMBER: _ClassVar[int]
    TORQUE_NM_FIELD_NUMBER: _ClassVar[int]
    VALID_FOR_US_FIELD_NUMBER: _ClassVar[int]
    WAY_FIELD_NUMBER: _ClassVar[int]
    based_on_tick: int
    channel: int
    device: int
    error_n: float
    field: int
    force_n: Vec3
    gripper_force_n: float
    model: LocalModel
    rotation_model: RotationModel
    sequence: int
    topology_changed: bool
    torque_nm: Vec3
    valid_for_us: int
    way: int
    def __init__(self, sequence: _Optional[int] = ..., based_on_tick: _Optional[int] = ..., force_n: _Optional[_Union[Vec3, _Mapping]] = ..., model: _Optional[_Union[LocalModel, _Mapping]] = ..., valid_for_us: _Optional[int] = ..., device: _Optional[int] = ..., channel: _Optional[int] = ..., topology_changed: bool = ..., error_n: _Optional[float] = ..., torque_nm: _Optional[_Union[Vec3, _Mapping]] = ..., gripper_force_n: _Optional[float] = ..., rotation_model: _Optional[_Union[RotationModel, _Mapping]] = ..., way: _Optional[int] = ..., field: _Optional[int] = ...) -> None: ...

class ForceTable(_message.Message):
    __slots__ = ["first_depth_m", "force_n", "step_m"]
    FIRST_DEPTH_M_FIELD_NUMBER: _ClassVar[int]
    FORCE_N_FIELD_NUMBER: _ClassVar[int]
    STEP_M_FIELD_NUMBER: _ClassVar[int]
    first_depth_m: float
    force_n: _containers.RepeatedScalarFieldContainer[float]
    step_m: float
    def __init__(self, first_depth_m: _Optional[float] = ..., step_m: _Optional[float] = ..., force_n: _Optional[_Iterable[float]] = ...) -> None: ...

class Frame(_message.Message):
    __slots__ = ["bye", "control", "control_ack", "device_report", "field_brick", "field_pose", "field_status", "force", "peer_report", "port_state", "report", "state", "states"]
    BYE_FIELD_NUMBER: _ClassVar[int]
    CONTROL_ACK_FIELD_NUMBER: _ClassVar[int]
    CONTROL_FIELD_NUMBER: _ClassVar[int]
    DEVICE_REPORT_FIELD_NUMBER: _ClassVar[int]
    FIELD_BRICK_FIELD_NUMBER: _ClassVar[int]
    FIELD_POSE_FIELD_NUMBER: _ClassVar[int]
    FIELD_STATUS_FIELD_NUMBER: _ClassVar[int]
    FORCE_FIELD_NUMBER: _ClassVar[int]
    PEER_REPORT_FIELD_NUMBER: _ClassVar[int]
    PORT_STATE_FIELD_NUMBER: _ClassVar[int]
    REPORT_FIELD_NUMBER: _ClassVar[int]
    STATES_FIELD_NUMBER: _ClassVar[int]
    STATE_FIELD_NUMBER: _ClassVar[int]
    bye: Bye
    control: Control
    control_ack: ControlAck
    device_report: DeviceReport
    field_brick: FieldBrick
    field_pose: FieldPose
    field_status: FieldStatus
    force: ForceCommand
    peer_report: PeerReport
    port_state: PortState
    report: LinkReport
    state: DeviceState
    states: DeviceStates
    def __init__(self, state: _Optional[_Union[DeviceState, _Mapping]] = ..., force: _Optional[_Union[ForceCommand, _Mapping]] = ..., control: _Optional[_Union[Control, _Mapping]] = ..., control_ack: _Optional[_Union[ControlAck, _Mapping]] = ..., bye: _Optional[_Union[Bye, _Mapping]] = ..., report: _Optional[_Union[LinkReport, _Mapping]] = ..., device_report: _Optional[_Union[DeviceReport, _Mapping]] = ..., peer_report: _Optional[_Union[PeerReport, _Mapping]] = ..., port_state: _Optional[_Union[PortState, _Mapping]] = ..., states: _Optional[_Union[DeviceStates, _Mapping]] = ..., field_brick: _Optional[_Union[FieldBrick, _Mapping]] = ..., field_status: _Optional[_Union[FieldStatus, _Mapping]] = ..., field_pose: _Optional[_Union[FieldPose, _Mapping]] = ...) -> None: ...

class GiveLease(_message.Message):
    __slots__ = ["channel", "device"]
    CHANNEL_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    channel: int
    device: int
    def __init__(self, device: _Optional[int] = ..., channel: _Optional[int] = ...) -> None: ...

class Grant(_message.Message):
    __slots__ = ["channel", "device", "role"]
    CHANNEL_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    ROLE_FIELD_NUMBER: _ClassVar[int]
    channel: int
    device: int
    role: Role
    def __init__(self, device: _Optional[int] = ..., channel: _Optional[int] = ..., role: _Optional[_Union[Role, str]] = ...) -> None: ...

class HandleDescription(_message.Message):
    __slots__ = ["buttons", "device", "gripper_open_rad", "group", "hand", "joints", "max_gripper_force_n", "max_torque_nm", "operator_from_device", "orientation_measured", "outputs"]
    BUTTONS_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    GRIPPER_OPEN_RAD_FIELD_NUMBER: _ClassVar[int]
    GROUP_FIELD_NUMBER: _ClassVar[int]
    HAND_FIELD_NUMBER: _ClassVar[int]
    JOINTS_FIELD_NUMBER: _ClassVar[int]
    MAX_GRIPPER_FORCE_N_FIELD_NUMBER: _ClassVar[int]
    MAX_TORQUE_NM_FIELD_NUMBER: _ClassVar[int]
    OPERATOR_FROM_DEVICE_FIELD_NUMBER: _ClassVar[int]
    ORIENTATION_MEASURED_FIELD_NUMBER: _ClassVar[int]
    OUTPUTS_FIELD_NUMBER: _ClassVar[int]
    buttons: _containers.RepeatedScalarFieldContainer[str]
    device: int
    gripper_open_rad: float
    group: str
    hand: Hand
    joints: _containers.RepeatedScalarFieldContainer[str]
    max_gripper_force_n: float
    max_torque_nm: float
    operator_from_device: Quat
    orientation_measured: bool
    outputs: _containers.RepeatedCompositeFieldContainer[OutputDescription]
    def __init__(self, device: _Optional[int] = ..., operator_from_device: _Optional[_Union[Quat, _Mapping]] = ..., buttons: _Optional[_Iterable[str]] = ..., orientation_measured: bool = ..., max_torque_nm: _Optional[float] = ..., gripper_open_rad: _Optional[float] = ..., max_gripper_force_n: _Optional[float] = ..., group: _Optional[str] = ..., hand: _Optional[_Union[Hand, str]] = ..., joints: _Optional[_Iterable[str]] = ..., outputs: _Optional[_Iterable[_Union[OutputDescription, _Mapping]]] = ...) -> None: ...

class Hello(_message.Message):
    __slots__ = ["claims", "features", "name", "role", "version_max", "version_min", "ways"]
    CLAIMS_FIELD_NUMBER: _ClassVar[int]
    FEATURES_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    ROLE_FIELD_NUMBER: _ClassVar[int]
    VERSION_MAX_FIELD_NUMBER: _ClassVar[int]
    VERSION_MIN_FIELD_NUMBER: _ClassVar[int]
    WAYS_FIELD_NUMBER: _ClassVar[int]
    claims: _containers.RepeatedCompositeFieldContainer[Claim]
    features: _containers.RepeatedScalarFieldContainer[str]
    name: str
    role: Role
    version_max: int
    version_min: int
    ways: _containers.RepeatedScalarFieldContainer[str]
    def __init__(self, version_min: _Optional[int] = ..., version_max: _Optional[int] = ..., role: _Optional[_Union[Role, str]] = ..., name: _Optional[str] = ..., features: _Optional[_Iterable[str]] = ..., claims: _Optional[_Iterable[_Union[Claim, _Mapping]]] = ..., ways: _Optional[_Iterable[str]] = ...) -> None: ...

class LeaseLost(_message.Message):
    __slots__ = ["channel", "device", "to"]
    CHANNEL_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    TO_FIELD_NUMBER: _ClassVar[int]
    channel: int
    device: int
    to: str
    def __init__(self, device: _Optional[int] = ..., channel: _Optional[int] = ..., to: _Optional[str] = ...) -> None: ...

class LinkReport(_message.Message):
    __slots__ = ["clock_drift_ppm", "clock_error_ns", "clock_offset_ns", "duplicated", "forces", "late_engine", "late_network", "late_server", "late_unknown", "longest_gap_ns", "lost", "number", "received", "refused_not_finite", "refused_old_sequence", "refused_out_of_bounds", "refused_unknown_tick", "reordered", "round_trip", "span_ns", "to_client", "to_server", "until_ns", "words", "worst_late_ns"]
    CLOCK_DRIFT_PPM_FIELD_NUMBER: _ClassVar[int]
    CLOCK_ERROR_NS_FIELD_NUMBER: _ClassVar[int]
    CLOCK_OFFSET_NS_FIELD_NUMBER: _ClassVar[int]
    DUPLICATED_FIELD_NUMBER: _ClassVar[int]
    FORCES_FIELD_NUMBER: _ClassVar[int]
    LATE_ENGINE_FIELD_NUMBER: _ClassVar[int]
    LATE_NETWORK_FIELD_NUMBER: _ClassVar[int]
    LATE_SERVER_FIELD_NUMBER: _ClassVar[int]
    LATE_UNKNOWN_FIELD_NUMBER: _ClassVar[int]
    LONGEST_GAP_NS_FIELD_NUMBER: _ClassVar[int]
    LOST_FIELD_NUMBER: _ClassVar[int]
    NUMBER_FIELD_NUMBER: _ClassVar[int]
    RECEIVED_FIELD_NUMBER: _ClassVar[int]
    REFUSED_NOT_FINITE_FIELD_NUMBER: _ClassVar[int]
    REFUSED_OLD_SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    REFUSED_OUT_OF_BOUNDS_FIELD_NUMBER: _ClassVar[int]
    REFUSED_UNKNOWN_TICK_FIELD_NUMBER: _ClassVar[int]
    REORDERED_FIELD_NUMBER: _ClassVar[int]
    ROUND_TRIP_FIELD_NUMBER: _ClassVar[int]
    SPAN_NS_FIELD_NUMBER: _ClassVar[int]
    TO_CLIENT_FIELD_NUMBER: _ClassVar[int]
    TO_SERVER_FIELD_NUMBER: _ClassVar[int]
    UNTIL_NS_FIELD_NUMBER: _ClassVar[int]
    WORDS_FIELD_NUMBER: _ClassVar[int]
    WORST_LATE_NS_FIELD_NUMBER: _ClassVar[int]
    clock_drift_ppm: float
    clock_error_ns: int
    clock_offset_ns: int
    duplicated: int
    forces: int
    late_engine: int
    late_network: int
    late_server: int
    late_unknown: int
    longest_gap_ns: int
    lost: int
    number: int
    received: int
    refused_not_finite: int
    refused_old_sequence: int
    refused_out_of_bounds: int
    refused_unknown_tick: int
    reordered: int
    round_trip: Delays
    span_ns: int
    to_client: Delays
    to_server: Delays
    until_ns: int
    words: str
    worst_late_ns: int
    def __init__(self, number: _Optional[int] = ..., until_ns: _Optional[int] = ..., span_ns: _Optional[int] = ..., forces: _Optional[int] = ..., late_server: _Optional[int] = ..., late_network: _Optional[int] = ..., late_engine: _Optional[int] = ..., worst_late_ns: _Optional[int] = ..., longest_gap_ns: _Optional[int] = ..., round_trip: _Optional[_Union[Delays, _Mapping]] = ..., to_server: _Optional[_Union[Delays, _Mapping]] = ..., to_client: _Optional[_Union[Delays, _Mapping]] = ..., clock_offset_ns: _Optional[int] = ..., clock_drift_ppm: _Optional[float] = ..., clock_error_ns: _Optional[int] = ..., received: _Optional[int] = ..., lost: _Optional[int] = ..., reordered: _Optional[int] = ..., duplicated: _Optional[int] = ..., words: _Optional[str] = ..., late_unknown: _Optional[int] = ..., refused_not_finite: _Optional[int] = ..., refused_out_of_bounds: _Optional[int] = ..., refused_unknown_tick: _Optional[int] = ..., refused_old_sequence: _Optional[int] = ...) -> None: ...

class LocalModel(_message.Message):
    __slots__ = ["at_m", "contact", "stiffness_npm", "valid_radius_m"]
    AT_M_FIELD_NUMBER: _ClassVar[int]
    CONTACT_FIELD_NUMBER: _ClassVar[int]
    STIFFNESS_NPM_FIELD_NUMBER: _ClassVar[int]
    VALID_RADIUS_M_FIELD_NUMBER: _ClassVar[int]
    at_m: Vec3
    contact: Contact
    stiffness_npm: _containers.RepeatedScalarFieldContainer[float]
    valid_radius_m: float
    def __init__(self, at_m: _Optional[_Union[Vec3, _Mapping]] = ..., stiffness_npm: _Optional[_Iterable[float]] = ..., valid_radius_m: _Optional[float] = ..., contact: _Optional[_Union[Contact, _Mapping]] = ...) -> None: ...

class OfferField(_message.Message):
    __slots__ = ["field", "offset", "part", "size"]
    FIELD_FIELD_NUMBER: _ClassVar[int]
    OFFSET_FIELD_NUMBER: _ClassVar[int]
    PART_FIELD_NUMBER: _ClassVar[int]
    SIZE_FIELD_NUMBER: _ClassVar[int]
    field: bytes
    offset: int
    part: bytes
    size: int
    def __init__(self, field: _Optional[bytes] = ..., size: _Optional[int] = ..., offset: _Optional[int] = ..., part: _Optional[bytes] = ...) -> None: ...

class OutputDescription(_message.Message):
    __slots__ = ["kind", "name"]
    KIND_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    kind: OutputKind
    name: str
    def __init__(self, name: _Optional[str] = ..., kind: _Optional[_Union[OutputKind, str]] = ...) -> None: ...

class PeerReport(_message.Message):
    __slots__ = ["channel", "device", "error_n", "forces_refused", "link", "name", "state_one_in", "way"]
    CHANNEL_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    ERROR_N_FIELD_NUMBER: _ClassVar[int]
    FORCES_REFUSED_FIELD_NUMBER: _ClassVar[int]
    LINK_FIELD_NUMBER: _ClassVar[int]
    NAME_FIELD_NUMBER: _ClassVar[int]
    STATE_ONE_IN_FIELD_NUMBER: _ClassVar[int]
    WAY_FIELD_NUMBER: _ClassVar[int]
    channel: int
    device: int
    error_n: float
    forces_refused: bool
    link: LinkReport
    name: str
    state_one_in: int
    way: str
    def __init__(self, device: _Optional[int] = ..., channel: _Optional[int] = ..., name: _Optional[str] = ..., state_one_in: _Optional[int] = ..., forces_refused: bool = ..., link: _Optional[_Union[LinkReport, _Mapping]] = ..., error_n: _Optional[float] = ..., way: _Optional[str] = ...) -> None: ...

class PortGrip(_message.Message):
    __slots__ = ["account_j", "force_n", "given_j", "need_j", "opening_m", "taken_j", "velocity_mps"]
    ACCOUNT_J_FIELD_NUMBER: _ClassVar[int]
    FORCE_N_FIELD_NUMBER: _ClassVar[int]
    GIVEN_J_FIELD_NUMBER: _ClassVar[int]
    NEED_J_FIELD_NUMBER: _ClassVar[int]
    OPENING_M_FIELD_NUMBER: _ClassVar[int]
    TAKEN_J_FIELD_NUMBER: _ClassVar[int]
    VELOCITY_MPS_FIELD_NUMBER: _ClassVar[int]
    account_j: float
    force_n: float
    given_j: float
    need_j: float
    opening_m: float
    taken_j: float
    velocity_mps: float
    def __init__(self, opening_m: _Optional[float] = ..., velocity_mps: _Optional[float] = ..., force_n: _Optional[float] = ..., account_j: _Optional[float] = ..., need_j: _Optional[float] = ..., given_j: _Optional[float] = ..., taken_j: _Optional[float] = ...) -> None: ...

class PortState(_message.Message):
    __slots__ = ["account_j", "answers", "answers_epoch", "buttons", "channel", "contact_force_n", "device", "energy_in_j", "engagement", "epoch", "force_n", "force_scale", "given_j", "grip", "need_j", "of_peer", "phase", "position_m", "position_scale", "round_trip_ns", "sequence", "share", "surface", "taken_j", "time_ns", "turn", "velocity_mps", "wave_energy_j", "wave_integral"]
    ACCOUNT_J_FIELD_NUMBER: _ClassVar[int]
    ANSWERS_EPOCH_FIELD_NUMBER: _ClassVar[int]
    ANSWERS_FIELD_NUMBER: _ClassVar[int]
    BUTTONS_FIELD_NUMBER: _ClassVar[int]
    CHANNEL_FIELD_NUMBER: _ClassVar[int]
    CONTACT_FORCE_N_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    ENERGY_IN_J_FIELD_NUMBER: _ClassVar[int]
    ENGAGEMENT_FIELD_NUMBER: _ClassVar[int]
    EPOCH_FIELD_NUMBER: _ClassVar[int]
    FORCE_N_FIELD_NUMBER: _ClassVar[int]
    FORCE_SCALE_FIELD_NUMBER: _ClassVar[int]
    GIVEN_J_FIELD_NUMBER: _ClassVar[int]
    GRIP_FIELD_NUMBER: _ClassVar[int]
    NEED_J_FIELD_NUMBER: _ClassVar[int]
    OF_PEER_FIELD_NUMBER: _ClassVar[int]
    PHASE_FIELD_NUMBER: _ClassVar[int]
    POSITION_M_FIELD_NUMBER: _ClassVar[int]
    POSITION_SCALE_FIELD_NUMBER: _ClassVar[int]
    ROUND_TRIP_NS_FIELD_NUMBER: _ClassVar[int]
    SEQUENCE_FIELD_NUMBER: _ClassVar[int]
    SHARE_FIELD_NUMBER: _ClassVar[int]
    SURFACE_FIELD_NUMBER: _ClassVar[int]
    TAKEN_J_FIELD_NUMBER: _ClassVar[int]
    TIME_NS_FIELD_NUMBER: _ClassVar[int]
    TURN_FIELD_NUMBER: _ClassVar[int]
    VELOCITY_MPS_FIELD_NUMBER: _ClassVar[int]
    WAVE_ENERGY_J_FIELD_NUMBER: _ClassVar[int]
    WAVE_INTEGRAL_FIELD_NUMBER: _ClassVar[int]
    account_j: float
    answers: int
    answers_epoch: int
    buttons: int
    channel: int
    contact_force_n: Vec3
    device: int
    energy_in_j: float
    engagement: int
    epoch: int
    force_n: Vec3
    force_scale: float
    given_j: float
    grip: PortGrip
    need_j: float
    of_peer: bool
    phase: PortPhase
    position_m: Vec3
    position_scale: float
    round_trip_ns: int
    sequence: int
    share: float
    surface: PortSurface
    taken_j: float
    time_ns: int
    turn: PortTurn
    velocity_mps: Vec3
    wave_energy_j: float
    wave_integral: Vec3
    def __init__(self, device: _Optional[int] = ..., channel: _Optional[int] = ..., epoch: _Optional[int] = ..., sequence: _Optional[int] = ..., answers_epoch: _Optional[int] = ..., answers: _Optional[int] = ..., time_ns: _Optional[int] = ..., round_trip_ns: _Optional[int] = ..., phase: _Optional[_Union[PortPhase, str]] = ..., engagement: _Optional[int] = ..., buttons: _Optional[int] = ..., position_m: _Optional[_Union[Vec3, _Mapping]] = ..., velocity_mps: _Optional[_Union[Vec3, _Mapping]] = ..., force_n: _Optional[_Union[Vec3, _Mapping]] = ..., contact_force_n: _Optional[_Union[Vec3, _Mapping]] = ..., account_j: _Optional[float] = ..., need_j: _Optional[float] = ..., given_j: _Optional[float] = ..., taken_j: _Optional[float] = ..., wave_integral: _Optional[_Union[Vec3, _Mapping]] = ..., wave_energy_j: _Optional[float] = ..., surface: _Optional[_Union[PortSurface, _Mapping]] = ..., turn: _Optional[_Union[PortTurn, _Mapping]] = ..., grip: _Optional[_Union[PortGrip, _Mapping]] = ..., energy_in_j: _Optional[float] = ..., share: _Optional[float] = ..., position_scale: _Optional[float] = ..., force_scale: _Optional[float] = ..., of_peer: bool = ...) -> None: ...

class PortSurface(_message.Message):
    __slots__ = ["normal", "offset_m", "stiffness_npm"]
    NORMAL_FIELD_NUMBER: _ClassVar[int]
    OFFSET_M_FIELD_NUMBER: _ClassVar[int]
    STIFFNESS_NPM_FIELD_NUMBER: _ClassVar[int]
    normal: Vec3
    offset_m: float
    stiffness_npm: float
    def __init__(self, normal: _Optional[_Union[Vec3, _Mapping]] = ..., offset_m: _Optional[float] = ..., stiffness_npm: _Optional[float] = ...) -> None: ...

class PortTurn(_message.Message):
    __slots__ = ["angular_velocity_radps", "torque_nm", "turn"]
    ANGULAR_VELOCITY_RADPS_FIELD_NUMBER: _ClassVar[int]
    TORQUE_NM_FIELD_NUMBER: _ClassVar[int]
    TURN_FIELD_NUMBER: _ClassVar[int]
    angular_velocity_radps: Vec3
    torque_nm: Vec3
    turn: Quat
    def __init__(self, turn: _Optional[_Union[Quat, _Mapping]] = ..., angular_velocity_radps: _Optional[_Union[Vec3, _Mapping]] = ..., torque_nm: _Optional[_Union[Vec3, _Mapping]] = ...) -> None: ...

class Quat(_message.Message):
    __slots__ = ["w", "x", "y", "z"]
    W_FIELD_NUMBER: _ClassVar[int]
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    Z_FIELD_NUMBER: _ClassVar[int]
    w: float
    x: float
    y: float
    z: float
    def __init__(self, w: _Optional[float] = ..., x: _Optional[float] = ..., y: _Optional[float] = ..., z: _Optional[float] = ...) -> None: ...

class RateControl(_message.Message):
    __slots__ = ["dead_zone_m", "gain_per_s", "max_speed_mps"]
    DEAD_ZONE_M_FIELD_NUMBER: _ClassVar[int]
    GAIN_PER_S_FIELD_NUMBER: _ClassVar[int]
    MAX_SPEED_MPS_FIELD_NUMBER: _ClassVar[int]
    dead_zone_m: float
    gain_per_s: float
    max_speed_mps: float
    def __init__(self, dead_zone_m: _Optional[float] = ..., gain_per_s: _Optional[float] = ..., max_speed_mps: _Optional[float] = ...) -> None: ...

class Rearm(_message.Message):
    __slots__ = ["device"]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    device: int
    def __init__(self, device: _Optional[int] = ...) -> None: ...

class Refused(_message.Message):
    __slots__ = ["code", "detail", "version_max", "version_min"]
    CODE_FIELD_NUMBER: _ClassVar[int]
    DETAIL_FIELD_NUMBER: _ClassVar[int]
    VERSION_MAX_FIELD_NUMBER: _ClassVar[int]
    VERSION_MIN_FIELD_NUMBER: _ClassVar[int]
    code: Code
    detail: str
    version_max: int
    version_min: int
    def __init__(self, code: _Optional[_Union[Code, str]] = ..., detail: _Optional[str] = ..., version_min: _Optional[int] = ..., version_max: _Optional[int] = ...) -> None: ...

class RotationModel(_message.Message):
    __slots__ = ["angular_stiffness_nmprad", "at_orientation"]
    ANGULAR_STIFFNESS_NMPRAD_FIELD_NUMBER: _ClassVar[int]
    AT_ORIENTATION_FIELD_NUMBER: _ClassVar[int]
    angular_stiffness_nmprad: _containers.RepeatedScalarFieldContainer[float]
    at_orientation: Quat
    def __init__(self, at_orientation: _Optional[_Union[Quat, _Mapping]] = ..., angular_stiffness_nmprad: _Optional[_Iterable[float]] = ...) -> None: ...

class SetOutput(_message.Message):
    __slots__ = ["device", "output", "rgb", "vibration"]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    OUTPUT_FIELD_NUMBER: _ClassVar[int]
    RGB_FIELD_NUMBER: _ClassVar[int]
    VIBRATION_FIELD_NUMBER: _ClassVar[int]
    device: int
    output: int
    rgb: int
    vibration: Vibration
    def __init__(self, device: _Optional[int] = ..., output: _Optional[int] = ..., rgb: _Optional[int] = ..., vibration: _Optional[_Union[Vibration, _Mapping]] = ...) -> None: ...

class SetScale(_message.Message):
    __slots__ = ["device", "force_scale", "position_scale"]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    FORCE_SCALE_FIELD_NUMBER: _ClassVar[int]
    POSITION_SCALE_FIELD_NUMBER: _ClassVar[int]
    device: int
    force_scale: float
    position_scale: float
    def __init__(self, device: _Optional[int] = ..., position_scale: _Optional[float] = ..., force_scale: _Optional[float] = ...) -> None: ...

class SetShare(_message.Message):
    __slots__ = ["channel", "device", "share"]
    CHANNEL_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    SHARE_FIELD_NUMBER: _ClassVar[int]
    channel: int
    device: int
    share: float
    def __init__(self, device: _Optional[int] = ..., channel: _Optional[int] = ..., share: _Optional[float] = ...) -> None: ...

class SetStateDeadband(_message.Message):
    __slots__ = ["floor_mps", "max_silence_us", "share"]
    FLOOR_MPS_FIELD_NUMBER: _ClassVar[int]
    MAX_SILENCE_US_FIELD_NUMBER: _ClassVar[int]
    SHARE_FIELD_NUMBER: _ClassVar[int]
    floor_mps: float
    max_silence_us: int
    share: float
    def __init__(self, share: _Optional[float] = ..., floor_mps: _Optional[float] = ..., max_silence_us: _Optional[int] = ...) -> None: ...

class SetStateRate(_message.Message):
    __slots__ = ["device", "hz"]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    HZ_FIELD_NUMBER: _ClassVar[int]
    device: int
    hz: int
    def __init__(self, hz: _Optional[int] = ..., device: _Optional[int] = ...) -> None: ...

class TakeLease(_message.Message):
    __slots__ = ["channel", "device"]
    CHANNEL_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    channel: int
    device: int
    def __init__(self, device: _Optional[int] = ..., channel: _Optional[int] = ...) -> None: ...

class UseField(_message.Message):
    __slots__ = ["channel", "device", "field", "fixtures", "generation", "materials", "tables"]
    CHANNEL_FIELD_NUMBER: _ClassVar[int]
    DEVICE_FIELD_NUMBER: _ClassVar[int]
    FIELD_FIELD_NUMBER: _ClassVar[int]
    FIXTURES_FIELD_NUMBER: _ClassVar[int]
    GENERATION_FIELD_NUMBER: _ClassVar[int]
    MATERIALS_FIELD_NUMBER: _ClassVar[int]
    TABLES_FIELD_NUMBER: _ClassVar[int]
    channel: int
    device: int
    field: bytes
    fixtures: _containers.RepeatedCompositeFieldContainer[FieldFixture]
    generation: int
    materials: _containers.RepeatedCompositeFieldContainer[FieldMaterial]
    tables: _containers.RepeatedCompositeFieldContainer[FieldDepthTable]
    def __init__(self, device: _Optional[int] = ..., channel: _Optional[int] = ..., generation: _Optional[int] = ..., field: _Optional[bytes] = ..., materials: _Optional[_Iterable[_Union[FieldMaterial, _Mapping]]] = ..., fixtures: _Optional[_Iterable[_Union[FieldFixture, _Mapping]]] = ..., tables: _Optional[_Iterable[_Union[FieldDepthTable, _Mapping]]] = ...) -> None: ...

class Vec3(_message.Message):
    __slots__ = ["x", "y", "z"]
    X_FIELD_NUMBER: _ClassVar[int]
    Y_FIELD_NUMBER: _ClassVar[int]
    Z_FIELD_NUMBER: _ClassVar[int]
    x: float
    y: float
    z: float
    def __init__(self, x: _Optional[float] = ..., y: _Optional[float] = ..., z: _Optional[float] = ...) -> None: ...

class Vibration(_message.Message):
    __slots__ = ["amplitude", "duration_ms", "frequency_hz"]
    AMPLITUDE_FIELD_NUMBER: _ClassVar[int]
    DURATION_MS_FIELD_NUMBER: _ClassVar[int]
    FREQUENCY_HZ_FIELD_NUMBER: _ClassVar[int]
    amplitude: float
    duration_ms: int
    frequency_hz: float
    def __init__(self, amplitude: _Optional[float] = ..., frequency_hz: _Optional[float] = ..., duration_ms: _Optional[int] = ...) -> None: ...

class Welcome(_message.Message):
    __slots__ = ["device_name", "features", "grants", "loop_hz", "max_force_n", "position_resolution_m", "role", "server", "timeout_ms", "version"]
    DEVICE_NAME_FIELD_NUMBER: _ClassVar[int]
    FEATURES_FIELD_NUMBER: _ClassVar[int]
    GRANTS_FIELD_NUMBER: _ClassVar[int]
    LOOP_HZ_FIELD_NUMBER: _ClassVar[int]
    MAX_FORCE_N_FIELD_NUMBER: _ClassVar[int]
    POSITION_RESOLUTION_M_FIELD_NUMBER: _ClassVar[int]
    ROLE_FIELD_NUMBER: _ClassVar[int]
    SERVER_FIELD_NUMBER: _ClassVar[int]
    TIMEOUT_MS_FIELD_NUMBER: _ClassVar[int]
    VERSION_FIELD_NUMBER: _ClassVar[int]
    device_name: str
    features: _containers.RepeatedScalarFieldContainer[str]
    grants: _containers.RepeatedCompositeFieldContainer[Grant]
    loop_hz: int
    max_force_n: float
    position_resolution_m: float
    role: Role
    server: str
    timeout_ms: int
    version: int
    def __init__(self, version: _Optional[int] = ..., features: _Optional[_Iterable[str]] = ..., role: _Optional[_Union[Role, str]] = ..., device_name: _Optional[str] = ..., max_force_n: _Optional[float] = ..., position_resolution_m: _Optional[float] = ..., loop_hz: _Optional[int] = ..., timeout_ms: _Optional[int] = ..., server: _Optional[str] = ..., grants: _Optional[_Iterable[_Union[Grant, _Mapping]]] = ...) -> None: ...

class Mode(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class FieldFixtureKind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class PortRole(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class CouplingMethod(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class OutputKind(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class Hand(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class ChannelRule(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class PortPhase(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class Safety(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class Code(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class Role(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []
