// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/near_body.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>

namespace tendon::softbody {
namespace {

/// For each mode so many random loads; the least share of the traces that is kept.
constexpr int kLoadsPerMode = 2;
constexpr double kLeft = 1e-3;

/// For so many loads solutions are found at once.
constexpr Eigen::Index kLoadsAtOnce = 8;

/// So many far elements at most are asked for what the linear far field leaves out.
constexpr std::size_t kWatched = 96;

Vec3 middle_of(const Mesh& mesh, int element) {
  Vec3 sum = Vec3::Zero();
  for (const int node : mesh.element(element)) sum += mesh.nodes[at(node)];
  return sum / static_cast<double>(mesh.element(element).size());
}

/// Evenly within ±1, the same everywhere.
class Noise {
 public:
  double next() { return static_cast<double>(random_() >> 11U) * 0x1p-52 - 1; }

 private:
  std::mt19937_64 random_{1};
};

double excess(const Solid& solid, const SymmetricMatrix& linear, const VectorXd& u) {
  const VectorXd free = solid.to_free(u);
  return free.dot(solid.to_free(solid.forces(u).force) - linear.times(free));
}

SymmetricMatrix stiffness_at_rest(const Solid& solid) {
  SymmetricMatrix stiffness = solid.pattern();
  solid.stiffness(VectorXd::Zero(solid.size()), Elastic::Curvature::kExact, stiffness);
  return stiffness;
}

}  // namespace

struct NearBody::Parts {
  Solid part;
  Solid watched;
  std::vector<int> rim{};        ///< components in `part`
  std::vector<int> rim_nodes{};  ///< in `part`
  std::vector<int> own_of{};
  MatrixXd modes{};
  MatrixXd far{};
  SymmetricMatrix linear{};
  MatrixXd followed{};
  double share = 1;

