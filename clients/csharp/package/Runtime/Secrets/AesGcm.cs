// SPDX-License-Identifier: Apache-2.0
using System;

namespace Tendon {
  /// <summary>AES-256-GCM (NIST SP 800-38D) with nonces of 12 bytes.</summary>
  internal sealed class AesGcm : Aead {
    private readonly Aes256 _aes;
    private readonly byte[] _stream = new byte[64];
    private readonly byte[] _counter = new byte[16];
    private readonly byte[] _block = new byte[16];
    // H x^i for each bit of GHASH.
    private readonly ulong[] _high = new ulong[128];
    private readonly ulong[] _low = new ulong[128];
    private ulong _sumHigh;
    private ulong _sumLow;

    internal AesGcm(byte[] key) {
      _aes = new Aes256(key);
      _aes.Encrypt(_stream);
      ulong high = Big.Read64(_stream, 0), low = Big.Read64(_stream, 8);
      for (int i = 0; i < 128; ++i) {
        _high[i] = high;
        _low[i] = low;
        ulong odd = 0 - (low & 1);
        low = low >> 1 | high << 63;
        high = high >> 1 ^ (0xE100000000000000 & odd);
      }
    }

    internal override byte Suite => 2;
    internal override Aead WithKey(byte[] key) => new AesGcm(key);
    protected override void Number(byte[] nonce, ulong number) => Big.Write64(nonce, 4, number);
    protected override void Begin(byte[] nonce) => Buffer.BlockCopy(nonce, 0, _counter, 0, 12);

    protected override void Crypt(byte[] data, int at, int count) {
      for (uint block = 2; count > 0; block += 4, at += 64, count -= 64) {
        Stream(block);
        for (int i = 0; i < 64 && i < count; ++i) data[at + i] ^= _stream[i];
      }
    }

    /// <summary>Computes the key stream of four blocks.</summary>
    private void Stream(uint first) {
      for (uint i = 0; i < 4; ++i) {
        uint number = first + i;
        for (int k = 0; k < 4; ++k) _counter[12 + k] = (byte)(number >> 24 - 8 * k);
        Buffer.BlockCopy(_counter, 0, _stream, 16 * (int)i, 16);
      }
      _aes.Encrypt(_stream);
    }

    protected override void Authenticate(
      byte[] associated, int associatedCount, byte[] data, int at, int count, byte[] tag) {
      _sumHigh = _sumLow = 0;
      Absorb(associated, 0, associatedCount);
      Absorb(data, at, count);
      Big.Write64(_block, 0, 8 * (ulong)associatedCount);
      Big.Write64(_block, 8, 8 * (ulong)count);
      AbsorbBlock();
      Stream(1);
      Big.Write64(tag, 0, _sumHigh ^ Big.Read64(_stream, 0));
      Big.Write64(tag, 8, _sumLow ^ Big.Read64(_stream, 8));
    }

    /// <summary>Pads the bytes with zeros to whole blocks.</summary>
    private void Absorb(byte[] data, int at, int count) {
      for (; count > 0; at += 16, count -= 16) {
        int size = Math.Min(count, 16);
        Buffer.BlockCopy(data, at, _block, 0, size);
        for (int i = size; i < 16; ++i) _block[i] = 0;
        AbsorbBlock();
      }
    }

    /// <summary>sum = (sum + block) H. All terms are computed and masked.</summary>
    private void AbsorbBlock() {
      ulong high = _sumHigh ^ Big.Read64(_block, 0), low = _sumLow ^ Big.Read64(_block, 8);
      ulong productHigh = 0, productLow = 0;
      for (int i = 0; i < 64; ++i) {
        ulong mask = 0 - (high >> 63 - i & 1);
        productHigh ^= _high[i] & mask;
        productLow ^= _low[i] & mask;
        mask = 0 - (low >> 63 - i & 1);
        productHigh ^= _high[64 + i] & mask;
        productLow ^= _low[64 + i] & mask;
      }
      _sumHigh = productHigh;
      _sumLow = productLow;
    }
  }

  /// <summary>Big-endian numbers in arrays.</summary>
  internal static class Big {
    internal static ulong Read64(byte[] from, int at) {
      ulong value = 0;
      for (int i = 0; i < 8; ++i) value = value << 8 | from[at + i];
      return value;
    }

    internal static void Write64(byte[] to, int at, ulong value) {
      for (int i = 0; i < 8; ++i) to[at + i] = (byte)(value >> 56 - 8 * i);
    }
  }
}
