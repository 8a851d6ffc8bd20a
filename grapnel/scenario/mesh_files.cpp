#include "grapnel/scenario/mesh_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <unordered_map>

#include "grapnel/result/file_seal.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/text_file.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

// What ends the reading of a file.
struct MeshFault {
  int line;  // 0: none
  int column;
  std::string message;
};

// Numbers of this size and more are no place in space.
constexpr double kLargestCoordinate = 1e9;

std::string lower_case(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

// --- Triangles as they come ---

class MeshCollector {
 public:
  int vertex(const Vector3d& p) {
    // -0 is 0 and has the same bits from here on.
    const Key key{std::bit_cast<std::uint64_t>(p[0] + 0.0), std::bit_cast<std::uint64_t>(p[1] + 0.0),
                  std::bit_cast<std::uint64_t>(p[2] + 0.0)};
    const auto [it, fresh] = known_.emplace(key, static_cast<int>(vertices_.size()));
    if (fresh) vertices_.push_back(p);
    return it->second;
  }

  // Counts every triangle; keeps those that have an area.
  void triangle(int a, int b, int c) {
    ++count_;
    if (a == b || b == c || c == a) return;
    const Vector3d n = cross(vertices_[b] - vertices_[a], vertices_[c] - vertices_[a]);
    if (dot(n, n) > 0) triangles_.push_back({a, b, c});
  }
  std::size_t count() const { return count_; }

  std::shared_ptr<const TriangleMesh> finish(const std::string& name) {
    if (count_ == 0) throw MeshFault{0, 0, "the mesh has no triangle"};
    if (triangles_.empty()) throw MeshFault{0, 0, "the mesh has no triangle with an area"};
    drop_unused();
    try {
      return make_triangle_mesh(name, std::move(vertices_), std::move(triangles_));
    } catch (const std::invalid_argument&) {
      throw MeshFault{0, 0, "the mesh is flat: all its vertices lie in one plane; give it a thickness"};
    }
  }

 private:
  using Key = std::array<std::uint64_t, 3>;
  struct Hash {
    std::size_t operator()(const Key& key) const {
      std::uint64_t h = 0;
      for (const std::uint64_t k : key) h = (h ^ k) * 0x9e3779b97f4a7c15u ^ (h >> 29);
      return h ^ (h >> 32);
    }
  };

  // Vertices that no triangle has, which would only widen the hull.
  void drop_unused() {
    std::vector<int> number(vertices_.size(), -1);
    std::vector<Vector3d> used;
    for (auto& triangle : triangles_) {
      for (int& v : triangle) {
        if (number[v] < 0) {
          number[v] = static_cast<int>(used.size());
          used.push_back(vertices_[v]);
        }
        v = number[v];
      }
    }
    vertices_ = std::move(used);
  }

  std::unordered_map<Key, int, Hash> known_;
  std::vector<Vector3d> vertices_;
  std::vector<std::array<int, 3>> triangles_;
  std::size_t count_ = 0;
};

void check_count(std::size_t count, int line) {
  if (count > kMostTriangles) {
    throw MeshFault{
        line, line > 0 ? 1 : 0,
        line > 0 ? fmt::format("the mesh has more than {} triangles; simplify it", kMostTriangles)
                 : fmt::format("the mesh has {} triangles, at most {} are read; simplify it", count, kMostTriangles)};
  }
}

// --- Texts ---

struct Word {
  std::string_view text;
  int column;  // 1-based [characters]
};

// A text line by line, its words, and where it is.
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {}

  // The next line that has words, without what stands behind '#'.
  bool next() {
    while (at_ < text_.size()) {
      const std::size_t end = std::min(text_.find('\n', at_), text_.size());
      line_ = text_.substr(at_, end - at_);
      at_ = end + 1;
      ++number_;
      line_ = line_.substr(0, std::min(line_.find('#'), line_.size()));
      split();
      if (!words_.empty()) return true;
    }
    return false;
  }
  const std::vector<Word>& words() const { return words_; }
  int number() const { return number_; }

  [[noreturn]] void fail(std::size_t word, const std::string& message) const {
    const std::size_t column = word < words_.size() ? words_[word].column : 1;
    throw MeshFault{number_, static_cast<int>(column), message};
  }

  double coordinate(std::size_t word) const {
    std::string_view text = words_[word].text;
    if (text.starts_with('+')) text.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    // What is too small for a double is zero; what is too large is reported below.
    if (error == std::errc::result_out_of_range && end == text.data() + text.size()) {
      value = text.find("e-") != text.npos || text.find("E-") != text.npos ? 0 : HUGE_VAL;
    } else if (error != std::errc() || end != text.data() + text.size()) {
      fail(word, fmt::format("a coordinate must be a number, not {}", in_quotes(words_[word].text)));
    }
    if (!(std::abs(value) < kLargestCoordinate)) {
      fail(word, fmt::format("a coordinate is {}, must be a finite number below {:.0e}", in_quotes(words_[word].text),
                             kLargestCoordinate));
    }
    return value;
  }
  Vector3d place(std::size_t first) const { return {coordinate(first), coordinate(first + 1), coordinate(first + 2)}; }

 private:
  void split() {
    words_.clear();
    int column = 1;
    for (std::size_t i = 0; i < line_.size();) {
      if (is_blank(line_[i])) {
        ++i, ++column;
        continue;
      }
      const std::size_t begin = i;
      const int here = column;
      for (; i < line_.size() && !is_blank(line_[i]); ++i)
        column += (static_cast<unsigned char>(line_[i]) & 0xc0) != 0x80;
      words_.push_back({line_.substr(begin, i - begin), here});
    }
  }
  static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

  std::string_view text_, line_;
  std::size_t at_ = 0;
  int number_ = 0;
  std::vector<Word> words_;
};

