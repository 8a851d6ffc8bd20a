#include "grapnel/scenario/scenario.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>

#include "grapnel/control/fmu_controller.hpp"
#include "grapnel/control/plugin_controller.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/file_seal.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/scenario/imported_robot.hpp"
#include "grapnel/scenario/mesh_files.hpp"
#include "grapnel/scenario/plausibility.hpp"
#include "grapnel/scenario/ready_made.hpp"
#include "grapnel/scenario/scenario_files.hpp"
#include "grapnel/scenario/schema.hpp"
#include "grapnel/scenario/sections.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/parse_yaml.hpp"
#include "grapnel/text/text_file.hpp"
#include "grapnel/text/yaml_tree.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

enum class FileKind { scenario, robot };

// One message instead of one per key of the other kind.
bool is_of_kind(const Node& tree, FileKind kind, FaultList& faults) {
  const Node* schema = tree.find("schema");
  if (!schema || !schema->is_scalar()) return true;
  const std::string is = schema->text.starts_with("grapnel-robot/")          ? "robot"
                         : schema->text.starts_with("grapnel-scenario/")     ? "scenario"
                         : schema->text.starts_with("grapnel-study/")        ? "study"
                         : schema->text.starts_with("grapnel-optimization/") ? "optimization"
                         : schema->text.starts_with("grapnel-campaign/")     ? "campaign"
                                                                             : "";
  const std::string wanted = kind == FileKind::scenario ? "scenario" : "robot";
  if (is.empty() || is == wanted) return true;
  faults.add(schema->mark,
             fmt::format("this is {} {} file where a {} is expected", is == "optimization" ? "an" : "a", is, wanted));
  return false;
}

// Whether a line of the text begins with a key of such a file, or the text has only blanks and comments.
bool may_be_of_kind(std::string_view text, const nlohmann::ordered_json& schema) {
  bool any = false;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string_view line = text.substr(at, end - at);
    at = end + 1;
    line.remove_prefix(std::min(line.find_first_not_of(" \t\r{\"'-"), line.size()));
    if (line.empty() || line[0] == '#') continue;
    any = true;
    for (const auto& [key, unused] : schema.at("properties").items()) {
      if (line.starts_with(key) && line.substr(key.size()).find(':') <= 2) return true;
    }
  }
  return !any;
}

// A file that another file names may be any readable file on this machine: files of another kind are rejected without
// showing their contents.
bool is_foreign(const std::string& text, FileKind kind, const std::shared_ptr<const std::string>& source,
                FaultList& faults) {
  const bool robot = kind == FileKind::robot;
  const auto& schema = robot ? robot_schema_document() : scenario_schema_document();
  if (may_be_of_kind(text, schema)) return false;
  std::vector<std::string> keys;
  for (const auto& [key, unused] : schema.at("properties").items()) keys.push_back(key);
  faults.add({source, 1, 1}, fmt::format("this is not a {} file: no line begins with one of its keys, such as {}",
                                         robot ? "robot" : "scenario", some_of(keys)));
  return true;
}

// A file to read.
struct FileToRead {
  std::filesystem::path path;
  FileKind kind;
  Mark blame;              // where a missing file is reported
  std::string named = {};  // as another file names it; empty: the user did
};

// A file's tree, with its bytes added to `hashed`. Empty after an error.
std::optional<Node> read_tree(const FileToRead& file, std::string& hashed, ScenarioFiles& files, FaultList& faults) {
  const auto& [path, kind, blame, named] = file;
  if (const auto stored = files.find(path)) {
    if (!is_of_kind(stored->tree, kind, faults)) return {};
    hashed += stored->bytes;
    return stored->tree;
  }
  const auto bytes = read_file(path, blame, faults, kLargestFile, named);
  if (!bytes) return {};
  hashed += *bytes;
  const auto source = std::make_shared<const std::string>(path.string());
  const auto text = checked_text(*bytes, source, faults);
  if (!text || (!named.empty() && is_foreign(*text, kind, source, faults))) return {};
  std::optional<Node> tree = parse_document(*text, source, faults);
  if (!tree) return {};
  if (tree->kind == Node::Kind::null) {
    faults.add({source, 1, 1}, "the file is empty");
    return {};
  }
  if (!is_of_kind(*tree, kind, faults)) return {};
  files.store(path, {*bytes, {}, *tree});
  return tree;
}

