#include "grapnel/campaign/column.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "grapnel/problem/enumeration_names.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/problem/plan_objectives.hpp"
#include "grapnel/result/load_table.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/verdicts.hpp"

namespace grapnel {
namespace {

using Getter = std::function<double(const StudyCase&, const CaptureResult&)>;
constexpr const char* kComponents[3] = {"x", "y", "z"};

// The described structure in a result; null if it is absent.
template <class T>
using Find = std::function<const T*(const CaptureResult&)>;

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

// The impulse of an end-effector's grasp or contact, with the impact in which it occurred.
struct FoundGrasp {
  const ImpactReport* impact = nullptr;
  const GraspImpulse* grasp = nullptr;
};
FoundGrasp find_grasp(const CaptureResult& result, const std::string& end_effector) {
  for (const ImpactReport& impact : result.impacts) {
    for (const GraspImpulse& g : impact.grasps) {
      if (g.end_effector == end_effector) return {&impact, &g};
    }
  }
  return {};
}

// Outward normal in W of the surface at an end-effector's impact; zero if there is none.
Vector3d outward_normal(const StudyCase& point, const FoundGrasp& found, const std::string& end_effector) {
  const auto& grasps = point.problem.grasps;
  for (std::size_t i = 0; i < grasps.size(); ++i) {
    if (grasps[i].end_effector != end_effector) continue;
    for (const BodyMotion& target : found.impact->targets_before) {
      if (target.name == grasps[i].target)
        return -(rotation_matrix(target.quaternion_wxyz) * point.inward_normals.at(i));
    }
  }
  return Vector3d::zero();
}

// Without overlap: the run's end, if clearance was monitored until then; else NaN.
double clear_until(const CaptureResult& r) {
  for (const LedgerEntry& e : r.ledger.entries) {
    if (e.name == "clearance_violation" && !e.not_checked.empty()) return NAN;
  }
  return r.post_impact_end ? r.post_impact_end->time : r.approach_end ? r.approach_end->time : NAN;
}

// The item of a list with the name; null if there is none.
template <class T>
const T* named(const std::vector<T>& all, const std::string& name) {
  const auto at = std::ranges::find(all, name, &T::name);
  return at == all.end() ? nullptr : &*at;
}

// The state at the end of all motion; `may_be_approach`: also that of an approach without a subsequent phase.
const std::optional<PhaseEnd>& end_of_motion(const CaptureResult& r, bool may_be_approach) {
  return r.post_impact_end || !may_be_approach ? r.post_impact_end : r.approach_end;
}

class Builder {
 public:
  explicit Builder(const CaptureProblem& problem) : problem_(problem) {}

  void outcome() {
    add("captured", "1", "whether all grasps closed and none was lost for good; see captured/judged",
        [](const StudyCase&, const CaptureResult& r) {
          return r.grasps.empty() ? NAN : static_cast<double>(r.captured());
        });
    add("captured/judged", "1",
        "whether envelopes were evaluated; 0: the capture is assumed, an end-effector has no envelope",
        [](const StudyCase&, const CaptureResult& r) {
          return r.grasps.empty() ? NAN : double(r.capture_verdict() != Captured::assumed);
        });
  }

  void grasps() {
    for (const GraspSetup& grasp : problem_.grasps) {
      closing_columns(grasp.end_effector);
      grasp_columns(grasp.end_effector);
    }
  }

  void impact() {
    const Find<ImpactReport> first = [](const CaptureResult& r) { return r.impact(); };
    field("base/velocity_change", "base_velocity_change", first);
    field("base/angular_velocity_change", "base_angular_velocity_change", first);
    for (const char* key : {"kinetic_energy_before", "kinetic_energy_after", "rows", "rank"}) field(key, key, first);
  }

  void joints() {
    for (const BodyDescription& body : problem_.robot.bodies) {
      const JointDescription& joint = body.joint;
      if (has_one_axis(joint.type) && !yields(joint)) joint_columns(joint.name, axis_units(joint.type));
    }
  }

