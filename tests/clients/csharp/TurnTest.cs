// SPDX-License-Identifier: Apache-2.0
using System;
using System.Diagnostics;

namespace Tendon.Tests {
  /// <summary>A turn is: a datagram with a state is opened and read, the state is answered with a force and its model,
  /// and the datagram is written and sealed.</summary>
  public static class TurnTest {
    /// <summary>The number of turns of suite 0. Ciphers take longer.</summary>
    private static readonly int Turns = int.Parse(Environment.GetEnvironmentVariable("TENDON_TURNS") ?? "1000000");

    public static void AMillionTurnsOfSuite0DoNotAllocate() => Measure("plain", Turns);
    public static void TurnsOfSuite1DoNotAllocate() => Measure("sealed", Turns / 10);
    public static void TurnsOfSuite2DoNotAllocate() => Measure("sealed_aes", Turns / 50);

    private static void Measure(string suite, int turns) {
      Json file = Json.Vectors(suite);
      var server = new FakeServer { Sealing = suite == "plain" ? null : VectorsTest.SealingOf(file, true, 0) };
      Sealing keys = suite == "plain" ? null : VectorsTest.SealingOf(file, false, 0);
      var session = new Session(FakeServer.Connection, keys, 0, server.Now);
      var hand = new DeviceState();
      var force = new ForceCommand();
      var datagram = new byte[1200];
      long allocated = 0, forces = 0;
      var watch = new Stopwatch();
      const int warmUp = 2000;
      for (int i = 0; i < turns + warmUp; ++i) {
        if (i == warmUp) {
          watch.Start();
          allocated = GC.GetAllocatedBytesForCurrentThread();
        }
        server.Now += Time.Millisecond / 100; // no key is renewed
        session.Receive(server.Now, server.Datagram, server.SayState((ulong)i + 1));
        if (session.HasState) {
          session.HasState = false;
          hand.CopyFrom(session.State);
          force.Clear();
          force.Sequence = (ulong)i + 1;
          force.BasedOnTick = hand.Tick;
          force.ValidForUs = 20_000;
          force.Force = -500 * hand.Position;
          force.HasModel = true;
          force.Model.At = hand.Position;
          force.Model.Stiffness.Set(500);
          if (force.Objection() == null) session.Send(force);
        }
        while (session.NextDatagram(server.Now, datagram) > 0) ++forces;
      }
      allocated = GC.GetAllocatedBytesForCurrentThread() - allocated;
      watch.Stop();
      Console.WriteLine($"      suite {file["suite"].Whole}: {turns} turns, {allocated} bytes, " +
               $"{watch.Elapsed.TotalMilliseconds * 1000 / turns:0.0} µs a turn with the server's half");
      Check.Equal((long)turns + warmUp, forces, "forces");
      Check.Equal(0L, allocated, "allocated bytes");
    }
  }
}
