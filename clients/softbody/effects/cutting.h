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

/// A mesh after cuts. Cuts run along element faces: a face opens if the centers of its two elements are on different
/// sides of the parallelogram. Nodes keep their numbers; copies on the other side of a cut are appended. A node at the
/// tip of a cut, whose elements are still connected around it, is not copied.
struct Division {
  Mesh mesh;
  Fixed fixed;                        ///< copies of fixed nodes are fixed, and so are nodes without an element
  std::vector<int> node_before;       ///< for each node, its number before the cuts
  std::vector<int> element_before{};  ///< for each element, its number before the cuts
  int opened = 0;                     ///< faces, including those opened before
  int lost = 0;  ///< elements removed with unheld pieces; a piece is held by three non-collinear fixed nodes
};

/// `cuts`: all cuts ever made in this mesh, including those already visible, because a later cut can split a node for
/// which an earlier one was too short.
Division divide(const Mesh& mesh, const Fixed& fixed, std::span<const Cut> cuts);

/// For each new free displacement, the one it was copied from. Only for a division without lost elements, in which
/// earlier displacements keep their numbers.
std::vector<int> twins(const Elastic& divided, const Division& division);

struct PlannedCut {
  enum class When : std::uint8_t {
    kTime,   ///< at the time `value`, s
    kForce,  ///< after an answer with a normal force above `value`, N
  };
  Cut cut;
  When when;
  double value;
};

/// Keeps track of the cuts that were made. Cuts are made in order; each waits for the previous ones. Thread-safe: no.
class Cutting {
 public:
  /// Throws std::invalid_argument, naming the cut, if a parallelogram has no area, a time is negative, or a force is
  /// not positive.
  explicit Cutting(std::vector<PlannedCut> plan);

  bool due(PlannedCut::When when, double value) const noexcept;
  std::span<const Cut> make_next();    ///< makes the next cut and returns all made; one must be left
  std::vector<Cut> with_next() const;  ///< the same list without making the cut
  std::size_t left() const noexcept { return plan_.size() - made_.size(); }
  bool take_changed() noexcept;  ///< true if cuts were made since the last call
  std::size_t bytes() const noexcept;

 private:
  std::vector<PlannedCut> plan_;
  std::vector<Cut> made_;
  bool changed_ = false;
};

}  // namespace tendon::softbody
