// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "clients/softbody/fem/element.h"

namespace tendon::softbody {

using Flat = std::vector<Eigen::Vector2d>;

/// Projects a polygon along the axis of the largest area, without rounding. The orientation may be reversed.
Flat flat(std::span<const Vec3> corners);

/// Returns the first corners of two sides that intersect or overlap; empty if the polygon is simple. Exact unless a
/// product of coordinates overflows or underflows. The time is quadratic in the number of corners.
std::optional<std::pair<int, int>> sides_that_meet(const Flat& polygon);

/// Divides a simple polygon with n ≥ 3 corners into n − 2 triangles of positive area and the same orientation. If all
/// corners are convex, the result is a fan around the first corner. Otherwise it uses ear clipping (Meisters 1975) and
/// clips the ear with the best shape first. Corners with an angle of 180° are allowed, and every corner is used. The
/// result is empty if the polygon is not simple.
std::vector<std::array<int, 3>> triangles_of(const Flat& polygon);

}  // namespace tendon::softbody
