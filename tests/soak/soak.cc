// SPDX-License-Identifier: Apache-2.0
#include "tests/soak/soak.h"

#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <fstream>
#include <iomanip>
#include <memory>
#include <optional>
#include <random>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "protocol/link.h"
#include "server/machine/clock.h"
#include "tests/e2e/stage/process.h"
#include "tests/e2e/stage/stage.h"
#include "tests/soak/guests.h"
#include "tests/soak/vital_signs.h"
#include "tests/support/json_line.h"

namespace tendon::soak {

namespace {

constexpr std::string_view kScene = R"([device]
kind = "simulated"
profile = "falcon"

[device.effects]
watchdog_ms = 5

[device.hand]
stiffness_n_per_m = 300
damping_n_s_per_m = 3
mass_kg = 0.05

[device.hand.motion]
kind = "sine"
amplitude_mm = 15
frequency_hz = 0.5

[network]
max_observers = 32
controller_timeout_ms = 300   # an engine that was killed makes room for the next one

[limiter]
kind = "aol+"
)";

std::vector<std::string> operator+(std::vector<std::string> words, const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

constexpr int kVisitors = 8;
constexpr VitalSigns kGrowth{.resident = std::size_t{1} << 20};
/// Each of the recent engines has a socket and statistics, so that their number varies.
constexpr VitalSigns kProxyGrowth{.resident = std::size_t{4} << 20, .files = 8};
/// The index of a recording is held in memory until the end: four chunks per second, about 200 bytes each.
constexpr std::size_t kIndexBytesPerSecond = 1024;

/// A program whose output goes to the file `log`. It must not exit before stop().
class Program {
 public:
  Program(const std::string& name, const std::vector<std::string>& arguments, const std::filesystem::path& folder,
          std::vector<std::string> environment = {})
      : name_(name), log_(folder / (name + ".log")) {
    std::vector<std::string> words = {"-c", R"(exec "$@" >>"$0" 2>&1)", log_.string(), e2e::program(name).string()};
    words.insert(words.end(), arguments.begin(), arguments.end());
    process_ = std::make_unique<e2e::Process>("/bin/sh", words, folder, std::move(environment));
  }

  pid_t pid() const noexcept { return process_->pid(); }
  const std::filesystem::path& log() const noexcept { return log_; }
  void kill() {
    process_->signal(SIGKILL);
    process_->wait();
  }
  int stop() {
    process_->signal(SIGTERM);
    return process_->wait();
  }

  std::string line(const std::string& text) const {
    for (const LocalTime end = clock::now() + e2e::kPatience; clock::now() < end;
         std::this_thread::sleep_for(std::chrono::milliseconds(20))) {
      if (const auto line = said(text)) return *line;
    }
    throw std::runtime_error(name_ + " did not say " + text + "; see " + log_.string());
  }
  std::optional<std::string> said(const std::string& text) const {
    std::ifstream file(log_);
    for (std::string line; std::getline(file, line);) {
      if (line.find(text) != std::string::npos) return line;
    }
    return std::nullopt;
  }

 private:
  std::string name_;
  std::filesystem::path log_;
  std::unique_ptr<e2e::Process> process_;
};

/// A small tmpfs. It is empty if this process may not mount.
class SmallDisk {
 public:
  explicit SmallDisk(std::filesystem::path path) : path_(std::move(path)) {
    std::filesystem::create_directories(path_);
    mounted_ = mount("tendon-soak", path_.c_str(), "tmpfs", 0, "size=256k") == 0;
  }
  ~SmallDisk() {
    if (mounted_) umount2(path_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  bool mounted() const noexcept { return mounted_; }
  const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
  bool mounted_ = false;
};

class Hogs {
 public:
  ~Hogs() { stop(); }
  void start() {
    while (pids_.size() < std::max(1U, std::thread::hardware_concurrency())) {
      const pid_t pid = fork();
      if (pid == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        for (std::atomic<unsigned> work = 0;; ++work) {
        }
      }
      if (pid < 0) return;
      pids_.push_back(pid);
    }
  }
  void stop() {
    for (const pid_t pid : pids_) {
      kill(pid, SIGKILL);
      waitpid(pid, nullptr, 0);
    }
    pids_.clear();
  }
  bool running() const noexcept { return !pids_.empty(); }

 private:
  std::vector<pid_t> pids_;
};

std::uint64_t rotate(const std::filesystem::path& log) {
  const std::uint64_t size = std::filesystem::file_size(log);
  std::filesystem::copy_file(log, log.string() + ".1", std::filesystem::copy_options::overwrite_existing);
  std::filesystem::resize_file(log, 0);
  return size;
}

struct Watched {
  Watched(std::string the_name, std::unique_ptr<Program> the_program, const VitalSigns& the_growth)
      : name(std::move(the_name)), program(std::move(the_program)), growth(the_growth) {}

  std::string name;
  std::unique_ptr<Program> program;
  VitalSigns growth;
  std::vector<VitalSigns> looks{};
};

class Run {
 public:
  explicit Run(const Config& config)
      : config_(config),
        random_(config.seed),
        disk_(config.folder / "small-disk"),
        scene_(e2e::write(config.folder / "soak.toml", kScene)),
        clock_file_(e2e::write(config.folder / "clock-step", "0")) {
    server_ = tendond("tendond", {}, kGrowth);
    const std::vector<std::string> proxy = {"--listen",  "127.0.0.1:0", "--to",   address(*server_),
                                            "--profile", "wifi-good",   "--seed", std::to_string(config.seed),
                                            "--json"};
    proxy_ = watch("tendon-inject", std::make_unique<Program>("tendon-inject", own_end() + proxy, config.folder),
                   kProxyGrowth);
    VitalSigns index = kGrowth;
    index.resident += kIndexBytesPerSecond * static_cast<std::size_t>(seconds(config.duration));
    tendond("recording", {"--record", "/dev/null"}, index);
    if (disk_.mounted()) {
      full_ = tendond("full-disk", {"--record", (disk_.path() / "run.mcap").string()}, kGrowth);
    }
    through_ = e2e::text_in(proxy_->line("\"event\":\"start\""), "listen");
  }

  Report run(const std::function<void(double)>& progress) {
    const LocalTime start = clock::now();
    const LocalTime end = start + config_.duration;
    const Address server = parse_address(address(*server_));
    // This is done a little early, so that the server is idle in the last sample.
    Reconnecting visitors(server, config_.reconnects, config_.duration * 9 / 10, kVisitors);
    Watching watcher(server);
    LocalTime next_look = start;
    LocalTime next_rough = start;
    while (clock::now() < end && alive()) {
      const LocalTime now = clock::now();
      flap(now);
      if (now >= next_look) {
        look();
        progress(seconds(now - start) / seconds(config_.duration));
        next_look += kLook;
      }
      if (now >= next_rough) {
        treat_roughly();
        next_rough += kRough;
      }
      clock::sleep_until(now + std::chrono::milliseconds(10));
    }
    hogs_.stop();
    visitors.stop();
    watcher.stop();
    report_.duration_s = seconds(clock::now() - start);
    report_.sessions = visitors.sessions();
    report_.vain = visitors.vain();
    report_.states_watched = watcher.states();
    report_.longest_silence_ms = seconds(watcher.longest_silence()) * 1e3;
    if (report_.vain > 0) broken(std::to_string(report_.vain) + " visitors saw no state within 10 s");
    if (const auto why = watcher.broken()) broken("a state: " + *why);
    finish();
    return report_;
  }

 private:
  static constexpr Duration kRough = std::chrono::seconds(7);
  static constexpr Duration kLook = std::chrono::seconds(1);

  /// Limits the lifetime of the programs in case this one is killed.
  std::vector<std::string> own_end() const {
    return {"--duration-s", std::to_string(static_cast<int>(seconds(config_.duration)) + 300)};
  }
  Program* watch(const std::string& name, std::unique_ptr<Program> program, const VitalSigns& growth) {
    return watched_.emplace_back(name, std::move(program), growth).program.get();
  }
  Program* tendond(const std::string& name, const std::vector<std::string>& more, const VitalSigns& growth) {
    const std::filesystem::path folder = config_.folder / name;
    std::filesystem::create_directories(folder);
    const std::vector<std::string> wrong_clock = {std::string("LD_PRELOAD=") + TENDON_STEPPED_CLOCK,
                                                  "TENDON_CLOCK_STEP=" + clock_file_};
    const std::vector<std::string> words = {scene_, "--json", "--listen", "127.0.0.1:0"};
    return watch(name, std::make_unique<Program>("tendond", own_end() + words + more, folder, wrong_clock), growth);
  }
  static std::string address(const Program& tendond) {
    return e2e::text_in(tendond.line("\"event\":\"listening\""), "address");
  }
  double uniform(double from, double to) {
    return from + (to - from) * (static_cast<double>(random_() >> 11U) * 0x1p-53);
  }
  void broken(const std::string& why) { report_.broken.push_back(why); }

  bool alive() {
    for (const Watched& watched : watched_) {
      if (!vital_signs(watched.program->pid())) {
        broken(watched.name + " ended before its time");
        return false;
      }
    }
    return true;
  }

  void flap(LocalTime now) {
    if (now < next_flap_) return;
    if (engine_) {
      engine_->kill();
      engine_.reset();
      ++report_.engines_killed;
      next_flap_ = now + from_seconds(uniform(0.05, 0.5));
      return;
    }
    engine_ = std::make_unique<Program>(
        "virtual_wall", own_end() + std::vector<std::string>{"--server", through_, "--stiffness-n-per-m", "800"},
        config_.folder);
    next_flap_ = now + from_seconds(uniform(0.2, 3));
  }

  void look() {
    for (Watched& watched : watched_) {
      if (const auto signs = vital_signs(watched.program->pid())) watched.looks.push_back(*signs);
    }
  }

  void treat_roughly() {
    constexpr double kDay_s = 86400;
    std::ofstream(clock_file_) << static_cast<std::int64_t>(uniform(-kDay_s, kDay_s) * 1e9) << '\n';
    ++report_.clock_steps;
    report_.log_bytes += rotate(server_->log());
    rotate(proxy_->log());
    ++report_.log_rotations;
    if (uniform(0, 1) < 1.0 / 3) {
      hogs_.start();
    } else {
      hogs_.stop();
    }
  }

  void finish() {
    engine_.reset();
    for (Watched& watched : watched_) {
      if (const auto why = not_flat(watched.name, watched.looks, watched.growth)) broken(*why);
      if (!watched.looks.empty()) {
        const VitalSigns& warm = watched.looks[watched.looks.size() / 5];
        report_.programs.push_back({.name = watched.name,
                                    .mb_first = static_cast<double>(warm.resident) / 1e6,
                                    .mb_last = static_cast<double>(watched.looks.back().resident) / 1e6,
                                    .files = watched.looks.back().files,
                                    .threads = watched.looks.back().threads});
      }
      const int code = watched.program->stop();
      // Exit code 1 is allowed: under this load the proxy misses release times, and the full disk loses data.
      const bool may_miss = watched.program.get() == proxy_ || watched.program.get() == full_;
      if (code != 0 && !(code == 1 && may_miss)) {
        broken(watched.name + ": exit code " + std::to_string(code));
      }
    }
    if (full_ != nullptr) report_.disk_was_full = full_->said("No space left on device").has_value();
    if (full_ != nullptr && !report_.disk_was_full)
      broken("the small disk did not become full: nothing was shown by it");
    const std::string end = server_->line("\"event\":\"stopped\"");
    report_.log_bytes += std::filesystem::file_size(server_->log());
    report_.steps = e2e::count_in(end, "steps");
    report_.overruns = e2e::count_in(end, "overruns");
    report_.longest_interval_ms = e2e::number_in(end, "longest_interval_us") / 1e3;
    report_.forces = e2e::count_in(end, "forces");
    if (e2e::count_in(end, "fault") != 0) broken("a latched fault: " + end);
  }

  Config config_;
  std::mt19937_64 random_;
  SmallDisk disk_;
  std::string scene_;
  std::string clock_file_;
  std::vector<Watched> watched_;
  Program* server_ = nullptr;  ///< owned by `watched_`, like the next pointers
  Program* proxy_ = nullptr;
  Program* full_ = nullptr;  ///< null if no disk could be mounted
  std::unique_ptr<Program> engine_;
  std::string through_;
  Hogs hogs_;
  LocalTime next_flap_{};
  Report report_;
};

}  // namespace

Report run(const Config& config, const std::function<void(double)>& progress) {
  std::filesystem::create_directories(config.folder);
  if (!std::filesystem::is_empty(config.folder)) {
    throw std::runtime_error(config.folder.string() + " is not empty: expected a folder that holds nothing to be lost");
  }
  return Run(config).run(progress);
}

std::string to_json(const Config& config, const Report& report) {
  std::string broken;
  for (const std::string& why : report.broken) broken += (broken.empty() ? "" : "; ") + why;
  JsonLine line;
  line.add("event", "soak")
      .add("passed", report.broken.empty())
      .add("broken", broken)
      .add("seed", config.seed)
      .add("duration_s", report.duration_s)
      .add("steps", report.steps)
      .add("overruns", report.overruns)
      .add("longest_interval_ms", report.longest_interval_ms)
      .add("engines_killed", report.engines_killed)
      .add("forces", report.forces)
      .add("reconnects", report.sessions)
      .add("reconnects_in_vain", report.vain)
      .add("states_watched", report.states_watched)
      .add("longest_silence_ms", report.longest_silence_ms)
      .add("clock_steps", report.clock_steps)
      .add("log_rotations", report.log_rotations)
      .add("log_bytes", report.log_bytes)
      .add("disk_was_full", report.disk_was_full);
  for (const ProgramReport& program : report.programs) {
    line.add(program.name + "_mb_first", program.mb_first)
        .add(program.name + "_mb_last", program.mb_last)
        .add(program.name + "_files", program.files)
        .add(program.name + "_threads", program.threads);
  }
  return line.str();
}

std::string to_text(const Report& report) {
  std::ostringstream text;
  const auto row = [&text](const auto& value, const char* meaning) {
    text << std::setw(12) << value << "  " << meaning << '\n';
  };
  text << std::fixed << std::setprecision(1);
  row(report.duration_s, "s");
  row(report.steps, "haptic steps");
  row(report.overruns, "… that took more than two periods");
  row(report.longest_interval_ms, "ms, the longest of them");
  row(report.engines_killed, "engines killed by SIGKILL");
  row(report.forces, "forces that came from them");
  row(report.sessions, "visitors that came, saw and left");
  row(report.vain, "… that saw nothing within 10 s");
  row(report.states_watched, "states held against the promises");
  row(report.longest_silence_ms, "ms, the longest time between two of them");
  row(report.clock_steps, "times that the wall clock was set");
  row(report.log_rotations, "times that the logs were cut");
  row(report.log_bytes, "bytes of the server's log in all");
  row(report.disk_was_full ? "yes" : "no", "the disk was full");
  for (const ProgramReport& program : report.programs) {
    text << std::setw(12) << program.mb_last << "  MB of memory of " << program.name << ", after a fifth of the time "
         << program.mb_first << "; " << program.files << " open files, " << program.threads << " threads\n";
  }
  for (const std::string& why : report.broken) text << "BROKEN: " << why << '\n';
  return text.str();
}

}  // namespace tendon::soak
