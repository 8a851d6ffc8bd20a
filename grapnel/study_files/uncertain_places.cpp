#include "grapnel/study_files/uncertain_places.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <optional>

#include "grapnel/scenario/reader.hpp"
#include "grapnel/scenario/schema.hpp"
#include "grapnel/scenario/sections.hpp"
#include "grapnel/study_files/read_uncertain.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/write_yaml.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

// Whether an existing mapping can have an orientation.
bool can_be_oriented(const Node& scenario, const std::string& path, const Mark& mark) {
  FaultList unused;
  std::vector<PathStep> steps = path_steps(scenario, path, mark, unused);
  steps.push_back({"quaternion_wxyz", 0, false});
  return place_rule(steps).is_known;
}

}  // namespace

Overlap overlap(std::span<const PathStep> place, std::span<const PathStep> other) {
  const std::size_t common = std::min(place.size(), other.size());
  const auto same = [](const PathStep& a, const PathStep& b) {
    return a.is_index == b.is_index && a.index == b.index && a.key == b.key;
  };
  if (!std::equal(place.begin(), place.begin() + static_cast<std::ptrdiff_t>(common), other.begin(), same))
    return Overlap::none;
  if (place.size() == other.size()) return Overlap::same;
  return place.size() > common ? Overlap::part : Overlap::whole;
}

UncertainPaths uncertain_paths(const UncertainFile& file, const Node& entry, const std::string& place) {
  UncertainPaths where;
  where.mark = entry.mark, where.place = place;
  const auto add = [&](const std::string& path, const Mark& mark) {
    if (path.empty()) return;
    where.paths.push_back(path);
    where.path_marks.push_back(mark);
  };
  add(file.path, part(entry, "path").mark);
  for (std::size_t i = 0; i < file.paths.size(); ++i) add(file.paths[i], part(entry, "paths").items[i].mark);
  where.is_orientation = file.rotation.has_value();
  if (where.is_orientation) {
    for (std::string& path : where.paths) {
      if (!path.ends_with(".quaternion_wxyz")) path += ".quaternion_wxyz";
    }
  }
  return where;
}

void prepare_orientations(const std::vector<UncertainPaths>& uncertain, Node& scenario, FaultList& faults) {
  for (const UncertainPaths& where : uncertain) {
    if (!where.is_orientation || where.paths.empty()) continue;
    const std::string of = where.paths[0].substr(0, where.paths[0].rfind(".quaternion_wxyz"));
    std::optional<Node> mapping = value_at(scenario, of);
    if (!mapping) continue;
    if (!mapping->is_mapping() || !can_be_oriented(scenario, of, where.path_marks[0])) {
      faults.add(where.path_marks[0],
                 fmt::format("{}: rotation requires an orientation, a 'quaternion_wxyz' or 'rpy', not {} at {}; use "
                             "the path of the mapping, such as targets.NAME.state",
                             where.place, described(*mapping), shortened(of)));
      continue;
    }
    if (mapping->find("quaternion_wxyz")) continue;
    FaultList unused;
    const auto rpy = vector_at(*mapping, "rpy").value_or(Vector3d::zero());
    const Quaterniond q = quaternion_from(rotation_from_rpy(rpy[0], rpy[1], rpy[2]));
    const Mark mark = mapping->entry("rpy") ? mapping->entry("rpy")->mark : mapping->mark;
    std::erase_if(mapping->entries, [](const NodeEntry& e) { return e.key == "rpy"; });
    mapping->entries.push_back({"quaternion_wxyz", mark, list_node(std::vector<double>{q.w, q.x, q.y, q.z}, mark)});
    apply_change(scenario, {of, mark, std::move(*mapping), {}}, unused);
  }
}

void complete_places(const std::vector<UncertainPaths>& uncertain, const Node& filled, Node& scenario) {
  for (const UncertainPaths& where : uncertain) {
    for (std::size_t p = 0; p < where.paths.size(); ++p) {
      FaultList unused;
      const Node* from = &filled;
      Node* to = &scenario;
      for (const PathStep& step : path_steps(filled, where.paths[p], where.path_marks[p], unused)) {
        if (step.is_index) {
          from = &from->items[step.index], to = &to->items[step.index];
          continue;
        }
        const NodeEntry* entry = from->entry(step.key);
        if (!entry) break;
        if (!to->find(step.key)) to->entries.push_back(*entry);
        from = &entry->value, to = to->find(step.key);
      }
    }
  }
}

