// SPDX-License-Identifier: Apache-2.0
#include "devices/woodenhaptics/report.h"

namespace tendon::woodenhaptics {
namespace {

constexpr std::size_t kFields = kReportBytes / 2;
using Fields = std::array<std::int16_t, kFields>;

ReportBytes bytes_of(const Fields& fields) {
  ReportBytes bytes{};
  for (std::size_t i = 0; i < kFields; ++i) {
    const auto field = static_cast<std::uint16_t>(fields[i]);
    bytes[2 * i] = static_cast<std::uint8_t>(field & 255U);
    bytes[2 * i + 1] = static_cast<std::uint8_t>(field >> 8U);
  }
  return bytes;
}

}  // namespace

ReportBytes encode(const Currents& currents) noexcept { return bytes_of({currents[0], currents[1], currents[2]}); }

ReportBytes encode_calibration(const Currents& counters) noexcept {
  return bytes_of({0, 0, 0, 1, counters[0], counters[1], counters[2]});
}

std::optional<Report> parse(std::span<const std::uint8_t> bytes) noexcept {
  if (bytes.size() != kReportBytes) return std::nullopt;
  const auto field = [&bytes](std::size_t i) {
    return static_cast<std::int16_t>(bytes[2 * i] | bytes[2 * i + 1] << 8U);
  };
  Report report;
  for (std::size_t i = 0; i < report.counters.size(); ++i) report.counters[i] = field(i);
  const std::int16_t info = field(report.counters.size());
  if (info != 0 && info != 1) return std::nullopt;
  report.calibrate = info == 1;
  return report;
}

}  // namespace tendon::woodenhaptics
