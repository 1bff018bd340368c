// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/commands/doctor.h"
#include "server/commands/doctor_network.h"
#include "tests/server/scratch_folder.h"

namespace tendon::testing {

using Findings = std::map<std::string, Diagnosis::Finding, std::less<>>;

/// A folder with the files of proc, sys, boot and etc that the doctor reads, and the answers of network drivers.
class PlantedMachine {
 public:
  void say(const std::string& file, const std::string& text) { std::ofstream(make(file)) << text << '\n'; }

  /// A connected card of a PCI slot, such as say_card("eth0", "igb", {24, 25}).
  void say_card(const std::string& name, const std::string& driver, const std::vector<int>& interrupts = {}) {
    const std::string device = "sys/class/net/" + name + "/device";
    say("sys/class/net/" + name + "/operstate", "up");
    for (const int interrupt : interrupts) say(device + "/msi_irqs/" + std::to_string(interrupt), "msix");
    std::filesystem::create_symlink("../../../bus/pci/drivers/" + driver, make(device + "/driver"));
  }
  void say_wireless(const std::string& name) { say("sys/class/net/" + name + "/phy80211/name", "phy0"); }
  void say_affinity(int interrupt, const std::string& processors) {
    say("proc/irq/" + std::to_string(interrupt) + "/effective_affinity_list", processors);
  }

  Findings look() const { return named(look_around(folder_.path())); }
  Findings look_at_network() const {
    return named(tendon::look_at_network(folder_.path(), {.cpu = cpu, .card = [this](const std::string& name) {
                                                            const auto known = cards.find(name);
                                                            return known == cards.end() ? NetworkCard() : known->second;
                                                          }}));
  }

  std::map<std::string, NetworkCard> cards;
  std::optional<std::uint32_t> cpu;

 private:
  std::filesystem::path make(const std::string& file) {
    auto path = folder_.path() / file;
    std::filesystem::create_directories(path.parent_path());
    return path;
  }
  static Findings named(const std::vector<Diagnosis::Finding>& all) {
    Findings findings;
    for (const auto& finding : all) findings.emplace(finding.key, finding);
    return findings;
  }

  ScratchFolder folder_;
};

}  // namespace tendon::testing
