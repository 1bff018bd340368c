// SPDX-License-Identifier: Apache-2.0
#include "devices/woodenhaptics/model.h"

#include <algorithm>

namespace tendon::woodenhaptics {
namespace {

constexpr std::array kModels = {
    Model{.name = "woodenhaptics_v2019",
          .joints = {{{0.010, 0.160, 0.080, 0.321, 2000, 1, 0},
                      {0.010, 0.120, 0.205, 0.0603, 2000, 1, 0},
                      {0.010, 0.120, 0.245, 0.0603, 2000, 1, 6000}}},
          .origin = {0.220, 0, 0.080},
          .workspace_radius = 0.100,
          .full_scale = 3,
          .max_force = 5},
    Model{.name = "woodenhaptics_v2015",
          .joints = {{{0.010, 0.160, 0.080, 0.0259, 2000, 1, 0},
                      {0.010, 0.120, 0.205, 0.0259, 2000, 1, 0},
                      {0.010, 0.120, 0.245, 0.0259, 2000, 1, 6000}}},
          .origin = {0.220, 0, 0.080},
          .workspace_radius = 0.100,
          .full_scale = 6,
          .max_force = 5},
    Model{.name = "polhem_v1",
          .joints = {{{0.010, 0.180, 0.058, 0.0538, 2000, -1, 0},
                      {0.010, 0.100, 0.174, 0.0538, 2000, -1, 0},
                      {0.010, 0.100, 0.133, 0.0538, 2000, -1, -5000}}},
          .origin = {0.140, 0, 0.100},
          .workspace_radius = 0.100,
          .full_scale = 3,
          .max_force = 5},
    Model{.name = "aluhaptics_v2",
          .joints = {{{0.0138, 0.116, 0.111, 0.0259, 2000, 1, 0},
                      {0.0098, 0.076, 0.140, 0.0259, 2000, 1, 0},
                      {0.0098, 0.076, 0.111, 0.0259, 2000, 1, 0}}},
          .origin = {0.140, 0, 0},
          .workspace_radius = 0.100,
          .full_scale = 3,
          .max_force = 5},
    Model{.name = "vintage",
          .joints = {{{0.013, 0.117, 0.056, 0.0163, 4000, 1, 0},
                      {0.010, 0.077, 0.138, 0.0163, 4000, 1, 0},
                      {0.010, 0.077, 0.112, 0.0163, 4000, 1, 0}}},
          .origin = {0.140, 0, 0},
          .workspace_radius = 0.100,
          .full_scale = 3,
          .max_force = 5},
};

constexpr std::array<std::string_view, 2> kClosedLinkages = {"polhem_v2", "polhem_v3"};

}  // namespace

std::span<const Model> models() noexcept { return kModels; }

const Model* find_model(std::string_view name) noexcept {
  const auto found = std::ranges::find(kModels, name, &Model::name);
  return found != kModels.end() ? &*found : nullptr;
}

bool has_unpublished_kinematics(std::string_view name) noexcept {
  return std::ranges::find(kClosedLinkages, name) != kClosedLinkages.end();
}

}  // namespace tendon::woodenhaptics
