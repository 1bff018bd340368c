// SPDX-License-Identifier: Apache-2.0
// Generated from protocol/wire/tendon.proto by protocol/generate. Do not edit.
using System.Collections.Generic;

namespace Tendon {
  /// <summary>The first message of a client.</summary>
  public sealed class Hello {
    /// <summary>The lowest version that is supported by the client. The highest common version is used</summary>
    public uint VersionMin;
    /// <summary>The highest version that is supported by the client</summary>
    public uint VersionMax;
    /// <summary>If there are claims, this is the highest role of them</summary>
    public Role Role;
    /// <summary>Name for logs</summary>
    public string Name = "";
    /// <summary>The features that are offered. A feature is used if both peers name it</summary>
    public readonly List<string> Features = new List<string>();
    /// <summary>The devices and channels that are claimed, without duplicates. If this is empty, the client is granted
    /// device 0 and its channel 0 with `role`</summary>
    public readonly List<Claim> Claims = new List<Claim>();
    // With the feature "ways" only:
    /// <summary>The names of the ways in which this engine can compute forces, starting with the fastest. They are used
    /// by ForceCommand.Way</summary>
    public readonly List<string> Ways = new List<string>();

    public void Clear() {
      VersionMin = 0;
      VersionMax = 0;
      Role = default(Role);
      Name = "";
      Features.Clear();
      Claims.Clear();
      Ways.Clear();
    }

    public void CopyFrom(Hello other) {
      VersionMin = other.VersionMin;
      VersionMax = other.VersionMax;
      Role = other.Role;
      Name = other.Name;
      Features.Clear();
      Features.AddRange(other.Features);
      Claims.Clear();
      Claims.AddRange(other.Claims);
      Ways.Clear();
      Ways.AddRange(other.Ways);
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (VersionMin < 1) return "version_min";
      if (!(VersionMin <= VersionMax)) return "version_min";
      if ((int)Role < 1 || (int)Role > 2) return "role";
      if (!Bounds.IsText(Name, 64)) return "name";
      if (!Bounds.AreTexts(Features, 16, 32)) return "features";
      if (Claims.Count > 16 || Claims.Exists(one => one.Objection() != null)) return "claims";
      if (!Bounds.AreTexts(Ways, 8, 24)) return "ways";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            VersionMin = r.UInt32();
            break;
          case 16:
            VersionMax = r.UInt32();
            break;
          case 24:
            Role = (Role)(int)r.UInt32();
            break;
          case 34:
            Name = r.Text();
            break;
          case 42:
            Features.Add(r.Text());
            break;
          case 50:
            var claim = new Claim();
            {
              int end = r.Enter();
              claim.Read(ref r);
              r.Leave(end);
            }
            Claims.Add(claim);
            break;
          case 58:
            Ways.Add(r.Text());
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt32(8, VersionMin);
      w.UInt32(16, VersionMax);
      w.UInt32(24, (uint)Role);
      w.Text(34, Name, 64);
      w.Texts(42, Features, 16, 32);
      for (int i = 0; i < Claims.Count && i < 16; ++i) {
        int begin = w.Begin(50);
        Claims[i].Write(ref w);
        w.End(begin);
      }
      w.Texts(58, Ways, 8, 24);
    }
  }

  /// <summary>Claims a device or a channel.</summary>
  public sealed class Claim {
    /// <summary>The name of the device, or empty for device 0</summary>
    public string Device = "";
    /// <summary>The name of the channel if the role is controller, or empty for channel 0</summary>
    public string Channel = "";
    public Role Role;

    public void Clear() {
      Device = "";
      Channel = "";
      Role = default(Role);
    }

    public void CopyFrom(Claim other) {
      Device = other.Device;
      Channel = other.Channel;
      Role = other.Role;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (!Bounds.IsText(Device, 24)) return "device";
      if (!Bounds.IsText(Channel, 24)) return "channel";
      if ((int)Role < 1 || (int)Role > 2) return "role";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 10:
            Device = r.Text();
            break;
          case 18:
            Channel = r.Text();
            break;
          case 24:
            Role = (Role)(int)r.UInt32();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.Text(10, Device, 24);
      w.Text(18, Channel, 24);
      w.UInt32(24, (uint)Role);
    }
  }