  Fixed fixed() const {
    Fixed fixed = part.fixed();
    for (const int component : rim) fixed[at(component)] = true;
    return fixed;
  }
};

Pieces NearBody::make(const Solid& whole, const Factor& at_rest, Config config, std::unique_ptr<NearBody>& made) {
  made.reset();
  const Mesh& mesh = whole.mesh();
  std::vector<int> near;
  std::vector<std::pair<double, int>> far;  // by distance from the middle
  std::vector<bool> touches_far(mesh.nodes.size());
  std::vector<bool> reached(mesh.nodes.size());
  for (const int node : config.pressed) reached[at(node)] = true;
  for (int e = 0; e < mesh.element_count(); ++e) {
    const double distance = (middle_of(mesh, e) - config.middle).norm();
    if (distance <= config.radius ||
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
  for (std::size_t i = 0; i < std::min(far.size(), kWatched); ++i) watched.push_back(far[i].second);
  std::vector<int> nodes;
  std::vector<int> watched_nodes;
  Solid near_part = Solid::part_of(whole, near, nodes);
  co_await kPieceDone;
  Solid watched_part = Solid::part_of(whole, watched, watched_nodes);
  Parts parts{.part = std::move(near_part), .watched = std::move(watched_part)};
  const Solid& part = parts.part;
  co_await kPieceDone;

  parts.own_of.assign(mesh.nodes.size(), -1);
  std::vector<int> whole_of;  // of each free component of the part, its free number in the whole
  std::vector<int> rim_free;  // the free numbers in the part of `rim`
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
  const SymmetricMatrix near_stiffness = stiffness_at_rest(part);
  co_await kPieceDone;

  MatrixXd shapes(loads.rows(), loads.cols());
  // What the far field's force on Γ is in each of these shapes: that of the load and of the near field is missing.
  MatrixXd traces(interface, loads_count);
  MatrixXd forces(interface, loads_count);
  VectorXd local(part.free_count());
  for (Eigen::Index first = 0; first < loads.cols(); first += kLoadsAtOnce) {
    const Eigen::Index count = std::min(kLoadsAtOnce, loads.cols() - first);
    shapes.middleCols(first, count) = at_rest.solve(loads.middleCols(first, count));
    for (Eigen::Index j = first; j < std::min(first + count, loads_count); ++j) {
      for (int i = 0; i < part.free_count(); ++i) local[i] = shapes(whole_of[at(i)], j);
      const VectorXd by_near = near_stiffness.times(local);
      for (Eigen::Index i = 0; i < interface; ++i) {
        const int free = rim_free[static_cast<std::size_t>(i)];
        traces(i, j) = local[free];
        forces(i, j) = loads(whole_of[at(free)], j) - by_near[free];
      }
    }
    co_await kPieceDone;
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> parts_of_traces(traces.transpose() * traces);
  const VectorXd& squares = parts_of_traces.eigenvalues();  // ascending
  Eigen::Index count = loads_count;
  double left = 0;
  while (!exact && count > 1 &&
         (count > config.modes || left + squares[loads_count - count] <= kLeft * kLeft * squares.sum())) {
    left += std::max(0.0, squares[loads_count - count]);
    --count;
  }
  const MatrixXd mix =
      parts_of_traces.eigenvectors().rightCols(count) * squares.tail(count).cwiseSqrt().cwiseInverse().asDiagonal();
  parts.modes = traces * mix;
  const MatrixXd far_forces = parts.modes.transpose() * forces * mix;
  parts.far = (far_forces + far_forces.transpose()) / 2;

  co_await kPieceDone;

  const Solid& sentinels = parts.watched;
  parts.linear = stiffness_at_rest(sentinels);
  parts.followed = MatrixXd::Zero(sentinels.size(), count);
  VectorXd pressed = VectorXd::Zero(whole.size());
  const double unit = 0.1 * config.radius / shapes.col(loads_count).lpNorm<Eigen::Infinity>();
  whole.add_free(unit * shapes.col(loads_count), pressed);
  VectorXd pressed_near = VectorXd::Zero(part.size());
  VectorXd pressed_watched = VectorXd::Zero(sentinels.size());
  for (int i = 0; i < part.size(); ++i) pressed_near[i] = pressed[3 * nodes[at(i / 3)] + i % 3];
  for (int i = 0; i < sentinels.size(); ++i) {
    const int component = 3 * watched_nodes[at(i / 3)] + i % 3;
    pressed_watched[i] = pressed[component];
    const int free = whole.free_of(component);
    if (free >= 0) parts.followed.row(i) = shapes.row(free).head(loads_count) * mix;
  }
  const VectorXd whole_free = whole.to_free(pressed);
  const double all = whole_free.dot(whole.to_free(whole.forces(pressed).force) - unit * config.press) -
                     excess(part, near_stiffness, pressed_near);
  parts.share = std::clamp(excess(sentinels, parts.linear, pressed_watched) / all, 0.25, 1.0);
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
      own_of_(std::move(parts.own_of)),
      watched_(std::move(parts.watched)),
      linear_(std::move(parts.linear)),
      followed_(std::move(parts.followed)),
      watched_share_(parts.share) {}

VectorXd NearBody::placed(const VectorXd& u) const {
  VectorXd all = u.head(part_.size());
  const VectorXd on_rim = modes_ * u.tail(modes());
  for (std::size_t i = 0; i < rim_.size(); ++i) all[rim_[i]] = on_rim[static_cast<Eigen::Index>(i)];
  return all;
}

Elastic::Forces NearBody::forces(const VectorXd& u) const {
  Forces near = part_.forces(placed(u));
  VectorXd on_rim(interface());
  for (std::size_t i = 0; i < rim_.size(); ++i) on_rim[static_cast<Eigen::Index>(i)] = near.force[rim_[i]];
  const auto y = u.tail(modes());
  const VectorXd of_far = far_ * y;
  Forces all{near.energy + y.dot(of_far) / 2, VectorXd(size())};
  all.force << near.force, modes_.transpose() * on_rim + of_far;
  return all;
}

void NearBody::stiffness(const VectorXd& u, Curvature curvature, SymmetricMatrix& to) const {
  SymmetricMatrix near = part_.pattern();
  part_.stiffness(placed(u), curvature, near);
  // Of each free component of the part: its place on Γ, or −1; and its number here.
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

double NearBody::left_out(const VectorXd& u) const {
  return excess(watched_, linear_, followed_ * u.tail(modes())) / watched_share_;
}

std::size_t NearBody::bytes() const noexcept {
  return mesh_bytes() + part_.bytes() + watched_.bytes() + linear_.bytes() +
         (rim_.size() + own_of_.size()) * sizeof(int) +
         static_cast<std::size_t>(modes_.size() + far_.size() + followed_.size()) * sizeof(double);
}

}  // namespace tendon::softbody
