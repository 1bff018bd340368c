// SPDX-License-Identifier: Apache-2.0
namespace Tendon {
  internal enum DatagramType : byte {
    Hello = 1,
    Retry = 2,
    Data = 3,
    Answer = 4,
  }

  /// <summary>The 16 bytes in front of every datagram (protocol/WIRE.md).</summary>
  internal static class Header {
    internal const int Size = 16;
    internal const int Largest = 1200;
    internal const ulong Numbers = 1UL << 60;
    private const byte Magic = 0x54;
    private const byte Version = 1;

    internal static void Write(byte[] to, DatagramType type, byte epoch, byte suite, uint connection, ulong number) {
      to[0] = Magic;
      to[1] = (byte)(Version << 4 | (int)type);
      to[2] = epoch;
      to[3] = suite;
      Little.Write32(to, 4, connection);
      Little.Write64(to, 8, number);
    }

    /// <summary>Returns true if the bytes begin like a datagram of this type, version and suite.</summary>
    internal static bool Is(byte[] datagram, int count, DatagramType type, byte suite) =>
      count >= Size && count <= Largest && datagram[0] == Magic &&
      datagram[1] == (Version << 4 | (int)type) && datagram[3] == suite;
  }
}
