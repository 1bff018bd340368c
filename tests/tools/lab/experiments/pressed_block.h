// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <tuple>
#include <vector>

#include "clients/softbody/body.h"
#include "clients/softbody/fem/material.h"
#include "clients/softbody/models/linear.h"

namespace tendon::lab {

/// A block that is clamped below, and a patch of its top that is pressed: what `tendon-lab accuracy` asks all models.
/// As it stands here it is B1 of clients/softbody/README.md.
struct PressedBlock {
  softbody::Vec3 size{0.1, 0.1, 0.05};  ///< m
  softbody::Material material{.young = 1e4, .poisson = 0.45};
  double patch_radius = 0.02;                            ///< m
  softbody::Vec2 patch_centre = softbody::Vec2::Zero();  ///< m, from the middle of the top
  std::array<double, 2> loads{0.3, 1};                   ///< N: one at which strains are small, and one that is hard

  /// Throws std::invalid_argument that names the option.
  void check() const;
  /// m, of the patch's middle: the body stands on z = 0, its middle above the origin.
  softbody::Vec3 touch_point() const { return {patch_centre.x(), patch_centre.y(), size.z()}; }
};

/// How stiff a body is under a load.
struct Stiffness {
  double secant = 0;   ///< N/m, load over mean depth of the patch
  double tangent = 0;  ///< N/m
};

/// Where a tool is, and what pushes it back.
struct Touched {
  softbody::Vec3 tool;
  softbody::Vec3 force;
};

/// What a pressed block really does: the answers that models are measured against, found in the same run on meshes of
/// quadratic hexahedra that are finest below the patch.
///
/// The truth is a Neo-Hookean solid. Its stiffness is that of the linear one on the fine mesh, times the ratio of both
/// on a mesh that Newton's method can still be paid for on:
///
///     K = K_linear(a/cells) · K_neo-Hookean(a/cells_for_large)/K_linear(a/cells_for_large)
///
/// because the ratio hardly depends on the mesh. `uncertainty()` says what both factors still change by from the next
/// coarser mesh. It computes only what is asked for. Thread-safe: no.
class Truth {
 public:
  /// Cells to a patch's radius, below the patch, 1.5 or more. As they stand here B1 takes half a minute and 0.3 GB.
  struct Config {
    double cells = 4;
    double cells_for_large = 2;  ///< … where Newton's method has to be paid for
  };
  Truth(const PressedBlock& block, const Config& config);
  ~Truth();
  Truth(const Truth&) = delete;
  Truth& operator=(const Truth&) = delete;

  const PressedBlock& block() const noexcept { return block_; }

  /// Under block().loads[load].
  Stiffness stiffness(std::size_t load);

  /// What the law `law` alone would make of it on an endlessly fine mesh: the truth and a model's own error. Empty when
  /// that body collapses under the load.
  std::optional<Stiffness> limit(softbody::Law law, std::size_t load) { return limit(law, block_.material, load); }
  /// The same of a body of another material.
  std::optional<Stiffness> limit(softbody::Law law, const softbody::Material& material, std::size_t load);

  double uncertainty();  ///< relative, of the stiffness under the second load

  /// The force on a tool, within a quarter of the patch's radius of the patch's middle. The linear body's, times a
  /// factor that is exact for the two loads in the middle: 1 + αF + βF².
  softbody::Vec3 force(const softbody::Vec3& tool);

  /// A tool that presses as deep as the first load goes, slides by a quarter of the patch's radius and comes off again,
  /// looked at every `kScriptInterval`.
  static constexpr double kScriptInterval = 0.03;  ///< s
  const std::vector<Touched>& script();

 private:
  struct Fine;
  struct Factor {
    double alpha;  ///< 1/N
    double beta;   ///< 1/N²
  };
  const Factor& factor();
  using AtLoads = std::array<std::optional<Stiffness>, 2>;
  /// Of K to the linear one, empty from where it collapses on.
  AtLoads ratios(softbody::Law law, const softbody::Material& material, double cells) const;

  PressedBlock block_;
  Config config_;
  std::unique_ptr<Fine> fine_;
  double linear_ = 0;                                                    ///< N/m
  std::map<std::tuple<softbody::Law, double, double>, AtLoads> limits_;  ///< by law, Young's modulus, Poisson's ratio
  std::optional<double> uncertainty_;
  std::optional<Factor> factor_;
  std::vector<Touched> script_;
};

}  // namespace tendon::lab
