// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/engine/fd_stiffness.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "protocol/expect.h"

namespace tendon {
namespace {

class Restored {
 public:
  explicit Restored(const SavedState& state) : state_(state) {
    if (state_.save) state_.save();
  }
  ~Restored() { restore(); }
  Restored(const Restored&) = delete;
  Restored& operator=(const Restored&) = delete;
  void restore() const {
    if (state_.restore) state_.restore();
  }

 private:
  const SavedState& state_;
};

}  // namespace

std::optional<FdStiffness> fd_stiffness(const std::function<Vec3(const Vec3& position)>& force, const Vec3& at,
                                        double step, const SavedState& state) {
  expect_above_zero(step, "step");
  if (!state.save != !state.restore) {
    throw std::invalid_argument("state: expected both save and restore, or neither");
  }

  const Restored saved(state);
  const auto force_at = [&](const Vec3& position) {
    saved.restore();
    return force(position);
  };
  const Vec3 middle = force_at(at);
  Mat3 ahead;
  Mat3 behind;
  for (int axis = 0; axis < 3; ++axis) {
    ahead.col(axis) = force_at(at + step * Vec3::Unit(axis));
    behind.col(axis) = force_at(at - step * Vec3::Unit(axis));
  }
  if (!middle.allFinite() || !ahead.allFinite() || !behind.allFinite()) return std::nullopt;

  const Mat3 difference = (behind - ahead) / (2 * step);
  FdStiffness found;
  found.stiffness = (difference + difference.transpose()) / 2;
  found.asymmetry = ((difference - difference.transpose()) / 2).cwiseAbs().maxCoeff();
  found.kink = ((ahead + behind).colwise() - 2 * middle).cwiseAbs().maxCoeff() / (2 * step);
  return found;
}

}  // namespace tendon
