// SPDX-License-Identifier: Apache-2.0
#include "server/commands/doctor_network.h"

#include <algorithm>
#include <cctype>
#include <iterator>
#include <set>
#include <sstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "server/commands/kernel_files.h"

namespace tendon {
namespace {

namespace fs = std::filesystem;
using kernel_files::list_of;
using kernel_files::number_of;
using kernel_files::Processors;
using kernel_files::processors_of;
using kernel_files::text_of;
using kernel_files::value_after;
using Finding = Diagnosis::Finding;

/// µs; similar to the usual wake-up latency of a thread.
constexpr std::uint32_t kNoticed = 10;

/// With these drivers, rx-usecs from 1 to 4 is not a time but a mode, in which the card changes the time with the
/// traffic (InterruptThrottleRate in Documentation/networking/device_drivers/ethernet/intel of the kernel).
constexpr std::uint32_t kMostModes = 4;
bool has_modes(std::string_view driver) {
  const std::set<std::string_view> drivers = {"e1000", "e1000e", "igb", "igbvf", "igc", "ixgbe", "ixgbevf"};
  return drivers.contains(driver);
}

struct Interface {
  std::string name;
  std::string driver;
  bool wireless = false;
  Processors interrupts{};  ///< their numbers
  NetworkCard card{};
};

struct Machine {
  fs::path root;
  bool knows_interfaces = false;
  std::vector<Interface> interfaces{};  ///< connected cards
  Processors haptic{};                  ///< the processors on which the haptic thread may run
  Processors others{};
  Processors without_tick{};
};

std::string joined(const std::vector<std::string>& texts, std::string_view between) {
  std::string all;
  for (const std::string& text : texts) all += (all.empty() ? "" : std::string(between)) + text;
  return all;
}

/// The numbers of the interrupts in proc/interrupts whose last word is `name`, or starts with it and a dash.
Processors interrupts_named(const fs::path& root, const std::string& name) {
  Processors numbers;
  std::istringstream lines(text_of(root / "proc/interrupts"));
  for (std::string line; std::getline(lines, line);) {
    const std::string word = line.substr(line.find_last_of(" \t") + 1);
    if (word != name && !word.starts_with(name + "-")) continue;
    const auto start = line.find_first_not_of(' ');
    if (const auto number = number_of(line.substr(start, line.find(':') - start))) numbers.insert(*number);
  }
  return numbers;
}

Processors interrupts_of(const fs::path& root, const fs::path& interface, std::string_view driver) {
  Processors numbers;
  std::error_code none;
  // A virtio card is a child of the PCI device that has the interrupts.
  const char* const folder = driver == "virtio_net" ? "device/../msi_irqs" : "device/msi_irqs";
  for (const auto& one : fs::directory_iterator(interface / folder, none)) {
    if (const auto number = number_of(one.path().filename().string())) numbers.insert(*number);
  }
  if (!numbers.empty()) return numbers;
  const auto line = number_of(text_of(interface / "device/irq"));
  if (line && *line > 0) return {*line};
  return interrupts_named(root, interface.filename().string());
}

/// Bridges, tunnels and the loopback have no device.
std::vector<Interface> connected_cards(const fs::path& root, const NetworkQuestions& questions) {
  std::vector<Interface> cards;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(root / "sys/class/net", none)) {
    const fs::path& path = entry.path();
    if (!fs::exists(path / "device", none) || text_of(path / "operstate") != "up") continue;
    const std::string name = path.filename().string();
    const std::string driver = fs::read_symlink(path / "device/driver", none).filename().string();
    cards.push_back({.name = name,
                     .driver = driver,
                     .wireless = fs::exists(path / "phy80211", none) || fs::exists(path / "wireless", none),
                     .interrupts = interrupts_of(root, path, driver),
                     .card = questions.card ? questions.card(name) : NetworkCard()});
  }
  std::ranges::sort(cards, {}, &Interface::name);
  return cards;
}

Machine machine_of(const fs::path& root, const NetworkQuestions& questions) {
  const fs::path cpus = root / "sys/devices/system/cpu";
  std::error_code none;
  Machine machine{.root = root,
                  .knows_interfaces = fs::is_directory(root / "sys/class/net", none),
                  .interfaces = connected_cards(root, questions),
                  .haptic = processors_of(text_of(cpus / "isolated")),
                  .others = processors_of(text_of(cpus / "online")),
                  .without_tick = processors_of(text_of(cpus / "nohz_full"))};
  if (questions.cpu) machine.haptic = {*questions.cpu};
  for (const std::int64_t one : machine.haptic) machine.others.erase(one);
  return machine;
}

Finding coalescing(const Machine& machine) {
  std::vector<std::string> found;
  std::vector<std::string> cures;
  for (const Interface& one : machine.interfaces) {
    if (!one.card.coalescing) continue;
    const auto [us, adaptive] = *one.card.coalescing;
    const bool mode = has_modes(one.driver) && us > 0 && us <= kMostModes;
    found.push_back(one.name + (adaptive || mode ? " adaptive" : " " + std::to_string(us) + " µs"));
    if (!adaptive && !mode && us <= kNoticed) continue;
    cures.push_back("`ethtool -C " + one.name + (adaptive ? " adaptive-rx off" : "") + " rx-usecs 0`");
  }
  if (found.empty()) return {"nic_coalescing", "unknown", ""};
  return {"nic_coalescing", joined(found, ", "),
          cures.empty() ? ""
                        : "run " + joined(cures, " and ") +
                              ": the network card keeps received datagrams, to interrupt the processor less often"};
}

/// In the form that a shell expands: 24, {24,26} or {24..27}.
std::string in_braces(const Processors& numbers) {
  if (numbers.size() == 1) return std::to_string(*numbers.begin());
  std::string list = list_of(numbers);
  const auto dash = list.find('-');
  if (dash != std::string::npos && list.find(',') == std::string::npos) return "{" + list.replace(dash, 1, "..") + "}";
  list.clear();
  for (const std::int64_t one : numbers) list += (list.empty() ? "" : ",") + std::to_string(one);
  return "{" + list + "}";
}

/// Returns the processors that can receive an interrupt. Old kernels only have the permitted ones.
Processors receivers(const fs::path& root, std::int64_t interrupt) {
  const fs::path folder = root / "proc/irq" / std::to_string(interrupt);
  const Processors effective = processors_of(text_of(folder / "effective_affinity_list"));
  return effective.empty() ? processors_of(text_of(folder / "smp_affinity_list")) : effective;
}

Finding interrupts(const Machine& machine) {
  bool known = false;
  Processors hit;
  Processors moved;
  std::vector<std::string> found;
  for (const Interface& one : machine.interfaces) {
    Processors of_this;
    for (const std::int64_t number : one.interrupts) {
      const Processors on = receivers(machine.root, number);
      known = known || !on.empty();
      Processors both;
      std::ranges::set_intersection(on, machine.haptic, std::inserter(both, both.end()));
      if (both.empty()) continue;
      of_this.insert(number);
      hit.merge(both);
    }
    if (of_this.empty()) continue;
    found.push_back(one.name + " (" + list_of(of_this) + ")");
    moved.merge(of_this);
  }
  if (!known) return {"nic_interrupts", "unknown", ""};
  if (machine.haptic.empty()) return {"nic_interrupts", "no processor is isolated for the haptic thread", ""};
  if (found.empty()) return {"nic_interrupts", "none on processor " + list_of(machine.haptic), ""};
  const std::string text = joined(found, ", ") + " on processor " + list_of(hit);
  if (machine.others.empty()) return {"nic_interrupts", text, ""};
  return {"nic_interrupts", text,
          "run `echo " + list_of(machine.others) + " | tee /proc/irq/" + in_braces(moved) +
              "/smp_affinity_list` as root, or set the kernel parameter `irqaffinity=" + list_of(machine.others) +
              "`: each datagram interrupts the haptic thread"};
}

/// Returns the bits of a hexadecimal mask such as "8" or "00000001,00000008", or an empty set if it is none.
Processors processors_of_mask(std::string mask) {
  if (mask.starts_with("0x")) mask.erase(0, 2);
  std::erase(mask, ',');
  Processors all;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    const auto digit = number_of(mask.substr(mask.size() - 1 - i, 1), 16);
    if (!digit) return {};
    for (int bit = 0; bit < 4; ++bit) {
      if ((*digit >> bit & 1) != 0) all.insert(static_cast<std::int64_t>(4 * i) + bit);
    }
  }
  return all;
}

