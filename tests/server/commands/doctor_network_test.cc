// SPDX-License-Identifier: Apache-2.0
#include "server/commands/doctor_network.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "tests/server/commands/planted_machine.h"
#include "tests/support/dice.h"

namespace tendon::doctor_network_test {
namespace {

using testing::Findings;
using Machine = testing::PlantedMachine;

/// This machine has no faults. It has 4 processors, of which the last is isolated, and two wired cards.
void make_healthy(Machine& machine) {
  machine.say("sys/devices/system/cpu/online", "0-3");
  machine.say("sys/devices/system/cpu/isolated", "3");
  machine.say("sys/devices/system/clocksource/clocksource0/current_clocksource", "tsc");
  machine.say("sys/devices/system/clocksource/clocksource0/available_clocksource", "tsc hpet acpi_pm ");
  machine.say("proc/1/comm", "systemd");
  machine.say_card("eth0", "r8169", {24});
  machine.say_card("eth1", "igb", {30, 31, 32});
  for (const int interrupt : {24, 30, 31, 32}) machine.say_affinity(interrupt, "0-2");
  machine.cards["eth0"] = {.coalescing = {{.rx_usecs = 0}}, .energy_efficient = false};
  machine.cards["eth1"] = {.coalescing = {{.rx_usecs = 0}}, .energy_efficient = false};
}

void run_irqbalance(Machine& machine) { machine.say("proc/412/comm", "irqbalance"); }

struct Fault {
  std::string name;
  std::string key;
  std::string found;
  std::string cure;  ///< in the advice
  std::function<void(Machine&)> plant;
};

std::vector<Fault> faults() {
  const auto clock = [](const std::string& current, const std::string& available) {
    return [=](Machine& m) {
      m.say("sys/devices/system/clocksource/clocksource0/current_clocksource", current);
      m.say("sys/devices/system/clocksource/clocksource0/available_clocksource", available);
    };
  };
  return {
      {"a fixed time", "nic_coalescing", "eth0 50 µs, eth1 0 µs",
       "`ethtool -C eth0 rx-usecs 0`:", [](Machine& m) { m.cards["eth0"].coalescing = {{.rx_usecs = 50}}; }},
      {"an adaptive time", "nic_coalescing", "eth0 adaptive, eth1 0 µs",
       "`ethtool -C eth0 adaptive-rx off rx-usecs 0`:",
       [](Machine& m) { m.cards["eth0"].coalescing = {{.rx_usecs = 8, .adaptive = true}}; }},
      {"a mode of Intel", "nic_coalescing", "eth0 0 µs, eth1 adaptive",
       "`ethtool -C eth1 rx-usecs 0`:", [](Machine& m) { m.cards["eth1"].coalescing = {{.rx_usecs = 3}}; }},
      {"both cards", "nic_coalescing", "eth0 11 µs, eth1 100 µs",
       "`ethtool -C eth0 rx-usecs 0` and `ethtool -C eth1 rx-usecs 0`:",
       [](Machine& m) {
         m.cards["eth0"].coalescing = {{.rx_usecs = 11}};
         m.cards["eth1"].coalescing = {{.rx_usecs = 100}};
       }},
      {"the interrupt of a card", "nic_interrupts", "eth0 (24) on processor 3",
       "`echo 0-2 | tee /proc/irq/24/smp_affinity_list`", [](Machine& m) { m.say_affinity(24, "3"); }},
      {"one of several queues", "nic_interrupts", "eth1 (31) on processor 3",
       "`echo 0-2 | tee /proc/irq/31/smp_affinity_list`", [](Machine& m) { m.say_affinity(31, "3"); }},
      {"all queues", "nic_interrupts", "eth1 (30-32) on processor 3", "/proc/irq/{30..32}/smp_affinity_list`",
       [](Machine& m) {
         for (const int interrupt : {30, 31, 32}) m.say_affinity(interrupt, "3");
       }},
      {"two cards", "nic_interrupts", "eth0 (24), eth1 (32) on processor 3", "/proc/irq/{24,32}/smp_affinity_list`",
       [](Machine& m) {
         m.say_affinity(24, "3");
         m.say_affinity(32, "2-3");
       }},
      {"an old kernel", "nic_interrupts", "eth0 (24) on processor 3", "`irqaffinity=0-2`",
       [](Machine& m) {
         m.say_affinity(24, "");
         m.say("proc/irq/24/smp_affinity_list", "0-3");
       }},
      {"a card without MSI", "nic_interrupts", "eth2 (19) on processor 3", "/proc/irq/19/smp_affinity_list`",
       [](Machine& m) {
         m.say_card("eth2", "e1000");
         m.say("sys/class/net/eth2/device/irq", "19");
         m.say_affinity(19, "3");
       }},
      {"a virtual card", "nic_interrupts", "eth2 (41-42) on processor 3", "/proc/irq/{41..42}/smp_affinity_list`",
       [](Machine& m) {
         m.say_card("eth2", "virtio_net");
         for (const char* const one : {"41", "42"}) m.say(std::string("sys/class/net/eth2/msi_irqs/") + one, "msix");
         m.say_affinity(41, "3");
         m.say_affinity(42, "3");
       }},
      {"a card without PCI", "nic_interrupts", "end0 (35) on processor 3", "/proc/irq/35/smp_affinity_list`",
       [](Machine& m) {
         m.say_card("end0", "bcmgenet");
         m.say(
             "proc/interrupts",
             "           CPU0       CPU1\n 35:   1  2  GICv2 189 Level     end0\n 36:   1  2  GICv2 190 Level  end01");
         m.say_affinity(35, "3");
         m.say_affinity(36, "3");
       }},
      {"a processor that is not isolated", "nic_interrupts", "eth0 (24) on processor 2",
       "`echo 0-1,3 | tee /proc/irq/24/smp_affinity_list`",
       [](Machine& m) {
         m.cpu = 2;
         m.say_affinity(24, "2");
         for (const int interrupt : {30, 31, 32}) m.say_affinity(interrupt, "0-1");
       }},
      {"irqbalance without isolation", "irqbalance", "running, and may use any processor",
       "`systemctl disable --now irqbalance`",
       [](Machine& m) {
         run_irqbalance(m);
         m.say("sys/devices/system/cpu/isolated", "");
       }},
      {"irqbalance and a list", "irqbalance", "running, and may use processor 3", "IRQBALANCE_BANNED_CPULIST=3 ",
       [](Machine& m) {
         run_irqbalance(m);
         m.say("etc/default/irqbalance", "#IRQBALANCE_BANNED_CPULIST=3\nIRQBALANCE_BANNED_CPULIST=\"1-2\"");
       }},
      {"irqbalance and a mask", "irqbalance", "running, and may use processor 3", "IRQBALANCE_BANNED_CPULIST=3 ",
       [](Machine& m) {
         run_irqbalance(m);
         m.say("etc/sysconfig/irqbalance", "IRQBALANCE_BANNED_CPUS=00000008,00000004");
       }},
      {"irqbalance and a processor that is not isolated", "irqbalance", "running, and may use processor 1",
       "IRQBALANCE_BANNED_CPULIST=1 ",
       [](Machine& m) {
         run_irqbalance(m);
         m.cpu = 1;
         for (const int interrupt : {24, 30, 31, 32}) m.say_affinity(interrupt, "0");
       }},
      {"a slow clock", "clock_source", "hpet", "`clocksource=tsc`", clock("hpet", "tsc hpet acpi_pm ")},
      {"a TSC that failed", "clock_source", "acpi_pm", "`dmesg | grep -i tsc`", clock("acpi_pm", "hpet acpi_pm ")},
      {"a virtual machine that lost its clock", "clock_source", "acpi_pm", "`tsc=reliable`",
       clock("acpi_pm", "hyperv_clocksource_tsc_page acpi_pm ")},
      {"Wi-Fi", "wifi_power_save", "wlan0 on", "`iw dev wlan0 set power_save off`",
       [](Machine& m) {
         m.say_card("wlan0", "iwlwifi");
         m.say_wireless("wlan0");
         m.cards["wlan0"] = {.power_save = true};
       }},
      {"the second Wi-Fi", "wifi_power_save", "wlan0 off, wlan1 on", "`iw dev wlan1 set power_save off`",
       [](Machine& m) {
         for (const char* const name : {"wlan0", "wlan1"}) {
           m.say_card(name, "mt7921e");
           m.say_wireless(name);
           m.cards[name] = {.power_save = std::string(name) == "wlan1"};
         }
       }},
      {"EEE", "eee", "eth0 on, eth1 off", "`ethtool --set-eee eth0 eee off`",
       [](Machine& m) { m.cards["eth0"].energy_efficient = true; }},
  };
}

TEST(DoctorNetwork, NamesThePlantedFaultAndItsCureAndNothingElse) {
  EXPECT_GE(faults().size(), 20U);
  for (const Fault& fault : faults()) {
    Machine machine;
    make_healthy(machine);
    fault.plant(machine);
    for (const auto& [key, finding] : machine.look_at_network()) {
      if (key == fault.key) {
        EXPECT_EQ(finding.found, fault.found) << fault.name;
        EXPECT_NE(finding.advice.find(fault.cure), std::string::npos) << fault.name << ": " << finding.advice;
      } else {
        EXPECT_EQ(finding.advice, "") << fault.name << ": " << key << " " << finding.found;
      }
    }
  }
}

TEST(DoctorNetwork, OfAHealthyMachineItSaysWhatItFound) {
  Machine machine;
  make_healthy(machine);
  run_irqbalance(machine);
  machine.say("etc/default/irqbalance", "IRQBALANCE_BANNED_CPUS=00000000,00000008");
  const Findings findings = machine.look_at_network();
  EXPECT_EQ(findings.at("nic_coalescing").found, "eth0 0 µs, eth1 0 µs");
  EXPECT_EQ(findings.at("nic_interrupts").found, "none on processor 3");
  EXPECT_EQ(findings.at("irqbalance").found, "running, but does not use processor 3");
  EXPECT_EQ(findings.at("clock_source").found, "tsc");
  EXPECT_EQ(findings.at("wifi_power_save").found, "no Wi-Fi");
  EXPECT_EQ(findings.at("eee").found, "eth0 off, eth1 off");
}

TEST(DoctorNetwork, OfWhatTheKernelDoesNotSayItClaimsNothing) {
  const Findings findings = Machine().look_at_network();
  EXPECT_EQ(findings.size(), 6U);
  for (const auto& [key, finding] : findings) {
    EXPECT_EQ(finding.found, "unknown") << key;
    EXPECT_EQ(finding.advice, "") << key;
  }
}

TEST(DoctorNetwork, DamagedFilesAreUnknown) {
  Machine machine;
  machine.say_card("eth0", "igb", {24});
  machine.say("sys/devices/system/cpu/online", "0-9999999999");
  machine.say("sys/devices/system/cpu/isolated", "3-x");
  machine.say("sys/class/net/eth0/device/msi_irqs/none", "");
  machine.say("proc/irq/24/effective_affinity_list", "-");
  machine.say("proc/irq/24/smp_affinity_list", std::string(100'000, ','));
  machine.say("proc/interrupts", ":\neth0\n x: eth0");
  machine.say("etc/default/irqbalance", "IRQBALANCE_BANNED_CPUS=0xzz");
  const Findings findings = machine.look_at_network();
  EXPECT_EQ(findings.at("nic_interrupts").found, "unknown");
  for (const auto& [key, finding] : findings) EXPECT_EQ(finding.advice, "") << key << " " << finding.found;
}

/// Draws a machine without faults, of many kinds.
class DrawnMachine {
 public:
  explicit DrawnMachine(unsigned seed) : dice_(seed) {
    const int cpus = whole(2, 128);
    const bool isolated = chance(0.6);
    haptic_ = isolated || chance(0.5) ? cpus - 1 : -1;
    if (!isolated && haptic_ >= 0) machine.cpu = haptic_;
    machine.say("sys/devices/system/cpu/online", "0-" + std::to_string(cpus - 1));
    if (isolated || chance(0.5)) {
      machine.say("sys/devices/system/cpu/isolated", isolated ? std::to_string(haptic_) : "");
    }
    machine.say("proc/1/comm", "systemd");
    draw_clock();
    draw_irqbalance(isolated);
    for (int i = whole(0, 3); i > 0; --i) draw_card("eth" + std::to_string(i), false);
    if (chance(0.4)) draw_card("wlan0", true);
    draw_what_is_not_used();
  }

  Machine machine;

 private:
  int whole(int least, int most) { return static_cast<int>(dice_.within(least, most + 1)); }
  bool chance(double share) { return dice_.chance(share); }
  std::string other_processor() { return std::to_string(haptic_ < 0 ? whole(0, 1) : whole(0, haptic_ - 1)); }

  void draw_clock() {
    const std::vector<std::pair<const char*, const char*>> clocks = {
        {"tsc", "tsc hpet acpi_pm"},
        {"tsc", "tsc kvm-clock acpi_pm"},
        {"kvm-clock", "kvm-clock"},
        {"arch_sys_counter", "arch_sys_counter"},
        {"riscv_clocksource", "riscv_clocksource"},
        {"hyperv_clocksource_tsc_page", "hyperv_clocksource_tsc_page acpi_pm"}};
    const auto& [current, available] = clocks[static_cast<std::size_t>(whole(0, 5))];
    if (chance(0.1)) return;
    machine.say("sys/devices/system/clocksource/clocksource0/current_clocksource", current);
    machine.say("sys/devices/system/clocksource/clocksource0/available_clocksource", available);
  }

  void draw_irqbalance(bool isolated) {
    if (haptic_ < 0 || chance(0.5)) {
      machine.say("proc/77/comm", "irqbalance-ui");
      return;
    }
    run_irqbalance(machine);
    if (!isolated || chance(0.5)) {
      machine.say(chance(0.5) ? "etc/default/irqbalance" : "etc/sysconfig/irqbalance",
                  "# irqbalance\nIRQBALANCE_ONESHOT=\nIRQBALANCE_BANNED_CPULIST=" + std::to_string(haptic_));
    }
  }

  void draw_card(const std::string& name, bool wireless) {
    const char* const wired[] = {"igb", "e1000e", "r8169", "mlx5_core", "i40e"};
    const std::string driver = wireless ? "iwlwifi" : wired[whole(0, 4)];
    std::vector<int> interrupts;
    for (int i = whole(0, 8); i > 0; --i) interrupts.push_back(next_interrupt_++);
    machine.say_card(name, driver, interrupts);
    for (const int interrupt : interrupts) machine.say_affinity(interrupt, other_processor());
    NetworkCard& card = machine.cards[name];
    if (wireless) {
      machine.say_wireless(name);
      if (chance(0.8)) card.power_save = false;
      return;
    }
    const bool modes = driver == "igb" || driver == "e1000e";
    if (chance(0.8))
      card.coalescing = {{.rx_usecs = static_cast<std::uint32_t>(modes ? whole(5, 10) * whole(0, 1) : whole(0, 10))}};
    if (chance(0.8)) card.energy_efficient = false;
  }

  /// None of these matter: a card without a cable, a bridge, and the interrupts of a disk.
  void draw_what_is_not_used() {
    if (chance(0.5)) {
      machine.say_card("eth9", "igb", {200});
      machine.say("sys/class/net/eth9/operstate", "down");
      machine.say_affinity(200, "0-127");
      machine.cards["eth9"] = {
          .coalescing = {{.rx_usecs = 200, .adaptive = true}}, .energy_efficient = true, .power_save = true};
    }
    if (chance(0.5)) {
      machine.say("sys/class/net/br0/operstate", "up");
      machine.cards["br0"] = {.coalescing = {{.rx_usecs = 200, .adaptive = true}}, .energy_efficient = true};
    }
    machine.say("proc/interrupts", "  9:  1  IR-IO-APIC  9-fasteoi  acpi\n201:  1  IR-PCI-MSI 5-edge  nvme0q5");
    machine.say_affinity(201, "0-127");
  }

  Dice dice_;
  int haptic_ = -1;
  int next_interrupt_ = 24;
};

TEST(DoctorNetwork, HasNoAdviceForAHundredDrawnMachinesWithoutFaults) {
  for (unsigned seed = 1; seed <= 100; ++seed) {
    for (const auto& [key, finding] : DrawnMachine(seed).machine.look_at_network()) {
      EXPECT_EQ(finding.advice, "") << "seed " << seed << ": " << key << " " << finding.found;
    }
  }
}

}  // namespace
}  // namespace tendon::doctor_network_test
