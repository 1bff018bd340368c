// SPDX-License-Identifier: Apache-2.0
using System;
using System.Text;

namespace Tendon {
  /// <summary>How a client introduces itself, and what it asks for.</summary>
  public sealed class Config {
    /// <summary>For logs, 64 bytes of UTF-8 at most.</summary>
    public string Name = "csharp";

    /// <summary>Names of the device and of its channel; empty: the first. 24 bytes at most.</summary>
    public string Device = "";
    public string Channel = "";

    /// <summary>If true, the client only receives states.</summary>
    public bool Observe;

    /// <summary>States per second; 0: every one, which are 1000 on most devices.</summary>
    public uint RateHz;

    /// <summary>How long a force is valid, µs, 1 … 10 000 000. It should be at least three times the time between two
    /// answers.</summary>
    public uint ValidForUs = 20_000;

    /// <summary>null: suite 0, on this machine only.</summary>
    public KeyFile Key;

    /// <summary>If true, suite 2 (AES-256-GCM) is offered too. It is slower here than suite 1, and only needed if a
    /// server forbids suite 1.</summary>
    public bool OfferAes;

    /// <summary>Throws an ArgumentException that names the member and its bound.</summary>
    internal void Check() {
      CheckText("Name", Name, 64);
      CheckText("Device", Device, 24);
      CheckText("Channel", Channel, 24);
      if (ValidForUs < 1 || ValidForUs > 10_000_000) {
        throw new ArgumentException($"ValidForUs is {ValidForUs}, expected 1 … 10 000 000");
      }
      if (Key != null && Key.Role == Role.Observer && !Observe) {
        throw new ArgumentException("the key is an observer's: set Observe, or use a controller's key");
      }
    }

    private static void CheckText(string name, string value, int most) {
      int size = Encoding.UTF8.GetByteCount(value);
      if (size > most) throw new ArgumentException($"{name} has {size} bytes of UTF-8, expected at most {most}");
    }

    internal Hello Hello() {
      Role role = Observe ? Role.Observer : Role.Controller;
      var hello = new Hello { VersionMin = 1, VersionMax = 1, Role = role, Name = Name };
      hello.Features.AddRange(new[] { "local-model", "handle", "channels" });
      if (OfferAes && Key != null) hello.Features.Add(Opening.Aes);
      if (Device != "" || Channel != "") {
        hello.Claims.Add(new Claim { Device = Device, Channel = Observe ? "" : Channel, Role = role });
      }
      return hello;
    }
  }
}