  /// <summary>The server's answer to a Hello.</summary>
  public sealed class Answer {
    /// <summary>The member that is present.</summary>
    public enum BodyCase {
      None = 0,
      Welcome = 1,
      Refused = 2,
    }

    public BodyCase Body;
    public readonly Welcome Welcome = new Welcome();
    public readonly Refused Refused = new Refused();

    public void Clear() {
      Body = BodyCase.None;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      string welcome = Body == BodyCase.Welcome ? Welcome.Objection() : null;
      if (welcome != null) return "welcome." + welcome;
      string refused = Body == BodyCase.Refused ? Refused.Objection() : null;
      if (refused != null) return "refused." + refused;
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 10:
            if (Body != BodyCase.Welcome) Welcome.Clear();
            Body = BodyCase.Welcome;
            {
              int end = r.Enter();
              Welcome.Read(ref r);
              r.Leave(end);
            }
            break;
          case 18:
            if (Body != BodyCase.Refused) Refused.Clear();
            Body = BodyCase.Refused;
            {
              int end = r.Enter();
              Refused.Read(ref r);
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
      if (Body == BodyCase.Welcome) {
        int begin = w.Begin(10);
        Welcome.Write(ref w);
        w.End(begin);
      }
      if (Body == BodyCase.Refused) {
        int begin = w.Begin(18);
        Refused.Write(ref w);
        w.End(begin);
      }
    }
  }

  /// <summary>The server accepts the client.</summary>
  public sealed class Welcome {
    /// <summary>The version of this session, which is in the range of the client</summary>
    public uint Version;
    /// <summary>The features that were named by both peers</summary>
    public readonly List<string> Features = new List<string>();
    /// <summary>Granted role</summary>
    public Role Role;
    /// <summary>The kind of device</summary>
    public string DeviceName = "";
    /// <summary>N, the maximum norm of the force</summary>
    public double MaxForce;
    /// <summary>M. The size of an encoder count at the handle, or 0 if the position is exact</summary>
    public double PositionResolution;
    /// <summary>Haptic steps per second</summary>
    public uint LoopHz;
    /// <summary>The server forgets the client if it is silent for this time</summary>
    public uint TimeoutMs;
    /// <summary>The name and the version of the server</summary>
    public string Server = "";
    /// <summary>One for each claim, in the same order. The fields DeviceName … LoopHz describe the device of the first
    /// one. Servers that do not support claims do not send any, and ignore the claims of the Hello</summary>
    public readonly List<Grant> Grants = new List<Grant>();

    public void Clear() {
      Version = 0;
      Features.Clear();
      Role = default(Role);
      DeviceName = "";
      MaxForce = 0;
      PositionResolution = 0;
      LoopHz = 0;
      TimeoutMs = 0;
      Server = "";
      Grants.Clear();
    }