Node tree_of(const ReadyMade& one) {
  FaultList none;  // tests read all of them
  return *parse_document(std::string(one.text), std::make_shared<const std::string>(one.source()), none);
}

// The tree of a ready-made robot, with its bytes added to `hashed`. Empty after an error.
std::optional<Node> ready_made_robot(const Node& named, std::string& hashed, ScenarioFiles& files, FaultList& faults) {
  const ReadyMade* found = find_ready_made(ReadyMade::Kind::robots, named.text);
  if (!found) {
    faults.add(named.mark, no_ready_made(ReadyMade::Kind::robots, named.text) +
                               " (the name of a robot file needs its extension, such as robot.yaml)");
    return {};
  }
  hashed += found->text;
  if (const auto stored = files.find(found->source())) return stored->tree;
  Node tree = tree_of(*found);
  files.store(found->source(), {std::string(found->text), {}, tree});
  return tree;
}

// Scenario and robot as trees during reading.
class Loader {
 public:
  Loader(std::filesystem::path path, ScenarioFiles& files, FaultList faults = {})
      : path_(std::move(path)), files_(files), faults_(std::move(faults)) {}

  /// The problem; warnings about valid but implausible input go to `warnings`, unless it is null.
  CaptureProblem load(std::span<const Change> changes, std::vector<Fault>* warnings = nullptr) {
    const Mark blame{std::make_shared<const std::string>(path_.string()), 0, 0};
    FileBytes bytes;
    std::string& robot_bytes = bytes.robot;
    std::optional<Node> scenario = read_tree({path_, FileKind::scenario, blame}, bytes.scenario, files_, faults_);
    if (!scenario) faults_.throw_if_any();

    for (const Change& change : changes) bytes_of_overrides_ += override_text({change.path, change.text}) + "\n";
    std::set<std::string, std::less<>> targets;  // that are ready-made
    apply_changes(*scenario, import_first(*scenario, changes), targets, faults_, [&](const Change& change) {
      const bool inside_robot = (change.path.starts_with("robot.") || change.path.starts_with("robot[")) &&
                                !is_import_choice(*scenario, change.path);
      if (inside_robot) include_robot(*scenario, robot_bytes);
      if (inside_robot && robot_unreadable_) return false;
      set_inside_robot_ = set_inside_robot_ || inside_robot;
      if (change.path == "robot") forget_robot(robot_bytes);
      return true;
    });
    include_robot(*scenario, robot_bytes);
    include_targets(*scenario, targets, faults_);

    const auto trajectory = read_csv_file(part(*scenario, "approach").find("trajectory"), bytes.trajectory);
    const auto torques = read_csv_file(part(*scenario, "control").find("torques"), bytes.torques);
    const PluginFile plugin = read_plugin_file(*scenario, "plugin"), fmu = read_plugin_file(*scenario, "fmu");
    ReadRobot robot = check_robot(*scenario);
    const auto& schema = scenario_schema_document();
    check_structure(*scenario, schema, "the scenario", faults_);
    fill_defaults(*scenario, schema);
    const Meshes meshes = read_mesh_files(*scenario, path_, files_, bytes_of_meshes_, faults_);
    CaptureProblem problem = read_scenario(*scenario, std::move(robot), trajectory ? &*trajectory : nullptr,
                                           torques ? &*torques : nullptr, meshes, faults_);
    if (problem.control) {
      problem.control->file = plugin.file + fmu.file, problem.control->sha256 = plugin.sha256 + fmu.sha256;
      if (!fmu.file.empty()) open_fmu(*scenario, problem);
    }
    for (const Fault& fault : robot_faults_.all()) faults_.add(fault);
    faults_.throw_if_any();
    if (warnings) {
      for (const Fault& warning : robot_faults_.warnings()) faults_.warn(warning);
      try {
        doubt_start(problem, *scenario, faults_);
        doubt_contact_stiffness(problem, *scenario, faults_);
      } catch (const std::invalid_argument& error) {
        faults_.add(scenario->mark, error.what());
      }
      faults_.throw_if_any();
      *warnings = sorted_faults(faults_.warnings());
    }
    std::string target_bytes;
    for (const std::string& name : targets) target_bytes += find_ready_made(ReadyMade::Kind::targets, name)->text;
    problem.sha256 = sha256(bytes.scenario + bytes.robot + target_bytes + bytes.trajectory + bytes_of_meshes_ +
                            bytes.torques + plugin.sha256 + fmu.sha256 + bytes_of_overrides_);
    if (!imported_) robot_texts_.emplace_back("robot", robot_bytes);
    problem.source = source_texts(text_at(*scenario, "description"), bytes, targets, changes);
    return problem;
  }

