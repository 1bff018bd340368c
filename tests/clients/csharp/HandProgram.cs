// SPDX-License-Identifier: Apache-2.0
// Plays the part of Unity: enables a TendonHand, calls FixedUpdate 50 times a second, and disables it.
//
//     mono hand.exe --server HOST:PORT --seconds S [--key FILE] [--pause-at S --pause S] [--valid-for S] [--throw]
//                   [--no-stiffness]
//     mono hand.exe --server HOST:PORT --turns N
//
// The hand feels a wall of 1000 N/m at Unity's x = 0. The last line of the output is a summary in JSON. With --turns, it
// is HapticClient.Run instead, with a spring, and the summary has the bytes that N turns have allocated.
using System;
using System.Collections.Generic;
using System.Diagnostics;
using System.Globalization;
using System.Threading;
using Tendon.Unity;
using UnityEngine;

namespace Tendon.Tests {
  public sealed class Wall : TendonHand {
    internal const float StiffnessNpm = 1000;
    internal int Touches;
    internal bool Throws;
    internal bool SendsStiffness = true;
    internal double MostForce;

    protected override HandForce Touch(HandState hand) {
      ++Touches;
      if (Throws) throw new Exception("a bug in the game");
      MostForce = Math.Max(MostForce, -hand.ForceApplied.x);
      float depth = hand.Position.x;
      if (depth <= 0) return default(HandForce);
      var force = new HandForce { Force = new Vector3(-StiffnessNpm * depth, 0, 0), Normal = new Vector3(1, 0, 0) };
      if (SendsStiffness) force.Stiffness = StiffnessNpm;
      return force;
    }

    internal void Enable() => OnEnable();
    internal void Disable() => OnDisable();
    internal void Step() => FixedUpdate();
  }

  public static class HandProgram {
    public static int Main(string[] words) {
      var options = new Dictionary<string, string>();
      for (int i = 0; i < words.Length; ++i) {
        if (words[i] == "--throw" || words[i] == "--no-stiffness") options[words[i]] = "";
        else options[words[i]] = words[++i];
      }
      Func<string, double, double> number = (name, otherwise) =>
        options.TryGetValue(name, out string text) ? double.Parse(text, CultureInfo.InvariantCulture) : otherwise;
      if (options.ContainsKey("--turns")) return Turns(options["--server"], (int)number("--turns", 0));
      var hand = new Wall { server = options["--server"], Throws = options.ContainsKey("--throw") };
      hand.SendsStiffness = !options.ContainsKey("--no-stiffness");
      if (options.TryGetValue("--key", out string key)) hand.keyFile = key;
      hand.validForSeconds = (float)number("--valid-for", 0.06);
      double seconds = number("--seconds", 5), pauseAt = number("--pause-at", 1e9);
      double pauseEnd = pauseAt + number("--pause", 0);
      hand.Enable();
      var clock = Stopwatch.StartNew();
      long allocated = 0, steps = 0, measured = 0;
      for (double next = 0; clock.Elapsed.TotalSeconds < seconds; next += 0.02) {
        double wait = next - clock.Elapsed.TotalSeconds;
        if (wait > 0) Thread.Sleep((int)(1000 * wait) + 1);
        double now = clock.Elapsed.TotalSeconds;
        if (now >= pauseAt && now < pauseEnd || !hand.enabled) continue;
        long before = GC.GetAllocatedBytesForCurrentThread();
        hand.Step();
        if (++steps > 100 && hand.Touches > 50) {
          allocated += GC.GetAllocatedBytesForCurrentThread() - before;
          ++measured;
        }
      }
      string status = hand.enabled ? hand.Status : "disabled";
      hand.Disable();
      foreach (string said in UnityEngine.Debug.Said) Console.WriteLine(said);
      string force = hand.MostForce.ToString(CultureInfo.InvariantCulture), enabled = hand.enabled ? "true" : "false";
      Console.WriteLine($"{{\"touches\":{hand.Touches},\"most_force_n\":{force},\"measured\":{measured}," +
                        $"\"allocated\":{allocated},\"status\":\"{status}\",\"enabled\":{enabled}}}");
      return 0;
    }

    private static int Turns(string server, int turns) {
      const int warmUp = 500;
      int turn = 0;
      long begin = 0;
      Physics spring = (hand, force) => {
        force.Force = -100 * hand.Position;
        force.HasModel = true;
        force.Model.At = hand.Position;
        force.Model.Stiffness.Set(100);
        if (++turn == warmUp) begin = GC.GetAllocatedBytesForCurrentThread();
      };
      using (var client = new HapticClient(server, new Config())) {
        var clock = Stopwatch.StartNew();
        client.Run(spring, () => {
          if (turn < warmUp + turns && clock.Elapsed.TotalSeconds < 60) return false;
          long allocated = GC.GetAllocatedBytesForCurrentThread() - begin;
          Console.WriteLine($"{{\"turns\":{turn - warmUp},\"allocated\":{allocated}}}");
          return true;
        });
      }
      return 0;
    }
  }
}
