// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/touch/layer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "protocol/expect.h"

namespace tendon::softbody {
namespace {

constexpr double kOnset = 0.1;  // relative to the thickness
constexpr int kLeastPieces = 4;
constexpr int kMostPieces = 32;
constexpr int kBunch = 4;  // points along each side of a bunch

constexpr double kGrown = 1.5;  ///< facet may be larger than at rest by this factor

Mat3 cross(const Vec3& v) { return (Mat3() << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0).finished(); }

Eigen::Matrix3Xd places_of(const Mesh& mesh, const std::vector<int>& nodes, const VectorXd& u) {
  Eigen::Matrix3Xd all(3, static_cast<Eigen::Index>(nodes.size()));
  for (Eigen::Index i = 0; i < all.cols(); ++i) {
    const int node = nodes[static_cast<std::size_t>(i)];
    all.col(i) = mesh.nodes[at(node)] + u.segment<3>(3 * node);
  }
  return all;
}

double reach_of(const Eigen::Matrix3Xd& nodes) {
  return (nodes.colwise() - nodes.rowwise().mean()).colwise().norm().maxCoeff();
}

}  // namespace

Distance HeldTool::distance(const Pose& handle, const Vec3& x) const {
  Distance found = shape.distance(in_tool(handle, x));
  found.gradient = handle.turn * found.gradient;
  found.curvature = handle.turn * found.curvature * handle.turn.transpose();
  return found;
}

Layer::Layer(const Elastic& elastic, const Config& config) : elastic_(elastic), config_(config) {
  expect_above_zero(config.thickness, "thickness");
  expect_above_zero(config.young, "young");
  expect_not_negative(config.friction, "friction");
  if (rubs()) expect_above_zero(config.shear, "shear");
  expect_above_zero(config.piece, "piece");
  const Mesh& mesh = elastic.mesh();
  least_facet_ = std::numeric_limits<double>::infinity();
  for (const Facet& facet : surface(mesh)) {
    FacetOfPoints made{.nodes = nodes_on(mesh, facet), .size = 0, .reach = 0, .first = bunches_.size(), .count = 0};
    const bool moves = std::ranges::any_of(made.nodes, [&](int node) {
      return elastic.free_of(3 * node) >= 0 || elastic.free_of(3 * node + 1) >= 0 || elastic.free_of(3 * node + 2) >= 0;
    });
    if (!moves) continue;
    const Eigen::Matrix3Xd at_rest = corners(made, VectorXd::Zero(elastic.size()));
    made.reach = reach_of(at_rest);
    const Face& face = faces(mesh.shape)[at(facet.face)];
    const auto element = mesh.element(facet.element);
    double area = 0;
    const auto add = [&](double s, double t, double reference_area) {
      const ShapeValues shape = shape_at(mesh.shape, face.origin + s * face.along_s + t * face.along_t);
      Mat3 jacobian = Mat3::Zero();
      PointOfFacet& point = points_.emplace_back();
      point.shares.resize(static_cast<Eigen::Index>(made.nodes.size()));
      for (int i = 0; i < shape.value.size(); ++i) {
        jacobian += mesh.nodes[at(element[at(i)])] * shape.gradient.col(i).transpose();
        const auto found = std::ranges::find(made.nodes, element[at(i)]);
        if (found != made.nodes.end()) point.shares[found - made.nodes.begin()] = shape.value[i];
      }
      point.area = reference_area * (jacobian * face.along_s).cross(jacobian * face.along_t).norm();
      area += point.area;
    };
    const bool triangle = mesh.shape == Shape::kTet4;
    const int cuts =
        std::clamp(static_cast<int>(std::ceil(1.4 * made.reach / config.piece)), kLeastPieces, kMostPieces);
    const double step = (triangle ? 1.0 : 2.0) / cuts;
    const auto add_cell = [&](int i, int j) {
      if (!triangle) return add((i + 0.5) * step - 1, (j + 0.5) * step - 1, step * step);
      if (i + j < cuts) add((i + 1 / 3.0) * step, (j + 1 / 3.0) * step, 0.5 * step * step);
      if (i + j + 1 < cuts) add((i + 2 / 3.0) * step, (j + 2 / 3.0) * step, 0.5 * step * step);
    };
    for (int i = 0; i < cuts; i += kBunch) {
      for (int j = 0; j < cuts; j += kBunch) {
        const std::size_t first = points_.size();
        for (int k = i; k < std::min(i + kBunch, cuts); ++k) {
          for (int l = j; l < std::min(j + kBunch, cuts); ++l) add_cell(k, l);
        }
        add_bunch(made, first);
      }
    }
    made.size = std::sqrt(area);
    least_facet_ = std::min(least_facet_, made.size);
    facets_.push_back(std::move(made));
  }
  if (rubs()) ties_.assign(config.tools, std::vector<Tie>(points_.size()));
}

void Layer::add_bunch(FacetOfPoints& facet, std::size_t first) {
  if (first == points_.size()) return;
  Bunch bunch{.first = first, .count = points_.size() - first, .middle = points_[first].shares, .spread = 0};
  for (std::size_t p = first + 1; p < points_.size(); ++p) bunch.middle += points_[p].shares;
  bunch.middle /= static_cast<double>(bunch.count);
  for (std::size_t p = first; p < points_.size(); ++p) {
    bunch.spread = std::max(bunch.spread, (points_[p].shares - bunch.middle).lpNorm<1>());
  }
  bunches_.push_back(std::move(bunch));
  ++facet.count;
}

Eigen::Matrix3Xd Layer::corners(const FacetOfPoints& facet, const VectorXd& u) const {
  return places_of(elastic_.mesh(), facet.nodes, u);
}

double Layer::pressure(double overlap, double& stiffness, double& energy) const {
  if (overlap <= 0) {
    stiffness = energy = 0;
    return 0;
  }
  const double c = config_.young / config_.thickness;
  const double onset = kOnset * config_.thickness;
  if (overlap < onset) {
    stiffness = c * overlap / onset;
    energy = stiffness * overlap * overlap / 6;
    return stiffness * overlap / 2;
  }
  const double past = overlap - onset / 2;
  stiffness = c;
  energy = c * (past * past / 2 + onset * onset / 24);
  return c * past;
}

Layer::Near Layer::near(std::span<const Placed> tools, const VectorXd& u, double margin) const {
  Near found;
  std::vector<bool> is_near(elastic_.mesh().nodes.size());
  for (std::size_t f = 0; f < facets_.size(); ++f) {
    const FacetOfPoints& facet = facets_[f];
    const Eigen::Matrix3Xd places = corners(facet, u);
    const Vec3 middle = places.rowwise().mean();
    const double apart = config_.thickness + margin * facet.size;
    for (std::size_t t = 0; t < tools.size(); ++t) {
      if (!tools[t].handle) continue;
      const HeldTool& tool = *tools[t].tool;
      const double far = tool.shape.reach() + kGrown * facet.reach + apart;
      if ((middle - tool.middle(*tools[t].handle)).squaredNorm() > far * far) continue;
      if (tool.value(*tools[t].handle, middle) > apart + kGrown * facet.reach) continue;
      const double reach = reach_of(places);
      bool close = false;
      for (std::size_t b = facet.first; b < facet.first + facet.count && !close; ++b) {
        const Bunch& bunch = bunches_[b];
        const double wide = bunch.spread * reach;
        if (tool.value(*tools[t].handle, places * bunch.middle.transpose()) >= apart + wide) continue;
        for (std::size_t p = bunch.first; p < bunch.first + bunch.count && !close; ++p) {
          close = tool.value(*tools[t].handle, places * points_[p].shares.transpose()) < apart;
        }
      }
      if (!close) continue;
      found.sites.push_back({t, static_cast<int>(f), {}});
      for (const int node : facet.nodes) is_near[at(node)] = true;
    }
  }
  std::vector<int> index(is_near.size(), -1);
  for (std::size_t i = 0; i < is_near.size(); ++i) {
    if (!is_near[i]) continue;
    index[i] = static_cast<int>(found.nodes.size());
    found.nodes.push_back(static_cast<int>(i));
  }
  for (Near::Site& site : found.sites) {
    for (const int node : facets_[at(site.facet)].nodes) site.nodes.push_back(index[at(node)]);
  }
  return found;
}

Eigen::Matrix3Xd Layer::places(const Near& near, const VectorXd& u) const {
  return places_of(elastic_.mesh(), near.nodes, u);
}

bool Layer::tied(const Bunch& bunch, std::size_t tool) const {
  return std::ranges::any_of(std::span(ties_[tool]).subspan(bunch.first, bunch.count), &Tie::tied);
}

/// Calls visit(site, point, x) for all points in the layer or with a tie.
template <class Visit>
void Layer::each_point(const Near& near, std::span<const Placed> tools, const Eigen::Matrix3Xd& places,
                       const Visit& visit) const {
  Eigen::Matrix3Xd nodes;
  for (const Near::Site& site : near.sites) {
    const FacetOfPoints& facet = facets_[at(site.facet)];
    const Placed& placed = tools[site.tool];
    nodes = places(Eigen::all, site.nodes);
    const double reach = reach_of(nodes);
    for (std::size_t b = facet.first; b < facet.first + facet.count; ++b) {
      const Bunch& bunch = bunches_[b];
      const double outside = config_.thickness + bunch.spread * reach;
      const bool far = placed.tool->value(*placed.handle, nodes * bunch.middle.transpose()) >= outside;
      if (far && !(rubs() && tied(bunch, site.tool))) continue;
      for (std::size_t p = bunch.first; p < bunch.first + bunch.count; ++p) {
        visit(site, p, nodes * points_[p].shares.transpose());
      }
    }
  }
}

Vec3 Layer::stretch(const Tie& tie, const Pose& handle, const Vec3& x) const {
  const Vec3 away = x - handle.position - handle.turn * tie.at;
  return away - tie.normal.dot(away) * tie.normal;
}

Layer::Press Layer::press(const Near& near, std::span<const Placed> tools, const Eigen::Matrix3Xd& places,
                          Order order) const {
  const auto size = 3 * static_cast<Eigen::Index>(near.nodes.size());
  Press all;
  all.slope = VectorXd::Zero(size);
  if (order != Order::kEnergy) all.curve = MatrixXd::Zero(size, size);
  if (order == Order::kFelt) {
    all.felt.resize(tools.size());
    for (Felt& felt : all.felt) felt.mixed = MatrixXd::Zero(size, 6);
  }
  std::vector<std::vector<Vec3>> pressed(tools.size());
  each_point(near, tools, places, [&](const Near::Site& site, std::size_t p, const Vec3& x) {
    const Placed& placed = tools[site.tool];
    const PointOfFacet& point = points_[p];
    const Tie* tie = rubs() && ties_[site.tool][p].most > 0 ? &ties_[site.tool][p] : nullptr;
    if (tie == nullptr && placed.tool->value(*placed.handle, x) >= config_.thickness) return;
    const Distance d = placed.tool->distance(*placed.handle, x);
    double stiffness = 0;
    double energy = 0;
    const double push = pressure(config_.thickness - d.value, stiffness, energy);
    Vec3 slope = -push * d.gradient;  // per m²
    Mat3 curve = stiffness * d.gradient * d.gradient.transpose() - push * d.curvature;
    Vec3 drag = Vec3::Zero();
    if (tie != nullptr) {
      // Huber's energy of a spring with a maximum force.
      const double c = config_.shear / config_.thickness;
      const Vec3 stretched = stretch(*tie, *placed.handle, x);
      const double length = stretched.norm();
      const Mat3 along = Mat3::Identity() - tie->normal * tie->normal.transpose();
      if (c * length <= tie->most) {
        energy += c * length * length / 2;
        drag = c * stretched;
        curve += c * along;
      } else {
        energy += tie->most * (length - tie->most / (2 * c));
        const Vec3 way = stretched / length;
        drag = tie->most * way;
        curve += tie->most / length * (along - way * way.transpose());
      }
      slope += drag;
    }
    all.energy += point.area * energy;
    slope *= point.area;
    for (std::size_t i = 0; i < site.nodes.size(); ++i) {
      all.slope.segment<3>(3 * site.nodes[i]) += point.shares[static_cast<Eigen::Index>(i)] * slope;
    }
    if (order == Order::kEnergy) return;
    curve *= point.area;
    for (std::size_t j = 0; j < site.nodes.size(); ++j) {
      const Mat3 column = point.shares[static_cast<Eigen::Index>(j)] * curve;
      for (std::size_t i = 0; i < site.nodes.size(); ++i) {
        all.curve.block<3, 3>(3 * site.nodes[i], 3 * site.nodes[j]) +=
            point.shares[static_cast<Eigen::Index>(i)] * column;
      }
    }
    if (order == Order::kCurve) return;
    // The tool moves by δt and δθ about the handle: relative to it x moves by w = δx − δt + r̂ δθ, to first order.
    Felt& felt = all.felt[site.tool];
    const Vec3 r = x - placed.handle->position;
    const Mat3 lever = cross(r);
    Eigen::Matrix<double, 3, 6> w;
    w << -Mat3::Identity(), lever;
    const Vec3 n = point.area * -push * d.gradient;
    felt.slope.head<3>() -= slope;
    felt.slope.tail<3>() -= r.cross(slope);
    felt.curve += w.transpose() * curve * w;
    const Mat3 turned = n * r.transpose();
    felt.curve.bottomRightCorner<3, 3>() += (turned + turned.transpose()) / 2 - n.dot(r) * Mat3::Identity();
    felt.curve.topRightCorner<3, 3>() += cross(n);
    felt.curve.bottomLeftCorner<3, 3>() -= cross(n);
    Eigen::Matrix<double, 3, 6> mixed = curve * w;
    mixed.rightCols<3>() -= cross(n);
    for (std::size_t i = 0; i < site.nodes.size(); ++i) {
      felt.mixed.middleRows<3>(3 * site.nodes[i]) += point.shares[static_cast<Eigen::Index>(i)] * mixed;
    }
    if (push == 0) return;
    felt.area += point.area;
    felt.middle += point.area * x;
    pressed[site.tool].push_back(x);
  });
  for (std::size_t t = 0; t < all.felt.size(); ++t) {
    Felt& felt = all.felt[t];
    if (felt.area > 0) felt.middle /= felt.area;
    for (const Vec3& x : pressed[t]) felt.spread = std::max(felt.spread, (x - felt.middle).norm());
  }
  return all;
}

void Layer::hold(const Near& near, std::span<const Placed> tools, const Eigen::Matrix3Xd& places) {
  each_point(near, tools, places, [&](const Near::Site& site, std::size_t p, const Vec3& x) {
    Tie& tie = ties_[site.tool][p];
    if (!tie.tied) return;
    const Distance d = tools[site.tool].tool->distance(*tools[site.tool].handle, x);
    double stiffness = 0;
    double energy = 0;
    tie.most = config_.friction * pressure(config_.thickness - d.value, stiffness, energy) * d.gradient.norm();
    tie.normal = d.gradient.normalized();
  });
}

Layer::Dissipated Layer::advance(const Near& near, std::span<const Placed> tools, const Eigen::Matrix3Xd& places) {
  Dissipated lost;
  std::vector<std::vector<bool>> pressed(ties_.size(), std::vector<bool>(points_.size()));
  hold(near, tools, places);
  const double c = config_.shear / config_.thickness;
  each_point(near, tools, places, [&](const Near::Site& site, std::size_t p, const Vec3& x) {
    const Pose& handle = *tools[site.tool].handle;
    Tie& tie = ties_[site.tool][p];
    if (tools[site.tool].tool->value(handle, x) >= config_.thickness) return;
    const Distance d = tools[site.tool].tool->distance(handle, x);
    double stiffness = 0;
    double energy = 0;
    const double push = pressure(config_.thickness - d.value, stiffness, energy);
    pressed[site.tool][p] = true;
    Vec3 stretched = Vec3::Zero();
    if (tie.tied) {
      stretched = stretch(tie, handle, x);
      const double length = stretched.norm();
      const double most = tie.most / c;
      if (length > most) {
        const double gone = points_[p].area * tie.most * (length - most);
        lost.least = std::min(lost.least, gone);
        lost.sum += gone;
        ++lost.slid;
        stretched *= most / length;
      }
    }
    tie = {true, handle.turn.transpose() * (x - stretched - handle.position),
           config_.friction * push * d.gradient.norm(), d.gradient.normalized()};
  });
  for (std::size_t t = 0; t < ties_.size(); ++t) {
    for (std::size_t p = 0; p < points_.size(); ++p) {
      if (!pressed[t][p]) ties_[t][p] = {};
    }
  }
  return lost;
}

Layer::Gap Layer::gap(const Placed& placed, const VectorXd& u) const {
  Gap least{std::numeric_limits<double>::infinity(), Vec3::Zero()};
  if (!placed.handle) return least;
  Vec3 nearest = Vec3::Zero();
  for (const FacetOfPoints& facet : facets_) {
    const Eigen::Matrix3Xd places = corners(facet, u);
    if (placed.tool->value(*placed.handle, places.rowwise().mean()) > least.value + kGrown * facet.reach) continue;
    const double reach = reach_of(places);
    for (std::size_t b = facet.first; b < facet.first + facet.count; ++b) {
      const Bunch& bunch = bunches_[b];
      const double wide = bunch.spread * reach;
      if (placed.tool->value(*placed.handle, places * bunch.middle.transpose()) > least.value + wide) continue;
      for (std::size_t p = bunch.first; p < bunch.first + bunch.count; ++p) {
        const Vec3 x = places * points_[p].shares.transpose();
        const double value = placed.tool->value(*placed.handle, x);
        if (!(value < least.value)) continue;
        least.value = value;
        nearest = x;
      }
    }
  }
  if (std::isfinite(least.value)) least.normal = -placed.tool->distance(*placed.handle, nearest).gradient.normalized();
  return least;
}

std::size_t Layer::bytes() const noexcept {
  std::size_t sum = sizeof *this + points_.size() * sizeof(PointOfFacet) + bunches_.size() * sizeof(Bunch);
  for (const FacetOfPoints& facet : facets_) sum += sizeof facet + facet.nodes.size() * sizeof(int);
  for (const auto& ties : ties_) sum += ties.size() * sizeof(Tie);
  return sum;
}

}  // namespace tendon::softbody
