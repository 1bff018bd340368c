// SPDX-License-Identifier: Apache-2.0
//
// In place of effects.cc and friction.cc, in a program that is built without effects (CMakeLists.txt).
#include <cstdlib>

#include "clients/softbody/effects.h"
#include "clients/softbody/friction.h"

namespace tendon::softbody {
namespace {

/// Takes what would else be members that nobody reads.
[[noreturn]] void abort_with(double) { std::abort(); }

}  // namespace

void check(const EffectsConfig&) {}
void check_only_with_inertia(const EffectsConfig&) {}
Effects effects_at_rest(const EffectsConfig&, const Elastic&) { return {}; }
void add_effects_of_time(Effects&, const EffectsConfig&, const Elastic&, const VectorXd&) {}
std::size_t bytes(const Effects&) noexcept { return 0; }

Friction::Friction(double, double) : coefficient_(0), stiffness_(0) { abort_with(coefficient_ + stiffness_); }
Friction::Drag Friction::move(const Vec2&, double) { std::abort(); }
double sideways_stiffness(const Material&, double) { std::abort(); }

}  // namespace tendon::softbody
