// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/cost.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/estimation/recursive_least_squares.h"
#include "core/remote/output_estimator.h"
#include "server/build_info.h"
#include "tests/support/json_line.h"
#include "tests/tools/lab/experiments/experiment.h"
#include "tests/tools/lab/experiments/law_steps.h"
#include "tests/tools/lab/experiments/meter.h"
#include "tests/tools/lab/experiments/paper.h"
#include "tests/tools/lab/pictures/csv.h"
#include "tests/tools/lab/pictures/gnuplot.h"
#include "tests/tools/lab/pictures/panels.h"

namespace tendon::lab {
namespace {

constexpr Friction kFriction = LawSteps::kFriction;
constexpr std::size_t kBatch = LawSteps::kPeriod;
constexpr double kStiffness = LawSteps::kStiffness;
constexpr double kSoft = 300;  // N/m, with an estimator, so that the limiter causes no force error
constexpr Duration kRare = LawSteps::kEnvironmentDelay;

template <class T>
void keep(const T& value) {
  asm volatile("" : : "g"(&value) : "memory");
}

struct Costed {
  std::string kind;  ///< floor, law, part, estimator, least squares
  std::string name;
  double nanoseconds = 0;
  std::optional<double> instructions{};
  std::optional<double> force_error{};  ///< N, rms, remaining
};

class Bench {
 public:
  explicit Bench(int batches) : batches_(batches) {}

  template <class Step>
  Costed measure(std::string kind, std::string name, Step step) const {
    std::vector<double> times;
    std::vector<double> instructions;
    for (int b = 0; b < batches_ + 1; ++b) {
      const Meter::Reading before = meter_.read();
      for (std::size_t i = 0; i < kBatch; ++i) step(i);
      const Meter::Reading took = meter_.read() - before;
      if (b == 0) continue;  // cold caches
      times.push_back(1e9 * took.wall / static_cast<double>(kBatch));
      if (took.instructions) {
        instructions.push_back(static_cast<double>(*took.instructions) / static_cast<double>(kBatch));
      }
    }
    Costed line{.kind = std::move(kind), .name = std::move(name), .nanoseconds = median(times)};
    if (!instructions.empty()) line.instructions = median(instructions);
    return line;
  }
  bool counts() const { return meter_.read().instructions.has_value(); }

 private:
  static double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  }
  Meter meter_;
  int batches_;
};

Experiment pressing(const LimiterConfig& config, double stiffness = kStiffness) {
  Experiment set;
  set.environment.force = [stiffness](double, const Vec3& x) { return Vec3(-stiffness * x); };
  set.environment.period = kRare;
  set.hand = paper_hand(kFriction);
  set.limiter = config;
  set.max_force = kPaperMaxForce;
  return set;
}

double force_error(const Experiment& set) { return outcome(run(set), set.period).force_error; }

Costed law_line(const Bench& bench, const std::string& kind, const std::string& name, const LimiterConfig& config) {
  LawSteps law(config);
  Costed line = bench.measure(kind, name, [&](std::size_t i) { keep(law.step(i)); });
  line.force_error = force_error(pressing(config));
  return line;
}

double estimated(const std::optional<OutputEstimator::Config>& estimator) {
  Experiment set = pressing(measured_limiter(Law::kAolPlus), kSoft);
  set.limiter.parts = default_parts(kPaperEncoder);
  set.environment.delay = kRare;
  set.estimator = estimator;
  return force_error(set);
}

Costed estimator_line(const Bench& bench, const std::string& name, OutputEstimator::Model model) {
  OutputEstimator::Config config;
  config.model = model;
  config.resolution = kPaperEncoder;
  OutputEstimator estimator(config);
  const PrescribedMotion motion = paper_motion(kFriction, 0);
  std::int64_t step = 0;
  Costed line = bench.measure("estimator", name, [&](std::size_t) {
    const LocalTime at{std::chrono::milliseconds(step)};
    const Motion hand{.at = at, .position = motion.position(static_cast<double>(step) * 1e-3)};
    estimator.observe(hand);
    if (step % 40 == 0) estimator.correct({.answers = at, .force = -kStiffness * hand.position, .model = {}});
    keep(estimator.predict(hand));
    ++step;
  });
  line.force_error = estimated(config);
  return line;
}

template <class Fit, int M, class Scalar>
Costed fit_line(const Bench& bench, const std::string& name) {
  Fit fit;
  std::size_t n = 0;
  return bench.measure("least squares", name, [&](std::size_t) {
    Eigen::Matrix<Scalar, M, 1> regressor;
    for (int i = 0; i < M; ++i)
      regressor[i] = static_cast<Scalar>(((n * 7 + static_cast<std::size_t>(i) * 13) % 101)) / 101;
    ++n;
    fit.observe(regressor, regressor.sum());
    keep(fit);
  });
}

template <int M>
void fit_lines(const Bench& bench, std::vector<Costed>& lines) {
  const std::string order = ", order " + std::to_string(M) + ", ";
  lines.push_back(fit_line<UdLeastSquares<M, double>, M, double>(bench, "UD" + order + "float64"));
  lines.push_back(fit_line<UdLeastSquares<M, float>, M, float>(bench, "UD" + order + "float32"));
}

std::vector<Costed> measure(const Bench& bench) {
  std::vector<Costed> lines;
  lines.push_back(bench.measure("floor", "nothing", [](std::size_t i) { keep(i); }));
  for (const LawInfo& law : laws()) {
    lines.push_back(law_line(bench, "law", std::string(law.name), measured_limiter(law.law)));
  }
  const auto part = [&](const char* name, const auto& add) {
    LimiterConfig config = measured_limiter(Law::kAolPlus);
    add(config.parts);
    lines.push_back(law_line(bench, "part", name, config));
  };
  using Parts = AolPlus<1, 3>::Parts;
  part("energy_cap", [](Parts& p) { p.energy_cap.emplace(); });
  part("robust_ledger", [](Parts& p) { p.robust_ledger.emplace().encoder_step = {kPaperEncoder}; });
  part("knee", [](Parts& p) { p.knee.emplace(); });
  part("latency_reserve", [](Parts& p) { p.latency_reserve.emplace(); });
  part("bounded_acceleration", [](Parts& p) {
    p.bounded_acceleration = low_friction_parts(0).bounded_acceleration;
    p.shaping = low_friction_parts(0).shaping;
  });
  part("adaptive_friction", [](Parts& p) { p.adaptive_friction.emplace(); });
  part("the default parts", [](Parts& p) { p = default_parts(kPaperEncoder); });

  lines.push_back(lines.front());
  lines.back().kind = "estimator";
  lines.back().name = "none: the force is held";
  lines.back().force_error = estimated({});
  lines.push_back(estimator_line(bench, "polynomial", OutputEstimator::Model::kPolynomial));
  lines.push_back(estimator_line(bench, "spring and bias", OutputEstimator::Model::kSpringAndBias));
  lines.push_back(estimator_line(bench, "output error", OutputEstimator::Model::kOutputError));
  fit_lines<1>(bench, lines);
  fit_lines<2>(bench, lines);
  fit_lines<3>(bench, lines);
  fit_lines<4>(bench, lines);
  return lines;
}

}  // namespace

