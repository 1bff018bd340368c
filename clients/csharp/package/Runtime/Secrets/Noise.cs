// SPDX-License-Identifier: Apache-2.0
using System;
using System.Security.Cryptography;
using System.Text;

namespace Tendon {
  /// <summary>The client's half of Noise_NNpsk0_25519_ChaChaPoly_SHA256. An object makes one attempt: it writes
  /// message 1, and reads message 2.</summary>
  internal sealed class Noise {
    private readonly byte[] _ephemeral;
    private byte[] _hash;
    private byte[] _chain;
    private byte[] _key;

    internal Noise(byte[] psk, byte[] ephemeral, byte[] prologue, byte[] payload) {
      _ephemeral = ephemeral;
      _hash = Sha256(Ascii("Noise_NNpsk0_25519_ChaChaPoly_SHA256"));
      _chain = _hash;
      MixHash(prologue);
      byte[][] keys = Hkdf(_chain, psk, 3);
      _chain = keys[0];
      MixHash(keys[1]);
      _key = keys[2];
      byte[] mine = X25519.PublicKey(ephemeral);
      MixHash(mine);
      MixKey(mine);
      var text = new byte[payload.Length + Aead.TagSize];
      Buffer.BlockCopy(payload, 0, text, 0, payload.Length);
      new ChaChaPoly(_key).Seal(0, _hash, 32, text, 0, payload.Length);
      MixHash(text);
      Message = Join(mine, text);
    }

    internal byte[] Message { get; }

    /// <summary>What is known after message 2: its payload, h, and a key for each direction.</summary>
    internal sealed class Opened {
      internal byte[] Payload, Hash, ClientToServer, ServerToClient;

      /// <summary>The keys of suite 2 (protocol/WIRE.md).</summary>
      internal void UseSuite2() {
        ClientToServer = Hmac(ClientToServer, Ascii("tendon-suite-2"), Hash);
        ServerToClient = Hmac(ServerToClient, Ascii("tendon-suite-2"), Hash);
      }
    }

    /// <summary>Reads message 2, which are the bytes from `at` on. Returns null if it is not authentic; a later one
    /// may be.</summary>
    internal Opened Read(byte[] answer, int at, int count) {
      if (count < 32 + Aead.TagSize) return null;
      (byte[] hash, byte[] chain, byte[] key) = (_hash, _chain, _key);
      Opened opened = null;
      var theirs = new byte[32];
      Buffer.BlockCopy(answer, at, theirs, 0, 32);
      MixHash(theirs);
      MixKey(theirs);
      byte[] shared = X25519.Multiply(_ephemeral, theirs);
      if (shared != null) {
        MixKey(shared);
        var text = new byte[count - 32];
        Buffer.BlockCopy(answer, at + 32, text, 0, text.Length);
        var sealedText = (byte[])text.Clone();
        if (new ChaChaPoly(_key).Open(0, _hash, 32, text, 0, text.Length)) {
          MixHash(sealedText);
          byte[][] keys = Hkdf(_chain, new byte[0], 2);
          Array.Resize(ref text, text.Length - Aead.TagSize);
          opened = new Opened
            { Payload = text, Hash = _hash, ClientToServer = keys[0], ServerToClient = keys[1] };
        }
      }
      (_hash, _chain, _key) = (hash, chain, key);
      return opened;
    }

    internal static byte[] Sha256(params byte[][] pieces) {
      using (var sha = SHA256.Create()) return sha.ComputeHash(Join(pieces));
    }

    internal static byte[] Hmac(byte[] key, params byte[][] pieces) {
      byte[] inner = new byte[64], outer = new byte[64];
      byte[] used = key.Length > 64 ? Sha256(key) : key;
      for (int i = 0; i < 64; ++i) {
        int one = i < used.Length ? used[i] : 0;
        inner[i] = (byte)(one ^ 0x36);
        outer[i] = (byte)(one ^ 0x5C);
      }
      return Sha256(outer, Sha256(inner, Join(pieces)));
    }

    internal static byte[] Ascii(string text) => Encoding.ASCII.GetBytes(text);

    internal static byte[] Join(params byte[][] pieces) {
      int size = 0;
      foreach (byte[] piece in pieces) size += piece.Length;
      var all = new byte[size];
      int at = 0;
      foreach (byte[] piece in pieces) {
        Buffer.BlockCopy(piece, 0, all, at, piece.Length);
        at += piece.Length;
      }
      return all;
    }

    private void MixHash(byte[] data) => _hash = Sha256(_hash, data);

    private void MixKey(byte[] material) {
      byte[][] keys = Hkdf(_chain, material, 2);
      _chain = keys[0];
      _key = keys[1];
    }

    private static byte[][] Hkdf(byte[] chain, byte[] material, int count) {
      byte[] secret = Hmac(chain, material);
      var keys = new byte[count][];
      var before = new byte[0];
      for (int i = 0; i < count; ++i) before = keys[i] = Hmac(secret, before, new[] { (byte)(i + 1) });
      return keys;
    }
  }
}
