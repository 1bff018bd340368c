// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "tests/tools/bench/row.h"

namespace tendon::bench {

/// What devices cost against how many there are, each curve beside its floor: the rows with the figure `devices`, more
/// than one. Draws `stem`.svg and `stem`.png and returns their names. Throws std::runtime_error when there are no such
/// rows, and what gnuplot's absence throws.
std::vector<std::filesystem::path> draw_devices(const std::filesystem::path& stem, const Circumstances& circumstances,
                                                const std::vector<Row>& rows);

}  // namespace tendon::bench
