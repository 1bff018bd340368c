// SPDX-License-Identifier: Apache-2.0
using System;

namespace Tendon {
  /// <summary>ChaCha20-Poly1305 (RFC 8439).</summary>
  internal sealed class ChaChaPoly : Aead {
    private readonly uint[] _start = new uint[16];
    private readonly uint[] _words = new uint[16];
    private readonly byte[] _stream = new byte[64];
    private readonly Poly1305 _poly = new Poly1305();
    private readonly byte[] _lengths = new byte[16];

    internal ChaChaPoly(byte[] key) {
      for (int i = 0; i < 4; ++i) _start[i] = Little.Read32(Constants, 4 * i);
      for (int i = 0; i < 8; ++i) _start[4 + i] = Little.Read32(key, 4 * i);
    }

    internal override byte Suite => 1;
    internal override Aead WithKey(byte[] key) => new ChaChaPoly(key);
    protected override void Number(byte[] nonce, ulong number) => Little.Write64(nonce, 4, number);

    private static readonly byte[] Constants = System.Text.Encoding.ASCII.GetBytes("expand 32-byte k");

    protected override void Begin(byte[] nonce) {
      for (int i = 0; i < 3; ++i) _start[13 + i] = Little.Read32(nonce, 4 * i);
      Block(0);
      _poly.Begin(_stream);
    }

    protected override void Crypt(byte[] data, int at, int count) {
      for (uint block = 1; count > 0; ++block, at += 64, count -= 64) {
        Block(block);
        for (int i = 0; i < 64 && i < count; ++i) data[at + i] ^= _stream[i];
      }
    }

    private void Block(uint number) {
      _start[12] = number;
      Array.Copy(_start, _words, 16);
      for (int i = 0; i < 10; ++i) {
        for (int column = 0; column < 4; ++column) Quarter(column, 4 + column, 8 + column, 12 + column);
        for (int d = 0; d < 4; ++d) Quarter(d, 4 + (d + 1) % 4, 8 + (d + 2) % 4, 12 + (d + 3) % 4);
      }
      for (int i = 0; i < 16; ++i) Little.Write32(_stream, 4 * i, _words[i] + _start[i]);
    }

    private void Quarter(int a, int b, int c, int d) {
      uint wa = _words[a], wb = _words[b], wc = _words[c], wd = _words[d];
      wa += wb;
      wd = Rotated(wd ^ wa, 16);
      wc += wd;
      wb = Rotated(wb ^ wc, 12);
      wa += wb;
      wd = Rotated(wd ^ wa, 8);
      wc += wd;
      wb = Rotated(wb ^ wc, 7);
      _words[a] = wa;
      _words[b] = wb;
      _words[c] = wc;
      _words[d] = wd;
    }

    private static uint Rotated(uint value, int by) => value << by | value >> 32 - by;

    protected override void Authenticate(
      byte[] associated, int associatedCount, byte[] data, int at, int count, byte[] tag) {
      _poly.Absorb(associated, 0, associatedCount);
      _poly.Absorb(data, at, count);
      Little.Write64(_lengths, 0, (ulong)associatedCount);
      Little.Write64(_lengths, 8, (ulong)count);
      _poly.Absorb(_lengths, 0, 16);
      _poly.Finish(tag);
    }
  }
}
