// SPDX-License-Identifier: Apache-2.0
#include "server/commands/doctor.h"

#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <iomanip>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>
#include <system_error>
#include <thread>
#include <utility>

#include "protocol/secrets/suites.h"
#include "server/commands/doctor_network.h"
#include "server/commands/kernel_files.h"
#include "server/machine/realtime.h"

namespace tendon {

namespace {

namespace fs = std::filesystem;

constexpr Duration kPeriod = std::chrono::milliseconds(1);
constexpr std::size_t kWakeUps = 1000;

using kernel_files::number_of;
using kernel_files::text_of;
using kernel_files::value_after;
using Finding = Diagnosis::Finding;

Finding kernel(const fs::path& root) {
  const std::string release = text_of(root / "proc/sys/kernel/osrelease");
  if (text_of(root / "sys/kernel/realtime") == "1") return {"kernel", release + ", PREEMPT_RT", ""};
  if (release.empty()) return {"kernel", "unknown", ""};
  return {"kernel", release + ", without PREEMPT_RT",
          "use a kernel with PREEMPT_RT, which bounds the wake-up latency: linux-image-rt-amd64 on Debian"};
}

Finding tick(const fs::path& root) {
  const std::string config = text_of(root / "boot" / ("config-" + text_of(root / "proc/sys/kernel/osrelease")));
  const std::string hz = value_after(config, "CONFIG_HZ=");
  if (hz.empty()) return {"tick", "unknown", ""};
  if (value_after(config, "CONFIG_HIGH_RES_TIMERS=") == "y") {
    return {"tick", hz + " Hz, with high-resolution timers", ""};
  }
  return {"tick", hz + " Hz, without high-resolution timers", "use a kernel with CONFIG_HIGH_RES_TIMERS"};
}

Finding governor(const fs::path& root) {
  std::set<std::string> governors;
  std::error_code none;
  for (const auto& cpu : fs::directory_iterator(root / "sys/devices/system/cpu", none)) {
    const std::string name = text_of(cpu.path() / "cpufreq/scaling_governor");
    if (!name.empty()) governors.insert(name);
  }
  if (governors.empty()) return {"governor", "unknown", ""};
  std::string all;
  for (const std::string& name : governors) all += (all.empty() ? "" : ", ") + name;
  if (governors == std::set<std::string>{"performance"}) return {"governor", all, ""};
  return {"governor", all, "run `cpupower frequency-set -g performance`: a processor at a low frequency wakes up late"};
}

Finding autosuspend(const fs::path& root) {
  const auto seconds = number_of(text_of(root / "sys/module/usbcore/parameters/autosuspend"));
  if (!seconds) return {"usb_autosuspend", "unknown", ""};
  if (*seconds < 0) return {"usb_autosuspend", "off", ""};
  return {"usb_autosuspend", "after " + std::to_string(*seconds) + " s",
          "set the kernel parameter `usbcore.autosuspend=-1`, or a udev rule with ATTR{power/control}=\"on\" for the "
          "device"};
}

Finding priority_limit(const fs::path& root) {
  const std::string limit = value_after(text_of(root / "proc/self/limits"), "Max realtime priority");
  const auto number = number_of(limit);
  if (limit.empty()) return {"rtprio_limit", "unknown", ""};
  if (!number || *number >= kHapticPriority) return {"rtprio_limit", limit, ""};
  return {"rtprio_limit", limit,
          "set LimitRTPRIO=" + std::to_string(kHapticPriority) +
              " in the systemd unit, or rtprio in /etc/security/limits.d (not required for root)"};
}

Finding memory_limit(const fs::path& root) {
  const std::string limit = value_after(text_of(root / "proc/self/limits"), "Max locked memory");
  if (limit.empty()) return {"memlock_limit", "unknown", ""};
  if (!number_of(limit)) return {"memlock_limit", limit, ""};
  return {"memlock_limit", limit + " bytes",
          "set LimitMEMLOCK=infinity in the systemd unit, or memlock in /etc/security/limits.d (not required for "
          "root): a server locks about 14 MB, 1 MB for each further device, and more while recording"};
}

Finding isolation(const fs::path& root) {
  if (!fs::exists(root / "sys/devices/system/cpu/isolated")) return {"isolated_cpus", "unknown", ""};
  const std::string isolated = text_of(root / "sys/devices/system/cpu/isolated");
  const std::string without_tick = text_of(root / "sys/devices/system/cpu/nohz_full");
  if (isolated.empty()) {
    return {"isolated_cpus", "none",
            "if other programs run on this machine, set the kernel parameters `isolcpus=N nohz_full=N rcu_nocbs=N`, "
            "and `cpu = N` in [loop] of the scene"};
  }
  const bool some = !without_tick.empty() && without_tick != "(null)";
  return {"isolated_cpus", isolated + (some ? ", without a tick: " + without_tick : ""), ""};
}

/// Checks the exit latency of the deepest sleep state. A running server may disable this state.
Finding sleep(const fs::path& root) {
  constexpr std::int64_t kNoticed = 20;  // µs; similar to the usual wake-up latency
  std::optional<std::int64_t> deepest;
  std::error_code none;
  for (const auto& state : fs::directory_iterator(root / "sys/devices/system/cpu/cpu0/cpuidle", none)) {
    const auto latency = number_of(text_of(state.path() / "latency"));
    if (latency) deepest = std::max(deepest.value_or(0), *latency);
  }
  if (!deepest) return {"cpu_sleep", "unknown", ""};
  const std::string found = "up to " + std::to_string(*deepest) + " µs to wake";
  if (*deepest <= kNoticed) return {"cpu_sleep", found, ""};
  if (access((root / "dev/cpu_dma_latency").c_str(), W_OK) == 0) {
    return {"cpu_sleep", found + " (disabled while the server is running)", ""};
  }
  return {
      "cpu_sleep", found,
      "allow the server to disable it with a udev rule: KERNEL==\"cpu_dma_latency\", GROUP=\"plugdev\", MODE=\"0660\""};
}

Finding slack(const fs::path& root) {
  const auto ns = number_of(text_of(root / "proc/self/timerslack_ns"));
  if (!ns) return {"timer_slack", "unknown", ""};
  return {"timer_slack", std::to_string(*ns) + " ns (the server requests 1 ns for its own threads)", ""};
}

Finding throttling(const fs::path& root) {
  const auto runtime = number_of(text_of(root / "proc/sys/kernel/sched_rt_runtime_us"));
  const auto period = number_of(text_of(root / "proc/sys/kernel/sched_rt_period_us"));
  if (!runtime || !period) return {"rt_throttling", "unknown", ""};
  if (*runtime < 0) return {"rt_throttling", "off", ""};
  return {"rt_throttling",
          std::to_string(*runtime) + " of each " + std::to_string(*period) + " µs for real-time threads",
          *runtime * 2 < *period ? "run `sysctl kernel.sched_rt_runtime_us=950000`, the default of the kernel" : ""};
}

Finding machine(const fs::path& root) {
  const std::string cpus = text_of(root / "proc/cpuinfo");
  if (cpus.empty()) return {"machine", "unknown", ""};
  if (cpus.find(" hypervisor") == std::string::npos) return {"machine", "not virtual", ""};
  return {"machine", "virtual",
          "do not use it for a real device: the host can stop the whole machine for 20 ms and more"};
}

Finding aes(const fs::path& root) {
  const std::string cpus = text_of(root / "proc/cpuinfo");
  if (cpus.empty()) return {"aes", "unknown", ""};
  const auto has = [&](std::string_view flag) {
    std::istringstream words(cpus);
    return std::find(std::istream_iterator<std::string>(words), {}, flag) != std::istream_iterator<std::string>();
  };
  if (has("aes") && has("pclmulqdq")) {
    return {"aes", "in hardware: sessions are encrypted with " + names_of(all_suites()), ""};
  }
  return {"aes", "none: sessions are encrypted with " + names_of({Suite::kNoise}),
          "AES requires half of the time or less: in a virtual machine, use a CPU model with the AES instructions of "
          "the host"};
}

Finding processors(const fs::path& root) {
  const std::size_t count = kernel_files::processors_of(text_of(root / "sys/devices/system/cpu/online")).size();
  if (count == 0) return {"processors", "unknown", ""};
  if (count == 1) {
    return {"processors", "1",
            "use a machine with 2 or more processors, for the network thread and the engines; `[network] busy = true` "
            "is refused"};
  }
  return {"processors", std::to_string(count) + " (`[network] busy = true` uses a whole one)", ""};
}

double us(Duration time) { return seconds(time) * 1e6; }

nlohmann::ordered_json as_json(const Diagnosis::WakeUps& wakes) {
  return {{"n", wakes.count}, {"p50_us", us(wakes.median)}, {"p99_us", us(wakes.p99)}, {"max_us", us(wakes.longest)}};
}

void add_words(std::ostringstream& out, std::string_view name, const Diagnosis::WakeUps& wakes) {
  out << "  " << std::left << std::setw(18) << name << std::right << std::fixed << std::setprecision(0) << "median "
      << std::setw(5) << us(wakes.median) << " µs, p99 " << std::setw(5) << us(wakes.p99) << " µs, longest "
      << std::setw(6) << us(wakes.longest) << " µs   (" << wakes.count << " wake-ups)\n";
}

}  // namespace

Diagnosis::WakeUps measure_wake_ups(const WakeUpClock& clock, Duration period, std::size_t count) {
  std::vector<Duration> late(count);
  LocalTime due = clock.now();
  for (Duration& one : late) {
    due += period;
    clock.sleep_until(due);
    const LocalTime now = clock.now();
    one = now - due;
    due = std::max(due, now - period);  // do not catch up after a pause
  }
  std::sort(late.begin(), late.end());
  return {count, late[count / 2], late[count * 99 / 100], late.back()};
}

std::vector<Diagnosis::Finding> look_around(const fs::path& root) {
  return {kernel(root),         tick(root),         machine(root),     processors(root), governor(root),
          priority_limit(root), memory_limit(root), autosuspend(root), isolation(root),  sleep(root),
          throttling(root),     slack(root),        aes(root)};
}

Diagnosis diagnose(const WakeUpClock& clock, std::optional<std::uint32_t> cpu) {
  Diagnosis diagnosis;
  diagnosis.findings = look_around("/");
  for (auto& finding : look_at_network("/", {.cpu = cpu, .card = ask_network_card})) {
    diagnosis.findings.push_back(std::move(finding));
  }
  std::thread([&] { diagnosis.ordinary = measure_wake_ups(clock, kPeriod, kWakeUps); }).join();
  std::thread([&] {
    diagnosis.refused = enter_realtime(kHapticPriority);
    if (auto refused = cpu ? stay_on(*cpu) : std::nullopt) diagnosis.refused.push_back(std::move(*refused));
    diagnosis.realtime = measure_wake_ups(clock, kPeriod, kWakeUps);
  }).join();
  return diagnosis;
}

std::string in_words(const Diagnosis& diagnosis) {
  std::ostringstream out;
  out << "Wake-up latency of a thread:\n";
  add_words(out, "ordinary", diagnosis.ordinary);
  add_words(out, "haptic thread", diagnosis.realtime);
  for (const std::string& refused : diagnosis.refused) out << "  not possible: " << refused << '\n';
  out << "Settings of the machine:\n";
  for (const auto& [key, found, advice] : diagnosis.findings) {
    out << "  " << std::left << std::setw(18) << key << found << '\n';
    if (!advice.empty()) out << "                    → " << advice << '\n';
  }
  return out.str();
}

std::string in_json(const Diagnosis& diagnosis) {
  using Json = nlohmann::ordered_json;
  Json out = {{"wake_ups", {{"ordinary", as_json(diagnosis.ordinary)}, {"realtime", as_json(diagnosis.realtime)}}},
              {"refused", diagnosis.refused},
              {"findings", Json::array()}};
  for (const auto& [key, found, advice] : diagnosis.findings) {
    out["findings"].push_back(
        {{"key", key}, {"found", found}, {"advice", advice.empty() ? Json(nullptr) : Json(advice)}});
  }
  return out.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace tendon
