// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/bench/row.h"

#include <sys/utsname.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "server/build_info.h"

namespace tendon::bench {
namespace {

/// At most three significant digits and one decimal: "0.4", "18.1", "1189".
std::string figure(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), value < 100 ? "%.1f" : "%.0f", value);
  return text.data();
}

std::string figure(const std::optional<double>& value) { return value ? figure(*value) : ""; }

std::string times(const std::optional<double>& ratio) {
  std::array<char, 32> text{};
  if (ratio) std::snprintf(text.data(), text.size(), *ratio < 100 ? "%.2f" : "%.0f", *ratio);
  return text.data();
}

std::string pad(const std::string& text, std::size_t width, bool left = true) {
  std::size_t places = 0;
  for (const char c : text) places += (static_cast<unsigned char>(c) & 0xC0U) == 0x80U ? 0 : 1;
  const std::string space(places < width ? width - places : 0, ' ');
  return left ? text + space : space + text;
}

constexpr std::size_t kWhat = 58;
constexpr std::size_t kNumber = 10;

std::string line(const std::string& what, const std::array<std::string, 7>& numbers, const std::string& rest) {
  std::string text = pad(what, kWhat);
  for (const std::string& number : numbers) text += pad(number, kNumber, false);
  return text + "  " + rest;
}

std::string of_target(const Row& row) {
  return row.target ? row.target->text + (row.target->met ? ": met" : ": missed") : "";
}

std::string first_line_of(const char* path, const std::string& key) {
  std::ifstream file(path);
  for (std::string text; std::getline(file, text);) {
    if (text.rfind(key, 0) != 0) continue;
    const auto value = text.find_first_not_of(" \t", text.find(':') + 1);
    return value == std::string::npos ? "" : text.substr(value);
  }
  return "unknown";
}

std::string cell(std::string text) {
  for (auto at = text.find('|'); at != std::string::npos; at = text.find('|', at + 2)) text.replace(at, 1, "\\|");
  return text;
}

}  // namespace

Circumstances look_around() {
  Circumstances here;
  here.machine = first_line_of("/proc/cpuinfo", "model name");
  utsname system{};
  if (::uname(&system) == 0) here.kernel = std::string(system.sysname) + " " + system.release;
  here.commit = kCommit;
  here.processors = std::thread::hardware_concurrency();
#if defined(__clang__)
  here.compiler = "clang " __clang_version__;
#else
  here.compiler = "g++ " __VERSION__;
#endif
  return here;
}

double load() {
  double minute = 0;
  ::getloadavg(&minute, 1);
  return minute;
}

std::string heading() {
  return line("", {"n", "p50", "p99", "floor p50", "p99", "to floor", "unit"}, "target; what the floor is") + "\n";
}

std::string to_text(const Row& row) {
  std::string rest = of_target(row);
  if (!row.floor.empty()) rest += (rest.empty() ? "" : "; ") + row.floor;
  std::string text = line(row.what,
                          {std::to_string(row.n), figure(row.p50), figure(row.p99), figure(row.floor_p50),
                           figure(row.floor_p99), times(row.ratio), row.unit},
                          rest) +
                     "\n";
  if (!row.note.empty()) text += "    " + row.note + "\n";
  return text;
}

std::string to_text(const Circumstances& c) {
  std::array<char, 160> numbers{};
  std::snprintf(numbers.data(), numbers.size(), "load %.1f before, %.1f after; seed %llu; %.0f s", c.load_before,
                c.load_after, static_cast<unsigned long long>(c.seed), c.seconds);
  return c.machine + ", " + std::to_string(c.processors) + " processors; " + c.kernel + "; commit " + c.commit + "; " +
         c.compiler + "; " + numbers.data() +
         (c.priority > 0 ? "; with real-time priority " + std::to_string(c.priority)
                         : std::string("; at normal priority")) +
         (c.quick ? "; --quick: too short for valid figures" : "") + "\n";
}

JsonLine line_of(const Row& row) {
  JsonLine json;
  json.add("section", row.section)
      .add("what", row.what)
      .add("unit", row.unit)
      .add("n", row.n)
      .add("p50", row.p50)
      .add("p99", row.p99)
      .add("floor", row.floor)
      .add("floor_p50", row.floor_p50)
      .add("floor_p99", row.floor_p99)
      .add("ratio", row.ratio)
      .add("instructions", row.instructions);
  if (row.target) json.add("target", row.target->text).add("met", row.target->met);
  for (const auto& [name, value] : row.figures) json.add(name.c_str(), value);
  json.add("note", row.note);
  return json;
}

std::string to_json(const Circumstances& c) {
  return JsonLine()
      .add("section", "circumstances")
      .add("machine", c.machine)
      .add("processors", c.processors)
      .add("kernel", c.kernel)
      .add("commit", c.commit)
      .add("compiler", c.compiler)
      .add("load_before", c.load_before)
      .add("load_after", c.load_after)
      .add("seed", c.seed)
      .add("priority", c.priority)
      .add("quick", c.quick)
      .add("seconds", c.seconds)
      .str();
}

std::string to_markdown(const Circumstances& c, const std::vector<Row>& rows) {
  std::string page = std::string(kPageBegins) + "\n\nWritten by `" + c.command +
                     "`; tests/tools/bench/README.md says how each line is measured.\n\n" + to_text(c) +
                     "\nEach line's floor was measured within this run: in turns with it, right after it (sessions, "
                     "512 devices), or once "
                     "(devices). Ratios travel from machine to machine; times do not.\n";
  std::string section;
  for (const Row& row : rows) {
    if (row.section != section) {
      section = row.section;
      page += "\n## " + section +
              "\n\n| | n | p50 | p99 | | floor | p50 | p99 | to floor | target | "
              "|\n|---|---|---|---|---|---|---|---|---|---|---|\n";
    }
    page += "| " + cell(row.what) + " | " + std::to_string(row.n) + " | " + figure(row.p50) + " | " + figure(row.p99) +
            " | " + row.unit + " | " + cell(row.floor) + " | " + figure(row.floor_p50) + " | " + figure(row.floor_p99) +
            " | " + times(row.ratio) + " | " + cell(of_target(row)) + " | " + cell(row.note) + " |\n";
  }
  return page;
}

}  // namespace tendon::bench
