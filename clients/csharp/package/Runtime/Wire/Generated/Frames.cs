// SPDX-License-Identifier: Apache-2.0
// Generated from protocol/wire/tendon.proto by protocol/generate. Do not edit.
using System.Collections.Generic;

namespace Tendon {
  /// <summary>Acknowledges a datagram of the peer and measures the round trip: with T3 = TxTimeNs of the datagram that
  /// carries the echo and T4 = the time at which that datagram arrives, the round trip is (T4 − T1) − (T3 −
  /// T2).</summary>
  public sealed class Echo {
    /// <summary>T1: the TxTimeNs of that datagram, on the clock of the peer</summary>
    public long PeerTxTimeNs;
    /// <summary>T2: the time at which that datagram arrived, on the clock of the sender of the echo; T2 ≤ T3</summary>
    public long RxTimeNs;
    /// <summary>Packet number of that datagram</summary>
    public ulong PacketNumber;
    /// <summary>Bit i is set if the packet PacketNumber − 1 − i has also arrived. Malformed packets only count as
    /// arrived in suites 1 and 2</summary>
    public uint ReceivedMask;

    public void Clear() {
      PeerTxTimeNs = 0;
      RxTimeNs = 0;
      PacketNumber = 0;
      ReceivedMask = 0;
    }

    public void CopyFrom(Echo other) {
      PeerTxTimeNs = other.PeerTxTimeNs;
      RxTimeNs = other.RxTimeNs;
      PacketNumber = other.PacketNumber;
      ReceivedMask = other.ReceivedMask;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (PeerTxTimeNs < -Bounds.Time || PeerTxTimeNs > Bounds.Time) return "peer_tx_time_ns";
      if (RxTimeNs < -Bounds.Time || RxTimeNs > Bounds.Time) return "rx_time_ns";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 9:
            PeerTxTimeNs = r.Fixed64();
            break;
          case 17:
            RxTimeNs = r.Fixed64();
            break;
          case 24:
            PacketNumber = r.UInt64();
            break;
          case 37:
            ReceivedMask = r.Fixed32();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.Fixed64(9, PeerTxTimeNs);
      w.Fixed64(17, RxTimeNs);
      w.UInt64(24, PacketNumber);
      w.Fixed32(37, ReceivedMask);
    }
  }

  /// <summary>One of these messages. `control` and `control_ack` are reliable (SESSION.md). All others but `bye` are
  /// sent once, and only the newest one counts.</summary>
  public sealed class Frame {
    /// <summary>The member that is present.</summary>
    public enum BodyCase {
      None = 0,
      State = 1,
      Force = 2,
      Control = 3,
      ControlAck = 4,
      Bye = 5,
      Report = 6,
      DeviceReport = 7,
      PeerReport = 8,
      PortState = 9,
    }

    public BodyCase Body;
    /// <summary>Server → client, unreliable; for each device the highest tick wins</summary>
    public readonly DeviceState State = new DeviceState();
    /// <summary>Client → server, unreliable; for each device and channel the highest sequence wins</summary>
    public readonly ForceCommand Force = new ForceCommand();
    /// <summary>Either way, reliable, in order</summary>
    public readonly Control Control = new Control();
    /// <summary>The answer to a Control</summary>
    public readonly ControlAck ControlAck = new ControlAck();
    /// <summary>Either way, sent three times</summary>
    public readonly Bye Bye = new Bye();
    /// <summary>Server → client, unreliable; the highest number wins</summary>
    public readonly LinkReport Report = new LinkReport();
    /// <summary>Server → client, unreliable, to an observer with the feature "diagnostics" only; for each device the
    /// highest number wins</summary>
    public readonly DeviceReport DeviceReport = new DeviceReport();
    /// <summary>Server → client, unreliable, to an observer with the feature "diagnostics" only; for each device and
    /// channel the highest number of its link wins</summary>
    public readonly PeerReport PeerReport = new PeerReport();
    /// <summary>Either way, unreliable, with the feature "teleoperation" only; for each device, channel and end the
    /// highest sequence of the highest epoch wins. An observer of the device is sent both ends of its
    /// coupling</summary>
    public readonly PortState PortState = new PortState();

    public void Clear() {
      Body = BodyCase.None;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      string state = Body == BodyCase.State ? State.Objection() : null;
      if (state != null) return "state." + state;
      string force = Body == BodyCase.Force ? Force.Objection() : null;
      if (force != null) return "force." + force;
      string control = Body == BodyCase.Control ? Control.Objection() : null;
      if (control != null) return "control." + control;
      string controlAck = Body == BodyCase.ControlAck ? ControlAck.Objection() : null;
      if (controlAck != null) return "control_ack." + controlAck;
      string bye = Body == BodyCase.Bye ? Bye.Objection() : null;
      if (bye != null) return "bye." + bye;
      string report = Body == BodyCase.Report ? Report.Objection() : null;
      if (report != null) return "report." + report;
      string deviceReport = Body == BodyCase.DeviceReport ? DeviceReport.Objection() : null;
      if (deviceReport != null) return "device_report." + deviceReport;
      string peerReport = Body == BodyCase.PeerReport ? PeerReport.Objection() : null;
      if (peerReport != null) return "peer_report." + peerReport;
      string portState = Body == BodyCase.PortState ? PortState.Objection() : null;
      if (portState != null) return "port_state." + portState;
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 10:
            if (Body != BodyCase.State) State.Clear();
            Body = BodyCase.State;
            {
              int end = r.Enter();
              State.Read(ref r);
              r.Leave(end);
            }
            break;
          case 18:
            if (Body != BodyCase.Force) Force.Clear();
            Body = BodyCase.Force;
            {
              int end = r.Enter();
              Force.Read(ref r);
              r.Leave(end);
            }
            break;
          case 26:
            if (Body != BodyCase.Control) Control.Clear();
            Body = BodyCase.Control;
            {
              int end = r.Enter();
              Control.Read(ref r);
              r.Leave(end);
            }
            break;
          case 34:
            if (Body != BodyCase.ControlAck) ControlAck.Clear();
            Body = BodyCase.ControlAck;
            {
              int end = r.Enter();
              ControlAck.Read(ref r);
              r.Leave(end);
            }
            break;
          case 42:
            if (Body != BodyCase.Bye) Bye.Clear();
            Body = BodyCase.Bye;
            {
              int end = r.Enter();
              Bye.Read(ref r);
              r.Leave(end);
            }
            break;
          case 50:
            if (Body != BodyCase.Report) Report.Clear();
            Body = BodyCase.Report;
            {
              int end = r.Enter();
              Report.Read(ref r);
              r.Leave(end);
            }
            break;
          case 58:
            if (Body != BodyCase.DeviceReport) DeviceReport.Clear();
            Body = BodyCase.DeviceReport;
            {
              int end = r.Enter();
              DeviceReport.Read(ref r);
              r.Leave(end);
            }
            break;
          case 66:
            if (Body != BodyCase.PeerReport) PeerReport.Clear();
            Body = BodyCase.PeerReport;
            {
              int end = r.Enter();
              PeerReport.Read(ref r);
              r.Leave(end);
            }
            break;
          case 74:
            if (Body != BodyCase.PortState) PortState.Clear();
            Body = BodyCase.PortState;
            {
              int end = r.Enter();
              PortState.Read(ref r);
              r.Leave(end);
            }
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      if (Body == BodyCase.State) {
        int begin = w.Begin(10);
        State.Write(ref w);
        w.End(begin);
      }
      if (Body == BodyCase.Force) {
        int begin = w.Begin(18);
        Force.Write(ref w);
        w.End(begin);
      }
      if (Body == BodyCase.Control) {
        int begin = w.Begin(26);
        Control.Write(ref w);
        w.End(begin);
      }
      if (Body == BodyCase.ControlAck) {
        int begin = w.Begin(34);
        ControlAck.Write(ref w);
        w.End(begin);
      }
      if (Body == BodyCase.Bye) {
        int begin = w.Begin(42);
        Bye.Write(ref w);
        w.End(begin);
      }
      if (Body == BodyCase.Report) {
        int begin = w.Begin(50);
        Report.Write(ref w);
        w.End(begin);
      }
      if (Body == BodyCase.DeviceReport) {
        int begin = w.Begin(58);
        DeviceReport.Write(ref w);
        w.End(begin);
      }
      if (Body == BodyCase.PeerReport) {
        int begin = w.Begin(66);
        PeerReport.Write(ref w);
        w.End(begin);
      }
      if (Body == BodyCase.PortState) {
        int begin = w.Begin(74);
        PortState.Write(ref w);
        w.End(begin);
      }
    }
  }

