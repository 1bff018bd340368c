// SPDX-License-Identifier: Apache-2.0
using System;

namespace Tendon {
  /// <summary>
  /// AES-256 (FIPS 197), four blocks at once, without tables, so that the time and the addresses do not depend on the
  /// key or the text.
  ///
  /// Plane k holds bit k of all 64 bytes. Byte (row, column) of block b is at bit 16 row + 4 column + b of each plane.
  /// </summary>
  internal sealed class Aes256 {
    private const int Rounds = 14;
    private readonly ulong[] _keys = new ulong[8 * (Rounds + 1)];
    private readonly ulong[] _planes = new ulong[8];
    private readonly ulong[] _power = new ulong[8];
    private readonly ulong[] _product = new ulong[8];
    private readonly ulong[] _wide = new ulong[15];

    internal Aes256(byte[] key) {
      var words = new byte[16 * (Rounds + 1)];
      Buffer.BlockCopy(key, 0, words, 0, 32);
      byte round = 1;
      var word = new byte[64];
      for (int at = 32; at < words.Length; at += 4) {
        Buffer.BlockCopy(words, at - 4, word, 0, 4);
        if (at % 32 == 0 || at % 32 == 16) {
          Pack(word);
          SubBytes();
          Unpack(word);
        }
        if (at % 32 == 0) {
          byte first = word[0];
          word[0] = (byte)(word[1] ^ round);
          word[1] = word[2];
          word[2] = word[3];
          word[3] = first;
          round = (byte)(round << 1);
        }
        for (int i = 0; i < 4; ++i) words[at + i] = (byte)(words[at + i - 32] ^ word[i]);
      }
      var four = new byte[64];
      for (int i = 0; i <= Rounds; ++i) {
        for (int block = 0; block < 4; ++block) Buffer.BlockCopy(words, 16 * i, four, 16 * block, 16);
        Pack(four);
        Array.Copy(_planes, 0, _keys, 8 * i, 8);
      }
    }

    /// <summary>Encrypts four blocks of 16 bytes in place.</summary>
    internal void Encrypt(byte[] blocks) {
      Pack(blocks);
      AddKey(0);
      for (int round = 1; round <= Rounds; ++round) {
        SubBytes();
        ShiftRows();
        if (round < Rounds) MixColumns();
        AddKey(round);
      }
      Unpack(blocks);
    }

    private void Pack(byte[] blocks) {
      Array.Clear(_planes, 0, 8);
      for (int i = 0; i < 64; ++i) {
        int place = Place(i);
        ulong one = blocks[i];
        for (int k = 0; k < 8; ++k) _planes[k] |= (one >> k & 1) << place;
      }
    }

    private void Unpack(byte[] blocks) {
      for (int i = 0; i < 64; ++i) {
        int place = Place(i);
        ulong one = 0;
        for (int k = 0; k < 8; ++k) one |= (_planes[k] >> place & 1) << k;
        blocks[i] = (byte)one;
      }
    }

    /// <summary>A block is stored by columns.</summary>
    private static int Place(int i) => 16 * (i % 4) + 4 * (i / 4 % 4) + i / 16;

    private void AddKey(int round) {
      for (int k = 0; k < 8; ++k) _planes[k] ^= _keys[8 * round + k];
    }

    /// <summary>Row r moves by r columns.</summary>
    private void ShiftRows() {
      for (int k = 0; k < 8; ++k) {
        ulong plane = _planes[k], shifted = 0;
        for (int row = 0; row < 4; ++row) {
          ulong bits = plane >> 16 * row & 0xFFFF;
          shifted |= ((bits >> 4 * row | bits << 16 - 4 * row) & 0xFFFF) << 16 * row;
        }
        _planes[k] = shifted;
      }
    }

    /// <summary>Row r becomes 2 (a_r + a_r+1) + a_r+1 + a_r+2 + a_r+3. A rotation by 16 gives the next row.</summary>
    private void MixColumns() {
      for (int k = 0; k < 8; ++k) {
        _power[k] = _planes[k] >> 16 | _planes[k] << 48;
        _product[k] = _planes[k] ^ _power[k];
      }
      ulong top = _product[7];
      for (int k = 0; k < 8; ++k) {
        ulong doubled = (k == 0 ? 0 : _product[k - 1]) ^ ((0x1B >> k & 1) == 1 ? top : 0);
        _planes[k] = doubled ^ _power[k] ^ (_product[k] >> 32 | _product[k] << 32);
      }
    }

    /// <summary>The inverse x^254 in GF(2^8), then the affine map.</summary>
    private void SubBytes() {
      Array.Copy(_planes, _power, 8);
      Square(_power); // x²
      Array.Copy(_power, _product, 8);
      Multiply(_product, _planes); // x³
      Array.Copy(_product, _planes, 8);
      Square(_product);
      Square(_product); // x¹²
      Multiply(_planes, _product); // x¹⁵
      for (int i = 0; i < 4; ++i) Square(_planes); // x²⁴⁰
      Multiply(_planes, _product); // x²⁵²
      Multiply(_planes, _power); // x²⁵⁴
      for (int k = 0; k < 8; ++k) {
        ulong bit = _planes[k] ^ _planes[(k + 4) % 8] ^ _planes[(k + 5) % 8] ^ _planes[(k + 6) % 8] ^
              _planes[(k + 7) % 8];
        _power[k] = (0x63 >> k & 1) == 1 ? ~bit : bit;
      }
      Array.Copy(_power, _planes, 8);
    }

    private void Square(ulong[] a) {
      Array.Clear(_wide, 0, 15);
      for (int k = 0; k < 8; ++k) _wide[2 * k] = a[k];
      Reduce(a);
    }

    private void Multiply(ulong[] a, ulong[] b) {
      Array.Clear(_wide, 0, 15);
      for (int i = 0; i < 8; ++i) {
        ulong ai = a[i];
        for (int j = 0; j < 8; ++j) _wide[i + j] ^= ai & b[j];
      }
      Reduce(a);
    }

    /// <summary>x⁸ = x⁴ + x³ + x + 1.</summary>
    private void Reduce(ulong[] to) {
      for (int k = 14; k >= 8; --k) {
        ulong high = _wide[k];
        _wide[k - 4] ^= high;
        _wide[k - 5] ^= high;
        _wide[k - 7] ^= high;
        _wide[k - 8] ^= high;
      }
      Array.Copy(_wide, to, 8);
    }
  }
}
