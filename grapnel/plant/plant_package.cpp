#include "grapnel/plant/plant_package.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "grapnel/plant/plant_problem.hpp"
#include "grapnel/scenario/problem_setter.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/scenario/scenario_files.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/parse_yaml.hpp"
#include "grapnel/text/units.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;

// Setting, in the notation of --set, that is added if the scenario has no control.
constexpr const char* kUsualPeriod = "control.period=10 ms";

// Converts settings in the notation of --set. @throws InputError.
std::vector<Change> changes_of(const std::vector<std::string>& settings) {
  std::vector<Change> changes;
  FaultList faults;
  for (const std::string& setting : settings) {
    const Override one = parse_override(setting);
    const Mark mark{std::make_shared<const std::string>(override_text(one)), 0, 0};
    if (auto value = parse_value(one.value, mark, faults))
      changes.push_back({one.path, mark, std::move(*value), one.value});
  }
  faults.throw_if_any();
  return changes;
}

// ---- Parameters ----

// "kg.m2.s-2"; empty where there is no dimension, or one with broken powers.
std::string si_name(const Unit& unit) {
  constexpr std::array<const char*, 4> kBase = {"m", "kg", "s", "rad"};
  std::string name;
  for (std::size_t i = 0; i < kBase.size(); ++i) {
    const int power = unit.powers.at(i);
    if (power % 10 != 0) return {};
    if (power == 0) continue;
    name += fmt::format("{}{}{}", name.empty() ? "" : ".", kBase.at(i), power == 10 ? "" : std::to_string(power / 10));
  }
  return name;
}

// A number in SI units, and the SI unit of its written unit.
struct WrittenNumber {
  double value = 0;
  std::string unit;
};

std::optional<WrittenNumber> number_at(const Node& node) {
  if (!node.is_scalar() || !node.plain) return {};
  if (const auto parts = number_and_unit(node.text)) {
    const auto unit = unit_named(parts->unit);
    if (!unit) return {};
    return WrittenNumber{in_si(*parts, *unit), si_name(*unit)};
  }
  const std::optional<double> plain = number_of(node);
  if (!plain) return {};
  return WrittenNumber{*plain, ""};
}

// Converts a number with any unit to a plain number.
Node in_si_units(Node node) {
  if (const auto number = number_at(node)) node.text = fmt::format("{:.17g}", number->value);
  return node;
}

// Paths of all numbers below a node.
void list_numbers(const Node& node, const std::string& path, std::vector<std::string>& paths) {
  if (number_at(node)) paths.push_back(path);
  for (std::size_t i = 0; i < node.items.size(); ++i)
    list_numbers(node.items[i], path + "[" + std::to_string(i) + "]", paths);
  for (const NodeEntry& entry : node.entries) list_numbers(entry.value, path + "." + entry.key, paths);
}

// Default parameters: numbers that campaigns can vary in place, which change neither structure nor names.
std::vector<std::string> default_parameters(const Node& scenario, const CaptureProblem& problem) {
  std::vector<std::string> all, varied;
  for (const char* section : {"initial", "targets", "contact", "impact", "loads"}) {
    if (const Node* node = scenario.find(section)) list_numbers(*node, section, all);
  }
  for (const std::string& path : all) {
    FaultList faults;
    const Mark mark{std::make_shared<const std::string>(path), 0, 0};
    const std::vector<PathStep> steps = path_steps(scenario, path, mark, faults);
    const std::optional<Node> node = value_at(scenario, path);
    if (faults.size() == 0 && node && problem_setter(steps, in_si_units(*node), problem)) varied.push_back(path);
  }
  return varied;
}

PlantParameter parameter_at(const Node& scenario, const std::string& path) {
  const std::optional<Node> node = value_at(scenario, path);
  if (!node) throw PlantError(fmt::format("--parameter {}: the scenario has no such value; set one with --set", path));
  const auto number = number_at(*node);
  if (!number) throw PlantError(fmt::format("--parameter {}: not a number", path));
  return {path, number->value, number->unit};
}

// The scenario's tree with the settings, except those of the robot's own file.
Node tree_with(std::vector<Change> changes, const fs::path& scenario, const ScenarioFiles& files) {
  Node tree = files.find(scenario)->tree;
  std::erase_if(changes, [](const Change& change) {
    return change.path.starts_with("robot.") || change.path.starts_with("robot[");
  });
  FaultList faults;
  std::set<std::string, std::less<>> ready_made;
  apply_changes(tree, changes, ready_made, faults, [](const Change&) { return true; });
  faults.throw_if_any();
  return tree;
}

// ---- Files ----

