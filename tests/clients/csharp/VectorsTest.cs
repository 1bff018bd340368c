// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;

namespace Tendon.Tests {
  /// <summary>The client against protocol/vectors.</summary>
  public static class VectorsTest {
    private static readonly string[] Files = { "plain", "sealed", "sealed_aes" };

    /// <summary>A session that is as old as the vectors.</summary>
    internal static Session SessionOf(Json file, long now) =>
      new Session((uint)file["connection_id"].Whole, SealingOf(file, false, now), 0, now);

    /// <summary>The keys of the client, or of the server.</summary>
    internal static Sealing SealingOf(Json file, bool ofServer, long now) {
      ulong suite = file["suite"].Whole;
      if (suite == 0) return null;
      byte[] up = file["welcome"]["client_to_server_key"].Bytes, down = file["welcome"]["server_to_client_key"].Bytes;
      Aead send = suite == 2 ? (Aead)new AesGcm(up) : new ChaChaPoly(up);
      Aead receive = suite == 2 ? (Aead)new AesGcm(down) : new ChaChaPoly(down);
      return ofServer ? new Sealing(receive, send, now) : new Sealing(send, receive, now);
    }

    private static bool IsLeftOut(Json one) {
      foreach (string word in new[] { "field", "brick", "truth" }) {
        if (one["name"].Text.Contains(word)) return true;
      }
      return false;
    }

    public static void EveryBodyIsReadAndWrittenAsTheSameBytes() {
      int judged = 0;
      foreach (string name in Files) {
        foreach (Json one in Json.Vectors(name)["data"].List) {
          if (IsLeftOut(one)) continue; // fields
          Check.Bytes(one["body"].Bytes, Rewritten(one["body"].Bytes), $"{name}: {one["name"].Text}");
          ++judged;
        }
      }
      Check.That(judged > 120, $"only {judged} bodies");
    }

    /// <summary>Reads a Datagram and writes it again.</summary>
    private static byte[] Rewritten(byte[] body) {
      var reader = new ProtoReader(body, 0, body.Length);
      var to = new byte[2048];
      var writer = new ProtoWriter(to, 0, to.Length);
      while (reader.Next()) {
        if (reader.Tag == 9) {
          writer.Fixed64(9, reader.Fixed64());
          continue;
        }
        Check.That(reader.Tag == 18 || reader.Tag == 26, $"tag {reader.Tag}");
        int end = reader.Enter(), begin = writer.Begin(reader.Tag);
        if (reader.Tag == 18) {
          var echo = new Echo();
          echo.Read(ref reader);
          echo.Write(ref writer);
        } else {
          var frame = new Frame();
          frame.Read(ref reader);
          Check.That(frame.Body != Frame.BodyCase.None && frame.Objection() == null, frame.Objection());
          frame.Write(ref writer);
        }
        reader.Leave(end);
        writer.End(begin);
      }
      Check.That(!reader.Bad && !writer.Full, "bad or full");
      Array.Resize(ref to, writer.At);
      return to;
    }

    public static void TheMembersHaveTheValuesOfTheMessages() {
      Frame frame = FrameOf("a handle with all there is", out Json message);
      Json state = message["frames"].List[0]["state"];
      Check.Equal(state["tick"].Whole, frame.State.Tick, "tick");
      Check.Equal(state["position_m"]["x"].Number, frame.State.Position.X, "x");
      Check.Equal(state["orientation"]["w"].Number, frame.State.Orientation.Value.W, "w");
      Check.Equal(state["gripper_rad"].Number, frame.State.Gripper.Value, "gripper");
      Check.Equal((uint)state["buttons"].Whole, frame.State.Buttons, "buttons");
      frame = FrameOf("force with all that it can say", out message);
      Json force = message["frames"].List[0]["force"];
      Check.Equal(force["force_n"]["x"].Number, frame.Force.Force.X, "force");
      Check.Equal((uint)force["valid_for_us"].Whole, frame.Force.ValidForUs, "valid");
      Json contact = force["model"]["contact"];
      Check.Equal(contact["gap_m"].Number, frame.Force.Model.Contact.Gap, "gap");
      Check.Equal(contact["table"]["force_n"].List.Count, frame.Force.Model.Contact.Table.Force.Count, "entries");
      Check.Equal(contact["table"]["force_n"].List[1].Number, frame.Force.Model.Contact.Table.Force[1], "entry");
      frame = FrameOf("description", out message);
      Json device = message["frames"].List[0]["control_ack"]["device"];
      Check.Equal(device["name"].Text, frame.ControlAck.Device.Name, "name");
      Check.Equal(device["channels"].List.Count, frame.ControlAck.Device.Channels.Count, "channels");
    }

    internal static Frame FrameOf(string name, out Json message) {
      Json one = Json.Vectors("plain")["data"].List.Find(each => each["name"].Text == name);
      message = one["message"];
      byte[] body = one["body"].Bytes;
      var reader = new ProtoReader(body, 0, body.Length);
      var frame = new Frame();
      while (reader.Next()) {
        if (reader.Tag != 26) {
          reader.Skip();
          continue;
        }
        int end = reader.Enter();
        frame.Read(ref reader);
        reader.Leave(end);
        break;
      }
      return frame;
    }

