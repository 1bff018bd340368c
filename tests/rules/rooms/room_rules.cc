// SPDX-License-Identifier: Apache-2.0
#include "tests/rules/rooms/room_rules.h"

#include <algorithm>
#include <cstddef>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tests/rules/rooms/citations.h"
#include "tests/rules/rooms/text.h"

namespace tendon::rooms {
namespace {

struct Room {
  std::string_view name;
  Names may_include;
};

/// `tests` is not listed because it may include everything.
const std::vector<Room>& rooms() {
  static const std::vector<Room> kRooms = {
      {"core", {"core"}},
      {"protocol", {"protocol", "core"}},
      {"devices", {"devices", "core"}},
      {"server", {"server", "protocol", "core", "devices"}},
      // A client may include its own folder, clients/cpp, and the headers of protocol, which provide the types of core,
      // but no other clients.
      {"clients", {"protocol"}},
  };
  return kRooms;
}

const Names kAtTheRoot = {".ci",          ".dockerignore", ".clang-format",  ".clang-tidy",       ".gitignore",
                          "CHANGELOG.md", "CITATION.cff",  "CMakeLists.txt", "CMakePresets.json", "CONTRIBUTING.md",
                          "LICENSE",      "README.md"};

/// Every room may use these headers: control the floating point unit, pass the newest value between threads, find
/// misspelled words, format the errors of a command line, print without waiting for a reader, mark datagrams and read
/// their time stamps, and declare the keys of a scene.
const Names kForAllRooms = {"core/base/arithmetic.h",     "core/base/nearest_word.h",    "core/exchange/latest.h",
                            "clients/cpp/dscp.h",         "clients/cpp/kernel_stamps.h", "clients/cpp/usage.h",
                            "server/machine/output.h",    "server/scene/reader.h",       "server/scene/reference.h",
                            "server/scene/scene_error.h", "server/scene/values.h"};

/// If a path ends with a slash, it is a folder. If it begins with a star, it is a suffix.
struct Door {
  std::string_view library;
  Names headers;
  Names files;
};

const std::vector<Door>& front_doors() {
  static const std::vector<Door> kDoors = {
      {"Asio", {"asio.hpp", "asio/"}, {"server/machine/udp_link.cc", "clients/cpp/udp_transport.cc"}},
      // HTTP and WebSockets may only be used by processes without a haptic thread.
      {"Boost.Beast and Boost.Asio", {"boost/"}, {"clients/cpp/web/http_server.cc"}},
      // For programs in C and in other languages.
      {"C", {"stddef.h", "stdint.h"}, {"clients/c/tendon.h"}},
      {"the installed header of libtendon", {"tendon.h"}, {"clients/c/examples/"}},
      {"CHOLMOD", {"cholmod.h", "Eigen/CholmodSupport"}, {"clients/softbody/fem/sparse.cc"}},
      {"CLI11",
       {"CLI/"},
       {"server/main.cc", "clients/cpp/options.cc", "clients/cpp/usage.h", "clients/cpp/usage.cc", "*_main.cc"}},
      // DDS, the types that idlc generates from ros2_types.idl, and the text of this file.
      {"Cyclone DDS", {"dds/", "ros2_types.h", "ros2_types_text.h"}, {"clients/bridge/ros2/ros2_node.cc"}},
      {"Eigen", {"Eigen/"}, {"core/", "protocol/", "devices/", "server/", "clients/"}},
      {"Eigen's tree of boxes", {"unsupported/Eigen/BVH"}, {"clients/softbody/effects/self_collision.cc"}},
      {"libsodium", {"sodium.h", "sodium/"}, {"protocol/secrets/crypto.cc", "devices/falcon/firmware.cc"}},
      {"libusb", {"libusb.h", "libusb-1.0/"}, {"devices/usb/with_libusb.cc", "tests/devices/usb/far_usbfs.cc"}},
      {"MuJoCo", {"mujoco/"}, {"clients/mujoco/cpp/touch_mjcf.cc"}},
      // The haptic thread must not write JSON.
      {"nlohmann's JSON",
       {"nlohmann/"},
       {"server/commands/", "server/main.cc", "clients/cpp/discovery/list.cc", "clients/cpp/engine/self_test.cc",
        "clients/cpp/run.cc", "clients/dashboard/page_json.cc", "clients/dashboard/foxglove_text.cc",
        "clients/bridge/bridge_host.cc", "clients/bridge/inverse/inverse_json.cc",
        "clients/softbody/cluster/estimate.cc", "clients/softbody/explain.cc", "*_main.cc"}},
      {"the library of OpenIGTLink", {"openigtlink/"}, {"tests/clients/bridge/igtl/igtl_library_test.cc"}},
      {"Octave", {"octave/"}, {"clients/c/examples/tendon_oct.cc"}},
      {"PETSc", {"petscksp.h"}, {"clients/softbody/mpi/spread_solver.cc"}},
      {"preCICE", {"precice/"}, {"clients/precice/precice_engine.cc", "tests/clients/precice/"}},
      {"prometheus-cpp", {"prometheus/"}, {"clients/dashboard/metrics.cc"}},
      {"protobuf",
       {"google/protobuf/", "*.pb.h"},
       {"server/recording/recording_codec.cc", "clients/dashboard/foxglove_message.cc"}},
      // The resolver of the C library, for record types that getaddrinfo() does not support.
      {"libresolv", {"resolv.h"}, {"clients/cpp/discovery/unicast.cc"}},
      {"libsystemd", {"systemd/"}, {"server/machine/announcer.cc", "clients/cpp/discovery/avahi.cc"}},
      {"Spectra", {"Spectra/"}, {"tests/tools/lab/models/spectrum.cc"}},
      {"toml++", {"toml++/"}, {"server/scene/"}},
      {"umockdev", {"umockdev.h"}, {"tests/devices/usb/mock_usb.cc"}},
      {"xxHash", {"xxhash.h"}, {"clients/softbody/fem/file_bytes.cc"}},
      {"zlib", {"zlib.h"}, {"server/recording/mcap_format.cc"}},
  };
  return kDoors;
}

/// Standard headers for mathematics. Threads, locks, clocks, files, streams and random numbers are excluded.
const std::set<std::string_view> kStandardForCore = {
    "algorithm",   "array",    "atomic",      "bit",       "bitset",     "cassert",
    "cfloat",      "charconv", "cmath",       "compare",   "complex",    "concepts",
    "cstddef",     "cstdint",  "cstring",     "exception", "functional", "initializer_list",
    "iterator",    "limits",   "memory",      "new",       "numbers",    "numeric",
    "optional",    "ratio",    "ranges",      "span",      "stdexcept",  "string",
    "string_view", "tuple",    "type_traits", "utility",   "variant",    "vector",
    "version"};

/// protocol does no I/O, never blocks, and is used by one thread at a time.
const std::set<std::string_view> kNotForProtocol = {
    "condition_variable", "fcntl.h",   "filesystem",   "fstream", "future",  "iostream", "mutex", "netdb.h", "poll.h",
    "pthread.h",          "semaphore", "shared_mutex", "thread",  "unistd.h"};

/// These headers of the operating system are not in a folder. C headers are included by their C++ names (<cmath>).
const std::set<std::string_view> kSystemHeaders = {"dlfcn.h",  "elf.h",    "fcntl.h", "ifaddrs.h",
                                                   "malloc.h", "netdb.h",  "poll.h",  "pthread.h",
                                                   "sched.h",  "signal.h", "spawn.h", "unistd.h"};
const Names kSystemFolders = {"arpa/", "linux/", "net/", "netinet/", "sys/"};

/// The background thread may outlive the model that gave it work, or it may end earlier, so both share the data.
const Names kSharedWithAThread = {"clients/softbody/near/near_model.cc", "clients/softbody/near/near_model.h",
                                  "server/machine/output.cc"};

/// Server and client library read the clock once per turn, and their sockets on each receive. All other code takes the
/// time as a parameter. tests/core/base/time_test.cc checks that the time types of core have no now().
const Names kClockReaders = {
    "server/machine/clock.h", "server/machine/clock.cc", "server/machine/log.cc", "server/server.cc",
    "server/machine/udp_link.cc", "clients/cpp/machine.h", "clients/cpp/machine.cc",
    // this runs in the process of another program and is called by its threads
    "clients/bridge/chai3d/hd_phantom.cc", "clients/softbody/softbody_main.cc", "tests/clients/softbody/bench.cc",
    "tests/clients/softbody/bullet_block.cc", "tests/tools/bench/", "tests/e2e/", "tests/realtime/", "tests/soak/",
    "tests/devices/usb/", "tests/core/base/time_test.cc", "tests/tools/lab/experiments/meter.cc",
    "tests/tools/injector/proxy/real_time.cc", "tests/tools/conformance/udp_wire.cc",
    "tests/tools/conformance/worker_wire.cc", "*_main.cc"};

/// Returns "clients/cpp/" for "clients/cpp/run.cc".
std::string_view client_folder(std::string_view path) {
  const auto end = path.find('/', path.find('/') + 1);
  return end == std::string_view::npos ? std::string_view() : path.substr(0, end + 1);
}

struct Include {
  int line = 0;
  bool quoted = false;
  std::string name;
};

bool is_source(const File& file) {
  return one_of(file.path, {"*.h", "*.cc", "*.h.in", "*.cc.in", "*.cmake.in", "*.proto", "*.cmake", "*CMakeLists.txt",
                            "*.mjs", "*.js", "*.ts", "*.py", "*.sh", "*.toml"}) ||
         file.text.starts_with("#!");
}

std::string list(const Names& names) {
  std::string all;
  for (const auto name : names) {
    all += all.empty() ? "" : ", ";
    all += name;
  }
  return all;
}

std::optional<std::string> broken_by_project_include(const std::string& path, const Include& include) {
  const auto here = first_folder(path);
  const auto there = first_folder(include.name);
  if (here == "tests" || one_of(include.name, kForAllRooms)) {
    return std::nullopt;
  }
  if (here == "clients" &&
      (include.name.starts_with(client_folder(path)) || include.name.starts_with("clients/cpp/"))) {
    return std::nullopt;
  }
  const auto room = std::ranges::find(rooms(), here, &Room::name);
  if (room == rooms().end() || std::ranges::find(room->may_include, there) != room->may_include.end()) {
    return std::nullopt;
  }
  return join({here, " may include ", list(room->may_include),
               here == "clients" ? ", clients/cpp and the client's own folder" : "", ", not ", include.name});
}

std::optional<std::string> broken_by_library_include(const std::string& path, const Include& include) {
  const auto here = first_folder(path);
  const std::string_view name = include.name;
  if (here == "tests") {
    return std::nullopt;
  }
  for (const auto& door : front_doors()) {
    if (one_of(name, door.headers)) {
      if (one_of(path, door.files)) {
        return std::nullopt;
      }
      return join({door.library, " has its front door in ", list(door.files), ", not here"});
    }
  }
  if (here == "core" && !kStandardForCore.contains(name) && !(name == "chrono" && path == "core/base/time.h")) {
    return join({"core is mathematics and must not know <", name, ">"});
  }
  if (here == "protocol" && (kNotForProtocol.contains(name) || name.starts_with("sys/"))) {
    return join({"protocol does no input or output and must not know <", name, ">"});
  }
  const bool standard = name.find_first_of("./") == std::string_view::npos;
  if (!standard && !kSystemHeaders.contains(name) && !one_of(name, kSystemFolders)) {
    return join({"<", name, "> is of a library that has no front door in tests/rules/rooms/room_rules.cc"});
  }
  return std::nullopt;
}

void check_includes(const File& file, const std::vector<std::string_view>& lines, std::vector<Finding>& findings) {
  static const std::regex kInclude(R"re(^\s*#\s*include\s*(["<])([^">]*)[">])re");
  for (std::size_t i = 0; i < lines.size(); ++i) {
    std::match_results<std::string_view::const_iterator> match;
    if (!contains(lines[i], "include") || !std::regex_search(lines[i].begin(), lines[i].end(), match, kInclude)) {
      continue;
    }
    const Include include{static_cast<int>(i) + 1, match.str(1) == "\"", match.str(2)};
    const auto there = first_folder(include.name);
    const bool generated = include.name.ends_with(".pb.h");
    const bool of_ours =
        include.name.find('/') != std::string::npos && std::ranges::find(kRoomFolders, there) != kRoomFolders.end();
    std::optional<std::string> broken;
    if (of_ours) {
      broken = broken_by_project_include(file.path, include);
    } else if (include.quoted && !generated) {
      broken = join({"\"", include.name, "\": the paths of our own headers begin at the root"});
    } else {
      broken = broken_by_library_include(file.path, include);
    }
    if (broken) {
      findings.push_back({file.path, include.line, *broken});
    }
  }
}

struct Forbidden {
  std::vector<std::string_view> words;  ///< if a line contains none of these, the pattern does not match
  std::regex pattern;
  std::string_view rule;
  bool (*applies)(std::string_view path);
};

const std::vector<Forbidden>& forbidden_words() {
  static const std::vector<Forbidden> kForbidden = [] {
    const auto everywhere = [](std::string_view) { return true; };
    const auto but_shared_with_a_thread = [](std::string_view path) { return !one_of(path, kSharedWithAThread); };
    const auto but_clock_readers = [](std::string_view path) { return !one_of(path, kClockReaders); };
    const auto headers = [](std::string_view path) { return path.ends_with(".h"); };
    std::vector<Forbidden> words;
    words.push_back(
        {{"now", "clock", "time"},
         std::regex(R"(::\s*now\s*\(|\b(clock_gettime|gettimeofday|timespec_get)\s*\(|\bstd::(time|clock)\s*\()"),
         "time is passed, never taken: only the clock files read a clock",
         but_clock_readers});
    words.push_back({{"_distribution"},
                     std::regex(R"(\bstd::\w+_distribution\b)"),
                     "distributions differ between standard libraries: use an inverse CDF over std::mt19937_64",
                     everywhere});
    words.push_back({{"_ptr", "make_shared"},
                     std::regex(R"(\b(std::)?(shared_ptr|make_shared)\b)"),
                     "own plainly: values, references, std::unique_ptr, no std::shared_ptr",
                     but_shared_with_a_thread});
    words.push_back({{"parse"},
                     std::regex(R"(\bapp\.parse\s*\()"),
                     "usage::parse() parses command lines: CLI11 takes an empty text for 0",
                     [](std::string_view path) { return path != "clients/cpp/usage.cc"; }});
    // These statements print a text field of tendon.proto.
    words.push_back({{"cout", "cerr"},
                     std::regex(R"(\bstd::(cout|cerr)\b(?!.*\bvisible\().*)"
                                R"(((\b(hello|welcome|peer)\w*|[^.\w]client\w*)(\.|->)name\b)"
                                R"(|[.>](words|reason|detail|fault|degraded|device_name|holder|model)\b))"),
                     "a peer's words are printed through visible(): they could forge a line or move the cursor",
                     everywhere});
    words.push_back({{"namespace"},
                     std::regex(R"(\busing\s+namespace\b)"),
                     "no using namespace in a header: it reaches everyone who includes it",
                     headers});
    return words;
  }();
  return kForbidden;
}

void check_words(const File& file, const std::vector<std::string_view>& lines, std::vector<Finding>& findings) {
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (const auto& word : forbidden_words()) {
      const auto in_line = [&](std::string_view one) { return contains(lines[i], one); };
      if (std::ranges::any_of(word.words, in_line) && word.applies(file.path) &&
          std::regex_search(lines[i].begin(), lines[i].end(), word.pattern)) {
        findings.push_back({file.path, static_cast<int>(i) + 1, std::string(word.rule)});
      }
    }
  }
}