// --- STL ---

constexpr std::size_t kStlHeader = 84, kStlFacet = 50;

std::uint32_t little_endian(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (int k = 3; k >= 0; --k) value = value << 8 | static_cast<unsigned char>(bytes[at + static_cast<std::size_t>(k)]);
  return value;
}

void read_binary_stl(std::string_view bytes, MeshCollector& mesh) {
  if (bytes.size() < kStlHeader) {
    throw MeshFault{0, 0,
                    fmt::format("not an STL file: {} are too few for a binary one, and it is no text that begins "
                                "with 'solid'",
                                counted(bytes.size(), "byte"))};
  }
  const std::size_t count = little_endian(bytes, 80);
  if (bytes.size() != kStlHeader + kStlFacet * count) {
    throw MeshFault{0, 0,
                    fmt::format("a binary STL file of {} triangles has {} bytes, this one {}: it is cut off or "
                                "no STL file",
                                count, kStlHeader + kStlFacet * count, bytes.size())};
  }
  check_count(count, 0);
  for (std::size_t f = 0; f < count; ++f) {
    std::array<int, 3> v{};
    for (std::size_t k = 0; k < 3; ++k) {
      Vector3d p;
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t at = kStlHeader + kStlFacet * f + 12 * (k + 1) + 4 * c;
        p[static_cast<int>(c)] = std::bit_cast<float>(little_endian(bytes, at));
        if (!(std::abs(p[static_cast<int>(c)]) < kLargestCoordinate)) {
          throw MeshFault{0, 0,
                          fmt::format("triangle {}: a coordinate is {}, must be a finite number below {:.0e}", f + 1,
                                      p[static_cast<int>(c)], kLargestCoordinate)};
        }
      }
      v[k] = mesh.vertex(p);
    }
    mesh.triangle(v[0], v[1], v[2]);
  }
}

