// SPDX-License-Identifier: Apache-2.0
using System;

namespace Tendon.Tests {
  /// <summary>The session and the client with a server that is wrong, hostile or gone.</summary>
  public static class SessionTest {
    private static readonly string[] Suites = { "plain", "sealed", "sealed_aes" };

    private static ulong Sum(LinkStats stats) =>
        stats.Received + stats.Duplicated + stats.Malformed + stats.Forged + stats.OldKey;

    public static void MutatedDatagramsAreCountedOnceAndNothingElseHappens() {
      var random = new Random(7);
      foreach (string suite in Suites) {
        Json file = Json.Vectors(suite);
        var bodies = file["data"].List.FindAll(one => one["direction"].Text == "server_to_client");
        Session session = VectorsTest.SessionOf(file, 0);
        int count = suite == "plain" ? 100_000 : suite == "sealed" ? 20_000 : 2_000;
        var datagrams = new byte[bodies.Count][];
        for (int i = 0; i < bodies.Count; ++i) datagrams[i] = bodies[i]["datagram"].Bytes;
        long allocated = 0;
        for (int i = 0; i < count; ++i) {
          if (!session.IsOpen) session = VectorsTest.SessionOf(file, 0);
          byte[] datagram = new byte[1300];
          byte[] good = datagrams[random.Next(bodies.Count)];
          Buffer.BlockCopy(good, 0, datagram, 0, good.Length);
          int length = Mutate(random, datagram, good.Length, suite == "plain" ? 16 : 0);
          if (length == good.Length && IsSame(good, datagram)) continue;
          ulong before = Sum(session.Stats);
          long begin = GC.GetAllocatedBytesForCurrentThread();
          session.Receive(1, datagram, length);
          if (suite != "plain") allocated += GC.GetAllocatedBytesForCurrentThread() - begin;
          Check.Equal(before + 1, Sum(session.Stats), "datagrams counted");
        }
        // In suites 1 and 2, only the key of the next epoch is made once.
        Check.That(suite == "plain" || session.Stats.Received == 0, "a mutated one is not accepted");
        Check.That(allocated < 20_000, $"{suite}: {allocated} bytes allocated");
      }
    }

    /// <summary>Changes at least one bit. In suite 0 the header remains, so that the body is read.</summary>
    private static int Mutate(Random random, byte[] datagram, int length, int from) {
      int changes = 1 + random.Next(4);
      for (int i = 0; i < changes; ++i) {
        int at = from + random.Next(length - from);
        switch (random.Next(4)) {
          case 0:
            datagram[at] ^= (byte)(1 << random.Next(8));
            break;
          case 1:
            datagram[at] = (byte)(datagram[at] + 1 + random.Next(255));
            break;
          case 2:
            datagram[at] = (byte)(datagram[at] ^ 0xFF);
            break;
          default:
            if (length - from > 2) length -= 1;
            break;
        }
      }
      if (from > 0) Little.Write64(datagram, 8, (ulong)random.Next(1 << 20));
      return length;
    }

    private static bool IsSame(byte[] good, byte[] datagram) {
      for (int i = 0; i < good.Length; ++i) {
        if (good[i] != datagram[i]) return false;
      }
      return true;
    }

    public static void BodiesThatLieAboutTheirSizesAreMalformed() {
      string[] bodies = {
        "1a", "1aff", "1affffffff0f", "1affffffffffffffffff01", "1a0a0a", "1a030a010a", "1a040a02197f", // a length
        "ffffffffffffffffffff01", "00", "0700", "08ffffffffffffffffffff01", // a tag, a varint
        "0b", "0b0b0b", "0b14", "0c", "1b0bfa01", // groups
        "1a072a05080112017f7f7f7f", "1a072a0508011201ff", // a Bye with text that is not UTF-8
      };
      foreach (string body in bodies) {
        Check.Equal(1UL, Received(body).Malformed, body);
      }
      Check.Equal(1UL, Received(Repeated("0b", 500) + Repeated("0c", 500)).Malformed, "deep groups");
      Check.Equal(1UL, Received(Repeated("1a00", 65)).Malformed, "65 frames");
      Check.Equal(1UL, Received(Repeated("1a00", 64)).Received, "64 frames");
      Check.Equal(1UL, Received("0b080110017a021a1a0c" + "a2060161").Received, "an unknown group and field");
    }