void check_first_lines(const File& file, std::vector<Finding>& findings) {
  const auto lines = lines_of(file.text);
  const std::size_t first = file.text.starts_with("#!") ? 1 : 0;
  const std::string_view mark =
      one_of(file.path, {"*.h", "*.cc", "*.proto", "*.mjs", "*.js", "*.ts", "*.h.in", "*.cc.in"}) ? "//" : "#";
  const std::string licence = join({mark, " SPDX-License-", "Identifier: Apache-2.0"});
  if (lines.size() <= first || lines[first] != licence) {
    findings.push_back({file.path, static_cast<int>(first) + 1, join({"a source file begins with ", licence})});
  }
  if (file.path.ends_with(".h") && std::ranges::find(lines, "#pragma once") == lines.end()) {
    findings.push_back({file.path, 1, "a header has #pragma once"});
  }
}

void check_places(const std::vector<File>& tree, std::vector<Finding>& findings) {
  std::set<std::string_view> paths;
  std::map<std::string_view, std::string_view> at_the_root;
  for (const auto& file : tree) {
    paths.insert(file.path);
    at_the_root.emplace(first_folder(file.path), file.path);
  }
  for (const auto& [name, example] : at_the_root) {
    if (std::ranges::find(kRoomFolders, name) == kRoomFolders.end() &&
        std::ranges::find(kAtTheRoot, name) == kAtTheRoot.end()) {
      findings.push_back({std::string(example), 1, join({name, " has no place at the root"})});
    }
  }
  for (const auto room : kRoomFolders) {
    const auto page = join({room, "/README.md"});
    if (at_the_root.contains(room) && !paths.contains(page)) {
      findings.push_back({page, 1, join({"the room ", room, " has no README.md"})});
    }
  }
}

}  // namespace