    public static void EveryDatagramIsSealedAndOpened() {
      foreach (string name in Files) {
        Json file = Json.Vectors(name);
        ulong suite = file["suite"].Whole;
        foreach (Json one in file["data"].List) {
          byte[] body = one["body"].Bytes, datagram = one["datagram"].Bytes;
          var mine = new byte[16 + body.Length + (suite == 0 ? 0 : 16)];
          byte epoch = (byte)(suite == 0 ? 0 : one["epoch"].Whole);
          ulong number = one["packet_number"].Whole;
          Header.Write(mine, DatagramType.Data, epoch, (byte)suite, (uint)file["connection_id"].Whole, number);
          body.CopyTo(mine, 16);
          if (suite > 0) {
            Aead key = Key(file, one["direction"].Text, epoch);
            key.Seal(number, mine, 16, mine, 16, body.Length);
            Check.Bytes(datagram, mine, one["name"].Text);
            Check.That(key.Open(number, mine, 16, mine, 16, mine.Length - 16), "opens");
            Array.Resize(ref mine, 16 + body.Length);
            Check.Bytes(body, Tail(mine, 16), one["name"].Text);
          } else {
            Check.Bytes(datagram, mine, one["name"].Text);
          }
        }
      }
    }

    private static Aead Key(Json file, string direction, byte epoch) {
      byte[] bytes = file["welcome"][direction + "_key"].Bytes;
      Aead key = file["suite"].Whole == 2 ? (Aead)new AesGcm(bytes) : new ChaChaPoly(bytes);
      for (int i = 0; i < epoch; ++i) key = key.WithKey(key.NextKey());
      return key;
    }

    private static byte[] Tail(byte[] bytes, int from) {
      var tail = new byte[bytes.Length - from];
      Buffer.BlockCopy(bytes, from, tail, 0, tail.Length);
      return tail;
    }

    public static void TheHandshakeHasTheBytesOfTheVectors() {
      foreach (string name in Files) {
        Json file = Json.Vectors(name);
        byte[] key = name == "plain" ? null : file["psk"].Bytes, body = file["hello"]["body"].Bytes;
        var reader = new ProtoReader(body, 0, body.Length);
        var hello = new Hello();
        hello.Read(ref reader);
        Check.Equal(file["hello"]["message"]["name"].Text, hello.Name, "name");
        byte[] ephemeral = key == null ? null : file["client_ephemeral"].Bytes;
        Func<Opening> attempt = () => new Opening(hello, key, file["client_random"].Bytes, ephemeral);
        Opening opening = attempt();
        var datagram = new byte[1200];
        Check.Equal(1200, opening.NextDatagram(0, datagram), "size");
        Check.Bytes(file["hello"][key == null ? "datagram" : "first_datagram"].Bytes, datagram, "the first Hello");
        Check.Equal(0, opening.NextDatagram(99 * Time.Millisecond, datagram), "too early");
        byte[] retry = file["retry"]["datagram"].Bytes;
        opening.Receive(1, retry, retry.Length);
        Check.Equal(1200, opening.NextDatagram(2, datagram), "with the cookie");
        if (key != null) Check.Bytes(file["hello"]["datagram"].Bytes, datagram, "the second Hello");
        byte[] welcome = file["welcome"]["datagram"].Bytes;
        for (int i = 16; i < welcome.Length; i += 7) {
          if (key == null && i >= 32) break;
          byte[] damaged = (byte[])welcome.Clone();
          damaged[i] ^= 1;
          opening.Receive(3, damaged, damaged.Length);
          Check.That(opening.Welcome == null && opening.Refused == null, $"a bit of byte {i} is changed");
        }
        opening.Receive(3, welcome, welcome.Length);
        Check.Equal(file["welcome"]["message"]["welcome"]["max_force_n"].Number, opening.Welcome.MaxForce, "force");
        Check.Equal((uint)file["connection_id"].Whole, opening.Connection, "connection");
        Check.Equal((byte)file["suite"].Whole, opening.Sealing == null ? (byte)0 : opening.Sealing.Suite, "suite");
        opening = attempt();
        byte[] refused = file["refused"]["datagram"].Bytes;
        opening.Receive(4, refused, refused.Length);
        Check.Equal(file["refused"]["message"]["refused"]["detail"].Text, opening.Refused.Detail, "detail");
      }
    }

    public static void PacketNumbersAreLetInOnce() {
      foreach (Json script in Json.Vectors("replay")["scripts"].List) {
        var window = new ReplayWindow();
        for (int i = 0; i < script["packet_numbers"].List.Count; ++i) {
          ulong number = script["packet_numbers"].List[i].Whole;
          Check.Equal(script["accept"].List[i].Truth, !window.Contains(number), $"{script["name"].Text}: {number}");
          if (!window.Contains(number)) window.Insert(number);
        }
      }
    }