/// Returns the processors that irqbalance leaves alone. By default, these are the isolated ones and those without a
/// tick, but a list in its file replaces them.
Processors banned(const Machine& machine) {
  for (const char* const file : {"etc/default/irqbalance", "etc/sysconfig/irqbalance"}) {
    const std::string text = text_of(machine.root / file);
    const auto said = [&text](std::string_view key) {
      std::string value = value_after(text, key);
      std::erase_if(value, [](char c) { return c == '"' || c == '\''; });
      return value;
    };
    if (const std::string list = said("IRQBALANCE_BANNED_CPULIST="); !list.empty()) return processors_of(list);
    if (const std::string mask = said("IRQBALANCE_BANNED_CPUS="); !mask.empty()) return processors_of_mask(mask);
  }
  Processors all = processors_of(text_of(machine.root / "sys/devices/system/cpu/isolated"));
  all.insert(machine.without_tick.begin(), machine.without_tick.end());
  return all;
}

/// Returns whether a process has this name, or nothing if there are no processes in proc.
std::optional<bool> runs(const fs::path& root, std::string_view name) {
  bool any = false;
  std::error_code none;
  for (const auto& process : fs::directory_iterator(root / "proc", none)) {
    const std::string file = process.path().filename().string();
    if (!std::ranges::all_of(file, [](unsigned char c) { return std::isdigit(c) != 0; })) continue;
    any = true;
    if (text_of(process.path() / "comm") == name) return true;
  }
  return any ? std::optional(false) : std::nullopt;
}

