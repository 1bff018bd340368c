// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;

namespace Tendon.Tests {
  /// <summary>The server's half of a conversation, with a client whose datagrams and times are those of the test. It
  /// opens sessions of suite 0, and speaks in the sessions of all suites.</summary>
  internal sealed class FakeServer {
    internal const uint Connection = 77;
    internal long Now = Time.Second;
    internal ulong Number;
    internal Sealing Sealing;
    internal readonly byte[] Datagram = new byte[2048];
    internal readonly List<Frame> Heard = new List<Frame>();
    internal readonly Frame Frame = new Frame();

    internal FakeServer() {
      Frame.Body = Frame.BodyCase.State;
      Frame.State.Mode = Mode.Active;
      Frame.State.Velocity = new Vec3(0.1, 0.2, 0.3);
      Frame.State.ForceApplied = new Vec3(1, 2, 3);
      Frame.State.PermittedForce = double.PositiveInfinity;
      Frame.State.Orientation = new Quat(1, 0, 0, 0);
    }

    /// <summary>Writes a datagram with these frames. Returns its length. Does not allocate.</summary>
    internal int Say(Frame frame) {
      byte epoch = Sealing == null ? (byte)0 : Sealing.SendEpoch(Now), suite = Sealing == null ? (byte)0 : Sealing.Suite;
      Header.Write(Datagram, DatagramType.Data, epoch, suite, Connection, Number);
      var writer = new ProtoWriter(Datagram, 16, 1200);
      writer.Fixed64(9, Now);
      if (frame != null) {
        int begin = writer.Begin(26);
        frame.Write(ref writer);
        writer.End(begin);
      }
      ulong number = Number++;
      return Sealing == null ? writer.At : Sealing.Seal(number, Datagram, writer.At);
    }

    internal int SayState(ulong tick) {
      Frame.State.Tick = tick;
      Frame.State.Position = new Vec3(0.001 * (tick % 7), 0, 0);
      return Say(Frame);
    }

    /// <summary>Sends all datagrams of the client into Heard.</summary>
    internal int Listen(ForceClient client) {
      var datagram = new byte[1200];
      int datagrams = 0;
      for (int count; (count = client.NextDatagram(Now, datagram)) > 0; ++datagrams) Hear(datagram, count);
      return datagrams;
    }

    internal void Hear(byte[] datagram, int count) {
      var reader = new ProtoReader(datagram, 16, count - 16);
      while (datagram[1] == 0x13 && reader.Next()) {
        if (reader.Tag != 26) {
          reader.Skip();
          continue;
        }
        int end = reader.Enter();
        var frame = new Frame();
        frame.Read(ref reader);
        reader.Leave(end);
        Heard.Add(frame);
      }
      Check.That(!reader.Bad, "the client writes protobuf");
    }

    /// <summary>Opens a session of suite 0 with these features.</summary>
    internal ForceClient Opened(Config config, params string[] features) {
      var client = new ForceClient(config);
      Reopen(client, config, features);
      return client;
    }

    internal void Reopen(ForceClient client, Config config, params string[] features) {
      var welcome = new Answer { Body = Answer.BodyCase.Welcome };
      welcome.Welcome.Version = 1;
      welcome.Welcome.Role = config.Observe ? Role.Observer : Role.Controller;
      welcome.Welcome.LoopHz = 1000;
      welcome.Welcome.TimeoutMs = 2000;
      welcome.Welcome.MaxForce = 8;
      welcome.Welcome.Features.AddRange(features);
      Reply(client, welcome);
      Check.Equal(Phase.Open, client.Phase, client.Reason);
    }

    /// <summary>Answers the client's Hello.</summary>
    internal void Reply(ForceClient client, Answer answer) {
      var hello = new byte[1200];
      Check.Equal(1200, client.NextDatagram(Now, hello), "a Hello");
      var writer = new ProtoWriter(Datagram, 32, 1199);
      Header.Write(Datagram, DatagramType.Answer, 0, 0, Connection, 0);
      Buffer.BlockCopy(hello, 16, Datagram, 16, 16);
      answer.Write(ref writer);
      client.Receive(Now, Datagram, writer.At);
    }

    internal void Tell(ForceClient client, Frame frame) => client.Receive(Now, Datagram, Say(frame));
  }
}
