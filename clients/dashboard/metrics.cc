// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/metrics.h"

#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>

#include <array>
#include <limits>
#include <sstream>
#include <utility>
#include <vector>

#include "clients/dashboard/page_json.h"

namespace tendon::dash {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;
using Labels = std::vector<ClientMetric::Label>;

class Exposition {
 public:
  void begin(const char* name, MetricType type, const char* help) {
    families_.emplace_back();
    families_.back().name = name;
    families_.back().help = help;
    families_.back().type = type;
  }
  void add(Labels labels, double value) {
    ClientMetric metric;
    metric.label = std::move(labels);
    metric.gauge.value = value;
    metric.counter.value = value;
    families_.back().metric.push_back(std::move(metric));
  }
  void add(Labels labels, std::uint64_t value) { add(std::move(labels), static_cast<double>(value)); }
  void add(Labels labels, ClientMetric::Histogram histogram) {
    ClientMetric metric;
    metric.label = std::move(labels);
    metric.histogram = std::move(histogram);
    families_.back().metric.push_back(std::move(metric));
  }
  std::string text() {
    std::erase_if(families_, [](const MetricFamily& family) { return family.metric.empty(); });
    std::ostringstream out;
    prometheus::TextSerializer().Serialize(out, families_);
    return out.str();
  }

 private:
  std::vector<MetricFamily> families_;
};

constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};
constexpr std::array kModes = {Mode::kIdle,     Mode::kActive,   Mode::kHolding,
                               Mode::kDecaying, Mode::kSafeStop, Mode::kFault};
constexpr std::array kPhases = {PortPhase::kAlone,    PortPhase::kCoupled, PortPhase::kAligning, PortPhase::kEngaged,
                                PortPhase::kClutched, PortPhase::kLost,    PortPhase::kFault};
constexpr std::array kSafeties = {Safety::kAbsent, Safety::kOpening, Safety::kFirmware, Safety::kUnhomed,
                                  Safety::kHomed,  Safety::kArmed,   Safety::kFault,    Safety::kUnguarded};

/// Calls `add` with the label of each device for which `what` is available.
template <class Add>
void each(const Board& board, Add add) {
  for (const auto& [number, device] : board.devices()) {
    const std::string name = device.about && !device.about->name.empty() ? device.about->name : std::to_string(number);
    add(ClientMetric::Label{"device", name}, device);
  }
}

ClientMetric::Histogram lateness(const Board::Device& device) {
  ClientMetric::Histogram histogram;
  double upper = 1e-6;
  for (std::size_t i = 0; i + 1 < device.lateness.size(); ++i, upper *= 2) {
    histogram.sample_count += device.lateness[i];
    histogram.bucket.push_back({histogram.sample_count, upper});
  }
  histogram.sample_count += device.lateness.back();
  histogram.bucket.push_back({histogram.sample_count, std::numeric_limits<double>::infinity()});
  histogram.sample_sum = std::numeric_limits<double>::quiet_NaN();  // the protocol only contains bucket counts
  return histogram;
}