// facet, outer loop, three times vertex, endloop, endfacet: normals are not read, and neither are names.
void read_text_stl(std::string_view bytes, MeshCollector& mesh) {
  static constexpr const char* kExpected[] = {"facet", "outer", "vertex", "vertex", "vertex", "endloop", "endfacet"};
  Lines lines(bytes);
  std::array<int, 3> v{};
  std::size_t step = 0;  // in kExpected
  bool inside = false;   // between solid and endsolid
  while (lines.next()) {
    const std::string word = lower_case(lines.words()[0].text);
    if (!inside) {
      if (word != "solid") lines.fail(0, fmt::format("expected 'solid', not {}", in_quotes(lines.words()[0].text)));
      inside = true;
    } else if (step == 0 && word == "endsolid") {
      inside = false;
    } else if (word != kExpected[step]) {
      lines.fail(0, fmt::format("expected '{}', not {}", kExpected[step], in_quotes(lines.words()[0].text)));
    } else {
      if (word == "vertex") {
        if (lines.words().size() != 4) lines.fail(0, "a vertex must have 3 coordinates");
        v[step - 2] = mesh.vertex(lines.place(1));
      }
      step = (step + 1) % std::size(kExpected);
      if (step == 0) mesh.triangle(v[0], v[1], v[2]);
      check_count(mesh.count(), lines.number());
    }
  }
  if (inside) throw MeshFault{lines.number(), 1, "the file ends without 'endsolid': it is cut off"};
}

// Binary files may begin with "solid" too, but their size is what their count asks for.
bool is_text_stl(std::string_view bytes) {
  if (bytes.size() >= kStlHeader && bytes.size() == kStlHeader + kStlFacet * std::size_t{little_endian(bytes, 80)}) {
    return false;
  }
  const std::size_t first = std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size());
  return lower_case(bytes.substr(first, 5)) == "solid" && bytes.substr(0, 512).find('\0') == bytes.npos;
}

// --- OBJ ---

class ObjReader {
 public:
  ObjReader(std::string_view bytes, MeshCollector& mesh) : lines_(bytes), mesh_(mesh) {}

  void read() {
    while (lines_.next()) {
      const std::string_view word = lines_.words()[0].text;
      if (word == "v") {
        // A fourth number is a weight, six are a place and a colour.
        if (lines_.words().size() < 4) lines_.fail(0, "a vertex must have 3 coordinates");
        places_.push_back(lines_.place(1));
      } else if (word == "f") {
        read_face();
      }
    }
    for (const Corner& corner : corners_) numbers_.push_back(number_of(corner));
    for (std::size_t f = 0, at = 0; f < faces_.size(); at += faces_[f++]) {
      for (std::size_t k = 2; k < faces_[f]; ++k) {
        mesh_.triangle(numbers_[at], numbers_[at + k - 1], numbers_[at + k]);
      }
    }
  }

 private:
  // A vertex that a face names; it may come later in the file.
  struct Corner {
    long long index;  // from 0
    int line, column;
  };

  void read_face() {
    const std::vector<Word>& words = lines_.words();
    if (words.size() < 4) lines_.fail(0, "a face must have at least 3 vertices");
    triangles_ += words.size() - 3;
    check_count(triangles_, lines_.number());
    for (std::size_t i = 1; i < words.size(); ++i) {
      const std::string_view text = words[i].text.substr(0, std::min(words[i].text.find('/'), words[i].text.size()));
      long long index = 0;
      const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), index);
      if (error != std::errc() || end != text.data() + text.size() || index == 0) {
        lines_.fail(i, fmt::format("a face must name vertices by whole numbers from 1, or below 0 from the last one "
                                   "back, not {}",
                                   in_quotes(words[i].text)));
      }
      const auto count = static_cast<long long>(places_.size());
      if (index < -count) {
        lines_.fail(i, fmt::format("there is no vertex {}: {} are before this line", index, places_.size()));
      }
      corners_.push_back({index > 0 ? index - 1 : count + index, lines_.number(), words[i].column});
    }
    faces_.push_back(words.size() - 1);
  }

  int number_of(const Corner& corner) {
    if (corner.index >= static_cast<long long>(places_.size())) {
      throw MeshFault{corner.line, corner.column,
                      fmt::format("there is no vertex {}: the file has {}", corner.index + 1, places_.size())};
    }
    return mesh_.vertex(places_[static_cast<std::size_t>(corner.index)]);
  }

  Lines lines_;
  MeshCollector& mesh_;
  std::vector<Vector3d> places_;
  std::vector<Corner> corners_;     // of all faces in turn
  std::vector<std::size_t> faces_;  // how many corners
  std::vector<int> numbers_;        // of corners, in the mesh
  std::size_t triangles_ = 0;
};

}  // namespace

