// SPDX-License-Identifier: Apache-2.0
using System;
using Tendon.Unity;
using UnityEngine;

namespace Tendon.Tests {
  /// <summary>Conversions between the base frame of a device and Unity's.</summary>
  public static class FrameTest {
    private static readonly Vec3[] Axes = { new Vec3(1, 0, 0), new Vec3(0, 1, 0), new Vec3(0, 0, 1) };
    private static readonly UnityFrame Plain = UnityFrame.Identity;

    /// <summary>The base frame of a device whose right is −y, up is z, and user is −x, as `axes` in a scene.</summary>
    private static readonly UnityFrame Turned = new UnityFrame(new Quat(0.5, -0.5, 0.5, 0.5));

    private static void Same(Vector3 expected, Vector3 actual, string what) {
      Check.Near(expected.x, actual.x, 1e-6, what + ", x");
      Check.Near(expected.y, actual.y, 1e-6, what + ", y");
      Check.Near(expected.z, actual.z, 1e-6, what + ", z");
    }

    private static void Same(Vec3 expected, Vec3 actual, string what) {
      Check.Near(0, (expected - actual).Length, 1e-6, $"{what}: {expected} and {actual}");
    }

    public static void PositionsAndForcesKeepXAndYAndMirrorZ() {
      Same(new Vector3(2, 0, 0), Plain.Vector(2 * Axes[0]), "right");
      Same(new Vector3(0, 2, 0), Plain.Vector(2 * Axes[1]), "up");
      Same(new Vector3(0, 0, -2), Plain.Vector(2 * Axes[2]), "to the user");
    }

    public static void TorquesAndTurnsMirrorXAndY() {
      Same(new Vector3(-2, 0, 0), Plain.Axial(2 * Axes[0]), "about x");
      Same(new Vector3(0, -2, 0), Plain.Axial(2 * Axes[1]), "about y");
      Same(new Vector3(0, 0, 2), Plain.Axial(2 * Axes[2]), "about z");
    }

    public static void QuaternionsMirrorXAndY() {
      Quaternion q = Plain.Rotation(new Quat(0.5, 0.1, 0.2, 0.3));
      Same(new Vector3(-0.1f, -0.2f, 0.3f), new Vector3(q.x, q.y, q.z), "q");
      Check.Near(0.5, q.w, 1e-7, "w");
      double half = Math.Sqrt(0.5);
      // A quarter turn about y moves −z (away) to −x (left). In Unity, it moves forward, +z, to −x.
      Same(new Vector3(-1, 0, 0), Rotated(Plain.Rotation(new Quat(half, 0, half, 0)), new Vector3(0, 0, 1)), "left");
      // About x, it moves −z to up.
      Same(new Vector3(0, 1, 0), Rotated(Plain.Rotation(new Quat(half, half, 0, 0)), new Vector3(0, 0, 1)), "up");
      // About z, it moves right to up.
      Same(new Vector3(0, 1, 0), Rotated(Plain.Rotation(new Quat(half, 0, 0, half)), new Vector3(1, 0, 0)), "right to up");
    }

    public static void ADeviceThatIsTurnedIsSeenFromTheOperator() {
      Same(new Vector3(-1, 0, 0), Turned.Vector(Axes[1]), "its y is the operator's left");
      Same(new Vector3(0, 1, 0), Turned.Vector(Axes[2]), "its z is up");
      Same(new Vector3(0, 0, 1), Turned.Vector(Axes[0]), "its x points away");
    }

    /// <summary>Whatever is computed before the conversion is the same as what is computed after it.</summary>
    public static void ConversionsCommuteWithPhysicsAndReturn() {
      var random = new System.Random(3);
      for (int i = 0; i < 1000; ++i) {
        UnityFrame frame = i % 2 == 0 ? Plain : Turned;
        Vec3 r = Drawn(random), f = Drawn(random);
        Same(f, frame.Vector(frame.Vector(f)), "vectors return");
        Same(f, frame.Axial(frame.Axial(f)), "torques return");
        var torque = new Vec3(r.Y * f.Z - r.Z * f.Y, r.Z * f.X - r.X * f.Z, r.X * f.Y - r.Y * f.X);
        Vector3 a = frame.Vector(r), b = frame.Vector(f);
        Same(frame.Axial(torque), new Vector3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x), "r × f");
        Check.Near(Vec3.Dot(r, f), a.x * b.x + a.y * b.y + a.z * b.z, 1e-6, "power");
        Vec3 axis = Drawn(random);
        double angle = random.NextDouble() * 3, part = Math.Sin(angle / 2) / axis.Length;
        var q = new Quat(Math.Cos(angle / 2), part * axis.X, part * axis.Y, part * axis.Z);
        // In the frame of the handle, the same mirror: the vector f of the handle is (x, y, −z).
        Same(frame.Vector(Rotated(q, f)), Rotated(frame.Rotation(q), Plain.Vector(f)), "a turned vector");
      }
    }

    private static Vec3 Drawn(System.Random random) =>
      new Vec3(random.NextDouble() - 0.5, random.NextDouble() - 0.5, random.NextDouble() - 0.5);

    private static Vec3 Rotated(Quat q, Vec3 v) {
      Vec3 u = new Vec3(q.X, q.Y, q.Z);
      Vec3 c = Cross(u, v);
      return v + 2 * (q.W * c + Cross(u, c));
    }

    private static Vector3 Rotated(Quaternion q, Vector3 v) {
      Vec3 turned = Rotated(new Quat(q.w, q.x, q.y, q.z), new Vec3(v.x, v.y, v.z));
      return new Vector3((float)turned.X, (float)turned.Y, (float)turned.Z);
    }

    private static Vec3 Cross(Vec3 a, Vec3 b) => new Vec3(a.Y * b.Z - a.Z * b.Y, a.Z * b.X - a.X * b.Z, a.X * b.Y - a.Y * b.X);
  }
}