void add_devices(Exposition& out, const Board& board) {
  using Label = ClientMetric::Label;
  using Device = Board::Device;
  const auto newest = [&](auto value) {
    each(board, [&](const Label& label, const Device& device) {
      if (device.newest) value(label, *device.newest);
    });
  };
  out.begin("tendon_device_position_meters", MetricType::Gauge, "Position of the handle, device base frame.");
  newest([&](const Label& label, const DeviceState& state) {
    for (int i = 0; i < 3; ++i) out.add({label, {"axis", kAxes[static_cast<std::size_t>(i)]}}, state.position[i]);
  });
  out.begin("tendon_device_force_wanted_newtons", MetricType::Gauge, "Norm of the force requested by the engines.");
  newest([&](const Label& label, const DeviceState& state) {
    if (state.force_wanted) out.add({label}, state.force_wanted->norm());
  });
  out.begin("tendon_device_force_permitted_newtons", MetricType::Gauge,
            "The limiter's bound on the norm of the force.");
  newest([&](const Label& label, const DeviceState& state) { out.add({label}, state.permitted_force); });
  out.begin("tendon_device_force_applied_newtons", MetricType::Gauge, "Norm of the force applied by the device.");
  newest([&](const Label& label, const DeviceState& state) { out.add({label}, state.force_applied.norm()); });
  out.begin("tendon_device_energy_joules", MetricType::Gauge,
            "Energy ledger: energy that the device may still generate.");
  newest([&](const Label& label, const DeviceState& state) { out.add({label}, state.energy); });
  out.begin("tendon_device_force_age_seconds", MetricType::Gauge, "Time since the rendered force arrived.");
  newest([&](const Label& label, const DeviceState& state) { out.add({label}, seconds(state.force_age)); });
  out.begin("tendon_device_field_generation", MetricType::Gauge, "Generation of the rendered field.");
  newest([&](const Label& label, const DeviceState& state) {
    if (state.field) out.add({label}, std::uint64_t{state.field->generation});
  });
  out.begin("tendon_device_field_depth_meters", MetricType::Gauge,
            "Distance from the proxy on the rendered field to the hand.");
  newest([&](const Label& label, const DeviceState& state) {
    if (state.field) out.add({label}, state.field->depth);
  });
  out.begin("tendon_device_mode", MetricType::Gauge, "1 for the current mode of the force, 0 for the others.");
  newest([&](const Label& label, const DeviceState& state) {
    for (const Mode mode : kModes) out.add({label, {"mode", name(mode)}}, state.mode == mode ? 1.0 : 0.0);
  });
  out.begin("tendon_device_states_total", MetricType::Counter, "Received states.");
  each(board, [&](const Label& label, const Device& device) { out.add({label}, device.states); });
  out.begin("tendon_device_states_limited_total", MetricType::Counter,
            "Received states whose force was not the requested one, by reason.");
  each(board, [&](const Label& label, const Device& device) {
    for (std::size_t bit = 0; bit < Board::kReasons; ++bit) {
      const std::string reason = reason_name(bit);
      if (!reason.starts_with("bit_") || device.limited[bit] > 0)
        out.add({label, {"reason", reason}}, device.limited[bit]);
    }
  });

  const auto reported = [&](auto value) {
    each(board, [&](const Label& label, const Device& device) {
      if (device.report) value(label, device, *device.report);
    });
  };
  using Report = DeviceReport;
  out.begin("tendon_device_safety_state", MetricType::Gauge,
            "1 for the current safety state of the device, 0 for the others.");
  reported([&](const Label& label, const Device&, const Report& report) {
    for (const Safety safety : kSafeties)
      out.add({label, {"state", name(safety)}}, report.safety == safety ? 1.0 : 0.0);
  });
  out.begin("tendon_device_fault", MetricType::Gauge, "1 while the force is zero because of a fault.");
  reported([&](const Label& label, const Device&, const Report& r) { out.add({label}, r.fault.empty() ? 0.0 : 1.0); });
  out.begin("tendon_device_degraded", MetricType::Gauge, "1 while the operation of the device is degraded.");
  reported(
      [&](const Label& label, const Device&, const Report& r) { out.add({label}, r.degraded.empty() ? 0.0 : 1.0); });
  out.begin("tendon_device_steps_total", MetricType::Counter, "Haptic steps.");
  reported([&](const Label& label, const Device& device, const Report&) { out.add({label}, device.steps); });
  out.begin("tendon_device_steps_missed_total", MetricType::Counter, "Periods without a step.");
  reported([&](const Label& label, const Device& device, const Report&) { out.add({label}, device.missed); });
  out.begin("tendon_device_steps_overrun_total", MetricType::Counter,
            "Steps with an overrun, because they were too late.");
  reported([&](const Label& label, const Device& device, const Report&) { out.add({label}, device.overruns); });
  out.begin("tendon_device_steps_unseen_total", MetricType::Counter, "Steps without a position of the device.");
  reported([&](const Label& label, const Device& device, const Report&) { out.add({label}, device.unseen); });
  out.begin("tendon_device_wakeup_lateness_seconds", MetricType::Histogram,
            "Wake-up latency of the haptic loop. The sum is unknown (NaN), because only buckets are transmitted.");
  reported([&](const Label& label, const Device& device, const Report&) { out.add({label}, lateness(device)); });
}

