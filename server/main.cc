// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <mutex>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "clients/cpp/usage.h"
#include "core/base/nearest_word.h"
#include "devices/falcon/firmware.h"
#include "devices/simulated/profiles.h"
#include "devices/usb/usb.h"
#include "protocol/limits.h"
#include "server/build_info.h"
#include "server/commands/devices_report.h"
#include "server/commands/doctor.h"
#include "server/commands/explain.h"
#include "server/machine/clock.h"
#include "server/machine/log.h"
#include "server/machine/out_of_memory.h"
#include "server/machine/output.h"
#include "server/machine/randomness.h"
#include "server/machine/realtime.h"
#include "server/machine/regular_file.h"
#include "server/machine/service.h"
#include "server/scene/key_folder.h"
#include "server/scene/scene.h"
#include "server/server.h"

namespace {

using namespace tendon;

using Json = nlohmann::ordered_json;

/// The lines on stdout with --json. Thread-safe.
class Lines {
 public:
  void begin(const Json& first) {
    const std::scoped_lock lock(mutex_);
    write(first);
    for (const Json& line : std::exchange(early_, {})) write(line);
    begun_ = true;
  }
  void add(const Json& line) {
    const std::scoped_lock lock(mutex_);
    begun_ ? write(line) : early_.push_back(line);
  }

 private:
  static void write(const Json& line) {
    std::cout << line.dump(-1, ' ', false, Json::error_handler_t::replace) << std::endl;
  }

  std::mutex mutex_;
  bool begun_ = false;
  std::vector<Json> early_;
};

/// Returns the globally unique name of a session: 32 hexadecimal digits like a trace id. `run` is a random id of this
/// run. The last eight digits are the connection id, as found in recorded datagrams.
std::string session_name(std::span<const std::byte> run, std::uint32_t connection) {
  std::string name;
  const auto add = [&name](unsigned byte) {
    for (const unsigned digit : {byte >> 4U, byte & 0xfU}) name += "0123456789abcdef"[digit];
  };
  for (const std::byte byte : run) add(std::to_integer<unsigned>(byte));
  for (const unsigned shift : {24U, 16U, 8U, 0U}) add(connection >> shift & 0xffU);
  return name;
}

Json in_json(const NetworkLoop::SessionChange& change, std::span<const std::byte> run) {
  Json line = {{"event", change.came ? "welcomed" : "left"},
               {"session", session_name(run, change.connection)},
               {"device", change.device},
               {"tick", change.tick},
               {"client", change.client},
               {"role", change.role == Role::kController ? "controller" : "observer"},
               {"address", to_string(change.address)}};
  if (!change.came) line["why"] = change.why;
  return line;
}

constexpr int kFailed = 1;
constexpr int kWrongUsage = 2;

constexpr double kLongestRun_s = 365.0 * 86400;

/// Includes SIGTSTP (Ctrl-Z).
sigset_t signals_to_wait_for() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGTSTP}) sigaddset(&set, signal);
  return set;
}

/// Sets the forces to zero, then stops the process unless SIGCONT is already pending.
void stop_this_process(Server& server, UnblockedOutput& output) {
  sigset_t going_on;
  sigemptyset(&going_on);
  sigaddset(&going_on, SIGCONT);
  constexpr timespec kNow{};
  server.suspend();
  log::warn(
      "stopped by SIGTSTP: the force is zero until the process continues (SIGCONT, `fg` or `bg`) and the device is "
      "armed again");
  output.flush();
  if (sigtimedwait(&going_on, nullptr, &kNow) < 0) {
    ::kill(::getpid(), SIGSTOP);
    sigtimedwait(&going_on, nullptr, &kNow);
  }
  server.resume();
  log::info("continued after SIGCONT");
}

