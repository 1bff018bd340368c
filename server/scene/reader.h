// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <toml++/toml.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/base/nearest_word.h"
#include "server/scene/values.h"

// Only the declarations of keys use this.

namespace tendon::scene_file {

std::string joined(std::string_view path, std::string_view name);

/// Returns "; " and the closest known key, or all known keys.
std::string advice(std::string_view unknown, const std::vector<std::string_view>& known);

/// Returns the present name of a key of an earlier version, or nothing.
std::string_view new_name_of(std::string_view path) noexcept;

/// A position in the file. Line 0 is unknown.
struct Place {
  std::uint32_t line = 0;
  std::uint32_t column = 0;
  friend bool operator<(const Place& a, const Place& b) {
    return std::pair(a.line, a.column) < std::pair(b.line, b.column);
  }
};

Place place_of(const toml::node& node);

/// Throws a SceneError if the text is not TOML. `name` is the start of the message.
toml::table parse_toml(std::string_view text, const std::string& name);

/// Throws SceneError "FILE:LINE: KEY: SENTENCE".
[[noreturn]] void fail(const std::string& file, Place at, const std::string& key, const std::string& sentence);

/// Reports the error with the lowest line. Missing keys are only reported if there are no other errors.
class SceneProblems {
 public:
  void wrong(Place at, std::string key, std::string sentence) { add({false, at, std::move(key), std::move(sentence)}); }
  void missing(Place at, std::string key, std::string sentence) {
    add({true, at, std::move(key), std::move(sentence)});
  }

  void throw_first(const std::string& file) const {
    if (first_) fail(file, first_->at, first_->key, first_->sentence);
  }

 private:
  struct Problem {
    bool missing;
    Place at;
    std::string key;
    std::string sentence;
  };

  void add(Problem problem) {
    const auto rank = [](const Problem& f) { return std::pair(f.missing, f.at); };
    if (!first_ || rank(problem) < rank(*first_)) first_ = std::move(problem);
  }

  std::optional<Problem> first_;
};

/// Reports inconsistencies between several keys of a file.
class SceneErrors {
 public:
  /// `name` starts error messages. Both arguments must outlive this object.
  SceneErrors(const toml::table& file, const std::string& name) : file_(file), name_(name) {}

  /// Throws a SceneError with the line of the first of `places` in the file, or of the innermost table with the key.
  [[noreturn]] void blame(std::string_view key, std::initializer_list<std::string_view> places,
                          const std::string& sentence) const;

  template <class Build>
  void build(std::string_view table, const Build& attempt) const {
    try {
      attempt();
    } catch (const std::invalid_argument& refused) {
      blame(table, {}, refused.what());
    }
  }

 protected:
  const toml::table& file_;
  const std::string& name_;
};

/// Reads the keys of a table from the file. `table` is null if it is not in the file.
class Reader {
 public:
  static constexpr bool kDocuments = false;

  Reader(SceneProblems& problems, const toml::table* table, std::string path, Place place)
      : problems_(problems), table_(table), path_(std::move(path)), place_(place) {}

  template <class T, class Rule>
  bool key(const Name& named, T& target, const Rule& rule, std::string_view /*meaning*/, const Absent& absent = {}) {
    const std::string_view name = named.name;
    const Unit& unit = unit_of(name);
    const toml::node* node = look_up(name);
    if (node == nullptr) {
      if (absent.required) {
        problems_.missing(place_, joined(path_, name), "missing, expected " + rule.expected(unit));
      }
      return false;
    }
    const Verdict refusal = rule.take(*node, unit, target);
    if (!refusal) return true;
    // If a setting is not valid TOML, it is read as a string, for example device.effects.mass_kg=0,05
    const bool number = refusal->expected.starts_with("a number") && refusal->found->is_string();
    const std::string found = found_in(*refusal->found);
    problems_.wrong(place_of(*refusal->found), joined(path_, name),
                    "expected " + refusal->expected + ", found " + found + refusal->hint +
                        std::string(number ? decimal_point_hint(found) : ""));
    return false;
  }

  template <class T, class Declare, class Common = NoKeys>
  void kind(const Names<T>& names, const Declare& declare, const Common& common = {}) {
    T value{};
    kind_known_ = key("kind", value, names, "", kRequired);
    if (!kind_known_) return;
    common(*this);
    declare(*this, value);
  }

  template <class Declare>
  void table(std::string_view name, const Declare& declare) {
    const toml::node* node = look_up(name);
    if (node != nullptr && !node->is_table()) {
      problems_.wrong(place_of(*node), joined(path_, name), "expected a table, found " + found_in(*node));
      return;
    }
    Reader inner(problems_, node != nullptr ? node->as_table() : nullptr, joined(path_, name),
                 node != nullptr ? place_of(*node) : place_);
    declare(inner);
    inner.refuse_unknown();
  }

  /// Reads an optional part. It is enabled if its table is present.
  template <class T, class Declare>
  void part(const Name& named, std::optional<T>& target, const Declare& declare) {
    if (look_up(named.name) == nullptr) return;
    table(named.name, [&](Reader& keys) {
      // clang 14 does not support optional<T>::emplace() without arguments if T was incomplete in the declaration.
      if constexpr (std::is_default_constructible_v<T>) {
        declare(keys, target.emplace());
      } else {
        declare(keys, target.emplace(T{}));
      }
    });
  }

  /// If there are no tables [[name]], `target` is not modified.
  template <class T, class Declare>
  void tables(std::string_view name, std::vector<T>& target, std::size_t most, const Declare& declare) {
    const toml::node* node = look_up(name);
    if (node == nullptr) return;
    const std::string path = joined(path_, name);
    if (!node->is_array_of_tables() || node->as_array()->size() > most) {
      problems_.wrong(place_of(*node), path,
                      "expected 1 to " + std::to_string(most) + " tables [[" + path + "]], found " + found_in(*node));
      return;
    }
    target.clear();
    for (const toml::node& one : *node->as_array()) {
      Reader inner(problems_, one.as_table(), path + "[" + std::to_string(target.size()) + "]", place_of(one));
      declare(inner, target.emplace_back());
      inner.refuse_unknown();
    }
  }

  /// Exactly one of two keys must be in the file. Returns true if it is the first one.
  bool either(std::string_view first, std::string_view second) {
    const bool found = look_up(first) != nullptr;
    if (found == (look_up(second) != nullptr)) {
      problems_.wrong(place_, path_, "expected either " + std::string(first) + " or " + std::string(second));
    }
    return found;
  }

  void refuse_unknown() const {
    if (table_ == nullptr || !kind_known_) return;
    for (const auto& [name, node] : *table_) {
      if (std::find(known_.begin(), known_.end(), name.str()) != known_.end()) continue;
      const std::string path = joined(path_, name.str());
      const std::string_view now = new_name_of(path);
      problems_.wrong(place_of(node), path,
                      now.empty() ? (node.is_table() ? "unknown table" : "unknown key") + advice(name.str(), known_)
                                  : "renamed to " + std::string(now));
    }
  }

 private:
  const toml::node* look_up(std::string_view name) {
    if (std::find(known_.begin(), known_.end(), name) == known_.end()) known_.push_back(name);
    return table_ != nullptr ? table_->get(name) : nullptr;
  }

  SceneProblems& problems_;
  const toml::table* table_;
  std::string path_;
  Place place_;
  std::vector<std::string_view> known_;
  bool kind_known_ = true;  ///< if false, the valid keys are unknown
};

}  // namespace tendon::scene_file
