// SPDX-License-Identifier: Apache-2.0
using System;
using System.Collections.Generic;
using System.Globalization;
using System.IO;
using System.Text;

namespace Tendon.Tests {
  /// <summary>A JSON value. A member that does not exist is an error.</summary>
  public sealed class Json {
    private readonly object _value;

    private Json(object value) {
      _value = value;
    }

    /// <summary>Reads a file of protocol/vectors.</summary>
    public static Json Vectors(string name) =>
        Parse(File.ReadAllText(Path.Combine(Check.Source, "protocol/vectors", name + ".json")));

    public static Json Parse(string text) {
      int at = 0;
      return Read(text, ref at);
    }

    public Json this[string name] => Members[name];
    public Dictionary<string, Json> Members => (Dictionary<string, Json>)_value;
    public bool Has(string name) => Members.ContainsKey(name);
    public List<Json> List => (List<Json>)_value;
    public string Text => _value as string ?? ((double)_value).ToString("R", CultureInfo.InvariantCulture);
    public bool Truth => (bool)_value;
    public double Number => _value is double number ? number : double.Parse(Text, CultureInfo.InvariantCulture);
    public ulong Whole => _value is double number ? (ulong)number : ulong.Parse(Text);

    public byte[] Bytes {
      get {
        var bytes = new byte[Text.Length / 2];
        for (int i = 0; i < bytes.Length; ++i) bytes[i] = Convert.ToByte(Text.Substring(2 * i, 2), 16);
        return bytes;
      }
    }

    private static Json Read(string text, ref int at) {
      while (" \n\r\t,:".IndexOf(text[at]) >= 0) ++at;
      char first = text[at];
      if (first == '"') return new Json(ReadText(text, ref at));
      if (first == '{' || first == '[') {
        ++at;
        var members = new Dictionary<string, Json>();
        var entries = new List<Json>();
        while (!Ends(text, ref at)) {
          Json entry = Read(text, ref at);
          if (first == '{') members[entry.Text] = Read(text, ref at);
          else entries.Add(entry);
        }
        return new Json(first == '{' ? (object)members : entries);
      }
      int begin = at;
      while (at < text.Length && (char.IsLetterOrDigit(text[at]) || "+-.".IndexOf(text[at]) >= 0)) ++at;
      string word = text.Substring(begin, at - begin);
      if (word == "true" || word == "false") return new Json(word == "true");
      return new Json(double.Parse(word, CultureInfo.InvariantCulture));
    }

    private static bool Ends(string text, ref int at) {
      while (" \n\r\t,".IndexOf(text[at]) >= 0) ++at;
      if (text[at] != '}' && text[at] != ']') return false;
      ++at;
      return true;
    }

    private static string ReadText(string text, ref int at) {
      var result = new StringBuilder();
      for (++at; text[at] != '"'; ++at) {
        if (text[at] != '\\') {
          result.Append(text[at]);
          continue;
        }
        char c = text[++at];
        if (c == 'u') {
          result.Append((char)Convert.ToInt32(text.Substring(at + 1, 4), 16));
          at += 4;
        } else {
          result.Append(c == 'n' ? '\n' : c == 'r' ? '\r' : c == 't' ? '\t' : c);
        }
      }
      ++at;
      return result.ToString();
    }
  }
}
