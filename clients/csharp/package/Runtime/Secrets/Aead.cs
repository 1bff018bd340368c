// SPDX-License-Identifier: Apache-2.0
using System;

namespace Tendon {
  /// <summary>A cipher that encrypts and authenticates in place, with its key. Seal and Open do not allocate, and their
  /// time does not depend on the key or the bytes. Not thread-safe.</summary>
  internal abstract class Aead {
    internal const int TagSize = 16;
    internal const int KeySize = 32;
    private readonly byte[] _nonce = new byte[12];
    private readonly byte[] _tag = new byte[TagSize];

    /// <summary>The suite of Data that uses this cipher (protocol/WIRE.md).</summary>
    internal abstract byte Suite { get; }

    internal abstract Aead WithKey(byte[] key);

    /// <summary>Encrypts data[at … at + count) and writes the tag behind it. The nonce is made from the number.
    /// </summary>
    internal void Seal(ulong number, byte[] associated, int associatedCount, byte[] data, int at, int count) {
      Seal(NonceOf(number), associated, associatedCount, data, at, count);
    }

    internal void Seal(byte[] nonce, byte[] associated, int associatedCount, byte[] data, int at, int count) {
      Begin(nonce);
      Crypt(data, at, count);
      Authenticate(associated, associatedCount, data, at, count, _tag);
      Buffer.BlockCopy(_tag, 0, data, at + count, TagSize);
    }

    /// <summary>Decrypts the text of data[at … at + count), whose last 16 bytes are the tag. Returns false, without
    /// a change, if it is not authentic.</summary>
    internal bool Open(ulong number, byte[] associated, int associatedCount, byte[] data, int at, int count) {
      if (count < TagSize) return false;
      Begin(NonceOf(number));
      Authenticate(associated, associatedCount, data, at, count - TagSize, _tag);
      int difference = 0;
      for (int i = 0; i < TagSize; ++i) difference |= _tag[i] ^ data[at + count - TagSize + i];
      if (difference != 0) return false;
      Crypt(data, at, count - TagSize);
      return true;
    }

    /// <summary>The key that follows this one.</summary>
    internal byte[] NextKey() {
      var sealedZeros = new byte[KeySize + TagSize];
      Seal(ulong.MaxValue, sealedZeros, 0, sealedZeros, 0, KeySize);
      Array.Resize(ref sealedZeros, KeySize);
      return sealedZeros;
    }

    /// <summary>Writes the number into the last 8 bytes of a nonce.</summary>
    protected abstract void Number(byte[] nonce, ulong number);

    protected abstract void Begin(byte[] nonce);
    protected abstract void Crypt(byte[] data, int at, int count);
    protected abstract void Authenticate(
        byte[] associated, int associatedCount, byte[] data, int at, int count, byte[] tag);

    private byte[] NonceOf(ulong number) {
      Number(_nonce, number);
      return _nonce;
    }
  }
}