    private static string Repeated(string text, int times) => string.Concat(System.Linq.Enumerable.Repeat(text, times));

    private static LinkStats Received(string body) {
      var session = new Session(FakeServer.Connection, null, 0, 0);
      byte[] bytes = Json.Parse('"' + body + '"').Bytes;
      var datagram = new byte[16 + bytes.Length];
      Header.Write(datagram, DatagramType.Data, 0, 0, FakeServer.Connection, 0);
      bytes.CopyTo(datagram, 16);
      session.Receive(1, datagram, datagram.Length);
      return session.Stats;
    }

    public static void ForeignOrRepeatedDatagramsAreDroppedAndDoNotKeepTheSessionAlive() {
      var server = new FakeServer();
      ForceClient client = server.Opened(new Config());
      long opened = server.Now;
      int count = server.SayState(1);
      client.Receive(server.Now, server.Datagram, count);
      for (int i = 0; i < 19; ++i) {
        server.Now += 100 * Time.Millisecond;
        client.Receive(server.Now, server.Datagram, count); // a replay
        server.Listen(client);
        Check.Equal(Phase.Open, client.Phase, "before the timeout");
      }
      Check.Equal(19UL, client.Stats.Duplicated, "duplicated");
      server.Now = opened + 2 * Time.Second;
      server.Listen(client);
      Check.Equal(Phase.Pause, client.Phase, "after 2 s");
      Check.That(client.Reason.Contains("nothing was received for 2 s"), client.Reason);
      server.Now += 100 * Time.Millisecond;
      Check.Equal(1, server.Listen(client), "a new Hello");
      Check.Equal(Phase.Opening, client.Phase, "opening");
    }

    public static void AKeepAliveFollows50MsAfterTheLastDatagram() {
      var server = new FakeServer();
      ForceClient client = server.Opened(new Config());
      var answer = new Frame { Body = Frame.BodyCase.ControlAck };
      answer.ControlAck.Id = 1;
      answer.ControlAck.Code = Code.Ok;
      server.Listen(client);
      server.Tell(client, answer); // of describe
      server.Now += 49 * Time.Millisecond;
      Check.Equal(0, server.Listen(client), "after 49 ms");
      server.Now += Time.Millisecond;
      Check.Equal(1, server.Listen(client), "after 50 ms");
    }

    public static void RequestsOfTheServerAreAnsweredOnceEachAndInOrder() {
      var server = new FakeServer();
      ForceClient client = server.Opened(new Config());
      server.Listen(client);
      server.Heard.Clear();
      var second = new Frame { Body = Frame.BodyCase.Control };
      second.Control.Id = 2;
      second.Control.Op = Control.OpCase.LeaseLost;
      server.Tell(client, second);
      server.Listen(client);
      Check.That(client.Holds && server.Heard.Count == 0, "the first one is missing");
      var first = new Frame { Body = Frame.BodyCase.Control };
      first.Control.Id = 1;
      first.Control.Op = Control.OpCase.Rearm; // is not for clients
      server.Tell(client, first);
      server.Tell(client, first);
      server.Listen(client);
      Check.That(!client.Holds, "the lease is lost");
      Check.That(client.Send(new DeviceState(), new ForceCommand()).Contains("another client"), "no force is sent");
      Check.Equal(2, server.Heard.Count, "answers");
      Check.Equal(Code.Unsupported, server.Heard[0].ControlAck.Code, "of the first");
      Check.Equal(Code.Ok, server.Heard[1].ControlAck.Code, "of the second");
      var third = new Frame { Body = Frame.BodyCase.Control };
      third.Control.Id = 3;
      third.Control.Op = Control.OpCase.LeaseLost;
      third.Control.LeaseLost.Channel = 8;
      server.Tell(client, third);
      server.Tell(client, third);
      server.Listen(client);
      Check.Equal(Code.Invalid, server.Heard[2].ControlAck.Code, "of the third");
      Check.That(server.Heard[2].ControlAck.Detail.Contains("channel"), server.Heard[2].ControlAck.Detail);
      third.Control.Id = 20;
      ulong invalid = client.Stats.Invalid;
      server.Tell(client, third);
      Check.Equal(invalid + 1, client.Stats.Invalid, "16 requests ahead");
    }