  // Each term of a weighted objective.
  void plan() {
    if (!problem_.approach || !problem_.approach->plan || !problem_.approach->plan->weights) return;
    add("plan/objective", "1", "objective of the plan", [](const StudyCase&, const CaptureResult& r) {
      return r.plan && r.plan->found ? r.plan->objective_value : NAN;
    });
    for (const PlanObjective& one : kPlanObjectives) {
      const std::string name = name_of(one.objective);
      add("plan/" + name, one.unit, std::string(one.description) + "; NaN: without a weight",
          [name](const StudyCase&, const CaptureResult& r) {
            if (!r.plan) return double(NAN);
            for (const PlanTerm& term : r.plan->terms) {
              if (term.name == name) return term.value;
            }
            return double(NAN);
          });
    }
  }

  void conservation_checks() {
    add(std::string(kConservationColumn), "1", "whether momentum and energy stayed within their bounds",
        [](const StudyCase&, const CaptureResult& r) {
          return r.status == CaptureStatus::completed ? double(r.ledger.pass()) : NAN;
        });
    add("ledger/feasible", "1",
        "whether joints stayed within their limits and bodies kept their clearance; NaN: not checked, or only in part",
        [](const StudyCase&, const CaptureResult& r) {
          const Verdict verdict = r.ledger.feasibility();
          if (r.status != CaptureStatus::completed || verdict == Verdict::not_checked) return double(NAN);
          return double(verdict == Verdict::yes);
        });
    add("valid_until", "s", "start of the first overlap, else the run's end; NaN: clearance not checked",
        [](const StudyCase&, const CaptureResult& r) {
          if (r.status != CaptureStatus::completed) return double(NAN);
          return r.valid_until ? *r.valid_until : clear_until(r);
        });
  }

  void ratings(bool with_motion) {
    for (Column& column : load_columns(problem_, with_motion)) {
      if (column.by_default) columns_.push_back(std::move(column));
    }
    if (!is_rated(problem_)) return;
    for (const GraspSetup& grasp : problem_.grasps) {
      const std::string& e = grasp.end_effector;
      const Find<SpeedLimit> limit = [e](const CaptureResult& r) -> const SpeedLimit* {
        const FoundGrasp found = find_grasp(r, e);
        if (!found.impact) return nullptr;
        for (const SpeedLimit& one : found.impact->speed_limits) {
          if (one.end_effector == e) return &one;
        }
        return nullptr;
      };
      field("grasps/" + e + "/speed_factor", "factor", limit);
      field("grasps/" + e + "/largest_speed", "largest_speed", limit);
    }
  }

  void motion_afterwards() {
    const bool without_grasps = problem_.grasps.empty();
    const Find<BodyMotion> base = [without_grasps](const CaptureResult& r) {
      const std::optional<PhaseEnd>& last = end_of_motion(r, without_grasps);
      return last ? &last->base : nullptr;
    };
    field("end/base/velocity", "velocity", base);
    field("end/base/angular_velocity", "angular_velocity", base);
    if (without_grasps) posture_at_end();
    if (problem_.post_impact.size() > 1 || problem_.post_impact.any([](const auto& p) { return p.until.has_value(); }))
      phases();
    if (problem_.post_impact.any([](const auto& p) { return p.detumble.has_value(); })) detumbling();
    if (problem_.post_impact.any([](const auto& p) { return p.at_rest.has_value(); })) rest();
    if (!problem_.robot.wheels.empty()) wheels();
    if (!problem_.robot.thrusters.empty()) thrusters();
    if (!problem_.robot.gyros.empty()) gyros();
    add("clearance/minimum", "m", "minimum distance of monitored bodies; negative: depth of overlap",
        [](const StudyCase&, const CaptureResult& r) {
          double least = NAN;
          for (const MinimumClearance& one : r.clearance) least = std::fmin(least, one.distance);
          return least;
        });
    for (Column& column : contact_columns(problem_)) {
      if (column.by_default) columns_.push_back(std::move(column));
    }
    for (Column& column : stage_columns(problem_)) columns_.push_back(std::move(column));
  }

