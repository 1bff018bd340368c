// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace tendon::lab {

// Palette of Okabe and Ito, distinguishable with any color vision.
inline constexpr const char* kInk = "#222222";
inline constexpr const char* kPale = "#666666";
inline constexpr const char* kGrey = "#E8E8E8";
inline constexpr const char* kBlue = "#0072B2";
inline constexpr const char* kSky = "#56B4E9";
inline constexpr const char* kOrange = "#E69F00";
inline constexpr const char* kGreen = "#009E73";
inline constexpr const char* kVermilion = "#D55E00";
inline constexpr const char* kPurple = "#CC79A7";

/// Returns `text` in single quotes for gnuplot. Control characters are replaced by spaces.
std::string literal(std::string_view text);

/// Returns the commands `set encoding`, `set terminal` and `set output` for an .svg or .png file.
std::string begin_picture(const std::filesystem::path& path, int width, int height);

/// Throws std::invalid_argument if `path` does not end with .svg or .png or contains control characters,
/// std::runtime_error if the file exists and has a different type.
void check_picture_name(const std::filesystem::path& path);

/// Waits for gnuplot (package gnuplot-nox). Throws std::runtime_error if it is missing or fails, or if the picture is
/// incomplete (full disk), which is then removed.
void run_gnuplot(const std::string& script, const std::filesystem::path& path);

}  // namespace tendon::lab
