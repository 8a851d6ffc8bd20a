#include "grapnel/campaign/optimization_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "grapnel/campaign/axis.hpp"
#include "grapnel/campaign/changed_scenario.hpp"
#include "grapnel/campaign/study_document.hpp"
#include "grapnel/scenario/imported_robot.hpp"
#include "grapnel/scenario/reader.hpp"
#include "grapnel/scenario/schema.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_tree.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

using VariableKind = SearchedVariable::Kind;

constexpr double kAcross = 1e-6;  // cosine of the angle between u and v

void take_range(const VariableFile& file, const Node& node, SearchedVariable& variable, FaultList& faults) {
  variable.from_mark = part(node, "from").mark;
  variable.to_mark = part(node, "to").mark;
  variable.written_unit = part(node, "from").unit != 0 ? part(node, "from").unit : part(node, "to").unit;
  variable.from = file.from.value_or(0);
  variable.to = file.to.value_or(variable.from + 1);
  if (variable.from < variable.to && std::isfinite(variable.to - variable.from)) return;
  if (!file.from || !file.to) return;
  faults.add(variable.from_mark, fmt::format("{}: 'from' must be less than 'to', and both finite", variable.place));
}

// TARGET.POINT; both may hold dots.
void find_patch(const Node& name, SearchedVariable& variable, const CaptureProblem& base, FaultList& faults) {
  std::vector<std::string> names;
  for (const TargetSetup& target : base.targets) {
    for (const GraspPoint& point : target.grasp_points) {
      names.push_back(target.name + "." + point.name);
      if (names.back() != name.text) continue;
      variable.patch.target = target.name;
      variable.patch.point = point.name;
      return;
    }
  }
  if (!name.text.empty())
    faults.add(name.mark, fmt::format("unknown grasp point {} in {}{}", in_quotes(name.text), variable.place,
                                      suggestion(name.text, names, "TARGET.POINT")));
}

void take_patch(const VariableFile& file, const Node& node, SearchedVariable& variable, const CaptureProblem* base,
                FaultList& faults) {
  variable.kind = VariableKind::patch;
  variable.name = file.patch;
  variable.unit = "m";
  ContactPatch& patch = variable.patch;
  const std::size_t before = faults.size();
  patch.u = unit_vector_at(node, "u", variable.place, faults);
  patch.v = unit_vector_at(node, "v", variable.place, faults);
  if (file.u && file.v && faults.size() == before && std::abs(dot(patch.u, patch.v)) > kAcross)
    faults.add(part(node, "v").mark, fmt::format("{}.v must be perpendicular to u", variable.place));
  patch.is_disc = file.radius.has_value();
  patch.half_width_u = patch.half_width_v = file.radius.value_or(1);
  if (file.half_widths) patch.half_width_u = (*file.half_widths)[0], patch.half_width_v = (*file.half_widths)[1];
  if (base) find_patch(part(node, "patch"), variable, *base, faults);
}

void take_quantity(const VariableFile& file, const Node& node, SearchedVariable& variable, const CaptureProblem* base,
                   FaultList& faults) {
  const ReadQuantity read = read_quantity(file, node, variable.place, faults);
  variable.kind = VariableKind::quantity;
  variable.quantity = read.quantity;
  variable.name = read.name;
  variable.unit = read.unit;
  variable.in_degrees = read.in_degrees;
  if (base)
    expect_grasp_or_target(read.quantity.of, read.of_mark, variable.place, info(read.quantity.kind).of_grasp, *base,
                           faults);
}

Change number_change(const SearchedVariable& variable, double value, const Mark& mark) {
  Change change{variable.path, variable.path_mark, {}, fmt::format("{}", value)};
  change.value.kind = Node::Kind::scalar;
  change.value.mark = mark;
  change.value.text = change.text;
  change.value.unit = variable.written_unit;
  return change;
}

}  // namespace

double SearchedVariable::in_si(double value) const { return in_degrees ? value * std::numbers::pi / 180 : value; }

SearchedVariable searched_variable(const VariableFile& file, const Node& node, const std::string& place,
                                   const CaptureProblem* base, FaultList& faults) {
  SearchedVariable variable;
  variable.place = place;
  variable.mark = node.mark;
  if (node.find("patch")) {
    take_patch(file, node, variable, base, faults);
    return variable;
  }
  take_range(file, node, variable, faults);
  if (file.quantity) {
    take_quantity(file, node, variable, base, faults);
  } else if (node.find("quantity")) {
    variable.kind = VariableKind::quantity;  // of an unknown name, which has been reported
  } else if (node.find("posture")) {
    variable.kind = VariableKind::posture;
    variable.name = "posture";
    variable.unit = "rad";
  } else {
    variable.path = variable.name = file.path;
    variable.path_mark = part(node, "path").mark;
  }
  return variable;
}

