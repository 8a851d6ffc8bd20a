#include "grapnel/campaign/campaign_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>

#include "grapnel/campaign/changed_scenario.hpp"
#include "grapnel/campaign/grid.hpp"
#include "grapnel/scenario/imported_robot.hpp"
#include "grapnel/scenario/reader.hpp"
#include "grapnel/scenario/schema.hpp"
#include "grapnel/text/write_yaml.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

// Cases come in the order of the design's points.
constexpr std::size_t kMaxStored = 64;

bool is_of_robot(const std::string& path) { return path.starts_with("robot.") || path.starts_with("robot["); }

// A scenario with the robot selected by changes.
Node with_its_robot(Node scenario, const std::vector<Change>& changes) {
  FaultList reported_before;
  for (const Change& change : changes) {
    if (change.path == "robot") apply_change(scenario, change, reported_before);
  }
  return scenario;
}

// Separates uncertain values of import options from those of the imported robot.
struct DrawnOfRobot {
  bool choices = false, values = false;
};
DrawnOfRobot drawn_of_robot(const std::vector<UncertainPaths>& uncertain, const Node& scenario) {
  DrawnOfRobot drawn;
  for (const UncertainPaths& where : uncertain) {
    for (const std::string& path : where.paths) {
      const bool is_choice = is_import_choice(scenario, path);
      drawn.choices = drawn.choices || is_choice;
      drawn.values = drawn.values || (is_of_robot(path) && !is_choice);
    }
  }
  return drawn;
}

// Changes of the imported robot.
std::vector<Change> taken_from(std::vector<Change>& changes, const Node& scenario) {
  const auto later = std::stable_partition(changes.begin(), changes.end(), [&](const Change& change) {
    return !is_of_robot(change.path) || is_import_choice(scenario, change.path);
  });
  std::vector<Change> taken(std::make_move_iterator(later), std::make_move_iterator(changes.end()));
  changes.erase(later, changes.end());
  return taken;
}

// Adds the imported robot to its import options, so that paths lead to both.
void add_robot(const Node& of, Node& scenario) {
  Node* robot = scenario.find("robot");
  Node both = part(of, "robot");
  for (NodeEntry& choice : robot->entries) both.entries.push_back(std::move(choice));
  *robot = std::move(both);
}

// Without changes of the robot, if it is imported again for every case.
std::vector<UncertainPaths> those_of_file(std::vector<UncertainPaths> uncertain, const Node& scenario) {
  for (UncertainPaths& where : uncertain) {
    for (std::size_t p = where.paths.size(); p-- > 0;) {
      if (!is_of_robot(where.paths[p]) || is_import_choice(scenario, where.paths[p])) continue;
      where.paths.erase(where.paths.begin() + static_cast<std::ptrdiff_t>(p));
      where.path_marks.erase(where.path_marks.begin() + static_cast<std::ptrdiff_t>(p));
    }
  }
  return uncertain;
}

// Setters of all paths; empty if one is missing.
std::vector<ProblemSetter> setters_of(const std::vector<ReadUncertain>& uncertain, const DesignPoint& design) {
  std::vector<ProblemSetter> setters;
  FaultList found_before;
  for (std::size_t i = 0; i < uncertain.size(); ++i) {
    const ReadUncertain& one = uncertain[i];
    if (design.forms[i].is_absent || (!one.choices.empty() && !one.choices_are_numbers)) return {};
    // A choice is one number; in place of a list it represents the whole list, which only the reader can set.
    const auto is_number = [](const Node& form) { return form.is_scalar(); };
    const std::vector<Node>& forms = design.forms[i].forms;
    if (!one.choices.empty() && !std::all_of(forms.begin(), forms.end(), is_number)) return {};
    for (std::size_t p = 0; p < one.where.paths.size(); ++p) {
      const auto steps = path_steps(design.filled, one.where.paths[p], one.where.path_marks[p], found_before);
      ProblemSetter setter = problem_setter(steps, design.forms[i].forms[p], design.problem);
      if (!setter) return {};
      setters.push_back(std::move(setter));
    }
  }
  return setters;
}

}  // namespace

