// SPDX-License-Identifier: Apache-2.0
using System;

namespace Tendon {
  /// <summary>The packet numbers that have arrived: the newest, and the 1983 before it (RFC 6479). All older ones count
  /// as seen.</summary>
  internal sealed class ReplayWindow {
    private const ulong Remembered = 1984;
    private const int Words = 32;
    private readonly ulong[] _bits = new ulong[Words];

    /// <summary>Valid if Any.</summary>
    internal ulong Newest { get; private set; }

    internal bool Any { get; private set; }
    internal bool IsNewest(ulong number) => !Any || number > Newest;

    internal bool Contains(ulong number) =>
      !IsNewest(number) && (Newest - number >= Remembered || Bit(number));

    internal void Insert(ulong number) {
      if (IsNewest(number)) {
        ulong newest = Newest / 64, last = number / 64;
        if (!Any || last - newest >= Words) Array.Clear(_bits, 0, Words);
        else for (ulong word = newest + 1; word <= last; ++word) _bits[word % Words] = 0;
        Newest = number;
        Any = true;
      }
      _bits[number / 64 % Words] |= 1UL << (int)(number % 64);
    }

    /// <summary>Bit i is set if packet `number` − 1 − i has arrived.</summary>
    internal uint MaskBefore(ulong number) {
      uint mask = 0;
      for (int i = 0; i < 32 && (ulong)i < number; ++i) {
        if (Bit(number - 1 - (ulong)i)) mask |= 1U << i;
      }
      return mask;
    }

    private bool Bit(ulong number) => (_bits[number / 64 % Words] >> (int)(number % 64) & 1) == 1;
  }
}
