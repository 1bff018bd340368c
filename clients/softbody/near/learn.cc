// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/learn.h"

#include <algorithm>
#include <array>
#include <concepts>
#include <cstdio>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include "clients/softbody/fem/file_bytes.h"
#include "clients/softbody/fem/file_text.h"
#include "clients/softbody/models/surface_table.h"

namespace tendon::softbody {
namespace {

constexpr std::uint64_t kLearnedVersion = 3;
constexpr std::uintmax_t kMostLearnedBytes = std::uintmax_t{1} << 30;

/// The magic bytes, the name and the fields of each file type.
struct OfShapes {
  using Value = LearnedShapes;
  static constexpr std::string_view kBegins = "TENDONSH";
  static constexpr std::string_view kName = "shapes-";
  template <class Pass>
  static void pass(Pass& pass, auto& v) {
    pass(v.elements), pass(v.weights), pass(v.shapes), pass(v.depths), pass(v.linear), pass(v.knots);
    pass(v.inverses), pass(v.errors);
  }
  static bool fits(const LearnedShapes& v, const Solid& solid, const TouchSurface& surface) {
    const Mesh& mesh = solid.mesh();
    std::vector<int> nodes;
    for (const int element : v.elements) {
      if (element < 0 || element >= mesh.element_count()) return false;
      nodes.insert(nodes.end(), mesh.element(element).begin(), mesh.element(element).end());
    }
    std::ranges::sort(nodes);
    const auto different = std::unique(nodes.begin(), nodes.end()) - nodes.begin();
    const Eigen::Index r = v.linear.rows();
    return std::ranges::is_sorted(v.elements, std::less_equal<>()) && r > 0 && v.linear.cols() == r &&
           v.weights.size() == static_cast<Eigen::Index>(v.elements.size()) && (v.weights.array() > 0).all() &&
           v.shapes.rows() == 3 * different && v.shapes.cols() == r && v.depths.rows() == r &&
           v.depths.cols() == static_cast<Eigen::Index>(surface.nodes().size()) && v.knots.rows() == r &&
           v.knots.cols() == v.grid.knots() && v.inverses.rows() == r && v.inverses.cols() == r * v.grid.knots() &&
           v.errors.size() == at(v.grid.cells()) && v.shapes.allFinite() && v.depths.allFinite() &&
           v.linear.allFinite() && v.knots.allFinite() && v.inverses.allFinite() && v.weights.allFinite();
  }
};

struct OfAnswers {
  using Value = TabulatedAnswers;
  static constexpr std::string_view kBegins = "TENDONAN";
  static constexpr std::string_view kName = "answers-";
  template <class Pass>
  static void pass(Pass& pass, auto& v) {
    pass(v.numbers), pass(v.errors);
  }
  static bool fits(const TabulatedAnswers& v, const Solid&, const TouchSurface&) {
    return v.numbers.size() == at(v.grid.knots()) * TabulatedAnswers::kNumbers &&
           v.errors.size() == at(v.grid.cells()) &&
           std::ranges::all_of(v.numbers, [](double x) { return std::isfinite(x); });
  }
};

class Writes {
 public:
  explicit Writes(std::string& to) : to_(to) {}
  template <class Entry>
  void operator()(const std::vector<Entry>& list) {
    put(to_, std::uint64_t{list.size()});
    for (const Entry entry : list) put(to_, static_cast<double>(entry));
  }
  template <class Derived>
  void operator()(const Eigen::PlainObjectBase<Derived>& all) {
    put(to_, static_cast<std::uint64_t>(all.rows()));
    put(to_, static_cast<std::uint64_t>(all.cols()));
    to_.append(reinterpret_cast<const char*>(all.data()), static_cast<std::size_t>(all.size()) * sizeof(double));
  }

 private:
  std::string& to_;
};

class Reads {
 public:
  explicit Reads(ByteReader& from) : from_(from) {}
  template <class Entry>
  void operator()(std::vector<Entry>& list) {
    list.resize(count(1));
    for (Entry& entry : list) entry = static_cast<Entry>(from_.take<double>());
  }
  void operator()(VectorXd& all) { sized(all); }
  void operator()(MatrixXd& all) { sized(all); }