void add_ports(Exposition& out, const Board& board) {
  using Label = ClientMetric::Label;
  const auto ends = [&](auto value) {
    each(board, [&](const Label& label, const Board::Device& device) {
      if (!device.ports) return;
      value(Labels{label, {"end", "own"}}, device.ports->own);
      if (device.ports->peer) value(Labels{label, {"end", "peer"}}, *device.ports->peer);
    });
  };
  out.begin("tendon_port_phase", MetricType::Gauge,
            "1 for the current phase of an end of the coupling, 0 for the others.");
  ends([&](const Labels& labels, const PortFrame& port) {
    for (const PortPhase phase : kPhases) {
      Labels with_phase = labels;
      with_phase.push_back({"phase", name(phase)});
      out.add(std::move(with_phase), port.phase == phase ? 1.0 : 0.0);
    }
  });
  out.begin("tendon_port_account_joules", MetricType::Gauge,
            "Energy that an end may still generate, in its own joules.");
  ends([&](const Labels& labels, const PortFrame& port) {
    if (port.need > 0) out.add(labels, port.account);
  });
  out.begin("tendon_port_pair_joules", MetricType::Gauge,
            "Energy that both ends may still generate, including the energy in transit, in joules of the leader.");
  each(board, [&](const Label& label, const Board::Device& device) {
    const auto pair = device.ports ? pair_account(*device.ports) : std::nullopt;
    if (pair) out.add({label}, *pair);
  });
  out.begin("tendon_port_round_trip_seconds", MetricType::Gauge,
            "Round-trip time between the ends, measured by each end.");
  ends([&](const Labels& labels, const PortFrame& port) {
    if (port.round_trip > Duration::zero()) out.add(labels, seconds(port.round_trip));
  });
}

void add_engines(Exposition& out, const Board& board) {
  const auto engines = [&](auto value) {
    each(board, [&](const ClientMetric::Label& label, const Board::Device& device) {
      for (const auto& [number, engine] : device.engines) {
        const bool named = device.about && number < device.about->channels.size();
        const std::string channel = named ? device.about->channels[number].name : std::to_string(number);
        value(Labels{label, {"channel", channel}, {"engine", engine.newest.name}}, engine);
      }
    });
  };
  const auto with = [](Labels labels, const char* name, const char* value) {
    labels.push_back({name, value});
    return labels;
  };
  const auto delays = [&](const Labels& labels, const char* way, const std::optional<Delays>& measured) {
    if (!measured) return;
    out.add(with(with(labels, "way", way), "quantile", "0.5"), seconds(measured->median));
    out.add(with(with(labels, "way", way), "quantile", "0.99"), seconds(measured->p99));
  };
  using Engine = Board::Engine;
  out.begin("tendon_engine_delay_seconds", MetricType::Gauge,
            "Delay of an engine's datagrams in the last second: round_trip, to_server, to_engine.");
  engines([&](const Labels& labels, const Engine& engine) {
    delays(labels, "round_trip", engine.newest.link.round_trip);
    delays(labels, "to_server", engine.newest.link.to_server);
    delays(labels, "to_engine", engine.newest.link.to_client);
  });
  out.begin("tendon_engine_forces_total", MetricType::Counter, "Forces received from the engine.");
  engines([&](const Labels& labels, const Engine& engine) { out.add(labels, engine.forces); });
  out.begin("tendon_engine_forces_late_total", MetricType::Counter, "Forces received too late, by cause.");
  engines([&](const Labels& labels, const Engine& engine) {
    out.add(with(labels, "cause", "server"), engine.late_server);
    out.add(with(labels, "cause", "network"), engine.late_network);
    out.add(with(labels, "cause", "engine"), engine.late_engine);
    out.add(with(labels, "cause", "unknown"), engine.late_unknown);
  });
  out.begin("tendon_engine_forces_unusable_total", MetricType::Counter,
            "Unusable forces of the engine on all of its channels, by cause.");
  engines([&](const Labels& labels, const Engine& engine) {
    out.add(with(labels, "cause", "not_finite"), engine.refused.not_finite);
    out.add(with(labels, "cause", "out_of_bounds"), engine.refused.out_of_bounds);
    out.add(with(labels, "cause", "unknown_tick"), engine.refused.unknown_tick);
    out.add(with(labels, "cause", "old_sequence"), engine.refused.old_sequence);
  });
  out.begin("tendon_engine_error_newtons", MetricType::Gauge,
            "Largest error of a force in the last second as reported by the engine, and its solver path.");
  engines([&](const Labels& labels, const Engine& engine) {
    const PeerReport& report = engine.newest;
    if (report.error) out.add(with(labels, "answered_by", report.way.c_str()), *report.error);
  });
  out.begin("tendon_engine_datagrams_received", MetricType::Gauge,
            "Received datagrams in the current session of the engine.");
  engines([&](const Labels& labels, const Engine& engine) { out.add(labels, engine.newest.link.received); });
  out.begin("tendon_engine_datagrams_lost", MetricType::Gauge, "Lost datagrams in the current session of the engine.");
  engines([&](const Labels& labels, const Engine& engine) { out.add(labels, engine.newest.link.lost); });
  out.begin("tendon_engine_forces_refused", MetricType::Gauge,
            "1 while its forces are ignored, because its network loses too many datagrams.");
  engines(
      [&](const Labels& labels, const Engine& engine) { out.add(labels, engine.newest.forces_refused ? 1.0 : 0.0); });
}

}  // namespace

