// Columns of the motion after the capture, or of a motion without one.
#include <algorithm>
#include <cmath>
#include <limits>

#include "grapnel/campaign/column_list.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/result/result_documents.hpp"

namespace grapnel {
namespace {

// The state at the end of all motion; `may_be_approach`: also that of an approach without a subsequent phase.
const std::optional<PhaseEnd>& end_of_motion(const CaptureResult& r, bool may_be_approach) {
  return r.post_impact_end || !may_be_approach ? r.post_impact_end : r.approach_end;
}

class MotionColumnBuilder {
 public:
  MotionColumnBuilder(const CaptureProblem& problem, ColumnList& list) : problem_(problem), list_(list) {}

  void add_all() {
    const bool without_grasps = problem_.grasps.empty();
    const FindIn<BodyMotion> base = [without_grasps](const CaptureResult& r) {
      const std::optional<PhaseEnd>& last = end_of_motion(r, without_grasps);
      return last ? &last->base : nullptr;
    };
    list_.field("end/base/velocity", "velocity", base);
    list_.field("end/base/angular_velocity", "angular_velocity", base);
    if (without_grasps) posture_at_end();
    if (problem_.post_impact.size() > 1 || problem_.post_impact.any([](const auto& p) { return p.until.has_value(); }))
      phases();
    if (problem_.post_impact.any([](const auto& p) { return p.detumble.has_value(); })) detumbling();
    if (problem_.post_impact.any([](const auto& p) { return p.at_rest.has_value(); })) rest();
    if (!problem_.robot.wheels.empty()) wheels();
    if (!problem_.robot.thrusters.empty()) thrusters();
    if (!problem_.robot.gyros.empty()) gyros();
    list_.add("clearance/minimum", "m", "minimum distance of monitored bodies; negative: depth of overlap",
              [](const StudyCase&, const CaptureResult& r) {
                double least = NAN;
                for (const MinimumClearance& one : r.clearance) least = std::fmin(least, one.distance);
                return least;
              });
    list_.add_defaults(contact_columns(problem_));
    list_.add_defaults(stage_columns(problem_));
  }

 private:
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
      list_.add("end/joints/" + joint.name + "/position", units.position, "of the joint at the end",
                value([](const PhaseEnd& end) -> const auto& { return end.joints.position; }));
      list_.add("end/joints/" + joint.name + "/velocity", units.rate, "of the joint at the end",
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
    list_.add(
        "end/base/attitude_error", "rad", "angle between the base's attitude at the end and the specified attitude",
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
      list_.add(path + "duration", "s", "of the phase", of_phase([](const P& p) { return p.duration(); }));
      list_.add(path + "condition_met", "1", "whether its `until` condition was met before the end of its duration",
                of_phase([](const P& p) { return p.ended == P::End::condition; }));
      const FindIn<BodyMotion> base = [name](const CaptureResult& r) -> const BodyMotion* {
        for (const MotionPhaseReport& phase : r.phases) {
          if (phase.name == name) return phase.at_end ? &phase.at_end->base : nullptr;
        }
        return nullptr;
      };
      list_.field(path + "base/angular_velocity", "angular_velocity", base);
    }
  }

  void detumbling() {
    const FindIn<LawReport> found = [](const CaptureResult& r) { return r.law(LawReport::Law::detumbling); };
    const auto report = [found](auto value) {
      return [found, value](const StudyCase&, const CaptureResult& r) {
        const LawReport* law = found(r);
        return law ? static_cast<double>(value(*law)) : NAN;
      };
    };
    list_.add("detumbling/at_rest", "1", "whether the held target came to rest",
              report([](const LawReport& law) { return law.ended == LawEnd::at_rest; }));
    list_.add("detumbling/duration", "s", "duration of the detumbling, for any end",
              report([](const LawReport& law) { return law.end - law.begin; }));
    for (const char* key : {"largest_torque", "least_scale"}) list_.field(std::string("detumbling/") + key, key, found);
  }

  void rest() {
    const FindIn<RestReport> rest = [](const CaptureResult& r) { return r.rest ? &*r.rest : nullptr; };
    for (const char* key : {"at_rest", "time", "angular_velocity"}) list_.field(std::string("rest/") + key, key, rest);
  }

  void wheels() {
    bool any_limit = false;
    for (const WheelSetup& wheel : problem_.robot.wheels) {
      list_.field("wheels/" + wheel.name + "/rate", "rate_after",
                  FindIn<WheelReport>([name = wheel.name](const CaptureResult& r) {
                    return find_item(r.wheels, name, &WheelReport::name);
                  }));
      if (!std::isfinite(wheel.rate)) continue;
      any_limit = true;
      saturated("wheels/" + wheel.name, "time at its largest rate", SaturationReport::Actuator::wheel, wheel.name);
    }
    if (any_limit)
      saturated("wheels", "longest time of a wheel at its largest rate", SaturationReport::Actuator::wheel);
  }

  void thrusters() {
    for (const ThrusterSetup& thruster : problem_.robot.thrusters) {
      list_.field("thrusters/" + thruster.name + "/duty", "duty",
                  FindIn<ThrusterReport>([name = thruster.name](const CaptureResult& r) {
                    return r.thrusters ? find_item(r.thrusters->each, name, &ThrusterReport::name) : nullptr;
                  }));
    }
    list_.field("thrusters/propellant", "propellant",
                FindIn<ThrustersReport>([](const CaptureResult& r) { return r.thrusters ? &*r.thrusters : nullptr; }));
    list_.add("thrusters/plume", "s", "duration of firing with a body in the plume, over all thrusters and bodies",
              [](const StudyCase&, const CaptureResult& r) {
                double time = 0;
                for (const PlumeHazard& hazard : r.thrusters.value_or(ThrustersReport{}).hazards)
                  time += hazard.duration;
                return time;
              });
  }

  void gyros() {
    for (const MomentGyroSetup& gyro : problem_.robot.gyros)
      saturated("gyros/" + gyro.name, "time of the gimbal at its largest rate or torque",
                SaturationReport::Actuator::gyro, gyro.name);
    const FindIn<GyrosReport> all = [](const CaptureResult& r) { return r.gyros ? &*r.gyros : nullptr; };
    for (const char* key : {"largest_torque_lacking", "least_singularity_measure"})
      list_.field(std::string("gyros/") + key, key, all);
    list_.add("gyros/near_singularity", "s", "time near a singularity while a torque was commanded",
              [](const StudyCase&, const CaptureResult& r) {
                double time = 0;
                for (const SingularityHazard& hazard : r.gyros.value_or(GyrosReport{}).hazards)
                  time += hazard.duration();
                return time;
              });
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
    list_.add(where + "/saturated", "s", words, [is_meant](const StudyCase&, const CaptureResult& r) {
      double longest = r.status == CaptureStatus::completed ? 0 : NAN;
      for (const SaturationReport& s : r.saturation) {
        if (is_meant(s)) longest = std::fmax(longest, s.duration);
      }
      return longest;
    });
    list_.add(where + "/first_saturated", "s", "start of the first saturation; NaN: never",
              [is_meant](const StudyCase&, const CaptureResult& r) {
                double first = NAN;
                for (const SaturationReport& s : r.saturation) {
                  if (is_meant(s)) first = std::fmin(first, s.first_time);
                }
                return first;
              });
  }

  const CaptureProblem& problem_;
  ColumnList& list_;
};

}  // namespace

void add_motion_columns(const CaptureProblem& problem, ColumnList& list) {
  MotionColumnBuilder(problem, list).add_all();
}

}  // namespace grapnel