std::vector<std::size_t> CampaignPoints::axis_sizes() const {
  std::vector<std::size_t> sizes;
  for (const ReadAxis& axis : axes) sizes.push_back(axis.values.size());
  return sizes;
}

CaptureProblem CampaignPoints::before_quantities(std::span<const std::size_t> at, std::vector<Fault>* warnings) {
  return load_scenario(scenario, changes_at(set, axes, at), files, warnings);
}

std::shared_ptr<const DesignPoint> CampaignPoints::design_point(std::uint64_t number) {
  {
    const std::lock_guard lock(mutex_);
    const auto it = stored_.find(number);
    if (it != stored_.end()) return it->second.get();
  }
  // Two threads may compute the same point, with equal results.
  StoredPoint made;
  try {
    made.point = make(number);
  } catch (const std::exception&) {
    made.error = std::current_exception();  // a failed search for a plan is cached too: it takes as long as a
                                            // successful one, or longer
  }
  const std::lock_guard lock(mutex_);
  const auto [it, fresh] = stored_.emplace(number, std::move(made));
  if (!fresh) return it->second.get();
  const StoredPoint result = it->second;
  order_.push_back(number);
  if (order_.size() > kMaxStored) {
    stored_.erase(order_.front());
    order_.pop_front();
  }
  return result.get();
}

void CampaignPoints::forget() {
  const std::lock_guard lock(mutex_);
  stored_.clear();
  order_.clear();
}

std::shared_ptr<const DesignPoint> CampaignPoints::make(std::uint64_t number) {
  const std::vector<std::size_t> at = grid_position(axis_sizes(), number);
  const std::vector<Change> changed = changes_at(set, axes, at);
  const CaptureProblem before = load_scenario(scenario, changed, files);
  StudyCase nominal{before, inward_normals(before)};
  apply_quantities(quantities_at(axes, at), nominal.problem);
  preserve_normals(before, nominal);

  auto made = std::make_shared<DesignPoint>();
  made->number = number;
  // In the folder of the scenario, so that its relative paths remain valid.
  made->file = scenario;
  made->file += fmt::format(" (point {} of the design{})", number, plan_once ? ", planned" : "");

  // A robot with uncertain import options is imported again for every case, and its changes are applied again.
  Node tree = with_its_robot(files.find(scenario)->tree, changed);
  const DrawnOfRobot drawn = drawn_of_robot(paths, tree);
  std::vector<Change> first = changed;
  if (drawn.choices) made->of_robot = taken_from(first, tree);
  tree = changed_tree(scenario, first, files);
  if (drawn.values && !drawn.choices) include_robot(tree, scenario, files);
  take_units(tree);  // so that values at uncertain places are numbers
  write_back(before, nominal.problem, tree);
  FaultList faults;
  prepare_orientations(paths, tree, faults);
  faults.throw_if_any();
  if (plan_once) freeze_plan(nominal.problem, tree);

  made->filled = tree;
  if (drawn.values && drawn.choices) {
    Node with_robot = changed_tree(scenario, changed, files);
    include_robot(with_robot, scenario, files);
    take_units(with_robot);
    add_robot(with_robot, made->filled);
  }
  fill_defaults(made->filled, scenario_schema_document());
  complete_places(drawn.choices ? those_of_file(paths, tree) : paths, made->filled, tree);
  files.store(made->file, {yaml_text(tree), {}, tree});
  made->problem = load_scenario(made->file, made->of_robot, files);
  for (const UncertainPaths& where : paths) made->forms.push_back(form_at(where, made->filled, faults));
  faults.throw_if_any();
  expect_counts(*made);
  if (setters_allowed_) made->setters = setters_of(uncertain, *made);
  return made;
}

