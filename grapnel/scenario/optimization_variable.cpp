#include "grapnel/scenario/optimization_variable.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "grapnel/scenario/read_study_axis.hpp"
#include "grapnel/scenario/reader.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

constexpr double kAcross = 1e-6;  // cosine of the angle between u and v

void read_range(const Node& node, SearchedVariable& variable, FaultList& faults) {
  variable.from_mark = part(node, "from").mark;
  variable.to_mark = part(node, "to").mark;
  variable.from = number_at(node, "from").value_or(0);
  variable.to = number_at(node, "to").value_or(variable.from + 1);
  if (variable.from < variable.to && std::isfinite(variable.to - variable.from)) return;
  if (!number_of(part(node, "from")) || !number_of(part(node, "to"))) return;
  faults.add(variable.from_mark, fmt::format("{}: 'from' must be less than 'to', and both finite", variable.place));
}

void expect_name(const std::string& name, const Mark& mark, const std::string& place, bool of_grasp,
                 const CaptureProblem& base, FaultList& faults) {
  std::vector<std::string> names;
  if (of_grasp) {
    for (const GraspSetup& grasp : base.grasps) names.push_back(grasp.end_effector);
  } else {
    for (const TargetSetup& target : base.targets) names.push_back(target.name);
  }
  if (name.empty() || std::find(names.begin(), names.end(), name) != names.end()) return;
  faults.add(mark, fmt::format("unknown {} {} in {}{}", of_grasp ? "grasp" : "target", in_quotes(name), place,
                               suggestion(name, names, of_grasp ? "end-effectors" : "targets")));
}

void read_quantity(const Node& node, SearchedVariable& variable, const CaptureProblem* base, FaultList& faults) {
  variable.kind = SearchedVariable::Kind::quantity;
  const ReadAxis axis = read_study_axis(node, variable.place, faults);
  if (!axis.quantity) return;
  variable.quantity = *axis.quantity;
  variable.name = axis.shown.name;
  variable.unit = axis.shown.unit;
  variable.in_degrees = axis.shown.unit.starts_with("deg");
  if (base)
    expect_name(variable.quantity.of, axis.of_mark, variable.place, info(variable.quantity.kind).of_grasp, *base,
                faults);
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

void read_patch(const Node& node, SearchedVariable& variable, const CaptureProblem* base, FaultList& faults) {
  variable.kind = SearchedVariable::Kind::patch;
  variable.name = text_at(node, "patch");
  variable.unit = "m";
  ContactPatch& patch = variable.patch;
  const std::size_t before = faults.size();
  patch.u = unit_vector_at(node, "u", variable.place, faults);
  patch.v = unit_vector_at(node, "v", variable.place, faults);
  const bool both = vector_at(node, "u") && vector_at(node, "v");
  if (both && faults.size() == before && std::abs(dot(patch.u, patch.v)) > kAcross)
    faults.add(part(node, "v").mark, fmt::format("{}.v must be perpendicular to u", variable.place));
  patch.is_disc = node.find("radius") != nullptr;
  patch.half_width_u = patch.half_width_v = number_at(node, "radius").value_or(1);
  if (const Node& widths = part(node, "half_widths"); widths.items.size() == 2) {
    patch.half_width_u = number_of(widths.items[0]).value_or(1);
    patch.half_width_v = number_of(widths.items[1]).value_or(1);
  }
  if (base) find_patch(part(node, "patch"), variable, *base, faults);
}

}  // namespace

double SearchedVariable::in_si(double value) const { return in_degrees ? value * std::numbers::pi / 180 : value; }

SearchedVariable read_searched_variable(const Node& node, const std::string& place, const CaptureProblem* base,
                                        FaultList& faults) {
  SearchedVariable variable;
  variable.place = place;
  variable.mark = node.mark;
  if (node.find("patch")) {
    read_patch(node, variable, base, faults);
    return variable;
  }
  read_range(node, variable, faults);
  if (node.find("quantity")) {
    read_quantity(node, variable, base, faults);
  } else if (node.find("posture")) {
    variable.kind = SearchedVariable::Kind::posture;
    variable.name = "posture";
    variable.unit = "rad";
  } else {
    variable.path = variable.name = text_at(node, "path");
    variable.path_mark = part(node, "path").mark;
  }
  return variable;
}

}  // namespace grapnel