    public static void ALeaseIsAskedForAgainIfItsLossMayBeNewerThanTheAnswer() {
      var server = new FakeServer();
      ForceClient client = server.Opened(new Config());
      server.Listen(client);
      ControlAck refusal = null;
      Check.That(client.TakeLease(answer => refusal = answer), "asked");
      Lose(server, client, 1);
      AnswerLast(server, client, Control.OpCase.TakeLease, Code.Ok);
      Check.That(!client.Holds, "the answer may be older");
      AnswerLast(server, client, Control.OpCase.TakeLease, Code.Ok);
      Check.That(client.Holds && refusal == null, "the second answer is newer");
      Lose(server, client, 2);
      client.TakeLease(answer => refusal = answer);
      AnswerLast(server, client, Control.OpCase.TakeLease, Code.Busy);
      Check.That(!client.Holds && refusal.Code == Code.Busy, "another one holds it");
    }

    private static void Lose(FakeServer server, ForceClient client, uint id) {
      var lost = new Frame { Body = Frame.BodyCase.Control };
      lost.Control.Id = id;
      lost.Control.Op = Control.OpCase.LeaseLost;
      server.Tell(client, lost);
    }

    private static void AnswerLast(FakeServer server, ForceClient client, Control.OpCase op, Code code) {
      server.Now += 200 * Time.Millisecond;
      server.Listen(client);
      Frame asked = server.Heard.FindLast(frame => frame.Body == Frame.BodyCase.Control && frame.Control.Op == op);
      var answer = new Frame { Body = Frame.BodyCase.ControlAck };
      for (uint id = 1; id <= asked.Control.Id; ++id) // they are delivered in order
      {
        answer.ControlAck.Id = id;
        answer.ControlAck.Code = code;
        server.Tell(client, answer);
      }
    }

    public static void AStateIsOnlyAnsweredInItsOwnSession() {
      var server = new FakeServer();
      ForceClient client = server.Opened(new Config());
      DeviceState old = Taken(server, client, 100);
      var kept = new DeviceState();
      kept.CopyFrom(old);
      var answer = new ForceCommand { Force = new Vec3(1, 0, 0) };
      Check.Equal(null, client.Send(kept, answer), "a copy is answered");

      server.Now += 3 * Time.Second; // without a datagram: the session ends
      server.Listen(client);
      server.Now += 3 * Time.Second;
      server.Number = 0;
      server.Reopen(client, new Config());
      Check.Equal(ForceClient.OtherSession, client.Send(old, answer), "before a state of the new session");
      DeviceState current = Taken(server, client, 50_000); // the tick of the server, which was never restarted
      foreach (DeviceState state in new[] { old, kept, new DeviceState { Tick = 50_000 } }) {
        Check.Equal(ForceClient.OtherSession, client.Send(state, answer), $"tick {state.Tick}");
      }
      server.Heard.Clear();
      server.Listen(client);
      Check.That(server.Heard.TrueForAll(frame => frame.Body != Frame.BodyCase.Force), "none is sent");
      Check.Equal(null, client.Send(current, answer), "the new one is answered");
      server.Listen(client);
      ForceCommand sent = server.Heard.Find(frame => frame.Body == Frame.BodyCase.Force).Force;
      Check.Equal(1UL, sent.Sequence, "sequence");
      Check.Equal(50_000UL, sent.BasedOnTick, "tick");
    }