// Values of the design may replace an uncertain value by another kind of value.
void CampaignPoints::expect_counts(const DesignPoint& design) const {
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const std::size_t here = design.forms[i].nominal.size();
    if (here == counts[i]) continue;
    throw std::runtime_error(
        fmt::format("{}: {} has {} numbers at this design point, but {} at the first; the number must not change",
                    paths[i].place, paths[i].paths[0], here, counts[i]));
  }
}

CampaignPoints::Draw CampaignPoints::draw(const DesignPoint& design, std::span<const double> point) const {
  Draw result;
  std::size_t at = 0;
  for (std::size_t i = 0; i < uncertain.size(); ++i) {
    const ReadUncertain& one = uncertain[i];
    const std::size_t n = dimensions(one.value);
    DrawnValue drawn = draw_value(one.value, design.forms[i].nominal, point.subspan(at, n));
    if (one.choices_are_numbers && !one.choices.empty())
      drawn.shown = *numbers_in(one.choices[static_cast<std::size_t>(drawn.numbers[0])]);
    result.values.push_back(std::move(drawn));
    at += n;
  }
  return result;
}

std::vector<Change> CampaignPoints::changes(const DesignPoint& design, const Draw& draw) const {
  std::vector<Change> all = design.of_robot;
  for (std::size_t i = 0; i < uncertain.size(); ++i) {
    const std::vector<Change> some = changes_of(uncertain[i], design.forms[i], draw.values[i].numbers);
    all.insert(all.end(), some.begin(), some.end());
  }
  return all;
}

CaptureProblem CampaignPoints::read(const DesignPoint& design, const Draw& draw) {
  CaptureProblem problem = load_scenario(design.file, changes(design, draw), files);
  problem.sha256 = design.problem.sha256;
  return problem;
}

CaptureProblem CampaignPoints::problem(const DesignPoint& design, const Draw& draw) {
  if (design.setters.empty()) return read(design, draw);
  CaptureProblem problem = design.problem;
  std::size_t setter = 0;
  for (std::size_t i = 0; i < uncertain.size(); ++i) {
    const std::span<const double> numbers =
        uncertain[i].choices.empty() ? draw.values[i].numbers : draw.values[i].shown;
    std::size_t at = 0;
    for (const Node& form : design.forms[i].forms) {
      const std::size_t n = form.is_scalar() ? 1 : form.items.size() + form.entries.size();
      if (!design.setters[setter++](problem, numbers.subspan(at, n))) return read(design, draw);
      at += n;
    }
  }
  return problem;
}

std::vector<double> CampaignPoints::point_of(std::uint64_t k) const {
  std::vector<double> point(samples->dimensions());
  // All points of the design use the same sample, so that they differ only by the design.
  samples->at(axes.empty() ? k : k % cases, point);
  return point;
}

std::vector<double> CampaignPoints::inputs(std::uint64_t k) {
  const auto design = design_point(axes.empty() ? 0 : k / cases);
  std::vector<double> numbers;
  for (const DrawnValue& value : draw(*design, point_of(k)).values)
    numbers.insert(numbers.end(), value.shown.begin(), value.shown.end());
  return numbers;
}

StudyCase CampaignPoints::study_case(std::uint64_t k) {
  const auto design = design_point(axes.empty() ? 0 : k / cases);
  StudyCase result{problem(*design, draw(*design, point_of(k))), {}};
  result.inward_normals = inward_normals(result.problem);
  return result;
}

std::string CampaignPoints::scenario_text(std::uint64_t k, const std::filesystem::path& place,
                                          const std::string& comment) {
  const auto design = design_point(axes.empty() ? 0 : k / cases);
  Node tree = changed_tree(design->file, changes(*design, draw(*design, point_of(k))), files);
  return changed_scenario_text({scenario, std::move(tree), design->problem}, design->problem, place,
                               fmt::format(", case {}", k), comment);
}

}  // namespace grapnel