  /// <summary>The state of a device at one haptic step. Server → client, unreliable; for each device the highest tick
  /// wins.</summary>
  public sealed class DeviceState {
    /// <summary>Number of the haptic step</summary>
    public ulong Tick;
    /// <summary>The time at which the position was sampled, on the clock of the server</summary>
    public long SampledNs;
    /// <summary>M</summary>
    public Vec3 Position;
    /// <summary>M/s</summary>
    public Vec3 Velocity;
    /// <summary>N, the actual force on the hand from this step on</summary>
    public Vec3 ForceApplied;
    /// <summary>J, the energy that the device may still output, according to the energy ledger</summary>
    public double Energy;
    /// <summary>N. The limiter's bound on the norm of the force, or +infinity if there is none</summary>
    public double PermittedForce;
    /// <summary>The reasons why the actual force differs from the requested one (bits of core/base/reason.h)</summary>
    public uint Reasons;
    /// <summary>The sequence of the ForceCommand that is rendered, or 0</summary>
    public ulong ForceSequence;
    /// <summary>The time since this ForceCommand has arrived</summary>
    public ulong ForceAgeNs;
    public Mode Mode;
    public uint Device;
    /// <summary>The channel of the force that is described by ForceSequence, ForceAgeNs and mode. This is the freshest
    /// one. If several are equally fresh, it is the one with the lowest number</summary>
    public uint Channel;
    // With the feature "diagnostics" only:
    /// <summary>N. The force on the hand that is requested by the engines at this step, before it is limited. It may be
    /// held, faded, or extrapolated using their models. Null if it is not reported</summary>
    public Vec3? ForceWanted;
    // With the feature "handle" only:
    /// <summary>The rotation from the handle frame to the device base frame. If the handle is in its middle position,
    /// the stylus or finger points along the −z axis of the handle frame, y is up, and x is to the right. Null if it is
    /// not measured</summary>
    public Quat? Orientation;
    /// <summary>Rad/s. The angular velocity in the axes of the base frame. It is ignored if there is no
    /// orientation</summary>
    public Vec3 AngularVelocity;
    /// <summary>Bit i is set if button i is pressed, or if it was pressed since the previous state</summary>
    public uint Buttons;
    /// <summary>N·m. The actual torque on the hand about Position from this step on, in the axes of the base frame.
    /// Null if the device cannot exert torques</summary>
    public Vec3? TorqueApplied;
    /// <summary>Rad. The opening of the gripper, which is 0 if it is closed. Null if there is no gripper</summary>
    public double? Gripper;
    /// <summary>Rad/s. The velocity of the opening. It is ignored if there is no Gripper</summary>
    public double? GripperVelocity;
    /// <summary>N. The actual force on the fingers from this step on. Positive values open them. Null if the gripper
    /// has no motor</summary>
    public double? GripApplied;
    /// <summary>N. The force of the hand ON THE HANDLE, as measured by a force sensor. Null if there is no force
    /// sensor</summary>
    public Vec3? HandForce;
    // With the feature "joints" only:
    /// <summary>Rad. The angles of the joints that carry the handle, in the order of
    /// HandleDescription.Joints.</summary>
    public readonly Reals Joint = new Reals(8);
    /// <summary>Rad/s. The velocities of these joints. Missing entries are 0, and entries without an angle are
    /// ignored</summary>
    public readonly Reals JointVelocity = new Reals(8);
    // With the feature "diagnostics" only:
    /// <summary>N/m, −∂ForceWanted/∂Position according to the models of the engines at this step, with the entries of
    /// LocalModel.Stiffness. Absent if there is no model</summary>
    public readonly Reals StiffnessWanted = new Reals(9);
    // With the feature "fields" only:
    /// <summary>The generation of the rendered field (UseField.Generation). If several channels use fields, this is the
    /// first one with contact, or else the first one.</summary>
    public uint Field;
    /// <summary>M, the distance from the proxy to the hand, or 0 if there is no contact</summary>
    public double FieldDepth;
    /// <summary>M, the position of the proxy, which is ignored if there is no field</summary>
    public Vec3 FieldProxy;
    /// <summary>The session in which it was received. It is copied, but not on the wire.</summary>
    internal object Session;

    public void Clear() {
      Tick = 0;
      SampledNs = 0;
      Position = default(Vec3);
      Velocity = default(Vec3);
      ForceApplied = default(Vec3);
      Energy = 0;
      PermittedForce = 0;
      Reasons = 0;
      ForceSequence = 0;
      ForceAgeNs = 0;
      Mode = default(Mode);
      Device = 0;
      Channel = 0;
      ForceWanted = null;
      Orientation = null;
      AngularVelocity = default(Vec3);
      Buttons = 0;
      TorqueApplied = null;
      Gripper = null;
      GripperVelocity = null;
      GripApplied = null;
      HandForce = null;
      Joint.Clear();
      JointVelocity.Clear();
      StiffnessWanted.Clear();
      Field = 0;
      FieldDepth = 0;
      FieldProxy = default(Vec3);
      Session = null;
    }

