// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/worker/proxy_engine.h"

#include <array>
#include <cstddef>
#include <ostream>
#include <utility>
#include <variant>

#include "clients/cpp/machine.h"

namespace tendon::worker {
namespace {

std::string secret_from_system() {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string secret;
  for (const auto byte : seed_from_system().bytes) {
    const auto value = static_cast<unsigned>(byte);
    secret += kDigits[value >> 4U];
    secret += kDigits[value & 15U];
  }
  return secret;
}

}  // namespace

ProxyEngine::ProxyEngine(const Config& config, LocalTime now, std::ostream& says)
    : name_(config.name), says_(says), scheduler_(config.scheduler, now), process_(config.process) {}

void ProxyEngine::see(LocalTime /*now*/, const Seen& seen) { scheduler_.see(seen); }

std::optional<Reply> ProxyEngine::turn(LocalTime now) {
  for (;;) {
    if (const auto event = process_.next()) {
      take(now, *event);
    } else if (const auto order = scheduler_.turn(now)) {
      if (auto answer = carry_out(now, *order)) return answer;
    } else {
      return std::nullopt;
    }
  }
}

void ProxyEngine::take(LocalTime now, const WorkerProcess::Event& event) {
  if (std::holds_alternative<WorkerProcess::Opened>(event)) {
    scheduler_.opened();
    say("worker " + std::to_string(scheduler_.stats().launches) + " is ready");
  } else if (const auto* ended = std::get_if<WorkerProcess::Ended>(&event)) {
    scheduler_.ended(now, ended->why);
  } else {
    const auto answer = codec_.read_answer(std::get<Record>(event), question_.sequence, question_.hand);
    if (answer.touch) return scheduler_.answered(now, *answer.touch);
    scheduler_.refused(answer.refused);
    if (answer.refused != std::exchange(refused_, answer.refused)) {
      say("an answer of the worker was rejected: " + std::string(answer.refused));
    }
  }
}

std::optional<Reply> ProxyEngine::carry_out(LocalTime now, const ProxyScheduler::Order& order) {
  if (const auto* answer = std::get_if<Reply>(&order)) return *answer;
  if (const auto* ask = std::get_if<ProxyScheduler::Ask>(&order)) {
    question_ = *ask;
    process_.send(codec_.state(ask->sequence, ask->hand));
  } else if (const auto* give_up = std::get_if<ProxyScheduler::GiveUp>(&order)) {
    process_.kill();
    const auto wait = std::chrono::duration<double>(scheduler_.next_turn() - now).count();
    says_ << name_ << ": worker " << scheduler_.stats().launches << " was stopped: " << give_up->why
          << "; the next one starts in " << wait << " s\n"
          << std::flush;
  } else {
    process_.launch(secret_from_system());
  }
  return std::nullopt;
}

void ProxyEngine::say(const std::string& text) { says_ << name_ << ": " << text << '\n' << std::flush; }

}  // namespace tendon::worker
