// SPDX-License-Identifier: Apache-2.0
// Stands in for the part of UnityEngine that the package uses, so that its scripts are compiled and run without Unity.
namespace UnityEngine {
  public struct Vector3 {
    public float x, y, z;
    public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
    public static Vector3 zero => new Vector3();
    public static Vector3 up => new Vector3(0, 1, 0);
    public static Vector3 operator *(float k, Vector3 v) => new Vector3(k * v.x, k * v.y, k * v.z);
    public static bool operator ==(Vector3 a, Vector3 b) => a.x == b.x && a.y == b.y && a.z == b.z;
    public static bool operator !=(Vector3 a, Vector3 b) => !(a == b);
    public override bool Equals(object other) => other is Vector3 v && v == this;
    public override int GetHashCode() => x.GetHashCode();
  }
  public struct Quaternion {
    public float x, y, z, w;
    public Quaternion(float x, float y, float z, float w) { this.x = x; this.y = y; this.z = z; this.w = w; }
    public static Quaternion identity => new Quaternion(0, 0, 0, 1);
  }
  public sealed class Transform { public Vector3 localPosition; public Quaternion localRotation; }
  public class MonoBehaviour {
    public string name = "hand";
    public bool enabled = true;
    public Transform transform = new Transform();
  }
  public sealed class TooltipAttribute : System.Attribute { public TooltipAttribute(string text) { } }
  public static class Mathf {
    public static float Clamp(float value, float a, float b) => value < a ? a : value > b ? b : value;
  }
  public static class Debug {
    public static readonly System.Collections.Generic.List<string> Said = new System.Collections.Generic.List<string>();
    public static void LogWarning(object text, MonoBehaviour of) { Said.Add("warning: " + text); }
    public static void LogError(object text, MonoBehaviour of) { Said.Add("error: " + text); }
    public static void LogException(System.Exception error, MonoBehaviour of) { Said.Add("exception: " + error.Message); }
  }
}
