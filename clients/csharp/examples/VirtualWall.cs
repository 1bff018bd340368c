// SPDX-License-Identifier: Apache-2.0
// A wall of 1000 N/m at x = 0, which pushes the hand towards −x.
//
//     mono virtual_wall.exe --server 127.0.0.1:47100 [--key wall.key] [--aes] [--rate HZ]
using System;
using System.IO;
using System.Threading;
using Tendon;

static class VirtualWall {
  private const double Stiffness = 1000; // N/m
  private static volatile bool _ending;
  private static readonly ManualResetEvent Ended = new ManualResetEvent(false);

  private static void Touch(DeviceState hand, ForceCommand force) {
    if (hand.Position.X <= 0) return; // no force
    force.Force = new Vec3(-Stiffness * hand.Position.X, 0, 0);
    force.HasModel = true; // the device evaluates it until the next answer
    force.Model.At = hand.Position;
    force.Model.Stiffness.Set(new Vec3(Stiffness, 0, 0));
  }

  private static uint Rate(string word) {
    if (uint.TryParse(word, out uint rate)) return rate;
    throw new ArgumentException($"--rate is \"{word}\", expected a whole number of Hz");
  }

  /// <summary>Ctrl-C and SIGTERM end the session with a Bye. SIGTERM is an event of its own in mono.</summary>
  private static void EndOnSignals() {
    Console.CancelKeyPress += (_, end) => _ending = end.Cancel = true;
#if MONO
    var terminated = new Mono.Unix.UnixSignal(Mono.Unix.Native.Signum.SIGTERM);
    new Thread(() => _ending = terminated.WaitOne()) { IsBackground = true }.Start();
#else
    AppDomain.CurrentDomain.ProcessExit += (_, end) => {
      _ending = true;
      Ended.WaitOne(1000); // until the Byes are sent
    };
#endif
  }

  private static int Main(string[] words) {
    string server = "127.0.0.1:47100";
    var config = new Config { Name = "virtual_wall" };
    try {
      for (int i = 0; i < words.Length; ++i) {
        if (words[i] == "--aes") config.OfferAes = true;
        else if (i + 1 == words.Length) throw new ArgumentException($"{words[i]} has no value, or is unknown");
        else if (words[i] == "--server") server = words[++i];
        else if (words[i] == "--key") config.Key = KeyFile.Load(words[++i]);
        else if (words[i] == "--rate") config.RateHz = Rate(words[++i]);
        else throw new ArgumentException($"{words[i]} is unknown");
      }
      using (var client = new HapticClient(server, config)) {
        EndOnSignals();
        string reason = client.Run(Touch, () => _ending);
        Ended.Set();
        Console.Error.WriteLine(reason);
        return _ending ? 0 : 1;
      }
    } catch (Exception error) when (error is ArgumentException || error is FormatException || error is IOException) {
      Console.Error.WriteLine($"virtual_wall: {error.Message}");
      return 2;
    }
  }
}