    private static DeviceState Taken(FakeServer server, ForceClient client, ulong tick) {
      var state = new DeviceState();
      client.Receive(server.Now, server.Datagram, server.SayState(tick));
      Check.That(client.TakeState(state), "a state");
      return state;
    }

    public static void AForceThatIsNotFiniteOrNotGrantedIsNotSent() {
      var server = new FakeServer();
      ForceClient client = server.Opened(new Config(), "local-model");
      DeviceState hand = Taken(server, client, 5);
      var force = new ForceCommand { Force = new Vec3(1, double.NaN, 0) };
      Check.Equal("force_n is not finite, or out of the bounds in WIRE.md", client.Send(hand, force), "NaN");
      force.Force = new Vec3(1, 0, 0);
      force.HasModel = true;
      Check.That(client.Send(hand, force).StartsWith("model.stiffness_npm"), "no entries");
      force.Model.Stiffness.Set(100);
      force.Torque = new Vec3(1, 2, 3);
      force.GripForce = 1;
      Check.Equal(null, client.Send(hand, force), "a good one");
      server.Listen(client);
      ForceCommand sent = server.Heard.Find(frame => frame.Body == Frame.BodyCase.Force).Force;
      Check.Equal(1UL, sent.Sequence, "sequence");
      Check.Equal(5UL, sent.BasedOnTick, "tick");
      Check.Equal(20_000U, sent.ValidForUs, "valid for");
      Check.That(sent.HasModel && !sent.Torque.HasValue && !sent.GripForce.HasValue, "handle is not granted");
    }

    public static void AFrameOutOfBoundsIsDroppedAndCountedAndTheNextIsTaken() {
      var server = new FakeServer();
      ForceClient client = server.Opened(new Config());
      var hand = new DeviceState();
      Action<DeviceState>[] changes = {
        state => state.Position = new Vec3(0, double.NaN, 0), state => state.Mode = 0, state => state.Device = 16,
        state => state.Energy = 2e12, state => state.Orientation = new Quat(1, 1, 0, 0),
      };
      ulong tick = 0;
      foreach (Action<DeviceState> change in changes) {
        var wrong = new Frame { Body = Frame.BodyCase.State };
        wrong.State.CopyFrom(server.Frame.State);
        wrong.State.Tick = ++tick;
        change(wrong.State);
        server.Tell(client, wrong);
        Check.That(!client.TakeState(hand) && client.Stats.Invalid == tick, $"wrong state {tick}");
      }
      server.Tell(client, new Frame { Body = Frame.BodyCase.Force });
      Check.Equal(tick + 1, client.Stats.Invalid, "servers send no forces");
      client.Receive(server.Now, server.Datagram, server.SayState(1));
      Check.That(client.TakeState(hand) && hand.Tick == 1, "the good one with the same tick");
    }

    public static void ARequestIsRepeatedMoreAndMoreSeldomUntilItIsAnswered() {
      var server = new FakeServer();
      ForceClient client = server.Opened(new Config());
      server.Listen(client);
      var times = new System.Collections.Generic.List<long>();
      long begin = server.Now;
      for (int ms = 1; ms <= 4000; ++ms) {
        server.Now += Time.Millisecond;
        if (ms % 500 == 0) client.Receive(server.Now, server.Datagram, server.Say(null)); // keeps the session alive
        server.Heard.Clear();
        server.Listen(client);
        bool asked = server.Heard.Exists(frame => frame.Body == Frame.BodyCase.Control);
        if (asked) times.Add((server.Now - begin) / Time.Millisecond);
      }
      Check.Equal("100 300 700 1500 2500 3500", string.Join(" ", times), "ms after the first one");
      var answer = new Frame { Body = Frame.BodyCase.ControlAck };
      answer.ControlAck.Id = 1;
      answer.ControlAck.Code = Code.Ok;
      server.Tell(client, answer);
      server.Heard.Clear();
      server.Now += Time.Second;
      server.Listen(client);
      Check.That(!server.Heard.Exists(frame => frame.Body == Frame.BodyCase.Control), "it is answered");
      answer.ControlAck.Id = 9;
      ulong invalid = client.Stats.Invalid;
      server.Tell(client, answer);
      Check.Equal(invalid + 1, client.Stats.Invalid, "an answer to no request");
    }

