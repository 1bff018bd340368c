// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using System.Text;

namespace Tendon {
  /// <summary>Checks of values against the bounds of protocol/WIRE.md, for the generated messages. NaN is beyond every
  /// bound.</summary>
  internal static class Bounds {
    /// <summary>The largest time, ns.</summary>
    internal const long Time = 1L << 60;
    private const double Most = 1e12;
    private const double UnitTolerance = 0.001;

    internal static bool IsNumber(double value) => Math.Abs(value) <= Most;
    internal static bool IsVec3(Vec3 v) => IsNumber(v.X) && IsNumber(v.Y) && IsNumber(v.Z);
    internal static bool IsNormal(Vec3 v) => Math.Abs(v.Length - 1) <= UnitTolerance;

    internal static bool IsRotation(Quat q) =>
      Math.Abs(Math.Sqrt(q.W * q.W + q.X * q.X + q.Y * q.Y + q.Z * q.Z) - 1) <= UnitTolerance;

    /// <summary>Returns true if both corners are present and least ≤ most, or if neither is present.</summary>
    internal static bool IsBox(Vec3? least, Vec3? most) {
      if (!least.HasValue || !most.HasValue) return least.HasValue == most.HasValue;
      Vec3 size = most.Value - least.Value;
      return size.X >= 0 && size.Y >= 0 && size.Z >= 0;
    }

    internal static bool IsMatrix(Reals k) =>
      (k.Count == 1 || k.Count == 3 || k.Count == 9) && AreNumbers(k, 1, 9, -Most, Most);

    internal static bool AreNumbers(Reals values, int fewest, int most, double least, double largest) {
      if (values.Count < fewest || values.Count > most) return false;
      for (int i = 0; i < values.Count; ++i) {
        if (!(values[i] >= least && values[i] <= largest)) return false;
      }
      return true;
    }

    internal static bool IsText(string text, int bytes) => Encoding.UTF8.GetByteCount(text) <= bytes;
    internal static bool AreTexts(List<string> texts, int most, int bytes) =>
      texts.Count <= most && texts.TrueForAll(text => IsText(text, bytes));
  }
}