  // Final state of a simulation without a capture.
  void posture_at_end() {
    for (const BodyDescription& body : problem_.robot.bodies) {
      const JointDescription& joint = body.joint;
      if (!has_one_axis(joint.type) || yields(joint)) continue;
      const auto value = [name = joint.name](auto values) {
        return [name, values](const StudyCase&, const CaptureResult& r) {
          const std::optional<PhaseEnd>& last = end_of_motion(r, true);
          if (!last) return double(NAN);
          const auto at = std::find(last->joints.names.begin(), last->joints.names.end(), name);
          return at == last->joints.names.end() ? double(NAN) : values(*last)[at - last->joints.names.begin()];
        };
      };
      const AxisUnits units = axis_units(joint.type);
      add("end/joints/" + joint.name + "/position", units.position, "of the joint at the end",
          value([](const PhaseEnd& end) -> const auto& { return end.joints.position; }));
      add("end/joints/" + joint.name + "/velocity", units.rate, "of the joint at the end",
          value([](const PhaseEnd& end) -> const auto& { return end.joints.velocity; }));
    }
    attitude_error();
  }

  // If the last phase states an attitude.
  void attitude_error() {
    const auto desired = [](const CaptureProblem& problem) -> const Rotationd* {
      const std::optional<BaseControlSetup>* control = nullptr;
      if (problem.approach) control = &problem.approach->base_control;
      if (problem.post_impact) control = &problem.post_impact.back().base_control;
      return control && *control && (*control)->R_WD ? &*(*control)->R_WD : nullptr;
    };
    if (!desired(problem_)) return;
    add("end/base/attitude_error", "rad", "angle between the base's attitude at the end and the specified attitude",
        [desired](const StudyCase& point, const CaptureResult& r) {
          const std::optional<PhaseEnd>& last = end_of_motion(r, true);
          const Rotationd* R_WD = desired(point.problem);
          return last && R_WD ? rotation_angle(rotation_matrix(last->base.quaternion_wxyz) * transpose(*R_WD)) : NAN;
        });
  }

  // Each phase under its name; NaN if the run ended before it.
  void phases() {
    for (std::size_t i = 0; i < problem_.post_impact.size(); ++i) {
      const std::string name = phase_name(problem_, i);
      const auto of_phase = [name](auto value) {
        return [name, value](const StudyCase&, const CaptureResult& r) {
          for (const MotionPhaseReport& phase : r.phases) {
            if (phase.name == name) return static_cast<double>(value(phase));
          }
          return double(NAN);
        };
      };
      using P = MotionPhaseReport;
      const std::string path = "phases/" + name + "/";
      add(path + "duration", "s", "of the phase", of_phase([](const P& p) { return p.duration(); }));
      add(path + "condition_met", "1", "whether its `until` condition was met before the end of its duration",
          of_phase([](const P& p) { return p.ended == P::End::condition; }));
      const Find<BodyMotion> base = [name](const CaptureResult& r) -> const BodyMotion* {
        for (const MotionPhaseReport& phase : r.phases) {
          if (phase.name == name) return phase.at_end ? &phase.at_end->base : nullptr;
        }
        return nullptr;
      };
      field(path + "base/angular_velocity", "angular_velocity", base);
    }
  }

  void detumbling() {
    const auto report = [](auto value) {
      return [value](const StudyCase&, const CaptureResult& r) {
        return r.detumbling ? static_cast<double>(value(*r.detumbling)) : NAN;
      };
    };
    using D = DetumblingReport;
    add("detumbling/at_rest", "1", "whether the held target came to rest",
        report([](const D& d) { return d.ended == LawEnd::at_rest; }));
    add("detumbling/duration", "s", "duration of the detumbling, for any end",
        report([](const D& d) { return d.end - d.begin; }));
    const Find<D> found = [](const CaptureResult& r) { return r.detumbling ? &*r.detumbling : nullptr; };
    for (const char* key : {"largest_torque", "least_scale"}) field(std::string("detumbling/") + key, key, found);
  }

