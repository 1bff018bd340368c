// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "clients/softbody/fem/elastic.h"

namespace tendon::softbody {

/// The parallelogram corner + s·`along` + t·`deep`, 0 ≤ s, t ≤ 1; m, body frame at rest.
struct Cut {
  Vec3 corner;
  Vec3 along;
  Vec3 deep;
};

/// A mesh after cuts. A face is opened if the centers of its two elements are on different sides of the parallelogram.
/// The nodes of opened faces are copied, except at the tip of a cut. The copies follow the other nodes.
struct Division {
  Mesh mesh;
  Fixed fixed;  ///< also set for nodes without an element
  std::vector<int> node_before;
  std::vector<int> element_before{};
  int opened = 0;  ///< faces
  int lost = 0;    ///< elements in pieces that were removed because they are not held by three nodes
};

/// `cuts` must contain all cuts of this mesh, because a later cut can open more faces of an earlier one.
Division divide(const Mesh& mesh, const Fixed& fixed, std::span<const Cut> cuts);

/// For each new free displacement, returns the original one. The division must not have lost elements.
std::vector<int> twins(const Elastic& divided, const Division& division);

struct PlannedCut {
  enum class When : std::uint8_t {
    kTime,   ///< s since the first answer
    kForce,  ///< N
  };
  Cut cut;
  When when;
  double value;
};

/// Keeps track of the cuts, which are made in order. Thread-safe: no.
class Cutting {
 public:
  /// Throws std::invalid_argument if a parallelogram has no area, a time is negative, or a force is not positive.
  explicit Cutting(std::vector<PlannedCut> plan);

  bool due(PlannedCut::When when, double value) const noexcept;
  std::span<const Cut> make_next();    ///< returns all cuts made so far
  std::vector<Cut> with_next() const;  ///< returns the result of make_next() without making the cut
  std::size_t left() const noexcept { return plan_.size() - made_.size(); }
  bool take_changed() noexcept;
  std::size_t bytes() const noexcept;

 private:
  std::vector<PlannedCut> plan_;
  std::vector<Cut> made_;
  bool changed_ = false;
};

}  // namespace tendon::softbody
