// SPDX-License-Identifier: Apache-2.0
// Generated from protocol/wire/tendon.proto by protocol/generate. Do not edit.
using System.Collections.Generic;

namespace Tendon {
  /// <summary>A request, and its number. `lease_lost` is from the server to the client, all others are from the client
  /// to the server. Either way, reliable, in order.</summary>
  public sealed class Control {
    /// <summary>The member that is present.</summary>
    public enum OpCase {
      None = 0,
      SetStateRate = 2,
      Rearm = 3,
      Describe = 4,
      TakeLease = 5,
      GiveLease = 6,
      LeaseLost = 7,
      SetStateDeadband = 8,
      Disarm = 9,
      SetOutput = 10,
      Couple = 11,
      Engage = 12,
      Disengage = 13,
      SetScale = 14,
      SetShare = 15,
    }

    public OpCase Op;
    /// <summary>1, 2, 3 … per session and direction. At most 16 requests can be unanswered</summary>
    public uint Id;
    public readonly SetStateRate SetStateRate = new SetStateRate();
    public readonly Rearm Rearm = new Rearm();
    public readonly Describe Describe = new Describe();
    public readonly TakeLease TakeLease = new TakeLease();
    public readonly GiveLease GiveLease = new GiveLease();
    public readonly LeaseLost LeaseLost = new LeaseLost();
    public readonly SetStateDeadband SetStateDeadband = new SetStateDeadband();
    public readonly Disarm Disarm = new Disarm();
    public readonly SetOutput SetOutput = new SetOutput();
    public readonly Couple Couple = new Couple();
    public readonly Engage Engage = new Engage();
    public readonly Disengage Disengage = new Disengage();
    public readonly SetScale SetScale = new SetScale();
    public readonly SetShare SetShare = new SetShare();

    public void Clear() {
      Op = OpCase.None;
      Id = 0;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Id < 1) return "id";
      string setStateRate = Op == OpCase.SetStateRate ? SetStateRate.Objection() : null;
      if (setStateRate != null) return "set_state_rate." + setStateRate;
      string rearm = Op == OpCase.Rearm ? Rearm.Objection() : null;
      if (rearm != null) return "rearm." + rearm;
      string describe = Op == OpCase.Describe ? Describe.Objection() : null;
      if (describe != null) return "describe." + describe;
      string takeLease = Op == OpCase.TakeLease ? TakeLease.Objection() : null;
      if (takeLease != null) return "take_lease." + takeLease;
      string giveLease = Op == OpCase.GiveLease ? GiveLease.Objection() : null;
      if (giveLease != null) return "give_lease." + giveLease;
      string leaseLost = Op == OpCase.LeaseLost ? LeaseLost.Objection() : null;
      if (leaseLost != null) return "lease_lost." + leaseLost;
      string setStateDeadband = Op == OpCase.SetStateDeadband ? SetStateDeadband.Objection() : null;
      if (setStateDeadband != null) return "set_state_deadband." + setStateDeadband;
      string disarm = Op == OpCase.Disarm ? Disarm.Objection() : null;
      if (disarm != null) return "disarm." + disarm;
      string setOutput = Op == OpCase.SetOutput ? SetOutput.Objection() : null;
      if (setOutput != null) return "set_output." + setOutput;
      string couple = Op == OpCase.Couple ? Couple.Objection() : null;
      if (couple != null) return "couple." + couple;
      string engage = Op == OpCase.Engage ? Engage.Objection() : null;
      if (engage != null) return "engage." + engage;
      string disengage = Op == OpCase.Disengage ? Disengage.Objection() : null;
      if (disengage != null) return "disengage." + disengage;
      string setScale = Op == OpCase.SetScale ? SetScale.Objection() : null;
      if (setScale != null) return "set_scale." + setScale;
      string setShare = Op == OpCase.SetShare ? SetShare.Objection() : null;
      if (setShare != null) return "set_share." + setShare;
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Id = r.UInt32();
            break;
          case 18:
            if (Op != OpCase.SetStateRate) SetStateRate.Clear();
            Op = OpCase.SetStateRate;
            {
              int end = r.Enter();
              SetStateRate.Read(ref r);
              r.Leave(end);
            }
            break;
          case 26:
            if (Op != OpCase.Rearm) Rearm.Clear();
            Op = OpCase.Rearm;
            {
              int end = r.Enter();
              Rearm.Read(ref r);
              r.Leave(end);
            }
            break;
          case 34:
            if (Op != OpCase.Describe) Describe.Clear();
            Op = OpCase.Describe;
            {
              int end = r.Enter();
              Describe.Read(ref r);
              r.Leave(end);
            }
            break;
          case 42:
            if (Op != OpCase.TakeLease) TakeLease.Clear();
            Op = OpCase.TakeLease;
            {
              int end = r.Enter();
              TakeLease.Read(ref r);
              r.Leave(end);
            }
            break;
          case 50:
            if (Op != OpCase.GiveLease) GiveLease.Clear();
            Op = OpCase.GiveLease;
            {
              int end = r.Enter();
              GiveLease.Read(ref r);
              r.Leave(end);
            }
            break;
          case 58:
            if (Op != OpCase.LeaseLost) LeaseLost.Clear();
            Op = OpCase.LeaseLost;
            {
              int end = r.Enter();
              LeaseLost.Read(ref r);
              r.Leave(end);
            }
            break;
          case 66:
            if (Op != OpCase.SetStateDeadband) SetStateDeadband.Clear();
            Op = OpCase.SetStateDeadband;
            {
              int end = r.Enter();
              SetStateDeadband.Read(ref r);
              r.Leave(end);
            }
            break;
          case 74:
            if (Op != OpCase.Disarm) Disarm.Clear();
            Op = OpCase.Disarm;
            {
              int end = r.Enter();
              Disarm.Read(ref r);
              r.Leave(end);
            }
            break;
          case 82:
            if (Op != OpCase.SetOutput) SetOutput.Clear();
            Op = OpCase.SetOutput;
            {
              int end = r.Enter();
              SetOutput.Read(ref r);
              r.Leave(end);
            }
            break;
          case 90:
            if (Op != OpCase.Couple) Couple.Clear();
            Op = OpCase.Couple;
            {
              int end = r.Enter();
              Couple.Read(ref r);
              r.Leave(end);
            }
            break;
          case 98:
            if (Op != OpCase.Engage) Engage.Clear();
            Op = OpCase.Engage;
            {
              int end = r.Enter();
              Engage.Read(ref r);
              r.Leave(end);
            }
            break;
          case 106:
            if (Op != OpCase.Disengage) Disengage.Clear();
            Op = OpCase.Disengage;
            {
              int end = r.Enter();
              Disengage.Read(ref r);
              r.Leave(end);
            }
            break;
          case 114:
            if (Op != OpCase.SetScale) SetScale.Clear();
            Op = OpCase.SetScale;
            {
              int end = r.Enter();
              SetScale.Read(ref r);
              r.Leave(end);
            }
            break;
          case 122:
            if (Op != OpCase.SetShare) SetShare.Clear();
            Op = OpCase.SetShare;
            {
              int end = r.Enter();
              SetShare.Read(ref r);
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
      w.UInt32(8, Id);
      if (Op == OpCase.SetStateRate) {
        int begin = w.Begin(18);
        SetStateRate.Write(ref w);
        w.End(begin);
      }
      if (Op == OpCase.Rearm) {
        int begin = w.Begin(26);
        Rearm.Write(ref w);
        w.End(begin);
      }
      if (Op == OpCase.Describe) {
        int begin = w.Begin(34);
        Describe.Write(ref w);
        w.End(begin);
      }
      if (Op == OpCase.TakeLease) {
        int begin = w.Begin(42);
        TakeLease.Write(ref w);
        w.End(begin);
      }
      if (Op == OpCase.GiveLease) {
        int begin = w.Begin(50);
        GiveLease.Write(ref w);
        w.End(begin);
      }
      if (Op == OpCase.LeaseLost) {
        int begin = w.Begin(58);
        LeaseLost.Write(ref w);
        w.End(begin);
      }
      if (Op == OpCase.SetStateDeadband) {
        int begin = w.Begin(66);
        SetStateDeadband.Write(ref w);
        w.End(begin);
      }
      if (Op == OpCase.Disarm) {
        int begin = w.Begin(74);
        Disarm.Write(ref w);
        w.End(begin);
      }
      if (Op == OpCase.SetOutput) {
        int begin = w.Begin(82);
        SetOutput.Write(ref w);
        w.End(begin);
      }
      if (Op == OpCase.Couple) {
        int begin = w.Begin(90);
        Couple.Write(ref w);
        w.End(begin);
      }
      if (Op == OpCase.Engage) {
        int begin = w.Begin(98);
        Engage.Write(ref w);
        w.End(begin);
      }
      if (Op == OpCase.Disengage) {
        int begin = w.Begin(106);
        Disengage.Write(ref w);
        w.End(begin);
      }
      if (Op == OpCase.SetScale) {
        int begin = w.Begin(114);
        SetScale.Write(ref w);
        w.End(begin);
      }
      if (Op == OpCase.SetShare) {
        int begin = w.Begin(122);
        SetShare.Write(ref w);
        w.End(begin);
      }
    }
  }