  void rest() {
    const Find<RestReport> rest = [](const CaptureResult& r) { return r.rest ? &*r.rest : nullptr; };
    for (const char* key : {"at_rest", "time", "angular_velocity"}) field(std::string("rest/") + key, key, rest);
  }

  void wheels() {
    bool any_limit = false;
    for (const WheelSetup& wheel : problem_.robot.wheels) {
      field("wheels/" + wheel.name + "/rate", "rate_after",
            Find<WheelReport>([name = wheel.name](const CaptureResult& r) { return named(r.wheels, name); }));
      if (!std::isfinite(wheel.rate)) continue;
      any_limit = true;
      saturated("wheels/" + wheel.name, "time at its largest rate", SaturationReport::Actuator::wheel, wheel.name);
    }
    if (any_limit)
      saturated("wheels", "longest time of a wheel at its largest rate", SaturationReport::Actuator::wheel);
  }

  void thrusters() {
    for (const ThrusterSetup& thruster : problem_.robot.thrusters) {
      field("thrusters/" + thruster.name + "/duty", "duty",
            Find<ThrusterReport>([name = thruster.name](const CaptureResult& r) {
              return r.thrusters ? named(r.thrusters->each, name) : nullptr;
            }));
    }
    field("thrusters/propellant", "propellant",
          Find<ThrustersReport>([](const CaptureResult& r) { return r.thrusters ? &*r.thrusters : nullptr; }));
    add("thrusters/plume", "s", "duration of firing with a body in the plume, over all thrusters and bodies",
        [](const StudyCase&, const CaptureResult& r) {
          double time = 0;
          for (const PlumeHazard& hazard : r.thrusters.value_or(ThrustersReport{}).hazards) time += hazard.duration;
          return time;
        });
  }

  void gyros() {
    for (const MomentGyroSetup& gyro : problem_.robot.gyros)
      saturated("gyros/" + gyro.name, "time of the gimbal at its largest rate or torque",
                SaturationReport::Actuator::gyro, gyro.name);
    const Find<GyrosReport> all = [](const CaptureResult& r) { return r.gyros ? &*r.gyros : nullptr; };
    for (const char* key : {"largest_torque_lacking", "least_singularity_measure"})
      field(std::string("gyros/") + key, key, all);
    add("gyros/near_singularity", "s", "time near a singularity while a torque was commanded",
        [](const StudyCase&, const CaptureResult& r) {
          double time = 0;
          for (const SingularityHazard& hazard : r.gyros.value_or(GyrosReport{}).hazards) time += hazard.duration();
          return time;
        });
  }

  std::vector<Column> take() { return std::move(columns_); }

 private:
  void add(std::string name, std::string unit, std::string description, Getter value) {
    columns_.push_back({std::move(name), std::move(unit), std::move(description), std::move(value)});
  }

  // Longest saturation, and start of the first, of one actuator or of all of a kind. Torques of wheels require
  // observation of every step and are not included.
  void saturated(const std::string& where, const std::string& words, SaturationReport::Actuator actuator,
                 const std::string& name = {}) {
    const auto is_meant = [actuator, name](const SaturationReport& s) {
      const bool observed =
          actuator != SaturationReport::Actuator::wheel || s.quantity == SaturationReport::Quantity::rate;
      return s.actuator == actuator && observed && (name.empty() || s.name == name);
    };
    add(where + "/saturated", "s", words, [is_meant](const StudyCase&, const CaptureResult& r) {
      double longest = r.status == CaptureStatus::completed ? 0 : NAN;
      for (const SaturationReport& s : r.saturation) {
        if (is_meant(s)) longest = std::fmax(longest, s.duration);
      }
      return longest;
    });
    add(where + "/first_saturated", "s", "start of the first saturation; NaN: never",
        [is_meant](const StudyCase&, const CaptureResult& r) {
          double first = NAN;
          for (const SaturationReport& s : r.saturation) {
            if (is_meant(s)) first = std::fmin(first, s.first_time);
          }
          return first;
        });
  }

