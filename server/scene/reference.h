// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/scene/reader.h"
#include "server/scene/values.h"

// Only the declarations of keys use this.

namespace tendon::scene_file {

/// Prints the documentation of a table.
class Reference {
 public:
  static constexpr bool kDocuments = true;  ///< declare all keys, including exclusive ones

  explicit Reference(std::string& text, std::string path = {}) : text_(text), path_(std::move(path)) {}

  template <class T, class Rule>
  bool key(const Name& named, const T& target, const Rule& rule, std::string_view meaning, const Absent& absent = {}) {
    const Unit& unit = unit_of(named.name);
    std::string without = "Default: ";
    if (absent.text.starts_with("required")) {
      without = capitalized(absent.text);
    } else if (!absent.text.empty()) {
      without += absent.text;
    } else if (absent.required) {
      without = "Required";
    } else {
      without += rule.shown(unit, target);
    }
    text_.append(indent_).append(named.name).append("\n");
    text_.append(indent_).append("    ").append(capitalized(meaning)).append(".\n");
    text_.append(indent_).append("    ").append(capitalized(rule.expected(unit))).append(". ");
    text_.append(without).append(".\n");
    return false;
  }

  template <class T, class Declare, class Common = NoKeys>
  void kind(const Names<T>& names, const Declare& declare, const Common& common = {}) {
    common(*this);
    std::string tables;
    for (const auto& [name, value] : names.all) {
      text_.append("  kind = ").append(in_quotes(name)).append("\n");
      Reference inner(text_, path_);
      inner.indent_ = "    ";
      inner.tables_ = &tables;
      inner.of_kind_ = "  of kind = " + in_quotes(name);
      declare(inner, value);
    }
    (tables_ != nullptr ? *tables_ : text_).append(tables);
  }

  template <class Declare>
  void table(std::string_view name, const Declare& declare) {
    const std::string path = joined(path_, name);
    std::string& text = tables_ != nullptr ? *tables_ : text_;
    text.append(text.empty() && tables_ == nullptr ? "[" : "\n[")
        .append(path)
        .append("]")
        .append(of_kind_)
        .append("\n");
    Reference inner(text, path);
    declare(inner);
  }

  template <class T, class Declare>
  void part(const Name& named, std::optional<T>&, const Declare& declare) {
    table(named.name, [&](Reference& keys) {
      T defaults;
      declare(keys, defaults);
    });
  }

  template <class T, class Declare>
  void tables(std::string_view name, std::vector<T>&, std::size_t most, const Declare& declare) {
    const std::string path = joined(path_, name);
    text_.append("\n[[").append(path).append("]]  at most ").append(std::to_string(most)).append("\n");
    Reference inner(text_, path);
    T defaults;
    declare(inner, defaults);
  }

  static bool either(std::string_view /*first*/, std::string_view /*second*/) { return true; }

 private:
  static std::string capitalized(std::string_view text) {
    std::string sentence(text);
    if (!sentence.empty() && sentence.front() >= 'a' && sentence.front() <= 'z') sentence.front() += 'A' - 'a';
    return sentence;
  }

  std::string& text_;
  std::string path_;
  std::string indent_ = "  ";
  /// The output for the tables of each kind, which are printed last.
  std::string* tables_ = nullptr;
  std::string of_kind_;
};

}  // namespace tendon::scene_file
