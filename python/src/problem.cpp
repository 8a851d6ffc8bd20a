#include "problem.hpp"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "grapnel/campaign/changed_scenario.hpp"
#include "grapnel/scenario/imported_robot.hpp"
#include "grapnel/scenario/schema.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/parse_yaml.hpp"
#include "grapnel/text/write_yaml.hpp"

namespace grapnel::python {
namespace {

namespace fs = std::filesystem;

// The value on one line, in the form of "--set", is what the scenario's digest and texts contain.
Change change_of(const std::string& path, const py::handle& value) {
  Change change{path, {}, tree_of(value, path), {}};
  change.text = flow_text(change.value);
  change.mark = change.value.mark;
  return change;
}

}  // namespace

Scenario::Scenario(const fs::path& file, const Changes& changes) : file_(file) { set(changes); }

Scenario::Scenario(const py::dict& values, const fs::path& folder, const Changes& changes)
    : file_(folder / "a scenario made in Python"), is_file_(false) {
  Node tree = tree_of(values, {});
  const std::string text = yaml_text(tree);
  files_->store(file_, {text, {}, std::move(tree)});
  set(changes);
}

void Scenario::load(std::vector<Change> changes) {
  std::vector<Fault> warnings;
  CaptureProblem problem = load_scenario(file_, changes, *files_, &warnings);
  problem_ = std::make_shared<const CaptureProblem>(std::move(problem));
  warnings_ = std::move(warnings);
  changes_ = std::move(changes);
  tree_.reset();
}

void Scenario::set(const Changes& changes) {
  std::vector<Change> all = changes_;
  for (const auto& [path, value] : changes) {
    // Only the last value of a path is effective: earlier ones are removed.
    std::erase_if(all, [&, &name = path](const Change& earlier) { return earlier.path == name; });
    all.push_back(change_of(path, value));
  }
  load(std::move(all));
}

const Node& Scenario::tree() const {
  if (!tree_) {
    Node tree = changed_tree(file_, changes_, *files_);
    include_robot(tree, file_, *files_);
    take_units(tree);
    fill_defaults(tree, scenario_schema_document());
    if (Node* robot = tree.find("robot"); robot && robot->is_mapping()) fill_defaults(*robot, robot_schema_document());
    tree_ = std::make_shared<const Node>(std::move(tree));
  }
  return *tree_;
}

py::object Scenario::get(const std::string& path) const {
  if (path.empty()) return value_of(tree());
  // path_steps() creates absent keys, in a copy. A malformed path is an error, an absent key is not.
  FaultList faults;
  Node copy = tree();
  path_steps(copy, path, {std::make_shared<const std::string>(path), 0, 0}, faults);
  if (!faults.empty()) throw py::key_error(faults.all().front().message);
  const std::optional<Node> value = value_at(std::move(copy), path);
  if (value) return value_of(*value);
  // If the last key is misspelt: the keys beside it.
  std::vector<std::string> keys;
  const std::size_t dot = path.rfind('.');
  const std::optional<Node> above = dot == std::string::npos ? tree() : value_at(tree(), path.substr(0, dot));
  if (above)
    for (const NodeEntry& entry : above->entries) keys.push_back(entry.key);
  const std::string name = dot == std::string::npos ? path : path.substr(dot + 1);
  throw py::key_error("the scenario has no " + in_quotes(path) +
                      (keys.empty() ? "" : suggestion(name, keys, "keys there")));
}

std::string Scenario::text(const fs::path& place) const {
  return changed_scenario_text({file_, changed_tree(file_, changes_, *files_), *problem_}, *problem_, place, {}, {});
}

std::vector<std::pair<std::string, py::object>> Scenario::changes() const {
  std::vector<std::pair<std::string, py::object>> changes;
  for (const Change& change : changes_) changes.emplace_back(change.path, value_of(change.value));
  return changes;
}

py::object Scenario::values() const { return is_file_ ? py::none() : value_of(files_->find(file_)->tree); }

std::vector<std::string> Scenario::settings() const {
  std::vector<std::string> settings;
  for (const Change& change : changes_) settings.push_back(change.path + "=" + change.text);
  return settings;
}

namespace {

// Errors and warnings of the scenario that make() loads.
std::vector<Fault> faults_of(const std::function<Scenario()>& make) {
  try {
    return make().warnings();
  } catch (const InputError& error) {
    return error.faults();
  }
}

}  // namespace

void bind_problem(py::module_& module) {
  py::class_<Scenario, std::shared_ptr<Scenario>>(module, "Problem")
      .def(py::init<const fs::path&, const Scenario::Changes&>(), py::arg("file"), py::arg("changes"))
      .def(py::init<const py::dict&, const fs::path&, const Scenario::Changes&>(), py::arg("values"), py::arg("folder"),
           py::arg("changes"))
      .def("copy", [](const Scenario& scenario) { return std::make_shared<Scenario>(scenario); })
      .def("set", &Scenario::set, py::arg("changes"))
      .def("get", &Scenario::get, py::arg("path"))
      .def("text", &Scenario::text, py::arg("place"))
      .def_property_readonly("file", [](const Scenario& scenario) { return scenario.file().string(); })
      .def_property_readonly("name", [](const Scenario& scenario) { return scenario.problem().name; })
      .def_property_readonly("sha256", [](const Scenario& scenario) { return scenario.problem().sha256; })
      .def_property_readonly("settings", &Scenario::settings)
      .def_property_readonly("changes", &Scenario::changes)
      .def_property_readonly("values", &Scenario::values)
      .def_property_readonly("warnings", &Scenario::warnings);
  module.def(
      "yaml_text", [](const py::dict& values) { return yaml_text(tree_of(values, {})); }, py::arg("values"));
  module.def(
      "check_file",
      [](const fs::path& file, const Scenario::Changes& changes) {
        return faults_of([&] { return Scenario(file, changes); });
      },
      py::arg("file"), py::arg("changes"));
  module.def(
      "check_values",
      [](const py::dict& values, const fs::path& folder, const Scenario::Changes& changes) {
        return faults_of([&] { return Scenario(values, folder, changes); });
      },
      py::arg("values"), py::arg("folder"), py::arg("changes"));
}

}  // namespace grapnel::python