  // A number, a boolean, or the components of a vector, with the unit and text of its description.
  template <class T>
  void field(const std::string& name, std::string_view key, const Find<T>& find) {
    const Field& described = *field_named(type_of<T>(), key);
    const bool is_vector = described.type().kind == Type::Kind::list;
    for (std::size_t k = 0; k < (is_vector ? 3 : 1); ++k) {
      add(is_vector ? name + "/" + kComponents[k] : name, std::string(described.unit.empty() ? "1" : described.unit),
          std::string(described.text), [find, &described, k](const StudyCase&, const CaptureResult& r) {
            const T* owner = find(r);
            return owner ? number_in(described, owner, k) : NAN;
          });
    }
  }

  void grasp_number(const std::string& e, const std::string& name, const char* unit, const char* description,
                    double (*get)(const GraspImpulse&)) {
    add("grasps/" + e + "/" + name, unit, description, [e, get](const StudyCase&, const CaptureResult& r) {
      const FoundGrasp found = find_grasp(r, e);
      return found.grasp ? get(*found.grasp) : NAN;
    });
  }

  // Deviations of the end-effector from its grasp point at the closing time, for closed and open grasps.
  void closing_columns(const std::string& e) {
    const Find<GraspOutcome> outcome = [e](const CaptureResult& r) -> const GraspOutcome* {
      for (const GraspOutcome& one : r.grasps) {
        if (one.end_effector == e) return &one;
      }
      return nullptr;
    };
    const std::string grasp = "grasps/" + e + "/";
    add(grasp + "captured", "1", "whether this grasp closed and was not lost",
        [outcome](const StudyCase&, const CaptureResult& r) {
          const GraspOutcome* found = outcome(r);
          return found ? double(found->captured) : NAN;
        });
    field(grasp + "position_error", "distance", outcome);
    field(grasp + "angle_error", "angle", outcome);
    field(grasp + "closing_speed", "velocity", outcome);
    field(grasp + "closing_angular_velocity", "angular_velocity", outcome);
    tolerance_columns(e);
    hold_columns(e);
  }

  // Load, slips and losses of a grasp with limits.
  void hold_columns(const std::string& e) {
    const auto grasp = std::ranges::find(problem_.grasps, e, &GraspSetup::end_effector);
    if (grasp == problem_.grasps.end() || !grasp->holds) return;
    const std::string name = "grasps/" + e + "/";
    add(name + "load_used", "1", "largest load over the limits of `holds`; at 1 the grasp opens or slips",
        [e](const StudyCase&, const CaptureResult& r) {
          for (const GraspOutcome& one : r.grasps) {
            if (one.end_effector == e && one.largest_load) return *one.largest_load;
          }
          return double(NAN);
        });
    add(name + "lost", "s", "time of the first loss under load; NaN: never lost",
        [e](const StudyCase&, const CaptureResult& r) {
          const auto loss = std::ranges::find(r.losses, e, &LossReport::end_effector);
          return loss == r.losses.end() ? NAN : loss->time;
        });
    add(name + "losses", "1", "number of losses under load", [e](const StudyCase&, const CaptureResult& r) {
      return static_cast<double>(std::ranges::count(r.losses, e, &LossReport::end_effector));
    });
    if (grasp->holds->slips()) slip_columns(e);
  }

  // Sums over the slips of a grasp.
  void slip_columns(const std::string& e) {
    const auto sum = [e](double SlipReport::*part) {
      return [e, part](const StudyCase&, const CaptureResult& r) {
        double total = 0;
        for (const SlipReport& slip : r.slips) total += slip.end_effector == e ? slip.*part : 0;
        return total;
      };
    };
    const std::string name = "grasps/" + e + "/slip";
    add(name + "s", "1", "number of slips", [e](const StudyCase&, const CaptureResult& r) {
      return static_cast<double>(std::ranges::count(r.slips, e, &SlipReport::end_effector));
    });
    add(name + "_time", "s", "onset of the first slip; NaN: it did not slip",
        [e](const StudyCase&, const CaptureResult& r) {
          const auto slip = std::ranges::find(r.slips, e, &SlipReport::end_effector);
          return slip == r.slips.end() ? NAN : slip->time;
        });
    add(name + "_distance", "m", "path of the gripper relative to the target in all slips", sum(&SlipReport::distance));
    add(name + "_angle", "rad", "the same for its rotation", sum(&SlipReport::angle));
    add(name + "_energy", "J", "energy dissipated in all slips", sum(&SlipReport::energy));
  }

