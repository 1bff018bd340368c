// SPDX-License-Identifier: Apache-2.0
#include "server/recording/solver_paths.h"

#include <algorithm>

namespace tendon {

std::uint8_t SolverPaths::number_of(std::string_view name) noexcept {
  if (name.empty() || name.size() > limits::kMaxLabel) return 0;
  for (std::uint8_t number = 1; number <= kMost; ++number) {
    Name& kept = names_[number - 1U];
    if (kept.size == 0) {
      std::ranges::copy(name, kept.text.begin());
      kept.size = static_cast<std::uint8_t>(name.size());
      return number;
    }
    if (name_of(number) == name) return number;
  }
  return 0;
}

std::string_view SolverPaths::name_of(std::uint8_t number) const noexcept {
  if (number == 0 || number > kMost) return {};
  const Name& kept = names_[number - 1U];
  return {kept.text.data(), kept.size};
}

}  // namespace tendon
