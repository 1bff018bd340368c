// SPDX-License-Identifier: Apache-2.0
using System;

namespace Tendon {
  /// <summary>A vector in the device base frame. The name of its member or its comment has the unit.</summary>
  public struct Vec3 {
    public double X, Y, Z;

    public Vec3(double x, double y, double z) {
      X = x;
      Y = y;
      Z = z;
    }

    public double Length => Math.Sqrt(Dot(this, this));
    public static double Dot(Vec3 a, Vec3 b) => a.X * b.X + a.Y * b.Y + a.Z * b.Z;
    public static Vec3 operator +(Vec3 a, Vec3 b) => new Vec3(a.X + b.X, a.Y + b.Y, a.Z + b.Z);
    public static Vec3 operator -(Vec3 a, Vec3 b) => new Vec3(a.X - b.X, a.Y - b.Y, a.Z - b.Z);
    public static Vec3 operator *(double factor, Vec3 a) => new Vec3(factor * a.X, factor * a.Y, factor * a.Z);
    public override string ToString() => $"({X}, {Y}, {Z})";
  }

  /// <summary>A rotation as a unit quaternion w + x i + y j + z k.</summary>
  public struct Quat {
    public double W, X, Y, Z;

    public Quat(double w, double x, double y, double z) {
      W = w;
      X = x;
      Y = y;
      Z = z;
    }

    public override string ToString() => $"({W}; {X}, {Y}, {Z})";
  }

  /// <summary>Numbers of a message, in memory that is reserved for the largest list within bounds. If there are more,
  /// Count tells how many, so that the list is refused, but they are not stored.</summary>
  public sealed class Reals {
    private readonly double[] _values;

    internal Reals(int most) {
      _values = new double[most];
    }

    public int Count { get; private set; }
    public double this[int index] => index < Count ? _values[index] : throw new IndexOutOfRangeException();
    public void Clear() => Count = 0;

    public void Add(double value) {
      if (Count < _values.Length) _values[Count] = value;
      ++Count;
    }

    public void CopyFrom(Reals other) {
      Count = other.Count;
      Array.Copy(other._values, _values, _values.Length);
    }

    /// <summary>Replaces the numbers by k, which is k times the unit matrix in a stiffness.</summary>
    public void Set(double k) {
      Clear();
      Add(k);
    }

    /// <summary>Replaces the numbers by the diagonal of a matrix.</summary>
    public void Set(Vec3 diagonal) {
      Clear();
      Add(diagonal.X);
      Add(diagonal.Y);
      Add(diagonal.Z);
    }

    /// <summary>Replaces the numbers by k n nᵀ: a spring of k that acts along the unit vector n only.</summary>
    public void SetAlong(Vec3 n, double k) {
      Clear();
      for (int row = 0; row < 3; ++row) {
        Vec3 line = (k * (row == 0 ? n.X : row == 1 ? n.Y : n.Z)) * n;
        Add(line.X);
        Add(line.Y);
        Add(line.Z);
      }
    }
  }

  /// <summary>As Reals, for whole numbers.</summary>
  public sealed class Counts {
    private readonly ulong[] _values;

    internal Counts(int most) {
      _values = new ulong[most];
    }

    public int Count { get; private set; }
    public ulong this[int index] => index < Count ? _values[index] : throw new IndexOutOfRangeException();
    public void Clear() => Count = 0;

    public void Add(ulong value) {
      if (Count < _values.Length) _values[Count] = value;
      ++Count;
    }

    public void CopyFrom(Counts other) {
      Count = other.Count;
      Array.Copy(other._values, _values, _values.Length);
    }

    /// <summary>The sum, or the largest number if it is larger.</summary>
    internal ulong Sum() {
      ulong sum = 0;
      for (int i = 0; i < Count && i < _values.Length; ++i) {
        sum = sum + _values[i] < sum ? ulong.MaxValue : sum + _values[i];
      }
      return sum;
    }
  }
}
