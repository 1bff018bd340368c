// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <future>
#include <utility>
#include <vector>

#include "clients/softbody/body.h"
#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/quasi_static.h"

namespace tendon::softbody::testing {

/// B1: 100 × 100 × 50 mm, 10 kPa, clamped at the bottom, pressed at the center of its top by a patch of 20 mm radius.
/// Known to ± 0.1 % from deal.II 9.4 (Q2 with n = 32 and Q3 with n = 12).
inline constexpr double kB1 = 420.2;                      // N/m, ν = 0.45
inline constexpr double kB1NearlyIncompressible = 450.9;  // N/m, ν = 0.499
inline constexpr double kB1PatchRadius = 0.02;            // m

inline Solid pressed_block(Element element, int n, double poisson, Law law = Law::kLinear) {
  Mesh mesh = block(info(element).shape, Vec3(0.1, 0.1, 0.05), {n, n, n / 2});
  const Fixed fixed = fix_where(mesh, [](const Vec3& node) { return node.z() < 1e-9; });
  return {std::move(mesh), element, {.young = 1e4, .poisson = poisson}, law, fixed};
}

inline BodyConfig pressed_body(ModelKind model, Element element, int n) {
  BodyConfig config;
  config.shape = BlockShape{Vec3(0.1, 0.1, 0.05), {n, n, n / 2}};
  config.element = element;
  config.material = {.young = 1e4, .poisson = 0.45};
  config.model = model_config(model);
  config.patch_radius = kB1PatchRadius;
  return config;
}

struct PressedByNewton {
  explicit PressedByNewton(Element element, int n, Law law, int max_iterations = 30)
      : solid(pressed_block(element, n, 0.45, law)),
        top(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius),
        model(solid, top, {.max_iterations = max_iterations}),
        patch(*top.patch(Vec2::Zero())) {}
  Solid solid;
  TouchSurface top;
  QuasiStaticModel model;
  Patch patch;
};

/// Collects the second thread's work until work() runs it.
struct Elsewhere {
  Background background() {
    return [this](std::packaged_task<void()> work) { given.push_back(std::move(work)); };
  }
  void work() {
    for (std::packaged_task<void()>& each : std::exchange(given, {})) each();
  }
  std::vector<std::packaged_task<void()>> given;
};

}  // namespace tendon::softbody::testing