 private:
  using RobotTexts = std::vector<std::pair<std::string, std::string>>;  // "robot" or "bus", and the text

  // Of the files as they were read.
  struct FileBytes {
    std::string scenario, robot, trajectory, torques;
  };

  std::shared_ptr<const SourceTexts> source_texts(std::string description, const FileBytes& bytes,
                                                  const std::set<std::string, std::less<>>& targets,
                                                  std::span<const Change> changes) const {
    SourceTexts texts;
    texts.description = std::move(description);
    texts.add("scenario", bytes.scenario);
    for (const auto& [part, text] : robot_texts_) {
      if (!text.empty()) texts.add(part, text);
    }
    for (const std::string& name : targets)
      texts.add("target " + name, std::string(find_ready_made(ReadyMade::Kind::targets, name)->text));
    if (!bytes.trajectory.empty()) texts.add("trajectory", bytes.trajectory);
    if (!bytes.torques.empty()) texts.add("torques", bytes.torques);
    for (const Change& change : changes) texts.settings.push_back(change.path + "=" + change.text);
    return std::make_shared<const SourceTexts>(std::move(texts));
  }

  // Another robot replaces the previous one.
  void forget_robot(std::string& robot_bytes) {
    included_ = robot_unreadable_ = imported_ = false;
    robot_bytes.clear();
    robot_texts_.clear();
  }

  // Replaces the robot's path, or its parts, by the content of a robot file.
  void include_robot(Node& scenario, std::string& robot_bytes) {
    Node* named = scenario.find("robot");
    if (!named || robot_unreadable_) return;
    if (!included_ && needs_import(*named)) return include_imported(scenario, *named, robot_bytes);
    if (const NodeEntry* entry = scenario.entry("import"); entry && !imported_ && !import_refused_) {
      faults_.add(entry->mark, "'import' is for a robot in URDF or MJCF (robot: arm.urdf), not for a robot file");
      import_refused_ = true;
    }
    if (!is_text(*named) || named->text.empty()) return;
    const std::size_t before = faults_.size();
    robot_path_ = robot_path(path_, named->text);
    auto tree = read_robot_tree(path_, *named, robot_bytes, files_, faults_);
    robot_unreadable_ = !tree;
    if (!tree) {
      if (faults_.size() == before) faults_.add(named->mark, "the robot file cannot be read");
      return;
    }
    *named = std::move(*tree);
    included_ = true;
  }

  // A robot from files in other formats, or put together from several.
  void include_imported(const Node& scenario, Node& place, std::string& robot_bytes) {
    const auto robot = import_robot(scenario, path_, files_, faults_);
    robot_path_ = path_;  // mesh paths are relative to its folder
    imported_ = true;
    robot_unreadable_ = !robot;
    if (!robot) {
      // Errors have been reported; a path temporarily replaces the robot.
      place.entries.clear();
      place.kind = Node::Kind::scalar, place.text = "robot", place.plain = true;
      return;
    }
    robot_bytes = robot->bytes;
    robot_texts_ = robot->texts;
    if (!robot->decisions.empty())
      robot_faults_.warn(place.mark, fmt::format("{} on importing the robot; grapnel import lists them",
                                                 counted(robot->decisions.size(), "decision")));
    place = robot->tree;
    included_ = true;
  }

