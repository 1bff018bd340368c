// SPDX-License-Identifier: Apache-2.0
// Generated from protocol/wire/tendon.proto by protocol/generate. Do not edit.
namespace Tendon {
  /// <summary>How the device renders the remote force.</summary>
  public enum Mode {
    /// <summary>No force has arrived since the start or the last safe stop</summary>
    Idle = 1,
    /// <summary>A fresh force is rendered</summary>
    Active = 2,
    /// <summary>The force is older than its validity and is still held</summary>
    Holding = 3,
    /// <summary>The old force fades</summary>
    Decaying = 4,
    /// <summary>The force is zero until a fresh force arrives</summary>
    SafeStop = 5,
    /// <summary>Latched: the force is zero until a Rearm</summary>
    Fault = 6,
  }

  /// <summary>The role of an end in a coupling.</summary>
  public enum PortRole {
    Leader = 1,
    Follower = 2,
  }

  /// <summary>How two handles are coupled.</summary>
  public enum CouplingMethod {
    /// <summary>Springs and dampers between the handles at both ends</summary>
    PositionPosition = 1,
    /// <summary>The follower is pulled by a spring, and the leader feels the contact force that is measured by the
    /// follower</summary>
    PositionForce = 2,
    /// <summary>Wave variables with a playout buffer</summary>
    Waves = 3,
    /// <summary>The follower is pulled by a spring, and the leader feels a model of the surface that was found by the
    /// follower</summary>
    Surface = 4,
    /// <summary>The velocity is sent to the follower and the force to the leader, and each end pays with the energy
    /// that was received by the other end</summary>
    Passivity = 5,
    /// <summary>Springs to delayed positions, which are only stretched as far as the energy account allows</summary>
    SetPosition = 6,
    /// <summary>The position of the leader commands the velocity of the follower</summary>
    Rate = 7,
  }

  /// <summary>The kind of an output.</summary>
  public enum OutputKind {
    Lamp = 1,
    /// <summary>A separate vibrator that is not one of the motors of the axes</summary>
    Vibration = 2,
  }

  /// <summary>The hand that is used for holding a device.</summary>
  public enum Hand {
    Any = 0,
    Left = 1,
    Right = 2,
  }

  /// <summary>Describes how the forces of the channels of a device are combined. The result is the sum of the forces of
  /// all sum channels and of the first fresh force of the priority channels, in the order of their numbers.</summary>
  public enum ChannelRule {
    /// <summary>The force is added to the others</summary>
    Sum = 1,
    /// <summary>Later channels with this rule are silent while the force is fresh</summary>
    Priority = 2,
  }

  /// <summary>The phase of an end of a coupling.</summary>
  public enum PortPhase {
    /// <summary>No peer</summary>
    Alone = 1,
    /// <summary>Connected to the peer, but the operator has not engaged the coupling yet; no force</summary>
    Coupled = 2,
    /// <summary>Absolute maps: the leader is moved to the position of the follower</summary>
    Aligning = 3,
    /// <summary>The handles are coupled</summary>
    Engaged = 4,
    /// <summary>The leader is free, the follower holds its position</summary>
    Clutched = 5,
    /// <summary>The peer fell silent during an engagement and the coupling must be engaged again</summary>
    Lost = 6,
    /// <summary>The device exerts no force</summary>
    Fault = 7,
  }

  /// <summary>The state of a device and its safety layer.</summary>
  public enum Safety {
    /// <summary>Not plugged in</summary>
    Absent = 1,
    /// <summary>Being opened</summary>
    Opening = 2,
    /// <summary>Has no firmware yet, or is receiving it</summary>
    Firmware = 3,
    /// <summary>Does not know its position yet</summary>
    Unhomed = 4,
    /// <summary>Ready, but must be armed first</summary>
    Homed = 5,
    /// <summary>Exerts forces</summary>
    Armed = 6,
    /// <summary>Disarmed because of a fault, and must be armed again</summary>
    Fault = 7,
    /// <summary>Ready, and there is no safety layer that can be armed</summary>
    Unguarded = 8,
  }

  /// <summary>Explains why a request was refused or a session was closed.</summary>
  public enum Code {
    Ok = 1,
    /// <summary>A value is out of bounds or does not make sense</summary>
    Invalid = 2,
    /// <summary>The request is not known or there is no common version</summary>
    Unsupported = 3,
    /// <summary>Used by another client, such as another controller</summary>
    Busy = 4,
    /// <summary>Not with this role</summary>
    Denied = 5,
    /// <summary>The server is shutting down</summary>
    Shutdown = 6,
    /// <summary>Nothing was received until the timeout</summary>
    TimedOut = 7,
    /// <summary>The session of suite 1 or 2 is too old, and the handshake must be repeated</summary>
    Expired = 8,
    /// <summary>Replaced by another program with the same key; the client must not reconnect automatically</summary>
    Replaced = 9,
  }

  /// <summary>The role of a client. Observers receive states, and controllers also send forces.</summary>
  public enum Role {
    /// <summary>Receives device states</summary>
    Observer = 1,
    /// <summary>Also sends forces; one per channel</summary>
    Controller = 2,
  }
}
