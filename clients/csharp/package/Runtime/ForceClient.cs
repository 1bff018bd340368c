// SPDX-License-Identifier: Apache-2.0
using System;

namespace Tendon {
  public enum Phase {
    /// <summary>Waits until the next attempt.</summary>
    Pause,

    /// <summary>The server has not answered yet.</summary>
    Opening,

    Open,

    /// <summary>Closed by Close, refused for good, or replaced. There is no further attempt.</summary>
    Ended,
  }

  /// <summary>
  /// A client without socket and clock: it opens a session, and opens the next one when it ends. Inputs are datagrams
  /// and times (ns of a monotonic clock), outputs are datagrams. Not thread-safe. HapticClient adds the socket.
  /// </summary>
  public sealed class ForceClient {
    private const long FirstPause = 100 * Time.Millisecond;
    private const long LongestPause = 2 * Time.Second;
    private readonly Config _config;
    private Opening _opening;
    private Session _session;
    private bool _closed;
    private long _pauseUntil = long.MinValue;
    private long _pause = FirstPause;
    private long _openingSince;
    private bool _localModel, _handle;
    private ulong _sequence;
    private bool _askedForLease, _askAgain;
    private readonly ForceCommand _command = new ForceCommand();

    /// <summary>Throws an ArgumentException if a value of the config is out of bounds.</summary>
    public ForceClient(Config config) {
      config.Check();
      _config = config;
    }

    public Phase Phase { get; private set; } = Phase.Pause;

    /// <summary>Why there is no session, as text for the user: the refusal, or the end of the last session. Empty
    /// before the first one.</summary>
    public string Reason { get; private set; } = "";

    /// <summary>null before the first session.</summary>
    public Welcome Welcome { get; private set; }

    /// <summary>What the server tells of the device and its handle; null until then.</summary>
    public DeviceDescription Device { get; private set; }
    public HandleDescription Handle { get; private set; }

    /// <summary>Whether the server will still describe the handle of this session.</summary>
    public bool AwaitsHandle { get; private set; }

    /// <summary>Whether our forces are used: a session is open, and we hold the channel.</summary>
    public bool Holds { get; private set; }

    /// <summary>The number of the device and of the channel that are used.</summary>
    public uint DeviceNumber { get; private set; }
    public uint ChannelNumber { get; private set; }

    /// <summary>The newest report on our forces; null before the first session.</summary>
    public LinkReport Report => _session?.Report;

    public LinkStats Stats => _session == null ? new LinkStats() : _session.Stats;

    /// <summary>The suite of Data: 0, 1 or 2.</summary>
    public int Suite => _session == null ? 0 : _session.Suite;

    /// <summary>For how long the server has not answered, ns.</summary>
    internal long Unanswered(long now) => Phase == Phase.Opening ? now - _openingSince : 0;

    // ---- In ----

    /// <summary>Handles the first `count` bytes, and decrypts them in place.</summary>
    public void Receive(long now, byte[] datagram, int count) {
      if (Phase == Phase.Open) {
        _session.Receive(now, datagram, count);
        EndOfSession(now);
        return;
      }
      if (Phase != Phase.Opening) return;
      _opening.Receive(now, datagram, count);
      if (_opening.Refused != null) TakeRefusal(now, _opening.Refused);
      else if (_opening.Welcome != null) Open(now);
    }

    private void TakeRefusal(long now, Refused refused) {
      Reason = $"refused ({refused.Code}): {refused.Detail}";
      if (refused.Code == Code.Busy || refused.Code == Code.Shutdown) Wait(now);
      else End();
    }

    private void Open(long now) {
      Welcome = _opening.Welcome;
      DeviceNumber = ChannelNumber = 0;
      Role role = Welcome.Role;
      if (Welcome.Grants.Count > 0) {
        DeviceNumber = Welcome.Grants[0].Device;
        ChannelNumber = Welcome.Grants[0].Channel;
        role = Welcome.Grants[0].Role;
      }
      Holds = role == Role.Controller && !_config.Observe;
      _localModel = Welcome.Features.Contains("local-model");
      _handle = Welcome.Features.Contains("handle");
      _session = new Session(_opening.Connection, _opening.Sealing, DeviceNumber, now);
      _session.Answering.OnLeaseLost = TakeLoss;
      _opening = null;
      _sequence = 0;
      _askedForLease = _askAgain = false;
      _pause = FirstPause;
      Phase = Phase.Open;
      Reason = "";
      Device = null;
      Handle = null;
      if (_config.RateHz > 0) {
        var rate = new Control { Op = Control.OpCase.SetStateRate };
        rate.SetStateRate.Hz = _config.RateHz;
        rate.SetStateRate.Device = DeviceNumber;
        Request(rate, null);
      }
      Describe(false);
      AwaitsHandle = _handle;
      if (_handle) Describe(true);
    }

    private void Describe(bool handle) {
      var describe = new Control { Op = Control.OpCase.Describe };
      describe.Describe.Device = DeviceNumber;
      describe.Describe.Handle = handle;
      Request(describe, answer => {
        if (answer.HasDevice) Device = answer.Device;
        if (answer.HasHandle) Handle = answer.Handle;
        if (handle) AwaitsHandle = false;
      });
    }

