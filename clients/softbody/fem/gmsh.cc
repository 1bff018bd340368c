// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/gmsh.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "clients/softbody/fem/file_text.h"

namespace tendon::softbody {
namespace {

constexpr int kMaxCount = 10'000'000;

class Words {
 public:
  Words(std::string_view text, std::string_view name) : rest_(without_mark(text, name)), name_(name) {}

  std::string_view next() {  // empty at the end of the file
    std::size_t begin = 0;
    while (begin < rest_.size() &&
           (rest_[begin] == ' ' || rest_[begin] == '\t' || rest_[begin] == '\r' || rest_[begin] == '\n')) {
      line_ += rest_[begin] == '\n' ? 1 : 0;
      ++begin;
    }
    const std::size_t end = std::min(rest_.find_first_of(" \t\r\n", begin), rest_.size());
    const std::string_view found = rest_.substr(begin, end - begin);
    rest_.remove_prefix(end);
    return found;
  }

  std::string_view word(std::string_view expected) {
    const std::string_view found = next();
    if (found.empty()) fail("expected " + std::string(expected) + ", found the end of the file");
    return found;
  }

  double number() { return value<double>("a number"); }
  std::int64_t whole() { return value<std::int64_t>("a whole number"); }
  std::int64_t count() {
    const auto found = whole();
    if (found < 0 || found > kMaxCount) fail("expected a count of at most 10 million, found " + std::to_string(found));
    return found;
  }

  void expect(std::string_view keyword) {
    const auto found = word(keyword);
    if (found != keyword) fail("expected " + std::string(keyword) + ", found \"" + std::string(found) + '"');
  }

  bool seek(std::string_view keyword) {
    for (;;) {
      const std::string_view found = next();
      if (found.empty()) return false;
      if (found == keyword) return true;
    }
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw std::invalid_argument(std::string(name_) + ":" + std::to_string(line_) + ": " + what);
  }

 private:
  template <class T>
  T value(std::string_view what) {
    const std::string_view found = word(what);
    T result{};
    const auto [stop, error] = std::from_chars(found.data(), found.data() + found.size(), result);
    bool good = error == std::errc{} && stop == found.data() + found.size();
    if constexpr (std::is_floating_point_v<T>) good = good && std::isfinite(result);
    if (!good) fail("expected " + std::string(what) + ", found \"" + std::string(found) + '"');
    return result;
  }

  std::string_view rest_;
  std::string_view name_;
  int line_ = 1;
};

struct Type {  // `shape` is empty if it is not supported
  int number;
  int nodes;
  std::optional<Shape> shape;
  bool volume;
};
constexpr Type kTypes[] = {
    {1, 2, {}, false},          {2, 3, {}, false},          {3, 4, {}, false},
    {4, 4, Shape::kTet4, true}, {5, 8, Shape::kHex8, true}, {6, 6, {}, true},
    {7, 5, {}, true},           {8, 3, {}, false},          {9, 6, {}, false},
    {10, 9, {}, false},         {11, 10, {}, true},         {12, 27, Shape::kHex27, true},
    {15, 1, {}, false},         {16, 8, {}, false},         {17, 20, Shape::kHex20, true},
};

struct FileElement {
  std::int64_t number;
  std::vector<std::int64_t> nodes;
};

struct Content {
  std::unordered_map<std::int64_t, Vec3> nodes;
  std::vector<FileElement> elements;
  std::optional<Shape> shape;
};

class Reader {
 public:
  Reader(std::string_view text, std::string_view name) : words_(text, name), name_(name) {}

  Content read() {
    const std::string_view first = words_.word("$MeshFormat or $NOD");
    if (first == "$NOD") {
      read_nodes();
      words_.expect("$ENDNOD");
      words_.expect("$ELM");
      read_elements_of_format_1();
      words_.expect("$ENDELM");
    } else if (first == "$MeshFormat") {
      const double version = words_.number();
      if (words_.whole() != 0) words_.fail("expected a text file, found a binary file");
      if (version != 2.2 && version != 4.1) words_.fail("expected format 2.2 or 4.1");
      seek("$Nodes");
      version < 4 ? read_nodes() : read_nodes_of_format_4();
      words_.expect("$EndNodes");
      seek("$Elements");
      version < 4 ? read_elements_of_format_2() : read_elements_of_format_4();
      words_.expect("$EndElements");
    } else {
      words_.fail("expected $MeshFormat or $NOD, found another type of file");
    }
    expect_no_other_mesh();
    return std::move(content_);
  }

 private:
  void seek(std::string_view keyword) {
    if (!words_.seek(keyword)) words_.fail("there is no " + std::string(keyword));
  }

  void expect_no_other_mesh() {
    for (std::string_view word = words_.next(); !word.empty(); word = words_.next()) {
      if (word == "$Nodes" || word == "$Elements" || word == "$NOD" || word == "$ELM") {
        words_.fail("a second " + std::string(word) + ": expected one mesh in a file");
      }
    }
  }

  void add_node(std::int64_t number) {
    const double x = words_.number();
    const double y = words_.number();
    const double z = words_.number();
    if (!content_.nodes.try_emplace(number, x, y, z).second) {
      words_.fail("node " + std::to_string(number) + " occurs twice");
    }
  }