bool report_unknown_keys(const UncertainPaths& where, const Node& scenario, FaultList& faults) {
  bool found = false;
  for (std::size_t p = 0; p < where.paths.size(); ++p) {
    const Mark& mark = where.path_marks[p];
    FaultList all;
    const std::vector<PathStep> steps = path_steps(scenario, where.paths[p], mark, all);
    if (steps.empty() || place_rule(steps).is_known) continue;
    // The value at the path is checked as part of the scenario; errors at its mark concern it.
    Node tree = scenario;
    apply_change(tree, {where.paths[p], mark, Node{}, {}}, all);
    check_structure(tree, scenario_schema_document(), "the scenario", all);
    for (const Fault& fault : all.all()) {
      const bool is_here = fault.line == mark.line && fault.column == mark.column;
      if (!is_here || !fault.message.starts_with("unknown key")) continue;
      faults.add(mark, where.place + ": " + fault.message);
      found = true;
      break;
    }
  }
  return found;
}

UncertainForm form_at(const UncertainPaths& where, const Node& scenario, FaultList& faults) {
  UncertainForm form;
  for (std::size_t p = 0; p < where.paths.size(); ++p) {
    const std::vector<PathStep> steps = path_steps(scenario, where.paths[p], where.path_marks[p], faults);
    if (steps.empty()) continue;
    const auto value = value_at(scenario, where.paths[p]);
    form.forms.push_back(value.value_or(Node{}));
    form.is_absent = form.is_absent || !value;
    if (!value) continue;
    const auto numbers = numbers_in(*value);
    if (numbers) form.nominal.insert(form.nominal.end(), numbers->begin(), numbers->end());
  }
  return form;
}

namespace {

// "rad or m": for revolute or prismatic joints. Longer units remain unchanged.
struct JointUnits {
  std::string turning, sliding;
};

std::optional<JointUnits> joint_units(const std::string& unit) {
  const std::string between = " or ";
  const std::size_t at = unit.find(between);
  if (at == std::string::npos || unit.find_first_of(",;") != std::string::npos) return {};
  return JointUnits{unit.substr(0, at), unit.substr(at + between.size())};
}

// Units of joint values: selects one unit of "rad or m".
class JointUnitFinder {
 public:
  explicit JointUnitFinder(const RobotSetup& robot) { joints_ = moving_joints(robot); }

  // Unit of number i of a value with this form at these steps.
  std::string unit(const JointUnits& units, std::span<const PathStep> steps, const Node& form, std::size_t i) const {
    const JointDescription* joint = find(steps, form, i);
    if (joint) return unit_of(units, *joint);
    // One number for all joints, or an unknown joint.
    const std::string first = joints_.empty() ? "" : unit_of(units, joints_.front());
    const auto alike = [&](const JointDescription& one) { return unit_of(units, one) == first; };
    return !first.empty() && std::all_of(joints_.begin(), joints_.end(), alike) ? first : either(units);
  }

 private:
  static std::string either(const JointUnits& units) { return units.turning + " or " + units.sliding; }

  static std::string unit_of(const JointUnits& units, const JointDescription& joint) {
    return turns_about_axis(joint.type) ? units.turning : slides_along_axis(joint.type) ? units.sliding : either(units);
  }

  const JointDescription* named(const std::string& name) const {
    const auto is_it = [&](const JointDescription& joint) { return joint.name == name; };
    const auto it = std::find_if(joints_.begin(), joints_.end(), is_it);
    return it == joints_.end() ? nullptr : &*it;
  }
  const JointDescription* at(std::size_t index) const { return index < joints_.size() ? &joints_[index] : nullptr; }

  // Values per joint: a list in joint order, or a mapping by name.
  const JointDescription* find(std::span<const PathStep> steps, const Node& form, std::size_t i) const {
    const PathStep& last = steps.back();
    if (form.is_mapping()) return i < form.entries.size() ? named(form.entries[i].key) : nullptr;
    if (form.is_sequence()) return !last.is_index && form.items.size() == joints_.size() ? at(i) : nullptr;
    if (!last.is_index) return named(last.key);
    return steps.size() > 1 && !steps[steps.size() - 2].is_index ? at(last.index) : nullptr;
  }

  std::vector<JointDescription> joints_;  // moving, in the model's order
};

class InputNamer {
 public:
  InputNamer(const ReadUncertain& uncertain, const UncertainForm& form, const Node& scenario,
             const CaptureProblem& problem)
      : read_(uncertain), form_(form), problem_(problem) {
    FaultList found_before;
    for (std::size_t p = 0; p < read_.where.paths.size(); ++p) {
      steps_.push_back(path_steps(scenario, read_.where.paths[p], read_.where.path_marks[p], found_before));
      rules_.push_back(place_rule(steps_.back()));
    }
  }

