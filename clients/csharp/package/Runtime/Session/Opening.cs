// SPDX-License-Identifier: Apache-2.0
using System;
using System.Security.Cryptography;

namespace Tendon {
  /// <summary>One attempt to open a session (protocol/SESSION.md, "Opening"), without socket and clock.</summary>
  internal sealed class Opening {
    internal const string Aes = "aes-256-gcm";
    private const long Repetition = 100 * Time.Millisecond;
    private const int RandomSize = 16;
    private const int BodyAt = 32; // of a Retry and an Answer
    private readonly byte _suite;
    private readonly bool _offersAes;
    private readonly uint _versionMax;
    private readonly byte[] _random;
    private readonly byte[] _cookie = new byte[RandomSize];
    private bool _hasCookie;
    private readonly byte[] _body;
    private readonly Noise _noise; // null in suite 0
    private long _due = long.MinValue;

    /// <summary>One of them is not null after an answer.</summary>
    internal Refused Refused { get; private set; }
    internal Welcome Welcome { get; private set; }

    /// <summary>These are those of the Welcome. Sealing is null in suite 0.</summary>
    internal uint Connection { get; private set; }
    internal Sealing Sealing { get; private set; }

    internal static byte[] Drawn(int count) {
      var bytes = new byte[count];
      using (var source = RandomNumberGenerator.Create()) source.GetBytes(bytes);
      return bytes;
    }

    /// <summary>`key` is null for suite 0. The random numbers must be new.</summary>
    internal Opening(Hello hello, byte[] key, byte[] random, byte[] ephemeral) {
      _random = random;
      _suite = (byte)(key == null ? 0 : 1);
      _offersAes = key != null && hello.Features.Contains(Aes);
      _versionMax = hello.VersionMax;
      var text = new byte[Header.Largest];
      var writer = new ProtoWriter(text, 0, 944);
      hello.Write(ref writer);
      if (writer.Full) throw new ArgumentException("the Hello has more than 944 bytes: use shorter names");
      Array.Resize(ref text, writer.At);
      _body = text;
      if (key == null) return;
      byte[] id = Noise.Sha256(Noise.Ascii("tendon-key-id"), key);
      Array.Resize(ref id, 8);
      var header = new byte[Header.Size];
      Header.Write(header, DatagramType.Hello, 0, _suite, 0, 0);
      _noise = new Noise(key, ephemeral, Noise.Join(Noise.Ascii("tendon-1"), header, id, random), text);
      _body = Noise.Join(id, _noise.Message);
    }

    internal long NextTime() => _due;

    /// <summary>Writes the Hello if it is due. Returns its length, or 0.</summary>
    internal int NextDatagram(long now, byte[] into) {
      if (now < _due) return 0;
      _due = now + Repetition;
      Array.Clear(into, 0, Header.Largest);
      Header.Write(into, DatagramType.Hello, 0, _suite, 0, 0);
      Buffer.BlockCopy(_random, 0, into, 16, RandomSize);
      Buffer.BlockCopy(_cookie, 0, into, 32, RandomSize);
      into[48] = (byte)_body.Length;
      into[49] = (byte)(_body.Length >> 8);
      Buffer.BlockCopy(_body, 0, into, 50, _body.Length);
      return Header.Largest;
    }

    internal void Receive(long now, byte[] datagram, int count) {
      bool retry = Header.Is(datagram, count, DatagramType.Retry, _suite) && count == BodyAt + RandomSize;
      bool answer = Header.Is(datagram, count, DatagramType.Answer, _suite) && count >= BodyAt;
      if (!retry && !answer || datagram[2] != 0 || Little.Read64(datagram, 8) != 0) return;
      for (int i = 0; i < RandomSize; ++i) {
        if (datagram[16 + i] != _random[i]) return;
      }
      if (answer) {
        TakeAnswer(now, datagram, count);
        return;
      }
      if (!_hasCookie) _due = long.MinValue; // only the first Retry is answered immediately
      _hasCookie = true;
      Buffer.BlockCopy(datagram, BodyAt, _cookie, 0, RandomSize);
    }

    private void TakeAnswer(long now, byte[] datagram, int count) {
      Noise.Opened opened = null;
      var reader = new ProtoReader(datagram, BodyAt, count - BodyAt);
      if (_noise != null) {
        opened = _noise.Read(datagram, BodyAt, count - BodyAt);
        if (opened == null) return;
        reader = new ProtoReader(opened.Payload, 0, opened.Payload.Length);
      }
      var message = new Answer();
      message.Read(ref reader);
      if (reader.Bad || message.Objection() != null) return;
      if (message.Body == Answer.BodyCase.Refused) {
        Refused = message.Refused;
      } else if (message.Body == Answer.BodyCase.Welcome && message.Welcome.Version <= _versionMax) {
        Welcome = message.Welcome;
        Connection = Little.Read32(datagram, 4);
        Sealing = opened == null ? null : SealingOf(opened, now);
      }
    }

    /// <summary>Suite 2 if it is offered and chosen.</summary>
    private Sealing SealingOf(Noise.Opened opened, long now) {
      if (!_offersAes || !Welcome.Features.Contains(Aes)) {
        return new Sealing(new ChaChaPoly(opened.ClientToServer), new ChaChaPoly(opened.ServerToClient), now);
      }
      opened.UseSuite2();
      return new Sealing(new AesGcm(opened.ClientToServer), new AesGcm(opened.ServerToClient), now);
    }
  }
}