// Waits for a signal or for `duration_s` if not zero, and notifies the service manager. Returns the reason to stop.
std::string wait_for_the_end(const sigset_t& signals, double duration_s, Server& server, UnblockedOutput& output) {
  constexpr Duration kLongestWait = std::chrono::hours(1);
  const std::optional<Duration> watched = service::watch_period();
  const Duration period = watched.value_or(kLongestWait);
  std::optional<Duration> left;
  if (duration_s > 0) left = from_seconds(duration_s);
  for (;;) {
    if (watched && server.turning()) service::alive();
    const Duration wait = left ? std::min(period, *left) : period;
    const auto whole = std::chrono::floor<std::chrono::seconds>(wait);
    const timespec timeout{.tv_sec = whole.count(), .tv_nsec = (wait - whole).count()};
    const int signal = sigtimedwait(&signals, nullptr, &timeout);
    if (signal == SIGTSTP) {
      stop_this_process(server, output);
      continue;
    }
    if (signal > 0) return "signal " + std::to_string(signal);
    if (errno == EINTR) continue;  // after SIGSTOP and SIGCONT
    if (left && (*left -= wait) <= Duration::zero()) return "the duration has ended";
  }
}

HapticLoop::Stats total(const std::vector<Server::DeviceSummary>& devices) {
  HapticLoop::Stats sum;
  for (const auto& [name, haptic, safety, counts] : devices) {
    sum.steps += haptic.steps;
    sum.overruns += haptic.overruns;
    sum.unseen += haptic.unseen;
    sum.longest_interval = std::max(sum.longest_interval, haptic.longest_interval);
    sum.fault = std::max(sum.fault, haptic.fault);
  }
  return sum;
}

Json by_device(const Server::Summary& summary) {
  Json devices = Json::array();
  for (const auto& [name, haptic, safety, counts] : summary.devices) {
    Json device = {{"name", name},
                   {"steps", haptic.steps},
                   {"overruns", haptic.overruns},
                   {"unseen", haptic.unseen},
                   {"longest_interval_us", seconds(haptic.longest_interval) * 1e6},
                   {"fault", static_cast<int>(haptic.fault)},
                   {"force_n", haptic.force},
                   {"safety", nullptr},
                   {"counts", nullptr},
                   {"channels", Json::array()}};
    if (safety) {
      device["safety"] = {{"state", to_string(safety->state)},
                          {"faults", safety->faults},
                          {"last_fault", to_string(safety->last_fault)}};
    }
    if (counts) {
      for (const DeviceCounter& row : kDeviceCounters) device["counts"][row.name] = (*counts)[row.count];
    }
    for (const auto& channel : summary.network.channels) {
      if (channel.device != name) continue;
      device["channels"].push_back({{"name", channel.channel},
                                    {"forces", channel.forces},
                                    {"late", channel.late},
                                    {"handovers", channel.handovers},
                                    {"worst_error_n", channel.worst_error ? Json(*channel.worst_error) : Json()},
                                    {"ways", Json::object()}});
      for (const auto& [way, forces] : channel.ways) device["channels"].back()["ways"][way] = forces;
    }
    devices.push_back(std::move(device));
  }
  return devices;
}

Json in_json(const Server::Summary& summary) {
  const HapticLoop::Stats haptic = total(summary.devices);
  const auto& [devices, network, recording, uptime] = summary;
  Json out = {{"event", "stopped"}};
  const auto add = [&out](const char* name, Json value) { out[name] = std::move(value); };
  add("uptime_s", seconds(uptime));
  add("steps", haptic.steps);
  add("overruns", haptic.overruns);
  add("unseen", haptic.unseen);
  add("longest_interval_us", seconds(haptic.longest_interval) * 1e6);
  add("fault", static_cast<int>(haptic.fault));
  add("welcomed", network.welcomed);
  add("refused", network.refused);
  add("timed_out", network.timed_out);
  add("forces", network.forces);
  add("denied", network.denied);
  add("unanswerable", network.unanswerable);
  add("late", network.late_ours + network.late_network + network.late_engine + network.late_unknown);
  add("late_server", network.late_ours);
  add("late_network", network.late_network);
  add("late_engine", network.late_engine);
  add("late_unknown", network.late_unknown);
  add("forces_not_finite", network.dropped.forces.not_finite);
  add("forces_out_of_bounds", network.dropped.forces.out_of_bounds);
  add("forces_old_sequence", network.dropped.forces.old_sequence);
  add("hopeless", network.unusable);
  add("foretold", network.predicted);
  add("replaced", network.replaced);
  add("roamed", network.roamed);
  add("half_open_forgotten", network.half_open_forgotten);
  add("malformed", network.malformed + network.hellos.malformed + network.dropped.malformed);
  add("unknown_connection", network.unknown_connection);
  add("retries", network.hellos.retries);
  add("hellos_plain", network.hellos.plain);
  add("hellos_limited", network.hellos.limited);
  add("hellos_unknown_key", network.hellos.unknown_key);
  add("hellos_forged", network.hellos.forged);
  add("forged", network.dropped.forged);
  add("old_key", network.dropped.old_key);
  add("duplicated", network.dropped.duplicated);
  add("invalid", network.dropped.invalid);
  add("stale", network.dropped.stale);
  add("stamps_refused", network.refused_stamps);
  add("lost", network.controller.lost);
  add("round_trip_ms", seconds(network.controller.smoothed_round_trip) * 1e3);
  if (const auto& clock = network.controller_clock) {
    add("clock_offset_ms", seconds(clock->offset) * 1e3);
    add("clock_drift_ppm", clock->drift * 1e6);
    add("clock_error_bound_ms", seconds(clock->error_bound) * 1e3);
  }
  if (recording) {
    add("recorded_parts", recording->parts);
    add("parts_not_kept", recording->parts_not_kept);
    add("recorded_bytes", recording->bytes);
    add("recorded_steps", recording->steps);
    add("lost_steps", recording->lost_steps);
    add("lost_datagrams", recording->lost_datagrams);
    add("strangers_left_out", recording->unauthenticated_left_out);
    add("datagrams_over_budget", recording->datagrams_over_budget);
    add("recording_ended_early", !recording->error.empty());
  }
  add("devices", by_device(summary));
  return out;
}