  void read_nodes() {
    for (auto left = words_.count(); left > 0; --left) add_node(words_.whole());
  }

  void read_nodes_of_format_4() {
    const auto blocks = words_.count();
    for (int skipped = 0; skipped < 3; ++skipped) words_.count();
    for (std::int64_t block = 0; block < blocks; ++block) {
      words_.whole();
      words_.whole();
      if (words_.whole() != 0) words_.fail("parametric nodes are not supported");
      std::vector<std::int64_t> numbers(static_cast<std::size_t>(words_.count()));
      for (auto& number : numbers) number = words_.whole();
      for (const auto number : numbers) add_node(number);
    }
  }

  const Type& type(std::int64_t number) {
    const auto* const found = std::ranges::find(kTypes, number, &Type::number);
    if (found == std::end(kTypes)) words_.fail("unknown type of element: " + std::to_string(number));
    return *found;
  }

  void add_element(std::int64_t number, const Type& type) {
    FileElement element{number, std::vector<std::int64_t>(static_cast<std::size_t>(type.nodes))};
    for (auto& node : element.nodes) node = words_.whole();
    if (!type.volume) return;
    const std::string who = "element " + std::to_string(number);
    if (!type.shape) words_.fail(who + ": expected a tetrahedron with 4 nodes, or a hexahedron with 8, 20 or 27");
    if (content_.shape && *content_.shape != *type.shape)
      words_.fail(who + " does not have the shape of the previous elements");
    content_.shape = type.shape;
    for (const auto node : element.nodes) {
      if (!content_.nodes.contains(node))
        words_.fail(who + " has the node " + std::to_string(node) + ", which does not exist");
    }
    if (std::set(element.nodes.begin(), element.nodes.end()).size() != element.nodes.size()) {
      words_.fail(who + " has a node twice");
    }
    content_.elements.push_back(std::move(element));
  }

  void read_elements_of_format_1() {
    for (auto left = words_.count(); left > 0; --left) {
      const auto number = words_.whole();
      const Type& kind = type(words_.whole());
      words_.whole();
      words_.whole();
      if (words_.whole() != kind.nodes)
        words_.fail("element " + std::to_string(number) + " has a wrong number of nodes");
      add_element(number, kind);
    }
  }

  void read_elements_of_format_2() {
    for (auto left = words_.count(); left > 0; --left) {
      const auto number = words_.whole();
      const Type& kind = type(words_.whole());
      for (auto tags = words_.count(); tags > 0; --tags) words_.whole();
      add_element(number, kind);
    }
  }

  void read_elements_of_format_4() {
    const auto blocks = words_.count();
    for (int skipped = 0; skipped < 3; ++skipped) words_.count();
    for (std::int64_t block = 0; block < blocks; ++block) {
      words_.whole();
      words_.whole();
      const Type& kind = type(words_.whole());
      for (auto left = words_.count(); left > 0; --left) add_element(words_.whole(), kind);
    }
  }

  Words words_;
  std::string_view name_;
  Content content_;
};

/// check() does not know the element numbers of the file.
void check_each(const Mesh& mesh, const std::vector<FileElement>& named, std::string_view name) {
  Mesh one{.shape = mesh.shape, .nodes = mesh.nodes, .elements = {}};
  try {
    check(mesh, name);
  } catch (const std::invalid_argument&) {
    for (int e = 0; e < mesh.element_count(); ++e) {
      const auto nodes = mesh.element(e);
      one.elements.assign(nodes.begin(), nodes.end());
      try {
        check(one, name);
      } catch (const std::invalid_argument& error) {
        std::string what = error.what();
        const std::string_view first = "element 1 ";
        what.replace(what.find(first), first.size(),
                     "element " + std::to_string(named[static_cast<std::size_t>(e)].number) + " ");
        throw std::invalid_argument(what);
      }
    }
  }
}

}  // namespace

FileMesh parse_gmsh(std::string_view text, std::string_view name, double scale, bool slits) {
  const Content content = Reader(text, name).read();
  if (!content.shape) refuse_file(name, "expected volume elements, found only a surface");
  FileMesh made{.mesh = {.shape = *content.shape, .nodes = {}, .elements = {}}, .numbers = {}};
  std::unordered_map<std::int64_t, int> index;
  for (const FileElement& element : content.elements) {
    made.numbers.push_back(element.number);
    for (const auto node : element.nodes) {
      const auto [found, is_new] = index.try_emplace(node, static_cast<int>(made.mesh.nodes.size()));
      if (is_new) made.mesh.nodes.push_back(content.nodes.at(node));
      made.mesh.elements.push_back(found->second);
    }
  }
  check_each(made.mesh, content.elements, name);
  made = joined(std::move(made), slits, name);
  for (Vec3& node : made.mesh.nodes) node *= scale;
  return made;
}

FileMesh read_gmsh(const std::filesystem::path& file, double scale, bool slits) {
  return parse_gmsh(read_file(file, kMaxMeshBytes), file.string(), scale, slits);
}

}  // namespace tendon::softbody