  /// <summary>Sets the number of states of a device that are sent to the client per second. Before the first request of
  /// this type, all LoopHz states per second are sent. After it, every k-th state is sent, where k = LoopHz / hz is
  /// rounded and at least 1. For example, if LoopHz is 1000, 300 Hz becomes 333 Hz and 2000 Hz becomes 1000
  /// Hz.</summary>
  public sealed class SetStateRate {
    /// <summary>If it is 0, the answer is Code.Invalid</summary>
    public uint Hz;
    public uint Device;

    public void Clear() {
      Hz = 0;
      Device = 0;
    }

    public void CopyFrom(SetStateRate other) {
      Hz = other.Hz;
      Device = other.Device;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Device > 15) return "device";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Hz = r.UInt32();
            break;
          case 16:
            Device = r.UInt32();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt32(8, Hz);
      w.UInt32(16, Device);
    }
  }

  /// <summary>Suppresses states that can be predicted by the client. After a state with velocity v, the server sends
  /// the first state whose velocity differs from v by more than max(share · ‖v‖, Floor), whose mode or buttons differ,
  /// or that is MaxSilenceUs newer. Between two states the client extrapolates: x + v · (t − SampledNs).</summary>
  public sealed class SetStateDeadband {
    /// <summary>The fraction of the speed (Weber fraction). If it is not in 0 … 0.5, the answer is
    /// Code.Invalid</summary>
    public double Share;
    /// <summary>M/s. The smallest difference of the velocity. If it is not in 0 … 0.1, the answer is
    /// Code.Invalid</summary>
    public double Floor;
    /// <summary>The maximum time without a state. If it is 0, every state is sent again. If it is not 0 or in 1000 … 20
    /// 000, the answer is Code.Invalid</summary>
    public uint MaxSilenceUs;

    public void Clear() {
      Share = 0;
      Floor = 0;
      MaxSilenceUs = 0;
    }

    public void CopyFrom(SetStateDeadband other) {
      Share = other.Share;
      Floor = other.Floor;
      MaxSilenceUs = other.MaxSilenceUs;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (!(Share >= -1e12 && Share <= 1e12)) return "share";
      if (!(Floor >= -1e12 && Floor <= 1e12)) return "floor_mps";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 9:
            Share = r.Double();
            break;
          case 17:
            Floor = r.Double();
            break;
          case 24:
            MaxSilenceUs = r.UInt32();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.Double(9, Share);
      w.Double(17, Floor);
      w.UInt32(24, MaxSilenceUs);
    }
  }

  /// <summary>Clears a latched fault and revokes a Disarm. Can only be used by controllers of the device. If the device
  /// has a safety layer, this is a request of the operator to arm it.</summary>
  public sealed class Rearm {
    public uint Device;

    public void Clear() {
      Device = 0;
    }

    public void CopyFrom(Rearm other) {
      Device = other.Device;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Device > 15) return "device";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Device = r.UInt32();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt32(8, Device);
    }
  }

  /// <summary>Sets the force to zero without a ramp, from the next haptic step until a Rearm. Can be used by any
  /// controller of the device, even if it does not hold the channel. This state does not end if there is a new force or
  /// a new session, or if only the dead man's button is pressed. The Safety of the device changes from armed to homed,
  /// and pending requests to arm it are withdrawn. A Disarm is not a fault and does not clear faults. If it is
  /// repeated, it has no effect. If the answer is Code.Ok, the loop of the device will receive the order before its
  /// next step.</summary>
  public sealed class Disarm {
    public uint Device;

    public void Clear() {
      Device = 0;
    }

    public void CopyFrom(Disarm other) {
      Device = other.Device;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Device > 15) return "device";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Device = r.UInt32();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt32(8, Device);
    }
  }

  /// <summary>Offers the sender's device as the other end of a coupling with this device, and describes that end. Can
  /// only be used by a client that has claimed the channel as a controller, and requires the feature "teleoperation".
  /// If the two ends match, the answer is Code.Ok. After that, both peers send PortState frames, and the server does
  /// not send states. Code.Invalid is returned if the ends do not match, and the detail contains the first difference.
  /// Code.Unsupported is returned if this device cannot be coupled. Code.Busy is returned if the channel is coupled
  /// with another client. A follower has one channel for each of its leaders.</summary>
  public sealed class Couple {
    /// <summary>The device of the server</summary>
    public uint Device;
    /// <summary>The channel of the server</summary>
    public uint Channel;
    /// <summary>The role of the sender. The device of the server has the other role</summary>
    public PortRole Role;
    public CouplingMethod Method;
    /// <summary>The follower's motion divided by the leader's</summary>
    public double PositionScale;
    /// <summary>The leader's force divided by the follower's</summary>
    public double ForceScale;
    /// <summary>The rotation from the base frame of the leader to that of the follower</summary>
    public Quat Rotation;
    /// <summary>Bits 1, 2 and 4 are set if x, y and z of the leader's frame are coupled</summary>
    public uint Axes;
    /// <summary>N/m, the stiffness between the handles, as felt by the leader</summary>
    public double Stiffness;
    /// <summary>N·s/m, the damping between the handles, as felt by the leader</summary>
    public double MutualDamping;
    /// <summary>N·s/m, the damping of each handle, as felt by the leader</summary>
    public double Damping;
    /// <summary>If true, the stiffness decreases when the round trip increases</summary>
    public bool AdaptToDelay;
    /// <summary>If true, the ends exchange energy (core/teleoperation/energy_tank.h)</summary>
    public bool Purse;
    /// <summary>The period in which the sender sends PortState frames</summary>
    public uint PeriodUs;
    /// <summary>If true, positions map to positions. The offsets are zero, and the ends are aligned before they are
    /// engaged</summary>
    public bool Absolute;
    // As felt by the leader. With a stiffness of 0 the part is not coupled:
    /// <summary>N·m/rad, the stiffness between the orientations</summary>
    public double TurnStiffness;
    /// <summary>N·m·s/rad, the damping between the orientations</summary>
    public double TurnDamping;
    /// <summary>N/m, the stiffness between the grippers at the fingers of the leader</summary>
    public double GripStiffness;
    /// <summary>N·s/m, the damping between the grippers</summary>
    public double GripDamping;
    // For one method only:
    /// <summary>1/s. The rate at which the follower corrects its drift, for CouplingMethod.Passivity</summary>
    public double DriftRate;
    /// <summary>The parameters of CouplingMethod.Rate, which are absent for other methods</summary>
    public bool HasRate;
    public readonly RateControl Rate = new RateControl();

    public void Clear() {
      Device = 0;
      Channel = 0;
      Role = default(PortRole);
      Method = default(CouplingMethod);
      PositionScale = 0;
      ForceScale = 0;
      Rotation = default(Quat);
      Axes = 0;
      Stiffness = 0;
      MutualDamping = 0;
      Damping = 0;
      AdaptToDelay = false;
      Purse = false;
      PeriodUs = 0;
      Absolute = false;
      TurnStiffness = 0;
      TurnDamping = 0;
      GripStiffness = 0;
      GripDamping = 0;
      DriftRate = 0;
      HasRate = false;
      Rate.Clear();
    }

    public void CopyFrom(Couple other) {
      Device = other.Device;
      Channel = other.Channel;
      Role = other.Role;
      Method = other.Method;
      PositionScale = other.PositionScale;
      ForceScale = other.ForceScale;
      Rotation = other.Rotation;
      Axes = other.Axes;
      Stiffness = other.Stiffness;
      MutualDamping = other.MutualDamping;
      Damping = other.Damping;
      AdaptToDelay = other.AdaptToDelay;
      Purse = other.Purse;
      PeriodUs = other.PeriodUs;
      Absolute = other.Absolute;
      TurnStiffness = other.TurnStiffness;
      TurnDamping = other.TurnDamping;
      GripStiffness = other.GripStiffness;
      GripDamping = other.GripDamping;
      DriftRate = other.DriftRate;
      HasRate = other.HasRate;
      Rate.CopyFrom(other.Rate);
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Device > 15) return "device";
      if (Channel > 7) return "channel";
      if ((int)Role < 1 || (int)Role > 2) return "role";
      if ((int)Method < 1 || (int)Method > 7) return "method";
      if (!(PositionScale >= 0.01 && PositionScale <= 100)) return "position_scale";
      if (!(ForceScale >= 0.01 && ForceScale <= 100)) return "force_scale";
      if (!Bounds.IsRotation(Rotation)) return "rotation";
      if (Axes < 1 || Axes > 7) return "axes";
      if (!(Stiffness >= 0 && Stiffness <= 1e12)) return "stiffness_npm";
      if (!(MutualDamping >= 0 && MutualDamping <= 1e12)) return "mutual_damping_nspm";
      if (!(Damping >= 0 && Damping <= 1e12)) return "damping_nspm";
      if (PeriodUs < 1 || PeriodUs > 10000000) return "period_us";
      if (!(TurnStiffness >= 0 && TurnStiffness <= 1e12)) return "turn_stiffness_nmprad";
      if (!(TurnDamping >= 0 && TurnDamping <= 1e12)) return "turn_damping_nmsprad";
      if (!(GripStiffness >= 0 && GripStiffness <= 1e12)) return "grip_stiffness_npm";
      if (!(GripDamping >= 0 && GripDamping <= 1e12)) return "grip_damping_nspm";
      if (!(DriftRate >= 0 && DriftRate <= 1e12)) return "drift_rate_per_s";
      string rate = HasRate ? Rate.Objection() : null;
      if (rate != null) return "rate." + rate;
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
            Role = (PortRole)(int)r.UInt32();
            break;
          case 32:
            Method = (CouplingMethod)(int)r.UInt32();
            break;
          case 41:
            PositionScale = r.Double();
            break;
          case 49:
            ForceScale = r.Double();
            break;
          case 58:
            Rotation = r.Quat(Rotation);
            break;
          case 64:
            Axes = r.UInt32();
            break;
          case 73:
            Stiffness = r.Double();
            break;
          case 81:
            MutualDamping = r.Double();
            break;
          case 89:
            Damping = r.Double();
            break;
          case 96:
            AdaptToDelay = r.Bool();
            break;
          case 104:
            Purse = r.Bool();
            break;
          case 112:
            PeriodUs = r.UInt32();
            break;
          case 120:
            Absolute = r.Bool();
            break;
          case 129:
            TurnStiffness = r.Double();
            break;
          case 137:
            TurnDamping = r.Double();
            break;
          case 145:
            GripStiffness = r.Double();
            break;
          case 153:
            GripDamping = r.Double();
            break;
          case 161:
            DriftRate = r.Double();
            break;
          case 170:
            HasRate = true;
            {
              int end = r.Enter();
              Rate.Read(ref r);
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
      w.UInt32(8, Device);
      w.UInt32(16, Channel);
      w.UInt32(24, (uint)Role);
      w.UInt32(32, (uint)Method);
      w.Double(41, PositionScale);
      w.Double(49, ForceScale);
      w.Quat(58, Rotation);
      w.UInt32(64, Axes);
      w.Double(73, Stiffness);
      w.Double(81, MutualDamping);
      w.Double(89, Damping);
      w.Bool(96, AdaptToDelay);
      w.Bool(104, Purse);
      w.UInt32(112, PeriodUs);
      w.Bool(120, Absolute);
      w.Double(129, TurnStiffness);
      w.Double(137, TurnDamping);
      w.Double(145, GripStiffness);
      w.Double(153, GripDamping);
      w.Double(161, DriftRate);
      if (HasRate) {
        int begin = w.Begin(170);
        Rate.Write(ref w);
        w.End(begin);
      }
    }
  }

  /// <summary>Describes how the displacement of the leader's handle sets the speed of the follower. A spring pulls the
  /// handle to its center. All values use the scale of the leader.</summary>
  public sealed class RateControl {
    /// <summary>M. If the leader is closer to its center than this distance, the follower does not move</summary>
    public double DeadZone;
    /// <summary>1/s, the speed of the follower per meter of displacement beyond the dead zone</summary>
    public double Gain;
    /// <summary>M/s, the maximum speed of the follower</summary>
    public double MaxSpeed;

    public void Clear() {
      DeadZone = 0;
      Gain = 0;
      MaxSpeed = 0;
    }

    public void CopyFrom(RateControl other) {
      DeadZone = other.DeadZone;
      Gain = other.Gain;
      MaxSpeed = other.MaxSpeed;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (!(DeadZone >= 0 && DeadZone <= 1e12)) return "dead_zone_m";
      if (!(Gain > 0 && Gain <= 1e12)) return "gain_per_s";
      if (!(MaxSpeed > 0 && MaxSpeed <= 1e12)) return "max_speed_mps";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 9:
            DeadZone = r.Double();
            break;
          case 17:
            Gain = r.Double();
            break;
          case 25:
            MaxSpeed = r.Double();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.Double(9, DeadZone);
      w.Double(17, Gain);
      w.Double(25, MaxSpeed);
    }
  }

  /// <summary>Engages the coupling on the command of the operator. Can only be used by controllers of the leader's
  /// device, at its server. If the answer is Code.Ok, the loop of the device has received the order. Code.Unsupported
  /// is returned if the device is not coupled, or if it is the follower.</summary>
  public sealed class Engage {
    public uint Device;

    public void Clear() {
      Device = 0;
    }

    public void CopyFrom(Engage other) {
      Device = other.Device;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Device > 15) return "device";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Device = r.UInt32();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt32(8, Device);
    }
  }

  /// <summary>Ends the engagement. Can be used at the server of either end, but only by controllers of its
  /// device.</summary>
  public sealed class Disengage {
    public uint Device;

    public void Clear() {
      Device = 0;
    }

    public void CopyFrom(Disengage other) {
      Device = other.Device;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Device > 15) return "device";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Device = r.UInt32();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt32(8, Device);
    }
  }

  /// <summary>Sets the scales of the coupling. Can only be used by controllers of the leader's device, at its server.
  /// If the answer is Code.Ok, the loop of the device has received the order. Code.Busy is returned if the leader is
  /// engaged and its clutch is not held. Code.Unsupported is returned if the device is not coupled, or if it is the
  /// follower.</summary>
  public sealed class SetScale {
    public uint Device;
    /// <summary>As in Couple</summary>
    public double PositionScale;
    /// <summary>As in Couple</summary>
    public double ForceScale;

    public void Clear() {
      Device = 0;
      PositionScale = 0;
      ForceScale = 0;
    }

    public void CopyFrom(SetScale other) {
      Device = other.Device;
      PositionScale = other.PositionScale;
      ForceScale = other.ForceScale;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Device > 15) return "device";
      if (!(PositionScale >= 0.01 && PositionScale <= 100)) return "position_scale";
      if (!(ForceScale >= 0.01 && ForceScale <= 100)) return "force_scale";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Device = r.UInt32();
            break;
          case 17:
            PositionScale = r.Double();
            break;
          case 25:
            ForceScale = r.Double();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt32(8, Device);
      w.Double(17, PositionScale);
      w.Double(25, ForceScale);
    }
  }

  /// <summary>Sets the weight of the leader of one channel if a follower has several leaders. Can only be used by
  /// controllers of the follower's device, at its server. The weight reaches the value within 0.5 s, and the ratios of
  /// the other weights do not change. Code.Unsupported is returned if the device is not coupled, if it only has one
  /// leader, or if it is a leader.</summary>
  public sealed class SetShare {
    public uint Device;
    public uint Channel;
    public double Share;

    public void Clear() {
      Device = 0;
      Channel = 0;
      Share = 0;
    }

    public void CopyFrom(SetShare other) {
      Device = other.Device;
      Channel = other.Channel;
      Share = other.Share;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Device > 15) return "device";
      if (Channel > 7) return "channel";
      if (!(Share >= 0 && Share <= 1)) return "share";
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
          case 25:
            Share = r.Double();
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
      w.Double(25, Share);
    }
  }

  /// <summary>Sets a lamp of the device or starts a vibration pulse. Can only be used by a controller that holds one of
  /// the channels of the device, and requires the feature "outputs". An output is turned off if the client that has set
  /// it gives up or loses a channel of the device, or if the device is disarmed. Code.Invalid is returned if the device
  /// does not have this output, if the output is of the other kind, or if both `rgb` and `vibration` are
  /// missing.</summary>
  public sealed class SetOutput {
    /// <summary>The member that is present.</summary>
    public enum SettingCase {
      None = 0,
      Rgb = 3,
      Vibration = 4,
    }

    public SettingCase Setting;
    public uint Device;
    /// <summary>The index in HandleDescription.Outputs. If the device does not have this output, the answer is
    /// Code.Invalid</summary>
    public uint Output;
    /// <summary>The color of a lamp as 0xRRGGBB. If it is 0, the lamp shows the state of the device</summary>
    public uint Rgb;
    public readonly Vibration Vibration = new Vibration();

    public void Clear() {
      Setting = SettingCase.None;
      Device = 0;
      Output = 0;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Device > 15) return "device";
      if (Setting == SettingCase.None) return "setting";
      if (Output > 7) return "output";
      if (Setting == SettingCase.Rgb && Rgb > 16777215) return "rgb";
      string vibration = Setting == SettingCase.Vibration ? Vibration.Objection() : null;
      if (vibration != null) return "vibration." + vibration;
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Device = r.UInt32();
            break;
          case 16:
            Output = r.UInt32();
            break;
          case 29:
            Setting = SettingCase.Rgb;
            Rgb = r.Fixed32();
            break;
          case 34:
            if (Setting != SettingCase.Vibration) Vibration.Clear();
            Setting = SettingCase.Vibration;
            {
              int end = r.Enter();
              Vibration.Read(ref r);
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
      w.UInt32(8, Device);
      w.UInt32(16, Output);
      if (Setting == SettingCase.Rgb) w.PresentFixed32(29, Rgb);
      if (Setting == SettingCase.Vibration) {
        int begin = w.Begin(34);
        Vibration.Write(ref w);
        w.End(begin);
      }
    }
  }

  /// <summary>A vibration pulse. It stops after its duration, or if it is replaced by a new pulse.</summary>
  public sealed class Vibration {
    /// <summary>The fraction of the maximum of the output. If it is 0, the output is turned off</summary>
    public double Amplitude;
    /// <summary>Hz, either 0 or at least 20. If it is 0, the frequency is chosen by the output</summary>
    public double Frequency;
    public uint DurationMs;

    public void Clear() {
      Amplitude = 0;
      Frequency = 0;
      DurationMs = 0;
    }

    public void CopyFrom(Vibration other) {
      Amplitude = other.Amplitude;
      Frequency = other.Frequency;
      DurationMs = other.DurationMs;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (!(Amplitude >= 0 && Amplitude <= 1)) return "amplitude";
      if (!(Frequency >= 0 && Frequency <= 1000)) return "frequency_hz";
      if (!(Frequency == 0 || Frequency >= 20)) return "frequency_hz";
      if (DurationMs > 10000) return "duration_ms";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 9:
            Amplitude = r.Double();
            break;
          case 17:
            Frequency = r.Double();
            break;
          case 24:
            DurationMs = r.UInt32();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.Double(9, Amplitude);
      w.Double(17, Frequency);
      w.UInt32(24, DurationMs);
    }
  }

  /// <summary>Requests the DeviceDescription of a device, which does not need to be claimed.</summary>
  public sealed class Describe {
    /// <summary>If the server does not have this device, the answer is Code.Invalid</summary>
    public uint Device;
    /// <summary>If true, the HandleDescription is requested instead. This requires the feature "handle"</summary>
    public bool Handle;

    public void Clear() {
      Device = 0;
      Handle = false;
    }

    public void CopyFrom(Describe other) {
      Device = other.Device;
      Handle = other.Handle;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Device > 15) return "device";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Device = r.UInt32();
            break;
          case 16:
            Handle = r.Bool();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt32(8, Device);
      w.Bool(16, Handle);
    }
  }

  /// <summary>Requests the lease of a channel. Can only be used by a client that has claimed the channel as a
  /// controller. If the answer is Code.Ok, the client holds the lease and its forces are used. If another client holds
  /// the lease, the answer is Code.Busy, and WaitMs is the time until the lease ends if it is not renewed.</summary>
  public sealed class TakeLease {
    public uint Device;
    public uint Channel;

    public void Clear() {
      Device = 0;
      Channel = 0;
    }

    public void CopyFrom(TakeLease other) {
      Device = other.Device;
      Channel = other.Channel;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Device > 15) return "device";
      if (Channel > 7) return "channel";
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
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt32(8, Device);
      w.UInt32(16, Channel);
    }
  }

  /// <summary>Releases the lease of a channel.</summary>
  public sealed class GiveLease {
    public uint Device;
    public uint Channel;

    public void Clear() {
      Device = 0;
      Channel = 0;
    }

    public void CopyFrom(GiveLease other) {
      Device = other.Device;
      Channel = other.Channel;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Device > 15) return "device";
      if (Channel > 7) return "channel";
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
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt32(8, Device);
      w.UInt32(16, Channel);
    }
  }

  /// <summary>Notifies a client with the feature "channels" that the lease of the channel was taken by another
  /// client.</summary>
  public sealed class LeaseLost {
    public uint Device;
    public uint Channel;
    /// <summary>The name of the new holder</summary>
    public string To = "";

    public void Clear() {
      Device = 0;
      Channel = 0;
      To = "";
    }

    public void CopyFrom(LeaseLost other) {
      Device = other.Device;
      Channel = other.Channel;
      To = other.To;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Device > 15) return "device";
      if (Channel > 7) return "channel";
      if (!Bounds.IsText(To, 64)) return "to";
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
            To = r.Text();
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
      w.Text(26, To, 64);
    }
  }

  /// <summary>The answer to a Control.</summary>
  public sealed class ControlAck {
    /// <summary>The id of the Control that is answered</summary>
    public uint Id;
    public Code Code;
    /// <summary>Explanation for people</summary>
    public string Detail = "";
    /// <summary>If the answer to TakeLease is Code.Busy, this is the time until the lease ends if it is not renewed, or
    /// 0 if it is unknown</summary>
    public uint WaitMs;
    /// <summary>The answer to a Describe with Code.Ok</summary>
    public bool HasDevice;
    public readonly DeviceDescription Device = new DeviceDescription();
    /// <summary>The answer to a Describe with Code.Ok if `handle` was set</summary>
    public bool HasHandle;
    public readonly HandleDescription Handle = new HandleDescription();

    public void Clear() {
      Id = 0;
      Code = default(Code);
      Detail = "";
      WaitMs = 0;
      HasDevice = false;
      Device.Clear();
      HasHandle = false;
      Handle.Clear();
    }

    public void CopyFrom(ControlAck other) {
      Id = other.Id;
      Code = other.Code;
      Detail = other.Detail;
      WaitMs = other.WaitMs;
      HasDevice = other.HasDevice;
      Device.CopyFrom(other.Device);
      HasHandle = other.HasHandle;
      Handle.CopyFrom(other.Handle);
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Id < 1) return "id";
      if ((int)Code < 1 || (int)Code > 9) return "code";
      if (!Bounds.IsText(Detail, 128)) return "detail";
      if (WaitMs > 3600000) return "wait_ms";
      string device = HasDevice ? Device.Objection() : null;
      if (device != null) return "device." + device;
      string handle = HasHandle ? Handle.Objection() : null;
      if (handle != null) return "handle." + handle;
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Id = r.UInt32();
            break;
          case 16:
            Code = (Code)(int)r.UInt32();
            break;
          case 26:
            Detail = r.Text();
            break;
          case 32:
            WaitMs = r.UInt32();
            break;
          case 42:
            HasDevice = true;
            {
              int end = r.Enter();
              Device.Read(ref r);
              r.Leave(end);
            }
            break;
          case 50:
            HasHandle = true;
            {
              int end = r.Enter();
              Handle.Read(ref r);
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
      w.UInt32(8, Id);
      w.UInt32(16, (uint)Code);
      w.Text(26, Detail, 128);
      w.UInt32(32, WaitMs);
      if (HasDevice) {
        int begin = w.Begin(42);
        Device.Write(ref w);
        w.End(begin);
      }
      if (HasHandle) {
        int begin = w.Begin(50);
        Handle.Write(ref w);
        w.End(begin);
      }
    }
  }

  /// <summary>The properties of a device.</summary>
  public sealed class DeviceDescription {
    public uint Device;
    /// <summary>The name of the device, which can be used in a claim</summary>
    public string Name = "";
    /// <summary>The kind of device, as in Welcome.DeviceName</summary>
    public string Model = "";
    /// <summary>The number of axes that are measured</summary>
    public uint PositionDof;
    /// <summary>The number of axes that have a motor</summary>
    public uint ForceDof;
    /// <summary>M. The minimum corner of the workspace of the handle. Both corners are null if the workspace is
    /// unknown</summary>
    public Vec3? WorkspaceMin;
    /// <summary>M. The maximum corner. If only one of the corners is present, the message is refused</summary>
    public Vec3 WorkspaceMax;
    /// <summary>N, the maximum norm of the force, or 0 if it is unknown</summary>
    public double MaxForce;
    /// <summary>N. The maximum norm of the force that has no time limit, or 0 if it is unknown</summary>
    public double ContinuousForce;
    /// <summary>N/m, the maximum stiffness that is rendered stably, or 0 if it is unknown</summary>
    public double MaxStiffness;
    /// <summary>M. The size of an encoder count at the handle, or 0 if the position is exact</summary>
    public double PositionResolution;
    /// <summary>Haptic steps per second</summary>
    public uint LoopHz;
    /// <summary>The channels of the device, in the order of their numbers</summary>
    public readonly List<ChannelDescription> Channels = new List<ChannelDescription>();

    public void Clear() {
      Device = 0;
      Name = "";
      Model = "";
      PositionDof = 0;
      ForceDof = 0;
      WorkspaceMin = null;
      WorkspaceMax = default(Vec3);
      MaxForce = 0;
      ContinuousForce = 0;
      MaxStiffness = 0;
      PositionResolution = 0;
      LoopHz = 0;
      Channels.Clear();
    }

    public void CopyFrom(DeviceDescription other) {
      Device = other.Device;
      Name = other.Name;
      Model = other.Model;
      PositionDof = other.PositionDof;
      ForceDof = other.ForceDof;
      WorkspaceMin = other.WorkspaceMin;
      WorkspaceMax = other.WorkspaceMax;
      MaxForce = other.MaxForce;
      ContinuousForce = other.ContinuousForce;
      MaxStiffness = other.MaxStiffness;
      PositionResolution = other.PositionResolution;
      LoopHz = other.LoopHz;
      Channels.Clear();
      Channels.AddRange(other.Channels);
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Device > 15) return "device";
      if (!Bounds.IsText(Name, 24)) return "name";
      if (!Bounds.IsText(Model, 64)) return "model";
      if (PositionDof < 1 || PositionDof > 6) return "position_dof";
      if (ForceDof < 1 || ForceDof > 6) return "force_dof";
      if (!Bounds.IsVec3(WorkspaceMin ?? default(Vec3))) return "workspace_min_m";
      if (!Bounds.IsVec3(WorkspaceMax)) return "workspace_max_m";
      if (!(MaxForce >= 0 && MaxForce <= 1e12)) return "max_force_n";
      if (!(ContinuousForce >= 0 && ContinuousForce <= 1e12)) return "continuous_force_n";
      if (!(MaxStiffness >= 0 && MaxStiffness <= 1e12)) return "max_stiffness_npm";
      if (!(PositionResolution >= 0 && PositionResolution <= 1e12)) return "position_resolution_m";
      if (LoopHz < 1 || LoopHz > 1000000) return "loop_hz";
      if (Channels.Count < 1 || Channels.Count > 8 || Channels.Exists(one => one.Objection() != null)) return "channels";
      if (!Bounds.IsBox(WorkspaceMin, WorkspaceMax)) return "workspace_min_m";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Device = r.UInt32();
            break;
          case 18:
            Name = r.Text();
            break;
          case 26:
            Model = r.Text();
            break;
          case 32:
            PositionDof = r.UInt32();
            break;
          case 40:
            ForceDof = r.UInt32();
            break;
          case 50:
            WorkspaceMin = r.Vec3(WorkspaceMin ?? default(Vec3));
            break;
          case 58:
            WorkspaceMax = r.Vec3(WorkspaceMax);
            break;
          case 65:
            MaxForce = r.Double();
            break;
          case 73:
            ContinuousForce = r.Double();
            break;
          case 81:
            MaxStiffness = r.Double();
            break;
          case 89:
            PositionResolution = r.Double();
            break;
          case 96:
            LoopHz = r.UInt32();
            break;
          case 106:
            var channelDescription = new ChannelDescription();
            {
              int end = r.Enter();
              channelDescription.Read(ref r);
              r.Leave(end);
            }
            Channels.Add(channelDescription);
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt32(8, Device);
      w.Text(18, Name, 24);
      w.Text(26, Model, 64);
      w.UInt32(32, PositionDof);
      w.UInt32(40, ForceDof);
      if (WorkspaceMin.HasValue) w.PresentVec3(50, WorkspaceMin.Value);
      w.Vec3(58, WorkspaceMax);
      w.Double(65, MaxForce);
      w.Double(73, ContinuousForce);
      w.Double(81, MaxStiffness);
      w.Double(89, PositionResolution);
      w.UInt32(96, LoopHz);
      for (int i = 0; i < Channels.Count && i < 8; ++i) {
        int begin = w.Begin(106);
        Channels[i].Write(ref w);
        w.End(begin);
      }
    }
  }

  /// <summary>The properties of the handle of a device. Requires the feature "handle".</summary>
  public sealed class HandleDescription {
    public uint Device;
    /// <summary>The rotation from the base frame of the device to the frame of the operator, where x is to the right, y
    /// is up, and z is towards the user. Null if it is unknown</summary>
    public Quat? OperatorFromDevice;
    /// <summary>The name for each bit of DeviceState.Buttons. Names can be empty</summary>
    public readonly List<string> Buttons = new List<string>();
    /// <summary>If true, all states contain an orientation. Otherwise, none of them do</summary>
    public bool OrientationMeasured;
    /// <summary>N·m, the maximum norm of the torque, or 0 if the device cannot exert torques</summary>
    public double MaxTorque;
    /// <summary>Rad. The opening of the gripper if it is open. Null if there is no gripper</summary>
    public double? GripperOpen;
    /// <summary>N, the maximum force on the fingers, or 0 if the gripper has no motor</summary>
    public double MaxGripperForce;
    /// <summary>The name of a group of devices that belong together, such as two arms or five fingers. It is empty if
    /// the device is not part of a group</summary>
    public string Group = "";
    public Hand Hand;
    // With the feature "joints" only:
    /// <summary>The names of the joints, in the order of DeviceState.Joint</summary>
    public readonly List<string> Joints = new List<string>();
    // With the feature "outputs" only:
    /// <summary>The outputs that can be set using SetOutput, in the order of their numbers</summary>
    public readonly List<OutputDescription> Outputs = new List<OutputDescription>();

    public void Clear() {
      Device = 0;
      OperatorFromDevice = null;
      Buttons.Clear();
      OrientationMeasured = false;
      MaxTorque = 0;
      GripperOpen = null;
      MaxGripperForce = 0;
      Group = "";
      Hand = default(Hand);
      Joints.Clear();
      Outputs.Clear();
    }

    public void CopyFrom(HandleDescription other) {
      Device = other.Device;
      OperatorFromDevice = other.OperatorFromDevice;
      Buttons.Clear();
      Buttons.AddRange(other.Buttons);
      OrientationMeasured = other.OrientationMeasured;
      MaxTorque = other.MaxTorque;
      GripperOpen = other.GripperOpen;
      MaxGripperForce = other.MaxGripperForce;
      Group = other.Group;
      Hand = other.Hand;
      Joints.Clear();
      Joints.AddRange(other.Joints);
      Outputs.Clear();
      Outputs.AddRange(other.Outputs);
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Device > 15) return "device";
      if (OperatorFromDevice.HasValue && !Bounds.IsRotation(OperatorFromDevice.Value)) return "operator_from_device";
      if (!Bounds.AreTexts(Buttons, 16, 24)) return "buttons";
      if (!(MaxTorque >= 0 && MaxTorque <= 1e12)) return "max_torque_nm";
      if (GripperOpen.HasValue && !(GripperOpen.Value >= 0 && GripperOpen.Value <= 1e12)) return "gripper_open_rad";
      if (!(MaxGripperForce >= 0 && MaxGripperForce <= 1e12)) return "max_gripper_force_n";
      if (!Bounds.IsText(Group, 24)) return "group";
      if ((int)Hand < 0 || (int)Hand > 2) return "hand";
      if (!Bounds.AreTexts(Joints, 8, 24)) return "joints";
      if (Outputs.Count > 8 || Outputs.Exists(one => one.Objection() != null)) return "outputs";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Device = r.UInt32();
            break;
          case 18:
            OperatorFromDevice = r.Quat(OperatorFromDevice ?? default(Quat));
            break;
          case 26:
            Buttons.Add(r.Text());
            break;
          case 32:
            OrientationMeasured = r.Bool();
            break;
          case 41:
            MaxTorque = r.Double();
            break;
          case 49:
            GripperOpen = r.Double();
            break;
          case 57:
            MaxGripperForce = r.Double();
            break;
          case 66:
            Group = r.Text();
            break;
          case 72:
            Hand = (Hand)(int)r.UInt32();
            break;
          case 82:
            Joints.Add(r.Text());
            break;
          case 90:
            var outputDescription = new OutputDescription();
            {
              int end = r.Enter();
              outputDescription.Read(ref r);
              r.Leave(end);
            }
            Outputs.Add(outputDescription);
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt32(8, Device);
      if (OperatorFromDevice.HasValue) w.PresentQuat(18, OperatorFromDevice.Value);
      w.Texts(26, Buttons, 16, 24);
      w.Bool(32, OrientationMeasured);
      w.Double(41, MaxTorque);
      if (GripperOpen.HasValue) w.PresentDouble(49, GripperOpen.Value);
      w.Double(57, MaxGripperForce);
      w.Text(66, Group, 24);
      w.UInt32(72, (uint)Hand);
      w.Texts(82, Joints, 8, 24);
      for (int i = 0; i < Outputs.Count && i < 8; ++i) {
        int begin = w.Begin(90);
        Outputs[i].Write(ref w);
        w.End(begin);
      }
    }
  }

  /// <summary>An output of a device, in addition to its forces.</summary>
  public sealed class OutputDescription {
    public string Name = "";
    public OutputKind Kind;

    public void Clear() {
      Name = "";
      Kind = default(OutputKind);
    }

    public void CopyFrom(OutputDescription other) {
      Name = other.Name;
      Kind = other.Kind;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (!Bounds.IsText(Name, 24)) return "name";
      if ((int)Kind < 1 || (int)Kind > 2) return "kind";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 10:
            Name = r.Text();
            break;
          case 16:
            Kind = (OutputKind)(int)r.UInt32();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.Text(10, Name, 24);
      w.UInt32(16, (uint)Kind);
    }
  }

  /// <summary>The properties of a channel.</summary>
  public sealed class ChannelDescription {
    /// <summary>The name that is used in a claim</summary>
    public string Name = "";
    public ChannelRule Rule;
    /// <summary>If the holder does not send a force for this time, another client can take the lease. It is 0 if the
    /// lease does not expire</summary>
    public uint LeaseMs;
    /// <summary>The first 24 bytes of the name of the holder. It is empty if there is no holder</summary>
    public string Holder = "";

    public void Clear() {
      Name = "";
      Rule = default(ChannelRule);
      LeaseMs = 0;
      Holder = "";
    }

    public void CopyFrom(ChannelDescription other) {
      Name = other.Name;
      Rule = other.Rule;
      LeaseMs = other.LeaseMs;
      Holder = other.Holder;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (!Bounds.IsText(Name, 24)) return "name";
      if ((int)Rule < 1 || (int)Rule > 2) return "rule";
      if (LeaseMs > 3600000) return "lease_ms";
      if (!Bounds.IsText(Holder, 24)) return "holder";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 10:
            Name = r.Text();
            break;
          case 16:
            Rule = (ChannelRule)(int)r.UInt32();
            break;
          case 24:
            LeaseMs = r.UInt32();
            break;
          case 34:
            Holder = r.Text();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.Text(10, Name, 24);
      w.UInt32(16, (uint)Rule);
      w.UInt32(24, LeaseMs);
      w.Text(34, Holder, 24);
    }
  }
}
