// SPDX-License-Identifier: Apache-2.0
using System;

namespace Tendon {
  /// <summary>X25519 (RFC 7748). A number modulo p = 2^255 − 19 has 16 limbs of 16 bits. The time does not depend on
  /// the scalar.</summary>
  internal static class X25519 {
    internal static byte[] PublicKey(byte[] scalar) {
      var basePoint = new byte[32];
      basePoint[0] = 9;
      return Multiply(scalar, basePoint);
    }

    /// <summary>Returns null if the result is 0, because then the point was chosen to make it known.</summary>
    internal static byte[] Multiply(byte[] scalar, byte[] point) {
      byte[] bits = (byte[])scalar.Clone();
      bits[0] &= 248;
      bits[31] = (byte)(bits[31] & 127 | 64);
      long[] x1 = Unpacked(point), x2 = One(1), z2 = One(0), x3 = Unpacked(point), z3 = One(1);
      long[] a = new long[16], b = new long[16], c = new long[16], d = new long[16];
      long swapped = 0;
      for (int i = 254; i >= 0; --i) {
        long bit = bits[i / 8] >> i % 8 & 1;
        Swap(x2, x3, swapped ^ bit);
        Swap(z2, z3, swapped ^ bit);
        swapped = bit;
        Add(a, x2, z2);
        Subtract(b, x2, z2);
        Add(c, x3, z3);
        Subtract(d, x3, z3);
        Product(d, d, a); // DA
        Product(c, c, b); // CB
        Product(a, a, a); // AA
        Product(b, b, b); // BB
        Add(x3, d, c);
        Product(x3, x3, x3);
        Subtract(z3, d, c);
        Product(z3, z3, z3);
        Product(z3, z3, x1);
        Product(x2, a, b);
        Subtract(b, a, b); // E
        for (int k = 0; k < 16; ++k) c[k] = 121665 * b[k];
        Carry(c);
        Add(c, c, a);
        Product(z2, b, c);
      }
      Swap(x2, x3, swapped);
      Swap(z2, z3, swapped);
      Product(x2, x2, Inverse(z2));
      byte[] result = Packed(x2);
      int any = 0;
      foreach (byte one in result) any |= one;
      return any == 0 ? null : result;
    }

    private static long[] One(long value) {
      var one = new long[16];
      one[0] = value;
      return one;
    }

    private static long[] Unpacked(byte[] from) {
      var to = new long[16];
      for (int i = 0; i < 16; ++i) to[i] = from[2 * i] | from[2 * i + 1] << 8;
      to[15] &= 0x7FFF;
      return to;
    }

    private static void Add(long[] to, long[] a, long[] b) {
      for (int i = 0; i < 16; ++i) to[i] = a[i] + b[i];
    }

    private static void Subtract(long[] to, long[] a, long[] b) {
      for (int i = 0; i < 16; ++i) to[i] = a[i] - b[i];
    }

    /// <summary>In the product, 2^256 is replaced by 38.</summary>
    private static void Product(long[] to, long[] a, long[] b) {
      var wide = new long[32];
      for (int i = 0; i < 16; ++i) {
        for (int j = 0; j < 16; ++j) wide[i + j] += a[i] * b[j];
      }
      for (int i = 0; i < 16; ++i) to[i] = wide[i] + 38 * wide[i + 16];
      Carry(to);
      Carry(to);
    }

    private static void Carry(long[] a) {
      for (int i = 0; i < 16; ++i) {
        long carry = a[i] >> 16;
        a[i] -= carry << 16;
        if (i < 15) a[i + 1] += carry;
        else a[0] += 38 * carry;
      }
    }

    private static void Swap(long[] a, long[] b, long bit) {
      for (int i = 0; i < 16; ++i) {
        long change = -bit & (a[i] ^ b[i]);
        a[i] ^= change;
        b[i] ^= change;
      }
    }

    /// <summary>a^(p − 2). All bits of p − 2 up to 254 are 1, except for bits 2 and 4.</summary>
    private static long[] Inverse(long[] a) {
      var power = (long[])a.Clone();
      for (int bit = 253; bit >= 0; --bit) {
        Product(power, power, power);
        if (bit != 2 && bit != 4) Product(power, power, a);
      }
      return power;
    }

    private static byte[] Packed(long[] a) {
      for (int i = 0; i < 3; ++i) Carry(a);
      var less = new long[16];
      for (int pass = 0; pass < 2; ++pass) // the number is less than 2^256 < 3 p
      {
        long borrow = 0;
        for (int i = 0; i < 16; ++i) {
          long limb = a[i] - (i == 0 ? 0xFFED : i == 15 ? 0x7FFF : 0xFFFF) + borrow;
          less[i] = limb & 0xFFFF;
          borrow = limb >> 16;
        }
        Swap(a, less, 1 + borrow); // if a ≥ p
      }
      var to = new byte[32];
      for (int i = 0; i < 16; ++i) {
        to[2 * i] = (byte)a[i];
        to[2 * i + 1] = (byte)(a[i] >> 8);
      }
      return to;
    }
  }
}
