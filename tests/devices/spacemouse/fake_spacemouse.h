// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "devices/spacemouse/report.h"
#include "tests/devices/usb/usb_model.h"

namespace tendon {

/// A report waits until it is read, but it is lost if the cable is unplugged. The descriptors are those of an HID
/// device that has one interrupt endpoint, as the driver expects. They were not compared with a real device.
class FakeSpaceMouse final : public UsbModel {
 public:
  bool split = false;                  ///< translation and rotation in two reports
  spacemouse::Axes twist{2313, 9, 9};  ///< an additional twist
  std::uint32_t connection = 1;
  std::uint32_t connections = 1;
  std::deque<std::vector<std::uint8_t>> reports{};

  void push(const spacemouse::Axes& cap) {
    std::vector<std::uint8_t> report{1};
    append(report, cap);
    if (split) {
      reports.push_back(report);
      report = {2};
    }
    append(report, twist);
    reports.push_back(report);
  }

  void unplug() override {
    connection = 0;
    reports.clear();
  }
  void plug() override { connection = ++connections; }

  std::span<const std::uint8_t> descriptors() const override { return kDescriptors; }
  std::span<const std::uint8_t> report_descriptor() const override { return kReportDescriptor; }
  bool request(LocalTime, std::uint8_t, std::uint16_t) override { return false; }
  bool write(LocalTime, std::span<const std::uint8_t>) override { return false; }
  LocalTime next_in() const override { return reports.empty() ? LocalTime::max() : LocalTime::min(); }
  std::vector<std::uint8_t> take_in(LocalTime) override {
    const auto report = reports.front();
    reports.pop_front();
    return report;
  }

 private:
  static void append(std::vector<std::uint8_t>& report, const spacemouse::Axes& axes) {
    for (const std::int16_t axis : axes) {
      report.push_back(static_cast<std::uint8_t>(axis & 255));
      report.push_back(static_cast<std::uint8_t>(axis >> 8));
    }
  }

  /// A "multi-axis controller" of six axes, ±350, and two buttons (HID 1.11, 6.2.2).
  static constexpr std::array<std::uint8_t, 51> kReportDescriptor = {
      0x05, 0x01, 0x09, 0x08, 0xA1, 0x01,                                                  //
      0x85, 0x01, 0x16, 0xA2, 0xFE, 0x26, 0x5E, 0x01, 0x09, 0x30, 0x09, 0x31, 0x09, 0x32,  //
      0x09, 0x33, 0x09, 0x34, 0x09, 0x35, 0x75, 0x10, 0x95, 0x06, 0x81, 0x02,              //
      0x85, 0x03, 0x05, 0x09, 0x19, 0x01, 0x29, 0x08, 0x15, 0x00, 0x25, 0x01, 0x75, 0x01, 0x95, 0x08, 0x81, 0x02, 0xC0};
  /// SpaceNavigator (046d:c626): device, configuration, interface, HID, one interrupt endpoint every 8 ms.
  static constexpr std::array<std::uint8_t, 52> kDescriptors = {
      18,   1,    0,    2,    0,  0, 0,    64,
      0x6D, 0x04, 0x26, 0xC6, 0,  1, 0,    0,
      0,    1,  //
      9,    2,    34,   0,    1,  1, 0,    0x80,
      50,  //
      9,    4,    0,    0,    1,  3, 0,    0,
      0,  //
      9,    0x21, 0x11, 1,    0,  1, 0x22, static_cast<std::uint8_t>(kReportDescriptor.size()),
      0,  //
      7,    5,    0x81, 3,    64, 0, 8};
};

}  // namespace tendon