    public static void EveryBoundIsKeptAndNamed() {
      var judged = new Dictionary<string, int>();
      foreach (Json one in Json.Vectors("bounds")["bounds"].List) {
        string field = one["field"].Text, message = one["message"].Text;
        byte[] body = one["body"].Bytes;
        string owner = field.Split('.')[0];
        bool leftOut = owner == "DeviceStates" || owner.StartsWith("Field") ||
               owner == "OfferField" || owner == "UseField" || owner == "DropField";
        if (leftOut) continue;
        var reader = new ProtoReader(body, 0, body.Length);
        string objection;
        if (message == "Datagram") {
          objection = ObjectionTo(body);
        } else if (message == "Hello") {
          var hello = new Hello();
          hello.Read(ref reader);
          objection = hello.Objection();
        } else {
          var answer = new Answer();
          answer.Read(ref reader);
          objection = answer.Objection();
        }
        string what = $"{field} = {one["value"].Text}";
        Check.Equal(one["accepted"].Truth, objection == null && !reader.Bad, $"{what} ({objection})");
        string name = field.Substring(field.IndexOf('.') + 1);
        bool isEntry = Array.IndexOf(new[] { "Claim", "Grant", "ChannelDescription", "OutputDescription" }, owner) >= 0;
        if (objection != null && owner != "Datagram" && !isEntry) Check.That(Names(objection, name), $"{what}: {objection}");
        judged[owner] = judged.TryGetValue(owner, out int n) ? n + 1 : 1;
      }
      int sum = 0;
      foreach (int n in judged.Values) sum += n;
      Check.That(sum > 1400, $"only {sum} bounds");
      Console.WriteLine($"      {sum} bounds of {judged.Count} messages");
    }

    /// <summary>Returns whether an end of the objection, force.model.at_m, is the field or contains it: model.at_m.x.
    /// </summary>
    private static bool Names(string objection, string field) {
      for (string end = objection; ; end = end.Substring(end.IndexOf('.') + 1)) {
        if (field == end || field.StartsWith(end + ".")) return true;
        if (end.IndexOf('.') < 0) return false;
      }
    }

    private static string ObjectionTo(byte[] body) {
      var reader = new ProtoReader(body, 0, body.Length);
      int frames = 0;
      while (reader.Next()) {
        string objection = null;
        if (reader.Tag == 9) {
          long sent = reader.Fixed64();
          if (sent < -Bounds.Time || sent > Bounds.Time) return "tx_time_ns";
        } else if (reader.Tag == 18 || reader.Tag == 26) {
          int end = reader.Enter();
          if (reader.Tag == 18) {
            var echo = new Echo();
            echo.Read(ref reader);
            objection = echo.Objection();
          } else {
            if (++frames > 64) return "frames";
            var frame = new Frame();
            frame.Read(ref reader);
            objection = frame.Objection();
          }
          reader.Leave(end);
        } else {
          reader.Skip();
        }
        if (objection != null) return objection;
      }
      return reader.Bad ? "not protobuf" : null;
    }

    public static void EachDatagramToDropIsCountedAsWhatItIs() {
      foreach (string name in new[] { "sealed", "sealed_aes" }) {
        Json file = Json.Vectors(name);
        foreach (Json one in file["dropped"].List) {
          Session session = SessionOf(file, 0);
          byte[] datagram = one["datagram"].Bytes;
          session.Receive(0, datagram, datagram.Length);
          LinkStats stats = session.Stats;
          string counter = one["counter"].Text;
          string what = $"{one["name"].Text}: {counter}";
          Check.Equal(counter == "forged" ? 1UL : 0, stats.Forged, what);
          Check.Equal(counter == "old_key" ? 1UL : 0, stats.OldKey, what);
          Check.Equal(counter == "malformed" ? 1UL : 0, stats.Malformed, what);
          Check.Equal(0UL, stats.Received, what);
        }
      }
    }

    public static void EveryDatagramOfTheServerIsTaken() {
      foreach (string name in Files) {
        Json file = Json.Vectors(name);
        Session session = SessionOf(file, 0);
        var cases = file["data"].List.FindAll(one => one["direction"].Text == "server_to_client");
        if (name != "plain") cases.RemoveAll(one => one["epoch"].Whole > 1);
        cases.Sort((a, b) => a["packet_number"].Whole.CompareTo(b["packet_number"].Whole));
        bool ended = false;
        foreach (Json one in cases) {
          byte[] datagram = one["datagram"].Bytes;
          bool was = session.IsOpen;
          session.Receive(10 * Time.Second, datagram, datagram.Length);
          LinkStats stats = session.Stats;
          if (was) Check.Equal(0UL, stats.Malformed + stats.Forged + stats.OldKey + stats.Duplicated, one["name"].Text);
          ended |= !session.IsOpen;
        }
        Check.That(ended, $"{name}: the Bye is taken");
        Check.That(session.HasState && session.Stats.Received > 1, name);
      }
    }
  }
}
