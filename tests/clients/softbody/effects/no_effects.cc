// SPDX-License-Identifier: Apache-2.0
// Replaces the sources of the effects in a program without them (see CMakeLists.txt).
#include <cstdlib>

#include "clients/softbody/effects/cutting.h"
#include "clients/softbody/effects/effects.h"
#include "clients/softbody/effects/self_collision.h"
#include "clients/softbody/models/stiffening.h"
#include "clients/softbody/touch/friction.h"

namespace tendon::softbody {
namespace {

[[noreturn]] void abort_with(double) { std::abort(); }

}  // namespace

void check(const EffectsConfig&) {}
Effects effects_at_rest(const EffectsConfig&, const Elastic&) { return {}; }
void add_effects_of_time(Effects&, const EffectsConfig&, const Elastic&, const VectorXd&) {}
std::size_t bytes(const Effects&) noexcept { return 0; }

Friction::Friction(double, double) : coefficient_(0), stiffness_(0) { abort_with(coefficient_ + stiffness_); }
Friction::Drag Friction::move(const Vec2&, double) { std::abort(); }
double sideways_stiffness(const Material&, double) { std::abort(); }

Division divide(const Mesh&, const Fixed&, std::span<const Cut>) { std::abort(); }
std::vector<int> twins(const Elastic&, const Division&) { std::abort(); }
// NOLINTNEXTLINE(performance-unnecessary-value-param): as it is declared
Cutting::Cutting(std::vector<PlannedCut>) { abort_with(changed_ ? 1 : 0); }
bool Cutting::due(PlannedCut::When, double) const noexcept { return false; }
std::span<const Cut> Cutting::make_next() { return made_; }
std::vector<Cut> Cutting::with_next() const { std::abort(); }
bool Cutting::take_changed() noexcept { return false; }
std::size_t Cutting::bytes() const noexcept { return 0; }

double SelfCollision::look(const VectorXd&) { std::abort(); }
double SelfCollision::foresee(const Factor&, const VectorXd&, const VectorXd&, const VectorXd*, double) {
  std::abort();
}
bool SelfCollision::pushes(const VectorXd&) const { std::abort(); }
VectorXd SelfCollision::foreseen_forces(const VectorXd&) const { std::abort(); }
MatrixXd SelfCollision::solve(const Factor&, const MatrixXd&) const { std::abort(); }
VectorXd SelfCollision::forces(const VectorXd&) const { std::abort(); }
std::size_t SelfCollision::bytes() const noexcept { return 0; }

double StiffnessOverTime::factor_at(double) const { std::abort(); }
void check(const StiffnessOverTime&) {}
// NOLINTNEXTLINE(performance-unnecessary-value-param): as it is declared
StiffeningModel::StiffeningModel(Model& model, StiffnessOverTime) : model_(model) { abort_with(factor_); }
void StiffeningModel::go_on_from(const Model&, std::span<const int>) { std::abort(); }
Reaction StiffeningModel::press(const Patch&, Prescribed, double) { std::abort(); }
std::size_t StiffeningModel::bytes() const noexcept { return 0; }

}  // namespace tendon::softbody
