// SPDX-License-Identifier: Apache-2.0
#include "core/base/frames.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <stdexcept>

namespace tendon {
namespace {

constexpr std::array<std::string_view, 3> kWords = {"right", "up", "user"};
constexpr std::string_view kAxes = "xyz";

[[noreturn]] void refuse(std::string_view axes, const std::string& why) {
  throw std::invalid_argument("axes = \"" + std::string(axes) +
                              "\": expected three words like \"right=x up=y user=z\": " + why);
}

/// A matrix with three signed axes as rows: ±1 … ±3 are ±x, ±y, ±z. 0 is not allowed.
Mat3 of_rows(int first, int second, int third) {
  Mat3 m = Mat3::Zero();
  const std::array<int, 3> rows = {first, second, third};
  for (Eigen::Index i = 0; i < 3; ++i) {
    const int row = rows[static_cast<std::size_t>(i)];
    m(i, (row < 0 ? -row : row) - 1) = row < 0 ? -1 : 1;
  }
  return m;
}

constexpr int kX = 1;
constexpr int kY = 2;
constexpr int kZ = 3;

}  // namespace

Mat3 operator_from_device(std::string_view axes) {
  Mat3 rotation = Mat3::Zero();
  for (std::string_view rest = axes; !rest.empty();) {
    const std::size_t end = std::min(rest.find(' '), rest.size());
    const std::string_view word = rest.substr(0, end);
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (word.empty()) continue;
    const std::size_t equals = word.find('=');
    const auto side = std::ranges::find(kWords, word.substr(0, std::min(equals, word.size())));
    std::string_view axis = equals == std::string_view::npos ? std::string_view() : word.substr(equals + 1);
    const bool back = axis.starts_with('-');
    if (back) axis.remove_prefix(1);
    if (side == kWords.end() || axis.size() != 1 || kAxes.find(axis.front()) == kAxes.npos) {
      refuse(axes, "\"" + std::string(word) + "\" is not right=, up= or user= with x, y, z, -x, -y or -z");
    }
    const auto row = rotation.row(side - kWords.begin());
    if (!row.isZero()) refuse(axes, std::string(*side) + " occurs twice");
    rotation(side - kWords.begin(), static_cast<Eigen::Index>(kAxes.find(axis.front()))) = back ? -1 : 1;
  }
  for (Eigen::Index i = 0; i < 3; ++i) {
    if (rotation.row(i).isZero()) refuse(axes, std::string(kWords[static_cast<std::size_t>(i)]) + " is missing");
    if (rotation.col(i).cwiseAbs().sum() > 1) {
      std::string why(kAxes.substr(static_cast<std::size_t>(i), 1));
      refuse(axes, why.append(" is used twice"));
    }
  }
  if (rotation.determinant() < 0) refuse(axes, "these three axes form a left-handed frame");
  return rotation;
}

std::string axes_in_words(const Mat3& rotation) {
  std::string words;
  for (Eigen::Index i = 0; i < 3; ++i) {
    Eigen::Index axis = 0;
    const double largest = rotation.row(i).cwiseAbs().maxCoeff(&axis);
    if (largest != 1 || rotation.row(i).cwiseAbs().sum() != 1) return {};
    words += std::string(i > 0 ? " " : "") + std::string(kWords[static_cast<std::size_t>(i)]) +
             (rotation(i, axis) < 0 ? "=-" : "=") + kAxes[static_cast<std::size_t>(axis)];
  }
  return words;
}

Quat quaternion_of(const Mat3& rotation) {
  const Eigen::Quaterniond q(rotation);
  return {.w = q.w(), .x = q.x(), .y = q.y(), .z = q.z()};
}

Mat3 matrix_of(const Quat& q) { return Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized().toRotationMatrix(); }

std::span<const Frame> frames() {
  static const std::array<Frame, 8> kFrames = {{
      {"operator", "x right, y up, z to the user", "OpenXR 1.0, section 2.16; WebXR", of_rows(kX, kY, kZ), 1},
      {"openhaptics", "x right, y up, z to the user", "VRPN's Phantom server, OpenHaptics", of_rows(kX, kY, kZ), 1},
      {"chai3d", "x to the user, y right, z up", "CHAI3D", of_rows(kZ, kX, kY), 1},
      {"inverse", "x right, y forward, z up", "Haply Inverse, basis XYZ", of_rows(kX, -kZ, kY), 1},
      {"ros", "x forward, y left, z up", "ROS REP 103", of_rows(-kZ, -kX, kY), 1},
      {"ras", "x left, y to the user, z up; mm", "3D Slicer: right, anterior, superior; the patient faces the user",
       of_rows(-kX, kZ, kY), 1000},
      {"unity", "x right, y up, z forward; left-handed", "Unity", of_rows(kX, kY, -kZ), 1},
      {"unreal", "x forward, y right, z up; left-handed; cm", "Unreal Engine", of_rows(-kZ, kX, kY), 100},
  }};
  return kFrames;
}

const Frame* find_frame(std::string_view name) {
  const auto all = frames();
  const auto found = std::ranges::find(all, name, &Frame::name);
  return found == all.end() ? nullptr : &*found;
}

}  // namespace tendon
