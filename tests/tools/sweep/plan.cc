// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/sweep/plan.h"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>

#include "protocol/secrets/crypto.h"
#include "tests/tools/sweep/results.h"

namespace tendon::sweep {
namespace {

std::string file_of(const Plan& plan) {
  nlohmann::ordered_json json;
  json["program"] = plan.program.string();
  json["sha256"] = plan.sha256;
  json["arguments"] = plan.arguments;
  json["units"] = std::to_string(plan.units.first) + ":" + std::to_string(plan.units.count);
  json["per_shard"] = plan.per_shard;
  json["arithmetic"] = name_of(plan.arithmetic);
  json["c_library"] = plan.fingerprint.c_library;
  json["functions"] = plan.fingerprint.functions;
  json["blas"] = plan.fingerprint.blas;
  return json.dump(2) + "\n";
}

}  // namespace

Units Plan::shard(std::uint64_t number) const {
  if (number >= shards()) {
    throw std::invalid_argument("shard " + std::to_string(number) + ": expected 0 to " + std::to_string(shards() - 1));
  }
  const std::uint64_t from = number * per_shard;
  return {.first = units.first + from, .count = std::min(per_shard, units.count - from)};
}

void write_plan(const std::filesystem::path& folder, const Plan& plan) {
  if (plan.per_shard == 0) throw std::invalid_argument("--per-shard 0: expected 1 or more");
  std::filesystem::create_directories(folder);
  const std::filesystem::path file = folder / "plan.json";
  if (keep(file, file_of(plan)) == Kept::kOther) {
    throw std::runtime_error(file.string() + " is a different plan: each sweep requires its own folder");
  }
}

Plan read_plan(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "plan.json";
  try {
    const auto json = nlohmann::json::parse(contents_of(file));
    Plan plan{
        .program = json.at("program").get<std::string>(),
        .sha256 = json.at("sha256"),
        .arguments = json.at("arguments"),
        .units = parse_units(json.at("units").get<std::string>()),
        .per_shard = json.at("per_shard"),
        .arithmetic = arithmetic_of(json.at("arithmetic").get<std::string>()),
        .fingerprint = {.c_library = json.at("c_library"), .functions = json.at("functions"), .blas = json.at("blas")}};
    if (plan.per_shard == 0) throw std::invalid_argument("per_shard = 0");
    return plan;
  } catch (const std::exception& error) {
    throw std::runtime_error(file.string() + ": expected a plan of a sweep: " + error.what());
  }
}

std::string sha256_of(const std::filesystem::path& file) {
  const std::string bytes = contents_of(file);
  std::string text;
  for (const std::byte byte : crypto::sha256({std::as_bytes(std::span(bytes))})) {
    constexpr std::string_view kDigits = "0123456789abcdef";
    text += kDigits[std::to_integer<std::size_t>(byte >> 4)];
    text += kDigits[std::to_integer<std::size_t>(byte & std::byte{15})];
  }
  return text;
}

}  // namespace tendon::sweep