std::string what_is_missing(const PartRecorder::Status& recording) {
  std::string text = std::to_string(recording.lost_steps) + " steps and " + std::to_string(recording.lost_datagrams) +
                     " datagrams are missing";
  if (!recording.error.empty()) text += "; " + recording.error;
  return text;
}

int run(const std::vector<Scene>& scenes, double duration_s, bool json) {
  // All threads inherit this mask, so that only sigwait receives these signals.
  const sigset_t signals = signals_to_wait_for();
  sigset_t blocked = signals;
  sigaddset(&blocked, SIGCONT);
  pthread_sigmask(SIG_BLOCK, &blocked, nullptr);
  // Otherwise, a background process would be stopped when it writes to a terminal with `stty tostop`.
  std::signal(SIGTTOU, SIG_IGN);
  std::signal(SIGTTIN, SIG_IGN);
  // A full recording or a closed log must not end the process.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);

  use_small_stacks();
  UnblockedOutput output;
  Lines lines;  // must outlive the server
  std::array<std::byte, 12> name_of_run;
  fill_random(name_of_run);
  Server server(scenes);
  const auto recording = server.recording();
  if (json) {
    server.on_sessions([&](const NetworkLoop::SessionChange& change) { lines.add(in_json(change, name_of_run)); });
  }
  server.start(duration_s > 0 ? std::optional(from_seconds(duration_s)) : std::nullopt);
  const auto& file = scenes.front().network.unix_path;
  log::info("tendond " + version_text() + " listens on " + to_string(server.address()) +
            (file ? " and on unix:" + file->string() : ""));
  if (recording) {
    const std::filesystem::path& wanted = scenes.front().recording->path;
    log::info("recording to " + recording->string() +
              (*recording == wanted ? "" : ", because " + wanted.string() + " exists"));
  }
  if (json) {
    Json listening = {{"event", "listening"}, {"address", to_string(server.address())}};
    if (recording) listening["recording"] = recording->string();
    lines.begin(listening);
  }
  service::ready();
  const std::string why = wait_for_the_end(signals, duration_s, server, output);
  service::stopping();
  const Server::Summary summary = server.stop();
  const HapticLoop::Stats haptic = total(summary.devices);
  log::info("stopped: " + why + "; " + std::to_string(haptic.steps) + " steps, " + std::to_string(haptic.overruns) +
            " overruns, " + std::to_string(summary.network.forces) + " forces");
  if (summary.recording && summary.recording->parts_not_kept > 0) {
    log::info(std::to_string(summary.recording->parts_not_kept) + " of " + std::to_string(summary.recording->parts) +
              " recorded files were deleted because they contain no fault ([recording] keep)");
  }
  if (json) lines.add(in_json(summary));
  if (!summary.recording || summary.recording->complete()) return 0;
  log::error("the recording is incomplete: " + what_is_missing(*summary.recording));
  return kFailed;
}

