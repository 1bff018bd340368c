// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "clients/softbody/fem/elastic.h"
#include "clients/softbody/touch/contact.h"
#include "clients/softbody/touch/rigid_shape.h"

namespace tendon::softbody {

struct HeldTool {  // a rigid tool in a handle
  RigidShape shape;
  Vec3 offset = Vec3::Zero();  ///< m, from the handle to the center of the tool, handle frame

  Vec3 middle(const Pose& handle) const { return handle.position + handle.turn * offset; }
  Distance distance(const Pose& handle, const Vec3& x) const;  ///< distance of a point x from the surface of the tool
  double value(const Pose& handle, const Vec3& x) const { return shape.value(in_tool(handle, x)); }
  Vec3 in_tool(const Pose& handle, const Vec3& x) const {
    return handle.turn.transpose() * (x - handle.position) - offset;
  }
};

/// A thin elastic layer on a body that is pressed by rigid tools. Contact is an energy of points on the facets. p is
/// the pose of a tool, φ is its distance (RigidShape) from a point, and each point has an area:
///
///     Ψ(u, p) = Σ area · ψ(ℓ − φ(x(u); p)),   ψ″(g) = E/ℓ · clamp(g/ε, 0, 1),   ε = ℓ/10
///
/// Where the tool would be ℓ below the surface, the pressure is about Young's modulus. There are many points on each
/// facet, so that the force has no steps if the facets are wider than the contact.
///
/// The distance between points must be smaller than the thickness of the tool; otherwise its edge slips off a row of
/// points, and energy is lost. A blade of 2.6 mm (spoon.off end on, B1 with cells of 10 mm, 3 mm deep and 3 mm across)
/// lost 81 to 88 % of the work with a distance of 1.4 mm, 3 to 4 % with 0.8 mm, and less than 0.1 % with 0.6 mm. Body
/// uses a quarter of the thickness, which is not possible if a facet is wider than 32 such distances.
///
/// With friction, points in contact are tied to the tool at the end of an answer. A tie is a tangential spring with the
/// shear modulus divided by ℓ; above µ times the pressure it slides and loses energy. During a solution, the pressure
/// and the normal of a tie are those of the last iteration (hold()), so friction has an energy too.
///
/// Thread-safe: no. Realtime-safe: no.
class Layer {
 public:
  struct Config {
    double thickness = 1e-4;  ///< ℓ, m
    double young = 0;         ///< E, Pa
    double friction = 0;      ///< µ
    double shear = 0;         ///< Pa
    double piece = 0;         ///< m, distance between points
    std::size_t tools = 1;
  };
  Layer(const Elastic& elastic, const Config& config);  ///< must outlive this; throws std::invalid_argument

  /// A tool with its pose. The pose is empty if the hand is absent.
  struct Placed {
    const HeldTool* tool;
    std::optional<Pose> handle;
  };

  struct Near {
    struct Site {
      std::size_t tool;
      int facet;
      std::vector<int> nodes;
    };
    std::vector<int> nodes;
    std::vector<Site> sites;
  };
  /// Returns the facets with a point closer to a tool than `margin` times the size of the facet.
  Near near(std::span<const Placed> tools, const VectorXd& u, double margin) const;

  using Vec6 = Eigen::Matrix<double, 6, 1>;
  using Mat6 = Eigen::Matrix<double, 6, 6>;
  struct Felt {
    Vec6 slope = Vec6::Zero();   ///< ∂Ψ/∂p: minus force and torque
    Mat6 curve = Mat6::Zero();   ///< ∂²Ψ/∂p²
    MatrixXd mixed;              ///< ∂²Ψ/∂u∂p
    double area = 0;             ///< m², in contact
    Vec3 middle = Vec3::Zero();  ///< m, center of the contact
    double spread = 0;           ///< m, radius of the contact
  };
  struct Press {
    double energy = 0;  ///< Ψ, J
    VectorXd slope;     ///< ∂Ψ/∂u, N
    MatrixXd curve;     ///< ∂²Ψ/∂u², N/m
    std::vector<Felt> felt;
  };
  enum class Order { kEnergy, kCurve, kFelt };  ///< each one includes the previous ones
  /// `places` are the positions (m) of the nodes of `near`.
  Press press(const Near& near, std::span<const Placed> tools, const Eigen::Matrix3Xd& places, Order order) const;

  Eigen::Matrix3Xd places(const Near& near, const VectorXd& u) const;  ///< of the nodes for the displacements u

  /// Sets the pressures and normals for friction.
  void hold(const Near& near, std::span<const Placed> tools, const Eigen::Matrix3Xd& places);
  /// Updates the ties after an answer. Returns the minimum and the sum of the energies (J) that the ties have lost.
  struct Dissipated {
    double least = 0;
    double sum = 0;
    int slid = 0;
  };
  Dissipated advance(const Near& near, std::span<const Placed> tools, const Eigen::Matrix3Xd& places);
  bool rubs() const noexcept { return config_.friction > 0; }

  /// The minimum distance between a tool and the body. Infinite if the hand is absent.
  struct Gap {
    double value;
    Vec3 normal;
  };
  Gap gap(const Placed& tool, const VectorXd& u) const;

  double thickness() const noexcept { return config_.thickness; }
  double least_facet() const noexcept { return least_facet_; }  ///< m, root of the area
  std::size_t bytes() const noexcept;

 private:
  struct FacetOfPoints {
    std::vector<int> nodes;
    double size;   ///< m, root of the area
    double reach;  ///< m, from the center to the farthest node at rest
    std::size_t first;
    std::size_t count;
  };
  using Shares = Eigen::Matrix<double, 1, Eigen::Dynamic, 1, 1, 9>;
  struct PointOfFacet {
    double area;  ///< m², at rest
    Shares shares;
  };
  /// A group of points, which is skipped if it is far from the tool.
  struct Bunch {
    std::size_t first;
    std::size_t count;
    Shares middle;
    double spread;  ///< upper bound of the points' distance from the center / FacetOfPoints::reach, in any shape
  };
  struct Tie {
    bool tied = false;
    Vec3 at = Vec3::Zero();      ///< m, handle frame
    double most = 0;             ///< Pa, maximum force per area
    Vec3 normal = Vec3::Zero();  ///< of the tool, body frame
  };
  double pressure(double overlap, double& stiffness, double& energy) const;
  void add_bunch(FacetOfPoints& facet, std::size_t first);
  Eigen::Matrix3Xd corners(const FacetOfPoints& facet, const VectorXd& u) const;
  bool tied(const Bunch& bunch, std::size_t tool) const;
  template <class Visit>
  void each_point(const Near& near, std::span<const Placed> tools, const Eigen::Matrix3Xd& places,
                  const Visit& visit) const;
  Vec3 stretch(const Tie& tie, const Pose& handle, const Vec3& x) const;

  const Elastic& elastic_;
  Config config_;
  std::vector<FacetOfPoints> facets_;
  std::vector<Bunch> bunches_;
  std::vector<PointOfFacet> points_;
  std::vector<std::vector<Tie>> ties_;  ///< by tool and point
  double least_facet_ = 0;
};

}  // namespace tendon::softbody
