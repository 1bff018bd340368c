// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using System.Reflection;

namespace Tendon.Tests {
  /// <summary>A test class is named on the command line: `mono csharp_test.exe Vectors`. All public static methods of
  /// this class are run, and their names are the claims. TENDON_SOURCE is the root of the repository.</summary>
  public static class Check {
    public static string Source => Environment.GetEnvironmentVariable("TENDON_SOURCE") ?? ".";

    public static void That(bool holds, string what) {
      if (!holds) throw new Exception(what);
    }

    public static void Equal<T>(T expected, T actual, string what) {
      That(EqualityComparer<T>.Default.Equals(expected, actual), $"{what}: expected {expected}, got {actual}");
    }

    public static void Near(double expected, double actual, double tolerance, string what) {
      That(Math.Abs(expected - actual) <= tolerance, $"{what}: expected {expected} ± {tolerance}, got {actual}");
    }

    public static void Bytes(byte[] expected, byte[] actual, string what) => Equal(Hex(expected), Hex(actual), what);

    public static string Hex(byte[] bytes) => BitConverter.ToString(bytes).Replace("-", "").ToLowerInvariant();

    /// <summary>Runs the action and returns the message of its exception.</summary>
    public static string Throws<T>(Action action) where T : Exception {
      try {
        action();
      } catch (T error) {
        return error.Message;
      }
      throw new Exception($"expected {typeof(T).Name}");
    }

    public static int Main(string[] names) {
      int failed = 0;
      foreach (string name in names) {
        Type tests = Type.GetType($"Tendon.Tests.{name}Test", true);
        foreach (MethodInfo test in tests.GetMethods(BindingFlags.Public | BindingFlags.Static | BindingFlags.DeclaredOnly)) {
          try {
            test.Invoke(null, null);
            Console.WriteLine($"ok    {test.Name}");
          } catch (TargetInvocationException error) {
            ++failed;
            Console.WriteLine($"FAIL  {test.Name}: {error.InnerException}");
          }
        }
      }
      return failed == 0 ? 0 : 1;
    }
  }
}
