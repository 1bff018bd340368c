// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/scene/keys.h"
#include "server/scene/reader.h"
#include "server/scene/values.h"

// Internal to server/scene.

namespace tendon::scene_file {

/// Lists all parts, and can remove one of them from the draft.
class Parts {
 public:
  static constexpr bool kDocuments = true;

  /// Removes the part `key`, and sets `removed` to true if it exists.
  Parts(std::vector<ScenePart>& all, std::string_view key, bool& removed) : all_(all), key_(key), removed_(removed) {}

  /// If a key `kind` is a part, the name of the part is the name of its table.
  template <class T, class Rule>
  bool key(const Name& named, T& target, const Rule&, std::string_view /*meaning*/, const Absent& = {}) {
    if constexpr (requires { take_out(target); }) visit(named.name == "kind" ? path_ : path_of(named), named, target);
    return false;
  }

  template <class T, class Declare, class Common = NoKeys>
  void kind(const Names<T>& names, const Declare& declare, const Common& = {}) {
    for (const auto& [name, value] : names.all) declare(*this, value);
  }

  template <class Declare>
  void table(const Name& named, const Declare& declare) {
    Parts inner = *this;
    inner.path_ = path_of(named);
    declare(inner);
  }

  template <class T, class Declare>
  void part(const Name& named, std::optional<T>& target, const Declare& declare) {
    const std::string path = path_of(named);
    visit(path, named, target);
    T defaults;
    table(named, [&](Parts& inner) { declare(inner, target && key_.starts_with(path + '.') ? *target : defaults); });
  }

  template <class T, class Declare>
  void tables(std::string_view, std::vector<T>&, std::size_t, const Declare&) {}

 private:
  template <class T>
  static bool take_out(std::optional<T>& part) {
    return std::exchange(part, std::nullopt).has_value();
  }
  static bool take_out(Law& law) { return std::exchange(law, Law::kNone) != Law::kNone; }

  template <class T>
  void visit(const std::string& path, const Name& named, T& target) {
    if (named.part.empty()) return;
    all_.push_back({path, named.part});
    if (path == key_) removed_ = take_out(target);
  }

  std::string path_of(const Name& named) const { return joined(path_, named.name); }

  std::vector<ScenePart>& all_;
  std::string_view key_;
  bool& removed_;
  std::string path_;
};

}  // namespace tendon::scene_file