int explain_each(const std::vector<std::filesystem::path>& files, bool json) {
  for (const Scene& scene : read_scenes(files)) {
    const Explanation explanation = explain(scene, clock::processor_time);
    std::cout << (json ? in_json(scene, explanation) + "\n" : in_words(scene, explanation));
  }
  return 0;
}

using OptionalPath = std::optional<std::filesystem::path>;

int list_devices(const OptionalPath& firmware, bool accept_unknown_firmware, bool json) {
  std::optional<std::string> problem;
  if (firmware) {
    try {
      std::ifstream file = open_regular_file(*firmware);
      falcon::read_firmware(
          file, firmware->string(),
          accept_unknown_firmware ? falcon::UnknownFirmware::kAccept : falcon::UnknownFirmware::kRefuse);
      problem = "";
    } catch (const std::runtime_error& refused) {
      problem = refused.what();
    }
  }
  try {
    const auto devices = report_devices(usb::plugged_in(), problem);
    std::cout << (json ? in_json(devices) : in_words(devices));
    return 0;
  } catch (const std::runtime_error& no_usb) {
    log::error(no_usb.what());
    return kFailed;
  }
}

void set_falcon(std::vector<Scene>& scenes, const OptionalPath& firmware, bool accept_unknown_firmware) {
  bool any = false;
  for (Scene& scene : scenes) {
    auto* falcon = std::get_if<falcon::Config>(&scene.device);
    if (falcon == nullptr) continue;
    any = true;
    if (firmware) falcon->firmware = firmware;
    if (accept_unknown_firmware) falcon->accept_unknown_firmware = true;
  }
  if (firmware && !any)
    throw std::invalid_argument("--falcon-firmware: expected a scene with [device] kind = \"falcon\"");
}

void dial_instead(std::vector<Scene>& scenes, const Address& server) {
  const auto found = std::ranges::find_if(scenes, &Scene::dials);
  if (found == scenes.end()) throw std::invalid_argument("--dial: expected a scene with [teleoperation] dial");
  found->teleoperation->dial = server;
}

/// Returns settings for the scene, so that they are recorded. Couplings also run without their energy accounts and
/// delay adaptation, which need a limiter.
std::vector<std::string> without_limiter_settings(const Scene& scene) {
  if (scene.driver().moves_a_hand) {
    throw std::invalid_argument("--without-limiter: expected simulated devices only, found " + scene.name + ", a " +
                                std::string(scene.driver().name));
  }
  std::vector<std::string> settings = limiter_settings("none", scene.loop.control);
  if (scene.teleoperation) {
    settings.insert(settings.end(), {"teleoperation.energy_tank=", "teleoperation.coupling.adapt_to_delay=false"});
  }
  return settings;
}

/// Returns an error message if the file does not exist and its name resembles a command.
std::string meant_command(const std::string& file) {
  const std::string meant = did_you_mean(file, "keygen, explain, devices, doctor");
  return meant.empty() || std::filesystem::exists(file) ? "" : "there is no file \"" + file + '"' + meant;
}

/// The name is used as a file name and in the log.
void check_key_name(const std::string& name) {
  const auto plain = [](unsigned char c) { return std::isalnum(c) != 0 || c == '-' || c == '_'; };
  if (name.empty() || name.size() > limits::kMaxName || !std::all_of(name.begin(), name.end(), plain)) {
    throw CLI::ValidationError("name", "expected 1 to 64 letters, digits, - or _, got \"" + name + "\"");
  }
}

int make_key(const std::string& name, const std::string& file, bool observer) {
  try {
    ClientKey key{.name = name, .role = observer ? Role::kObserver : Role::kController, .key = {}};
    fill_random(key.key.bytes());
    write_key_file(file, key);
    std::cerr << "Wrote " << file << ", a key for " << (observer ? "an observer" : "a controller")
              << ". Copy it to the server and to the client over a trusted connection.\n  on the server, in the folder "
                 "of the scene:  mkdir -p -m 700 keys && cp "
              << file << " keys/\n"
              << "  in the scene:                               [network]\n"
                 "                                              keys = \"keys\"\n"
                 "  the client:                                 "
              << (observer ? "tendon-dash" : "virtual_wall") << " --key " << file << " --server HOST:47100\n";
    return 0;
  } catch (const std::exception& problem) {
    log::error(problem.what());
    return kFailed;
  }
}

}  // namespace