// Locations of the files below their nearest common folder.
std::vector<GatheredPlant::File> placed(const std::vector<fs::path>& files) {
  fs::path common;
  std::vector<fs::path> whole;
  for (const fs::path& file : files) {
    whole.push_back(fs::absolute(file).lexically_normal());
    const fs::path folder = whole.back().parent_path();
    if (common.empty()) common = folder;
    auto a = common.begin();
    auto b = folder.begin();
    fs::path shared;
    for (; a != common.end() && b != folder.end() && *a == *b; ++a, ++b) shared /= *a;
    common = shared;
  }
  std::vector<GatheredPlant::File> list;
  for (const fs::path& file : whole)
    list.push_back({file, "scenario/" + file.lexically_relative(common).generic_string()});
  return list;
}

// Rejects trees that name a file by an absolute path, which would not exist on another machine.
void refuse_absolute(const Node& node) {
  if (node.is_scalar() && node.text.size() > 1 && node.text.front() == '/' && fs::exists(node.text))
    throw PlantError(fmt::format(
        "{} is named by an absolute path, which does not exist on other machines; name it relative to the scenario",
        in_quotes(node.text)));
  for (const Node& item : node.items) refuse_absolute(item);
  for (const NodeEntry& entry : node.entries) refuse_absolute(entry.value);
}

std::string setting_of(const PlantParameter& parameter, double value) {
  return fmt::format("{}={:.17g}", parameter.path, value);
}

}  // namespace

std::string plant_json(const PlantPackage& package) {
  Json parameters = Json::array();
  for (const PlantParameter& p : package.parameters)
    parameters.push_back({{"path", p.path}, {"start", p.start}, {"unit", p.unit}});
  return Json{{"format", kFormat},        {"scenario", package.scenario},
              {"set", package.settings},  {"base_torque", package.base_torque},
              {"parameters", parameters}, {"token", package.token}}
             .dump(2) +
         "\n";
}

PlantPackage read_plant(const fs::path& folder) {
  const fs::path file = folder / kPlantFile;
  std::ifstream in(file);
  if (!in) throw PlantError(fmt::format("there is no file {} in the FMU's resources, {}", kPlantFile, folder.string()));
  try {
    const Json json = Json::parse(in);
    if (json.at("format") != kFormat)
      throw PlantError(fmt::format("{} has format {}, expected {}", file.string(), json.at("format").dump(), kFormat));
    PlantPackage package;
    package.scenario = json.at("scenario");
    package.settings = json.at("set").get<std::vector<std::string>>();
    package.base_torque = json.at("base_torque");
    package.token = json.at("token");
    for (const Json& p : json.at("parameters"))
      package.parameters.push_back({p.at("path"), p.at("start"), p.at("unit")});
    return package;
  } catch (const Json::exception& error) {
    throw PlantError(fmt::format("{} is damaged: {}", file.string(), error.what()));
  }
}

CaptureProblem load_plant(const PlantPackage& package, const fs::path& folder, const std::vector<double>& values) {
  std::vector<Override> overrides;
  for (const std::string& setting : package.settings) overrides.push_back(parse_override(setting));
  // Unchanged values keep their written form.
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (values[i] != package.parameters.at(i).start)
      overrides.push_back(parse_override(setting_of(package.parameters[i], values[i])));
  }
  return plant_of(load_scenario(folder / package.scenario, overrides), package.base_torque);
}

GatheredPlant gather_plant(const fs::path& scenario, const std::vector<std::string>& settings,
                           const std::vector<std::string>& parameters, bool base_torque, std::vector<Fault>* warnings) {
  ScenarioFiles files;
  GatheredPlant gathered;
  gathered.package.settings = settings;
  std::vector<Change> changes = changes_of(settings);
  CaptureProblem problem = load_scenario(scenario, changes, files, warnings);
  if (!problem.control) {
    gathered.assumed = kUsualPeriod;
    gathered.package.settings.push_back(gathered.assumed);
    changes = changes_of(gathered.package.settings);
    problem = load_scenario(scenario, changes, files, nullptr);
  }
  gathered.plant = plant_of(problem, base_torque);
  gathered.package.base_torque = base_torque;
  const Node tree = tree_with(changes, scenario, files);
  std::vector<std::string> paths;
  for (const std::string& asked : parameters) {
    const std::vector<std::string> more =
        asked == "default" ? default_parameters(tree, problem) : std::vector<std::string>{asked};
    for (const std::string& path : more) {
      if (std::find(paths.begin(), paths.end(), path) == paths.end()) paths.push_back(path);
    }
  }
  for (const std::string& path : paths) gathered.package.parameters.push_back(parameter_at(tree, path));
  refuse_absolute(tree);
  std::vector<fs::path> read{scenario};
  for (const fs::path& path : files.paths()) {
    if (fs::exists(path) && path != scenario) read.push_back(path);
    if (const auto file = files.find(path)) refuse_absolute(file->tree);
  }
  gathered.files = placed(read);
  gathered.package.scenario = gathered.files.front().to;
  return gathered;
}

}  // namespace grapnel
