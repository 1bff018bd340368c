// SPDX-License-Identifier: Apache-2.0
using System;

namespace Tendon {
  /// <summary>Counters of one session (protocol/SESSION.md, "Dropped and counted").</summary>
  public struct LinkStats {
    public ulong Sent, Received, Duplicated, Malformed, Forged, OldKey, Invalid, Stale, Reordered;

    /// <summary>The smoothed round trip, ns. 0: not measured yet.</summary>
    public long RoundTripNs;
  }

  /// <summary>
  /// An open session of a client, without socket and clock (protocol/SESSION.md). Receiving a state, answering it with
  /// a force and writing the datagram does not allocate.
  ///
  /// Call Receive for each datagram and Tick when NextTime has come, then NextDatagram until it returns 0.
  /// </summary>
  internal sealed class Session {
    private const long KeepAlive = 50 * Time.Millisecond;
    private const long Timeout = 2 * Time.Second;
    private const long Life = 86_400 * Time.Second;
    private const long FirstResend = 100 * Time.Millisecond;
    private const long ShortestResend = 20 * Time.Millisecond;
    private const ulong MostForged = 1UL << 36;
    private const int MostFrames = 64;
    private const int Byes = 3;
    private const int Devices = 16;

    private readonly uint _connection;
    private readonly Sealing _sealing; // null in suite 0
    private readonly uint _device;
    private readonly long _opened;

    // Out.
    private readonly ForceCommand _force = new ForceCommand();
    private bool _hasForce;
    private ulong _next;
    private long _lastSent;
    private readonly Bye _bye = new Bye();
    private int _byesLeft;

    // In.
    private readonly ReplayWindow _seen = new ReplayWindow();
    private readonly Frame _frame = new Frame();
    private readonly Echo _echoRead = new Echo();
    private readonly Echo _echo = new Echo();
    private readonly ulong[] _ticks = new ulong[Devices]; // the newest + 1
    private ulong _newestReport;
    private long _lastHeard;
    private long _sent; // of the datagram that is being read
    private bool _hasEcho;
    private long _smoothed;
    private long _variation;
    private LinkStats _stats = new LinkStats();

    internal readonly OutgoingRequests Asked = new OutgoingRequests();
    internal readonly IncomingRequests Answering = new IncomingRequests();

    /// <summary>The newest state of the device. It is new if HasState is true, which the owner resets. Its buttons
    /// include those that were pressed in states that the owner has not taken.</summary>
    internal readonly DeviceState State = new DeviceState();
    internal bool HasState;

    /// <summary>The newest report on our forces. Its number is 0 before the first one.</summary>
    internal readonly LinkReport Report = new LinkReport();

    /// <summary>Not 0 after the end of the session.</summary>
    internal Code EndCode { get; private set; }
    internal string EndReason { get; private set; } = "";

    internal Session(uint connection, Sealing sealing, uint device, long now) {
      _connection = connection;
      _sealing = sealing;
      _device = device;
      _opened = _lastHeard = now;
    }

    internal LinkStats Stats {
      get {
        LinkStats stats = _stats;
        stats.Sent = _next;
        stats.RoundTripNs = _smoothed;
        return stats;
      }
    }

    internal byte Suite => _sealing == null ? (byte)0 : _sealing.Suite;
    internal bool IsOpen => EndCode == 0;

    // ---- In ----

    internal void Receive(long now, byte[] datagram, int count) {
      if (!IsOpen) return;
      if (!Header.Is(datagram, count, DatagramType.Data, Suite)) {
        byte handshake = (byte)(_sealing == null ? 0 : 1);
        bool late = Header.Is(datagram, count, DatagramType.Retry, handshake) ||
              Header.Is(datagram, count, DatagramType.Answer, handshake);
        if (late) ++_stats.Duplicated;
        else ++_stats.Malformed;
        return;
      }
      ulong number = Little.Read64(datagram, 8);
      bool foreign = Little.Read32(datagram, 4) != _connection || number >= Header.Numbers ||
             (_sealing == null && datagram[2] != 0);
      if (foreign) {
        ++_stats.Malformed;
        return;
      }
      if (_seen.Contains(number)) {
        ++_stats.Duplicated;
        return;
      }
      int body = count - Header.Size;
      if (_sealing != null) {
        Sealing.Result result = _sealing.Open(now, number, datagram, count);
        if (result == Sealing.Result.Forged) ++_stats.Forged;
        if (result == Sealing.Result.OldKey) ++_stats.OldKey;
        if (result != Sealing.Result.Opened) return;
        body -= Aead.TagSize;
      }
      // In suite 0, a damaged copy must not use up the number of the original.
      if (!IsDatagram(datagram, body)) {
        ++_stats.Malformed;
        if (_sealing != null) _seen.Insert(number);
        return;
      }
      Accept(now, number, datagram, body);
    }

