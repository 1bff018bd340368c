// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using System.IO;
using System.Runtime.InteropServices;

namespace Tendon {
  /// <summary>A key that the client shares with the server, as `tendond keygen` writes it.</summary>
  public sealed class KeyFile {
    private const int FewestDifferent = 18; // random keys have about 30
    private const string Expected = "expected one line, `controller` or `observer` and 64 hexadecimal digits";

    /// <summary>The highest role that the server grants.</summary>
    public readonly Role Role;

    internal readonly byte[] Key;

    private KeyFile(Role role, byte[] key) {
      Role = role;
      Key = key;
    }

    /// <summary>Reads a file. Throws a FormatException with the path and the reason if it is malformed, if the key is
    /// weak, or if users other than its owner can read it (only checked on Linux).</summary>
    public static KeyFile Load(string path) {
      if (IsReadByOthers(path)) {
        throw new FormatException($"{path}: users other than its owner can read it; expected mode 600 or 400");
      }
      try {
        return Parse(File.ReadAllText(path));
      } catch (FormatException error) {
        throw new FormatException($"{path}: {error.Message}");
      }
    }

    /// <summary>Reads the text of a key file. Throws a FormatException with the reason, without the key.</summary>
    public static KeyFile Parse(string text) {
      string[] words = null;
      foreach (string line in text.Split('\n')) {
        string content = line.Trim(' ', '\t', '\r', '\v', '\f');
        if (content == "" || content[0] == '#') continue;
        if (words != null) throw new FormatException($"{Expected}, got several lines");
        words = content.Split(new[] { ' ', '\t' }, StringSplitOptions.RemoveEmptyEntries);
      }
      if (words == null || words.Length != 2) throw new FormatException(Expected);
      bool controller = words[0] == "controller";
      if (!controller && words[0] != "observer") {
        throw new FormatException($"{Expected}, got a line that begins with neither");
      }
      if (words[1].Length != 2 * Aead.KeySize) {
        throw new FormatException($"{Expected}, got {words[1].Length} characters");
      }
      var key = new byte[Aead.KeySize];
      for (int i = 0; i < key.Length; ++i) key[i] = (byte)(Digit(words[1][2 * i]) << 4 | Digit(words[1][2 * i + 1]));
      string weakness = WeaknessOf(key);
      if (weakness != null) {
        throw new FormatException($"the key is weak: {weakness}; create one with `tendond keygen NAME`");
      }
      return new KeyFile(controller ? Role.Controller : Role.Observer, key);
    }

    private static int Digit(char c) {
      int value = "0123456789abcdef".IndexOf(char.ToLowerInvariant(c));
      if (value < 0) throw new FormatException($"{Expected}, got a character that is not a hexadecimal digit");
      return value;
    }

    private static string WeaknessOf(byte[] key) {
      if (new HashSet<byte>(key).Count < FewestDifferent) return "it repeats the same few bytes";
      var steps = new HashSet<byte>();
      for (int i = 1; i < key.Length; ++i) steps.Add((byte)(key[i] - key[i - 1]));
      if (steps.Count < FewestDifferent) return "its bytes follow a pattern";
      return Array.TrueForAll(key, one => one >= 0x20 && one < 0x7F) ? "it is typed text" : null;
    }

    private static bool IsReadByOthers(string path) {
      const int AtCurrentFolder = -100, ModeField = 2, PlaceOfMode = 28;
      var answer = new byte[256];
      try {
        return Statx(AtCurrentFolder, path, 0, ModeField, answer) == 0 && (answer[PlaceOfMode] & 0x3F) != 0;
      } catch (Exception error) when (error is DllNotFoundException || error is EntryPointNotFoundException) {
        return false; // not Linux
      }
    }

    [DllImport("libc", EntryPoint = "statx")]
    private static extern int Statx(int folder, string path, int flags, uint mask, byte[] answer);
  }
}