  // Checks the robot separately and leaves a path in its place, so that its errors do not hide errors of the rest.
  ReadRobot check_robot(Node& scenario) {
    Node* place = scenario.find("robot");
    if (!place || robot_unreadable_ || !(place->is_mapping() || included_)) return unknown_robot();
    Node tree = std::move(*place);
    *place = Node{};
    place->kind = Node::Kind::scalar;
    place->mark = tree.mark;
    place->text = "robot";
    // Overrides name the robot's values with the prefix "robot.".
    const bool by_itself = included_ && !set_inside_robot_;
    const std::string prefix = by_itself ? "" : "robot";
    check_structure(tree, robot_schema_document(), by_itself ? "the robot" : "robot", robot_faults_, prefix);
    fill_defaults(tree, robot_schema_document());
    const Meshes meshes = read_mesh_files(tree, included_ ? robot_path_ : path_, files_, bytes_of_meshes_, faults_);
    return read_robot(tree, prefix, meshes, robot_faults_);
  }

  // The file of numbers that approach.trajectory or control.torques names, if it exists and can be read.
  std::optional<TrajectoryFile> read_csv_file(const Node* named, std::string& bytes) {
    if (!named || !is_text(*named) || named->text.empty()) return {};
    const std::filesystem::path path = path_beside(path_, named->text);
    const auto source = std::make_shared<const std::string>(path.string());
    if (const auto stored = files_.find(path)) {
      bytes = stored->bytes;
      return TrajectoryFile{source, stored->text};
    }
    const auto read = read_file(path, named->mark, faults_, kLargestTrajectory, named->text);
    if (!read) return {};
    bytes = *read;
    auto text = checked_text(bytes, source, faults_);
    if (!text) return {};
    files_.store(path, {bytes, *text, {}});
    return TrajectoryFile{source, std::move(*text)};
  }

  // The library that control.plugin names, or the FMU, and its digest, which represents its bytes.
  struct PluginFile {
    std::string file, sha256;
  };
  PluginFile read_plugin_file(const Node& scenario, const std::string& key) {
    const Node* named = part(scenario, "control").find(key);
    if (!named || !is_text(*named) || named->text.empty()) return {};
    std::error_code error;
    const std::filesystem::path beside = path_beside(path_, named->text);
    const std::filesystem::path path = std::filesystem::absolute(beside, error);
    auto stored = files_.find(path);
    if (!stored) {
      const auto bytes = read_file(beside, named->mark, faults_, kLargestPlugin, named->text);
      if (!bytes) return {};
      files_.store(path, {sha256(*bytes), {}, {}});
      stored = files_.find(path);
    }
    if (key == "fmu") return {path.string(), stored->bytes};
    if (const std::string fault = plugin_fault(path.string(), named->text); !fault.empty()) {
      faults_.add(named->mark, fault);
      return {};
    }
    return {path.string(), stored->bytes};
  }

  // Errors of an FMU are reported where the scenario names it, or where it maps its variables.
  void open_fmu(const Node& scenario, CaptureProblem& problem) {
    ControlSetup& control = *problem.control;
    const Node& section = part(scenario, "control");
    ControlledRobot robot = controlled_parts(problem);
    for (const BodyDescription& body : problem.robot.bodies) {
      if (velocity_count(body.joint.type) == 1) robot.joints.push_back(body.joint.name);
    }
    try {
      const auto source =
          std::make_shared<const fmi::FmuControllers>(control.file, control.fmu, control.inputs, control.outputs);
      for (const fmi::FmuMisfit& misfit : source->misfits(robot, control.parameters, control.timing.period)) {
        const Node* place = section.find(misfit.key);
        const Node* entry = place && !misfit.entry.empty() ? place->find(misfit.entry) : nullptr;
        faults_.add((entry ? entry : place ? place : section.find("fmu"))->mark, misfit.text);
      }
      control.source = source;
    } catch (const fmi::FmuError& error) {
      faults_.add(section.find("fmu")->mark, error.what());
    }
  }