int main(int argc, char** argv) {
  exit_when_out_of_memory();
  CLI::App app(
      "Run the haptics server. It runs the control loop and the output limiter next to the device, and receives\n"
      "forces from remote physics engines over UDP.\n",
      "tendond");
  usage::dress(app);
  app.footer(
      "Examples:\n"
      "  tendond deploy/scenes/demo.toml --record run.mcap\n"
      "  tendond deploy/scenes/left.toml deploy/scenes/right.toml\n\n"
      "The second example runs two devices. [network] and [recording] are only allowed in the first scene. Use\n"
      "[device] count = 512 in a scene for many simulated devices.\n\n"
      "Files:\n"
      "  /etc/tendon/scene.toml     scene of the service tendond\n"
      "  /usr/share/tendon/scenes   example scenes\n\n"
      "Exit: 0 success; 1 a file, a port or a device cannot be used, or the recording is incomplete;\n"
      "2 wrong usage, or an error in a scene.");
  std::vector<std::filesystem::path> scene_files;
  std::string record;
  std::string listen;
  std::string dial;
  double duration_s = 0;
  bool without_limiter = false;
  bool json = false;
  std::optional<std::uint32_t> cpu;
  bool profiles = false;
  std::string table;
  auto* scene_option = app.add_option("SCENE", scene_files, "Scene files (TOML), one for each device");
  scene_option->expected(1, static_cast<int>(limits::kMaxDevices))->check(CLI::Validator(meant_command, ""));
  app.add_option("--record", record,
                 "Record to this MCAP file instead of the one of the scene. Existing files are never "
                 "overwritten: if run.mcap exists, run-2.mcap is written")
      ->type_name("FILE.mcap");
  app.add_option("--listen", listen,
                 "Receive datagrams at this address instead of [network] listen of the scene. Port 0: a free port")
      ->type_name("HOST:PORT");
  app.add_option("--dial", dial, "Connect to this server instead of [teleoperation] dial of the scene")
      ->type_name("HOST:PORT");
  app.add_option("--duration-s", duration_s,
                 "Stop this number of seconds after the first haptic step. 0: run until SIGINT or SIGTERM")
      ->capture_default_str();
  app.add_flag("--without-limiter", without_limiter,
               "Disable the output limiter, and in a coupling the energy sharing and the delay-dependent stiffness. "
               "For simulated devices only");
  std::string firmware;
  bool accept_unknown_firmware = false;
  constexpr const char* kFalcon = "Novint Falcon";
  constexpr const char* kAbout = "Print and exit";
  const auto add_firmware = [&](CLI::App& to) {
    to.add_option("--falcon-firmware", firmware,
                  "Load the firmware of a Novint Falcon from this file instead of [device] firmware of the scene")
        ->type_name("FILE")
        ->group(kFalcon);
    to.add_flag("--accept-unknown-firmware", accept_unknown_firmware,
                "Accept a firmware file that is not one of the known files")
        ->group(kFalcon);
  };
  add_firmware(app);
  app.add_flag("--json", json,
               "Print JSON on stdout, one object per line: listening; welcomed and left for each session; stopped");
  app.add_flag("--profiles", profiles, "Print the profiles of devices and operators, with the source of each number")
      ->group(kAbout);
  auto* scene_help =
      app.add_option("--scene-help", table,
                     "Print the tables of a scene file, or all keys of one TABLE, or of all tables with \"all\"")
          ->type_name("[TABLE]")
          ->expected(0, 1)
          ->group(kAbout);
  std::string key_name;
  std::string key_file;
  bool observer = false;
  auto* keygen = app.add_subcommand(
      "keygen", "Create a key for a client: `tendond keygen wall` writes wall.key, which is only readable by you");
  keygen->footer(
      "\n"
      "Example: tendond keygen wall\n\n"
      "Exit: 0 success; 1 the file exists or cannot be written; 2 wrong usage.");
  keygen->add_option("NAME", key_name, "Name of the client at this server")->required();
  keygen->add_option("--out", key_file, "Write the key to this file instead of NAME.key")->type_name("FILE");
  keygen->add_flag("--observer", observer, "Create a key for an observer, which cannot send forces");
  auto* explainer = app.add_subcommand("explain",
                                       "List the parts of a scene that are on and off, and measure the cost of each "
                                       "part in a haptic step: `tendond explain demo.toml`");
  explainer->footer(
      "\n"
      "Example: tendond explain deploy/scenes/demo.toml\n\n"
      "Exit: 0 success; 1 a file cannot be read; 2 wrong usage, or an error in a scene.");
  explainer->add_option("SCENE", scene_files, "Scene files")->required();
  explainer->add_flag("--json", json, "Print JSON on stdout, one object per scene");
  auto* devices = app.add_subcommand("devices",
                                     "List the connected devices, what each of them requires, and how to fix it: "
                                     "`tendond devices --falcon-firmware FILE`");
  devices->footer("\nExample: tendond devices\n\nExit: 0 success; 1 USB is not available; 2 wrong usage.");
  add_firmware(*devices);
  devices->add_flag("--json", json, "Print JSON on stdout, one object per device");
  auto* doctor =
      app.add_subcommand("doctor",
                         "Measure the wake-up latency of a haptic thread on this machine, and recommend changes. This "
                         "takes two seconds and does not change any settings: `tendond doctor`");
  doctor->footer("\nExample: tendond doctor\n\nExit: 0 success; 2 wrong usage.");
  doctor->add_option("--cpu", cpu, "Processor of the haptic thread. Default: the isolated processors")->type_name("N");
  doctor->add_flag("--json", json, "Print JSON on stdout, one object");
  app.set_help_flag("-h,--help", "Print this help")->group(kAbout);
  app.set_version_flag("--version", version_text(), "Print the version and the commit")->group(kAbout);
  try {
    usage::parse(app, argc, argv);
    if (profiles) {
      std::cout
          << "Each number is measured, quoted from a source, recalled from a source (not verified), or assumed.\n\n";
      for (const DeviceProfile& profile : device_profiles()) std::cout << provenance_table(profile) << '\n';
      for (const OperatorProfile& profile : operator_profiles()) std::cout << provenance_table(profile) << '\n';
      return 0;
    }
    if (*scene_help) {
      std::cout << (table.empty() ? scene_tables() : table == "all" ? scene_reference() : scene_reference(table));
      return 0;
    }
    if (!(duration_s >= 0 && duration_s <= kLongestRun_s)) {  // also refuses NaN
      throw CLI::ValidationError("--duration-s", "expected 0 to 31536000 seconds, got " + std::to_string(duration_s));
    }
    if (*keygen) {
      check_key_name(key_name);
      return make_key(key_name, key_file.empty() ? key_name + ".key" : key_file, observer);
    }
    if (!*explainer && !*devices && !*doctor && scene_option->count() == 0) throw CLI::RequiredError("SCENE");
  } catch (const CLI::ParseError& problem) {
    return usage::exit_code(app, problem);
  } catch (const std::invalid_argument& problem) {
    log::error(problem.what());
    return kWrongUsage;
  }

  try {
    const OptionalPath firmware_file = firmware.empty() ? OptionalPath() : OptionalPath(firmware);
    if (*explainer) return explain_each(scene_files, json);
    if (*devices) return list_devices(firmware_file, accept_unknown_firmware, json);
    if (*doctor) {
      const Diagnosis diagnosis = diagnose({.now = clock::now, .sleep_until = clock::sleep_until}, cpu);
      std::cout << (json ? in_json(diagnosis) + "\n" : in_words(diagnosis));
      return 0;
    }
    std::vector<Scene> scenes = read_scenes(scene_files, without_limiter ? without_limiter_settings : Overrides());
    if (!record.empty()) scenes.front().recording = Scene::Recording{.path = record};
    if (!listen.empty()) scenes.front().network.listen = parse_address(listen);
    if (!dial.empty()) dial_instead(scenes, parse_address(dial));
    set_falcon(scenes, firmware_file, accept_unknown_firmware);
    return run(each_device(scenes), duration_s, json);
  } catch (const SceneFileError& problem) {
    log::error(problem.what());
    return kFailed;
  } catch (const SceneError& problem) {
    log::error(problem.what());
    return kWrongUsage;
  } catch (const std::invalid_argument& problem) {
    log::error(problem.what());
    return kWrongUsage;
  } catch (const std::bad_alloc&) {
    say_out_of_memory();
    return kFailed;
  } catch (const std::exception& problem) {
    log::error(problem.what());
    return kFailed;
  }
}
