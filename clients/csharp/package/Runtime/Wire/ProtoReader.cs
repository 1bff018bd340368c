// SPDX-License-Identifier: Apache-2.0
using System;
using System.Text;

namespace Tendon {
  /// <summary>Reads protobuf from a part of an array without allocation, except for texts. If the bytes are not
  /// protobuf, or a text is not UTF-8, Bad becomes true, and Next returns false from then on.</summary>
  internal struct ProtoReader {
    private const int DeepestGroup = 100;
    private readonly byte[] _data;
    private int _at;
    private int _end;

    internal ProtoReader(byte[] data, int at, int count) {
      _data = data;
      _at = at;
      _end = at + count;
      Bad = false;
      Tag = 0;
    }

    internal bool Bad { get; private set; }

    /// <summary>The number of the field × 8 + its wire type.</summary>
    internal uint Tag { get; private set; }

    /// <summary>Moves to the next field of the message. Returns false at its end.</summary>
    internal bool Next() {
      if (_at >= _end || Bad) return false;
      ulong tag = UInt64();
      Tag = (uint)tag;
      if (tag > uint.MaxValue || Tag >> 3 == 0) Fail();
      return !Bad;
    }

    /// <summary>Enters the message of the field. Pass the result to Leave.</summary>
    internal int Enter() {
      int outer = _end;
      ulong count = UInt64();
      if (Bad || count > (ulong)(_end - _at)) Fail();
      else _end = _at + (int)count;
      return outer;
    }

    internal void Leave(int outer) {
      if (Bad) return;
      _at = _end;
      _end = outer;
    }

    internal ulong UInt64() {
      ulong value = 0;
      for (int shift = 0; shift < 70; shift += 7) {
        if (_at >= _end) break;
        byte one = _data[_at++];
        value |= (ulong)(one & 0x7F) << shift;
        if (one < 0x80) return value;
      }
      Fail();
      return 0;
    }

    internal uint UInt32() => (uint)UInt64();
    internal bool Bool() => UInt64() != 0;

    internal long SInt64() {
      ulong zigzag = UInt64();
      return (long)(zigzag >> 1) ^ -(long)(zigzag & 1);
    }

    internal uint Fixed32() {
      if (!Has(4)) return 0;
      _at += 4;
      return Little.Read32(_data, _at - 4);
    }

    internal long Fixed64() {
      if (!Has(8)) return 0;
      _at += 8;
      return (long)Little.Read64(_data, _at - 8);
    }

    internal double Double() => BitConverter.Int64BitsToDouble(Fixed64());

    internal string Text() {
      int outer = Enter();
      int at = _at, count = _end - _at;
      if (!Bad && !IsUtf8(at, _end)) Fail();
      Leave(outer);
      return Bad || count == 0 ? "" : Encoding.UTF8.GetString(_data, at, count);
    }

    /// <summary>Reads a vector. If the message has several of them, they are merged as protobuf does.</summary>
    internal Vec3 Vec3(Vec3 value) {
      int outer = Enter();
      while (Next()) {
        if (Tag == 9) value.X = Double();
        else if (Tag == 17) value.Y = Double();
        else if (Tag == 25) value.Z = Double();
        else Skip();
      }
      Leave(outer);
      return value;
    }

    internal Quat Quat(Quat value) {
      int outer = Enter();
      while (Next()) {
        if (Tag == 9) value.W = Double();
        else if (Tag == 17) value.X = Double();
        else if (Tag == 25) value.Y = Double();
        else if (Tag == 33) value.Z = Double();
        else Skip();
      }
      Leave(outer);
      return value;
    }

    /// <summary>Reads one number, or all numbers of a packed field.</summary>
    internal void Read(Reals into) {
      if ((Tag & 7) != 2) {
        into.Add(Double());
        return;
      }
      int outer = Enter();
      while (_at < _end && !Bad) into.Add(Double());
      Leave(outer);
    }

    internal void Read(Counts into) {
      if ((Tag & 7) != 2) {
        into.Add(UInt64());
        return;
      }
      int outer = Enter();
      while (_at < _end && !Bad) into.Add(UInt64());
      Leave(outer);
    }

    /// <summary>Skips a field that is not known.</summary>
    internal void Skip() => Skip(0);

    private void Skip(int depth) {
      uint field = Tag >> 3;
      switch (Tag & 7) {
        case 0:
          UInt64();
          break;
        case 1:
          Fixed64();
          break;
        case 2:
          Leave(Enter());
          break;
        case 3: // a group ends at its own number
          if (depth >= DeepestGroup) Fail();
          while (true) {
            if (!Next()) {
              Fail();
              return;
            }
            if ((Tag & 7) == 4) break;
            Skip(depth + 1);
          }
          if (Tag >> 3 != field) Fail();
          break;
        case 5:
          Fixed32();
          break;
        default:
          Fail();
          break;
      }
    }

    private bool Has(int count) {
      if (!Bad && _end - _at >= count) return true;
      Fail();
      return false;
    }

    private void Fail() {
      Bad = true;
      _at = _end;
    }

    /// <summary>Refuses overlong forms, surrogates and numbers above 10FFFF.</summary>
    private bool IsUtf8(int at, int end) {
      while (at < end) {
        byte first = _data[at++];
        if (first < 0x80) continue;
        int more = first >= 0xF0 ? 3 : first >= 0xE0 ? 2 : 1;
        if (first < 0xC2 || first > 0xF4 || end - at < more) return false;
        int low = first == 0xE0 ? 0xA0 : first == 0xF0 ? 0x90 : 0x80;
        int high = first == 0xED ? 0x9F : first == 0xF4 ? 0x8F : 0xBF;
        for (; more > 0; --more, ++at, low = 0x80, high = 0xBF) {
          if (_data[at] < low || _data[at] > high) return false;
        }
      }
      return true;
    }
  }

  /// <summary>Little-endian numbers in arrays.</summary>
  internal static class Little {
    internal static uint Read32(byte[] from, int at) =>
      (uint)(from[at] | from[at + 1] << 8 | from[at + 2] << 16 | from[at + 3] << 24);

    internal static ulong Read64(byte[] from, int at) => Read32(from, at) | (ulong)Read32(from, at + 4) << 32;

    internal static void Write32(byte[] to, int at, uint value) {
      for (int i = 0; i < 4; ++i) to[at + i] = (byte)(value >> 8 * i);
    }

    internal static void Write64(byte[] to, int at, ulong value) {
      for (int i = 0; i < 8; ++i) to[at + i] = (byte)(value >> 8 * i);
    }
  }
}