    /// <summary>Checks that all of the body is protobuf before anything of it is used.</summary>
    private bool IsDatagram(byte[] datagram, int count) {
      var reader = new ProtoReader(datagram, Header.Size, count);
      int frames = 0;
      _sent = 0;
      _hasEcho = false;
      _echoRead.Clear();
      while (reader.Next()) {
        if (reader.Tag == 9) {
          _sent = reader.Fixed64();
        } else if (reader.Tag == 18) {
          _hasEcho = true;
          int end = reader.Enter();
          _echoRead.Read(ref reader);
          reader.Leave(end);
        } else if (reader.Tag == 26) {
          ++frames;
          ReadFrame(ref reader);
        } else {
          reader.Skip();
        }
      }
      return !reader.Bad && frames <= MostFrames && _sent >= -Bounds.Time && _sent <= Bounds.Time;
    }

    private void ReadFrame(ref ProtoReader reader) {
      int end = reader.Enter();
      _frame.Clear();
      _frame.Read(ref reader);
      reader.Leave(end);
    }

    private void Accept(long now, ulong number, byte[] datagram, int count) {
      ++_stats.Received;
      _lastHeard = now;
      if (_seen.IsNewest(number)) {
        _echo.PeerTxTimeNs = _sent;
        _echo.RxTimeNs = now;
        _echo.PacketNumber = number;
      } else {
        ++_stats.Reordered;
      }
      _seen.Insert(number);
      if (_hasEcho) Observe(now);
      var reader = new ProtoReader(datagram, Header.Size, count);
      while (IsOpen && reader.Next()) {
        if (reader.Tag != 26) {
          reader.Skip();
          continue;
        }
        ReadFrame(ref reader);
        TakeFrame();
      }
    }

    /// <summary>RFC 6298. A sample can be negative if the rates of the clocks differ.</summary>
    private void Observe(long now) {
      bool possible = _echoRead.Objection() == null && _echoRead.PacketNumber < _next &&
              _echoRead.PeerTxTimeNs >= _opened && _echoRead.PeerTxTimeNs <= now &&
              _echoRead.RxTimeNs <= _sent;
      if (!possible) {
        ++_stats.Invalid;
        return;
      }
      long sample = now - _echoRead.PeerTxTimeNs - (_sent - _echoRead.RxTimeNs);
      if (sample < 0) return;
      _variation = _smoothed == 0 ? sample / 2 : (3 * _variation + Math.Abs(_smoothed - sample)) / 4;
      _smoothed = _smoothed == 0 ? sample : (7 * _smoothed + sample) / 8;
    }

    private void TakeFrame() {
      string objection = _frame.Objection();
      if (_frame.Body == Frame.BodyCase.Control) {
        // The detail of an answer has the name of the field without the name of the frame.
        if (!Answering.Take(_frame.Control, _frame.Control.Objection())) ++_stats.Invalid;
        return;
      }
      if (_frame.Body == Frame.BodyCase.ControlAck) {
        TakeAnswer(objection);
        return;
      }
      if (objection != null || _frame.Body == Frame.BodyCase.Force) {
        ++_stats.Invalid;
        return;
      }
      switch (_frame.Body) {
        case Frame.BodyCase.State:
          TakeState(_frame.State);
          break;
        case Frame.BodyCase.Report:
          if (_frame.Report.Number <= _newestReport) {
            ++_stats.Stale;
            break;
          }
          _newestReport = _frame.Report.Number;
          Report.CopyFrom(_frame.Report);
          break;
        case Frame.BodyCase.Bye:
          End(_frame.Bye.Code, _frame.Bye.Reason);
          break;
      }
    }

    private void TakeState(DeviceState state) {
      if (state.Tick < _ticks[state.Device]) {
        ++_stats.Stale;
        return;
      }
      _ticks[state.Device] = state.Tick + 1;
      if (state.Device != _device) return;
      uint pressed = HasState ? State.Buttons : 0;
      State.CopyFrom(state);
      State.Buttons |= pressed;
      HasState = true;
    }

