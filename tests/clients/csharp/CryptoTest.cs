// SPDX-License-Identifier: Apache-2.0
using System;

namespace Tendon.Tests {
  public static class CryptoTest {
    private static byte[] Text(Json of, string name) => of[name].Bytes;

    public static void X25519IsThatOfTheRfc() {
      foreach (Json one in Json.Vectors("primitives")["x25519"].List) {
        Check.Bytes(Text(one, "result"), X25519.Multiply(Text(one, "scalar"), Text(one, "point")), one["source"].Text);
      }
    }

    /// <summary>RFC 7748, 5.2: the result after a thousand steps.</summary>
    public static void X25519OfAThousandStepsIsThatOfTheRfc() {
      var k = new byte[32];
      k[0] = 9;
      byte[] u = (byte[])k.Clone();
      for (int i = 0; i < 1000; ++i) {
        byte[] next = X25519.Multiply(k, u);
        u = k;
        k = next;
      }
      Check.Equal("684cf59ba83309552800ef566f2f4d3c1c3887c49360e3875f2eb94d99532c51", Check.Hex(k), "k");
    }

    /// <summary>All points of low order, and those that are p or 2 p larger.</summary>
    public static void APointOfLowOrderHasNoSecret() {
      string[] points = {
        "0000000000000000000000000000000000000000000000000000000000000000",
        "0100000000000000000000000000000000000000000000000000000000000000",
        "ecffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff7f",
        "edffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff7f",
        "eeffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff7f",
        "e0eb7a7c3b41b8ae1656e3faf19fc46ada098deb9c32b1fd866205165f49b800",
        "5f9c95bca3508c24b1d0b1559c83ef5b04445cc4581c8e86d8224eddd09f1157",
      };
      foreach (string point in points) {
        Json text = Json.Parse('"' + point + '"');
        Check.That(X25519.Multiply(Seven(), text.Bytes) == null, point);
      }
    }

    public static void HmacIsThatOfTheRfc() {
      foreach (Json one in Json.Vectors("primitives")["hmac_sha256"].List) {
        byte[] expected = Text(one, "result"), actual = Noise.Hmac(Text(one, "key"), Text(one, "data"));
        Array.Resize(ref actual, expected.Length); // one result of the RFC is truncated
        Check.Bytes(expected, actual, one["source"].Text);
      }
    }

    public static void BothCiphersSealAsTheirDocuments() {
      foreach (string name in new[] { "chacha20_poly1305", "aes256_gcm" }) {
        foreach (Json one in Json.Vectors("primitives")[name].List) {
          byte[] text = Text(one, "text"), associated = Text(one, "associated_data");
          var data = new byte[text.Length + 16];
          text.CopyTo(data, 0);
          Cipher(name, Text(one, "key")).Seal(Text(one, "nonce"), associated, associated.Length, data, 0, text.Length);
          Check.Bytes(Text(one, "sealed"), data, one["source"].Text);
        }
      }
    }

    public static void WhatIsSealedOpensAndNothingElseDoes() {
      var random = new Random(1);
      foreach (string name in new[] { "chacha20_poly1305", "aes256_gcm" }) {
        for (int length = 0; length < 300; length += 1 + length / 20) {
          byte[] key = Drawn(random, 32), associated = Drawn(random, random.Next(40)), text = Drawn(random, length);
          Aead cipher = Cipher(name, key);
          var data = new byte[length + 20];
          text.CopyTo(data, 3);
          cipher.Seal(77, associated, associated.Length, data, 3, length);
          byte[] good = (byte[])data.Clone();
          data[3 + random.Next(length + 16)] ^= (byte)(1 << random.Next(8));
          byte[] damaged = (byte[])data.Clone();
          Check.That(!cipher.Open(77, associated, associated.Length, data, 3, length + 16), "a damaged one opens");
          Check.Bytes(damaged, data, "a refused one is not changed");
          Check.That(!cipher.Open(78, associated, associated.Length, good, 3, length + 16), "another number opens");
          Check.That(!Cipher(name, Drawn(random, 32)).Open(77, associated, associated.Length, good, 3, length + 16), "another key opens");
          Check.That(cipher.Open(77, associated, associated.Length, good, 3, length + 16), "it does not open");
          for (int i = 0; i < length; ++i) Check.Equal(text[i], good[3 + i], "text");
          Check.That(!cipher.Open(77, associated, associated.Length, good, 0, 15), "shorter than a tag");
        }
      }
    }

