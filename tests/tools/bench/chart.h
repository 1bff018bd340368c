// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "tests/tools/bench/row.h"

namespace tendon::bench {

/// Plots the cost against the number of devices, from the rows with more than one device. Writes `stem`.svg and
/// `stem`.png and returns their names. Throws std::runtime_error if there are no such rows or if gnuplot is missing.
std::vector<std::filesystem::path> draw_devices(const std::filesystem::path& stem, const Circumstances& circumstances,
                                                const std::vector<Row>& rows);

}  // namespace tendon::bench
