// SPDX-License-Identifier: Apache-2.0
#include "clients/precice/touched_patch.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <string>

namespace tendon::precice_worker {
namespace {

constexpr int kMostRings = 50;

template <class Value>
void expect(bool holds, const char* field, const Value& value, const char* expected) {
  if (holds) return;
  std::ostringstream text;
  text << field << " = " << value << ": expected " << expected;
  throw std::invalid_argument(text.str());
}

}  // namespace

TouchedPatch::TouchedPatch(const Config& config) : config_(config) {
  expect(config.middle.allFinite(), "middle", config.middle.transpose(), "three finite numbers");
  const double length = config.normal.norm();
  expect(std::isfinite(length) && length > 0, "normal", config.normal.transpose(), "three finite numbers, not all 0");
  expect(std::isfinite(config.radius) && config.radius > 0, "radius", config.radius, "more than 0");
  expect(config.rings >= 1 && config.rings <= kMostRings, "rings", config.rings, "1 to 50");
  config_.normal /= length;
  const Vec3 along = config_.normal.unitOrthogonal();
  const Vec3 across = config_.normal.cross(along);
  const auto add = [&](const Vec3& place) { places_.insert(places_.end(), place.begin(), place.end()); };
  add(config.middle);
  for (int ring = 1; ring <= config.rings; ++ring) {
    const double r = config.radius * ring / config.rings;
    for (int i = 0; i < 6 * ring; ++i) {
      const double angle = 2 * std::numbers::pi * i / (6 * ring);
      add(config.middle + r * (std::cos(angle) * along + std::sin(angle) * across));
    }
  }
}

double TouchedPatch::depth(const DeviceState& hand) const {
  const Vec3 from_middle = hand.position - config_.middle;
  const double height = from_middle.dot(config_.normal);
  const double aside = (from_middle - height * config_.normal).norm();
  return aside > config_.radius ? 0 : std::max(0.0, -height);
}

std::vector<double> TouchedPatch::displacements(const DeviceState& hand) const {
  const Vec3 moved = -depth(hand) * config_.normal;
  std::vector<double> out;
  out.reserve(places_.size());
  for (std::size_t i = 0; i < nodes(); ++i) out.insert(out.end(), moved.begin(), moved.end());
  return out;
}

Touch TouchedPatch::answer(const DeviceState& hand, std::span<const double> held) {
  expect(held.size() == places_.size(), "held", held.size(), "three numbers for each node");
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < held.size(); ++i) sum[static_cast<Eigen::Index>(i % 3)] += held[i];
  const double deep = depth(hand);
  const double pushes = -sum.dot(config_.normal);
  if (!std::isfinite(pushes)) return Vec3(pushes * config_.normal);  // the proxy reports it
  const double force = deep > 0 ? std::max(0.0, pushes) : 0;
  Touch touch = Vec3(force * config_.normal);
  if (last_) {
    const double step = deep - last_->depth;
    if (secant_) touch.error = std::abs(force - (last_->force + *secant_ * step));
    if (std::abs(step) >= kLeastStep) secant_ = std::max(0.0, (force - last_->force) / step);
  }
  if (!last_ || std::abs(deep - last_->depth) >= kLeastStep) last_ = Press{.depth = deep, .force = force};
  if (secant_) touch.stiffness = Mat3((deep > 0 ? *secant_ : 0) * config_.normal * config_.normal.transpose());
  return touch;
}

}  // namespace tendon::precice_worker
