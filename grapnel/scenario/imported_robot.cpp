#include "grapnel/scenario/imported_robot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "grapnel/import/source_model.hpp"
#include "grapnel/import/xml_file.hpp"
#include "grapnel/scenario/mesh_files.hpp"
#include "grapnel/scenario/schema.hpp"
#include "grapnel/scenario/sections.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/text_file.hpp"
#include "grapnel/text/write_yaml.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {

// ---- Keys in files ----

namespace {

// Mappings of files for ImportOptions.
struct ImportKeys {};
struct ArmKeys {};
struct BusKeys {};

}  // namespace

template <>
struct Described<Mount> {
  using T = Mount;
  static constexpr auto fields = std::to_array<Field>({
      key<std::string>("link", "", "Link of the bus that carries the arm; absent: its base.").optional(),
      found<[](T& t) -> Vector3d& { return t.X_LM.p; }>("position", "m",
                                                        "Position of the arm's base frame in the link's frame."),
      quaternion_of<&T::X_LM>(),
      rpy_of<&T::X_LM>(),
  });
  static constexpr auto rules = std::to_array<Rule>({not_both("quaternion_wxyz, rpy")});
  static constexpr Type type = structure<T>("mount", "", fields, rules);
};

namespace {

constexpr Field base_key() {
  return key<std::string>("base", "", "Link that becomes the base; absent: the root.").optional();
}
constexpr Field packages_key() {
  return key<std::string>(
             "packages", "",
             "Folders of ROS packages, by name: package://NAME/... is below the folder; a path relative to this file. "
             "Absent: the import searches the folder of the model's file and the folders above it.")
      .as("names by name")
      .optional();
}
constexpr Field lock_key() {
  return key<double>("lock", "rad or m", "Locked joints, by name, with their values.").as("numbers by name").optional();
}
constexpr Field wheels_key() {
  return key<std::vector<std::string>>("wheels", "", "Joints of the base that become its reaction wheels.")
      .items(1, 100)
      .optional();
}
constexpr Field end_effectors_key() {
  return key<std::vector<std::string>>("end_effectors", "",
                                       "Links or frames that become end-effectors; absent: the outermost ones.")
      .items(1, 0)
      .optional();
}
constexpr Field repair_key() {
  return key<bool>("repair_inertia", "",
                   "Replace a physically impossible inertia by the nearest possible tensor; absent: false, such an "
                   "inertia is an error.")
      .optional();
}
constexpr Field prefix_key() {
  return key<std::string>("prefix", "", "Prefix of all names of the arm on the bus.").optional();
}
constexpr Field mount_key() {
  return key<Mount>("mount", "", "Pose of the arm's base on the bus; absent: at the origin of the bus's base.")
      .as("mount")
      .optional();
}

}  // namespace

template <>
struct Described<ImportKeys> {
  static constexpr auto fields = std::to_array<Field>({
      base_key(),
      packages_key(),
      lock_key(),
      wheels_key(),
      end_effectors_key(),
      repair_key(),
      key<std::string>("bus", "",
                       "Satellite on which the robot is mounted as an arm: a robot file, its path relative to this "
                       "file, or the name of a ready-made robot.")
          .optional(),
      mount_key(),
      prefix_key(),
  });
  static constexpr auto rules =
      std::to_array<Rule>({needs("mount", "bus"), needs("prefix", "bus"), not_both("wheels, bus")});
  static constexpr Type type =
      structure<ImportKeys>("import", "How a robot in URDF or MJCF is converted to a robot of Grapnel.", fields, rules);
};

template <>
struct Described<ArmKeys> {
  static constexpr auto fields = std::to_array<Field>({
      key<std::string>("file", "",
                       "A model (.urdf, .xml) or a robot file, its path relative to this file, or the name of a "
                       "ready-made robot.")
          .required(),
      mount_key(),
      prefix_key(),
      base_key(),
      packages_key(),
      lock_key(),
      end_effectors_key(),
      repair_key(),
  });
  static constexpr Type type = structure<ArmKeys>("imported_arm", "", fields);
};

