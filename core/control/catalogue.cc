// SPDX-License-Identifier: Apache-2.0
#include "core/control/catalogue.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <utility>

#include "core/base/expect.h"

namespace tendon {
namespace {

using catalogue::kRows;

constexpr std::size_t kCount = std::tuple_size_v<decltype(kRows)>;

constexpr auto kLaws = std::apply([](const auto&... row) { return std::array<LawInfo, kCount>{row.info...}; }, kRows);

static_assert(
    [] {
      for (std::size_t i = 0; i < kCount; ++i) {
        if (static_cast<std::size_t>(kLaws[i].law) != i) return false;
      }
      return kCount == static_cast<std::size_t>(Law::kAolPlus) + 1;
    }(),
    "row i of the catalogue is enumerator i of Law");

using Maker = AnyLaw (*)(const LimiterConfig&);

constexpr auto kMakers = []<std::size_t... I>(std::index_sequence<I...>) {
  return std::array<Maker, kCount>{
      [](const LimiterConfig& config) { return AnyLaw(std::get<I>(kRows).make(config)); }...};
}
(std::make_index_sequence<kCount>());

}  // namespace

std::span<const LawInfo> laws() noexcept { return kLaws; }

const LawInfo& info(Law law) noexcept { return kLaws[static_cast<std::size_t>(law)]; }

std::optional<Law> law_named(std::string_view name) noexcept {
  const auto* const found = std::ranges::find(kLaws, name, &LawInfo::name);
  if (found == kLaws.end()) return std::nullopt;
  return found->law;
}

AnyLaw make_law(const LimiterConfig& config) {
  const auto i = static_cast<std::size_t>(config.law);
  expect(i < kCount, "law", static_cast<double>(i), "one of laws()");
  return kMakers[i](config);
}

}  // namespace tendon