    /// <summary>RFC 8439, A.3, 7 to 9: sums next to p = 2^130 − 5 and 2^128, which no text of a test reaches by chance.
    /// </summary>
    public static void Poly1305NextToItsModulusIsThatOfTheRfc() {
      string zeros = new string('0', 32), ones = new string('f', 32), two = "02" + new string('0', 30);
      Check.Equal("03" + new string('0', 30), Tag(two + zeros, ones), "2^130 − 2");
      Check.Equal("03" + new string('0', 30), Tag(two + ones, two), "a carry beyond 2^128");
      Check.Equal("fa" + new string('f', 30), Tag(two + zeros, "fd" + new string('f', 30)), "2^130 − 6");
    }

    private static string Tag(string key, string text) {
      var poly = new Poly1305();
      var tag = new byte[16];
      poly.Begin(Json.Parse('"' + key + '"').Bytes);
      poly.Absorb(Json.Parse('"' + text + '"').Bytes, 0, 16);
      poly.Finish(tag);
      return Check.Hex(tag);
    }

    public static void TheHandshakeOfCacophonyIsReproduced() {
      Json vector = Json.Vectors("noise")["vectors"].List[0];
      var noise = new Noise(vector["init_psks"].List[0].Bytes, vector["init_ephemeral"].Bytes, vector["init_prologue"].Bytes,
        vector["messages"].List[0]["payload"].Bytes);
      Check.Bytes(vector["messages"].List[0]["ciphertext"].Bytes, noise.Message, "message 1");
      byte[] second = vector["messages"].List[1]["ciphertext"].Bytes;
      Check.That(noise.Read(second, 1, second.Length - 1) == null, "a shorter message 2 opens");
      Noise.Opened opened = noise.Read(second, 0, second.Length);
      Check.Bytes(vector["messages"].List[1]["payload"].Bytes, opened.Payload, "payload 2");
      Check.Bytes(vector["handshake_hash"].Bytes, opened.Hash, "hash");
      for (int i = 2; i < 6; ++i) {
        byte[] payload = vector["messages"].List[i]["payload"].Bytes;
        var data = new byte[payload.Length + 16];
        payload.CopyTo(data, 0);
        var cipher = new ChaChaPoly(i % 2 == 0 ? opened.ClientToServer : opened.ServerToClient);
        cipher.Seal((ulong)(i / 2 - 1), data, 0, data, 0, payload.Length);
        Check.Bytes(vector["messages"].List[i]["ciphertext"].Bytes, data, $"message {i + 1}");
      }
    }

    public static void KeyFilesAreReadOrRefused() {
      foreach (Json one in Json.Vectors("key_files")["files"].List) {
        KeyFile read = null;
        string why = null;
        try {
          read = KeyFile.Parse(one["text"].Text);
        } catch (FormatException error) {
          why = error.Message;
        }
        Check.Equal(one["accept"].Truth, read != null, one["name"].Text + ": " + why);
        if (read == null) continue;
        Check.Bytes(one["key"].Bytes, read.Key, "key");
        Check.Equal(one["role"].Text == "observer" ? Role.Observer : Role.Controller, read.Role, "role");
      }
    }

    private static Aead Cipher(string name, byte[] key) => name == "aes256_gcm" ? (Aead)new AesGcm(key) : new ChaChaPoly(key);

    private static byte[] Seven() {
      var seven = new byte[32];
      for (int i = 0; i < 32; ++i) seven[i] = 7;
      return seven;
    }

    private static byte[] Drawn(Random random, int count) {
      var bytes = new byte[count];
      random.NextBytes(bytes);
      return bytes;
    }
  }
}
