// SPDX-License-Identifier: Apache-2.0
using System;

namespace Tendon {
  /// <summary>Poly1305 (RFC 8439) of whole blocks, as ChaCha20-Poly1305 uses it.</summary>
  internal sealed class Poly1305 {
    private const uint Low26 = (1 << 26) - 1;
    private static readonly byte[] Clamp =
      { 255, 255, 255, 15, 252, 255, 255, 15, 252, 255, 255, 15, 252, 255, 255, 15 };
    // r and the sum as five limbs of 26 bits, and the part of the key that is added in the end.
    private readonly uint[] _r = new uint[5];
    private readonly uint[] _sum = new uint[5];
    private readonly byte[] _added = new byte[16];
    private readonly byte[] _block = new byte[16];

    /// <summary>Begins with the first 32 bytes as the key.</summary>
    internal void Begin(byte[] key) {
      for (int i = 0; i < 16; ++i) _block[i] = (byte)(key[i] & Clamp[i]);
      Limbs(_block, _r);
      Buffer.BlockCopy(key, 16, _added, 0, 16);
      Array.Clear(_sum, 0, 5);
    }

    /// <summary>Pads the bytes with zeros to whole blocks.</summary>
    internal void Absorb(byte[] data, int at, int count) {
      for (; count > 0; at += 16, count -= 16) {
        int size = Math.Min(count, 16);
        Buffer.BlockCopy(data, at, _block, 0, size);
        for (int i = size; i < 16; ++i) _block[i] = 0;
        AbsorbBlock();
      }
    }

    /// <summary>sum = (sum + block + 2^128) r mod 2^130 − 5. In the products, 2^130 is replaced by 5.</summary>
    private void AbsorbBlock() {
      uint w0 = Little.Read32(_block, 0), w1 = Little.Read32(_block, 4);
      uint w2 = Little.Read32(_block, 8), w3 = Little.Read32(_block, 12);
      ulong h0 = _sum[0] + (w0 & Low26);
      ulong h1 = _sum[1] + ((w0 >> 26 | w1 << 6) & Low26);
      ulong h2 = _sum[2] + ((w1 >> 20 | w2 << 12) & Low26);
      ulong h3 = _sum[3] + ((w2 >> 14 | w3 << 18) & Low26);
      ulong h4 = _sum[4] + (w3 >> 8 | 1U << 24);
      ulong r0 = _r[0], r1 = _r[1], r2 = _r[2], r3 = _r[3], r4 = _r[4];
      ulong s1 = 5 * r1, s2 = 5 * r2, s3 = 5 * r3, s4 = 5 * r4;
      ulong d0 = h0 * r0 + h1 * s4 + h2 * s3 + h3 * s2 + h4 * s1;
      ulong d1 = h0 * r1 + h1 * r0 + h2 * s4 + h3 * s3 + h4 * s2;
      ulong d2 = h0 * r2 + h1 * r1 + h2 * r0 + h3 * s4 + h4 * s3;
      ulong d3 = h0 * r3 + h1 * r2 + h2 * r1 + h3 * r0 + h4 * s4;
      ulong d4 = h0 * r4 + h1 * r3 + h2 * r2 + h3 * r1 + h4 * r0;
      d1 += d0 >> 26;
      d2 += d1 >> 26;
      d3 += d2 >> 26;
      d4 += d3 >> 26;
      d0 = (d0 & Low26) + 5 * (d4 >> 26);
      _sum[0] = (uint)d0 & Low26;
      _sum[1] = (uint)((d1 & Low26) + (d0 >> 26));
      _sum[2] = (uint)d2 & Low26;
      _sum[3] = (uint)d3 & Low26;
      _sum[4] = (uint)d4 & Low26;
    }

    internal void Finish(byte[] tag) {
      Carry();
      Carry();
      // sum − p = sum + 5 − 2^130, which is chosen if it is not negative.
      uint carry = 5;
      uint mask = 0;
      for (int pass = 0; pass < 2; ++pass) {
        for (int i = 0; i < 5; ++i) {
          uint limb = _sum[i] + carry;
          carry = limb >> 26;
          if (pass == 1) _sum[i] = limb & Low26;
        }
        mask = 0 - carry; // all ones if sum ≥ p
        carry = 5 & mask;
      }
      ulong low = _sum[0] | (ulong)_sum[1] << 26 | (ulong)_sum[2] << 52;
      ulong high = _sum[2] >> 12 | (ulong)_sum[3] << 14 | (ulong)_sum[4] << 40;
      ulong added = low + Little.Read64(_added, 0);
      Little.Write64(tag, 0, added);
      Little.Write64(tag, 8, high + Little.Read64(_added, 8) + (added < low ? 1UL : 0));
    }

    private void Carry() {
      uint carry = 0;
      for (int i = 0; i < 5; ++i) {
        uint limb = _sum[i] + carry;
        carry = limb >> 26;
        _sum[i] = limb & Low26;
      }
      _sum[0] += 5 * carry;
    }

    private static void Limbs(byte[] from, uint[] to) {
      uint w0 = Little.Read32(from, 0), w1 = Little.Read32(from, 4);
      uint w2 = Little.Read32(from, 8), w3 = Little.Read32(from, 12);
      to[0] = w0 & Low26;
      to[1] = (w0 >> 26 | w1 << 6) & Low26;
      to[2] = (w1 >> 20 | w2 << 12) & Low26;
      to[3] = (w2 >> 14 | w3 << 18) & Low26;
      to[4] = w3 >> 8;
    }
  }
}