  static ReadRobot unknown_robot() {
    ReadRobot robot;
    for (NameTable* table : {&robot.links, &robot.end_effectors, &robot.joint_names}) table->make_incomplete();
    return robot;
  }

  std::filesystem::path path_, robot_path_;  // of the scenario, and of the robot if it is a file
  ScenarioFiles& files_;
  FaultList faults_, robot_faults_;
  std::string bytes_of_meshes_, bytes_of_overrides_;
  bool included_ = false, set_inside_robot_ = false;
  bool robot_unreadable_ = false;
  bool imported_ = false, import_refused_ = false;
  RobotTexts robot_texts_;
};

}  // namespace

std::optional<Node> read_robot_tree(const std::filesystem::path& beside, const Node& named, std::string& hashed,
                                    ScenarioFiles& files, FaultList& faults) {
  const std::filesystem::path path = robot_path(beside, named.text);
  // A name without dot and slash refers to a ready-made robot, unless only a file has this name.
  std::error_code unknown;
  if (is_ready_made_name(named.text) &&
      (find_ready_made(ReadyMade::Kind::robots, named.text) || !std::filesystem::exists(path, unknown)))
    return ready_made_robot(named, hashed, files, faults);
  return read_tree({path, FileKind::robot, named.mark, named.text}, hashed, files, faults);
}

std::filesystem::path robot_path(const std::filesystem::path& scenario, const std::string& named) {
  const ReadyMade* found = find_ready_made(ReadyMade::Kind::robots, named);
  return found ? std::filesystem::path(found->source()) : path_beside(scenario, named);
}

void include_targets(Node& scenario, std::set<std::string, std::less<>>& used, FaultList& faults) {
  Node* const list = scenario.find("targets");
  if (!list) return;
  for (Node& target : list->items) {
    const Node* const named = target.find("ready_made");
    if (!named || !is_text(*named) || named->text.empty()) continue;
    const ReadyMade* found = find_ready_made(ReadyMade::Kind::targets, named->text);
    Node tree;
    if (found) {
      used.emplace(found->name);
      tree = tree_of(*found);
    } else {
      // Missing parts are not reported again.
      faults.add(named->mark, no_ready_made(ReadyMade::Kind::targets, named->text));
      tree.entries.push_back({"mass", named->mark, number_node(1, named->mark)});
      tree.entries.push_back({"inertia", named->mark, list_node(std::vector<double>{1, 1, 1}, named->mark)});
    }
    for (NodeEntry& entry : tree.entries) {
      if (entry.key != "schema" && entry.key != "description" && !target.find(entry.key))
        target.entries.push_back(std::move(entry));
    }
  }
}

std::filesystem::path path_beside(const std::filesystem::path& file, const std::string& named) {
  const std::filesystem::path path = file.parent_path() / named;
  const std::filesystem::path shorter = path.lexically_normal();
  std::error_code error;
  if (std::filesystem::equivalent(path, shorter, error)) return shorter;
  // For a missing file the folder decides.
  const bool same_folder = std::filesystem::equivalent(path.parent_path(), shorter.parent_path(), error);
  return same_folder && !std::filesystem::exists(path, error) ? shorter : path;
}

std::shared_ptr<const ScenarioFiles::File> ScenarioFiles::find(const std::filesystem::path& path) const {
  const std::lock_guard lock(mutex_);
  const auto it = files_.find(path.string());
  return it == files_.end() ? nullptr : it->second;
}

void ScenarioFiles::store(const std::filesystem::path& path, File file) {
  const std::lock_guard lock(mutex_);
  files_.emplace(path.string(), std::make_shared<const File>(std::move(file)));
}

std::vector<std::filesystem::path> ScenarioFiles::paths() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::filesystem::path> list;
  for (const auto& [path, unused] : files_) list.emplace_back(path);
  return list;
}

std::shared_ptr<const ImportedFile> ScenarioFiles::find_imported(const std::string& key) const {
  const std::lock_guard lock(mutex_);
  const auto it = imported_.find(key);
  return it == imported_.end() ? nullptr : it->second;
}