    public static void AnObserverSendsNoForce() {
      var server = new FakeServer();
      ForceClient client = server.Opened(new Config { Observe = true });
      Check.That(!client.Holds && client.Send(new DeviceState(), new ForceCommand()).Contains("an observer"), "refused");
      server.Listen(client);
      Check.That(!server.Heard.Exists(frame => frame.Body == Frame.BodyCase.Force), "no force");
    }

    public static void APressInAStateThatIsNotTakenIsNotLost() {
      var server = new FakeServer();
      ForceClient client = server.Opened(new Config());
      var hand = new DeviceState();
      uint[] buttons = { 2, 0, 1 };
      for (int i = 0; i < 3; ++i) {
        server.Frame.State.Buttons = buttons[i];
        client.Receive(server.Now, server.Datagram, server.SayState((ulong)i + 1));
      }
      Check.That(client.TakeState(hand) && hand.Buttons == 3 && hand.Tick == 3, $"buttons {hand.Buttons}");
      server.Frame.State.Buttons = 0;
      client.Receive(server.Now, server.Datagram, server.SayState(4));
      Check.That(client.TakeState(hand) && hand.Buttons == 0, "released");
      Check.That(!client.TakeState(hand), "taken once");
      client.Receive(server.Now, server.Datagram, server.SayState(4));
      Check.That(!client.TakeState(hand) && client.Stats.Stale == 1, "stale");
    }

    public static void ARefusalIsToldAndOnlySomeAreTriedAgain() {
      foreach (Code code in new[] { Code.Busy, Code.Shutdown, Code.Denied, Code.Unsupported, Code.Invalid }) {
        var server = new FakeServer();
        var client = new ForceClient(new Config());
        var refusal = new Answer { Body = Answer.BodyCase.Refused };
        refusal.Refused.Code = code;
        refusal.Refused.Detail = "a key is needed";
        long[] pauses = { 100, 200, 400, 800, 1600, 2000, 2000 };
        bool again = code == Code.Busy || code == Code.Shutdown;
        foreach (long pause in pauses) {
          server.Reply(client, refusal);
          Check.That(client.Reason.Contains("a key is needed") && client.Reason.Contains(code.ToString()), client.Reason);
          Check.Equal(again ? Phase.Pause : Phase.Ended, client.Phase, code.ToString());
          server.Now += pause * Time.Millisecond - 1;
          Check.Equal(0, server.Listen(client), "too early");
          server.Now += 1;
          if (!again) break;
        }
        Check.Equal(again ? 1 : 0, server.Listen(client), "another Hello");
      }
    }

    public static void WrongAnswersAreIgnored() {
      Action<Welcome>[] changes = {
        welcome => welcome.LoopHz = 0, welcome => welcome.Version = 2, welcome => welcome.TimeoutMs = 0,
        welcome => welcome.Role = 0, welcome => welcome.MaxForce = -1, welcome => welcome.MaxForce = double.NaN,
      };
      foreach (Action<Welcome> change in changes) {
        var server = new FakeServer();
        var client = new ForceClient(new Config());
        var answer = new Answer { Body = Answer.BodyCase.Welcome };
        answer.Welcome.Version = 1;
        answer.Welcome.Role = Role.Controller;
        answer.Welcome.LoopHz = 1000;
        answer.Welcome.TimeoutMs = 2000;
        change(answer.Welcome);
        server.Reply(client, answer);
        Check.Equal(Phase.Opening, client.Phase, "still opening");
      }
    }

