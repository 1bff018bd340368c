// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/grid/table.h"

#include <cstddef>
#include <span>
#include <string_view>
#include <utility>

#include "core/base/expect.h"
#include "protocol/secrets/crypto.h"
#include "server/build_info.h"
#include "tests/tools/sweep/arithmetic.h"

namespace tendon::lab {
namespace {

std::optional<double> in_ms(const std::optional<double>& time) {
  constexpr double kMsPerS = 1e3;
  if (!time) return std::nullopt;
  return *time * kMsPerS;
}

std::string sha256_of(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string hexadecimal;
  for (const std::byte byte : crypto::sha256({std::as_bytes(std::span(text))})) {
    hexadecimal += kDigits[std::to_integer<std::size_t>(byte) / 16];
    hexadecimal += kDigits[std::to_integer<std::size_t>(byte) % 16];
  }
  return hexadecimal;
}

}  // namespace

std::optional<bool> quiet(const Measured& measured, const Thresholds& thresholds) {
  if (!measured.vibration) return std::nullopt;
  return *measured.vibration <= thresholds.vibration;
}

std::optional<bool> passive(const Measured& measured, const Thresholds& thresholds) {
  if (!measured.least_energy) return std::nullopt;
  return *measured.least_energy >= -thresholds.given_out;
}

Origin origin_of(std::string command, const std::string& scene_text) {
  return {.command = std::move(command),
          .scene_sha256 = sha256_of(scene_text),
          .commit = std::string(kCommit),
          .arithmetic = sweep::fingerprint().functions};
}

CsvTable table_of(const std::vector<GridRow>& rows, const Thresholds& thresholds, const Origin& origin,
                  const std::map<std::string, std::string>& parts) {
  CsvTable table(origin.command);
  for (const auto& [cell, measured] : rows) {
    table.add(JsonLine()
                  .add("law", cell.law)
                  .add("parts", parts.at(cell.law))
                  .add("network", cell.network)
                  .add("rtt_p50_ms", in_ms(measured.round_trip))
                  .add("loss_share", measured.loss)
                  .add("rate_hz", shortest(cell.rate_hz))
                  .add("stiffness_npm", shortest(cell.stiffness))
                  .add("seed", cell.seed)
                  .add("felt_stiffness_npm", measured.felt_stiffness)
                  .add("least_energy_j", measured.least_energy)
                  .add("vibration_mps", measured.vibration)
                  .add("felt_db", measured.felt_db)
                  .add("force_error_n", measured.force_error)
                  .add("limited_share", measured.limited_share)
                  .add("quiet", quiet(measured, thresholds))
                  .add("passive", passive(measured, thresholds))
                  .add("scene_sha256", origin.scene_sha256)
                  .add("commit", origin.commit)
                  .add("arithmetic", origin.arithmetic));
  }
  return table;
}

}  // namespace tendon::lab
