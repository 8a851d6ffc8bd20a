#include "grapnel/import/mjcf_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "grapnel/text/message_text.hpp"
#include "grapnel/text/text_file.hpp"

namespace grapnel {
namespace {

// Limits above any realistic file, against files that are slow to read or exhaust the stack.
constexpr int kDeepest = 200;
constexpr std::size_t kMostElements = 200000;
constexpr std::size_t kMostFiles = 200;

constexpr std::array kActuators{"general", "motor",    "position", "velocity", "intvelocity", "damper",
                                "muscle",  "cylinder", "adhesion", "plugin",   "dcmotor"};

// Container elements have no defaults; all other elements inherit from <default>.
constexpr std::array kInheriting{"mesh",   "material", "joint", "geom",     "site",
                                 "camera", "light",    "pair",  "equality", "tendon"};

std::filesystem::path canonical_or_same(const std::filesystem::path& path) {
  std::error_code error;
  const std::filesystem::path canonical = std::filesystem::canonical(path, error);
  return error ? path : canonical;
}

}  // namespace

// ---- Files ----

MjcfFiles::MjcfFiles(const std::filesystem::path& path, std::string text, FaultList& faults)
    : faults_(faults), folder_(path.parent_path()) {
  const XmlFile* file = &parse(path, std::move(text));
  const pugi::xml_node root = file->root();
  if (!root) return;
  const std::string tag = root.name();
  if (tag == "robot") {
    faults.add(file->mark(root), "this is a URDF file: its outermost element is <robot>, expected <mujoco>");
    return;
  }
  if (tag != "mujoco") {
    faults.add(file->mark(root),
               fmt::format("the outermost element is <{}>, expected <mujoco>", shortened(printable_line(tag))));
    return;
  }
  root_ = MjcfElement{file, root, {}};
  add_children(*file, root, 0, root_->children);
  if (with_text_ == 0) return;
  const std::string others = with_text_ > 1 ? " and " + counted(with_text_ - 1, "other element") : "";
  decisions_.push_back({first_with_text_.mark(),
                        fmt::format("text in <{}>{} is ignored, as by MuJoCo", first_with_text_.tag(), others)});
}

const XmlFile& MjcfFiles::parse(const std::filesystem::path& path, std::string text) {
  loaded_.insert(canonical_or_same(path));
  files_.push_back(std::make_unique<XmlFile>(path.string(), std::move(text), faults_));
  folders_[files_.back().get()] = path.parent_path();
  return *files_.back();
}

void MjcfFiles::add_children(const XmlFile& file, const pugi::xml_node& node, int depth,
                             std::vector<MjcfElement>& into) {
  bool has_text = false;
  for (const pugi::xml_node& child : node.children()) {
    if ((child.type() == pugi::node_pcdata || child.type() == pugi::node_cdata) && !std::exchange(has_text, true)) {
      if (with_text_++ == 0) first_with_text_ = {&file, node, {}};
    }
    if (child.type() != pugi::node_element) continue;
    if (depth >= kDeepest) {
      faults_.add(file.mark(child), fmt::format("elements are nested deeper than {} levels", kDeepest));
      return;
    }
    if (elements_ >= kMostElements) {
      if (elements_++ == kMostElements)
        faults_.add(file.mark(child), fmt::format("the model has more than {} elements", kMostElements));
      return;
    }
    ++elements_;
    if (std::string_view(child.name()) == "include") {
      include(file, child, depth, into);
      continue;
    }
    into.push_back({&file, child, {}});
    add_children(file, child, depth + 1, into.back().children);
  }
}

void MjcfFiles::include(const XmlFile& file, const pugi::xml_node& node, int depth, std::vector<MjcfElement>& into) {
  const std::filesystem::path named = file.required_text(node, "file", faults_);
  if (named.empty()) return;
  const Mark mark = file.mark(node, "file");
  std::filesystem::path path = folder_ / named;
  std::error_code error;
  const std::filesystem::path beside = folders_[&file] / named;
  if (!std::filesystem::exists(path, error) && std::filesystem::exists(beside, error)) {
    decisions_.push_back({mark, fmt::format("include {}: read from the folder of the including file, because the "
                                            "folder of the model's file, which MuJoCo searches, does not contain it",
                                            in_quotes(named.string()))});
    path = beside;
  }
  if (loaded_.contains(canonical_or_same(path))) {
    faults_.add(mark, fmt::format("{} has been included before or includes itself; MJCF includes a file once",
                                  in_quotes(named.string())));
    return;
  }
  if (files_.size() >= kMostFiles) {
    faults_.add(mark, fmt::format("the model has more than {} files", kMostFiles));
    return;
  }
  auto bytes = read_file(path, mark, faults_, kLargestFile, named);
  if (!bytes) return;
  included_bytes_ += *bytes;
  const XmlFile& included = parse(path, std::move(*bytes));
  if (included.root()) add_children(included, included.root(), depth + 1, into);
}

// ---- Attributes ----

const MjcfElement* MjcfAttributes::giver(const char* attribute) const {
  const auto found =
      std::find_if(layers.rbegin(), layers.rend(), [&](const MjcfElement* layer) { return layer->has(attribute); });
  return found == layers.rend() ? nullptr : *found;
}

Mark MjcfAttributes::mark(const char* attribute) const {
  const MjcfElement* from = giver(attribute);
  return from != nullptr ? from->mark(attribute) : element().mark();
}

std::string MjcfAttributes::text(const char* attribute, const char* otherwise) const {
  const MjcfElement* from = giver(attribute);
  return from != nullptr ? from->text(attribute) : otherwise;
}

std::optional<double> MjcfAttributes::number(const char* attribute, FaultList& faults) const {
  const MjcfElement* from = giver(attribute);
  return from != nullptr ? from->file->number(from->node, attribute, faults) : std::nullopt;
}

std::optional<Vector3d> MjcfAttributes::vector(const char* attribute, FaultList& faults) const {
  const MjcfElement* from = giver(attribute);
  return from != nullptr ? from->file->vector(from->node, attribute, faults) : std::nullopt;
}

std::optional<std::vector<double>> MjcfAttributes::numbers(const char* attribute, std::size_t count,
                                                           FaultList& faults) const {
  const MjcfElement* from = giver(attribute);
  return from != nullptr ? from->file->numbers(from->node, attribute, count, faults) : std::nullopt;
}

std::vector<double> MjcfAttributes::overlaid(const char* attribute, std::vector<double> values,
                                             FaultList& faults) const {
  for (const MjcfElement* layer : layers) {
    if (!layer->has(attribute)) continue;
    const auto given = layer->file->numbers(layer->node, attribute, 0, faults);
    if (!given) continue;
    if (given->size() > values.size()) {
      faults.add(layer->mark(attribute), fmt::format("{} of <{}> has {} numbers, expected at most {}", attribute,
                                                     layer->tag(), given->size(), values.size()));
      continue;
    }
    std::copy(given->begin(), given->end(), values.begin());
  }
  return values;
}

std::string MjcfAttributes::word(const char* attribute, std::span<const char* const> words, FaultList& faults) const {
  const MjcfElement* from = giver(attribute);
  if (from == nullptr) return words[0];
  const std::string said = from->text(attribute);
  if (std::ranges::find(words, said) != words.end()) return said;
  faults.add(from->mark(attribute), fmt::format("{} of <{}> is {}{}", attribute, from->tag(), in_quotes(said),
                                                suggestion(said, {words.begin(), words.end()})));
  return words[0];
}

bool MjcfAttributes::flag(const char* attribute, bool otherwise, FaultList& faults) const {
  const std::array words{otherwise ? "true" : "false", otherwise ? "false" : "true"};
  return word(attribute, words, faults) == "true";
}

// ---- Default classes ----

std::string mjcf_kind(const std::string& tag) {
  return std::ranges::find(kActuators, tag) != kActuators.end() ? "actuator" : tag;
}

void MjcfDefaults::read(const MjcfElement& section, FaultList& faults) {
  if (section.has("class")) {
    classes_.erase(main_name_);
    main_name_ = section.text("class");
  }
  read_class(section, main_, faults);
  classes_[main_name_] = main_;
}

void MjcfDefaults::read_class(const MjcfElement& section, Layers& layers, FaultList& faults) {
  // A class starts as a copy of its parent after all elements of the parent have been read.
  for (const MjcfElement& child : section.children) {
    const std::string kind = mjcf_kind(child.tag());
    if (child.tag() == "default") continue;
    if (kind == "actuator" || std::ranges::find(kInheriting, kind) != kInheriting.end()) {
      layers[kind].push_back(&child);
    } else {
      faults.add(child.mark(), fmt::format("<{}> is not allowed in <default>{}", child.tag(),
                                           suggestion(child.tag(), {kInheriting.begin(), kInheriting.end()})));
    }
  }
  for (const MjcfElement& child : section.children) {
    if (child.tag() != "default") continue;
    const std::string name = child.file->required_text(child.node, "class", faults);
    if (name.empty()) continue;
    if (classes_.contains(name) || name == main_name_) {
      faults.add(child.mark("class"), fmt::format("there are two default classes {}", in_quotes(name)));
      continue;
    }
    Layers own = layers;
    classes_[name] = {};
    read_class(child, own, faults);
    classes_[name] = std::move(own);
  }
}

MjcfAttributes MjcfDefaults::attributes(const MjcfElement& element, const std::string& kind,
                                        const std::string& childclass, FaultList& faults) const {
  check_class(element, "class", faults);
  const std::string name = element.has("class") ? element.text("class") : childclass;
  MjcfAttributes result;
  const auto of_class = classes_.find(name);
  const Layers& layers = of_class != classes_.end() ? of_class->second : main_;
  if (const auto found = layers.find(kind); found != layers.end()) result.layers = found->second;
  result.layers.push_back(&element);
  return result;
}

void MjcfDefaults::check_class(const MjcfElement& element, const char* attribute, FaultList& faults) const {
  if (!element.has(attribute)) return;
  const std::string name = element.text(attribute);
  if (name == main_name_ || classes_.contains(name)) return;
  std::vector<std::string> names{main_name_};
  for (const auto& [known, layers] : classes_) names.push_back(known);
  faults.add(element.mark(attribute), fmt::format("there is no default class {}{}", in_quotes(name),
                                                  suggestion(name, names, "default classes")));
}

}  // namespace grapnel