  // Used share of each tolerance of the envelope.
  void tolerance_columns(const std::string& e) {
    struct Tolerance {
      const char* name;
      double CaptureEnvelope::*allowed;
      double GraspOutcome::*found;
    };
    static constexpr Tolerance kTolerances[] = {
        {"position", &CaptureEnvelope::position, &GraspOutcome::distance},
        {"angle", &CaptureEnvelope::angle, &GraspOutcome::angle},
        {"velocity", &CaptureEnvelope::velocity, &GraspOutcome::velocity},
        {"angular_velocity", &CaptureEnvelope::angular_velocity, &GraspOutcome::angular_velocity}};
    const CaptureEnvelope* envelope = envelope_of(problem_, e);
    for (const Tolerance& tolerance : kTolerances) {
      if (envelope == nullptr || envelope->*tolerance.allowed == CaptureEnvelope::kAny) continue;
      add(std::string("grasps/") + e + "/tolerance_used/" + tolerance.name, "1",
          "deviation over the tolerance of the envelope; above 1 the grasp misses",
          [e, tolerance](const StudyCase& point, const CaptureResult& r) {
            const CaptureEnvelope* of_case = envelope_of(point.problem, e);
            for (const GraspOutcome& grasp : r.grasps) {
              if (of_case != nullptr && grasp.end_effector == e)
                return grasp.*tolerance.found / (of_case->*tolerance.allowed);
            }
            return double(NAN);
          });
    }
  }
  static const CaptureEnvelope* envelope_of(const CaptureProblem& problem, const std::string& e) {
    for (const EndEffectorSetup& one : problem.robot.end_effectors) {
      if (one.name == e) return one.envelope ? &*one.envelope : nullptr;
    }
    return nullptr;
  }

  void grasp_columns(const std::string& e) {
    const Find<GraspImpulse> grasp = [e](const CaptureResult& r) { return find_grasp(r, e).grasp; };
    const auto column = [&](const std::string& name, std::string_view key) {
      field("grasps/" + e + "/" + name, key, grasp);
    };
    column("impulse", "impulse");
    column("impulse_magnitude", "impulse_magnitude");
    normal_and_tangential(e);
    column("angular_impulse", "angular_impulse");
    grasp_number(e, "angular_impulse_magnitude", "N m s", "magnitude of the angular impulse",
                 [](const GraspImpulse& g) { return norm(g.angular_impulse); });
    column("mean_force", "mean_force");
    grasp_number(e, "determined", "1", "whether every component is unique, without self-stress",
                 [](const GraspImpulse& g) {
                   return double(std::all_of(g.determined.begin(), g.determined.end(), [](bool b) { return b; }));
                 });
    column("gap", "gap");
    column("gap_angle", "gap_angle");
    column("relative_velocity", "relative_velocity_before");
    grasp_number(e, "relative_speed", "m/s", "magnitude of the relative velocity",
                 [](const GraspImpulse& g) { return norm(g.relative_velocity_before); });
    column("relative_angular_velocity", "relative_angular_velocity_before");
    if (problem_.impact && impact_law(*problem_.impact).in_time) {
      const Find<ForceProfile> profile = [grasp](const CaptureResult& r) -> const ForceProfile* {
        const GraspImpulse* found = grasp(r);
        return found && found->profile ? &*found->profile : nullptr;
      };
      field("grasps/" + e + "/peak_force", "peak_force", profile);
    }
  }

