#include "grapnel/campaign/column.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "grapnel/campaign/column_list.hpp"
#include "grapnel/problem/enumeration_names.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/problem/plan_objectives.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/verdicts.hpp"

namespace grapnel {
namespace {

// A field's number or boolean, or a component of its vector.
double number_in(const Type& type, const void* value, std::size_t component) {
  double number = NAN;
  const auto take = [&](const void* item) { number = *static_cast<const double*>(item); };
  if (type.kind == Type::Kind::list) {
    type.show_item(value, component, visitor_of(take));
  } else if (type.kind == Type::Kind::optional) {
    const auto take_item = [&](const void* item) { number = number_in(type.of(), item, component); };
    if (type.size(value) == 1) type.show_item(value, 0, visitor_of(take_item));
  } else if (type.kind == Type::Kind::real) {
    take(value);
  } else {
    number = static_cast<double>(type.whole(value));
  }
  return number;
}

// Without overlap: the run's end, if clearance was monitored until then; else NaN.
double clear_until(const CaptureResult& r) {
  for (const LedgerEntry& e : r.ledger.entries) {
    if (e.name == "clearance_violation" && !e.not_checked.empty()) return NAN;
  }
  return r.post_impact_end ? r.post_impact_end->time : r.approach_end ? r.approach_end->time : NAN;
}

void add_outcome(ColumnList& list) {
  list.add("captured", "1", "whether all grasps closed and none was lost for good; see captured/judged",
           [](const StudyCase&, const CaptureResult& r) {
             return r.grasps.empty() ? NAN : static_cast<double>(r.captured());
           });
  list.add("captured/judged", "1",
           "whether envelopes were evaluated; 0: the capture is assumed, an end-effector has no envelope",
           [](const StudyCase&, const CaptureResult& r) {
             return r.grasps.empty() ? NAN : double(r.capture_verdict() != Captured::assumed);
           });
}

void add_impact(ColumnList& list) {
  const FindIn<ImpactReport> first = [](const CaptureResult& r) { return r.impact(); };
  list.field("base/velocity_change", "base_velocity_change", first);
  list.field("base/angular_velocity_change", "base_angular_velocity_change", first);
  for (const char* key : {"kinetic_energy_before", "kinetic_energy_after", "rows", "rank"}) list.field(key, key, first);
}

void add_joint(const CaptureProblem& problem, const std::string& joint, const AxisUnits& units, ColumnList& list) {
  list.add("joints/" + joint + "/position", units.position, "joint position at the capture, planned or given",
           [joint](const StudyCase&, const CaptureResult& r) {
             if (!r.plan) return double(NAN);
             const auto at = std::find(r.plan->joints.begin(), r.plan->joints.end(), joint) - r.plan->joints.begin();
             return at < std::ssize(r.plan->final_position) ? r.plan->final_position[at] : NAN;
           });
  if (problem.grasps.empty()) return;  // no impact
  list.add("joints/" + joint + "/velocity_change", units.rate, "change of the joint rate in the impact",
           [joint](const StudyCase&, const CaptureResult& r) {
             if (!r.impact()) return double(NAN);
             const auto& names = r.impact()->joint_names;
             const auto at = std::find(names.begin(), names.end(), joint) - names.begin();
             return at < std::ssize(r.impact()->joint_velocity_change) ? r.impact()->joint_velocity_change[at] : NAN;
           });
  list.add("joints/" + joint + "/driving_impulse", units.impulse, "impulse that the joint transmits along its axis",
           [joint](const StudyCase&, const CaptureResult& r) {
             if (!r.impact()) return double(NAN);
             for (const JointImpulse& one : r.impact()->joints) {
               if (one.joint == joint) return one.along_axis;
             }
             return double(NAN);
           });
}

void add_joints(const CaptureProblem& problem, ColumnList& list) {
  for (const BodyDescription& body : problem.robot.bodies) {
    const JointDescription& joint = body.joint;
    if (has_one_axis(joint.type) && !yields(joint)) add_joint(problem, joint.name, axis_units(joint.type), list);
  }
}

// Each term of a weighted objective.
void add_plan(const CaptureProblem& problem, ColumnList& list) {
  if (!problem.approach || !problem.approach->plan || !problem.approach->plan->weights) return;
  list.add("plan/objective", "1", "objective of the plan", [](const StudyCase&, const CaptureResult& r) {
    return r.plan && r.plan->found ? r.plan->objective_value : NAN;
  });
  for (const PlanObjective& one : kPlanObjectives) {
    const std::string name = name_of(one.objective);
    list.add("plan/" + name, one.unit, std::string(one.description) + "; NaN: without a weight",
             [name](const StudyCase&, const CaptureResult& r) {
               if (!r.plan) return double(NAN);
               for (const PlanTerm& term : r.plan->terms) {
                 if (term.name == name) return term.value;
               }
               return double(NAN);
             });
  }
}

void add_conservation_checks(ColumnList& list) {
  list.add(std::string(kConservationColumn), "1", "whether momentum and energy stayed within their bounds",
           [](const StudyCase&, const CaptureResult& r) {
             return r.status == CaptureStatus::completed ? double(r.ledger.pass()) : NAN;
           });
  list.add(
      "ledger/feasible", "1",
      "whether joints stayed within their limits and bodies kept their clearance; NaN: not checked, or only in part",
      [](const StudyCase&, const CaptureResult& r) {
        const Verdict verdict = r.ledger.feasibility();
        if (r.status != CaptureStatus::completed || verdict == Verdict::not_checked) return double(NAN);
        return double(verdict == Verdict::yes);
      });
  list.add("valid_until", "s", "start of the first overlap, else the run's end; NaN: clearance not checked",
           [](const StudyCase&, const CaptureResult& r) {
             if (r.status != CaptureStatus::completed) return double(NAN);
             return r.valid_until ? *r.valid_until : clear_until(r);
           });
}

}  // namespace

double number_in(const Field& field, const void* owner, std::size_t component) {
  double number = NAN;
  const auto take = [&](const void* value) { number = number_in(field.type(), value, component); };
  field.show(owner, visitor_of(take));
  return number;
}

template <>
const Type& type_of<Column>() {
  static constexpr Field fields[] = {
      field<&Column::name>("name", "name of the column, grouped by `/`"),
      field<&Column::unit>("unit", "`1` for counts, ratios and yes (1) or no (0)"),
      field<&Column::description>("description", "meaning of the number"),
  };
  static constexpr Type type = structure<Column>("Column", "a stored number of every case.", fields);
  return type;
}

CaptureDetail detail_of(std::span<const Column> columns) {
  const bool loads = std::any_of(columns.begin(), columns.end(), [](const Column& c) { return c.needs_loads; });
  return loads ? CaptureDetail::columns_and_loads : CaptureDetail::columns;
}

std::vector<Column> standard_columns(const CaptureProblem& problem, bool with_motion_afterwards) {
  ColumnList list;
  // Without grasps there is no capture.
  if (!problem.grasps.empty()) {
    add_outcome(list);
    add_grasp_columns(problem, list);
    add_impact(list);
  }
  add_joints(problem, list);
  add_plan(problem, list);
  list.add_defaults(load_columns(problem, with_motion_afterwards));
  if (is_rated(problem)) add_speed_limits(problem, list);
  add_conservation_checks(list);
  if (with_motion_afterwards) add_motion_columns(problem, list);
  return list.take();
}

namespace {

// Quantities that require observation of every step, as loads do.
std::vector<Column> control_columns(const CaptureProblem& problem) {
  std::vector<Column> columns;
  columns.push_back({"stable", "1", "whether control is stable; 0: unstable; NaN: not evaluated",
                     [](const StudyCase&, const CaptureResult& r) {
                       const Stability verdict = stability_of(r);
                       return verdict == Stability::not_evaluated ? NAN : double(verdict == Stability::stable);
                     },
                     true, false});
  const auto saturated = [&](const std::string& name, const std::string& words, SaturationReport::Actuator actuator,
                             const std::string& joint) {
    columns.push_back({name, "s", words,
                       [actuator, joint](const StudyCase&, const CaptureResult& r) {
                         double longest = r.status == CaptureStatus::completed ? 0 : NAN;
                         for (const SaturationReport& s : r.saturation) {
                           if (s.actuator == actuator && (joint.empty() || s.name == joint))
                             longest = std::fmax(longest, s.duration);
                         }
                         return longest;
                       },
                       true, false});
  };
  for (const ThrusterSetup& thruster : problem.robot.thrusters)
    saturated("thrusters/" + thruster.name + "/saturated", "time on while delivering less than commanded",
              SaturationReport::Actuator::thruster, thruster.name);
  for (const BodyDescription& body : problem.robot.bodies) {
    const JointDescription& joint = body.joint;
    if (has_one_axis(joint.type) && !yields(joint) && std::isfinite(joint.limits.effort))
      saturated("joints/" + joint.name + "/saturated", "time of the drive at its effort limit",
                SaturationReport::Actuator::joint, joint.name);
  }
  if ((problem.approach && problem.approach->base_control) ||
      (problem.post_impact && problem.post_impact->base_control))
    saturated("base_control/saturated", "longest time of base control about an axis at its limit",
              SaturationReport::Actuator::base_control, "");
  return columns;
}

}  // namespace

std::vector<Column> offered_columns(const CaptureProblem& problem, bool with_motion_afterwards) {
  std::vector<Column> columns = standard_columns(problem, with_motion_afterwards);
  merge_columns(columns, load_columns(problem, with_motion_afterwards));
  if (with_motion_afterwards) merge_columns(columns, contact_columns(problem));
  if (with_motion_afterwards) merge_columns(columns, control_columns(problem));
  return columns;
}

void merge_columns(std::vector<Column>& columns, const std::vector<Column>& more) {
  std::set<std::string> known;
  for (const Column& column : columns) known.insert(column.name);
  for (const Column& column : more) {
    if (known.insert(column.name).second) columns.push_back(column);
  }
}

bool column_matches(std::string_view pattern, std::string_view name) {
  while (true) {
    const std::size_t wanted = std::min(pattern.find('/'), pattern.size()),
                      given = std::min(name.find('/'), name.size());
    if (pattern.substr(0, wanted) != "*" && pattern.substr(0, wanted) != name.substr(0, given)) return false;
    if (wanted == pattern.size()) return true;
    if (given == name.size()) return false;
    pattern.remove_prefix(wanted + 1), name.remove_prefix(given + 1);
  }
}

}  // namespace grapnel