void OptimizationPoints::check(const SearchedVariable& variable, double value, const CaptureProblem& base) const {
  CaptureProblem copy = base;
  switch (variable.kind) {
    case VariableKind::path: {
      std::vector<Change> all = set;
      all.push_back(number_change(variable, value, value == variable.from ? variable.from_mark : variable.to_mark));
      load_scenario(scenario, all, files);
      return;
    }
    case VariableKind::quantity: {
      const QuantityValue one{variable.quantity, variable.in_si(value)};
      apply_quantities({&one, 1}, copy);
      return;
    }
    case VariableKind::patch:
      if (!variable.patch.point.empty())
        move_on_patch(variable.patch, variable.patch.half_width_u, variable.patch.half_width_v, copy);
      return;
    case VariableKind::posture:
      if (!base.approach || !base.approach->plan)
        throw std::invalid_argument("a posture needs approach.plan: the final configuration is given");
  }
}

void OptimizationPoints::finish(const CaptureProblem& base, FaultList& faults) {
  base_ = std::make_shared<const CaptureProblem>(base);
  for (const SearchedVariable& variable : variables) {
    if (variable.kind != VariableKind::posture) continue;
    try {
      posture = posture_space(base);
      if (posture.directions.empty())
        faults.add(variable.mark, fmt::format("{}: the grasps determine all joint values, so no posture can be varied",
                                              variable.place));
    } catch (const std::exception& error) {
      faults.add(variable.mark, fmt::format("{}: {}", variable.place, error.what()));
    }
  }
}

std::vector<OptimizationVariable> OptimizationPoints::shown(const SearchedVariable& variable) const {
  const auto ranged = [&](const std::string& name, double half_width) {
    return OptimizationVariable{name, variable.unit, -half_width, half_width, 0};
  };
  std::vector<OptimizationVariable> all;
  switch (variable.kind) {
    case VariableKind::patch:
      return {ranged(variable.name + "/u", variable.patch.half_width_u),
              ranged(variable.name + "/v", variable.patch.half_width_v)};
    case VariableKind::posture:
      for (std::size_t k = 0; k < posture.directions.size(); ++k)
        all.push_back({fmt::format("posture/{}", k + 1), variable.unit, variable.from, variable.to, 0});
      return all;
    case VariableKind::path: {
      Node now = tree(set);
      take_units(now);
      const auto present = value_at(std::move(now), variable.path);
      const double middle = (variable.from + variable.to) / 2;
      return {{variable.name, variable.unit, variable.from, variable.to,
               present ? number_of(*present).value_or(middle) : middle}};
    }
    case VariableKind::quantity:
      break;
  }
  const bool is_turn = variable.quantity.kind == QuantityKind::approach_angle ||
                       variable.quantity.kind == QuantityKind::relative_direction;
  return {{variable.name, variable.unit, variable.from, variable.to, is_turn ? 0 : (variable.from + variable.to) / 2}};
}

std::vector<Change> OptimizationPoints::changes(std::span<const double> values) const {
  std::vector<Change> all = set;
  std::size_t at = 0;
  for (const SearchedVariable& variable : variables) {
    if (variable.kind == VariableKind::path) all.push_back(number_change(variable, values[at], variable.mark));
    at += variable.kind == VariableKind::patch     ? 2
          : variable.kind == VariableKind::posture ? posture.directions.size()
                                                   : 1;
  }
  return all;
}

CaptureProblem OptimizationPoints::before_moves(std::span<const double> values) const {
  const std::vector<Change> all = changes(values);
  return all.size() == set.size() ? *base_ : load_scenario(scenario, all, files);
}

StudyCase OptimizationPoints::moved(const CaptureProblem& before, std::span<const double> values) const {
  StudyCase point{before, {}};
  std::vector<QuantityValue> quantities;
  std::size_t at = 0;
  for (const SearchedVariable& variable : variables) {
    switch (variable.kind) {
      case VariableKind::path:
        ++at;
        break;
      case VariableKind::quantity:
        quantities.push_back({variable.quantity, variable.in_si(values[at++])});
        break;
      case VariableKind::patch:
        move_on_patch(variable.patch, values[at], values[at + 1], point.problem);
        at += 2;
        break;
      case VariableKind::posture: {
        const auto mine = values.subspan(at, posture.directions.size());
        set_posture(posture, {mine.begin(), mine.end()}, point.problem);
        at += mine.size();
      }
    }
  }
  point.inward_normals = inward_normals(point.problem);
  apply_quantities(quantities, point.problem);
  preserve_normals(before, point);
  return point;
}

StudyCase OptimizationPoints::point(std::span<const double> values) const {
  return moved(before_moves(values), values);
}

Node OptimizationPoints::tree(const std::vector<Change>& changes) const {
  return changed_tree(scenario, changes, files);
}

std::string OptimizationPoints::scenario_text(std::span<const double> values, const std::filesystem::path& place,
                                              const std::string& comment) const {
  const CaptureProblem before = before_moves(values);
  return changed_scenario_text({scenario, tree(changes(values)), before}, moved(before, values).problem, place,
                               ", optimized", comment);
}

}  // namespace grapnel
