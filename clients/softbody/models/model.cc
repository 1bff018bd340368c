// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/models/model.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace tendon::softbody {
namespace {

constexpr double kApart = 0.01;  // s between answers
constexpr int kAlike = 10;       // several in a row, because an oscillation can have a turning point

}  // namespace

double constrained_force(Prescribed given, double value, double untouched, double compliance) {
  if (given == Prescribed::kForce) return value;
  if (!(compliance > 0)) return 0;
  const double force = (value - untouched) / compliance;
  return given == Prescribed::kLeastDepth ? std::max(0.0, force) : force;
}

double secant(const Reaction& reaction, double rest) {
  return reaction.depth > rest && reaction.force > 0 ? reaction.force / (reaction.depth - rest) : 0;
}

void Model::cut(const Division&, const EffectsConfig&) {
  throw std::logic_error("this model does not support cutting");
}

void Model::go_on_from(const Model&, std::span<const int>) {
  throw std::logic_error("this model does not support cutting");
}

Reaction settle(Model& model, const Patch& patch, Prescribed given, double value, double tolerance, double most) {
  const int apart = model.step() > 0 ? std::max(1, static_cast<int>(std::lround(kApart / model.step()))) : 1;
  const int rounds = static_cast<int>(std::ceil(most / kApart));
  Reaction last = model.press(patch, given, value);
  double change = 0;
  for (int round = 0, alike = 0; round < rounds && alike < kAlike; ++round) {
    Reaction next;
    for (int i = 0; i < apart; ++i) next = model.press(patch, given, value);
    change = std::abs(next.force - last.force) + std::abs(next.depth - last.depth) * next.stiffness;
    alike = change <= tolerance * std::abs(next.force) ? alike + 1 : 0;
    last = next;
  }
  last.error += change;
  return last;
}

}  // namespace tendon::softbody
