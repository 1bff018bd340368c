// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "clients/softbody/fem/elastic.h"

namespace tendon::softbody {

/// A planned cut: the parallelogram corner + s·`along` + t·`deep`, 0 ≤ s, t ≤ 1; m, in the body's frame, at rest.
struct Cut {
  Vec3 corner;
  Vec3 along;
  Vec3 deep;
};

/// A mesh after cuts. Its elements stay as they were, so a cut runs along their faces: it opens each face whose two
/// elements have their centres on different sides of the parallelogram. Nodes keep their numbers, and the copies on the
/// other side of a cut come after them. At the tip of a cut, where the elements around a node are still connected,
/// there is no copy.
struct Division {
  Mesh mesh;
  Fixed fixed;                        ///< copies of held nodes are held, and so are nodes without an element
  std::vector<int> node_before;       ///< for each node: its number before the cuts
  std::vector<int> element_before{};  ///< for each element: its number before the cuts
  int opened = 0;                     ///< faces, including those opened before
  int lost = 0;                       ///< elements removed with pieces that nothing holds (three held nodes hold one)
};

/// `cuts`: all that were ever made in this mesh, even those that it shows already: a later cut can split a node for
/// which an earlier one was too short.
Division divide(const Mesh& mesh, const Fixed& fixed, std::span<const Cut> cuts);

/// For each new free displacement, the one of the node that was copied. Only for a division that lost no elements, in
/// which the earlier displacements have kept their numbers.
std::vector<int> twins(const Elastic& divided, const Division& division);

/// A cut that a scene has planned.
struct PlannedCut {
  enum class When : std::uint8_t {
    kTime,   ///< `value` s have gone by
    kForce,  ///< an answer's force along the normal was more than `value` N
  };
  Cut cut;
  When when;
  double value;
};

/// The effect: which cuts have been made. They are made in their order; each waits for those before it. Thread-safe:
/// no.
class Cutting {
 public:
  /// Throws std::invalid_argument that names the cut: a parallelogram without area, a time below 0, a force not above
  /// 0.
  explicit Cutting(std::vector<PlannedCut> plan);

  bool due(PlannedCut::When when, double value) const noexcept;
  std::span<const Cut> make_next();  ///< all that are made then; one must be left
  std::size_t left() const noexcept { return plan_.size() - made_.size(); }
  bool take_changed() noexcept;  ///< true when cuts were made since the last call
  std::size_t bytes() const noexcept;

 private:
  std::vector<PlannedCut> plan_;
  std::vector<Cut> made_;
  bool changed_ = false;
};

}  // namespace tendon::softbody
