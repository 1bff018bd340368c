// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;

namespace Tendon {
  /// <summary>Our requests: sent until they are answered, and answered in order.</summary>
  internal sealed class OutgoingRequests {
    private const int MostPending = 16;
    private const long Longest = Time.Second;

    private sealed class Pending {
      internal Control Control;
      internal Action<ControlAck> Then;
      internal ControlAck Answer;
      internal long Due;
      internal long Interval;
    }

    private readonly List<Pending> _pending = new List<Pending>();
    private uint _lastId;

    /// <summary>Queues a request, whose `id` is set here. Returns false if 16 are pending.</summary>
    internal bool Add(Control control, Action<ControlAck> then) {
      if (_pending.Count >= MostPending) return false;
      control.Id = ++_lastId;
      _pending.Add(new Pending { Control = control, Then = then, Due = long.MinValue });
      return true;
    }

    /// <summary>Returns false if it answers no request of ours.</summary>
    internal bool Take(ControlAck answer) {
      if (answer.Id == 0 || answer.Id > _lastId) return false;
      Pending found = _pending.Find(one => one.Control.Id == answer.Id && one.Answer == null);
      if (found != null) {
        found.Answer = new ControlAck();
        found.Answer.CopyFrom(answer);
      }
      while (_pending.Count > 0 && _pending[0].Answer != null) {
        Pending first = _pending[0];
        _pending.RemoveAt(0);
        first.Then?.Invoke(first.Answer);
      }
      return true;
    }

    /// <summary>Returns the next request that is due, or null. `resend` is the first interval.</summary>
    internal Control NextDue(long now, long resend) {
      for (int i = 0; i < _pending.Count; ++i) {
        Pending one = _pending[i];
        if (one.Answer != null || one.Due > now) continue;
        one.Interval = one.Interval == 0 ? resend : Math.Min(2 * one.Interval, Longest);
        one.Due = now + one.Interval;
        return one.Control;
      }
      return null;
    }

    internal long NextTime() {
      long due = Time.Never;
      for (int i = 0; i < _pending.Count; ++i) {
        if (_pending[i].Answer == null) due = Math.Min(due, _pending[i].Due);
      }
      return due;
    }
  }

  /// <summary>Requests of the server: each is handled once and in order, and its answer is kept and repeated.</summary>
  internal sealed class IncomingRequests {
    private const uint Kept = 16;
    private readonly SortedDictionary<uint, ControlAck> _early = new SortedDictionary<uint, ControlAck>();
    private readonly Dictionary<uint, LeaseLost> _lost = new Dictionary<uint, LeaseLost>();
    private readonly Dictionary<uint, ControlAck> _answers = new Dictionary<uint, ControlAck>();
    private readonly Queue<uint> _due = new Queue<uint>();
    private uint _next = 1;

    /// <summary>Called for each `lease_lost`.</summary>
    internal Action<LeaseLost> OnLeaseLost;

    internal bool HasDue => _due.Count > 0;

    /// <summary>Takes a request with the first field that is out of bounds, or null. Returns false if it is not one
    /// that a correct server sends.</summary>
    internal bool Take(Control control, string objection) {
      uint id = control.Id;
      if (id == 0 || id - (ulong)_next >= Kept && id >= _next) return false;
      if (id < _next) {
        if (_answers.ContainsKey(id) && !_due.Contains(id)) _due.Enqueue(id);
        return objection == null;
      }
      if (!_early.ContainsKey(id)) {
        var answer = new ControlAck { Id = id, Code = Code.Unsupported, Detail = "the client has no such request" };
        if (objection != null) {
          answer.Code = Code.Invalid;
          answer.Detail = $"{objection} is out of bounds";
        } else if (control.Op == Control.OpCase.LeaseLost) {
          answer.Code = Code.Ok;
          answer.Detail = "";
          var lost = new LeaseLost();
          lost.CopyFrom(control.LeaseLost);
          _lost[id] = lost;
        }
        _early[id] = answer;
      }
      for (; _early.TryGetValue(_next, out ControlAck ready); ++_next) {
        _early.Remove(_next);
        if (_lost.TryGetValue(_next, out LeaseLost lost)) OnLeaseLost?.Invoke(lost);
        _lost.Remove(_next);
        _answers[_next] = ready;
        _answers.Remove(_next - Kept);
        _due.Enqueue(_next);
      }
      return objection == null;
    }

    /// <summary>Returns the next answer to send, or null.</summary>
    internal ControlAck NextDue() {
      while (_due.Count > 0) {
        if (_answers.TryGetValue(_due.Dequeue(), out ControlAck answer)) return answer;
      }
      return null;
    }
  }
}
