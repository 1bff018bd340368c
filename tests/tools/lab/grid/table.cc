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

std::string field(const std::optional<double>& value, double scale = 1) {
  constexpr int kDigits = 6;
  return value ? rounded(*value * scale, kDigits) : "";
}

std::string field(const std::optional<bool>& value) {
  if (!value) return "";
  return *value ? "yes" : "no";
}

/// Quoted if it contains a comma or a quote (RFC 4180).
std::string csv_field(std::string_view text) {
  if (text.find_first_of(",\"\n") == std::string_view::npos) return std::string(text);
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? "\"\"" : std::string(1, c);
  return result + '"';
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

std::string to_csv(const std::vector<GridRow>& rows, const Thresholds& thresholds, const Origin& origin,
                   const std::map<std::string, std::string>& parts) {
  std::string text = "# " + origin.command +
                     "\nlaw,parts,network,rtt_p50_ms,loss_share,rate_hz,stiffness_npm,seed,felt_stiffness_npm,"
                     "least_energy_j,vibration_mps,felt_db,force_error_n,limited_share,quiet,passive,scene_sha256,"
                     "commit,arithmetic\n";
  const std::string ends = ',' + origin.scene_sha256 + ',' + origin.commit + ',' + origin.arithmetic + '\n';
  for (const auto& [cell, measured] : rows) {
    text += cell.law + ',' + parts.at(cell.law) + ',' + csv_field(cell.network) + ',' +
            field(measured.round_trip, 1e3) + ',' + field(measured.loss) + ',' + shortest(cell.rate_hz) + ',' +
            shortest(cell.stiffness) + ',' + std::to_string(cell.seed) + ',' + field(measured.felt_stiffness) + ',' +
            field(measured.least_energy) + ',' + field(measured.vibration) + ',' + field(measured.felt_db) + ',' +
            field(measured.force_error) + ',' + field(measured.limited_share) + ',' +
            field(quiet(measured, thresholds)) + ',' + field(passive(measured, thresholds)) + ends;
  }
  return text;
}

}  // namespace tendon::lab
