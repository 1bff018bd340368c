// SPDX-License-Identifier: Apache-2.0
#include "server/scene/scene.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace tendon {
namespace {

/// Calls the free function, which the member function with the same name would hide.
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

bool Scene::may_use_fields(const Channel& channel) const {
  return has_fields() &&
         (fields.channels.empty() || std::ranges::find(fields.channels, channel.name) != fields.channels.end());
}

std::string Scene::name_of(std::uint32_t index) const { return count == 1 ? name : name + '-' + std::to_string(index); }

std::vector<Scene> each_device(const std::vector<Scene>& scenes) {
  std::vector<Scene> each;
  std::size_t devices = 0;
  for (const Scene& scene : scenes) devices += scene.count;
  each.reserve(devices);
  for (const Scene& scene : scenes) {
    for (std::uint32_t index = 0; index < scene.count; ++index) {
      Scene& one = each.emplace_back(scene);
      one.name = scene.name_of(index);
      one.count = 1;
      one.loop.device = scene.loop.device + index;
    }
  }
  return each;
}

std::string_view needs_one_network_thread(const std::vector<Scene>& scenes) {
  if (scenes.front().network.busy) return "network.busy";
  if (scenes.front().network.unix_path) return "network.unix";
  if (std::ranges::any_of(scenes, &Scene::dials)) return "teleoperation.dial";
  return {};
}

const std::vector<const Driver*>& drivers() {
  static const std::vector<const Driver*> kRows =
      rows_of(std::make_index_sequence<std::variant_size_v<Scene::AnyDevice>>());
  return kRows;
}

}  // namespace tendon