bool is_mesh_file(const std::filesystem::path& path) {
  const std::string ending = lower_case(path.extension().string());
  return ending == ".stl" || ending == ".obj";
}

std::shared_ptr<const TriangleMesh> read_mesh(std::string_view bytes, const std::filesystem::path& path,
                                              FaultList& faults) {
  try {
    MeshCollector mesh;
    if (lower_case(path.extension().string()) == ".obj")
      ObjReader(bytes, mesh).read();
    else if (is_text_stl(bytes))
      read_text_stl(bytes, mesh);
    else
      read_binary_stl(bytes, mesh);
    return mesh.finish(path.filename().string());
  } catch (const MeshFault& fault) {
    faults.add(Fault{path.string(), fault.line, fault.column, fault.message});
    return nullptr;
  }
}

// --- The files that a tree names ---

namespace {

void add_file_of_shape(Node& shape, std::vector<Node*>& files) {
  if (text_at(shape, "shape") != "mesh") return;
  Node* file = shape.find("file");
  if (file && is_text(*file) && !file->text.empty()) files.push_back(file);
}

void add_files_of(Node& body, std::vector<Node*>& files) {
  Node* geometry = body.find("geometry");
  if (!geometry) return;
  add_file_of_shape(*geometry, files);
  for (Node& shape : geometry->items) add_file_of_shape(shape, files);
}

void add_files_of_list(Node& tree, const char* key, std::vector<Node*>& files) {
  Node* list = tree.find(key);
  if (!list || !list->is_sequence()) return;
  for (Node& body : list->items) add_files_of(body, files);
}

std::shared_ptr<const ScenarioFiles::File> mesh_file(const std::filesystem::path& path, const Node& named,
                                                     ScenarioFiles& files, FaultList& faults) {
  if (auto kept = files.find(path); kept && kept->mesh) return kept;
  if (!is_mesh_file(path)) {
    faults.add(named.mark, fmt::format("mesh file {} must end in .stl or .obj", in_quotes(named.text)));
    return nullptr;
  }
  const auto bytes = read_file(path, named.mark, faults, kLargestMesh, named.text);
  if (!bytes) return nullptr;
  auto mesh = read_mesh(*bytes, path, faults);
  if (!mesh) return nullptr;
  // Its digest instead of its bytes: a study hashes its inputs once per point.
  const ScenarioFiles::File file{sha256(*bytes) + "\n", {}, {}, std::move(mesh)};
  files.keep(path, file);
  return std::make_shared<const ScenarioFiles::File>(file);
}

}  // namespace

std::vector<Node*> mesh_file_nodes(Node& tree) {
  std::vector<Node*> files;
  for (Node* robot : {&tree, tree.find("robot")}) {
    if (!robot) continue;
    if (Node* base = robot->find("base")) add_files_of(*base, files);
    add_files_of_list(*robot, "links", files);
  }
  add_files_of_list(tree, "targets", files);
  return files;
}

Meshes read_mesh_files(Node& tree, const std::filesystem::path& beside, ScenarioFiles& files, std::string& hashed,
                       FaultList& faults) {
  Meshes meshes;
  for (const Node* named : mesh_file_nodes(tree)) {
    if (faults.full()) break;
    if (!meshes.emplace(named->text, nullptr).second) continue;
    const auto file = mesh_file(path_beside(beside, named->text), *named, files, faults);
    if (!file) continue;
    hashed += file->bytes;
    meshes[named->text] = file->mesh;
  }
  return meshes;
}

}  // namespace grapnel
