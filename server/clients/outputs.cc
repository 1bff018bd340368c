// SPDX-License-Identifier: Apache-2.0
#include "server/clients/outputs.h"

namespace tendon {

void Outputs::set(std::uint32_t client, std::size_t output, const OutputSetting& setting) noexcept {
  OutputSettings::One& one = settings_.of[output];
  one = {.number = one.number + 1, .setting = setting};
  set_by_[output] = client;
}

bool Outputs::turn_off_those_of(std::uint32_t client) noexcept {
  bool any = false;
  for (std::size_t i = 0; i < kMostOutputs; ++i) any |= set_by_[i] == client && turn_off(i);
  return any;
}

bool Outputs::turn_off_all() noexcept {
  bool any = false;
  for (std::size_t i = 0; i < kMostOutputs; ++i) any |= turn_off(i);
  return any;
}

bool Outputs::turn_off(std::size_t output) noexcept {
  if (set_by_[output] == 0) return false;
  set(0, output, turned_off(kind_of(settings_.of[output].setting)));
  return true;
}

}  // namespace tendon