    public void CopyFrom(Welcome other) {
      Version = other.Version;
      Features.Clear();
      Features.AddRange(other.Features);
      Role = other.Role;
      DeviceName = other.DeviceName;
      MaxForce = other.MaxForce;
      PositionResolution = other.PositionResolution;
      LoopHz = other.LoopHz;
      TimeoutMs = other.TimeoutMs;
      Server = other.Server;
      Grants.Clear();
      Grants.AddRange(other.Grants);
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Version < 1) return "version";
      if (!Bounds.AreTexts(Features, 16, 32)) return "features";
      if ((int)Role < 1 || (int)Role > 2) return "role";
      if (!Bounds.IsText(DeviceName, 64)) return "device_name";
      if (!(MaxForce >= 0 && MaxForce <= 1e12)) return "max_force_n";
      if (!(PositionResolution >= 0 && PositionResolution <= 1e12)) return "position_resolution_m";
      if (LoopHz < 1 || LoopHz > 1000000) return "loop_hz";
      if (TimeoutMs < 1 || TimeoutMs > 3600000) return "timeout_ms";
      if (!Bounds.IsText(Server, 64)) return "server";
      if (Grants.Count > 16 || Grants.Exists(one => one.Objection() != null)) return "grants";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Version = r.UInt32();
            break;
          case 18:
            Features.Add(r.Text());
            break;
          case 24:
            Role = (Role)(int)r.UInt32();
            break;
          case 34:
            DeviceName = r.Text();
            break;
          case 41:
            MaxForce = r.Double();
            break;
          case 49:
            PositionResolution = r.Double();
            break;
          case 56:
            LoopHz = r.UInt32();
            break;
          case 64:
            TimeoutMs = r.UInt32();
            break;
          case 74:
            Server = r.Text();
            break;
          case 82:
            var grant = new Grant();
            {
              int end = r.Enter();
              grant.Read(ref r);
              r.Leave(end);
            }
            Grants.Add(grant);
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt32(8, Version);
      w.Texts(18, Features, 16, 32);
      w.UInt32(24, (uint)Role);
      w.Text(34, DeviceName, 64);
      w.Double(41, MaxForce);
      w.Double(49, PositionResolution);
      w.UInt32(56, LoopHz);
      w.UInt32(64, TimeoutMs);
      w.Text(74, Server, 64);
      for (int i = 0; i < Grants.Count && i < 16; ++i) {
        int begin = w.Begin(82);
        Grants[i].Write(ref w);
        w.End(begin);
      }
    }
  }

  /// <summary>The numbers of a device and a channel that were claimed using their names.</summary>
  public sealed class Grant {
    /// <summary>The number of the device in all later messages</summary>
    public uint Device;
    /// <summary>The number of the channel in all later messages</summary>
    public uint Channel;
    /// <summary>The role that was granted. It is Role.Observer if a controller was claimed, but another client holds
    /// the lease (TakeLease)</summary>
    public Role Role;

    public void Clear() {
      Device = 0;
      Channel = 0;
      Role = default(Role);
    }

    public void CopyFrom(Grant other) {
      Device = other.Device;
      Channel = other.Channel;
      Role = other.Role;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if (Device > 15) return "device";
      if (Channel > 7) return "channel";
      if ((int)Role < 1 || (int)Role > 2) return "role";
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
            Role = (Role)(int)r.UInt32();
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
    }
  }

  /// <summary>The server refuses the client.</summary>
  public sealed class Refused {
    /// <summary>Why</summary>
    public Code Code;
    /// <summary>A sentence for people</summary>
    public string Detail = "";
    /// <summary>The lowest version that is supported by the server</summary>
    public uint VersionMin;
    /// <summary>The highest version that is supported by the server</summary>
    public uint VersionMax;

    public void Clear() {
      Code = default(Code);
      Detail = "";
      VersionMin = 0;
      VersionMax = 0;
    }

    public void CopyFrom(Refused other) {
      Code = other.Code;
      Detail = other.Detail;
      VersionMin = other.VersionMin;
      VersionMax = other.VersionMax;
    }

    /// <summary>The name of the first field that is out of bounds, or null.</summary>
    internal string Objection() {
      if ((int)Code < 1 || (int)Code > 9) return "code";
      if (!Bounds.IsText(Detail, 128)) return "detail";
      return null;
    }

    internal void Read(ref ProtoReader r) {
      while (r.Next()) {
        switch (r.Tag) {
          case 8:
            Code = (Code)(int)r.UInt32();
            break;
          case 18:
            Detail = r.Text();
            break;
          case 24:
            VersionMin = r.UInt32();
            break;
          case 32:
            VersionMax = r.UInt32();
            break;
          default:
            r.Skip();
            break;
        }
      }
    }

    internal void Write(ref ProtoWriter w) {
      w.UInt32(8, (uint)Code);
      w.Text(18, Detail, 128);
      w.UInt32(24, VersionMin);
      w.UInt32(32, VersionMax);
    }
  }
}
