// SPDX-License-Identifier: Apache-2.0
#include "core/remote/answer.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/base/rotation.h"

namespace tendon {
namespace {

bool is_sound(const ForceTable& table) noexcept {
  return table.size >= ForceTable::kMinEntries && table.size <= ForceTable::kMaxEntries && std::isfinite(table.first) &&
         std::isfinite(table.step) && table.step > 0 &&
         std::all_of(table.force.begin(), table.force.begin() + table.size, [](double f) { return std::isfinite(f); });
}

bool is_sound(const LocalModel& model) noexcept {
  if (!model.at.allFinite() || !model.stiffness.allFinite() || !(model.valid_radius >= 0)) return false;
  if (!model.contact) return true;
  const Contact& contact = *model.contact;
  return std::abs(contact.normal.norm() - 1) <= Contact::kUnitTolerance && std::isfinite(contact.gap) &&
         (!contact.table || is_sound(*contact.table));
}

bool is_sound(const RemoteTorque& torque) noexcept {
  return torque.torque.allFinite() &&
         (!torque.model || (is_rotation(torque.model->at) && torque.model->stiffness.allFinite()));
}

Mat3 conservative(const Mat3& stiffness, double max) noexcept {
  const Mat3 symmetric = (stiffness + stiffness.transpose()) / 2;
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(symmetric);
  const Vec3 bounded = solver.eigenvalues().cwiseMax(0).cwiseMin(max);
  if (bounded == solver.eigenvalues()) return symmetric;  // avoids rounding
  return solver.eigenvectors() * bounded.asDiagonal() * solver.eigenvectors().transpose();
}

void flatten(ForceTable& table, double max_slope) noexcept {
  const double most = max_slope * table.step;
  const auto near = [most](double force, double neighbour) {
    return std::clamp(force, neighbour - most, neighbour + most);
  };
  const auto middle = static_cast<std::size_t>(
      std::clamp(std::round(-table.first / table.step), 0.0, static_cast<double>(table.size - 1)));
  for (std::size_t i = middle + 1; i < table.size; ++i) table.force[i] = near(table.force[i], table.force[i - 1]);
  for (std::size_t i = middle; i-- > 0;) table.force[i] = near(table.force[i], table.force[i + 1]);
}

/// The force along the normal, and its negative gradient.
struct Along {
  double force;
  Vec3 gradient;
};

Along look_up(const ForceTable& table, double depth, const Vec3& normal) noexcept {
  const double place = (depth - table.first) / table.step;
  if (!(place > 0)) return {table.force[0], Vec3::Zero()};
  if (place >= static_cast<double>(table.size - 1)) return {table.force[table.size - 1], Vec3::Zero()};
  const auto i = static_cast<std::size_t>(place);
  const double rise = table.force[i + 1] - table.force[i];
  return {table.force[i] + (place - static_cast<double>(i)) * rise, std::max(0.0, rise / table.step) * normal};
}

}  // namespace

bool is_sound(const RemoteForce& answer) noexcept {
  return answer.force.allFinite() && (!answer.model || is_sound(*answer.model)) &&
         (!answer.error || (std::isfinite(*answer.error) && *answer.error >= 0)) &&
         (!answer.torque || is_sound(*answer.torque)) && (!answer.grip_force || std::isfinite(*answer.grip_force));
}

RemoteForce believed(const RemoteForce& answer, double max_stiffness) noexcept {
  RemoteForce result = answer;
  if (answer.topology_changed) result.model.reset();
  if (!result.model) return result;
  result.model->stiffness = conservative(result.model->stiffness, max_stiffness);
  if (auto& contact = result.model->contact) {
    contact->normal.normalize();
    if (contact->table) flatten(*contact->table, max_stiffness);
  }
  return result;
}

RemoteTorque believed(const RemoteTorque& torque, double max_angular_stiffness) noexcept {
  RemoteTorque result = torque;
  if (result.model) result.model->stiffness = conservative(result.model->stiffness, max_angular_stiffness);
  return result;
}

Vec3 reconstruct(const RemoteTorque& torque, const Quat& q) noexcept {
  if (!torque.model) return torque.torque;
  if (!is_within_reach(torque.model->at, q)) return Vec3::Zero();
  return torque.torque + spring_torque(torque.model->stiffness, torque.model->at, q);
}

Vec3 within(const LocalModel& model, const Vec3& position) noexcept {
  const Vec3 way = position - model.at;
  const double distance = way.norm();
  if (!(distance > model.valid_radius)) return position;
  return model.at + way * (model.valid_radius / distance);
}

Prediction reconstruct(const RemoteForce& answer, const Vec3& position) noexcept {
  if (!answer.model) return {.force = answer.force, .stiffness = Mat3::Zero()};
  const LocalModel& model = *answer.model;
  const Vec3 trusted = within(model, position);
  Prediction linear{.force = answer.force - model.stiffness * (trusted - model.at), .stiffness = Mat3::Zero()};
  if (trusted == position) linear.stiffness = model.stiffness;
  if (!model.contact) return linear;

  const Contact& contact = *model.contact;
  const Vec3& n = contact.normal;
  const double away = n.dot(position - model.at);
  Along along{n.dot(linear.force), linear.stiffness.transpose() * n};
  if (contact.table) {
    along = look_up(*contact.table, -away, n);
  } else if (along.force < 0 || contact.gap + away > std::max(0.0, contact.gap)) {
    along = {0, Vec3::Zero()};
  }
  const double answered = n.dot(answer.force);
  const double share = answered > 0 ? std::clamp(along.force / answered, 0.0, 1.0) : 1.0;
  const Mat3 across = Mat3::Identity() - n * n.transpose();
  Vec3 tangential = share * (across * linear.force);
  Mat3 sticking = share * (across * linear.stiffness);
  if (!std::isfinite(model.valid_radius)) {
    const double rubs = (across * answer.force).norm();
    const double most = answered > 0 ? rubs * (std::max(along.force, 0.0) / answered) : rubs;
    const double size = tangential.norm();
    if (size > most * (1 + 1e-12)) {  // not by rounding
      tangential *= most / size;
      sticking.setZero();
    }
  }
  return {.force = along.force * n + tangential, .stiffness = n * along.gradient.transpose() + sticking};
}

}  // namespace tendon
