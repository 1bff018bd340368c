// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "clients/softbody/fem/elastic.h"

namespace tendon::softbody {

/// Where a body comes apart: the parallelogram corner + s·`along` + t·`deep`, 0 ≤ s, t ≤ 1; m, the body's frame, as it
/// lies at rest.
struct Cut {
  Vec3 corner;
  Vec3 along;
  Vec3 deep;
};

/// A mesh after cuts. Its elements are those that there were, so that the cut runs along their faces: it opens each
/// face between two elements whose middles the parallelogram lies between. Nodes keep their numbers, and the copies on
/// a cut's other side come behind them; at the tip of a cut, where the elements around a node still hang together,
/// there is none.
struct Division {
  Mesh mesh;
  Fixed fixed;                   ///< copies of held nodes are held, and so are nodes that no element has any more
  std::vector<int> node_before;  ///< for each node: which it was
  int opened = 0;                ///< faces, those included that were opened before
  int lost = 0;                  ///< elements of pieces that nothing holds (three held nodes do): they are taken out
};

/// `cuts`: all that were ever made in this mesh, also those that it shows already: where a cut was too short to part a
/// node, the next to it can.
Division divide(const Mesh& mesh, const Fixed& fixed, std::span<const Cut> cuts);

/// For each free displacement that is there for the first time, that of whose node it is a copy. Of a division without
/// losses, where those that there were have kept their numbers.
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

/// The effect: which cuts have been made, in their order; each waits for those before it. Thread-safe: no.
class Cutting {
 public:
  /// Throws std::invalid_argument that names the cut: a parallelogram without area, a time below 0, a force not above
  /// 0.
  explicit Cutting(std::vector<PlannedCut> plan);

  bool due(PlannedCut::When when, double value) const noexcept;
  std::span<const Cut> make_next();  ///< all that are made then; one must be left
  std::size_t left() const noexcept { return plan_.size() - made_.size(); }
  bool take_changed() noexcept;  ///< whether cuts were made since this was asked last
  std::size_t bytes() const noexcept;

 private:
  std::vector<PlannedCut> plan_;
  std::vector<Cut> made_;
  bool changed_ = false;
};

}  // namespace tendon::softbody