    /// <summary>Sends a request reliably. `then` receives the answer and may be null. It must not throw,
    /// and it is called in the thread of the client. Returns false if there is no
    /// session, or if 16 requests are pending. Throws an ArgumentException if a value is out of bounds.</summary>
    public bool Request(Control request, Action<ControlAck> then) {
      request.Id = 1; // is within bounds; the number follows
      string objection = request.Objection();
      if (objection != null) throw new ArgumentException($"{objection} is out of bounds (WIRE.md)");
      if (Phase != Phase.Open || !_session.Asked.Add(request, then)) return false;
      if (request.Op == Control.OpCase.GiveLease && request.GiveLease.Device == DeviceNumber &&
          request.GiveLease.Channel == ChannelNumber) {
        Holds = false;
      }
      return true;
    }

    /// <summary>Asks for the lease of the channel. Holds becomes true if the server agrees. Otherwise, `refused`
    /// receives the code, the holder and the time to wait.</summary>
    public bool TakeLease(Action<ControlAck> refused) {
      var take = new Control { Op = Control.OpCase.TakeLease };
      take.TakeLease.Device = DeviceNumber;
      take.TakeLease.Channel = ChannelNumber;
      _askedForLease = true;
      return Request(take, answer => {
        _askedForLease = false;
        bool again = _askAgain;
        _askAgain = false;
        if (answer.Code != Code.Ok) refused?.Invoke(answer);
        else if (again) TakeLease(refused); // the loss may be newer than this answer
        else Holds = true;
      });
    }

    private void TakeLoss(LeaseLost lost) {
      if (lost.Device != DeviceNumber || lost.Channel != ChannelNumber) return;
      Holds = false;
      _askAgain = _askedForLease;
    }

    private void EndOfSession(long now) {
      if (Phase != Phase.Open || _session.IsOpen) return;
      Holds = false;
      Reason = $"the session ended ({_session.EndCode}): {_session.EndReason}";
      if (_session.EndCode == Code.Replaced) End();
      else if (_session.EndCode != Code.Expired) Wait(now);
    }

    private void Wait(long now) {
      Phase = Phase.Pause;
      _opening = null;
      _pauseUntil = now + _pause;
      _pause = Math.Min(2 * _pause, LongestPause);
    }

    private void End() {
      Phase = Phase.Ended;
      _opening = null;
    }

    // ---- The engine ----

    /// <summary>Copies the newest state of the device. Returns false if it was taken before.</summary>
    public bool TakeState(DeviceState into) {
      if (Phase != Phase.Open || !_session.HasState) return false;
      _session.HasState = false;
      into.CopyFrom(_session.State);
      into.Session = _session;
      return true;
    }

    /// <summary>
    /// Answers a state with a force on the hand. The sequence, tick, device, channel and a zero ValidForUs are filled
    /// in. What the server has not granted is left out. Returns null, or the reason why nothing is sent: no session, a
    /// state that TakeState has not returned in this session, no lease, or the first field that is not finite or out of
    /// bounds.
    /// </summary>
    public string Send(DeviceState answered, ForceCommand force) {
      if (Phase != Phase.Open) return NoSession;
      if (!Holds) return NoLease;
      if (answered.Session != _session) return OtherSession;
      _command.CopyFrom(force);
      _command.Sequence = _sequence + 1;
      _command.BasedOnTick = answered.Tick;
      _command.Device = DeviceNumber;
      _command.Channel = ChannelNumber;
      _command.Way = 0;
      _command.Field = 0;
      if (_command.ValidForUs == 0) _command.ValidForUs = _config.ValidForUs;
      if (!_localModel) _command.HasModel = false;
      if (!_handle) {
        _command.Torque = null;
        _command.GripForce = null;
        _command.HasRotationModel = false;
      }
      string objection = _command.Objection();
      if (objection != null) return objection + " is not finite, or out of the bounds in WIRE.md";
      ++_sequence;
      _session.Send(_command);
      return null;
    }

    internal const string NoSession = "there is no session";
    internal const string OtherSession = "the state is not of this session";
    internal const string NoLease = "another client holds the channel, or this client is an observer";

    // ---- Out ----

    /// <summary>Ends the session with a Bye. There is no further one.</summary>
    public void Close(string reason) {
      if (Phase == Phase.Open) _session.Close(Code.Ok, reason);
      _closed = true;
      Holds = false;
      Reason = reason;
      End();
    }

    /// <summary>Writes the next datagram that is due into an array of at least 1200 bytes. Returns its length, or 0.
    /// Call it until it returns 0.</summary>
    public int NextDatagram(long now, byte[] into) {
      if (_closed) return _session == null ? 0 : _session.NextDatagram(now, into);
      if (Phase == Phase.Open) {
        _session.Tick(now);
        EndOfSession(now);
        int count = _session.NextDatagram(now, into); // the Byes of a session that has expired
        if (count == 0 && !_session.IsOpen && Phase == Phase.Open) Wait(now);
        return count;
      }
      if (Phase == Phase.Pause && now >= _pauseUntil) {
        byte[] key = _config.Key?.Key;
        _opening = new Opening(_config.Hello(), key, Opening.Drawn(16), Opening.Drawn(32));
        _openingSince = now;
        Phase = Phase.Opening;
      }
      return Phase == Phase.Opening ? _opening.NextDatagram(now, into) : 0;
    }

    /// <summary>When NextDatagram is due, if nothing is received.</summary>
    public long NextTime() {
      if (_closed) return Time.Never;
      if (Phase == Phase.Open) return _session.NextTime();
      if (Phase == Phase.Opening) return _opening.NextTime();
      return Phase == Phase.Pause ? _pauseUntil : Time.Never;
    }
  }
}
