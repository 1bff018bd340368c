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
  /// Of a recording of several devices only this one.
  std::optional<std::string> device = {};
  std::optional<std::filesystem::path> csv = {};      ///< a row for each step of a device
  std::optional<std::filesystem::path> picture = {};  ///< .svg or .png, both runs of at most two devices side by side
  bool json = false;
  bool progress = false;  ///< to stderr, a line that is written over
};

/// Reads the recording, with its parts as one run, and takes every step of every device in it again, in bounded memory.
///
/// Without `law` and `settings` the scene that was recorded is run, each step with what the device held then, and
/// whatever the law decides has to be the same bit for bit: interval, account, bound, force, mode, reasons. Returns
/// false at the first step of a device that is not, named with both values. What cannot be compared is said: the steps
/// after a gap, because what the law had learned in it is not known. Returns false, too, when no step of a device could
/// be.
///
/// With them another law answers the recorded motion and forces, with an account of what it would have given itself.
/// The hand moves as it was recorded, so it shows what the law would have permitted there, not where the hand would
/// have come to. Returns true.
///
/// Writes to `out` a table of both runs of each device, of many devices of those that differ first, or with `json` for
/// each device a line for the comparison and one for each run. Throws std::invalid_argument when a setting is wrong
/// (naming it), the picture's name is, or a CSV or picture is to hold more devices than it can; SceneError when a scene
/// cannot be run; std::runtime_error when the recording cannot be read, holds no step or has no such device, or when
/// something cannot be written.
bool replay(const Options& options, std::ostream& out);

}  // namespace tendon::replay