template <>
struct Described<BusKeys> {
  static constexpr auto fields = std::to_array<Field>({
      key<std::string>(
          "bus", "", "The satellite: a robot file, its path relative to this file, or the name of a ready-made robot.")
          .required(),
      key<std::vector<ArmKeys>>("arms", "", "Arms mounted on the satellite, in this order.").items(1, 100).required(),
  });
  static constexpr Type type = structure<BusKeys>("robot_on_bus", "Several arms from files on one satellite.", fields);
};

namespace {
// Separate from the description of scenarios, so that Described<ImportKeys> is visible only here.
const nlohmann::ordered_json& bus_schema() {
  static const nlohmann::ordered_json kSchema = schema_of(type_of<BusKeys>(), "Grapnel robot on a bus");
  return kSchema;
}
const nlohmann::ordered_json& import_schema() {
  static const nlohmann::ordered_json kSchema = schema_of(type_of<ImportKeys>(), "Grapnel import");
  return kSchema;
}
}  // namespace

const Type& import_description() { return type_of<ImportKeys>(); }
const Type& robot_on_bus_description() { return type_of<BusKeys>(); }

// ---- Reading ----

namespace {

namespace fs = std::filesystem;

std::string lower_case_path(std::string_view path) {
  std::string lower(path);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

// Key of the import of a scenario's robot: everything it depends on except files.
std::string import_key(const Node& scenario, const fs::path& path) {
  return fmt::format("import for {}: {} {}", path.parent_path().string(), flow_text(part(scenario, "robot")),
                     flow_text(part(scenario, "import")));
}

class Importer {
 public:
  /// Paths are relative to `beside`; meshes are named relative to `place`.
  Importer(fs::path beside, fs::path place, ScenarioFiles& files, FaultList& faults)
      : beside_(std::move(beside)), place_(std::move(place)), files_(files), faults_(faults) {}

  std::shared_ptr<const ImportedFile> finish(std::optional<Node> tree) {
    if (!tree) return nullptr;
    result_.tree = std::move(*tree);
    return std::make_shared<const ImportedFile>(std::move(result_));
  }

  /// A model with the options of `import`, on a bus if they name one.
  std::optional<Node> single(const fs::path& model, const Node& named, const Node& settings) {
    const Node* bus_name = settings.find("bus");
    std::optional<Node> robot = read_model(model, named, settings, bus_name != nullptr);
    if (!bus_name) return robot;
    std::optional<Node> bus = read_bus(*bus_name);
    if (!robot || !bus) return {};
    const std::size_t before = faults_.size();
    put_on(*bus, std::move(*robot), settings, "mount");
    return faults_.size() > before ? std::nullopt : bus;
  }

  /// A bus with its arms.
  std::optional<Node> on_bus(const Node& robot) {
    std::optional<Node> bus = read_bus(part(robot, "bus"));
    const std::size_t before = faults_.size();
    for (std::size_t i = 0; i < part(robot, "arms").items.size() && !faults_.full(); ++i) {
      const Node& arm = part(robot, "arms").items[i];
      std::optional<Node> tree = read_arm(arm);
      if (tree && bus) put_on(*bus, std::move(*tree), arm, fmt::format("mount-{}", i + 1));
    }
    return faults_.size() > before ? std::nullopt : bus;
  }

 private:
  void put_on(Node& bus, Node robot, const Node& settings, const std::string& joint) {
    const std::string prefix = text_at(settings, "prefix");
    prefix_names(robot, prefix);
    const Names there = names_of(bus), further = names_of(robot);
    // Names that exist on the bus already, by kind.
    for (const auto& [kind, name] : further) {
      if (!there.contains({kind, name})) continue;
      faults_.add(settings.mark, fmt::format("{} {} exists on the bus; give the arm a prefix (prefix: left-; "
                                             "--prefix left-)",
                                             kind, in_quotes(name)));
      return;
    }
    std::string name = prefix + joint;
    for (int i = 2; there.contains({"joint", name}) || further.contains({"joint", name}); ++i)
      name = fmt::format("{}{}-{}", prefix, joint, i);
    mount_robot(bus, std::move(robot), mount_of(settings), name, faults_);
  }

  using Names = std::set<std::pair<std::string, std::string>>;  // kinds and names

  // The names of a robot: a base without mass is not a body. Missing names are reported elsewhere.
  static Names names_of(const Node& tree) {
    Names names;
    const auto add = [&](const char* kind, std::string name) {
      if (!name.empty()) names.emplace(kind, std::move(name));
    };
    const Node& base = part(tree, "base");
    if (base.find("mass")) add("link", base.find("name") ? text_at(base, "name") : "base");
    for (const Node& link : part(tree, "links").items) {
      add("link", text_at(link, "name"));
      add("joint", text_at(part(link, "joint"), "name"));
    }
    for (const Node& frame : part(tree, "end_effectors").items) add("end-effector", text_at(frame, "name"));
    return names;
  }

  Mount mount_of(const Node& settings) {
    Mount mount;
    mount.mark = settings.mark;
    const Node* node = settings.find("mount");
    if (!node) return mount;
    mount.mark = node->mark;
    mount.link = text_at(*node, "link");
    const Meshes none;
    read_members(*node, type_of<Mount>(), "mount", &mount, {faults_, none});
    return mount;
  }

  ImportOptions options_of(const Node& settings) const {
    ImportOptions options;
    options.base = {text_at(settings, "base"), part(settings, "base").mark};
    using WrittenAs = LockedJoint::WrittenAs;
    for (const auto& [joint, mark, value] : part(settings, "lock").entries) {
      const WrittenAs form = value.unit == 1   ? WrittenAs::angle
                             : value.unit == 2 ? WrittenAs::length
                                               : WrittenAs::number;
      options.locked.push_back({joint, number_of(value).value_or(0), mark, form});
    }
    for (const NodeEntry& entry : part(settings, "packages").entries)
      options.packages.push_back({entry.key, path_beside(beside_, entry.value.text)});
    for (const Node& item : part(settings, "end_effectors").items)
      options.end_effectors.push_back({item.text, item.mark});
    for (const Node& item : part(settings, "wheels").items) options.wheels.push_back({item.text, item.mark});
    options.repair_inertia = boolean_at(settings, "repair_inertia");
    return options;
  }

  // The tree of a model; `named` is the place that names it.
  std::optional<Node> read_model(const fs::path& path, const Node& named, const Node& settings, bool is_carried) {
    const auto model = source_model(path, named);
    if (!model) return {};
    ImportOptions options = options_of(settings);
    options.is_carried = is_carried;
    options.source = path;
    options.place = place_;
    options.mesh_fault = [&](const fs::path& mesh) {
      std::string unused, why_not;
      mesh_at(mesh, unused, why_not);
      return why_not;
    };
    auto robot = assemble_robot(*model, options, faults_);
    if (!robot) return {};
    result_.decisions.insert(result_.decisions.end(), robot->decisions.begin(), robot->decisions.end());
    result_.comment += (result_.comment.empty() || robot->comment.empty() ? "" : "\n") + robot->comment;
    return std::move(robot->tree);
  }

  std::shared_ptr<const SourceModel> source_model(const fs::path& path, const Node& named) {
    std::shared_ptr<const ScenarioFiles::File> file = files_.find(path);
    if (!file || !file->model) {
      const auto bytes = read_file(path, named.mark, faults_, kLargestFile, named.text);
      if (!bytes) return nullptr;
      const std::size_t before = faults_.size();
      std::string note;
      const auto text = xml_in_utf8(path.string(), *bytes, note, faults_);
      if (!text) return nullptr;
      SourceModel model = read_source(path, *text);
      if (faults_.size() > before) return nullptr;
      if (!note.empty())
        model.decisions.insert(model.decisions.begin(),
                               ImportDecision{{std::make_shared<const std::string>(path.string()), 1, 1}, note});
      ScenarioFiles::File kept{*text, {}, {}};
      kept.model = std::make_shared<const SourceModel>(std::move(model));
      files_.keep(path, kept);
      file = std::make_shared<const ScenarioFiles::File>(std::move(kept));
    }
    result_.bytes += file->bytes + file->model->further_bytes;
    result_.texts.emplace_back("robot", file->bytes);
    return file->model;
  }

  SourceModel read_source(const fs::path& path, const std::string& bytes) {
    const XmlFile file(path.string(), bytes, faults_, XmlFile::Numbers::arithmetic);
    if (std::string_view(file.root().name()) != "mujoco") return read_urdf(file, faults_);
    std::string meshes;
    SourceModel model = read_mjcf(path, bytes, faults_, [&](const fs::path& mesh, std::string& why_not) {
      return mesh_at(fs::absolute(mesh).lexically_normal(), meshes, why_not);
    });
    model.further_bytes += meshes;
    return model;
  }

  // The mesh in a file; null, with the error of the mesh reader, if there is none. It is read with the same options as
  // the robot's meshes, so that it is read once. The digest of its bytes is added to `hashed`.
  std::shared_ptr<const TriangleMesh> mesh_at(const fs::path& path, std::string& hashed, std::string& why_not) {
    const fs::path named = fs::proximate(path, fs::absolute(place_).parent_path());
    Node shape = mapping_node(), body = mapping_node(), tree = mapping_node();
    put(shape, "shape", text_node("mesh"));
    put(shape, "file", text_node(named.generic_string()));
    put(body, "geometry", std::move(shape));
    put(tree, "base", std::move(body));
    FaultList faults;
    const Meshes meshes = read_mesh_files(tree, place_, files_, hashed, faults);
    if (!faults.empty()) why_not = faults.all().front().message;
    for (const Fault& warning : faults.warnings())
      result_.decisions.push_back({{std::make_shared<const std::string>(warning.file), 0, 0}, warning.message});
    return faults.empty() && !meshes.empty() ? meshes.begin()->second : nullptr;
  }

  std::optional<Node> read_arm(const Node& arm) {
    const Node& named = part(arm, "file");
    if (!is_text(named)) return {};
    if (is_model_file(named.text)) return read_model(path_beside(beside_, named.text), named, arm, true);
    for (const char* key : {"base", "packages", "lock", "end_effectors", "repair_inertia"}) {
      if (const NodeEntry* entry = arm.entry(key))
        faults_.add(entry->mark, fmt::format("{} applies only to imported models (.urdf, .xml), not to a robot file",
                                             in_quotes(key)));
    }
    std::optional<Node> tree = read_yaml(named, "robot");
    if (!tree || !check_arm(*tree)) return {};
    return tree;
  }

  // Computations use plain numbers, so units are converted before. A base without mass, valid only for a mounted arm,
  // gets a temporary mass.
  bool check_arm(Node& tree) {
    Node* base = tree.find("base");
    const bool only_carries = base && base->is_mapping() && !base->find("mass") && !base->find("inertia");
    if (only_carries) {
      put(*base, "mass", number_node(1));
      put(*base, "inertia", list_node(std::vector<double>{1, 1, 1}));
    }
    FaultList found;  // its warnings are repeated by the check of the whole robot
    check_structure(tree, robot_schema_document(), "the arm", found);
    for (const Fault& fault : found.all()) faults_.add(fault);
    if (only_carries)
      std::erase_if(tree.find("base")->entries,
                    [](const NodeEntry& entry) { return entry.key == "mass" || entry.key == "inertia"; });
    return found.empty();
  }

  std::optional<Node> read_bus(const Node& named) {
    if (!is_text(named)) return {};
    if (is_model_file(named.text)) {
      faults_.add(named.mark, fmt::format("a bus must be a robot file or a ready-made robot, but {} is a model: "
                                          "convert it to a robot file, grapnel import {} -o bus.yaml",
                                          in_quotes(named.text), shell_word(named.text)));
      return {};
    }
    return read_yaml(named, "bus");
  }

  // The tree of a robot file or a ready-made robot, with mesh paths relative to `place`.
  std::optional<Node> read_yaml(const Node& named, const char* what) {
    std::string bytes;
    std::optional<Node> tree = read_robot_tree(beside_, named, bytes, files_, faults_);
    if (!tree) return {};
    for (Node* mesh : mesh_file_nodes(*tree)) {
      const fs::path file = fs::absolute(path_beside(robot_path(beside_, named.text), mesh->text));
      mesh->text = fs::proximate(file, fs::absolute(place_).parent_path()).generic_string();
    }
    result_.bytes += bytes;
    result_.texts.emplace_back(what, bytes);
    return tree;
  }

  fs::path beside_, place_;
  ScenarioFiles& files_;
  FaultList& faults_;
  ImportedFile result_;
};

// The options; empty if they have errors, which the check of the scenario reports.
std::optional<Node> sound_settings(Node settings) {
  FaultList faults;
  if (settings.kind != Node::Kind::null) check_structure(settings, import_schema(), "import", faults, "import");
  if (!faults.empty()) return {};
  return settings;
}

}  // namespace

bool is_model_file(std::string_view path) {
  const std::string lower = lower_case_path(path);
  return lower.ends_with(".urdf") || lower.ends_with(".xacro") || lower.ends_with(".xml");
}

bool is_put_together(const Node& robot) { return robot.is_mapping() && (robot.find("bus") || robot.find("arms")); }

bool needs_import(const Node& robot) {
  return is_put_together(robot) || (is_text(robot) && robot.is_scalar() && is_model_file(robot.text));
}

void check_put_together(Node& robot, FaultList& faults) {
  check_structure(robot, bus_schema(), "robot", faults, "robot");
}

void take_units(Node& scenario) {
  FaultList reported_before;
  // The parts of an assembled robot are not a robot: a path temporarily replaces them.
  Node* robot = scenario.find("robot");
  std::optional<Node> parts;
  if (robot && is_put_together(*robot)) {
    check_put_together(*robot, reported_before);
    parts = std::exchange(*robot, text_node("robot", robot->mark));
  }
  check_structure(scenario, scenario_schema_document(), "the scenario", reported_before);
  if (parts) *scenario.find("robot") = std::move(*parts);
}

bool is_import_choice(const Node& scenario, std::string_view path) {
  const auto is_below = [&](std::string_view place) {
    if (!path.starts_with(place)) return false;
    const std::string_view rest = path.substr(place.size());
    return rest.empty() || rest[0] == '.' || rest[0] == '[';
  };
  if (is_below("import")) return true;
  return (is_below("robot.bus") || is_below("robot.arms")) && is_put_together(part(scenario, "robot"));
}

std::vector<Change> import_first(const Node& scenario, std::span<const Change> changes) {
  std::vector<Change> ordered(changes.begin(), changes.end());
  std::stable_partition(ordered.begin(), ordered.end(),
                        [&](const Change& change) { return is_import_choice(scenario, change.path); });
  return ordered;
}

std::shared_ptr<const ImportedFile> import_model(const fs::path& model, const Node& settings, const fs::path& beside,
                                                 const fs::path& place, ScenarioFiles& files, FaultList& faults) {
  const Node named = text_node({}, {std::make_shared<const std::string>(model.string()), 0, 0});
  Node checked = settings;
  const std::size_t before = faults.size();
  if (settings.kind != Node::Kind::null) check_structure(checked, import_schema(), "import", faults, "import");
  if (faults.size() > before) return nullptr;
  Importer importer(beside, place, files, faults);
  return importer.finish(importer.single(model, named, checked));
}

std::shared_ptr<const ImportedFile> imported_robot(const Node& scenario, const fs::path& path,
                                                   const ScenarioFiles& files) {
  return files.find_imported(import_key(scenario, path));
}

std::shared_ptr<const ImportedFile> import_robot(const Node& scenario, const fs::path& path, ScenarioFiles& files,
                                                 FaultList& faults) {
  if (auto kept = imported_robot(scenario, path, files)) return kept;
  const Node& robot = part(scenario, "robot");
  Importer importer(path, path, files, faults);
  std::shared_ptr<const ImportedFile> imported;
  if (is_put_together(robot)) {
    Node checked = robot;
    const std::size_t before = faults.size();
    check_put_together(checked, faults);
    if (const NodeEntry* entry = scenario.entry("import"))
      faults.add(entry->mark, "'import' has no effect with robot.arms, where every arm has its own options");
    if (faults.size() == before) imported = importer.finish(importer.on_bus(checked));
  } else {
    const auto settings = sound_settings(part(scenario, "import"));
    if (!settings) return nullptr;
    imported = importer.finish(importer.single(path_beside(path, robot.text), robot, *settings));
  }
  if (!imported) return nullptr;
  files.keep_imported(import_key(scenario, path), imported);
  return imported;
}

}  // namespace grapnel
