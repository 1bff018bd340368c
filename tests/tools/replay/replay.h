// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace tendon::replay {

/// `tendon-replay`: a recording through the control law again.
struct Options {
  std::filesystem::path recording;
  std::vector<std::filesystem::path> more_parts = {};  ///< of the same run, in order: run-2.mcap, run-3.mcap …
  /// Another law, of core/control/limiter.h: of the scene's limiter it takes over the friction bounds only.
  std::optional<std::string> law = {};
  std::vector<std::string> settings = {};  ///< "TABLE.KEY=VALUE", as `parse_scene` takes them; after `law`
  /// Where the files are that the scene names.
  std::filesystem::path files = ".";
  std::optional<std::filesystem::path> csv = {};      ///< a row for each step
  std::optional<std::filesystem::path> picture = {};  ///< .svg or .png, both runs side by side
  bool json = false;
  bool progress = false;  ///< to stderr, a line that is written over
};

/// Reads the recording, with its parts as one run, of one device (of several: the first) and takes every step of it
/// again, in bounded memory.
///
/// Without `law` and `settings` the scene that was recorded is run, each step with what the device held then, and
/// whatever the law decides has to be the same bit for bit: interval, account, bound, force, mode, reasons. Returns
/// false at the first step that is not, named with both values. What cannot be compared is said: the steps after a gap,
/// because what the law had learned in it is not known. Returns false too when no step could be.
///
/// With them another law answers the recorded motion and forces, with an account of what it would have given itself.
/// The hand moves as it was recorded, so it shows what the law would have permitted there, not where the hand would
/// have come to. Returns true.
///
/// Writes to `out` a table of both runs, or with `json` a line for the comparison and one for each run. Throws
/// std::invalid_argument when a setting is wrong (naming it) or the picture's name is; SceneError when the scene cannot
/// be run; std::runtime_error when the recording cannot be read or holds no step, or when something cannot be written.
bool replay(const Options& options, std::ostream& out);

}  // namespace tendon::replay