 private:
  std::size_t count(std::size_t each) {
    const auto size = from_.take<std::uint64_t>();
    if (size > from_.left() / sizeof(double) / std::max<std::size_t>(each, 1)) {
      throw std::invalid_argument("it is truncated");
    }
    return size;
  }
  template <class All>
  void sized(All& all) {
    const std::size_t rows = count(1);
    const std::size_t columns = count(rows);
    all.resize(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns));
    for (double& entry : all.reshaped()) entry = from_.take<double>();
  }
  ByteReader& from_;
};

std::uint64_t digest_of(const Solid& solid, const TouchSurface& surface, const PressGrid& grid) {
  std::string bytes;
  put(bytes, softbody::digest_of(solid, surface.normal()));
  put(bytes, static_cast<std::uint64_t>(solid.law()));
  for (const double x : {surface.radius(), grid.middle.x(), grid.middle.y(), grid.spacing, grid.step}) put(bytes, x);
  put(bytes, grid.around);
  put(bytes, PressGrid::kLevels);
  put(bytes, kLearnedVersion);
  return checksum(bytes);
}

std::filesystem::path file_of(const std::filesystem::path& folder, std::string_view name, std::uint64_t digest) {
  std::array<char, 17> hex{};
  std::snprintf(hex.data(), hex.size(), "%016llx", static_cast<unsigned long long>(digest));
  return folder / (std::string(name) + hex.data());
}

template <class Kind>
std::string bytes_of(const typename Kind::Value& value, std::uint64_t digest) {
  std::string bytes(Kind::kBegins);
  put(bytes, kLearnedVersion);
  put(bytes, digest);
  Writes writes(bytes);
  Kind::pass(writes, value);
  put(bytes, checksum(bytes));
  return bytes;
}

template <class Kind>
typename Kind::Value value_of(std::string_view bytes, std::uint64_t digest, const PressGrid& grid, const Solid& solid,
                              const TouchSurface& surface) {
  if (!bytes.starts_with(Kind::kBegins)) throw std::invalid_argument("it does not start with the expected header");
  if (bytes.size() < Kind::kBegins.size() + sizeof(std::uint64_t)) throw std::invalid_argument("it is truncated");
  ByteReader reader(without_checksum(bytes).substr(Kind::kBegins.size()));
  if (reader.take<std::uint64_t>() != kLearnedVersion || reader.take<std::uint64_t>() != digest) {
    throw std::invalid_argument("it is for another body than its name");
  }
  typename Kind::Value value{.grid = grid};
  Reads reads(reader);
  Kind::pass(reads, value);
  if (reader.left() > 0 || !Kind::fits(value, solid, surface)) {
    throw std::invalid_argument("its data do not match the body");
  }
  return value;
}

/// Does not overwrite an existing file.
void keep(const std::filesystem::path& file, std::string_view bytes) {
  std::filesystem::create_directories(file.parent_path());
  std::filesystem::path draft = file;
  draft += ".new";
  write_draft(draft, bytes);
  std::error_code there;
  std::filesystem::create_hard_link(draft, file, there);  // another process may be faster
  std::filesystem::remove(draft);
  if (there && there != std::errc::file_exists) {
    throw std::runtime_error("cannot write " + file.string() + ": " + there.message());
  }
}

template <class Kind>
void read_kept(const std::filesystem::path& file, std::uint64_t digest, const PressGrid& grid, const Solid& solid,
               const TouchSurface& surface, std::optional<typename Kind::Value>& to,
               std::vector<std::string>& warnings) {
  if (!std::filesystem::exists(file)) return;
  try {
    to = value_of<Kind>(read_file(file, kMostLearnedBytes), digest, grid, solid, surface);
  } catch (const std::invalid_argument& error) {
    warnings.push_back(file.string() + " cannot be used: " + error.what() +
                       ". The data are learned again at each start until this file is removed");
  }
}

}  // namespace

Learned learn(const Solid& solid, const TouchSurface& surface, const LearnConfig& config, const Tell& tell) {
  const PressGrid grid = PressGrid::over(config.middle, config.reach, surface.radius());
  const bool keeps = !config.folder.empty();
  const std::uint64_t digest = keeps ? digest_of(solid, surface, grid) : 0;
  const std::filesystem::path shapes = file_of(config.folder, OfShapes::kName, digest);
  const std::filesystem::path answers = file_of(config.folder, OfAnswers::kName, digest);
  Learned learned;
  if (keeps && config.shapes) {
    read_kept<OfShapes>(shapes, digest, grid, solid, surface, learned.shapes, learned.warnings);
  }
  if (keeps && config.answers) {
    read_kept<OfAnswers>(answers, digest, grid, solid, surface, learned.answers, learned.warnings);
  }
  const bool wants_shapes = config.shapes && !learned.shapes;
  const bool wants_answers = config.answers && !learned.answers;
  if (!wants_shapes && !wants_answers) return learned;
  const SolvedPresses presses = solve_presses(solid, surface, grid, wants_answers, tell);
  if (wants_shapes) {
    learned.shapes = learn_shapes(solid, surface, presses, tell);
    if (keeps) keep(shapes, bytes_of<OfShapes>(*learned.shapes, digest));
  }
  if (wants_answers) {
    learned.answers = tabulate(presses);
    if (keeps) keep(answers, bytes_of<OfAnswers>(*learned.answers, digest));
  }
  return learned;
}

}  // namespace tendon::softbody
