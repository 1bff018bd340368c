// SPDX-License-Identifier: Apache-2.0
using UnityEngine;

namespace Tendon.Unity {
  /// <summary>
  /// Converts between the base frame of a device and the frame of Unity: x right, y up, z away from the user, which is
  /// left-handed. The frame of the operator (x right, y up, z to the user) is between them: the handle's description
  /// has the rotation from the base frame to it, which is the identity if it is not known.
  ///
  /// Vectors (positions, velocities, forces) become (x, y, −z). The mirror image of a rotation turns the other way, so
  /// that torques and angular velocities become (−x, −y, z), and quaternions (−x, −y, z, w).
  /// </summary>
  public struct UnityFrame {
    private readonly Quat _operatorFromDevice;

    public UnityFrame(Quat operatorFromDevice) {
      _operatorFromDevice = operatorFromDevice;
    }

    /// <summary>For a base frame that is the frame of the operator.</summary>
    public static UnityFrame Identity => new UnityFrame(new Quat(1, 0, 0, 0));

    public Vector3 Vector(Vec3 v) {
      Vec3 o = Turned(_operatorFromDevice, v);
      return new Vector3((float)o.X, (float)o.Y, (float)-o.Z);
    }

    public Vec3 Vector(Vector3 v) => Turned(Inverse(_operatorFromDevice), new Vec3(v.x, v.y, -v.z));

    public Vector3 Axial(Vec3 v) {
      Vec3 o = Turned(_operatorFromDevice, v);
      return new Vector3((float)-o.X, (float)-o.Y, (float)o.Z);
    }

    public Vec3 Axial(Vector3 v) => Turned(Inverse(_operatorFromDevice), new Vec3(-v.x, -v.y, v.z));

    /// <summary>From the frame of the handle, whose axes are mirrored too, to the frame of Unity.</summary>
    public Quaternion Rotation(Quat q) {
      Quat o = Product(_operatorFromDevice, q);
      return new Quaternion((float)-o.X, (float)-o.Y, (float)o.Z, (float)o.W);
    }

    private static Quat Inverse(Quat q) => new Quat(q.W, -q.X, -q.Y, -q.Z);

    private static Quat Product(Quat a, Quat b) => new Quat(
      a.W * b.W - a.X * b.X - a.Y * b.Y - a.Z * b.Z,
      a.W * b.X + a.X * b.W + a.Y * b.Z - a.Z * b.Y,
      a.W * b.Y - a.X * b.Z + a.Y * b.W + a.Z * b.X,
      a.W * b.Z + a.X * b.Y - a.Y * b.X + a.Z * b.W);

    private static Vec3 Turned(Quat q, Vec3 v) {
      Quat turned = Product(Product(q, new Quat(0, v.X, v.Y, v.Z)), Inverse(q));
      return new Vec3(turned.X, turned.Y, turned.Z);
    }
  }
}