std::string metrics_text(const Board& board, const WebCounts& web, const BridgeCounts& bridge) {
  Exposition out;
  out.begin("tendon_up", MetricType::Gauge, "1 while tendond responds.");
  out.add({}, board.contact() == Contact::kOpen ? 1.0 : 0.0);
  out.begin("tendon_server_info", MetricType::Gauge, "1, with the name and version of the server.");
  if (board.welcome()) out.add({{"server", board.welcome()->server}}, 1.0);
  out.begin("tendon_sessions_total", MetricType::Counter, "Sessions of this dashboard with the server.");
  out.add({}, board.sessions());
  add_devices(out, board);
  add_engines(out, board);
  add_ports(out, board);
  out.begin("tendon_dash_pages", MetricType::Gauge, "Connected pages.");
  out.add({}, web.pages);
  out.begin("tendon_dash_requests_total", MetricType::Counter, "HTTP requests.");
  out.add({}, web.requests);
  out.begin("tendon_dash_requests_refused_total", MetricType::Counter, "HTTP requests refused.");
  out.add({}, web.refused);
  out.begin("tendon_dash_states_skipped_total", MetricType::Counter, "States skipped because a page was too slow.");
  out.add({}, web.states_skipped);
  out.begin("tendon_bridge_pages", MetricType::Gauge, "WebSockets on the bridge.");
  out.add({}, bridge.pages);
  out.begin("tendon_bridge_datagrams_total", MetricType::Counter, "Datagrams forwarded by the bridge.");
  out.add({{"way", "to_server"}}, bridge.to_server);
  out.add({{"way", "to_page"}}, bridge.to_page);
  out.begin("tendon_bridge_dropped_total", MetricType::Counter, "Datagrams dropped by the bridge, by cause.");
  out.add({{"cause", "malformed"}}, bridge.malformed);
  out.add({{"cause", "plain"}}, bridge.plain);
  out.add({{"cause", "too_fast"}}, bridge.too_fast);
  out.add({{"cause", "too_slow"}}, bridge.too_slow);
  out.begin("tendon_bridge_refused_total", MetricType::Counter, "WebSockets refused by the bridge, by cause.");
  out.add({{"cause", "origin"}}, bridge.refused_origin);
  out.add({{"cause", "full"}}, bridge.refused_full);
  return out.text();
}

}  // namespace tendon::dash
