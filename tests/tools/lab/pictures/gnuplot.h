// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace tendon::lab {

// Okabe and Ito's colours, which people with any colour vision can tell apart.
inline constexpr const char* kInk = "#222222";
inline constexpr const char* kPale = "#666666";
inline constexpr const char* kGrey = "#E8E8E8";
inline constexpr const char* kBlue = "#0072B2";
inline constexpr const char* kSky = "#56B4E9";
inline constexpr const char* kOrange = "#E69F00";
inline constexpr const char* kGreen = "#009E73";
inline constexpr const char* kVermilion = "#D55E00";
inline constexpr const char* kPurple = "#CC79A7";

/// In single quotes, where gnuplot takes everything as it is but the quote itself; control characters become spaces.
std::string literal(std::string_view text);

/// `set encoding`, `set terminal` and `set output` for a picture, .svg or .png by the name of `path`.
std::string begin_picture(const std::filesystem::path& path, int width, int height);

/// Throws std::invalid_argument unless `path` ends with .svg or .png and has no control characters in it, and
/// std::runtime_error when a file of another kind is there, which the picture would replace.
void check_picture_name(const std::filesystem::path& path);

/// Has gnuplot (package gnuplot-nox) run a script which draws `path`, and waits for it. Throws std::runtime_error when
/// gnuplot is not installed or fails, or when the picture is not whole afterwards, as on a full disk; it is removed
/// then.
void run_gnuplot(const std::string& script, const std::filesystem::path& path);

}  // namespace tendon::lab
