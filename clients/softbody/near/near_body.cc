// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/near_body.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>

#include "clients/softbody/fem/sparse.h"

namespace tendon::softbody {
namespace {

constexpr int kLoadsPerMode = 2;  ///< number of random loads for each mode
constexpr double kLeft = 1e-3;    ///< part of the motion of Γ (RMS) that may be neglected

constexpr Eigen::Index kLoadsAtOnce = 8;

/// left_out() evaluates this number of elements, and all others at the distance of the last one, so that rounding does
/// not choose among them.
constexpr std::size_t kWatched = 96;
constexpr double kAsFar = 1 + 1e-9;

Vec3 middle_of(const Mesh& mesh, int element) {
  Vec3 sum = Vec3::Zero();
  for (const int node : mesh.element(element)) sum += mesh.nodes[at(node)];
  return sum / static_cast<double>(mesh.element(element).size());
}

class Noise {  // random numbers between −1 and 1, always the same
 public:
  double next() { return static_cast<double>(random_() >> 11U) * 0x1p-52 - 1; }

 private:
  std::mt19937_64 random_{1};
};

SymmetricMatrix stiffness_at(const Solid& solid, const VectorXd& u) {
  SymmetricMatrix stiffness = solid.pattern();
  solid.stiffness(u, Elastic::Curvature::kExact, stiffness);
  return stiffness;
}

VectorXd of_nodes(const VectorXd& all, const std::vector<int>& nodes) {
  VectorXd own(3 * static_cast<Eigen::Index>(nodes.size()));
  for (Eigen::Index i = 0; i < own.size(); ++i) own[i] = all[3 * nodes[static_cast<std::size_t>(i / 3)] + i % 3];
  return own;
}

}  // namespace

NearBody::Linear::Linear(const Solid& solid, VectorXd u)
    : about(std::move(u)), forces(solid.to_free(solid.forces(about).force)), stiffness(stiffness_at(solid, about)) {}

double NearBody::Linear::excess(const Solid& solid, const VectorXd& moved, const VectorXd& along) const {
  const VectorXd by_law = solid.to_free(solid.forces(about + moved).force) - forces;
  return solid.to_free(along).dot(by_law - stiffness.times(solid.to_free(moved)));
}

struct NearBody::Parts {
  Solid part;
  Watched watched;
  std::vector<int> rim{};
  std::vector<int> rim_nodes{};
  std::vector<int> own_of{};
  MatrixXd modes{};
  MatrixXd far{};
  VectorXd held{};
  VectorXd on_rim{};
  VectorXd beginning{};
  double about_depth = 0;

