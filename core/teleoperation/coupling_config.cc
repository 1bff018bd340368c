// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/coupling_config.h"

#include <array>

namespace tendon {

namespace {

std::string in_quotation(CouplingMethod method) { return "\"" + std::string(to_string(method)) + "\""; }

/// Returns `"a", "b" or "c"`.
std::string methods_with(bool CouplingMethodInfo::*property) {
  std::string text;
  std::string last;
  for (const CouplingMethod method : kCouplingMethods) {
    if (!(info(method).*property)) continue;
    if (!last.empty()) text += (text.empty() ? "" : ", ") + last;
    last = in_quotation(method);
  }
  return text.empty() ? last : text + " or " + last;
}

struct CouplingRule {
  std::string_view key;
  bool (*broken)(const CouplingConfig&);
  std::string (*sentence)(const CouplingConfig&);
};

bool leads(const CouplingConfig& config) { return config.role == PortRole::kLeader; }

constexpr std::array kCouplingRules = {
    CouplingRule{"clutch", [](const CouplingConfig& c) { return !leads(c) && c.clutch.has_value(); },
                 [](const CouplingConfig&) {
                   return std::string("expected no clutch for a follower: only the leader has a clutch");
                 }},
    CouplingRule{"holds_place", [](const CouplingConfig& c) { return leads(c) && c.holds_place; },
                 [](const CouplingConfig&) {
                   return std::string("expected \"release\" for a leader, which is held by a hand");
                 }},
    CouplingRule{"engage_by", [](const CouplingConfig& c) { return !leads(c) && c.engage_by.has_value(); },
                 [](const CouplingConfig&) { return std::string("expected \"request\": the leader engages"); }},
    CouplingRule{"clutch", [](const CouplingConfig& c) { return c.absolute && c.clutch.has_value(); },
                 [](const CouplingConfig&) {
                   return std::string(
                       "expected no clutch with map.absolute: a clutch changes the offset, which is always 0");
                 }},
    CouplingRule{"absolute", [](const CouplingConfig& c) { return c.absolute && !info(c.method).has_places; },
                 [](const CouplingConfig&) {
                   return "expected the method " + methods_with(&CouplingMethodInfo::has_places) +
                          " with map.absolute: the other methods have no absolute positions";
                 }},
    CouplingRule{"share", [](const CouplingConfig& c) { return leads(c) && c.share.has_value(); },
                 [](const CouplingConfig&) {
                   return std::string("expected no share for a leader: only a follower has shares");
                 }},
    CouplingRule{"method", [](const CouplingConfig& c) { return c.share && !info(c.method).can_be_shared; },
                 [](const CouplingConfig& c) {
                   return "expected " + methods_with(&CouplingMethodInfo::can_be_shared) +
                          " with several leaders, found " + in_quotation(c.method);
                 }},
    CouplingRule{"rate", [](const CouplingConfig& c) { return c.method == CouplingMethod::kRate && !c.rate; },
                 [](const CouplingConfig& c) {
                   return "missing, expected this table with method " + in_quotation(c.method) +
                          ": it sets the speed of the follower";
                 }},
    CouplingRule{"rate", [](const CouplingConfig& c) { return c.method != CouplingMethod::kRate && c.rate; },
                 [](const CouplingConfig& c) {
                   return "expected none with method " + in_quotation(c.method) + ": only the method \"rate\" uses it";
                 }},
    CouplingRule{"centring", [](const CouplingConfig& c) { return !leads(c) && c.centring > 0; },
                 [](const CouplingConfig&) {
                   return std::string("expected 0 or no value for a follower: only the leader's handle is centred");
                 }},
    CouplingRule{
        "own_damping",
        [](const CouplingConfig& c) { return !info(c.method).needs_damping.empty() && !(c.spring.own_damping > 0); },
        [](const CouplingConfig& c) {
          return "expected a number above 0: " + std::string(info(c.method).needs_damping);
        }}};

}  // namespace

std::vector<CouplingReason> check(const CouplingConfig& config) {
  std::vector<CouplingReason> reasons;
  for (const CouplingRule& rule : kCouplingRules) {
    if (rule.broken(config)) reasons.push_back({rule.key, rule.sentence(config)});
  }
  return reasons;
}

}  // namespace tendon
