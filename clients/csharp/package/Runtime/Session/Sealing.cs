// SPDX-License-Identifier: Apache-2.0
namespace Tendon {
  /// <summary>The keys of a session of suite 1 or 2, and their renewal (protocol/WIRE.md).</summary>
  internal sealed class Sealing {
    internal enum Result {
      Opened,
      Forged,
      OldKey,
    }

    private const long KeyAge = 590 * Time.Second; // 10 s before the latest time
    private const ulong KeyDatagrams = 1 << 20;
    private const long Overlap = 2 * Time.Second;
    private Aead _send;
    private byte _sendEpoch;
    private ulong _sealed;
    private long _keySince;
    private Aead _receive;
    private Aead _next; // made when it is needed
    private Aead _previous;
    private byte _receiveEpoch;
    private long _movedOn;

    internal Sealing(Aead send, Aead receive, long now) {
      _send = send;
      _receive = receive;
      _keySince = now;
    }

    internal byte Suite => _send.Suite;

    /// <summary>The epoch of the next datagram to be sealed.</summary>
    internal byte SendEpoch(long now) {
      if (_sealed >= KeyDatagrams || now - _keySince >= KeyAge) {
        _send = _send.WithKey(_send.NextKey());
        ++_sendEpoch;
        _sealed = 0;
        _keySince = now;
      }
      return _sendEpoch;
    }

    /// <summary>Seals what follows the header. Returns the length of the datagram.</summary>
    internal int Seal(ulong number, byte[] datagram, int count) {
      ++_sealed;
      _send.Seal(number, datagram, Header.Size, datagram, Header.Size, count - Header.Size);
      return count + Aead.TagSize;
    }

    internal Result Open(long now, ulong number, byte[] datagram, int count) {
      if (_previous != null && now - _movedOn >= Overlap) _previous = null;
      byte ahead = (byte)(datagram[2] - _receiveEpoch);
      if (ahead == 1 && _next == null) _next = _receive.WithKey(_receive.NextKey());
      Aead key = ahead == 0 ? _receive : ahead == 1 ? _next : ahead == 0xFF ? _previous : null;
      if (count < Header.Size + Aead.TagSize) return Result.Forged;
      if (key == null) return Result.OldKey;
      if (!key.Open(number, datagram, Header.Size, datagram, Header.Size, count - Header.Size)) return Result.Forged;
      if (ahead == 1) {
        _previous = _receive;
        _receive = _next;
        _next = null;
        ++_receiveEpoch;
        _movedOn = now;
      }
      return Result.Opened;
    }
  }

  /// <summary>Times are in ns of a monotonic clock.</summary>
  internal static class Time {
    internal const long Millisecond = 1_000_000;
    internal const long Second = 1000 * Millisecond;
    internal const long Never = long.MaxValue;
  }
}