  Fixed fixed() const {
    Fixed fixed = part.fixed();
    for (const int component : rim) fixed[at(component)] = true;
    return fixed;
  }
};

Pieces NearBody::make(const Solid& whole, const Factor& factor, Config config, std::unique_ptr<NearBody>& made) {
  made.reset();
  const Mesh& mesh = whole.mesh();
  std::vector<int> near;
  std::vector<std::pair<double, int>> far;
  std::vector<bool> touches_far(mesh.nodes.size());
  std::vector<bool> reached(mesh.nodes.size());
  for (const int node : config.pressed) reached[at(node)] = true;
  for (int e = 0; e < mesh.element_count(); ++e) {
    const double distance = (middle_of(mesh, e) - config.middle).norm();
    if (distance <= kAsFar * config.radius ||
        std::ranges::any_of(mesh.element(e), [&](int node) { return reached[at(node)]; })) {
      near.push_back(e);
    } else {
      far.emplace_back(distance, e);
      for (const int node : mesh.element(e)) touches_far[at(node)] = true;
    }
  }
  if (far.empty()) co_return;
  std::ranges::sort(far);
  std::vector<int> watched;
  const double farthest = kAsFar * far[std::min(far.size(), kWatched) - 1].first;
  for (const auto& [distance, e] : far) {
    if (distance <= farthest) watched.push_back(e);
  }
  std::vector<int> nodes;
  std::vector<int> watched_nodes;
  Solid near_part = Solid::part_of(whole, near, nodes);
  co_await kPieceDone;
  Solid watched_part = Solid::part_of(whole, watched, watched_nodes);
  const VectorXd about = config.about.size() > 0 ? config.about : VectorXd::Zero(whole.size());
  Parts parts{
      .part = std::move(near_part), .watched = {.part = std::move(watched_part)}, .about_depth = config.about_depth};
  const Solid& part = parts.part;
  const VectorXd about_near = of_nodes(about, nodes);
  co_await kPieceDone;

  parts.own_of.assign(mesh.nodes.size(), -1);
  std::vector<int> whole_of;  // free numbers in the whole body
  std::vector<int> rim_free;  // free numbers in the part
  std::vector<double> weight;
  for (int i = 0; i < static_cast<int>(nodes.size()); ++i) {
    const int node = nodes[at(i)];
    const bool on_rim = touches_far[at(node)];
    if (on_rim) parts.rim_nodes.push_back(i);
    if (!on_rim) parts.own_of[at(node)] = i;
    const double closeness = std::max(0.0, 1 - (mesh.nodes[at(node)] - config.middle).norm() / config.radius);
    for (int c = 0; c < 3; ++c) {
      const int free = part.free_of(3 * i + c);
      if (free < 0) continue;
      whole_of.push_back(whole.free_of(3 * node + c));
      weight.push_back(closeness * closeness);
      if (!on_rim) continue;
      parts.rim.push_back(3 * i + c);
      rim_free.push_back(free);
    }
  }
  const auto interface = static_cast<Eigen::Index>(rim_free.size());
  const bool exact = config.modes >= interface;
  const Eigen::Index loads_count = exact ? interface : kLoadsPerMode * config.modes;
  MatrixXd loads = MatrixXd::Zero(whole.free_count(), loads_count + 1);
  Noise noise;
  for (Eigen::Index j = 0; exact && j < loads_count; ++j)
    loads(whole_of[at(rim_free[static_cast<std::size_t>(j)])], j) = 1;
  for (std::size_t i = 0; !exact && i < whole_of.size(); ++i) {
    for (Eigen::Index j = 0; j < loads_count; ++j) loads(whole_of[i], j) = weight[i] * noise.next();
  }
  loads.col(loads_count) = config.press;
  const Linear near_field(part, about_near);
  const VectorXd whole_forces = whole.to_free(whole.forces(about).force);
  VectorXd by_far(interface);
  for (Eigen::Index i = 0; i < interface; ++i) {
    const int free = rim_free[static_cast<std::size_t>(i)];
    by_far[i] = whole_forces[whole_of[at(free)]] - near_field.forces[free];
  }
  co_await kPieceDone;

  MatrixXd shapes(loads.rows(), loads.cols());
  // The forces of the far field on Γ are the loads minus the forces of the near field.
  MatrixXd traces(interface, loads_count);
  MatrixXd forces(interface, loads_count);
  VectorXd local(part.free_count());
  for (Eigen::Index first = 0; first < loads.cols(); first += kLoadsAtOnce) {
    const Eigen::Index count = std::min(kLoadsAtOnce, loads.cols() - first);
    shapes.middleCols(first, count) = factor.solve(loads.middleCols(first, count));
    for (Eigen::Index j = first; j < std::min(first + count, loads_count); ++j) {
      for (int i = 0; i < part.free_count(); ++i) local[i] = shapes(whole_of[at(i)], j);
      const VectorXd by_near = near_field.stiffness.times(local);
      for (Eigen::Index i = 0; i < interface; ++i) {
        const int free = rim_free[static_cast<std::size_t>(i)];
        traces(i, j) = local[free];
        forces(i, j) = loads(whole_of[at(free)], j) - by_near[free];
      }
    }
    co_await kPieceDone;
  }
  const Eigensystem parts_of_traces = eigensystem(traces.transpose() * traces);
  const VectorXd& squares = parts_of_traces.values;
  Eigen::Index count = loads_count;
  double left = 0;
  while (!exact && count > 1 &&
         (count > config.modes || left + squares[loads_count - count] <= kLeft * kLeft * squares.sum())) {
    left += std::max(0.0, squares[loads_count - count]);
    --count;
  }
  const MatrixXd mix =
      parts_of_traces.vectors.rightCols(count) * squares.tail(count).cwiseSqrt().cwiseInverse().asDiagonal();
  parts.modes = traces * mix;
  const MatrixXd far_forces = parts.modes.transpose() * forces * mix;
  parts.far = (far_forces + far_forces.transpose()) / 2;
  parts.held = parts.modes.transpose() * by_far;
  parts.on_rim.resize(interface);
  for (Eigen::Index i = 0; i < interface; ++i) parts.on_rim[i] = about_near[parts.rim[static_cast<std::size_t>(i)]];
  parts.beginning.resize(about_near.size() + count);
  parts.beginning << about_near, VectorXd::Zero(count);

  co_await kPieceDone;

  Watched& sentinels = parts.watched;
  sentinels.linear = Linear(sentinels.part, of_nodes(about, watched_nodes));
  sentinels.followed = MatrixXd::Zero(sentinels.part.size(), count);
  for (int i = 0; i < sentinels.part.size(); ++i) {
    const int free = whole.free_of(3 * watched_nodes[at(i / 3)] + i % 3);
    if (free >= 0) sentinels.followed.row(i) = shapes.row(free).head(loads_count) * mix;
  }
  VectorXd pressed = VectorXd::Zero(whole.size());
  const double unit = 0.1 * config.radius / shapes.col(loads_count).lpNorm<Eigen::Infinity>();
  whole.add_free(unit * shapes.col(loads_count), pressed);
  const VectorXd pressed_near = of_nodes(pressed, nodes);
  const VectorXd pressed_watched = of_nodes(pressed, watched_nodes);
  const VectorXd added = whole.to_free(whole.forces(about + pressed).force) - whole_forces - unit * config.press;
  const double all = whole.to_free(pressed).dot(added) - near_field.excess(part, pressed_near, pressed_near);
  const double of_sentinels = sentinels.linear.excess(sentinels.part, pressed_watched, pressed_watched);
  sentinels.share = std::clamp(of_sentinels / all, 0.25, 1.0);
  co_await kPieceDone;
  made.reset(new NearBody(std::move(parts)));
}

NearBody::NearBody(Parts parts)
    : Elastic(parts.part.mesh(), parts.fixed(),
              {.count = static_cast<int>(parts.modes.cols()), .rim = parts.rim_nodes}),
      part_(std::move(parts.part)),
      rim_(std::move(parts.rim)),
      modes_(std::move(parts.modes)),
      far_(std::move(parts.far)),
      held_(std::move(parts.held)),
      on_rim_(std::move(parts.on_rim)),
      beginning_(std::move(parts.beginning)),
      about_depth_(parts.about_depth),
      own_of_(std::move(parts.own_of)),
      watched_(std::move(parts.watched)) {}

VectorXd NearBody::placed(const VectorXd& u) const {
  VectorXd all = u.head(part_.size());
  const VectorXd on_rim = on_rim_ + modes_ * u.tail(modes());
  for (std::size_t i = 0; i < rim_.size(); ++i) all[rim_[i]] = on_rim[static_cast<Eigen::Index>(i)];
  return all;
}

Elastic::Forces NearBody::forces(const VectorXd& u) const {
  Forces near = part_.forces(placed(u));
  VectorXd on_rim(interface());
  for (std::size_t i = 0; i < rim_.size(); ++i) on_rim[static_cast<Eigen::Index>(i)] = near.force[rim_[i]];
  const auto y = u.tail(modes());
  const VectorXd of_far = far_ * y;
  Forces all{near.energy + held_.dot(y) + y.dot(of_far) / 2, VectorXd(size())};
  all.force << near.force, modes_.transpose() * on_rim + held_ + of_far;
  return all;
}

void NearBody::stiffness(const VectorXd& u, Curvature curvature, SymmetricMatrix& to) const {
  SymmetricMatrix near = part_.pattern();
  part_.stiffness(placed(u), curvature, near);
  // The index of each free component on Γ, and its free number in this body.
  std::vector<int> on_rim(at(part_.free_count()), -1);
  for (std::size_t i = 0; i < rim_.size(); ++i) on_rim[at(part_.free_of(rim_[i]))] = static_cast<int>(i);
  std::vector<int> own(at(part_.free_count()), -1);
  for (int i = 0; i < part_.size(); ++i) {
    if (part_.free_of(i) >= 0) own[at(part_.free_of(i))] = free_of(i);
  }
  const int inner = free_count() - modes();
  MatrixXd beside = MatrixXd::Zero(modes(), inner);
  MatrixXd by_rim = MatrixXd::Zero(interface(), modes());  // K_ΓΓ Ψ
  std::ranges::fill(to.values, 0.0);
  for (int column = 0; column < near.size; ++column) {
    for (int k = near.column_starts[at(column)]; k < near.column_starts[at(column) + 1]; ++k) {
      const int row = near.rows[at(k)];
      const double value = near.values[at(k)];
      const int row_rim = on_rim[at(row)];
      const int column_rim = on_rim[at(column)];
      if (row_rim < 0 && column_rim < 0) {
        to.values[at(to.slot(own[at(row)], own[at(column)]))] = value;
      } else if (row_rim >= 0 && column_rim >= 0) {
        by_rim.row(row_rim) += value * modes_.row(column_rim);
        if (row != column) by_rim.row(column_rim) += value * modes_.row(row_rim);
      } else if (row_rim >= 0) {
        beside.col(own[at(column)]) += value * modes_.row(row_rim).transpose();
      } else {
        beside.col(own[at(row)]) += value * modes_.row(column_rim).transpose();
      }
    }
  }
  const MatrixXd among = modes_.transpose() * by_rim + far_;
  for (int column = 0; column < to.size; ++column) {
    for (int k = to.column_starts[at(column)]; k < to.column_starts[at(column) + 1]; ++k) {
      const int mode = to.rows[at(k)] - inner;
      if (mode < 0) continue;
      to.values[at(k)] = column < inner ? beside(mode, column) : among(mode, column - inner);
    }
  }
}

double NearBody::left_out(const VectorXd& u, double depth) const {
  const VectorXd moved = watched_.followed * u.tail(modes());
  const VectorXd shape = depth > about_depth_ ? VectorXd(watched_.linear.about + moved) : watched_.linear.about;
  const double deep = std::max(depth, about_depth_);
  return deep > 0 ? watched_.linear.excess(watched_.part, moved, shape) / (deep * watched_.share) : 0;
}

std::size_t NearBody::bytes() const noexcept {
  const Watched& watched = watched_;
  return mesh_bytes() + part_.bytes() + watched.part.bytes() + watched.linear.stiffness.bytes() +
         (rim_.size() + own_of_.size()) * sizeof(int) +
         static_cast<std::size_t>(modes_.size() + far_.size() + held_.size() + on_rim_.size() + beginning_.size() +
                                  watched.linear.about.size() + watched.linear.forces.size() +
                                  watched.followed.size()) *
             sizeof(double);
}

}  // namespace tendon::softbody