    public static void AByeEndsTheSessionAndAReplacedClientDoesNotComeBack() {
      foreach (Code code in new[] { Code.Shutdown, Code.Replaced }) {
        var server = new FakeServer();
        ForceClient client = server.Opened(new Config());
        var bye = new Frame { Body = Frame.BodyCase.Bye };
        bye.Bye.Code = code;
        bye.Bye.Reason = "why";
        server.Tell(client, bye);
        Check.Equal(code == Code.Replaced ? Phase.Ended : Phase.Pause, client.Phase, code.ToString());
        Check.That(client.Reason.Contains("why"), client.Reason);
      }
    }

    public static void CloseSendsThreeByesAndNothingMore() {
      var server = new FakeServer();
      ForceClient client = server.Opened(new Config());
      server.Listen(client);
      server.Heard.Clear();
      client.Close("the program ends");
      Check.Equal(3, server.Listen(client), "Byes");
      Check.That(server.Heard.TrueForAll(frame => frame.Bye.Code == Code.Ok), "code");
      Check.That(server.Heard.TrueForAll(frame => frame.Bye.Reason == "the program ends"), "reason");
      server.Now += 10 * Time.Second;
      Check.Equal(0, server.Listen(client), "silence");
    }

    public static void KeysAreRenewedInTimeAndTheServerFollows() {
      Json file = Json.Vectors("sealed");
      Sealing client = VectorsTest.SealingOf(file, false, 0), server = VectorsTest.SealingOf(file, true, 0);
      var datagram = new byte[1200];
      byte[] before = new byte[1200], late = new byte[1200];
      int size = SealedAt(client, 589 * Time.Second, 1, before);
      SealedAt(client, 589 * Time.Second, 2, late);
      Check.Equal((byte)0, before[2], "the epoch after 589 s");
      Check.Equal((byte)1, client.SendEpoch(590 * Time.Second), "after 590 s");
      Header.Write(datagram, DatagramType.Data, 1, 1, FakeServer.Connection, 5);
      int count = client.Seal(5, datagram, 40);
      Check.Equal(Sealing.Result.Opened, server.Open(600 * Time.Second, 5, datagram, count), "the server follows");
      Sealing.Result result = server.Open(602 * Time.Second - 1, 1, before, size);
      Check.Equal(Sealing.Result.Opened, result, "the previous key, for 2 s");
      Check.Equal(Sealing.Result.OldKey, server.Open(602 * Time.Second, 2, late, size), "and not longer");
      for (int i = 1; i < 1 << 20; ++i) client.Seal(1, datagram, 16);
      Check.Equal((byte)2, client.SendEpoch(600 * Time.Second), "after 2^20 datagrams");
    }

    private static int SealedAt(Sealing keys, long now, ulong number, byte[] datagram) {
      Header.Write(datagram, DatagramType.Data, keys.SendEpoch(now), 1, FakeServer.Connection, number);
      return keys.Seal(number, datagram, 40);
    }

    public static void BadConfigsSayWhatWasExpected() {
      var longName = new Config { Name = new string('x', 65) };
      string why = Check.Throws<ArgumentException>(() => new ForceClient(longName));
      Check.Equal("Name has 65 bytes of UTF-8, expected at most 64", why, "name");
      why = Check.Throws<ArgumentException>(() => new ForceClient(new Config { ValidForUs = 0 }));
      Check.That(why.Contains("expected 1 … 10 000 000"), why);
      foreach (string server in new[] { "", "host", "host:", "host:0", "host:70000", ":1" }) {
        why = Check.Throws<ArgumentException>(() => new HapticClient(server, new Config()));
        Check.That(why.Contains("expected HOST:PORT"), why);
      }
      why = Check.Throws<ArgumentException>(() => new HapticClient("192.0.2.1:47100", new Config()));
      Check.That(why.Contains("a key is needed"), why);
    }
  }
}
