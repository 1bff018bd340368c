// SPDX-License-Identifier: Apache-2.0
// For effects_proof_test.cc: a tool presses and strokes several bodies in turn. Callgrind counts within `touch_in_turn`
// and writes a file each time it returns, so that one run measures all bodies.
//
// softbody-proof none     each model with only the effects that it requires
// softbody-proof each     some of them with one additional effect at a time
//
// Prints a line for each body: its name, its heap memory in bytes, and the memory that it reports.
#include <iostream>
#include <memory>
#include <string>
#include <string_view>

#include "tests/clients/softbody/pressed_block.h"
#include "tests/clients/softbody/steady_heap.h"

using namespace tendon::softbody;

namespace {

BodyConfig body_of(const ModelInfo& model) {
  BodyConfig config = testing::pressed_body(model.kind, Element::kHex8Sri, 4);
  // The number of iterations depends on the forces, but the test compares the cost of one.
  if (Newton* newton = newton_of(config.model)) newton->max_iterations = 1;
  config.effects.step = 1e-3;
  return config;
}

void list(EffectKind effect, BodyConfig& config) {
  config.effects.density = 1000;
  switch (effect) {
    case EffectKind::kGravity:
      config.effects.gravity = Vec3(0, 0, -0.1);
      break;
    case EffectKind::kInertia:
      config.effects.inertia = true;
      break;
    case EffectKind::kDamping:
      config.effects.damping = 10;
      break;
    case EffectKind::kViscosity:
      config.effects.viscosity = 0.01;
      break;
    case EffectKind::kFriction:
      config.friction = 0.3;
      break;
    case EffectKind::kCutting:  // a cut that is never made
      config.cuts = {{{Vec3(0, -0.06, 0.025), Vec3(0, 0.12, 0), Vec3(0, 0, 0.03)}, PlannedCut::When::kForce, 1e6}};
      break;
    case EffectKind::kStiffening:
      config.stiffening = StiffnessOverTime{.at = {0, 10}, .factor = {1, 2}};
      break;
    case EffectKind::kPlasticity:
      set_plasticity(config.model, Yield{.stress = 100, .hardening = 1e4});
      break;
    case EffectKind::kSelfCollision:
      set_self_collision(config.model, 1e-4);
      break;
    default:
      break;
  }
}

}  // namespace

/// Neither inlined nor mangled, for callgrind.
extern "C" [[gnu::noinline]] void touch_in_turn(Body& body, int steps) {
  for (int i = 0; i < steps; ++i) {
    body.tick(0.01 * i);
    body.touch(Vec3(0.0005 * i, 0, 0.0485 - 1e-5 * i));
  }
}

namespace {

void prove(const std::string& name, const BodyConfig& config) {
  const std::size_t before = testing::bytes_on_heap();
  const auto body = std::make_unique<Body>(config);
  touch_in_turn(*body, 2);
  touch_in_turn(*body, 6);
  std::cout << name << ' ' << testing::bytes_on_heap() - before << ' ' << body->size().bytes << '\n';
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view which = argc == 2 ? argv[1] : "";
  if (which == "none") {
    for (const ModelInfo& model : models()) prove(std::string(model.name) + " none", body_of(model));
    return 0;
  }
  if (which != "each") return 2;
  for (const ModelKind kind : {ModelKind::kLinear, ModelKind::kCondensed, ModelKind::kNeoHookean}) {
    const ModelInfo& model = info(kind);
    prove(std::string(model.name) + " none", body_of(model));
    for (const EffectInfo& effect : effects()) {
      if (!model.may.has(effect.kind)) continue;
      BodyConfig config = body_of(model);
      list(effect.kind, config);
      prove(std::string(model.name) + ' ' + std::string(effect.name), config);
    }
  }
}