  void normal_and_tangential(const std::string& e) {
    add("grasps/" + e + "/impulse_normal", "N s",
        "part of the impulse along the outward normal of the grasp point: positive pushes the robot away",
        [e](const StudyCase& point, const CaptureResult& r) {
          const FoundGrasp found = find_grasp(r, e);
          if (!found.grasp) return double(NAN);
          const Vector3d n = outward_normal(point, found, e);
          return norm(n) > 0 ? dot(n, found.grasp->impulse) : NAN;
        });
    add("grasps/" + e + "/impulse_tangential", "N s", "magnitude of the tangential impulse",
        [e](const StudyCase& point, const CaptureResult& r) {
          const FoundGrasp found = find_grasp(r, e);
          if (!found.grasp) return double(NAN);
          const Vector3d n = outward_normal(point, found, e);
          return norm(n) > 0 ? norm(found.grasp->impulse - dot(n, found.grasp->impulse) * n) : NAN;
        });
  }

  void joint_columns(const std::string& joint, const AxisUnits& units) {
    add("joints/" + joint + "/position", units.position, "joint position at the capture, planned or given",
        [joint](const StudyCase&, const CaptureResult& r) {
          if (!r.plan) return double(NAN);
          const auto at = std::find(r.plan->joints.begin(), r.plan->joints.end(), joint) - r.plan->joints.begin();
          return at < std::ssize(r.plan->final_position) ? r.plan->final_position[at] : NAN;
        });
    if (problem_.grasps.empty()) return;  // no impact
    add("joints/" + joint + "/velocity_change", units.rate, "change of the joint rate in the impact",
        [joint](const StudyCase&, const CaptureResult& r) {
          if (!r.impact()) return double(NAN);
          const auto& names = r.impact()->joint_names;
          const auto at = std::find(names.begin(), names.end(), joint) - names.begin();
          return at < std::ssize(r.impact()->joint_velocity_change) ? r.impact()->joint_velocity_change[at] : NAN;
        });
    add("joints/" + joint + "/driving_impulse", units.impulse, "impulse that the joint transmits along its axis",
        [joint](const StudyCase&, const CaptureResult& r) {
          if (!r.impact()) return double(NAN);
          for (const JointImpulse& one : r.impact()->joints) {
            if (one.joint == joint) return one.along_axis;
          }
          return double(NAN);
        });
  }