void ScenarioFiles::store_imported(const std::string& key, std::shared_ptr<const ImportedFile> imported) {
  const std::lock_guard lock(mutex_);
  if (!imported_.emplace(key, std::move(imported)).second) return;
  imported_order_.push_back(key);
  if (imported_order_.size() <= kMostImported) return;
  imported_.erase(imported_order_.front());
  imported_order_.pop_front();
}

std::vector<Change> changes_of(std::span<const Override> overrides, FaultList& faults) {
  std::vector<Change> changes;
  for (const Override& one : overrides) {
    const Mark mark{std::make_shared<const std::string>(override_text(one)), 0, 0};
    if (auto value = parse_value(one.value, mark, faults))
      changes.push_back({one.path, mark, std::move(*value), one.value});
  }
  return changes;
}

CaptureProblem load_scenario(const std::filesystem::path& path, std::span<const Override> overrides,
                             std::vector<Fault>* warnings) {
  FaultList faults;
  const std::vector<Change> changes = changes_of(overrides, faults);
  ScenarioFiles files;
  return Loader(path, files, std::move(faults)).load(changes, warnings);
}

CaptureProblem load_scenario(const std::filesystem::path& path, std::span<const Change> changes, ScenarioFiles& files,
                             std::vector<Fault>* warnings) {
  return Loader(path, files).load(changes, warnings);
}

namespace {

// The robot of a tree; meshes are named relative to the folder of `path`.
RobotSetup robot_of_tree(Node tree, const std::filesystem::path& path, ScenarioFiles& files, FaultList& faults,
                         std::vector<Fault>* warnings) {
  std::string unused;
  check_structure(tree, robot_schema_document(), "the robot", faults);
  fill_defaults(tree, robot_schema_document());
  const Meshes meshes = read_mesh_files(tree, path, files, unused, faults);
  ReadRobot robot = read_robot(tree, {}, meshes, faults);
  faults.throw_if_any();
  if (warnings) *warnings = sorted_faults(faults.warnings());
  return std::move(robot.setup);
}

}  // namespace

TargetSetup load_ready_made_target(std::string_view name, std::vector<Fault>* warnings) {
  FaultList faults;
  const ReadyMade* found = find_ready_made(ReadyMade::Kind::targets, name);
  if (!found) faults.add({}, no_ready_made(ReadyMade::Kind::targets, name));
  faults.throw_if_any();
  Node tree = tree_of(*found);
  check_structure(tree, target_schema_document(), "the target", faults);
  fill_defaults(tree, target_schema_document());
  const Meshes no_meshes;
  TargetSetup target;
  read_members(tree, targets_description().of(), {}, &target, {faults, no_meshes});
  doubt_target_inertia(tree, {}, target, faults);
  faults.throw_if_any();
  if (warnings) *warnings = sorted_faults(faults.warnings());
  return target;
}

RobotSetup load_robot(const std::filesystem::path& path, std::vector<Fault>* warnings) {
  FaultList faults;
  ScenarioFiles files;
  std::optional<Node> tree;
  if (is_model_file(path.string())) {
    if (const auto imported = import_model(path, {}, path, path, files, faults)) tree = imported->tree;
  } else {
    std::string bytes;
    const Mark blame{std::make_shared<const std::string>(path.string()), 0, 0};
    // By its name, if there is no such file.
    std::error_code error;
    const bool is_name = is_ready_made_name(path.string()) && !std::filesystem::exists(path, error);
    Node named;
    named.text = path.string(), named.mark = blame;
    tree = is_name ? ready_made_robot(named, bytes, files, faults)
                   : read_tree({path, FileKind::robot, blame}, bytes, files, faults);
  }
  if (!tree) faults.throw_if_any();
  return robot_of_tree(std::move(*tree), path, files, faults, warnings);
}

RobotSetup read_imported(const ImportedFile& imported, const std::filesystem::path& place, ScenarioFiles& files,
                         std::vector<Fault>* warnings) {
  FaultList faults;
  return robot_of_tree(imported.tree, place, files, faults, warnings);
}

}  // namespace grapnel