    public void CopyFrom(DeviceState other) {
      Tick = other.Tick;
      SampledNs = other.SampledNs;
      Position = other.Position;
      Velocity = other.Velocity;
      ForceApplied = other.ForceApplied;
      Energy = other.Energy;
      PermittedForce = other.PermittedForce;
      Reasons = other.Reasons;
      ForceSequence = other.ForceSequence;
      ForceAgeNs = other.ForceAgeNs;
      Mode = other.Mode;
      Device = other.Device;
      Channel = other.Channel;
      ForceWanted = other.ForceWanted;
      Orientation = other.Orientation;
      AngularVelocity = other.AngularVelocity;
      Buttons = other.Buttons;
      TorqueApplied = other.TorqueApplied;
      Gripper = other.Gripper;
      GripperVelocity = other.GripperVelocity;
      GripApplied = other.GripApplied;
      HandForce = other.HandForce;
      Joint.CopyFrom(other.Joint);
      JointVelocity.CopyFrom(other.JointVelocity);
      StiffnessWanted.CopyFrom(other.StiffnessWanted);
      Field = other.Field;
      FieldDepth = other.FieldDepth;
      FieldProxy = other.FieldProxy;
      Session = other.Session;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (SampledNs < -Bounds.Time || SampledNs > Bounds.Time) return "sampled_ns";
      if (!Bounds.IsVec3(Position)) return "position_m";
      if (!Bounds.IsVec3(Velocity)) return "velocity_mps";
      if (!Bounds.IsVec3(ForceApplied)) return "force_applied_n";
      if (!(Energy >= -1e12 && Energy <= 1e12)) return "energy_j";
      if (PermittedForce != double.PositiveInfinity && !(PermittedForce >= 0 && PermittedForce <= 1e12)) return "permitted_force_n";
      if (ForceAgeNs > Bounds.Time) return "force_age_ns";
      if ((int)Mode < 1 || (int)Mode > 6) return "mode";
      if (Device > 15) return "device";
      if (Channel > 7) return "channel";
      if (!Bounds.IsVec3(ForceWanted ?? default(Vec3))) return "force_wanted_n";
      if (Orientation.HasValue && !Bounds.IsRotation(Orientation.Value)) return "orientation";
      if (!Bounds.IsVec3(AngularVelocity)) return "angular_velocity_radps";
      if (!Bounds.IsVec3(TorqueApplied ?? default(Vec3))) return "torque_applied_nm";
      if (Gripper.HasValue && !(Gripper.Value >= -1e12 && Gripper.Value <= 1e12)) return "gripper_rad";
      if (GripperVelocity.HasValue && !(GripperVelocity.Value >= -1e12 && GripperVelocity.Value <= 1e12)) return "gripper_velocity_radps";
      if (GripApplied.HasValue && !(GripApplied.Value >= -1e12 && GripApplied.Value <= 1e12)) return "gripper_force_applied_n";
      if (!Bounds.IsVec3(HandForce ?? default(Vec3))) return "hand_force_n";
      if (!Bounds.AreNumbers(Joint, 0, 8, -1e12, 1e12)) return "joint_rad";
      if (!Bounds.AreNumbers(JointVelocity, 0, 8, -1e12, 1e12)) return "joint_velocity_radps";
      if (StiffnessWanted.Count > 0 && !Bounds.IsMatrix(StiffnessWanted)) return "stiffness_wanted_npm";
      if (!(FieldDepth >= 0 && FieldDepth <= 1e12)) return "field_depth_m";
      if (!Bounds.IsVec3(FieldProxy)) return "field_proxy_m";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Tick = r.UInt64();
            break;
          case 17:
            SampledNs = r.Fixed64();
            break;
          case 26:
            Position = r.Vec3(Position);
            break;
          case 34:
            Velocity = r.Vec3(Velocity);
            break;
          case 42:
            ForceApplied = r.Vec3(ForceApplied);
            break;
          case 49:
            Energy = r.Double();
            break;
          case 57:
            PermittedForce = r.Double();
            break;
          case 69:
            Reasons = r.Fixed32();
            break;
          case 72:
            ForceSequence = r.UInt64();
            break;
          case 80:
            ForceAgeNs = r.UInt64();
            break;
          case 88:
            Mode = (Mode)(int)r.UInt32();
            break;
          case 96:
            Device = r.UInt32();
            break;
          case 104:
            Channel = r.UInt32();
            break;
          case 114:
            ForceWanted = r.Vec3(ForceWanted ?? default(Vec3));
            break;
          case 122:
            Orientation = r.Quat(Orientation ?? default(Quat));
            break;
          case 130:
            AngularVelocity = r.Vec3(AngularVelocity);
            break;
          case 141:
            Buttons = r.Fixed32();
            break;
          case 146:
            TorqueApplied = r.Vec3(TorqueApplied ?? default(Vec3));
            break;
          case 153:
            Gripper = r.Double();
            break;
          case 161:
            GripperVelocity = r.Double();
            break;
          case 169:
            GripApplied = r.Double();
            break;
          case 178:
            HandForce = r.Vec3(HandForce ?? default(Vec3));
            break;
          case 186:
          case 185:
            r.Read(Joint);
            break;
          case 194:
          case 193:
            r.Read(JointVelocity);
            break;
          case 202:
          case 201:
            r.Read(StiffnessWanted);
            break;
          case 208:
            Field = r.UInt32();
            break;
          case 217:
            FieldDepth = r.Double();
            break;
          case 226:
            FieldProxy = r.Vec3(FieldProxy);
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt64(8, Tick);
      w.Fixed64(17, SampledNs);
      w.Vec3(26, Position);
      w.Vec3(34, Velocity);
      w.Vec3(42, ForceApplied);
      w.Double(49, Energy);
      w.Double(57, PermittedForce);
      w.Fixed32(69, Reasons);
      w.UInt64(72, ForceSequence);
      w.UInt64(80, ForceAgeNs);
      w.UInt32(88, (uint)Mode);
      w.UInt32(96, Device);
      w.UInt32(104, Channel);
      if (ForceWanted.HasValue) w.PresentVec3(114, ForceWanted.Value);
      if (Orientation.HasValue) w.PresentQuat(122, Orientation.Value);
      w.Vec3(130, AngularVelocity);
      w.Fixed32(141, Buttons);
      if (TorqueApplied.HasValue) w.PresentVec3(146, TorqueApplied.Value);
      if (Gripper.HasValue) w.PresentDouble(153, Gripper.Value);
      if (GripperVelocity.HasValue) w.PresentDouble(161, GripperVelocity.Value);
      if (GripApplied.HasValue) w.PresentDouble(169, GripApplied.Value);
      if (HandForce.HasValue) w.PresentVec3(178, HandForce.Value);
      w.Write(186, Joint);
      w.Write(194, JointVelocity);
      w.Write(202, StiffnessWanted);
      w.UInt32(208, Field);
      w.Double(217, FieldDepth);
      w.Vec3(226, FieldProxy);
    }
  }

  /// <summary>The force that is requested by a physics engine in response to a state. Client → server, unreliable; for
  /// each device and channel the highest sequence wins.</summary>
  public sealed class ForceCommand {
    /// <summary>1, 2, 3 … per session, device and channel</summary>
    public ulong Sequence;
    /// <summary>The DeviceState.Tick of the state that was used for computing the force</summary>
    public ulong BasedOnTick;
    /// <summary>N. The force on the hand. A wall that resists motion along +x sends −x</summary>
    public Vec3 Force;
    /// <summary>The change of the force when the hand moves. Absent if the force is constant</summary>
    public bool HasModel;
    public readonly LocalModel Model = new LocalModel();
    /// <summary>The time after its arrival during which the force is fresh</summary>
    public uint ValidForUs;
    public uint Device;
    public uint Channel;
    /// <summary>If true, the body was cut or torn since the previous answer, so neither this model nor the previous one
    /// is used</summary>
    public bool TopologyChanged;
    /// <summary>N. The error of Force, as estimated by the engine. Null if it is unknown</summary>
    public double? Error;
    // With the feature "handle" only:
    /// <summary>N·m. The torque on the hand about the position of the handle, in the axes of the base frame. Null if no
    /// torque is requested</summary>
    public Vec3? Torque;
    /// <summary>N. The force on the fingers. Positive values open them. Null if no force is requested</summary>
    public double? GripForce;
    /// <summary>The change of the torque when the handle turns. It does not require a `model`, and Torque is 0 if it is
    /// missing</summary>
    public bool HasRotationModel;
    public readonly RotationModel RotationModel = new RotationModel();
    // With the feature "ways" only:
    /// <summary>The way in which the engine has computed this force, as an index in Hello.Ways that starts at 1, or 0
    /// if it is unknown. Servers treat an index that is larger than the number of ways as 0</summary>
    public uint Way;
    // With the feature "fields" only:
    /// <summary>If it is not 0, Force is not rendered. It is the true force for the state `BasedOnTick`, which is used
    /// for correcting the field with this generation (UseField.Generation). The model is ignored</summary>
    public uint Field;

    public void Clear() {
      Sequence = 0;
      BasedOnTick = 0;
      Force = default(Vec3);
      HasModel = false;
      Model.Clear();
      ValidForUs = 0;
      Device = 0;
      Channel = 0;
      TopologyChanged = false;
      Error = null;
      Torque = null;
      GripForce = null;
      HasRotationModel = false;
      RotationModel.Clear();
      Way = 0;
      Field = 0;
    }