std::vector<Finding> check(const std::vector<File>& tree) {
  std::vector<Finding> findings;
  const auto citable = citable_in(tree);
  for (const auto& file : tree) {
    std::vector<Finding> in_file;
    if (is_source(file) || (file.path.ends_with(".md") && file.path != "CHANGELOG.md")) {
      check_citations(file, citable, in_file);
    }
    if (is_source(file)) {
      check_first_lines(file, in_file);
    }
    if (is_cpp(file.path)) {
      const auto code = without_comments_and_strings(file.text);
      const auto lines = lines_of(code);
      check_includes(file, lines, in_file);
      check_words(file, lines, in_file);
    }
    std::ranges::stable_sort(in_file, {}, &Finding::line);
    std::ranges::move(in_file, std::back_inserter(findings));
  }
  check_places(tree, findings);
  return findings;
}

std::vector<File> read_tree(const std::filesystem::path& root) {
  static const std::set<std::string> kMadeHere = {".git", ".cache", "__pycache__", "build", "dist", "node_modules"};
  std::vector<File> tree;
  for (auto entry = std::filesystem::recursive_directory_iterator(root); entry != std::filesystem::end(entry);
       ++entry) {
    if (kMadeHere.contains(entry->path().filename().string())) {
      entry.disable_recursion_pending();
    } else if (entry->is_regular_file() && entry->path().extension() != ".mcap") {
      std::ifstream stream(entry->path(), std::ios::binary);
      tree.push_back({entry->path().lexically_relative(root).generic_string(),
                      std::string(std::istreambuf_iterator<char>(stream), {})});
    }
  }
  std::ranges::sort(tree, {}, &File::path);
  return tree;
}

std::string to_string(const Finding& finding) {
  return join({finding.path, ":", std::to_string(finding.line), ": ", finding.rule});
}

std::string without_comments_and_strings(std::string_view text) {
  std::string code(text);
  const auto blank = [&](std::size_t from, std::size_t to) {
    for (auto i = from; i < std::min(to, code.size()); ++i) {
      code[i] = code[i] == '\n' ? '\n' : ' ';
    }
  };
  for_each_comment_and_literal(text, blank, blank);
  return code;
}

}  // namespace tendon::rooms
