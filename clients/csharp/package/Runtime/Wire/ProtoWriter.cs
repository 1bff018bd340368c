// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using System.Text;

namespace Tendon {
  /// <summary>Writes protobuf into a part of an array without allocation, except for texts. As proto3 requires, zeros
  /// and empty texts are omitted; the functions Present… write them. If there is not enough space, Full becomes true.
  /// </summary>
  internal struct ProtoWriter {
    private readonly byte[] _data;
    private readonly int _end;

    internal ProtoWriter(byte[] data, int at, int end) {
      _data = data;
      _end = end;
      At = at;
      Full = false;
    }

    internal int At { get; private set; }
    internal bool Full { get; private set; }

    internal void UInt64(uint tag, ulong value) {
      if (value == 0) return;
      Varint(tag);
      Varint(value);
    }

    internal void UInt32(uint tag, uint value) => UInt64(tag, value);
    internal void Bool(uint tag, bool value) => UInt64(tag, value ? 1UL : 0);
    internal void SInt64(uint tag, long value) => UInt64(tag, (ulong)(value << 1 ^ value >> 63));

    internal void Fixed32(uint tag, uint value) {
      if (value != 0) PresentFixed32(tag, value);
    }

    internal void PresentFixed32(uint tag, uint value) {
      Varint(tag);
      if (Claim(4)) Little.Write32(_data, At - 4, value);
    }

    internal void Fixed64(uint tag, long value) {
      if (value == 0) return;
      Varint(tag);
      if (Claim(8)) Little.Write64(_data, At - 8, (ulong)value);
    }

    internal void Double(uint tag, double value) => Fixed64(tag, BitConverter.DoubleToInt64Bits(value));

    internal void PresentDouble(uint tag, double value) {
      Varint(tag);
      if (Claim(8)) Little.Write64(_data, At - 8, (ulong)BitConverter.DoubleToInt64Bits(value));
    }

    /// <summary>Truncates the text to whole characters and at most that many bytes.</summary>
    internal void Text(uint tag, string text, int most) {
      if (text.Length > 0) Entry(tag, text, most);
    }

    internal void Texts(uint tag, List<string> texts, int entries, int most) {
      for (int i = 0; i < texts.Count && i < entries; ++i) Entry(tag, texts[i], most);
    }

    internal void Vec3(uint tag, Vec3 value) {
      if (value.X != 0 || value.Y != 0 || value.Z != 0) PresentVec3(tag, value);
    }

    internal void PresentVec3(uint tag, Vec3 value) {
      int begin = Begin(tag);
      Double(9, value.X);
      Double(17, value.Y);
      Double(25, value.Z);
      End(begin);
    }

    internal void Quat(uint tag, Quat value) => PresentQuat(tag, value);

    internal void PresentQuat(uint tag, Quat value) {
      int begin = Begin(tag);
      Double(9, value.W);
      Double(17, value.X);
      Double(25, value.Y);
      Double(33, value.Z);
      End(begin);
    }

    /// <summary>Writes a packed field.</summary>
    internal void Write(uint tag, Reals values) {
      if (values.Count == 0) return;
      int begin = Begin(tag);
      for (int i = 0; i < values.Count; ++i) {
        if (Claim(8)) Little.Write64(_data, At - 8, (ulong)BitConverter.DoubleToInt64Bits(values[i]));
      }
      End(begin);
    }

    internal void Write(uint tag, Counts values) {
      if (values.Count == 0) return;
      int begin = Begin(tag);
      for (int i = 0; i < values.Count; ++i) Varint(values[i]);
      End(begin);
    }

    /// <summary>Begins a message. Pass the result to End.</summary>
    internal int Begin(uint tag) {
      Varint(tag);
      Claim(1); // for a length of less than 128, which is the most frequent
      return At;
    }

    internal void End(int begin) {
      if (Full) return;
      int count = At - begin;
      int more = count < 1 << 7 ? 0 : count < 1 << 14 ? 1 : 2;
      if (more > 0 && !Claim(more)) return;
      if (more > 0) Buffer.BlockCopy(_data, begin, _data, begin + more, count);
      for (int i = 0; i < more; ++i) _data[begin - 1 + i] = (byte)(count >> 7 * i | 0x80);
      _data[begin - 1 + more] = (byte)(count >> 7 * more);
    }

    private void Entry(uint tag, string text, int most) {
      int length = text.Length;
      while (Encoding.UTF8.GetByteCount(text) > most) {
        --length;
        if (length > 0 && char.IsHighSurrogate(text[length - 1])) --length;
        text = text.Substring(0, length);
      }
      int begin = Begin(tag);
      int count = Encoding.UTF8.GetByteCount(text);
      if (Claim(count)) Encoding.UTF8.GetBytes(text, 0, text.Length, _data, At - count);
      End(begin);
    }

    private void Varint(ulong value) {
      for (; value >= 0x80; value >>= 7) {
        if (Claim(1)) _data[At - 1] = (byte)(value | 0x80);
      }
      if (Claim(1)) _data[At - 1] = (byte)value;
    }

    private bool Claim(int count) {
      if (Full || _end - At < count) {
        Full = true;
        return false;
      }
      At += count;
      return true;
    }
  }
}