    public void CopyFrom(ForceCommand other) {
      Sequence = other.Sequence;
      BasedOnTick = other.BasedOnTick;
      Force = other.Force;
      HasModel = other.HasModel;
      Model.CopyFrom(other.Model);
      ValidForUs = other.ValidForUs;
      Device = other.Device;
      Channel = other.Channel;
      TopologyChanged = other.TopologyChanged;
      Error = other.Error;
      Torque = other.Torque;
      GripForce = other.GripForce;
      HasRotationModel = other.HasRotationModel;
      RotationModel.CopyFrom(other.RotationModel);
      Way = other.Way;
      Field = other.Field;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Sequence < 1) return "sequence";
      if (!Bounds.IsVec3(Force)) return "force_n";
      string model = HasModel ? Model.Objection() : null;
      if (model != null) return "model." + model;
      if (ValidForUs < 1 || ValidForUs > 10000000) return "valid_for_us";
      if (Device > 15) return "device";
      if (Channel > 7) return "channel";
      if (Error.HasValue && !(Error.Value >= 0 && Error.Value <= 1e12)) return "error_n";
      if (!Bounds.IsVec3(Torque ?? default(Vec3))) return "torque_nm";
      if (GripForce.HasValue && !(GripForce.Value >= -1e12 && GripForce.Value <= 1e12)) return "gripper_force_n";
      string rotationModel = HasRotationModel ? RotationModel.Objection() : null;
      if (rotationModel != null) return "rotation_model." + rotationModel;
      if (Way > 8) return "way";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Sequence = r.UInt64();
            break;
          case 16:
            BasedOnTick = r.UInt64();
            break;
          case 26:
            Force = r.Vec3(Force);
            break;
          case 34:
            HasModel = true;
            {
              int end = r.Enter();
              Model.Read(ref r);
              r.Leave(end);
            }
            break;
          case 40:
            ValidForUs = r.UInt32();
            break;
          case 48:
            Device = r.UInt32();
            break;
          case 56:
            Channel = r.UInt32();
            break;
          case 64:
            TopologyChanged = r.Bool();
            break;
          case 73:
            Error = r.Double();
            break;
          case 82:
            Torque = r.Vec3(Torque ?? default(Vec3));
            break;
          case 89:
            GripForce = r.Double();
            break;
          case 114:
            HasRotationModel = true;
            {
              int end = r.Enter();
              RotationModel.Read(ref r);
              r.Leave(end);
            }
            break;
          case 120:
            Way = r.UInt32();
            break;
          case 128:
            Field = r.UInt32();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt64(8, Sequence);
      w.UInt64(16, BasedOnTick);
      w.Vec3(26, Force);
      if (HasModel) {
        int begin = w.Begin(34);
        Model.Write(ref w);
        w.End(begin);
      }
      w.UInt32(40, ValidForUs);
      w.UInt32(48, Device);
      w.UInt32(56, Channel);
      w.Bool(64, TopologyChanged);
      if (Error.HasValue) w.PresentDouble(73, Error.Value);
      if (Torque.HasValue) w.PresentVec3(82, Torque.Value);
      if (GripForce.HasValue) w.PresentDouble(89, GripForce.Value);
      if (HasRotationModel) {
        int begin = w.Begin(114);
        RotationModel.Write(ref w);
        w.End(begin);
      }
      w.UInt32(120, Way);
      w.UInt32(128, Field);
    }
  }

  /// <summary>A local model of the torque. The device loop evaluates it at the handle's orientation q. With p = (w, v)
  /// = q · At⁻¹, the rotation from At to q, and K = Stiffness, it is
  /// τ(q) = Torque − 2 (w K v + v × K v)        which is Torque − K θ for a small rotation vector θ</summary>
  public sealed class RotationModel {
    /// <summary>The orientation for which Torque was computed</summary>
    public Quat At;
    /// <summary>N·m/rad, −∂τ/∂θ in the axes of the base frame, with the entries of LocalModel.Stiffness. Springs are
    /// positive</summary>
    public readonly Reals Stiffness = new Reals(9);

    public void Clear() {
      At = default(Quat);
      Stiffness.Clear();
    }

    public void CopyFrom(RotationModel other) {
      At = other.At;
      Stiffness.CopyFrom(other.Stiffness);
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (!Bounds.IsRotation(At)) return "at_orientation";
      if (!Bounds.IsMatrix(Stiffness)) return "angular_stiffness_nmprad";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 10:
            At = r.Quat(At);
            break;
          case 18:
          case 17:
            r.Read(Stiffness);
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.Quat(10, At);
      w.Write(18, Stiffness);
    }
  }

  /// <summary>A local model of the force. The device loop evaluates it at the hand's position x:
  /// F(x) = Force − Stiffness · (x − At)
  /// With a radius or a contact see WIRE.md, "The force between two answers". A server that does not know them uses
  /// this equation.</summary>
  public sealed class LocalModel {
    /// <summary>M, the position for which Force was computed</summary>
    public Vec3 At;
    /// <summary>N/m, −∂F/∂x. Springs are positive. A single entry k is k·I, three entries are the diagonal, and nine
    /// entries are the matrix row by row. Engines that do not know the stiffness send a single 0</summary>
    public readonly Reals Stiffness = new Reals(9);
    /// <summary>M. The distance from At up to which the model is valid. Null if it is unknown</summary>
    public double? ValidRadius;
    /// <summary>The surface that is touched by the tool or is about to be touched</summary>
    public bool HasContact;
    public readonly Contact Contact = new Contact();

    public void Clear() {
      At = default(Vec3);
      Stiffness.Clear();
      ValidRadius = null;
      HasContact = false;
      Contact.Clear();
    }

    public void CopyFrom(LocalModel other) {
      At = other.At;
      Stiffness.CopyFrom(other.Stiffness);
      ValidRadius = other.ValidRadius;
      HasContact = other.HasContact;
      Contact.CopyFrom(other.Contact);
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (!Bounds.IsVec3(At)) return "at_m";
      if (!Bounds.IsMatrix(Stiffness)) return "stiffness_npm";
      if (ValidRadius.HasValue && ValidRadius.Value != double.PositiveInfinity && !(ValidRadius.Value >= 0 && ValidRadius.Value <= 1e12)) return "valid_radius_m";
      string contact = HasContact ? Contact.Objection() : null;
      if (contact != null) return "contact." + contact;
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 10:
            At = r.Vec3(At);
            break;
          case 18:
          case 17:
            r.Read(Stiffness);
            break;
          case 25:
            ValidRadius = r.Double();
            break;
          case 34:
            HasContact = true;
            {
              int end = r.Enter();
              Contact.Read(ref r);
              r.Leave(end);
            }
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.Vec3(10, At);
      w.Write(18, Stiffness);
      if (ValidRadius.HasValue) w.PresentDouble(25, ValidRadius.Value);
      if (HasContact) {
        int begin = w.Begin(34);
        Contact.Write(ref w);
        w.End(begin);
      }
    }
  }

  /// <summary>A surface that is touched by the tool or is about to be touched. It can push but not pull, unless there
  /// is a table.</summary>
  public sealed class Contact {
    /// <summary>The direction from the body to the hand, which is pushed away by a force along +normal</summary>
    public Vec3 Normal;
    /// <summary>M. The distance from the surface to the tool along the normal. It is negative if the tool is inside of
    /// the body</summary>
    public double Gap;
    /// <summary>The forces along the normal if the tool is at other depths</summary>
    public bool HasTable;
    public readonly ForceTable Table = new ForceTable();

    public void Clear() {
      Normal = default(Vec3);
      Gap = 0;
      HasTable = false;
      Table.Clear();
    }

    public void CopyFrom(Contact other) {
      Normal = other.Normal;
      Gap = other.Gap;
      HasTable = other.HasTable;
      Table.CopyFrom(other.Table);
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (!Bounds.IsNormal(Normal)) return "normal";
      if (!(Gap >= -1e12 && Gap <= 1e12)) return "gap_m";
      string table = HasTable ? Table.Objection() : null;
      if (table != null) return "table." + table;
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 10:
            Normal = r.Vec3(Normal);
            break;
          case 17:
            Gap = r.Double();
            break;
          case 26:
            HasTable = true;
            {
              int end = r.Enter();
              Table.Read(ref r);
              r.Leave(end);
            }
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.Vec3(10, Normal);
      w.Double(17, Gap);
      if (HasTable) {
        int begin = w.Begin(26);
        Table.Write(ref w);
        w.End(begin);
      }
    }
  }

  /// <summary>Forces along the normal. Entry i is for the tool at At − (First + i · Step) · normal.</summary>
  public sealed class ForceTable {
    /// <summary>M. The depth of entry 0. It is negative if the tool is farther out than At</summary>
    public double First;
    /// <summary>M</summary>
    public double Step;
    /// <summary>N, the forces along +normal</summary>
    public readonly Reals Force = new Reals(16);

    public void Clear() {
      First = 0;
      Step = 0;
      Force.Clear();
    }

    public void CopyFrom(ForceTable other) {
      First = other.First;
      Step = other.Step;
      Force.CopyFrom(other.Force);
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (!(First >= -1e12 && First <= 1e12)) return "first_depth_m";
      if (!(Step > 0 && Step <= 1e12)) return "step_m";
      if (!Bounds.AreNumbers(Force, 2, 16, -1e12, 1e12)) return "force_n";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 9:
            First = r.Double();
            break;
          case 17:
            Step = r.Double();
            break;
          case 26:
          case 25:
            r.Read(Force);
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.Double(9, First);
      w.Double(17, Step);
      w.Write(26, Force);
    }
  }

  /// <summary>This table is added to the force of the springs of a material. The correction is zero at the surface, and
  /// is interpolated linearly between the entries. The last entry is also used for all greater depths. The slope of the
  /// table must be at least −0.9 times the stiffness of the material. The sum of the slope and the stiffnesses must not
  /// exceed the maximum stiffness of the server.</summary>
  public sealed class FieldDepthTable {
    /// <summary>The number of the material</summary>
    public uint Material;
    /// <summary>M, the spacing of the entries</summary>
    public double Step;
    /// <summary>N, entry i is for the depth (i + 1) · Step</summary>
    public readonly Reals Force = new Reals(16);

    public void Clear() {
      Material = 0;
      Step = 0;
      Force.Clear();
    }

    public void CopyFrom(FieldDepthTable other) {
      Material = other.Material;
      Step = other.Step;
      Force.CopyFrom(other.Force);
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Material > 7) return "material";
      if (!(Step >= 0.0001 && Step <= 0.1)) return "step_m";
      if (!Bounds.AreNumbers(Force, 1, 16, -1e12, 1e12)) return "force_n";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Material = r.UInt32();
            break;
          case 17:
            Step = r.Double();
            break;
          case 26:
          case 25:
            r.Read(Force);
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt32(8, Material);
      w.Double(17, Step);
      w.Write(26, Force);
    }
  }

  /// <summary>The end of the session. Either way, sent three times.</summary>
  public sealed class Bye {
    /// <summary>Reason for the end</summary>
    public Code Code;
    /// <summary>Explanation for people</summary>
    public string Reason = "";

    public void Clear() {
      Code = default(Code);
      Reason = "";
    }

    public void CopyFrom(Bye other) {
      Code = other.Code;
      Reason = other.Reason;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if ((int)Code < 1 || (int)Code > 9) return "code";
      if (!Bounds.IsText(Reason, 128)) return "reason";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Code = (Code)(int)r.UInt32();
            break;
          case 18:
            Reason = r.Text();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt32(8, (uint)Code);
      w.Text(18, Reason, 128);
    }
  }

  /// <summary>Statistics of the forces and datagrams of a client, which show why forces were late and how the network
  /// performed. One-way delays depend on the estimated offset of the clocks. They have an error of up to ± ClockErrorNs
  /// and can be negative. Server → client, unreliable; the highest number wins.</summary>
  public sealed class LinkReport {
    /// <summary>1, 2, 3 … per session</summary>
    public ulong Number;
    /// <summary>End of the reported interval, server clock</summary>
    public long UntilNs;
    /// <summary>Length of the interval</summary>
    public ulong SpanNs;
    // In the interval:
    /// <summary>The number of forces that have arrived</summary>
    public ulong Forces;
    /// <summary>The number of forces that were late because a state was late</summary>
    public ulong LateServer;
    /// <summary>The number of forces that were late because of the network, in either direction</summary>
    public ulong LateNetwork;
    /// <summary>The number of forces that were late because the engine was slower than usual</summary>
    public ulong LateEngine;
    /// <summary>The maximum time for which the device did not have a valid force</summary>
    public ulong WorstLateNs;
    /// <summary>The maximum time without a datagram from the client</summary>
    public ulong LongestGapNs;
    /// <summary>Absent if it was not measured</summary>
    public bool HasRoundTrip;
    public readonly Delays RoundTrip = new Delays();
    /// <summary>One way; absent if it was not measured</summary>
    public bool HasToServer;
    public readonly Delays ToServer = new Delays();
    /// <summary>One way; absent if it was not measured</summary>
    public bool HasToClient;
    public readonly Delays ToClient = new Delays();
    // Clocks:
    /// <summary>The clock of the client minus the clock of the server</summary>
    public long ClockOffsetNs;
    /// <summary>The rate at which the offset increases</summary>
    public double ClockDriftPpm;
    /// <summary>An upper bound of |true offset − ClockOffsetNs|</summary>
    public ulong ClockErrorNs;
    // Datagrams of the client since the session opened:
    public ulong Received;
    public ulong Lost;
    public ulong Reordered;
    public ulong Duplicated;
    // In the interval:
    /// <summary>An explanation of late and refused forces that can be shown to the user. It is empty if there are
    /// none</summary>
    public string Words = "";
    /// <summary>The number of forces that are late for an unknown reason, because the client is silent</summary>
    public ulong LateUnknown;
    // Forces of the client, on all its channels, that could not be used in the interval:
    /// <summary>A number is NaN or infinite</summary>
    public ulong RefusedNotFinite;
    /// <summary>A number is beyond its bound</summary>
    public ulong RefusedOutOfBounds;
    /// <summary>BasedOnTick was unknown or more than 4096 ticks ago</summary>
    public ulong RefusedUnknownTick;
    /// <summary>The sequence was not increased even though the datagram is the newest</summary>
    public ulong RefusedOldSequence;

    public void Clear() {
      Number = 0;
      UntilNs = 0;
      SpanNs = 0;
      Forces = 0;
      LateServer = 0;
      LateNetwork = 0;
      LateEngine = 0;
      WorstLateNs = 0;
      LongestGapNs = 0;
      HasRoundTrip = false;
      RoundTrip.Clear();
      HasToServer = false;
      ToServer.Clear();
      HasToClient = false;
      ToClient.Clear();
      ClockOffsetNs = 0;
      ClockDriftPpm = 0;
      ClockErrorNs = 0;
      Received = 0;
      Lost = 0;
      Reordered = 0;
      Duplicated = 0;
      Words = "";
      LateUnknown = 0;
      RefusedNotFinite = 0;
      RefusedOutOfBounds = 0;
      RefusedUnknownTick = 0;
      RefusedOldSequence = 0;
    }

    public void CopyFrom(LinkReport other) {
      Number = other.Number;
      UntilNs = other.UntilNs;
      SpanNs = other.SpanNs;
      Forces = other.Forces;
      LateServer = other.LateServer;
      LateNetwork = other.LateNetwork;
      LateEngine = other.LateEngine;
      WorstLateNs = other.WorstLateNs;
      LongestGapNs = other.LongestGapNs;
      HasRoundTrip = other.HasRoundTrip;
      RoundTrip.CopyFrom(other.RoundTrip);
      HasToServer = other.HasToServer;
      ToServer.CopyFrom(other.ToServer);
      HasToClient = other.HasToClient;
      ToClient.CopyFrom(other.ToClient);
      ClockOffsetNs = other.ClockOffsetNs;
      ClockDriftPpm = other.ClockDriftPpm;
      ClockErrorNs = other.ClockErrorNs;
      Received = other.Received;
      Lost = other.Lost;
      Reordered = other.Reordered;
      Duplicated = other.Duplicated;
      Words = other.Words;
      LateUnknown = other.LateUnknown;
      RefusedNotFinite = other.RefusedNotFinite;
      RefusedOutOfBounds = other.RefusedOutOfBounds;
      RefusedUnknownTick = other.RefusedUnknownTick;
      RefusedOldSequence = other.RefusedOldSequence;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Number < 1) return "number";
      if (UntilNs < -Bounds.Time || UntilNs > Bounds.Time) return "until_ns";
      if (SpanNs > Bounds.Time) return "span_ns";
      if (WorstLateNs > Bounds.Time) return "worst_late_ns";
      if (LongestGapNs > Bounds.Time) return "longest_gap_ns";
      string roundTrip = HasRoundTrip ? RoundTrip.Objection() : null;
      if (roundTrip != null) return "round_trip." + roundTrip;
      string toServer = HasToServer ? ToServer.Objection() : null;
      if (toServer != null) return "to_server." + toServer;
      string toClient = HasToClient ? ToClient.Objection() : null;
      if (toClient != null) return "to_client." + toClient;
      if (ClockOffsetNs < -Bounds.Time || ClockOffsetNs > Bounds.Time) return "clock_offset_ns";
      if (!(ClockDriftPpm >= -1e12 && ClockDriftPpm <= 1e12)) return "clock_drift_ppm";
      if (ClockErrorNs > Bounds.Time) return "clock_error_ns";
      if (!Bounds.IsText(Words, 128)) return "words";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Number = r.UInt64();
            break;
          case 17:
            UntilNs = r.Fixed64();
            break;
          case 24:
            SpanNs = r.UInt64();
            break;
          case 32:
            Forces = r.UInt64();
            break;
          case 40:
            LateServer = r.UInt64();
            break;
          case 48:
            LateNetwork = r.UInt64();
            break;
          case 56:
            LateEngine = r.UInt64();
            break;
          case 64:
            WorstLateNs = r.UInt64();
            break;
          case 72:
            LongestGapNs = r.UInt64();
            break;
          case 82:
            HasRoundTrip = true;
            {
              int end = r.Enter();
              RoundTrip.Read(ref r);
              r.Leave(end);
            }
            break;
          case 90:
            HasToServer = true;
            {
              int end = r.Enter();
              ToServer.Read(ref r);
              r.Leave(end);
            }
            break;
          case 98:
            HasToClient = true;
            {
              int end = r.Enter();
              ToClient.Read(ref r);
              r.Leave(end);
            }
            break;
          case 104:
            ClockOffsetNs = r.SInt64();
            break;
          case 113:
            ClockDriftPpm = r.Double();
            break;
          case 120:
            ClockErrorNs = r.UInt64();
            break;
          case 128:
            Received = r.UInt64();
            break;
          case 136:
            Lost = r.UInt64();
            break;
          case 144:
            Reordered = r.UInt64();
            break;
          case 152:
            Duplicated = r.UInt64();
            break;
          case 162:
            Words = r.Text();
            break;
          case 168:
            LateUnknown = r.UInt64();
            break;
          case 176:
            RefusedNotFinite = r.UInt64();
            break;
          case 184:
            RefusedOutOfBounds = r.UInt64();
            break;
          case 192:
            RefusedUnknownTick = r.UInt64();
            break;
          case 200:
            RefusedOldSequence = r.UInt64();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt64(8, Number);
      w.Fixed64(17, UntilNs);
      w.UInt64(24, SpanNs);
      w.UInt64(32, Forces);
      w.UInt64(40, LateServer);
      w.UInt64(48, LateNetwork);
      w.UInt64(56, LateEngine);
      w.UInt64(64, WorstLateNs);
      w.UInt64(72, LongestGapNs);
      if (HasRoundTrip) {
        int begin = w.Begin(82);
        RoundTrip.Write(ref w);
        w.End(begin);
      }
      if (HasToServer) {
        int begin = w.Begin(90);
        ToServer.Write(ref w);
        w.End(begin);
      }
      if (HasToClient) {
        int begin = w.Begin(98);
        ToClient.Write(ref w);
        w.End(begin);
      }
      w.SInt64(104, ClockOffsetNs);
      w.Double(113, ClockDriftPpm);
      w.UInt64(120, ClockErrorNs);
      w.UInt64(128, Received);
      w.UInt64(136, Lost);
      w.UInt64(144, Reordered);
      w.UInt64(152, Duplicated);
      w.Text(162, Words, 128);
      w.UInt64(168, LateUnknown);
      w.UInt64(176, RefusedNotFinite);
      w.UInt64(184, RefusedOutOfBounds);
      w.UInt64(192, RefusedUnknownTick);
      w.UInt64(200, RefusedOldSequence);
    }
  }

  /// <summary>Two quantiles of a delay. The delay can be negative if two clocks are compared.</summary>
  public sealed class Delays {
    public long MedianNs;
    public long P99Ns;

    public void Clear() {
      MedianNs = 0;
      P99Ns = 0;
    }

    public void CopyFrom(Delays other) {
      MedianNs = other.MedianNs;
      P99Ns = other.P99Ns;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (MedianNs < -Bounds.Time || MedianNs > Bounds.Time) return "median_ns";
      if (P99Ns < -Bounds.Time || P99Ns > Bounds.Time) return "p99_ns";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            MedianNs = r.SInt64();
            break;
          case 16:
            P99Ns = r.SInt64();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.SInt64(8, MedianNs);
      w.SInt64(16, P99Ns);
    }
  }

  /// <summary>The state of one end of a coupling, which is sent to the other end. Vectors use the base frame and the
  /// scale of the SENDER's device. For their use, see core/teleoperation/coupling.h. Either way, unreliable, with the
  /// feature "teleoperation" only; for each device, channel and end the highest sequence of the highest epoch wins. An
  /// observer of the device is sent both ends of its coupling.</summary>
  public sealed class PortState {
    /// <summary>The device of the server of this session, in both directions</summary>
    public uint Device;
    /// <summary>The channel of the server of this session, in both directions</summary>
    public uint Channel;
    /// <summary>The epoch of the sender, which is increased if the sender is restarted</summary>
    public ulong Epoch;
    /// <summary>The number of the haptic step of the sender in this epoch: 1, 2, 3 …</summary>
    public ulong Sequence;
    /// <summary>The epoch of the receiver for `answers`, Given and Taken, or 0</summary>
    public ulong AnswersEpoch;
    /// <summary>The sequence of the receiver's newest PortState that is used, or 0</summary>
    public ulong Answers;
    /// <summary>The time on the clock of the sender, which is only used for computing differences</summary>
    public long TimeNs;
    /// <summary>The round trip that was measured by the sender, or 0 if it was not measured yet</summary>
    public ulong RoundTripNs;
    public PortPhase Phase;
    /// <summary>The number of the engagement of the leader that the phase belongs to: 1, 2, 3 …, or 0</summary>
    public ulong Engagement;
    /// <summary>Bit i is set if button i is pressed</summary>
    public uint Buttons;
    /// <summary>M, the displacement of the handle from the offset of the sender</summary>
    public Vec3 Position;
    /// <summary>M/s, the velocity of this displacement, which is zero if the displacement is frozen</summary>
    public Vec3 Velocity;
    /// <summary>N, the actual force on the hand at the handle of the sender</summary>
    public Vec3 Force;
    /// <summary>N. The force of the environment on the tool of the sender. Null if it is not measured</summary>
    public Vec3? ContactForce;
    /// <summary>J, the energy that the sender may still output, minus its payments</summary>
    public double Account;
    /// <summary>J. The energy that the sender needs for its desired force, or 0 if it does not have a tank</summary>
    public double Need;
    /// <summary>J. The total energy that was paid to the receiver. It does not decrease until one of the epochs
    /// changes</summary>
    public double Given;
    /// <summary>J, the Given of the receiver that was received last, in joules of the receiver</summary>
    public double Taken;
    /// <summary>For CouplingMethod.Waves, √W·s: the integral of the wave since the start of the epoch. Since this is a
    /// total, lost frames have no lasting effect. Half the square of a wave is a power. Null if nothing was sent
    /// yet</summary>
    public Vec3? WaveIntegral;
    /// <summary>J, ∫ ‖wave‖²/2 dt; it never decreases within an epoch</summary>
    public double WaveEnergy;
    /// <summary>For CouplingMethod.Surface, from the follower. Absent if it has not touched a surface yet</summary>
    public bool HasSurface;
    public readonly PortSurface Surface = new PortSurface();
    /// <summary>Absent if the orientations are not coupled</summary>
    public bool HasTurn;
    public readonly PortTurn Turn = new PortTurn();
    /// <summary>Absent if the grippers are not coupled</summary>
    public bool HasGrip;
    public readonly PortGrip Grip = new PortGrip();
    /// <summary>J. For CouplingMethod.Passivity, the energy that was received by the port of the sender in this
    /// epoch</summary>
    public double EnergyIn;
    /// <summary>The weight of the receiver if the follower has several leaders. Null if the receiver is the only
    /// leader</summary>
    public double? Share;
    // From a leader, in use from this frame on; 0: as in Couple. An observer is always sent the values:
    public double PositionScale;
    public double ForceScale;
    // To an observer:
    /// <summary>If true, this is the other end of the coupling of the device, as received by the server</summary>
    public bool OfPeer;

    public void Clear() {
      Device = 0;
      Channel = 0;
      Epoch = 0;
      Sequence = 0;
      AnswersEpoch = 0;
      Answers = 0;
      TimeNs = 0;
      RoundTripNs = 0;
      Phase = default(PortPhase);
      Engagement = 0;
      Buttons = 0;
      Position = default(Vec3);
      Velocity = default(Vec3);
      Force = default(Vec3);
      ContactForce = null;
      Account = 0;
      Need = 0;
      Given = 0;
      Taken = 0;
      WaveIntegral = null;
      WaveEnergy = 0;
      HasSurface = false;
      Surface.Clear();
      HasTurn = false;
      Turn.Clear();
      HasGrip = false;
      Grip.Clear();
      EnergyIn = 0;
      Share = null;
      PositionScale = 0;
      ForceScale = 0;
      OfPeer = false;
    }

    public void CopyFrom(PortState other) {
      Device = other.Device;
      Channel = other.Channel;
      Epoch = other.Epoch;
      Sequence = other.Sequence;
      AnswersEpoch = other.AnswersEpoch;
      Answers = other.Answers;
      TimeNs = other.TimeNs;
      RoundTripNs = other.RoundTripNs;
      Phase = other.Phase;
      Engagement = other.Engagement;
      Buttons = other.Buttons;
      Position = other.Position;
      Velocity = other.Velocity;
      Force = other.Force;
      ContactForce = other.ContactForce;
      Account = other.Account;
      Need = other.Need;
      Given = other.Given;
      Taken = other.Taken;
      WaveIntegral = other.WaveIntegral;
      WaveEnergy = other.WaveEnergy;
      HasSurface = other.HasSurface;
      Surface.CopyFrom(other.Surface);
      HasTurn = other.HasTurn;
      Turn.CopyFrom(other.Turn);
      HasGrip = other.HasGrip;
      Grip.CopyFrom(other.Grip);
      EnergyIn = other.EnergyIn;
      Share = other.Share;
      PositionScale = other.PositionScale;
      ForceScale = other.ForceScale;
      OfPeer = other.OfPeer;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Device > 15) return "device";
      if (Channel > 7) return "channel";
      if (Epoch < 1) return "epoch";
      if (Sequence < 1) return "sequence";
      if (TimeNs < -Bounds.Time || TimeNs > Bounds.Time) return "time_ns";
      if (RoundTripNs > 10000000000) return "round_trip_ns";
      if ((int)Phase < 1 || (int)Phase > 7) return "phase";
      if (!Bounds.IsVec3(Position)) return "position_m";
      if (!Bounds.IsVec3(Velocity)) return "velocity_mps";
      if (!Bounds.IsVec3(Force)) return "force_n";
      if (!Bounds.IsVec3(ContactForce ?? default(Vec3))) return "contact_force_n";
      if (!(Account >= -1e3 && Account <= 1e3)) return "account_j";
      if (!(Need >= 0 && Need <= 1e3)) return "need_j";
      if (!(Given >= 0 && Given <= 1e6)) return "given_j";
      if (!(Taken >= 0 && Taken <= 1e6)) return "taken_j";
      if (!Bounds.IsVec3(WaveIntegral ?? default(Vec3))) return "wave_integral";
      if (!(WaveEnergy >= 0 && WaveEnergy <= 1e6)) return "wave_energy_j";
      string surface = HasSurface ? Surface.Objection() : null;
      if (surface != null) return "surface." + surface;
      string turn = HasTurn ? Turn.Objection() : null;
      if (turn != null) return "turn." + turn;
      string grip = HasGrip ? Grip.Objection() : null;
      if (grip != null) return "grip." + grip;
      if (!(EnergyIn >= 0 && EnergyIn <= 1e6)) return "energy_in_j";
      if (Share.HasValue && !(Share.Value >= 0 && Share.Value <= 1)) return "share";
      if (PositionScale != 0 && !(PositionScale >= 0.01 && PositionScale <= 100)) return "position_scale";
      if (ForceScale != 0 && !(ForceScale >= 0.01 && ForceScale <= 100)) return "force_scale";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Device = r.UInt32();
            break;
          case 16:
            Channel = r.UInt32();
            break;
          case 24:
            Epoch = r.UInt64();
            break;
          case 32:
            Sequence = r.UInt64();
            break;
          case 40:
            AnswersEpoch = r.UInt64();
            break;
          case 48:
            Answers = r.UInt64();
            break;
          case 57:
            TimeNs = r.Fixed64();
            break;
          case 64:
            RoundTripNs = r.UInt64();
            break;
          case 72:
            Phase = (PortPhase)(int)r.UInt32();
            break;
          case 80:
            Engagement = r.UInt64();
            break;
          case 93:
            Buttons = r.Fixed32();
            break;
          case 98:
            Position = r.Vec3(Position);
            break;
          case 106:
            Velocity = r.Vec3(Velocity);
            break;
          case 114:
            Force = r.Vec3(Force);
            break;
          case 122:
            ContactForce = r.Vec3(ContactForce ?? default(Vec3));
            break;
          case 129:
            Account = r.Double();
            break;
          case 137:
            Need = r.Double();
            break;
          case 145:
            Given = r.Double();
            break;
          case 153:
            Taken = r.Double();
            break;
          case 162:
            WaveIntegral = r.Vec3(WaveIntegral ?? default(Vec3));
            break;
          case 169:
            WaveEnergy = r.Double();
            break;
          case 178:
            HasSurface = true;
            {
              int end = r.Enter();
              Surface.Read(ref r);
              r.Leave(end);
            }
            break;
          case 186:
            HasTurn = true;
            {
              int end = r.Enter();
              Turn.Read(ref r);
              r.Leave(end);
            }
            break;
          case 194:
            HasGrip = true;
            {
              int end = r.Enter();
              Grip.Read(ref r);
              r.Leave(end);
            }
            break;
          case 201:
            EnergyIn = r.Double();
            break;
          case 209:
            Share = r.Double();
            break;
          case 217:
            PositionScale = r.Double();
            break;
          case 225:
            ForceScale = r.Double();
            break;
          case 232:
            OfPeer = r.Bool();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt32(8, Device);
      w.UInt32(16, Channel);
      w.UInt64(24, Epoch);
      w.UInt64(32, Sequence);
      w.UInt64(40, AnswersEpoch);
      w.UInt64(48, Answers);
      w.Fixed64(57, TimeNs);
      w.UInt64(64, RoundTripNs);
      w.UInt32(72, (uint)Phase);
      w.UInt64(80, Engagement);
      w.Fixed32(93, Buttons);
      w.Vec3(98, Position);
      w.Vec3(106, Velocity);
      w.Vec3(114, Force);
      if (ContactForce.HasValue) w.PresentVec3(122, ContactForce.Value);
      w.Double(129, Account);
      w.Double(137, Need);
      w.Double(145, Given);
      w.Double(153, Taken);
      if (WaveIntegral.HasValue) w.PresentVec3(162, WaveIntegral.Value);
      w.Double(169, WaveEnergy);
      if (HasSurface) {
        int begin = w.Begin(178);
        Surface.Write(ref w);
        w.End(begin);
      }
      if (HasTurn) {
        int begin = w.Begin(186);
        Turn.Write(ref w);
        w.End(begin);
      }
      if (HasGrip) {
        int begin = w.Begin(194);
        Grip.Write(ref w);
        w.End(begin);
      }
      w.Double(201, EnergyIn);
      if (Share.HasValue) w.PresentDouble(209, Share.Value);
      w.Double(217, PositionScale);
      w.Double(225, ForceScale);
      w.Bool(232, OfPeer);
    }
  }

  /// <summary>The rotation of a handle since its offset was set.</summary>
  public sealed class PortTurn {
    /// <summary>The rotation in the axes of the sender's base frame</summary>
    public Quat Turn;
    /// <summary>Rad/s, the angular velocity, which is zero if the rotation is frozen</summary>
    public Vec3 AngularVelocity;
    /// <summary>N·m, the actual torque on the hand at the handle of the sender</summary>
    public Vec3 Torque;

    public void Clear() {
      Turn = default(Quat);
      AngularVelocity = default(Vec3);
      Torque = default(Vec3);
    }

    public void CopyFrom(PortTurn other) {
      Turn = other.Turn;
      AngularVelocity = other.AngularVelocity;
      Torque = other.Torque;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (!Bounds.IsRotation(Turn)) return "turn";
      if (!Bounds.IsVec3(AngularVelocity)) return "angular_velocity_radps";
      if (!Bounds.IsVec3(Torque)) return "torque_nm";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 10:
            Turn = r.Quat(Turn);
            break;
          case 18:
            AngularVelocity = r.Vec3(AngularVelocity);
            break;
          case 26:
            Torque = r.Vec3(Torque);
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.Quat(10, Turn);
      w.Vec3(18, AngularVelocity);
      w.Vec3(26, Torque);
    }
  }

  /// <summary>The state of a gripper, measured at its fingers. The gripper has a separate energy account.</summary>
  public sealed class PortGrip {
    /// <summary>M</summary>
    public double Opening;
    /// <summary>M/s</summary>
    public double Velocity;
    /// <summary>N. The actual force on the fingers. Positive values open them</summary>
    public double Force;
    /// <summary>J, as in PortState</summary>
    public double Account;
    /// <summary>J, as in PortState</summary>
    public double Need;
    /// <summary>J, as in PortState</summary>
    public double Given;
    /// <summary>J, as in PortState</summary>
    public double Taken;

    public void Clear() {
      Opening = 0;
      Velocity = 0;
      Force = 0;
      Account = 0;
      Need = 0;
      Given = 0;
      Taken = 0;
    }

    public void CopyFrom(PortGrip other) {
      Opening = other.Opening;
      Velocity = other.Velocity;
      Force = other.Force;
      Account = other.Account;
      Need = other.Need;
      Given = other.Given;
      Taken = other.Taken;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (!(Opening >= -1e12 && Opening <= 1e12)) return "opening_m";
      if (!(Velocity >= -1e12 && Velocity <= 1e12)) return "velocity_mps";
      if (!(Force >= -1e12 && Force <= 1e12)) return "force_n";
      if (!(Account >= -1e3 && Account <= 1e3)) return "account_j";
      if (!(Need >= 0 && Need <= 1e3)) return "need_j";
      if (!(Given >= 0 && Given <= 1e6)) return "given_j";
      if (!(Taken >= 0 && Taken <= 1e6)) return "taken_j";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 9:
            Opening = r.Double();
            break;
          case 17:
            Velocity = r.Double();
            break;
          case 25:
            Force = r.Double();
            break;
          case 33:
            Account = r.Double();
            break;
          case 41:
            Need = r.Double();
            break;
          case 49:
            Given = r.Double();
            break;
          case 57:
            Taken = r.Double();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.Double(9, Opening);
      w.Double(17, Velocity);
      w.Double(25, Force);
      w.Double(33, Account);
      w.Double(41, Need);
      w.Double(49, Given);
      w.Double(57, Taken);
    }
  }

  /// <summary>A flat elastic surface that is or was touched by the tool of the sender. It can push but not
  /// pull.</summary>
  public sealed class PortSurface {
    /// <summary>The direction out of the surface</summary>
    public Vec3 Normal;
    /// <summary>M, the surface is where normal · Position = Offset</summary>
    public double Offset;
    /// <summary>N/m, the stiffness, or 0 if there is no surface</summary>
    public double Stiffness;

    public void Clear() {
      Normal = default(Vec3);
      Offset = 0;
      Stiffness = 0;
    }

    public void CopyFrom(PortSurface other) {
      Normal = other.Normal;
      Offset = other.Offset;
      Stiffness = other.Stiffness;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (!Bounds.IsNormal(Normal)) return "normal";
      if (!(Offset >= -1e12 && Offset <= 1e12)) return "offset_m";
      if (!(Stiffness >= 0 && Stiffness <= 1e12)) return "stiffness_npm";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 10:
            Normal = r.Vec3(Normal);
            break;
          case 17:
            Offset = r.Double();
            break;
          case 25:
            Stiffness = r.Double();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.Vec3(10, Normal);
      w.Double(17, Offset);
      w.Double(25, Stiffness);
    }
  }

  /// <summary>Statistics of the loop of a device. All counts are for the reported interval. Server → client,
  /// unreliable, to an observer with the feature "diagnostics" only; for each device the highest number wins.</summary>
  public sealed class DeviceReport {
    /// <summary>1, 2, 3 … per device</summary>
    public ulong Number;
    /// <summary>End of the reported interval, server clock</summary>
    public long UntilNs;
    /// <summary>Length of the interval</summary>
    public ulong SpanNs;
    public uint Device;
    /// <summary>Haptic steps</summary>
    public ulong Steps;
    /// <summary>The number of periods that were skipped because the previous step was late</summary>
    public ulong Missed;
    /// <summary>The number of steps that started too late (reason overrun)</summary>
    public ulong Overruns;
    /// <summary>The number of steps without a position</summary>
    public ulong Unseen;
    /// <summary>The number of steps by their delay. Entry 0 counts the steps that were at most 1 µs late, entry i the
    /// steps that were more than 2^(i−1) µs and at most 2^i µs late, and entry 23 all steps that were more than 2^22 µs
    /// late. Zeros at the end are omitted. If the server was not able to count all steps, the sum is smaller than
    /// `steps`</summary>
    public readonly Counts Lateness = new Counts(24);
    public Safety Safety;
    /// <summary>The reason why the device does not exert forces until it is armed or rearmed, as text for the user. It
    /// is empty if there is no fault</summary>
    public string Fault = "";
    /// <summary>The service that is currently reduced by the server, as text for the user. It is empty if there is
    /// none</summary>
    public string Degraded = "";

    public void Clear() {
      Number = 0;
      UntilNs = 0;
      SpanNs = 0;
      Device = 0;
      Steps = 0;
      Missed = 0;
      Overruns = 0;
      Unseen = 0;
      Lateness.Clear();
      Safety = default(Safety);
      Fault = "";
      Degraded = "";
    }

    public void CopyFrom(DeviceReport other) {
      Number = other.Number;
      UntilNs = other.UntilNs;
      SpanNs = other.SpanNs;
      Device = other.Device;
      Steps = other.Steps;
      Missed = other.Missed;
      Overruns = other.Overruns;
      Unseen = other.Unseen;
      Lateness.CopyFrom(other.Lateness);
      Safety = other.Safety;
      Fault = other.Fault;
      Degraded = other.Degraded;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Number < 1) return "number";
      if (UntilNs < -Bounds.Time || UntilNs > Bounds.Time) return "until_ns";
      if (SpanNs > Bounds.Time) return "span_ns";
      if (Device > 15) return "device";
      if (!(Overruns <= Steps)) return "overruns";
      if (!(Unseen <= Steps)) return "unseen";
      if (Lateness.Count > 24) return "lateness_us_log2";
      if (!(Lateness.Sum() <= Steps)) return "lateness_us_log2";
      if ((int)Safety < 1 || (int)Safety > 8) return "safety";
      if (!Bounds.IsText(Fault, 128)) return "fault";
      if (!Bounds.IsText(Degraded, 128)) return "degraded";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Number = r.UInt64();
            break;
          case 17:
            UntilNs = r.Fixed64();
            break;
          case 24:
            SpanNs = r.UInt64();
            break;
          case 32:
            Device = r.UInt32();
            break;
          case 40:
            Steps = r.UInt64();
            break;
          case 48:
            Missed = r.UInt64();
            break;
          case 56:
            Overruns = r.UInt64();
            break;
          case 64:
            Unseen = r.UInt64();
            break;
          case 74:
          case 72:
            r.Read(Lateness);
            break;
          case 80:
            Safety = (Safety)(int)r.UInt32();
            break;
          case 90:
            Fault = r.Text();
            break;
          case 98:
            Degraded = r.Text();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt64(8, Number);
      w.Fixed64(17, UntilNs);
      w.UInt64(24, SpanNs);
      w.UInt32(32, Device);
      w.UInt64(40, Steps);
      w.UInt64(48, Missed);
      w.UInt64(56, Overruns);
      w.UInt64(64, Unseen);
      w.Write(74, Lateness);
      w.UInt32(80, (uint)Safety);
      w.Text(90, Fault, 128);
      w.Text(98, Degraded, 128);
    }
  }

  /// <summary>Statistics of the engine that holds the lease of a channel. Server → client, unreliable, to an observer
  /// with the feature "diagnostics" only; for each device and channel the highest number of its link wins.</summary>
  public sealed class PeerReport {
    public uint Device;
    public uint Channel;
    /// <summary>The name of the engine in its Hello</summary>
    public string Name = "";
    /// <summary>One of this many requested states is sent to the engine, because its link is congested</summary>
    public uint StateOneIn;
    /// <summary>If true, the forces of the engine are ignored because its link has lost too many datagrams</summary>
    public bool ForcesRefused;
    /// <summary>The report about the link of the engine. The number and the counts of forces are per channel; absent is
    /// refused</summary>
    public bool HasLink;
    public readonly LinkReport Link = new LinkReport();
    // Of the force in the interval with the largest ForceCommand.Error; if none states an error, of the newest:
    /// <summary>N. The estimated error of this force. Null if errors are not estimated</summary>
    public double? Error;
    /// <summary>The entry of Hello.Ways for this force. It is empty if it is unknown</summary>
    public string Way = "";

    public void Clear() {
      Device = 0;
      Channel = 0;
      Name = "";
      StateOneIn = 0;
      ForcesRefused = false;
      HasLink = false;
      Link.Clear();
      Error = null;
      Way = "";
    }

    public void CopyFrom(PeerReport other) {
      Device = other.Device;
      Channel = other.Channel;
      Name = other.Name;
      StateOneIn = other.StateOneIn;
      ForcesRefused = other.ForcesRefused;
      HasLink = other.HasLink;
      Link.CopyFrom(other.Link);
      Error = other.Error;
      Way = other.Way;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Device > 15) return "device";
      if (Channel > 7) return "channel";
      if (!Bounds.IsText(Name, 64)) return "name";
      if (StateOneIn < 1 || StateOneIn > 1000) return "state_one_in";
      if (!HasLink) return "link";
      string link = HasLink ? Link.Objection() : null;
      if (link != null) return "link." + link;
      if (Error.HasValue && !(Error.Value >= 0 && Error.Value <= 1e12)) return "error_n";
      if (!Bounds.IsText(Way, 24)) return "way";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Device = r.UInt32();
            break;
          case 16:
            Channel = r.UInt32();
            break;
          case 26:
            Name = r.Text();
            break;
          case 32:
            StateOneIn = r.UInt32();
            break;
          case 40:
            ForcesRefused = r.Bool();
            break;
          case 50:
            HasLink = true;
            {
              int end = r.Enter();
              Link.Read(ref r);
              r.Leave(end);
            }
            break;
          case 57:
            Error = r.Double();
            break;
          case 66:
            Way = r.Text();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt32(8, Device);
      w.UInt32(16, Channel);
      w.Text(26, Name, 64);
      w.UInt32(32, StateOneIn);
      w.Bool(40, ForcesRefused);
      if (HasLink) {
        int begin = w.Begin(50);
        Link.Write(ref w);
        w.End(begin);
      }
      if (Error.HasValue) w.PresentDouble(57, Error.Value);
      w.Text(66, Way, 24);
    }
  }
}
