// SPDX-License-Identifier: Apache-2.0
#include "server/scene/scene.h"

#include <cstddef>
#include <utility>

namespace tendon {
namespace {

/// Calls the free function `driver`, which a member function of the same name would hide.
template <class Device>
const Driver& row_of(const Device& device) {
  return driver(device);
}

template <std::size_t... index>
std::vector<const Driver*> rows_of(std::index_sequence<index...> /*all*/) {
  return {&row_of(std::variant_alternative_t<index, Scene::AnyDevice>{})...};
}

}  // namespace

const Driver& Scene::driver() const {
  return std::visit([](const auto& config) -> const Driver& { return row_of(config); }, device);
}

SimulatedDevice::Config Scene::simulated() const {
  return std::visit([](const auto& config) { return stand_in(config); }, device);
}

const std::vector<const Driver*>& drivers() {
  static const std::vector<const Driver*> kRows =
      rows_of(std::make_index_sequence<std::variant_size_v<Scene::AnyDevice>>());
  return kRows;
}

}  // namespace tendon