Finding balance(const Machine& machine) {
  const auto running = runs(machine.root, "irqbalance");
  if (!running) return {"irqbalance", "unknown", ""};
  if (!*running) return {"irqbalance", "not running", ""};
  if (machine.haptic.empty()) {
    return {"irqbalance", "running, and may use any processor",
            "run `systemctl disable --now irqbalance`, or isolate a processor for the haptic thread: it moves "
            "interrupts to the processors that are idle"};
  }
  const std::string haptic = list_of(machine.haptic);
  if (std::ranges::includes(banned(machine), machine.haptic)) {
    return {"irqbalance", "running, but does not use processor " + haptic, ""};
  }
  return {"irqbalance", "running, and may use processor " + haptic,
          "set IRQBALANCE_BANNED_CPULIST=" + haptic +
              " in /etc/default/irqbalance and run `systemctl restart irqbalance`: it moves interrupts to the "
              "processors that are idle"};
}

/// The haptic loop reads the clock several times in each step.
Finding clock_source(const Machine& machine) {
  const fs::path folder = machine.root / "sys/devices/system/clocksource/clocksource0";
  const std::string current = text_of(folder / "current_clocksource");
  if (current.empty()) return {"clock_source", "unknown", ""};
  // Clocks of hypervisors, ARM and RISC-V are read without a system call, as the TSC is.
  const std::set<std::string_view> devices = {"hpet", "acpi_pm", "pit", "jiffies", "refined-jiffies"};
  if (!devices.contains(current)) return {"clock_source", current, ""};
  constexpr std::string_view kWhy = ": each reading of this clock is a system call of about a microsecond";
  std::istringstream available(text_of(folder / "available_clocksource"));
  if (std::find(std::istream_iterator<std::string>(available), {}, "tsc") != std::istream_iterator<std::string>()) {
    return {"clock_source", current, "set the kernel parameter `clocksource=tsc`" + std::string(kWhy)};
  }
  return {"clock_source", current,
          "run `dmesg | grep -i tsc` to find out why the kernel does not use the TSC, and update the firmware; if the "
          "TSC is reliable, set the kernel parameter `tsc=reliable`" +
              std::string(kWhy)};
}

/// A finding with one setting that is on or off for each card.
Finding switched(const Machine& machine, std::string_view key, std::optional<bool> NetworkCard::*setting,
                 std::string_view before, std::string_view after, std::string_view why) {
  std::vector<std::string> found;
  std::vector<std::string> cures;
  for (const Interface& one : machine.interfaces) {
    const std::optional<bool>& on = one.card.*setting;
    if (!on) continue;
    found.push_back(one.name + (*on ? " on" : " off"));
    if (*on) cures.push_back("`" + std::string(before) + one.name + std::string(after) + "`");
  }
  if (found.empty()) return {key, "unknown", ""};
  return {key, joined(found, ", "), cures.empty() ? "" : "run " + joined(cures, " and ") + std::string(why)};
}

Finding power_save(const Machine& machine) {
  const bool wired = machine.knows_interfaces &&
                     std::ranges::none_of(machine.interfaces, [](const Interface& one) { return one.wireless; });
  if (wired) return {"wifi_power_save", "no Wi-Fi", ""};
  return switched(machine, "wifi_power_save", &NetworkCard::power_save, "iw dev ", " set power_save off",
                  ", and set `wifi.powersave = 2` for NetworkManager: the radio sleeps between two beacons, and "
                  "datagrams wait for about 100 ms");
}

Finding energy_efficient(const Machine& machine) {
  return switched(machine, "eee", &NetworkCard::energy_efficient, "ethtool --set-eee ", " eee off",
                  ": the link sleeps between datagrams, and each datagram waits until it has woken up");
}

}  // namespace

std::vector<Finding> look_at_network(const fs::path& root, const NetworkQuestions& questions) {
  const Machine machine = machine_of(root, questions);
  return {coalescing(machine),   interrupts(machine), balance(machine),
          clock_source(machine), power_save(machine), energy_efficient(machine)};
}

}  // namespace tendon