  const CaptureProblem& problem_;
  std::vector<Column> columns_;
};

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
  Builder build(problem);
  // Without grasps there is no capture.
  if (!problem.grasps.empty()) {
    build.outcome();
    build.grasps();
    build.impact();
  }
  build.joints();
  build.plan();
  build.ratings(with_motion_afterwards);
  build.conservation_checks();
  if (with_motion_afterwards) build.motion_afterwards();
  return build.take();
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

namespace {

double least_rating(const LoadRating& r) {
  return std::min({r.force, r.moment, r.impulse, r.angular_impulse, r.driving, r.driving_impulse});
}

// One load of a joint, an end-effector or the base control.
struct LoadQuantity {
  std::string of, name, unit;
  bool rated;    // in the robot file
  bool limited;  // by what a drive can exert
};

// Bodies without load have no record in a result (LoadMonitor): in a completed run their load is zero.
bool bore_nothing(const CaptureResult& result) { return result.status == CaptureStatus::completed; }

// The load with the largest magnitude over all phases, or the smallest margin.
const PeakLoad* largest(const CaptureResult& result, const std::string& of, const std::string& quantity) {
  const PeakLoad* found = nullptr;
  for (const PeakLoad& load : result.peak_loads) {
    if (load.of == of && load.quantity == quantity && (!found || !(load.peak <= found->peak))) found = &load;
  }
  return found;
}
double least_margin(const CaptureResult& result, const std::string& of, const std::string& quantity) {
  double least = NAN;
  for (const PeakLoad& load : result.peak_loads) {
    if (load.of == of && load.quantity == quantity && std::isfinite(load.rating))
      least = std::fmin(least, load.margin());
  }
  if (std::isnan(least) && bore_nothing(result)) return 1;
  return least;
}

void add_quantities(const std::string& of, const LoadRating& rating, const AxisUnits* axis, double effort,
                    std::vector<LoadQuantity>& all) {
  const auto add = [&](const char* name, const char* unit, double limit, bool limited = false) {
    all.push_back({of, name, unit, std::isfinite(limit), limited});
  };
  add("force", "N", rating.force);
  add("moment", "N m", rating.moment);
  add("impulse", "N s", rating.impulse);
  add("angular_impulse", "N m s", rating.angular_impulse);
  if (!axis) return;
  add("driving", axis->effort, rating.driving, std::isfinite(effort));
  add("driving_impulse", axis->impulse, rating.driving_impulse);
}

std::vector<LoadQuantity> load_quantities(const CaptureProblem& problem) {
  const LoadRating none;
  std::vector<LoadQuantity> all;
  for (const BodyDescription& body : problem.robot.bodies) {
    if (body.name == problem.robot.base) continue;
    const auto rating = std::find_if(problem.robot.ratings.begin(), problem.robot.ratings.end(),
                                     [&](const auto& r) { return r.first == body.joint.name; });
    const AxisUnits units = axis_units(body.joint.type);
    add_quantities(body.joint.name, rating == problem.robot.ratings.end() ? none : rating->second,
                   has_one_axis(body.joint.type) ? &units : nullptr, body.joint.limits.effort, all);
  }
  for (const EndEffectorSetup& e : problem.robot.end_effectors) add_quantities(e.name, e.rating, nullptr, NAN, all);
  // Its limit bounds the command and is not a rating.
  const bool controls_base = (problem.approach && problem.approach->base_control) ||
                             problem.post_impact.any([](const auto& p) { return p.base_control.has_value(); });
  for (int k = 0; controls_base && k < 3; ++k)
    all.push_back({"base control", std::string("driving/") + "xyz"[k], "N m", false, false});
  return all;
}

}  // namespace

bool is_rated(const CaptureProblem& problem) {
  const auto& end_effectors = problem.robot.end_effectors;
  return !problem.robot.ratings.empty() ||
         std::any_of(end_effectors.begin(), end_effectors.end(),
                     [](const EndEffectorSetup& e) { return std::isfinite(least_rating(e.rating)); });
}

std::vector<Column> load_columns(const CaptureProblem& problem, bool with_motion) {
  std::vector<Column> columns;
  bool any_limit = false;
  for (const LoadQuantity& q : load_quantities(problem)) {
    if (q.rated || (q.limited && with_motion)) {
      any_limit = true;
      columns.push_back({"margins/" + q.of + "/" + q.name, "1",
                         with_motion ? "1 - load over rating, the worst of all phases"
                                     : "1 - load over rating, the worst of all impacts",
                         [q](const StudyCase&, const CaptureResult& r) { return least_margin(r, q.of, q.name); },
                         with_motion, q.rated});
    }
    if (!with_motion) continue;
    columns.push_back({"loads/" + q.of + "/" + q.name, q.unit, "largest magnitude over all phases",
                       [q](const StudyCase&, const CaptureResult& r) {
                         const PeakLoad* load = largest(r, q.of, q.name);
                         return load ? load->peak : bore_nothing(r) ? 0.0 : NAN;
                       },
                       true, false});
    columns.push_back({"load_times/" + q.of + "/" + q.name, "s", "time of the largest magnitude; NaN: the load is zero",
                       [q](const StudyCase&, const CaptureResult& r) {
                         const PeakLoad* load = largest(r, q.of, q.name);
                         return load && load->peak > 0 ? load->time : NAN;
                       },
                       true, false});
  }
  if (any_limit) {
    columns.push_back({"worst_margin", "1", "minimum of all margins",
                       [](const StudyCase&, const CaptureResult& r) {
                         const PeakLoad* worst = worst_margin(r);
                         return worst ? worst->margin() : bore_nothing(r) ? 1.0 : NAN;
                       },
                       with_motion, is_rated(problem)});
  }
  return columns;
}

}  // namespace grapnel