    /// <summary>An answer that is out of bounds still ends the request, because later ones wait for it.</summary>
    private void TakeAnswer(string objection) {
      ControlAck answer = _frame.ControlAck;
      if (objection != null) {
        ++_stats.Invalid;
        uint id = answer.Id;
        answer.Clear();
        answer.Id = id;
        answer.Code = Code.Invalid;
        answer.Detail = objection + " of the answer is out of bounds";
      }
      if (!Asked.Take(answer) && objection == null) ++_stats.Invalid;
    }

    private void End(Code code, string reason) {
      EndCode = code;
      EndReason = reason;
    }

    /// <summary>Ends the session if the server was silent for too long, or if the session is too old.</summary>
    internal void Tick(long now) {
      if (!IsOpen) return;
      if (now - _lastHeard >= Timeout) {
        End(Code.TimedOut, $"nothing was received for {Timeout / Time.Second} s");
      } else if (_sealing != null &&
          (now - _opened >= Life || _next >= Header.Numbers - Byes || _stats.Forged >= MostForged)) {
        Close(Code.Expired, "the session has reached its maximum age");
      }
    }

    // ---- Out ----

    /// <summary>Replaces a force that has not been sent yet. Its sequence and bounds are the caller's.</summary>
    internal void Send(ForceCommand force) {
      _force.CopyFrom(force);
      _hasForce = true;
    }

    /// <summary>Ends the session. The next datagrams are Byes.</summary>
    internal void Close(Code code, string reason) {
      if (!IsOpen) return;
      End(code, reason);
      _bye.Code = code;
      _bye.Reason = reason;
      _byesLeft = Byes;
    }

    /// <summary>Writes the next datagram that is due into an array of at least 1200 bytes. Returns its length, or 0.
    /// </summary>
    internal int NextDatagram(long now, byte[] into) {
      if (_byesLeft > 0) {
        --_byesLeft;
        ProtoWriter last = Begin(now, into);
        int frame = last.Begin(26), bye = last.Begin(42);
        _bye.Write(ref last);
        last.End(bye);
        last.End(frame);
        return Finish(now, last.At, into);
      }
      if (!IsOpen || now < NextTimeToSend()) return 0;
      ProtoWriter writer = Begin(now, into);
      if (_hasForce) {
        int frame = writer.Begin(26), force = writer.Begin(18);
        _force.Write(ref writer);
        writer.End(force);
        writer.End(frame);
        _hasForce = false;
      }
      // An answer and a request have less than 512 bytes together, so there is room for one of each.
      ControlAck answer = Answering.NextDue();
      if (answer != null) {
        int frame = writer.Begin(26), ack = writer.Begin(34);
        answer.Write(ref writer);
        writer.End(ack);
        writer.End(frame);
      }
      Control request = Asked.NextDue(now, Resend);
      if (request != null) {
        int frame = writer.Begin(26), control = writer.Begin(26);
        request.Write(ref writer);
        writer.End(control);
        writer.End(frame);
      }
      return Finish(now, writer.At, into);
    }

    /// <summary>When Tick or NextDatagram is due, if nothing is received.</summary>
    internal long NextTime() {
      if (_byesLeft > 0) return long.MinValue;
      return IsOpen ? Math.Min(NextTimeToSend(), _lastHeard + Timeout) : Time.Never;
    }

    private long Resend => _smoothed == 0 ? FirstResend : Math.Max(ShortestResend, _smoothed + 4 * _variation);

    private long NextTimeToSend() {
      if (_hasForce || _next == 0 || Answering.HasDue) return long.MinValue;
      return Math.Min(_lastSent + KeepAlive, Asked.NextTime());
    }

    private ProtoWriter Begin(long now, byte[] into) {
      byte epoch = _sealing == null ? (byte)0 : _sealing.SendEpoch(now);
      Header.Write(into, DatagramType.Data, epoch, Suite, _connection, _next);
      var writer = new ProtoWriter(into, Header.Size, Header.Largest - Aead.TagSize);
      writer.Fixed64(9, now);
      if (!_seen.Any) return writer;
      _echo.ReceivedMask = _seen.MaskBefore(_echo.PacketNumber);
      int echo = writer.Begin(18);
      _echo.Write(ref writer);
      writer.End(echo);
      return writer;
    }

    private int Finish(long now, int count, byte[] into) {
      _lastSent = now;
      ulong number = _next++;
      return _sealing == null ? count : _sealing.Seal(number, into, count);
    }
  }
}