void cost(const CostOptions& options, std::ostream& out) {
  const Bench bench(options.batches);
  const std::vector<Costed> lines = measure(bench);
  if (!options.json) {
    out << "One step of each, median of " << options.batches << " batches of " << kBatch << "; commit " << kCommit
        << (bench.counts() ? "" : "\nInstructions are not counted, because the kernel does not permit it.") << "\n\n"
        << "                                             ns  instructions  force error N\n";
  }
  CsvTable table(options.command);
  for (const Costed& line : lines) {
    JsonLine json;
    json.add("kind", line.kind)
        .add("name", line.name)
        .add("ns", line.nanoseconds)
        .add("instructions", line.instructions)
        .add("force_error_n", line.force_error)
        .add("batches", options.batches)
        .add("commit", kCommit);
    table.add(json);
    if (options.json) {
      out << json.str() << "\n";
      continue;
    }
    const auto or_dash = [](const std::optional<double>& value, const char* format) {
      std::array<char, 32> text{};
      std::snprintf(text.data(), text.size(), format, value.value_or(0));
      return value ? std::string(text.data()) : std::string("-");
    };
    std::array<char, 160> text{};
    std::snprintf(text.data(), text.size(), "%-14s %-26s %8.1f %13s %14s\n", line.kind.c_str(), line.name.c_str(),
                  line.nanoseconds, or_dash(line.instructions, "%.0f").c_str(),
                  or_dash(line.force_error, "%.3f").c_str());
    out << text.data();
  }
  if (!options.json) {
    out << "\nForce error: rms against a spring of " << kStiffness << " N/m (for estimators: " << kSoft
        << ", 40 ms late) with updates at 25 Hz, with a hand that is free to move,\n"
           "b = 0.26 N s/m, f_c = 0.02 N. Estimators are used with aol+ and its default parts.\n";
  }
  if (options.out) {
    std::filesystem::create_directories(*options.out);
    table.write(*options.out / "cost.csv");
    std::vector<Panel> panels;
    for (const auto& kinds : {std::vector{"law", "part"}, std::vector{"estimator"}}) {
      Panel panel{
          .title = kinds.size() > 1 ? "Force error, N, over the time of one step: laws and parts" : "… estimators",
          .x_label = "ns",
          .log_x = true,
          .log_y = true};
      for (std::size_t i = 0; i < kinds.size(); ++i) {
        Curve curve{.name = kinds[i], .colour = i == 0 ? kBlue : kGreen, .style = Curve::Style::kPoints};
        for (const Costed& line : lines) {
          if (line.kind == kinds[i] && line.force_error) curve.points.emplace_back(line.nanoseconds, *line.force_error);
        }
        panel.curves.push_back(curve);
      }
      panels.push_back(panel);
    }
    draw_panels(*options.out / "cost", "What accuracy costs", "commit " + std::string(kCommit), panels,
                options.command);
  }
  if (!out.flush()) throw std::runtime_error("cannot write the table: is the disk full?");
}

}  // namespace tendon::lab
