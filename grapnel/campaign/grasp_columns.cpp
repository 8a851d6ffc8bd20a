// Columns of grasps: how they closed, what they hold, their impulses.
#include <algorithm>
#include <cmath>

#include "grapnel/campaign/column_list.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/verdicts.hpp"

namespace grapnel {
namespace {

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

class GraspColumnBuilder {
 public:
  GraspColumnBuilder(const CaptureProblem& problem, ColumnList& list) : problem_(problem), list_(list) {}

  void add_all() {
    for (const GraspSetup& grasp : problem_.grasps) {
      closing_columns(grasp.end_effector);
      grasp_columns(grasp.end_effector);
    }
  }

 private:
  void grasp_number(const std::string& e, const std::string& name, const char* unit, const char* description,
                    double (*get)(const GraspImpulse&)) {
    list_.add("grasps/" + e + "/" + name, unit, description, [e, get](const StudyCase&, const CaptureResult& r) {
      const FoundGrasp found = find_grasp(r, e);
      return found.grasp ? get(*found.grasp) : NAN;
    });
  }

  // Deviations of the end-effector from its grasp point at the closing time, for closed and open grasps.
  void closing_columns(const std::string& e) {
    const FindIn<GraspOutcome> outcome = [e](const CaptureResult& r) {
      return find_item(r.grasps, e, &GraspOutcome::end_effector);
    };
    const std::string grasp = "grasps/" + e + "/";
    list_.add(grasp + "captured", "1", "whether this grasp closed and was not lost",
              [outcome](const StudyCase&, const CaptureResult& r) {
                const GraspOutcome* found = outcome(r);
                return found ? double(found->captured) : NAN;
              });
    list_.field(grasp + "position_error", "distance", outcome);
    list_.field(grasp + "angle_error", "angle", outcome);
    list_.field(grasp + "closing_speed", "velocity", outcome);
    list_.field(grasp + "closing_angular_velocity", "angular_velocity", outcome);
    tolerance_columns(e);
    hold_columns(e);
  }

  // Load, slips and losses of a grasp with limits.
  void hold_columns(const std::string& e) {
    const auto grasp = std::ranges::find(problem_.grasps, e, &GraspSetup::end_effector);
    if (grasp == problem_.grasps.end() || !grasp->holds) return;
    const std::string name = "grasps/" + e + "/";
    list_.add(name + "load_used", "1", "largest load over the limits of `holds`; at 1 the grasp opens or slips",
              [e](const StudyCase&, const CaptureResult& r) {
                for (const GraspOutcome& one : r.grasps) {
                  if (one.end_effector == e && one.largest_load) return *one.largest_load;
                }
                return double(NAN);
              });
    list_.add(name + "lost", "s", "time of the first loss under load; NaN: never lost",
              [e](const StudyCase&, const CaptureResult& r) {
                const auto loss = std::ranges::find(r.losses, e, &LossReport::end_effector);
                return loss == r.losses.end() ? NAN : loss->time;
              });
    list_.add(name + "losses", "1", "number of losses under load", [e](const StudyCase&, const CaptureResult& r) {
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
    list_.add(name + "s", "1", "number of slips", [e](const StudyCase&, const CaptureResult& r) {
      return static_cast<double>(std::ranges::count(r.slips, e, &SlipReport::end_effector));
    });
    list_.add(name + "_time", "s", "onset of the first slip; NaN: it did not slip",
              [e](const StudyCase&, const CaptureResult& r) {
                const auto slip = std::ranges::find(r.slips, e, &SlipReport::end_effector);
                return slip == r.slips.end() ? NAN : slip->time;
              });
    list_.add(name + "_distance", "m", "path of the gripper relative to the target in all slips",
              sum(&SlipReport::distance));
    list_.add(name + "_angle", "rad", "the same for its rotation", sum(&SlipReport::angle));
    list_.add(name + "_energy", "J", "energy dissipated in all slips", sum(&SlipReport::energy));
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
      list_.add(std::string("grasps/") + e + "/tolerance_used/" + tolerance.name, "1",
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
    const FindIn<GraspImpulse> grasp = [e](const CaptureResult& r) { return find_grasp(r, e).grasp; };
    const auto column = [&](const std::string& name, std::string_view key) {
      list_.field("grasps/" + e + "/" + name, key, grasp);
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
      const FindIn<ForceProfile> profile = [grasp](const CaptureResult& r) -> const ForceProfile* {
        const GraspImpulse* found = grasp(r);
        return found && found->profile ? &*found->profile : nullptr;
      };
      list_.field("grasps/" + e + "/peak_force", "peak_force", profile);
    }
  }

  void normal_and_tangential(const std::string& e) {
    list_.add("grasps/" + e + "/impulse_normal", "N s",
              "part of the impulse along the outward normal of the grasp point: positive pushes the robot away",
              [e](const StudyCase& point, const CaptureResult& r) {
                const FoundGrasp found = find_grasp(r, e);
                if (!found.grasp) return double(NAN);
                const Vector3d n = outward_normal(point, found, e);
                return norm(n) > 0 ? dot(n, found.grasp->impulse) : NAN;
              });
    list_.add("grasps/" + e + "/impulse_tangential", "N s", "magnitude of the tangential impulse",
              [e](const StudyCase& point, const CaptureResult& r) {
                const FoundGrasp found = find_grasp(r, e);
                if (!found.grasp) return double(NAN);
                const Vector3d n = outward_normal(point, found, e);
                return norm(n) > 0 ? norm(found.grasp->impulse - dot(n, found.grasp->impulse) * n) : NAN;
              });
  }

  const CaptureProblem& problem_;
  ColumnList& list_;
};

}  // namespace

void add_grasp_columns(const CaptureProblem& problem, ColumnList& list) { GraspColumnBuilder(problem, list).add_all(); }

void add_speed_limits(const CaptureProblem& problem, ColumnList& list) {
  for (const GraspSetup& grasp : problem.grasps) {
    const std::string& e = grasp.end_effector;
    const FindIn<SpeedLimit> limit = [e](const CaptureResult& r) -> const SpeedLimit* {
      const FoundGrasp found = find_grasp(r, e);
      return found.impact ? find_item(found.impact->speed_limits, e, &SpeedLimit::end_effector) : nullptr;
    };
    list.field("grasps/" + e + "/speed_factor", "factor", limit);
    list.field("grasps/" + e + "/largest_speed", "largest_speed", limit);
  }
}

}  // namespace grapnel
