// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace tendon::replay {

struct Options {
  std::filesystem::path recording;
  std::vector<std::filesystem::path> more_parts = {};  ///< of the same run, in order: run-2.mcap, run-3.mcap …
  /// A law of core/control/limiter.h, which replaces the scene's limiter and keeps only its friction bounds.
  std::optional<std::string> law = {};
  std::vector<std::string> settings = {};  ///< "TABLE.KEY=VALUE", as for `parse_scene`; applied after `law`
  /// Folder of the files that the scene names.
  std::filesystem::path files = ".";
  std::optional<std::string> device = {};
  std::optional<std::filesystem::path> csv = {};
  std::optional<std::filesystem::path> picture = {};  ///< .svg or .png, both runs of at most two devices side by side
  bool fields = false;                                ///< renders the recorded fields again
  bool json = false;
  bool progress = false;  ///< rewrites a progress line on stderr
};

/// Replays all steps of all devices, with the parts of a recording as a single run, in bounded memory.
///
/// Without `law` and `settings`, runs the recorded scene. Each step uses the force that the device held then, and all
/// results of the law must be bitwise identical: interval, account, bound, force, mode, reasons. Returns false at the
/// first differing step of a device and prints both values, or if no step of a device could be compared. Steps after a
/// gap cannot be compared, because the state of the law is unknown there; they are reported.
///
/// With `fields`, the fields are also rendered again (FieldRerun) and compared. Otherwise, their recorded forces and
/// credits are used.
///
/// With `law` or `settings`, another law receives the recorded motion and forces, and its account uses its own force.
/// The hand moves as recorded, so the result shows what the law would have permitted, not where the hand would have
/// moved. Returns true.
///
/// Prints a table of both runs of each device to `out` (if there are many, the differing ones first), or with `json`
/// one line for the comparison and one for each run. Throws std::invalid_argument for an invalid setting, an invalid
/// name of the picture, or too many devices for the CSV or picture; SceneError if a scene cannot be run;
/// std::runtime_error if the recording cannot be read, has no step or lacks the device, or if an output cannot be
/// written.
bool replay(const Options& options, std::ostream& out);

}  // namespace tendon::replay