  // Heads of all numbers of all paths.
  std::vector<std::string> units() const {
    std::vector<std::string> all;
    for (std::size_t p = 0; p < form_.forms.size(); ++p) {
      const std::size_t n = numbers_in(form_.forms[p]).value_or(std::vector<double>{}).size();
      for (std::size_t i = 0; i < n; ++i) all.push_back(unit_of(p, form_.forms[p], i));
    }
    return all;
  }

  std::vector<CampaignInput> names() {
    std::visit([this](const auto& value) { name(value); }, read_.value);
    return std::move(inputs_);
  }

 private:
  const std::string& path() const { return read_.where.paths[0]; }
  const PlaceRule& rule() const { return rules_[0]; }

  void add(const std::string& name, const std::string& unit, const std::string& description) {
    inputs_.push_back({name, unit, description});
  }

  // Unit of number i of a value with this form at path p.
  std::string unit_of(std::size_t p, const Node& form, std::size_t i) const {
    const auto units = joint_units(rules_[p].unit);
    // Joints locked by an import are not moving joints.
    if (!units || steps_[p].empty() || steps_[p][0].key == "robot" || steps_[p][0].key == "import")
      return rules_[p].unit;
    return JointUnitFinder(problem_.robot).unit(*units, steps_[p], form, i);
  }

  void add_number(std::size_t p, std::size_t i) {
    const Node& form = form_.forms[p];
    std::string name = number_name(form, i);
    if (read_.where.paths[p].ends_with("inertia") && form.is_sequence())
      name = std::vector<std::string>{"xx", "yy", "zz", "xy", "xz", "yz"}.at(std::min<std::size_t>(i, 5));
    const std::string& of = read_.where.paths[p];
    add(name.empty() ? of : of + "/" + name, unit_of(p, form, i), rules_[p].description);
  }

  void name(const IndependentNumbers& numbers) {
    for (std::size_t i = 0; i < numbers.distributions.size(); ++i) {
      if (!numbers.distributions[i].is_constant()) add_number(0, i);
    }
  }
  void name(const CommonNumber& number) {
    const bool factor = number.form == ValueForm::factor;
    add(path(), factor ? "1" : unit_of(0, number_node(0), 0),
        factor ? "factor on the scenario's numbers" : "for all numbers there; " + rule().description);
  }
  void name(const CorrelatedNumbers&) {
    for (std::size_t p = 0; p < form_.forms.size(); ++p) {
      const std::size_t n = numbers_in(form_.forms[p])->size();
      for (std::size_t i = 0; i < n; ++i) add_number(p, i);
    }
  }
  void name(const SphereVector& vector) { name_vector(vector.length); }
  void name(const TiltedVector& vector) { name_vector(vector.factor); }
  void name_vector(const NumberDistribution& length) {
    for (const char* axis : {"x", "y", "z"}) add(path() + "/" + axis, rule().unit, rule().description);
    if (!length.is_constant()) add(path() + "/length", rule().unit, "length of the vector");
  }
  void name(const UncertainRotation& rotation) {
    const std::string of = path().substr(0, path().rfind(".quaternion_wxyz"));
    using Names = std::vector<const char*>;
    for (const char* one : rotation.uniform ? Names{"w", "x", "y", "z"} : Names{"x", "y", "z"})
      add(of + "/" + one, rotation.uniform ? "1" : "rad",
          rotation.uniform ? "component of the orientation's quaternion" : "component of the rotation vector");
  }
  void name(const ChosenValue&) {
    if (read_.choices_are_numbers) return add(path(), unit_of(0, form_.forms[0], 0), rule().description);
    constexpr std::size_t kShown = 20;
    std::string list;
    for (std::size_t i = 0; i < std::min(read_.choices.size(), kShown); ++i)
      list += fmt::format("{}{}: {}", i == 0 ? "" : ", ", i, shortened(flow_text(read_.choices[i])));
    add(path(), "1", "index of the value: " + list + (read_.choices.size() > kShown ? ", ..." : ""));
  }

  const ReadUncertain& read_;
  const UncertainForm& form_;
  const CaptureProblem& problem_;
  std::vector<std::vector<PathStep>> steps_;  // per path
  std::vector<PlaceRule> rules_;              // likewise
  std::vector<CampaignInput> inputs_;
};

}  // namespace

std::vector<CampaignInput> inputs_of(const ReadUncertain& uncertain, const UncertainForm& form, const Node& scenario,
                                     const CaptureProblem& problem) {
  return InputNamer(uncertain, form, scenario, problem).names();
}

std::vector<std::string> units_at(const ReadUncertain& uncertain, const UncertainForm& form, const Node& scenario,
                                  const CaptureProblem& problem) {
  return InputNamer(uncertain, form, scenario, problem).units();
}

}  // namespace grapnel
